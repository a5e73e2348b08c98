"""Checks of drawings: finite, within reach, on declared layers, in declared worlds, and stable from frame to frame."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from itertools import islice, product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import Drawing, Ellipsoids, Picture, Primitive, World, WorldDrawing
from pftrack.core.model.faults import faults
from pftrack.core.model.marks import Mark
from pftrack.core.model.setup import Setup, Suitability
from pftrack.core.model.source import FrameSequence, Target
from pftrack.core.model.tracker import Step
from pftrack.core.refusal import RefusedError
from pftrack.experiments.experiment import PICTURES, Experiment
from pftrack.runs.record import save
from pftrack.runs.reproduction import load
from pftrack.runs.run import Run
from pftrack.sources.beliefs.recorder import Recorder
from pftrack.sources.sequence import open_sequence
from pftrack.sources.tracks import write
from pftrack.testing.check import FRAMES, SEED, CheckError, demand, each_tracker, straight, whole
from pftrack.testing.declarations import at_first
from pftrack.testing.numbers import FEW, demand_equal
from pftrack.vision.film import FilmWriter
from pftrack.vision.rendering import render_beside

REACH = 10.0
"""How many times the picture's longer side a coordinate may lie from its corner: anything further is an error."""

PLACES = (
    "positions",
    "centre",
    "centres",
    "half_axes",
    "origin",
    "vertices",
    "segments",
    "position",
    "apex",
    "corners",
)

ROUNDING = 1e-4
"""Tolerance, as a share of the largest entry of a covariance, because they are drawn from 32 bits."""

WORLD_REACH = 1.01
"""Largest distance of a coordinate from a world's middle, in radii; anything further is cut off."""


def _draw(experiment: Experiment, tracker: str) -> Iterator[tuple[int, Drawing]]:
    yield from enumerate(straight(experiment, tracker).drawings)


@each_tracker("a drawing holds what can be shown")
def _drawings_have_no_faults(experiment: Experiment, tracker: str) -> None:
    for frame, drawing in _draw(experiment, tracker):
        for name, clause in faults(drawing).items():
            raise CheckError(f"{name} in frame {frame} cannot be shown: {clause}")


@each_tracker("drawings keep to the picture and to declared layers")
def _drawings_are_sound(experiment: Experiment, tracker: str) -> None:
    for frame, drawing in _draw(experiment, tracker):
        _demand_sound(experiment, drawing, frame)
        if frame in {0, FRAMES - 1}:
            shape = render_beside(drawing).shape
            fits = shape == (drawing.height, max(shape[1], drawing.width), 3)
            demand(fits, f"frame {frame} is rendered to the shape {shape}")


def _demand_sound(experiment: Experiment, drawing: Drawing, frame: int) -> None:
    first = next(iter(drawing.primitives.values()), None)
    demand(isinstance(first, Picture), f"the drawing of frame {frame} must begin with the picture, got {first!r:.60}")
    demand("\n" not in drawing.caption, f"the caption of frame {frame} must be one line, got {drawing.caption!r}")
    for name, item in drawing.primitives.items():
        _demand_layer(experiment, name, item)
        if isinstance(item, Picture):
            shape = item.image_rgb.shape
            wanted = (drawing.height, drawing.width, 3)
            demand(shape == wanted, f"the picture of frame {frame} must have the shape {wanted}, got {shape}")
        _demand_finite(name, item, frame)
        most = REACH * max(drawing.width, drawing.height)
        for part, values in _places(item):
            far = float(np.abs(values).max(initial=0.0))
            demand(far <= most, f"{part} of {name} in frame {frame} must lie within {most:g} px, got {far:g} px")


def _demand_layer(experiment: Experiment, name: str, item: Primitive) -> None:
    demand(item.layer in experiment.display.shown, f"{name} is drawn on the undeclared layer {item.layer!r}")


@each_tracker("what is drawn in a world keeps to it")
def _worlds_are_sound(experiment: Experiment, tracker: str) -> None:
    for world in experiment.display.worlds:
        stated = world.name and world.title and world.unit
        demand(stated, f"the world {world.name!r} must have a name, a title and a unit")
    for frame, drawing in _draw(experiment, tracker):
        drawn = tuple(each.world for each in drawing.worlds)
        demand(
            drawn == experiment.display.worlds,
            f"the drawing of frame {frame} must have the worlds that are declared, "
            f"{_named(experiment.display.worlds)}, got {_named(drawn)}",
        )
        for each in drawing.worlds:
            _demand_within(experiment, each, frame)


def _demand_within(experiment: Experiment, drawn: WorldDrawing, frame: int) -> None:
    world = drawn.world
    for name, item in drawn.primitives.items():
        _demand_layer(experiment, name, item)
        _demand_finite(name, item, frame)
        for part, values in _places(item):
            far = float(np.linalg.norm(values - np.array(world.middle), axis=-1).max(initial=0.0))
            demand(
                far <= WORLD_REACH * world.radius,
                f"{part} of {name} in frame {frame} must lie within {world.radius:g} {world.unit} of the middle of "
                f"the world {world.name!r}, got {far:.4g} {world.unit}",
            )


def _named(worlds: tuple[World, ...]) -> str:
    return ", ".join(world.name for world in worlds) or "none"


def _places(item: Primitive) -> Iterator[tuple[str, Floats]]:
    for field in fields(item):
        if field.name in PLACES:
            yield field.name, np.asarray(getattr(item, field.name), dtype=np.float64)


def _demand_finite(name: str, item: Primitive, frame: int) -> None:
    for part, values in _places(item):
        demand(np.isfinite(values).all(), f"{part} of {name} in frame {frame} must be finite")
    if isinstance(item, Ellipsoids):
        spread = item.covariances.astype(np.float64)
        demand(np.isfinite(spread).all(), f"covariances of {name} in frame {frame} must be finite")
        least = float(np.linalg.eigvalsh(spread).min(initial=0.0))
        size = float(np.abs(spread).max(initial=0.0))
        symmetric = np.allclose(spread, np.swapaxes(spread, 1, 2), atol=ROUNDING * size)
        demand(
            symmetric and least >= -ROUNDING * size,
            f"covariances of {name} in frame {frame} must be symmetric and not negative, got the eigenvalue {least:g}",
        )


@each_tracker("what has a name in a drawing stays what it is")
def _names_are_stable(experiment: Experiment, tracker: str) -> None:
    known: dict[str, tuple[str, str]] = {}
    for frame, drawing in _draw(experiment, tracker):
        in_worlds = {
            f"{each.world.name} {name}": item for each in drawing.worlds for name, item in each.primitives.items()
        }
        for name, item in (drawing.primitives | in_worlds).items():
            is_now = type(item).__name__, item.layer
            was = known.setdefault(name, is_now)
            demand(
                is_now == was,
                f"{name} is a {is_now[0]} on the layer {is_now[1]!r} in frame {frame}, and was a {was[0]} on "
                f"{was[1]!r} before; a viewer updates by name what it already shows",
            )


@each_tracker("a drawing shows no future")
def _no_future_is_drawn(experiment: Experiment, tracker: str) -> None:
    known = straight(experiment, tracker)
    early = known.drawings[FRAMES // 2]
    late = experiment.draw(known.steps[FRAMES // 2], known.run.diagnostics)
    same = early.caption == late.caption and early.primitives.keys() == late.primitives.keys()
    same = same and np.array_equal(render_beside(early), render_beside(late))
    demand(same, f"frame {FRAMES // 2} is drawn differently once later frames are computed")


@each_tracker("a second run can be drawn beside it")
def _a_second_run_is_drawn(experiment: Experiment, tracker: str) -> None:
    run = straight(experiment, tracker).run
    there = straight(experiment, experiment.default_tracker, seed=0).run.current.diagnostics
    before = experiment.draw(run.current, run.diagnostics)
    drawing = experiment.draw(run.current, run.diagnostics, there)
    _demand_sound(experiment, drawing, FRAMES - 1)
    more = drawing.primitives.keys() - before.primitives.keys()
    demand(more, "nothing is drawn of a second run beside the first")


@each_tracker("a tracker that joins it is drawn")
def _a_joined_tracker_is_drawn(experiment: Experiment, tracker: str) -> None:
    """Draw a step of a tracker whose name and title the experiment's code does not know."""
    known = straight(experiment, tracker)
    title = experiment.trackers[tracker].title
    step = replace(known.steps[-1], tracker="joined-later", tracker_title="Joined later")
    try:
        drawn = experiment.draw(step, known.run.diagnostics)
    except Exception as error:
        raise CheckError(
            f"a step of a tracker that joins the experiment must be drawn, got {type(error).__name__}: {error}"
        ) from error
    names_it = title not in known.drawings[-1].caption or step.tracker_title in drawn.caption
    demand(names_it, f"the caption of a step must name the tracker that took it by its title, got {drawn.caption!r}")


# Checks of recordings: a film of the experiment's own scene is tracked from a mark, as an upload would be.
#
# The simulated scene is written to a small video file, its measured points to a table where tracks are taken, or its
# beliefs to a recording of beliefs. Its target is marked by each kind of mark that the experiment takes: at its true
# place, if the kind supports that (`Mark.of_target`), and else as an editor begins. The second may mark nothing that
# can be tracked; it may then be refused, but only in a sentence.

LENGTH = 2 * FRAMES // 3
"""Number of frames of the film: a run on it behaves like one on the scene, whose runs are longer."""

LATER = LENGTH // 2
"""The picture at which a run that does not begin with the film begins."""


@contextmanager
def _film(experiment: Experiment, frames: int = LENGTH) -> Iterator[tuple[FrameSequence, list[Target | None]]]:
    """Write the simulated scene to a file, and give its pictures as a decoder has them, and where the target is."""
    course = straight(experiment, experiment.default_tracker)
    run, steps = course.run, course.steps[:frames]
    targets = [step.frame.target for step in steps]
    with tempfile.TemporaryDirectory() as folder:
        if set(experiment.video.footage) & set(PICTURES):
            path = Path(folder, "scene.mp4")
            with FilmWriter(path, run.source.frame_rate_hz) as film:
                for step in steps:
                    film.write(_picture(experiment, run, step))
        elif "tracks" in experiment.video.footage:
            path = Path(folder, "scene.csv")
            path.write_text(_tracks(steps), encoding="utf-8")
        else:
            path = Path(folder, "scene.pft")
            _record(path, steps)
        sequence = open_sequence(path)
        try:
            yield sequence, targets
        finally:
            sequence.close()


def _picture(experiment: Experiment, run: Run, step: Step) -> NDArray[np.uint8]:
    """Return what a camera would see of a frame; of a scene without pictures, what is drawn in their place."""
    if step.frame.image_rgb is not None:
        return step.frame.image_rgb
    shown = experiment.draw(step, run.diagnostics).primitives.values()
    return next(item.image_rgb for item in shown if isinstance(item, Picture))


def _tracks(steps: Sequence[Step]) -> str:
    """Return the table of the points that were measured."""
    measured = [step.frame.measurements for step in steps]
    if any(one is None for one in measured):
        raise CheckError("the frames of an experiment that takes tracks must have measured points")
    points = np.array([one.points_px for one in measured if one is not None])
    sd = np.array([one.sd_px for one in measured if one is not None])
    names = [str(number) for number in range(1, points.shape[1] + 1)]
    return write(names, points, np.broadcast_to(np.square(sd).reshape(*points.shape[:2], -1), points.shape))


def _record(path: Path, steps: Sequence[Step]) -> None:
    """Write the beliefs of each frame as a recording of beliefs."""
    with Recorder(path) as record:
        for step in steps:
            arrays, target = step.state.arrays(), step.frame.target
            states = arrays.get("states")
            believed = {"particles": states, "log_weights": arrays.get("log_weights")} if states is not None else {}
            truth = None if target is None else target.position
            record(step.diagnostics.frame, **(believed or {"mean": step.state.estimate}), truth=truth)


@whole("a film of its scene is tracked from a mark")
def _a_film_is_tracked(experiment: Experiment) -> None:
    if not experiment.accepts_video:
        return
    with _film(experiment) as (sequence, targets):
        for place, (kind, start) in enumerate(product(experiment.video.marks, (0, LATER))):
            target = targets[start]
            known = None if target is None else kind.of_target(target)
            mark = known or experiment.video.mark(at_first(kind, sequence.size))
            setup = _wire(experiment, sequence, mark, start, sure=known is not None)
            if setup is not None:
                _demand_declared(experiment, setup, sequence)
                _demand_suitability(experiment, setup, sequence, f"a recording with a {kind.name()}")
                # All trackers handle a kind of mark in the same way, and some are slow.
                trackers = list(experiment.trackers) if place == 0 else []
                _demand_tracked(experiment, setup, sequence, f"a recording with a {kind.name()}", trackers, start)
        if not experiment.video.needs_mark(sequence.index.kind):
            setup = _wire(experiment, sequence, None, 0, sure=False)
            if setup is not None:
                _demand_declared(experiment, setup, sequence)
                trackers = [] if experiment.video.marks else list(experiment.trackers)
                _demand_tracked(experiment, setup, sequence, "a recording without a mark", trackers)


def _wire(
    experiment: Experiment, sequence: FrameSequence, mark: Mark | None, start: int, *, sure: bool
) -> Setup | None:
    """Return the setup of a recording, or None where the mark may be, and is, refused in a sentence."""
    what = f"a {mark.kind}" if mark else "no mark"
    try:
        return experiment.video.on_video(sequence, mark, start=start)
    except ValueError as error:
        demand(not sure, f"{what} of the scene's own target in picture {start} must be taken, and is refused: {error}")
        demand(str(error), f"{what} in a film of the scene must be refused in a sentence, got an empty {type(error)}")
        return None
    except Exception as error:
        said = f"{type(error).__name__}: {error}"
        raise CheckError(
            f"{what} in a film of the scene must be taken or refused by a ValueError, got {said}"
        ) from error


def _demand_declared(experiment: Experiment, setup: Setup, sequence: FrameSequence) -> None:
    """Demand that the parameters which plans of sweeps go by are those of the recording."""
    if experiment.video.recorded is not None:
        kind, had = sequence.index.kind, type(setup.parameters)
        declared = type(experiment.video.recorded(kind))
        demand(had is declared, f"recorded must say {had.__name__} of a {kind}, and says {declared.__name__}")


def _demand_suitability(experiment: Experiment, setup: Setup, sequence: FrameSequence, what: str) -> None:
    """Check that the experiment can rate the suitability of a target, if it declares that."""
    if experiment.video.suits is None or setup.footage is None:
        return
    try:
        found = experiment.video.suits(sequence, setup.footage, setup.parameters)
    except Exception as error:
        said = f"{type(error).__name__}: {error}"
        raise CheckError(f"the experiment must look how suitable {what} is without an error, got {said}") from error
    demand(isinstance(found, Suitability), f"what comes of looking at {what} must be a Suitability, got {found!r:.60}")
    demand(0.0 <= found.value <= 1.0, f"the suitability of {what} must lie between 0 and 1, got {found.value}")
    places = found.likelihood
    if places is not None:
        shares = places.ndim == 2 and bool(((places >= 0.0) & (places <= 1.0)).all())
        demand(shares, f"the likelihood of {what} must be (height, width) numbers from 0 to 1, got {places.shape}")
    for text in (found.remark, *found.advice):
        demand(
            text and not text.endswith("."), f"what is said of {what} must be clauses without full stops, got {text!r}"
        )


def _demand_tracked(
    experiment: Experiment,
    setup: Setup,
    sequence: FrameSequence,
    what: str,
    others: Sequence[str],
    start: int | None = None,
) -> None:
    """Go on if the default tracker tracks the whole recording, and each of the others its beginning."""
    footage = setup.footage
    if footage is None or footage.sha256 != sequence.sha256:
        raise CheckError(f"the footage of {what} must have the hash of its file, got {footage}")
    if start is not None:
        demand(footage.start == start, f"{what} must begin at picture {start}, got {footage.start}")
    length = sequence.frame_count - footage.start
    whole = Run(experiment, setup, seed=SEED)
    for tracker in dict.fromkeys((whole.tracker, *others)):
        run = whole if tracker == whole.tracker else Run(experiment, setup, tracker=tracker, seed=SEED)
        demand(run.frames == length, f"{what} has {length} pictures to track, and the run has {run.frames} frames")
        for step in run if run is whole else islice(run, LATER):
            where = f"in frame {step.diagnostics.frame} of {what} with the tracker {tracker}"
            finite = np.isfinite(step.diagnostics.estimate).all()
            demand(finite, f"the estimate {where} is {step.diagnostics.estimate}")
            for name, clause in faults(experiment.draw(step, run.diagnostics)).items():
                raise CheckError(f"{name} {where} cannot be shown: {clause}")
    _demand_reopened(whole, sequence, what)


def _demand_reopened(run: Run, sequence: FrameSequence, what: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "run.pft")
        save(run, path)
        try:
            again = load(path, open_sequence=lambda _: sequence)
        except RefusedError as error:
            raise CheckError(f"a saved run on {what} must open again: {error}") from None
    again.seek(FEW)
    demand_equal(run, again, f"a saved run on {what}", FEW + 1)
