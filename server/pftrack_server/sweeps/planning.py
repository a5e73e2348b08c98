"""Planning: from a request to a plan of the library; every refusal names its field.

Every experiment has an example, a sweep worth starting unchanged, with which the form is first filled.
"""

from decimal import Decimal
from math import prod
from typing import Annotated, Any, Self, cast

from pydantic import Field, model_validator

from pftrack.core.model.parameters import NOT_BOOLEAN, Declaration, declarations, flat, limit_particles
from pftrack.core.model.recipe import Footage, Seed
from pftrack.core.model.source import Kind
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.experiments import find as find_experiment
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own.extension import outline
from pftrack.sweep import Plan
from pftrack.sweep.axis import TRACKER, Axis, AxisRange, SweepError, check
from pftrack_server.core.bodies import GivenTitle, Name, RequestBody
from pftrack_server.core.settings import Settings
from pftrack_server.sessions.create import footage_in
from pftrack_server.store import Store
from pftrack_server.store.filters import FilterFiles

Number = Annotated[float, Field(allow_inf_nan=False), NOT_BOOLEAN]


class SweepAxis(RequestBody):
    """A varied parameter: from `start` to `stop` by `step`, both ends included, or over a list of values."""

    name: Name
    start: Number | None = None
    stop: Number | None = None
    step: Number | None = None
    values: list[Any] | None = Field(None, max_length=10_000)

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        missing = [self.start, self.stop, self.step].count(None)
        if missing != (0 if self.values is None else 3):
            raise ValueError("an axis has either start, stop and step, or a list of values")
        return self


class SweepCreate(RequestBody):
    """A new sweep: an experiment over a grid of conditions."""

    experiment: Name
    title: GivenTitle | None = Field(None, description="Title; made from the plan if it is not given.")
    axes: list[SweepAxis] = Field(
        max_length=8, description="Axes; all values are combined. May be empty on a recording."
    )
    trackers: list[Name] = Field([], max_length=64, description="Trackers; all get the same seeds.")
    trials: Annotated[int, Field(ge=1, le=1_000_000), NOT_BOOLEAN] = 10
    frames: Annotated[int, Field(ge=1, le=10_000_000), NOT_BOOLEAN] | None = Field(None, description="Length of a run.")
    seed: Seed = 0
    loss_probability: bool = Field(False, description="Whether to measure the probability of a loss, too.")
    parameters: dict[Name, Any] = Field({}, description="Parameters that differ from the defaults in every run.")
    footage: Footage | None = Field(None, description="The recording of all runs; the simulated scene if not given.")
    upload: Name | None = Field(None, description="Name of the footage's upload; the footage's hash is enough, too.")


class EstimateRequest(SweepCreate):
    """A sweep whose size is requested before it starts."""

    measure: bool = Field(True, description="Whether to measure the time on a few runs, which takes some seconds.")


BYTES_A_RUN = 160
"""Generous estimate of a run's bytes on disk, chunks and final file together."""

MOST_CELLS = 40_000
"""Most cells of one map: more than a screen can show or a page should receive."""


def as_plan(body: SweepCreate, settings: Settings, store: Store, filters: FilterFiles) -> Plan:
    """Return the plan of a request's body.

    Args:
        body: The request's body.
        settings: The server's limits.
        store: Holds the recording, if there is one.
        filters: Filter files of the server's owner, which may be trackers, too.

    Raises:
        RefusedError: A field is unknown, out of bounds, given twice or too large; the error names it.
    """
    experiment = find_experiment(body.experiment)
    own = _own_filters(filters, body)
    experiment = outline(experiment.id, own)
    footage, kind, frames = _recording(store, experiment, body)
    if not body.axes and footage is None:
        raise RefusedError("A sweep needs at least one axis.", field="axes")
    if not body.trackers and TRACKER not in {axis.name for axis in body.axes}:
        raise RefusedError("Choose at least one method.", field="trackers")
    try:
        plan = Plan(
            experiment=body.experiment,
            axes=tuple(_axis(experiment, index, axis, kind) for index, axis in enumerate(body.axes)),
            trackers=tuple(body.trackers),
            trials=body.trials,
            seed=body.seed,
            frames=frames,
            values=body.parameters,
            footage=footage,
            kind=kind,
            filters=own,
            loss_probability=body.loss_probability,
            outlined=True,
        )
    except SweepError as error:
        field = error.field.replace("values.", "parameters.", 1) if error.field.startswith("values.") else error.field
        message = _sentence(str(error))
        raise RefusedError(message, field=field or "axes", bound=error.bound, value=error.value) from None
    _within_server(plan, settings)
    _within_a_map(plan)
    return plan


def _own_filters(filters: FilterFiles, body: SweepCreate) -> dict[str, tuple[str, ...]]:
    """Return the texts of the trackers from files of the server's owner, by name."""
    varied = (value for axis in body.axes if axis.name == TRACKER for value in axis.values or ())
    try:
        return filters.texts_of(body.experiment, {*body.trackers, *(name for name in varied if isinstance(name, str))})
    except (ValueError, OSError) as error:
        raise RefusedError(f"The file {error}.", field="trackers") from None


def _recording(store: Store, experiment: Experiment, body: SweepCreate) -> tuple[Footage | None, Kind | None, int]:
    """Return the recording of a body, its kind, and the length of a run; 0 for the experiment's own length."""
    found = footage_in(store, experiment, body.upload, body.footage)
    if found is None:
        return None, None, body.frames or 0
    footage, upload = found
    left = upload.frames - footage.start
    if left < 1:
        raise ParameterError("footage.start", footage.start, f"a frame of the upload, 0 to {upload.frames - 1}")
    return footage, cast("Kind", upload.kind), min(body.frames or left, left)


def within_limits(plan: Plan, settings: Settings) -> None:
    """Refuse a plan that is too much for this server.

    Raises:
        RefusedError: The plan has too many runs.
    """
    if plan.runs > settings.max_sweep_runs:
        raise RefusedError(
            f"A sweep on this server has at most {settings.max_sweep_runs:,} runs; this one has {plan.runs:,}.",
            field="trials",
            bound=f"at most {settings.max_sweep_runs:,} runs",
            value=plan.runs,
        )


def _axis(experiment: Experiment, index: int, body: SweepAxis, kind: Kind | None) -> Axis:
    """Return an axis of a body; its numbers are rounded to what a person would type: 0.3, not a neighbouring float."""
    ends = [Decimal(repr(number)) for number in (body.start, body.stop, body.step) if number is not None]
    given = AxisRange(body.name, *ends) if ends else Axis(body.name, tuple(body.values or ()))
    try:
        return check(experiment, given, kind)
    except SweepError as error:
        raise error.within(f"axes.{index}") from None


def _within_a_map(plan: Plan) -> None:
    """Refuse axes that are too long for a map over two of them."""
    longest = sorted(plan.axes, key=lambda axis: len(axis.values))[-2:]
    cells = prod(len(axis.values) for axis in longest)
    if cells > MOST_CELLS:
        raise RefusedError(
            f"A map has at most {MOST_CELLS:,} cells; {' and '.join(axis.name for axis in longest)} would make "
            f"{cells:,}.",
            field="axes",
            bound=f"at most {MOST_CELLS:,} cells",
            value=cells,
        )


def _sentence(said: str) -> str:
    """Return the library's message as a sentence that does not begin with a parameter's name."""
    first = said.partition(" ")[0]
    return f"The parameter {said}." if "_" in first else f"{said[:1].upper()}{said[1:]}."


def _within_server(plan: Plan, settings: Settings) -> None:
    """Refuse a plan in which a tracker has more particles, or a run more frames, than the server allows."""
    parameters = plan.parameters
    declared = plan.wiring.declarations(type(parameters))
    largest = {**flat(parameters), **plan.values}
    for axis in plan.axes:
        if axis.name in {declaration.name for declaration in declared if declaration.role == "particles"}:
            largest[axis.name] = max(axis.values)
    for tracker in plan.trackers:
        limit_particles(declared, largest, tracker, settings.max_particles)
    if plan.frames > settings.max_frames:
        raise ParameterError("frames", plan.frames, f"at most {settings.max_frames} on this server")


STEPS = 5


def example(experiment: Experiment) -> SweepCreate:
    """Return an example body for an experiment; without one of its own, its first two numbers are varied."""
    known = experiment.example_sweep
    if known is not None:
        return SweepCreate(
            experiment=experiment.id,
            axes=[SweepAxis(name=name, values=list(values)) for name, values in known.axes.items()],
            trackers=list(known.trackers),
            trials=known.trials,
            frames=known.frames,
        )
    every = declarations(type(experiment.simulate().parameters))
    numbers = [it for it in every if it.kind in {"integer", "number"} and it.useful]
    return SweepCreate(
        experiment=experiment.id,
        axes=[_around(it) for it in numbers[:2]],
        trackers=list(experiment.trackers)[:3],
        trials=5,
        frames=min(experiment.frames, 60),
    )


def _around(declaration: Declaration) -> SweepAxis:
    """Return an axis around a number's default, within its useful range."""
    step = declaration.step or 1.0
    low, high = declaration.useful or (0.0, 1.0)
    middle = float(declaration.default)
    start = max(low, middle - STEPS // 2 * step)
    return SweepAxis(name=declaration.name, start=start, stop=min(high, start + (STEPS - 1) * step), step=step)
