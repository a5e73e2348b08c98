"""Parameters, declared once.

Everything that a person can turn is a field of a `Parameters` model: its title, unit, bounds, step, default, one
sentence of help, and whether it may change while a run is going on. Sliders, the REST schema, command-line options,
sweep axes and the documentation are all generated from that one declaration, and every value enters through one door,
`revise`, which refuses what is wrong with a sentence that names the field, the bound and the value.
"""

import math
from collections.abc import Iterable, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar, Literal, TypeAlias, TypeVar, Unpack, get_args, get_origin

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, TypeAdapter, ValidationError, computed_field
from pydantic.fields import FieldInfo

from pftrack.core.refusal import ParameterError, first_problem

Value: TypeAlias = bool | int | float | str

Role: TypeAlias = Literal[
    "",
    "particles",
    "threshold",
    "noise",
    "memory",
    "smoothing",
    "sharpness",
    "resampling",
    "world",
    "loss_share",
    "drawing",
]
"""What general code may know of a parameter without knowing its name.

- "particles": a number of particles; limits on particles hold for it, and a cost may be plotted over it.
- "threshold": a limit of the series that the parameter is a threshold of; it is drawn beside that series.
- "noise": how far a tracker takes the target, or a measurement, to stray: a deviation, a variance or a bound.
- "memory": how long a tracker holds on to what was: a share kept from frame to frame, or a number of frames.
- "smoothing": how many later frames an earlier one is reconsidered by; a change of it changes no estimate of a frame
  that is made when the frame is seen, and so neither saves nor loses a target.
- "sharpness": how much more likely a good match is than a poor one.
- "resampling": how or when particles are drawn anew.
- "world": of the scene and not of the tracker: how hard it is, such as the width of an occluder or the light.
- "loss_share": the share of a run's frames that may be lost in a success.
- "drawing": what is drawn and nothing else; a change of it shows at once, also of a frame that is computed already.
"""


LONGEST_FILE = 100_000
"""Characters of a file that is a parameter's value: it travels with every recipe."""


def _refuse_boolean(value: object) -> object:
    if isinstance(value, bool):
        raise ValueError("Input should be a number, not true or false")  # noqa: TRY004 - what pydantic takes up
    return value


NOT_BOOLEAN = BeforeValidator(_refuse_boolean)
"""In the annotation of a number, as the last of it: the `true` of JSON is not 1."""


Within: TypeAlias = tuple[float, float, float]
"""The smallest and the largest value of a number, and the step of its slider."""


class Declaration(BaseModel):
    """Everything about one parameter that the page, the command line and the documentation need.

    A number may be anything from `minimum` to `maximum`; its sliders cover the `useful` range.
    """

    model_config = ConfigDict(frozen=True)

    name: str
    title: str
    description: str
    unit: str
    kind: Literal["integer", "number", "boolean", "choice", "colour", "file"]
    default: Value
    minimum: float | None = None
    maximum: float | None = None
    step: float | None = None
    useful: tuple[float, float] | None = None
    choices: tuple[str, ...] = ()
    live: bool = True
    group: str = ""
    trackers: tuple[str, ...] = ()
    role: Role = ""
    threshold_of: str = ""
    sets: int = 1
    accept: str = ""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def label(self) -> str:
        """Its title with its unit, as a control is called."""
        return f"{self.title} ({self.unit})" if self.unit else self.title

    @computed_field  # type: ignore[prop-decorator]
    @property
    def hint(self) -> str:
        """What it does, between which bounds, and whether a change restarts the run."""
        unit = f" {self.unit}" if self.unit else ""
        bounds = "" if self.minimum is None else f"From {self.minimum:g} to {self.maximum:g}{unit}."
        return " ".join(filter(None, (self.description, bounds, "" if self.live else "A change restarts the run.")))


def _on_one_line(schema: dict[str, Any]) -> None:
    for field in schema.get("properties", {}).values():
        if "description" in field:
            field["description"] = " ".join(field["description"].split())


class Parameters(BaseModel):
    """Base of all parameter models: immutable, closed to unknown names, finite numbers only.

    A class names what its own fields have in common; a field may say otherwise.

        class MotionParameters(Parameters, group="Motion model", trackers=MODELLED): ...

    Attributes of the class statement:
        group: The heading under which a panel shows the fields.
        trackers: The trackers that read them; empty means all.
        constants: Former parameters and the only values that they have now, which old recipes may name.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True, json_schema_extra=_on_one_line
    )

    constants: ClassVar[Mapping[str, Value]] = {}

    def __init_subclass__(
        cls,
        *,
        group: str = "",
        trackers: tuple[str, ...] = (),
        constants: Mapping[str, Value] = MappingProxyType({}),
        **config: Unpack[ConfigDict],
    ) -> None:
        """Give the fields of a class what it declares for all of them; inherited ones have that of their own class."""
        super().__init_subclass__(**config)
        cls.constants = dict(constants)
        for base in cls.__bases__:
            cls.constants = {**getattr(base, "constants", {}), **cls.constants}
        for field in vars(cls).values():
            said = field.json_schema_extra if isinstance(field, FieldInfo) else None
            if isinstance(said, dict):
                said.setdefault("group", group)
                said.setdefault("trackers", list(trackers))

    def __hash__(self) -> int:
        """Hash once: a run looks its parameters up in caches in every frame."""
        known = self.__dict__.get("_hash")
        if known is None:
            known = hash((type(self), *(self.__dict__[name] for name in type(self).model_fields)))
            self.__dict__["_hash"] = known
        return int(known)


P = TypeVar("P", bound=Parameters)


def parameter(
    default: Value,
    title: str,
    description: str = "",
    *,
    unit: str = "",
    within: Within | None = None,
    useful: tuple[float, float] | None = None,
    colour: bool = False,
    live: bool = True,
    group: str | None = None,
    trackers: tuple[str, ...] | None = None,
    role: Role = "",
    threshold_of: str = "",
    sets: int = 1,
    accept: str = "",
) -> Any:  # noqa: ANN401 - what a pydantic field declaration is to a type checker
    """Declare one field of a `Parameters` model.

    Args:
        default: The value that a run starts with.
        title: What a slider is called, in sentence case.
        description: One sentence on what it does; the docstring below the field if not given.
        unit: The unit as printed beside the value; empty for a pure number.
        within: Of a number, the smallest and the largest value allowed, and the slider's step.
        useful: Of a number, from where to where its slider goes; all that is allowed if not given.
        colour: Whether the text is a colour, `#rrggbb`.
        live: Whether a change may take effect in the middle of a run.
        group: The heading under which a panel shows it, if it is not that of the class.
        trackers: The trackers that read it, if not those of the class; empty means all.
        role: What general code may do with it.
        threshold_of: Of a "threshold", the name of the series that it limits.
        sets: Of "particles", how many sets of this size a tracker has at most, such as one for each feature.
        accept: Of a text that is the content of a small file, the suffix of such files, with the dot.

    Raises:
        ValueError: A number has no bounds or a useful range beyond them or without the default, a threshold names no
            series, or another role names one.
    """
    if (role == "threshold") != bool(threshold_of):
        raise ValueError(f"a threshold and no other role names a series, got role {role!r} of {threshold_of!r}")
    if isinstance(default, int | float) and not isinstance(default, bool) and within is None:
        raise ValueError(f"the number {title!r} must be declared with bounds: within=(least, most, step)")
    low, high, step = within or (None, None, None)
    useful = useful or (within and within[:2])
    if within and useful and not within[0] <= useful[0] <= float(default) <= useful[1] <= within[1]:
        raise ValueError(
            f"the useful range of {title!r} must lie within {low:g} to {high:g} and hold the default, {default}, "
            f"got {useful[0]:g} to {useful[1]:g}"
        )
    declared: dict[str, Any] = {
        "title": title,
        "description": description or None,
        "default": default,
        "unit": unit,
        "minimum": low,
        "maximum": high,
        "step": step,
        "useful": useful,
        "colour": colour,
        "live": live,
        "group": group,
        "trackers": trackers,
        "role": role,
        "threshold_of": threshold_of,
        "sets": sets,
        "accept": accept,
    }
    pattern, longest = r"^#[0-9a-fA-F]{6}$" if colour else None, LONGEST_FILE if accept else None
    said = {name: value for name, value in declared.items() if value is not None}
    return Field(default, ge=low, le=high, pattern=pattern, max_length=longest, json_schema_extra=said)


@cache
def declarations(model: type[Parameters]) -> tuple[Declaration, ...]:
    """Return the declaration of every field of a parameter model, in order."""
    return tuple(_declaration(model, name) for name in model.model_fields)


def with_role(model: type[Parameters], role: Role) -> tuple[Declaration, ...]:
    """Return the declarations of the fields that have a role, in order."""
    return tuple(declaration for declaration in declarations(model) if declaration.role == role)


def limit_particles(declared: Iterable[Declaration], values: Mapping[str, Any], tracker: str, most: int) -> None:
    """Refuse values with which a tracker would hold more particles than are allowed.

    What counts is the product: a tracker with a set of particles for each feature holds all of them at once. Numbers of
    particles that another tracker reads do not count.

    Args:
        declared: The declarations, with all that read them.
        values: All values in force, by name.
        tracker: Name of the tracker.
        most: How many particles are allowed.

    Raises:
        ParameterError: A number of particles is too large.
    """
    for each in declared:
        is_read = not each.trackers or tracker in each.trackers
        if each.role == "particles" and is_read and values[each.name] * each.sets > most:
            raise ParameterError(each.name, values[each.name], f"at most {most // each.sets} on this server")


def read_particles(declared: Iterable[Declaration], values: Mapping[str, Any], tracker: str) -> int:
    """Return how many particles a tracker with one set of them has; 0 for one without."""
    read = (each for each in declared if each.role == "particles" and (not each.trackers or tracker in each.trackers))
    return next((int(values[each.name]) for each in read), 0)


def parse(model: type[Parameters], name: str, text: str) -> Value:
    """Read a parameter's value from text, as a command line gives it.

    Raises:
        ParameterError: The name is unknown or the text is no value of its kind.
    """
    known = {declaration.name: declaration for declaration in declarations(model)}
    if name not in known:
        raise ParameterError(name, text, f"one of {', '.join(sorted(known))}")
    kind: Any = model.model_fields[name].annotation
    try:
        return TypeAdapter[Value](kind).validate_python(text)
    except ValidationError:
        raise ParameterError(name, text, describe_allowed(known[name])) from None


def revise(current: P, changes: Mapping[str, object]) -> P:
    """Return a copy with some values changed, validated as a whole.

    Args:
        current: The parameters in force.
        changes: New values by name.

    Raises:
        ParameterError: A name is unknown, or a value is of the wrong kind, out of bounds or at odds with another.
    """
    model = type(current)
    known = {declaration.name: declaration for declaration in declarations(model)}
    for name, value in changes.items():
        if name in known and isinstance(value, bool) and known[name].kind in {"integer", "number"}:
            raise ParameterError(name, value, describe_allowed(known[name]))
        if name not in {*known, *model.constants}:
            raise ParameterError(name, value, f"the value of a known parameter ({', '.join(sorted(known))})")
        if name not in known and value != model.constants[name]:
            raise ParameterError(name, value, f"{model.constants[name]}: it is a constant now")
    values = {**flat(current), **{name: value for name, value in changes.items() if name in known}}
    try:
        return model.model_validate(values, strict=False)
    except ValidationError as error:
        first = first_problem(error.errors())
        name = str(first["loc"][0])
        raise ParameterError(name, first["input"], describe_allowed(known[name])) from None


def nearest(model: type[Parameters], values: Mapping[str, object]) -> dict[str, object]:
    """Bring finite numbers within their bounds and onto their steps, as where a line was dragged in a figure.

    What is no number, or of no parameter, is left as it is for `revise` to refuse.
    """
    known = {declaration.name: declaration for declaration in declarations(model)}
    return {name: _nearest(known[name], value) if name in known else value for name, value in values.items()}


def flat(parameters: Parameters) -> dict[str, Value]:
    """Return the values by name."""
    return {name: parameters.__dict__[name] for name in type(parameters).model_fields}


def _declaration(model: type[Parameters], name: str) -> Declaration:
    field = model.model_fields[name]
    said = field.json_schema_extra
    if not isinstance(said, dict):
        raise TypeError(f"{model.__name__}.{name} must be declared with parameter()")
    choices = get_args(field.annotation) if get_origin(field.annotation) is Literal else ()
    kinds = {bool: "boolean", int: "integer", float: "number"}
    special = {"choice": choices, "colour": said["colour"], "file": said["accept"]}
    kind = next((name for name, holds in special.items() if holds), None) or kinds[field.annotation]  # type: ignore[index]
    described = {"description": " ".join((field.description or "").split()), **said}
    return Declaration.model_validate({**described, "name": name, "kind": kind, "choices": choices})


def describe_allowed(declaration: Declaration) -> str:
    """Return in words what a parameter may be, as messages say it: "a finite number between 0 and 640 px"."""
    unit = f" {declaration.unit}" if declaration.unit else ""
    match declaration.kind:
        case "boolean":
            return "true or false"
        case "colour":
            return "a colour as #rrggbb"
        case "choice":
            return f"one of {', '.join(declaration.choices)}"
        case "file":
            return f"the text of a file {declaration.accept} of at most {LONGEST_FILE} characters, or nothing"
        case kind:
            noun = "a finite number" if kind == "number" else "a whole number"
            return f"{noun} between {declaration.minimum:g} and {declaration.maximum:g}{unit}"


def _nearest(declared: Declaration, value: object) -> object:
    if declared.kind not in {"integer", "number"} or isinstance(value, bool) or not isinstance(value, int | float):
        return value
    low, high, step = declared.minimum, declared.maximum, declared.step
    if low is None or high is None or step is None or not math.isfinite(value):
        return value
    # A step such as 0.1 is none in binary: twelve digits leave 0.3 and not 0.30000000000000004.
    on_step = float(f"{low + step * round((value - low) / step):.12g}")
    within = min(max(on_step, low), high)
    return round(within) if declared.kind == "integer" else within
