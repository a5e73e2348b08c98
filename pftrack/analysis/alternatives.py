"""Alternatives: the changes that are tried on a run, one at a time, found by the roles of its parameters."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from pftrack.core.model.parameters import Declaration, Parameters, Role, Value, revise
from pftrack.core.model.recipe import parameter_values
from pftrack.core.refusal import ParameterError
from pftrack.runs.run import Run

Kind: TypeAlias = Literal[
    "seeds", "particles", "tracker", "resampling", "noise", "sharpness", "threshold", "memory", "world"
]
"""The subject of a change: only the seeds, the tracker, or a parameter with a role."""

KINDS: tuple[Kind, ...] = get_args(Kind)
"""In the order in which they are tried."""

FACTORS: Mapping[Role, tuple[float, ...]] = {
    "particles": (4.0, 0.25),
    "noise": (2.0, 0.5),
    "sharpness": (2.0, 0.5),
    "threshold": (2.0, 0.5),
    "memory": (2.0, 0.5),
    "world": (0.5, 2.0),
    "resampling": (0.5,),
}
"""Factors by which a parameter with a role is multiplied."""


@dataclass(frozen=True, slots=True, eq=False)
class Alternative:
    """One change of a run.

    Attributes:
        kind: Its subject.
        title: In words, such as "Particles 800 to 3,200".
        values: By parameter name; `tracker` names a tracker. Empty where nothing but the seeds is changed.
        parameter: Name of the one parameter that is changed; empty if none is.
    """

    kind: Kind
    title: str
    values: Mapping[str, Value]
    parameter: str = ""


BASELINE = Alternative("seeds", "Same settings, other seeds", {})


Allow: TypeAlias = Callable[[str, Parameters], bool]
"""(name of a tracker, parameters) -> whether that may be computed, such as by a limit on particles."""


def allow_all(tracker: str, parameters: Parameters) -> bool:
    """Allow everything within the bounds of the parameters."""
    del tracker, parameters
    return True


def alternatives(run: Run, frame: int, *, allow: Allow = allow_all) -> tuple[Alternative, ...]:
    """Return what is tried in place of what a run did from a frame on, the unchanged settings first.

    A parameter that the tracker does not read is left out, as is one that cannot change in the middle of a run, or
    whose value lies at its bound already.

    Args:
        run: The run.
        frame: The first frame that is computed otherwise.
        allow: Limits of the computation.
    """
    parameters, tracker = run.parameters_at(frame), run.tracker_at(frame)
    found = [BASELINE, *_trackers(run, tracker)]
    for declared in run.experiment.declarations(type(parameters)):
        if declared.live and (not declared.trackers or tracker in declared.trackers):
            found += _changes(declared, getattr(parameters, declared.name))
    usable = (each for each in found if _is_allowed(each, tracker, parameters, allow))
    return tuple(sorted(usable, key=lambda each: KINDS.index(each.kind)))


def _is_allowed(each: Alternative, tracker: str, parameters: Parameters, allow: Allow) -> bool:
    try:
        return allow(str(each.values.get("tracker", tracker)), revise(parameters, parameter_values(each.values)))
    except ParameterError:  # at odds with another value, as a lower limit above an upper one
        return False


def _trackers(run: Run, mine: str) -> Iterator[Alternative]:
    for name, tracker in run.experiment.trackers.items():
        if name != mine:
            yield Alternative("tracker", f"Tracker {tracker.title}", {"tracker": name})


def _changes(declared: Declaration, value: Value) -> Iterator[Alternative]:
    """Yield the changes of one parameter."""
    if declared.role not in FACTORS:
        return
    others: list[Value]
    match declared.kind:
        case "choice":
            others = [choice for choice in declared.choices if choice != value]
        case "integer" | "number" if isinstance(value, int | float):
            others = [_times(declared, value, factor) for factor in FACTORS[declared.role]]
        case _:
            return
    for other in dict.fromkeys(others):
        if other != value:
            title = f"{declared.title} {_words(declared, value)} to {_words(declared, other)}"
            yield Alternative(_kind(declared.role), title, {declared.name: other}, declared.name)


def _kind(role: Role) -> Kind:
    return next(kind for kind in KINDS if kind == role)


def _times(declared: Declaration, value: float, factor: float) -> Value:
    """Multiply a value, within its bounds.

    A share that is kept from frame to frame, whose bound is 1, is a memory of 1 / (1 - share) frames; these frames are
    multiplied. A memory that never ends is halved as a share.
    """
    low, high = declared.minimum, declared.maximum
    if declared.role == "memory" and high == 1.0 and value < 1.0:
        changed = 1.0 - (1.0 - value) / factor
    else:
        changed = value * factor
    # Twelve digits leave 0.3 and not 0.30000000000000004, as a slider would.
    rounded = float(f"{changed if low is None or high is None else min(max(changed, low), high):.12g}")
    return round(rounded) if declared.kind == "integer" else rounded


def _words(declared: Declaration, value: Value) -> str:
    if not isinstance(value, int | float):
        return str(value)
    text = f"{value:,}" if isinstance(value, int) else f"{value:.4g}"
    return f"{text} {declared.unit}".strip()
