"""Runs: one source folded through one tracker.

A run is a seed and a timeline of parameter changes; everything else follows from them.

    state_t = step(state_{t-1}, frame_t, parameters_t, random numbers of (seed, t))

This recursion is pure, so a run can resume at any frame: it keeps complete states at keyframes, and `seek` restores the
nearest one and repeats the few steps from there, with the same numbers. A parameter change takes effect in the next
frame. The past never changes; a change to it makes a `branch`.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from pftrack.core.entry_points import PRESENTERS, load
from pftrack.core.model.band import Finding
from pftrack.core.model.drawing import drawn_particles
from pftrack.core.model.measures import evaluate
from pftrack.core.model.parameters import flat, read_particles, with_role
from pftrack.core.model.recipe import LONGEST_RUN, Change, Move, Recipe, Timeline
from pftrack.core.model.setup import Exported, Setup
from pftrack.core.model.source import Frame
from pftrack.core.model.tracker import Diagnostics, Step, Tracker, TrackState, diagnose
from pftrack.core.numerics.random import LARGEST_KEY, LARGEST_SEED, Purpose, Stream
from pftrack.core.refusal import ConflictError, ParameterError
from pftrack.experiments.experiment import Experiment
from pftrack.runs.checkpoint import Checkpoint, Keyframes
from pftrack.runs.loss import judge_state
from pftrack.runs.record import save
from pftrack.runs.scoring import Summary, estimates_hash, evaluated_run, measurements, summarise
from pftrack.runs.table import dataset_of, table_of

if TYPE_CHECKING:
    import pyarrow as pa

    from pftrack.analysis.explanation import Explanation


class Run:
    """A source tracked frame by frame, with its past kept.

    Attributes:
        explained: The last explanation with changes that would have saved the run; None if there is none for its state.
    """

    def __init__(
        self,
        experiment: Experiment,
        setup: Setup,
        *,
        tracker: str | None = None,
        seed: int = 0,
        frames: int | None = None,
        timeline: Iterable[Change] = (),
    ) -> None:
        """Set up a run and compute frame 0.

        Args:
            experiment: The wiring.
            setup: The source, as `experiment.simulate()` or `experiment.on_video(...)` gives it.
            tracker: Name of the tracker at frame 0.
            seed: Random seed, 0..2**53-1; files of earlier versions may have a larger one.
            frames: Length of the run (default: that of the recording, or the experiment's own for a simulated scene).
            timeline: Changes in ascending order of frames; those of frame 0 are the initial values.

        Raises:
            ParameterError: A parameter is unknown, or a value, the length or the seed is out of bounds.
        """
        self.setup = setup
        self.seed = _check_seed(seed)
        self.timeline = Timeline.begin(
            setup.parameters, tracker or experiment.default_tracker, tuple(experiment.trackers), timeline
        )
        begun = self.parameters_at(0)
        self.experiment = experiment if setup.units is None else experiment.with_units(setup.units(begun))
        self.source = setup.open_source(seed, begun)
        self.frames = _check_length(frames, self.source.frame_count, experiment.frames)
        self._check_moves(self.timeline)
        self.diagnostics: list[Diagnostics] = []
        self.explained: Explanation | None = None
        self._keyframes = Keyframes()
        self._declared = {series.name: series for series in self.experiment.all_series()}
        self.current = self._compute(0, None)

    @classmethod
    def from_recipe(cls, recipe: Recipe, experiment: Experiment, setup: Setup) -> "Run":
        """Return the run of a recipe, at its frame 0.

        Args:
            recipe: The recipe.
            experiment: The experiment that the recipe names.
            setup: The source that the recipe names.

        Raises:
            ParameterError: A parameter is unknown, or a value or the length is out of bounds.
        """
        return cls(
            experiment,
            setup,
            tracker=recipe.tracker,
            seed=recipe.seed,
            frames=recipe.frames,
            timeline=recipe.changes(flat(setup.parameters)),
        )

    @property
    def recipe(self) -> Recipe:
        """The recipe that reproduces this run."""
        # Not validated again: a file of an earlier version may have a seed beyond today's bound.
        return Recipe.model_construct(
            experiment=self.experiment.id,
            tracker=self.tracker,
            seed=self.seed,
            frames=self.frames,
            timeline=self.timeline.changes,
            footage=self.setup.footage,
            filters=dict(self.experiment.filters),
        )

    @property
    def tracker(self) -> str:
        """Name of the tracker at frame 0."""
        return self.timeline.tracker_at(0)

    @property
    def position(self) -> int:
        """Frame of the current step."""
        return self.current.diagnostics.frame

    @property
    def computed(self) -> int:
        """The furthest frame computed so far."""
        return len(self.diagnostics) - 1

    def parameters_at(self, frame: int) -> Any:  # noqa: ANN401 - the experiment's own model
        """Return the parameters in force in a frame."""
        return self.timeline.parameters_at(frame)

    def tracker_at(self, frame: int) -> str:
        """Return the name of the tracker that computes a frame."""
        return self.timeline.tracker_at(frame)

    def seed_at(self, frame: int) -> int:
        """Return the tracker's random seed in a frame: the run's own unless a change replaced it."""
        changed = self.timeline.seed_at(frame)
        return self.seed if changed is None else changed

    def advance(self) -> Step:
        """Compute the next frame and return it.

        Raises:
            ConflictError: The current frame is the last.
        """
        if self.position + 1 >= self.frames:
            raise ConflictError(f"the run ends at frame {self.frames - 1}")
        self.current = self._compute(self.position + 1, self.current.state)
        return self.current

    def __iter__(self) -> Iterator[Step]:
        """Yield the current step and all further ones."""
        yield self.current
        while self.position + 1 < self.frames:
            yield self.advance()

    def finish(self) -> Step:
        """Compute all frames and return the last step."""
        return self.seek(self.frames - 1)

    def seek(self, frame: int) -> Step:
        """Go to a past or future frame; its numbers do not depend on the way there.

        Raises:
            ParameterError: The run has no such frame.
        """
        for _ in self.seeking(frame):
            pass
        return self.current

    def seeking(self, frame: int) -> Iterator[Step]:
        """Go to a frame as `seek` does, yielding each step so that the caller can do other work in between.

        Raises:
            ParameterError: The run has no such frame.
        """
        if not 0 <= frame < self.frames:
            raise ParameterError("frame", frame, f"a whole number between 0 and {self.frames - 1}")
        if frame < self.position or self._keyframes.latest(frame)[0] > self.position:
            index, state = self._keyframes.latest(frame)
            self.current = self._recall_step(index, state)
            yield self.current
        while self.position < frame:
            yield self.advance()

    def replay(self, first: int, last: int) -> Iterator[Step]:
        """Yield earlier steps, recomputed from the kept states; the position of the run stays.

        Args:
            first: The first frame, 0..last.
            last: The last, at most the furthest frame computed.

        Raises:
            ParameterError: Some of these frames have not been computed.
        """
        if not 0 <= first <= last <= self.computed:
            raise ParameterError("frame", first, f"a whole number between 0 and {self.computed}, and the last after it")
        index, state = self._keyframes.latest(first)
        step = self.current if index < self.position <= first else self._recall_step(index, state)
        while True:
            if step.frame.index >= first:
                yield step
            if step.frame.index == last:
                return
            step = self._compute(step.frame.index + 1, step.state)

    def change(self, values: Mapping[str, object]) -> Change:
        """Change parameters from the next frame on; a drawing parameter also changes past frames and the last one.

        Args:
            values: New values by name. `tracker` names the tracker that takes over from the present state, `seed` sets
                its random seed. `move` puts one particle of the present state, or all of them, elsewhere before the
                next frame: {"particle": 7, "place": (312, 140)}, or the place alone for the estimate.

        Returns:
            The change as the timeline records it.

        Raises:
            ConflictError: The current frame is in the past or is the last, or a value cannot change in mid-run.
            ParameterError: A value is unknown or out of bounds; nothing has changed.
        """
        following = self.position + 1
        if self.is_only_drawn(values):
            following = min(following, self.frames - 1)
        elif self.position < self.computed:
            raise ConflictError(f"frame {following} has been computed already; branch there to change it")
        elif following >= self.frames:
            raise ConflictError(
                f"the run ends at frame {self.frames - 1}; go back to change what leads there, or restart"
            )
        timeline = self.timeline.insert(Change(following, dict(values)))
        self._check_moves(timeline)
        self.timeline = timeline
        self.explained = None  # trials may have gone beyond this frame
        return next(change for change in self.timeline.changes if change.frame == following)

    @property
    def moved(self) -> Any:  # noqa: ANN401 - the state of any family
        """The present state with the moves of a person that take effect before the next frame."""
        moves = self.timeline.moves_at(self.position + 1)
        return self.experiment.trackers[self.current.tracker].moved(self.current.state, moves)

    def landing(self, frame: int, drawn: int | None, place_px: Sequence[float]) -> dict[str, Any]:
        """Return the change that moves a particle or the estimate to a place in the drawing, or to the nearest valid.

        Args:
            frame: Frame in which it was grabbed.
            drawn: Index among the drawn particles; None for the estimate.
            place_px: (2,) place in the drawing, px.

        Raises:
            ConflictError: The run is at another frame.
            ParameterError: The drawing has no such particle, or the tracker allows no moves.
        """
        if frame != self.position:
            raise ConflictError(f"frame {frame} is not shown any more; pause before you move what is in it")
        tracker, state, particle = self.experiment.trackers[self.current.tracker], self.moved, drawn
        cloud, model = tracker.cloud(state), tracker.model
        if model is None or not model.movable:
            raise self._refuse_move(tracker, place_px)
        if drawn is not None:
            chosen = [] if cloud is None else drawn_particles(len(cloud)).tolist()
            if not 0 <= drawn < len(chosen):
                raise ParameterError("particle", drawn, f"below {len(chosen)}, the number of particles drawn")
            particle = chosen[drawn]
        width = len(state.estimate)
        current = state.estimate if particle is None or cloud is None else cloud.states[particle, :width]
        low, high = model.reach(self.source.size, width)
        place = np.clip(model.landing(current, np.array(place_px, np.float64)), low, high)
        return {"move": Move(particle=particle, place=place.tolist())}

    def is_only_drawn(self, values: Mapping[str, object]) -> bool:
        """Return whether these values change only what is drawn, and no number of any frame."""
        drawn = {item.name for item in with_role(type(self.setup.parameters), "drawing")}
        return bool(values) and values.keys() <= drawn

    def branch(
        self,
        frame: int,
        values: Mapping[str, object] | None = None,
        *,
        on_step: Callable[[], None] = lambda: None,
    ) -> "Run":
        """Return a new run at a frame, with this run's past up to that frame.

        Args:
            frame: The last frame shared, 0..computed.
            values: Changes from the next frame on.
            on_step: Called after each step that is repeated on the way there.

        Raises:
            ParameterError: The frame has not been computed, it is the last and changes are given, or a parameter is
                unknown or its value out of bounds.
        """
        if not 0 <= frame <= self.computed:
            raise ParameterError("frame", frame, f"a whole number between 0 and {self.computed}")
        if values and frame + 1 >= self.frames:
            raise ParameterError(
                "frame", frame, f"0 to {self.frames - 2}, since a change counts from the next frame on"
            )
        changes = (Change(frame + 1, dict(values)),) if values else ()
        twin = Run(
            self.experiment,
            self.setup,
            tracker=self.tracker,
            seed=self.seed,
            frames=self.frames,
            timeline=self.timeline.changes_until(frame) + changes,
        )
        twin.diagnostics = self.diagnostics[: frame + 1]
        twin._keyframes = self._keyframes.until(frame)
        for _ in twin.seeking(frame):
            on_step()
        return twin

    def rewire(self, experiment: Experiment, setup: Setup) -> "Run":
        """Return the same run with more trackers to choose from, without computing it again.

        Args:
            experiment: This run's experiment with more trackers.
            setup: This run's setup with more parameters.
        """
        twin = Run(
            experiment,
            setup,
            tracker=self.tracker,
            seed=self.seed,
            frames=self.frames,
            timeline=self.timeline.changes,
        )
        twin.diagnostics = self.diagnostics
        twin._keyframes = self._keyframes
        twin.seek(self.position)
        return twin

    def checkpoint(self) -> Checkpoint:
        """Return the frames computed so far, for a run of the same recipe that need not compute them again."""
        return Checkpoint(self._past(self.computed), tuple(self.diagnostics), self._keyframes.states)

    def recall(self, checkpoint: Checkpoint) -> bool:
        """Take over the frames that another run computed; return whether they are valid here.

        The recipe must be the same, and a step repeated from the last state but one must give the same numbers, because
        another version of the program may compute others.
        """
        frames, last = sorted(checkpoint.states), len(checkpoint.diagnostics) - 1
        if len(frames) < 2 or (frames[0], frames[-1]) != (0, last):
            return False
        if checkpoint.recipe != self._past(last):
            return False
        before = frames[-2]
        if not self._agrees(checkpoint.states[before], checkpoint.diagnostics[before + 1]):
            return False
        self.diagnostics = list(checkpoint.diagnostics)
        for frame in frames:
            self._keyframes.offer(frame, checkpoint.states[frame])
        return True

    def _past(self, frame: int) -> str:
        """Return as JSON the part of the recipe that affects the frames up to one."""
        timeline = self.timeline.changes_until(frame)
        return self.recipe.model_copy(update={"timeline": timeline}).model_dump_json()

    @property
    def estimates_sha256(self) -> str:
        """Hash of all estimates computed so far; equal if and only if they are the same bit for bit."""
        return estimates_hash(np.array([row.estimate for row in self.diagnostics]))

    @property
    def doubts(self) -> tuple[Finding, ...]:
        """Doubts about the error bands of the frames computed so far; empty if all bands were found right."""
        return self.experiment.doubts(*self.timeline.in_force_until(self.computed))

    def measures(self) -> Mapping[str, float | int]:
        """Return by name the measures of the run so far for which the truth is known."""
        measures = self.experiment.measures_on(self.setup.footage)
        if measures == self.experiment.run_measures and all(row.truth is None for row in self.diagnostics):
            return {}
        return evaluate(measures, evaluated_run(self.experiment, self.diagnostics))

    def summary(self) -> Summary:
        """Return the results of the run so far.

        Success and measures use the frames whose truth is known. Without any, success is None and there are no
        measures.
        """
        return summarise(self.experiment, self.setup, self.timeline, self.seed, self.diagnostics)

    def save(self, path: str | PathLike[str], *, states: bool = False) -> None:
        """Save the run to a file that reproduces it; `pftrack.load` reads it.

        Args:
            path: Path of the new .pft file; an existing file is replaced.
            states: Whether to keep the particles of every frame.

        Raises:
            OSError: The file cannot be written; what was there before is still there.
        """
        save(self, Path(path), states=states)

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows: the current frame, a summary and the error plot."""
        return cast("str", load(PRESENTERS, "run_html")(self))

    def __repr__(self) -> str:
        done = f"{self.computed + 1} of {self.frames} frames computed"
        return f"<Run of {self.experiment.id}, {self.tracker}, seed {self.seed}: {done}, at frame {self.position}>"

    def table(self) -> "pa.Table":
        """Return the numbers of all computed frames as an Arrow table, one row per frame.

        Columns are those of the exported tables; the metadata of each field hold its title and unit.
        """
        return table_of(self)

    def to_xarray(self, *, particles: bool = False) -> Any:  # noqa: ANN401 - xarray's, which is an extra
        """Return the numbers of all frames that were computed as an `xarray.Dataset` (pip install pftrack[xarray]).

        Args:
            particles: Whether to add `cloud` (frame, particle, component), its log weights and its ancestors.
        """
        return dataset_of(self, particles=particles)

    def export(self, path: str | PathLike[str], *, plot: str | None = None) -> Exported:
        """Export the computed part of the run; the suffix of the path chooses the file type.

        Args:
            path: Path of the new file; an existing file is replaced.
            plot: Id of the one plot to show in a picture (default: all).

        Returns:
            The files written, and the part of the run that they hold.

        Raises:
            ConflictError: The file type, the folder or the plot does not exist; the message lists those that do.
            OSError: The file cannot be written; what was there before is still there.
        """
        return cast(Exported, load(PRESENTERS, "export")(self, Path(path), plot=plot))

    def explain(self, frame: int | None = None, *, seeds: int = 0) -> "Explanation":
        """Explain why the target was lost in the computed part of the run.

        The run keeps the changes that would have saved it, and notebooks and HTML exports show them.

        Args:
            frame: The frame to ask about; the first lasting loss if not given.
            seeds: Number of seeds with which to try each change that might have saved the run; 0 tries none.

        Raises:
            ValueError: The frame has not been computed, or the number of seeds is negative.
        """
        found: Explanation = load(PRESENTERS, "explain")(self, frame, seeds=seeds)
        if found.what_if is not None:
            self.explained = found
        return found

    def _compute(self, index: int, previous: TrackState | None) -> Step:
        """Return the step of a frame, and keep its numbers and state if it is new."""
        frame = self.source.frame(index, self.timeline.history)
        begun = perf_counter()
        state = self._follow(frame, previous)
        step_ms = 1e3 * (perf_counter() - begun)
        if index == len(self.diagnostics):
            self.diagnostics.append(self._diagnose(frame, state, step_ms))
            self._keyframes.offer(index, state)
        return self._step(frame, state)

    def _follow(self, frame: Frame, previous: TrackState | None) -> TrackState:
        """Return the state of a frame, given the state of the frame before (None in frame 0)."""
        index, parameters = frame.index, self.parameters_at(frame.index)
        tracker = self.experiment.trackers[self.tracker_at(index)]
        if previous is not None and (moves := self.timeline.moves_at(index)):
            previous = self.experiment.trackers[self.tracker_at(index - 1)].moved(previous, moves)
        if previous is None:
            return tracker.start(self.source.start, frame, parameters, Stream(self.seed, index, Purpose.START))
        return tracker.step(previous, frame, parameters, Stream(self.seed_at(index), index, Purpose.TRACK))

    def _check_moves(self, timeline: Timeline) -> None:
        """Check the moves of a timeline against the trackers, the numbers of particles and the bounds of places.

        Raises:
            ParameterError: A particle does not exist, a place is out of bounds, or a tracker allows no moves.
        """
        for segment in timeline.segments:
            before = segment.start - 1
            for move in segment.moves:
                name, parameters = timeline.tracker_at(before), timeline.parameters_at(before)
                tracker, width = self.experiment.trackers[name], len(self.source.start.position)
                if tracker.model is None or not tracker.model.movable:
                    raise self._refuse_move(tracker, list(move.place))
                count = read_particles(self.experiment.declarations(type(parameters)), flat(parameters), name)
                if move.particle is not None and move.particle >= count:
                    bound = f"one of frame {before}, 0 to {count - 1}" if count else "left out: the tracker has none"
                    raise ParameterError("particle", move.particle, bound)
                low, high = tracker.model.reach(self.source.size, width)
                if len(move.place) != width or not ((low <= move.place) & (move.place <= high)).all():
                    ranges = ", ".join(f"{least:g} to {most:g}" for least, most in zip(low, high, strict=True))
                    raise ParameterError("place", list(move.place), f"within bounds ({ranges})")

    def _refuse_move(self, tracker: Tracker, place: Sequence[float]) -> ParameterError:
        what = f"left out: {self.experiment.title} has nothing that {tracker.title} lets people move"
        return ParameterError("move", list(place), what)

    def _diagnose(self, frame: Frame, state: TrackState, step_ms: float) -> Diagnostics:
        """Return the numbers of a frame."""
        experiment, parameters, beside = self.experiment, self.parameters_at(frame.index), self.setup.beside
        tracker = experiment.trackers[self.tracker_at(frame.index)]
        look = None if beside is None else lambda: beside(frame, state, parameters)
        return diagnose(
            frame,
            state,
            judge_state(experiment, state, frame.target, parameters),
            step_ms,
            scale=experiment.judge.scale,
            searching=tracker.searching(state) if tracker.searching else None,
            series=measurements(experiment, self._declared, tracker, frame, state, look),
        )

    def _step(self, frame: Frame, state: TrackState) -> Step:
        """Return a frame with the observation, the belief and the numbers of both."""
        name, row = self.tracker_at(frame.index), self.diagnostics[frame.index]
        return Step(frame, state, row, self.parameters_at(frame.index), name, self.experiment.trackers[name].title)

    def _recall_step(self, index: int, state: TrackState) -> Step:
        return self._step(self.source.frame(index, self.timeline.history), state)

    def _agrees(self, previous: TrackState, row: Diagnostics) -> bool:
        """Return whether a step from a state, perhaps of another version, gives the estimate of the next frame."""
        try:
            state = self._follow(self.source.frame(row.frame, self.timeline.history), previous)
        except Exception:  # noqa: BLE001 - it was made for another version, and may fail in any way
            return False
        return tuple((self.experiment.judge.scale * state.estimate).tolist()) == row.estimate


def _check_seed(seed: int) -> int:
    if not 0 <= seed <= LARGEST_KEY:
        raise ParameterError("seed", seed, f"a whole number between 0 and {LARGEST_SEED}")
    return seed


def _check_length(wanted: int | None, available: int | None, usual: int) -> int:
    longest = available or LONGEST_RUN
    frames = wanted if wanted is not None else available or usual
    if not 1 <= frames <= longest:
        raise ParameterError("frames", frames, f"a whole number between 1 and {longest}")
    return frames
