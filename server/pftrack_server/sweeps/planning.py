"""Planning: from a request to a plan of the library, every refusal with the field that it is about."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import prod
from typing import TypeVar, cast

from pftrack.core.model.parameters import ParameterError, declarations, flat, limit_particles
from pftrack.core.model.recipe import Footage
from pftrack.core.model.source import Kind
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own.extension import outline
from pftrack.sweep import Plan
from pftrack.sweep.axis import TRACKER, Axis, SweepError, check, parse_axis
from pftrack_server.errors import RefusedError
from pftrack_server.experiments import find_experiment
from pftrack_server.filters import FilterFiles
from pftrack_server.schemas.sweeps import SweepAxis, SweepCreate
from pftrack_server.sessions.create import footage_in
from pftrack_server.settings import Settings
from pftrack_server.store import Store

Part = TypeVar("Part")

BYTES_A_RUN = 160
"""Of the result on the disk, chunks and final file together, generously."""

MOST_CELLS = 40_000
"""Of one map: more than a screen can show, and than a page should be sent."""


def as_plan(body: SweepCreate, settings: Settings, store: Store, filters: FilterFiles) -> Plan:
    """Return the plan of a body.

    Args:
        body: What was asked for.
        settings: What is allowed.
        store: Where the recording is, if it is on one.
        filters: Files of the server's owner, which may be trackers, too.

    Raises:
        RefusedError: Something of it is unknown, out of bounds, given twice or too much, with the field.
    """
    experiment = find_experiment(body.experiment)
    own = _own_filters(filters, body)
    experiment = outline(experiment.id, own)
    footage, kind, frames = _recording(store, experiment, body)
    axes = tuple(_axis(experiment, index, axis, kind) for index, axis in enumerate(body.axes))
    if not axes and footage is None:
        raise RefusedError("A sweep needs at least one axis.", field="axes")
    names = [axis.name for axis in axes]
    for index, name in enumerate(names):
        if name in names[:index]:
            raise RefusedError(f"The axis {name} appears twice.", field=f"axes.{index}.name", value=name)
    if not body.trackers and TRACKER not in names:
        raise RefusedError("Choose at least one method.", field="trackers")
    for name in body.trackers:
        _part("trackers", partial(check, experiment, Axis(TRACKER, (name,)), kind))
    for name, value in body.parameters.items():
        if name in names:
            raise RefusedError(
                f"The parameter {name} is an axis and cannot have a fixed value as well.", field=f"parameters.{name}"
            )
        _part(f"parameters.{name}", partial(check, experiment, Axis(name, (value,)), kind))
    plan = _part(
        "axes",
        lambda: Plan(
            experiment=body.experiment,
            axes=axes,
            trackers=tuple(body.trackers),
            trials=body.trials,
            seed=body.seed,
            frames=frames,
            values=body.parameters,
            footage=footage,
            kind=kind,
            filters=own,
            outlined=True,
        ),
    )
    if body.loss_probability:
        plan = _part("loss_probability", lambda: replace(plan, loss_probability=True))
    _within_server(plan, settings)
    _within_a_map(plan)
    return plan


def _own_filters(filters: FilterFiles, body: SweepCreate) -> dict[str, tuple[str, ...]]:
    """Return the texts of the trackers that files of the server's owner make, by name."""
    varied = (value for axis in body.axes if axis.name == TRACKER for value in axis.values or ())
    try:
        return filters.texts_of(body.experiment, {*body.trackers, *varied})
    except (ValueError, OSError) as error:
        raise RefusedError(f"The file {error}.", field="trackers") from None


def _recording(store: Store, experiment: Experiment, body: SweepCreate) -> tuple[Footage | None, Kind | None, int]:
    """Return the recording of a body, its kind, and the length of a run; 0 stands for the experiment's own."""
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
        RefusedError: It has too many runs.
    """
    if plan.runs > settings.max_sweep_runs:
        raise RefusedError(
            f"A sweep on this server has at most {settings.max_sweep_runs:,} runs; this one has {plan.runs:,}.",
            field="trials",
            bound=f"at most {settings.max_sweep_runs:,} runs",
            value=plan.runs,
        )


def cells_of(plan: Plan) -> int:
    """Return how many cells the map over the plan's first two axes has."""
    return prod(len(axis.values) for axis in plan.axes[:2])


def _axis(experiment: Experiment, index: int, body: SweepAxis, kind: Kind | None) -> Axis:
    faulty = partial(_faulty_part, experiment, body, kind)
    if body.values is not None:
        axis = Axis(body.name, tuple(body.values))
        return _part(f"axes.{index}.{faulty()}", partial(check, experiment, axis, kind))
    text = f"{body.name}={_plain(body.start)}:{_plain(body.stop)}:{_plain(body.step)}"
    return _part(f"axes.{index}.{faulty()}", partial(parse_axis, experiment, text, kind))


def _faulty_part(experiment: Experiment, body: SweepAxis, kind: Kind | None) -> str:
    """Return which part of an axis is most likely the one that is wrong."""
    known = {it.name: it for it in declarations(type(experiment.parameters_on(kind)))}
    if body.name != TRACKER and body.name not in known:
        return "name"
    if body.values is not None or body.start is None or body.stop is None or not body.step:
        return "step" if body.values is None else "values"
    low, high = known[body.name].minimum, known[body.name].maximum
    for name in ("start", "stop"):
        end = getattr(body, name)
        if (low is not None and end < low) or (high is not None and end > high):
            return name
    return "step" if (body.stop - body.start) * body.step < 0 else "stop"


def _within_a_map(plan: Plan) -> None:
    """Refuse axes so long that a map over two of them could not be looked at."""
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
    """Return the library's words as a sentence; the name of a parameter is no word to begin one with."""
    first = said.partition(" ")[0]
    return f"The parameter {said}." if "_" in first else f"{said[:1].upper()}{said[1:]}."


def _plain(number: float | None) -> str:
    """Return a number as a person would type it: `0.1`, and no exponent that hides a digit."""
    return repr(int(number)) if number is not None and number == int(number) else repr(number)


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


def _part(field: str, part: Callable[[], Part]) -> Part:
    """Return a part of a plan; if the library refuses it, say so with the field."""
    try:
        return part()
    except (SweepError, ParameterError) as error:
        raise RefusedError(_sentence(str(error)), field=field) from None
