"""Which target of a recording is looked at, and which components of its state."""

from pftrack.core.model.parameters import Parameters, parameter

__all__ = ["GROUP", "SelectionParameters"]

GROUP = "Selection"


class SelectionParameters(Parameters):
    """What the run's estimate and error are of."""

    # fmt: off
    selected_target: int = parameter(
        -1, "Selected target", "Number of the target that is looked at, as the file has it; -1 for the one that is "
        "followed longest.",
        ge=-1, le=1_000_000, step=1, live=False, group=GROUP)
    component_across: int = parameter(
        0, "Component across", "Which component of the state is drawn across, from 0; the first of the estimate.",
        ge=0, le=399, step=1, live=False, group=GROUP)
    component_down: int = parameter(
        1, "Component down", "Which component of the state is drawn downwards, or upwards where there is no picture; "
        "the second of the estimate.",
        ge=0, le=399, step=1, live=False, group=GROUP)
    # fmt: on
