"""Parameters, declared once.

Each parameter is a field of a `Parameters` model, with title, unit, bounds, step, default, one sentence of help, and
whether it may change during a run. Sliders, the REST schema, command-line options, sweep axes and the documentation are
generated from this declaration. All values pass through `revise`, which refuses an invalid one with a message that
names the field, the bound and the value.
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
"""The meaning of a parameter for general code, which does not know its name.

- "particles": a number of particles; limits on particles apply, and plots may show cost over it.
- "threshold": a threshold of a series, drawn in the plot of that series.
- "noise": assumed noise of the target's motion or of a measurement: a deviation, a variance or a bound.
- "memory": how long a tracker keeps past information: a share kept from frame to frame, or a number of frames.
- "smoothing": the number of later frames that revise an earlier one; it does not change the filtered estimates, and so
  neither saves nor loses a target.
- "sharpness": how much more likely a good match is than a poor one.
- "resampling": how or when to resample.
- "world": a property of the scene, not of the tracker, such as the width of an occluder or the light.
- "loss_share": the share of a run's frames that may be lost in a success.
- "drawing": only changes the drawing; it takes effect at once, also in computed frames.
"""


LONGEST_FILE = 100_000
"""Most characters of a file as a parameter's value, which every recipe includes."""


def _refuse_boolean(value: object) -> object:
    if isinstance(value, bool):
        raise ValueError("Input should be a number, not true or false")  # noqa: TRY004 - what pydantic takes up
    return value


NOT_BOOLEAN = BeforeValidator(_refuse_boolean)
"""Last item in the annotation of a number: the `true` of JSON is not 1."""


Within: TypeAlias = tuple[float, float, float]
"""Smallest and largest value of a number, and the step of its slider."""


class Declaration(BaseModel):
    """The declaration of one parameter for page, command line and documentation.

    A number may have any value from `minimum` to `maximum`; its slider covers the `useful` range.
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
        """Title with unit, the label of a control."""
        return f"{self.title} ({self.unit})" if self.unit else self.title

    @computed_field  # type: ignore[prop-decorator]
    @property
    def hint(self) -> str:
        """Description, bounds, and whether a change restarts the run."""
        unit = f" {self.unit}" if self.unit else ""
        bounds = "" if self.minimum is None else f"From {self.minimum:g} to {self.maximum:g}{unit}."
        return " ".join(filter(None, (self.description, bounds, "" if self.live else "A change restarts the run.")))


def _on_one_line(schema: dict[str, Any]) -> None:
    for field in schema.get("properties", {}).values():
        if "description" in field:
            field["description"] = " ".join(field["description"].split())


class Parameters(BaseModel):
    """Base of all parameter models: immutable, without unknown names, with finite numbers only.

    The class statement sets common attributes of its own fields; a field may override them.

        class MotionParameters(Parameters, group="Motion model", trackers=MODELLED): ...

    Attributes of the class statement:
        group: Heading of the fields in a panel.
        trackers: Trackers that read the fields; empty means all.
        constants: Former parameters with their only present values, which old recipes may name.
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
        """Apply the attributes of the class statement to the fields of this class, not to inherited ones."""
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
        """Return a stored hash, because a run looks up its parameters in caches in every frame."""
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
        default: Initial value.
        title: Title in sentence case.
        description: Effect in one sentence (default: the docstring below the field).
        unit: Unit as shown with the value; empty for a pure number.
        within: Smallest and largest value of a number, and the step of its slider.
        useful: Range of a number's slider (default: all allowed values).
        colour: Whether the text is a colour, `#rrggbb`.
        live: Whether a change may take effect during a run.
        group: Heading in a panel (default: that of the class).
        trackers: Trackers that read the parameter (default: those of the class); empty means all.
        role: Meaning for general code.
        threshold_of: For a "threshold", the name of the series that it limits.
        sets: For "particles", the largest number of sets of this size in a tracker, such as one for each feature.
        accept: For the text of a small file, the suffix of such files with the dot.

    Raises:
        ValueError: A number has no bounds, or its useful range exceeds them or excludes the default; or the role and
            `threshold_of` contradict each other.
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
    """Return the declarations of all fields of a parameter model, in order."""
    return tuple(_declaration(model, name) for name in model.model_fields)


def with_role(model: type[Parameters], role: Role) -> tuple[Declaration, ...]:
    """Return the declarations of the fields with a role, in order."""
    return tuple(declaration for declaration in declarations(model) if declaration.role == role)


def limit_particles(declared: Iterable[Declaration], values: Mapping[str, Any], tracker: str, most: int) -> None:
    """Refuse values with which a tracker would have too many particles.

    The product counts: a tracker with a set of particles for each feature holds all sets at once. Numbers of particles
    for other trackers do not count.

    Args:
        declared: The declarations with their readers.
        values: All values in force, by name.
        tracker: Name of the tracker.
        most: Largest number of particles.

    Raises:
        ParameterError: A number of particles is too large.
    """
    for each in declared:
        is_read = not each.trackers or tracker in each.trackers
        if each.role == "particles" and is_read and values[each.name] * each.sets > most:
            raise ParameterError(each.name, values[each.name], f"at most {most // each.sets} on this server")


def read_particles(declared: Iterable[Declaration], values: Mapping[str, Any], tracker: str) -> int:
    """Return the number of particles of a tracker with one set; 0 for a tracker without particles."""
    read = (each for each in declared if each.role == "particles" and (not each.trackers or tracker in each.trackers))
    return next((int(values[each.name]) for each in read), 0)


def parse(model: type[Parameters], name: str, text: str) -> Value:
    """Read a parameter's value from a command line.

    Raises:
        ParameterError: The name is unknown, or the text is not a value of its kind.
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
    """Return a validated copy with some values changed.

    Args:
        current: The parameters in force.
        changes: New values by name.

    Raises:
        ParameterError: A name is unknown, or a value is of the wrong kind, out of bounds or contradicts another.
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
    """Move finite numbers into their bounds and onto their steps, for example after a drag in a figure.

    Other values and unknown names stay, so that `revise` refuses them.
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
    """Return the allowed values of a parameter in words: "a finite number between 0 and 640 px"."""
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
    # A step such as 0.1 is not exact in binary: twelve digits give 0.3 and not 0.30000000000000004.
    on_step = float(f"{low + step * round((value - low) / step):.12g}")
    within = min(max(on_step, low), high)
    return round(within) if declared.kind == "integer" else within
