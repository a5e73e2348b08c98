"""The run tree: the runs of one session, a branch each, and what a person may do with them.

It knows neither pipe nor clock: the worker drives it, and tests can too.
"""

import dataclasses
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pftrack.analysis.explanation import Explanation, explain
from pftrack.core.files import free_bytes
from pftrack.core.model.band import DIRECTIONS
from pftrack.core.model.drawing import Drawing
from pftrack.core.model.parameters import Parameters, declarations, flat, limit_particles, revise, with_role
from pftrack.core.model.recipe import Change, Recipe, Timeline, check_timeline, parameter_values
from pftrack.core.model.setup import BESIDE, Setup, describe_course
from pftrack.core.model.tracker import Diagnostics
from pftrack.core.refusal import ConflictError, ParameterError
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own.code import FilterFileError, digest_of, trust, with_digests
from pftrack.experiments.own.extension import extend, new_defaults, widen
from pftrack.runs import checkpoint, record, reproduction
from pftrack.runs.loss import Loss
from pftrack.runs.loss_probability import LossAccount
from pftrack.runs.run import Run
from pftrack_server.sessions.spec import Goal, Problem, RunSnapshot, SessionDescription
from pftrack_server.sessions.worker.description import FrameView, describe, describe_timeline, with_loss
from pftrack_server.sessions.worker.protocol import Inspect, InspectionPublic, WorkerConfig


class RunTree:
    """The branches of a session's run, one of them active.

    Attributes:
        experiment: Of the run.
        active: Name of the active branch.
        restarts: How often a branch was restarted, which drops its past.
        problem: Why a filter that the run could have is not at hand.
    """

    def __init__(self, config: WorkerConfig, on_step: Callable[[], None] = lambda: None) -> None:
        """Wire the experiment and begin the run at frame 0, or where its checkpoint is.

        Args:
            config: What makes the run.
            on_step: Called after each step that is repeated for a branch, which may take a while.

        Raises:
            RefusedError: A value of the config is refused, the experiment is unknown, or the upload cannot be opened,
                is another one, or shows no target.
        """
        self._recipe = recipe = with_digests(config.run.recipe)
        self._max_particles = config.max_particles
        self._on_step = on_step
        self._states = Path(config.states) if config.states else None
        self._reserve_bytes = config.reserve_bytes
        frames = recipe.frames
        if frames is not None and frames > config.limits.frames:
            raise ParameterError("frames", frames, f"at most {config.limits.frames} on this server")
        # That of the recording alone, to which what filters bring is added.
        self._bare = _wire(config)
        filters, self.problem = _usable_filters(recipe)
        self._adopt(filters)
        recipe = self._recipe
        self.active = config.run.branch
        self._runs: dict[str, Run] = {}  # the one that was active last comes last
        self._left: dict[str, str] = {}
        self.restarts = 0
        self._view = FrameView()
        self._loss = LossAccount()
        self._course: tuple[Timeline | None, dict[str, Any]] = None, {}
        self._measured: tuple[tuple[str, int, int], dict[str, float | int]] = ("", 0, -1), {}
        self._runs[self.active] = self._begin(recipe)
        check_timeline(recipe.timeline, self.run.frames)
        self._recall()

    @property
    def run(self) -> Run:
        """The active branch."""
        return self._runs[self.active]

    @property
    def ended(self) -> bool:
        """Whether the active branch stands on its last frame."""
        return self.run.position >= self.run.frames - 1

    @property
    def branch_point(self) -> int | None:
        """Frame at which a change leaves the active branch; None where it counts from its next frame on."""
        if self.run.frames > 1 and self.run.position == self.run.frames - 1:
            return 0
        return None if self.run.position == self.run.computed else self.run.position

    def describe(self) -> SessionDescription:
        """Return what is fixed while the session lives."""
        return describe(self.run)

    def measures(self) -> dict[str, float | int]:
        """Return the measures of the active branch so far, by name."""
        of = self.active, self.restarts, self.run.computed
        if self._measured[0] != of:
            self._measured = of, dict(self.run.measures())
        return self._measured[1]

    def look(self) -> str:
        """Return how the target separates from its surroundings in the frame that is shown, a sentence."""
        if self._setup.beside is None:
            return ""
        rows = self.run.diagnostics[: self.run.position + 1]
        said = describe_course([row.number(BESIDE.name) for row in rows])
        return said and f"{said}."

    def explain(self, frame: int | None) -> Explanation:
        """Return why the target was lost in the active branch.

        Args:
            frame: The frame to ask about; the first lasting loss if None.

        Raises:
            ParameterError: The frame has not been computed.
        """
        if frame is not None and not 0 <= frame <= self.run.computed:
            raise ParameterError("frame", frame, f"a frame that has been computed, 0 to {self.run.computed}")
        return explain(self.run, frame)

    def before_loss(self) -> int:
        """Return the frame from which to watch how the target was lost.

        Raises:
            ConflictError: It has not been lost so far.
        """
        rows = self.run.diagnostics
        frame = Loss.of(rows).approach([row.hidden is True for row in rows], self.run.position)
        if frame is None:
            raise ConflictError("the target has not been lost so far")
        return frame

    def snapshot(self) -> RunSnapshot:
        """Return what moves of the active branch, as far as it is known here."""
        run = self.run
        following = run.position + 1
        tracker, parameters = run.tracker_at(following), run.parameters_at(following)
        # Most frames have the timeline of the frame before.
        if self._course[0] is not run.timeline:
            self._course = run.timeline, describe_timeline(run)
        return RunSnapshot(
            branch=self.active,
            second=self.second,
            tracker=tracker,
            parameters=flat(parameters),
            doubts={it: DIRECTIONS[it] for it in self.experiment.miscalibration((tracker, parameters))},
            **self._course[1],
            restarts=self.restarts,
            position=run.position,
            computed=run.computed,
            branch_point=self.branch_point,
        )

    def forward(self) -> dict[str, Any] | None:
        """Go to the next frame; return its diagnostics when it had to be computed."""
        if self.run.position == self.run.computed:
            return self.run.advance().diagnostics.as_dict()
        self.run.seek(self.run.position + 1)
        return None

    def reachable_goal(self, goal: Goal) -> Goal:
        """Return a goal as far as the run goes."""
        computed = min(goal.computed, self.run.frames - 1)
        position = min(goal.position, max(computed, self.run.computed))
        return Goal(max(computed, position), position)

    def seek_steps(self, goal: Goal) -> Iterator[dict[str, Any] | None]:
        """Go to a goal; after each step on the way yield the diagnostics of its frame, if that had to be computed."""
        if goal.computed > self.run.computed:
            for _ in self.run.seeking(self.run.computed):
                yield None
            while self.run.computed < goal.computed:
                yield self.forward()
        for _ in self.run.seeking(goal.position):
            yield None

    def keep_states(self) -> None:
        """Write a checkpoint of the active branch, if it is wanted and there is room.

        Raises:
            OSError: It cannot be written.
            ValueError: The tracker's states cannot.
        """
        if self._states is None or free_bytes(self._states.parent) < self._reserve_bytes:
            return
        self._states.mkdir(exist_ok=True, mode=0o700)
        checkpoint.write(self.run.checkpoint(), self._place(self._states))

    def _recall(self) -> None:
        """Have the active branch begin with what its checkpoint holds."""
        if self._states is not None:
            package = type(self._setup.parameters).__module__.partition(".")[0]
            place = self._place(self._states)
            found = checkpoint.read(place, package)
            if found is not None and self.run.recall(found):
                os.utime(place)  # the checkpoints that nobody has used for the longest time are the first to go

    def _place(self, folder: Path) -> Path:
        return folder / f"{self.active}.states"

    def rows(self, first: int) -> list[dict[str, Any]]:
        """Return the diagnostics of the active branch from a frame on."""
        return self.with_loss([row.as_dict() for row in self.run.diagnostics[first:]])

    def loss_probability(self, frame: int) -> float:
        """Return how probable it is that the target is lost in a frame of the active branch; NaN if not known."""
        return self._loss.follow(self.run)[frame]

    def with_loss(self, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """Return diagnostics of the active branch with the probability that the target is lost, where that is known.

        It is told of many frames at once, which takes an eighth of the time of one by one.
        """
        return with_loss(rows, self._loss.follow(self.run)) if rows else rows

    def drawing(self) -> Drawing:
        """Return what is to be seen of the frame that is shown, without what no viewer can show."""
        return self._view.draw(self.run, self.other)

    def inspect(self, wanted: Inspect) -> InspectionPublic:
        """Look at something in the frame that is shown, and draw it from now on.

        Raises:
            ParameterError: It does not exist; what was looked at before still is.
        """
        return self._view.inspect(self.run, wanted)

    def redraws(self, values: Mapping[str, object]) -> bool:
        """Return whether a change of these shows in the frame that is shown, and not from the next one on."""
        drawn = {item.name for item in with_role(type(self._setup.parameters), "drawing")}
        return not values.keys().isdisjoint(drawn | {"move"})

    @property
    def second(self) -> str | None:
        """The branch that the active one left, else the one active before it, of those that see the same scene."""
        others = [name for name, run in self._runs.items() if name != self.active and run.seed == self.run.seed]
        left = self._left.get(self.active)
        return left if left in others else others[-1] if others else None

    @property
    def other(self) -> Diagnostics | None:
        """The frame that is shown, in the second branch.

        None if that has not come so far, or estimates the same: branches share their past.
        """
        if self.second is None:
            return None
        rows = self._runs[self.second].diagnostics
        here = self.run.current.diagnostics
        there = rows[here.frame] if here.frame < len(rows) else None
        return there if there is not None and there.estimate != here.estimate else None

    def change(self, values: Mapping[str, object], branch: str) -> None:
        """Change parameters from the next frame on.

        In the past this makes a branch, unless it changes no number, and at the end of the run one from its start; a
        parameter that cannot change in the middle of a run restarts it.

        Raises:
            ParameterError: A value is refused; nothing has changed then.
        """
        self._limit_change(values, self.run.position + 1)
        fixed = {item.name for item in declarations(type(self._setup.parameters)) if not item.live}
        if fixed & values.keys():
            self.restart(values=values)
        elif self.branch_point is not None and not self.run.is_only_drawn(values):
            self.branch(branch, self.branch_point, values)
        else:
            self.run.change(values)

    def branch(self, name: str, frame: int, values: Mapping[str, object]) -> None:
        """Leave the active branch at a frame and go on under a new name.

        Raises:
            ParameterError: The frame or a value is refused; nothing has changed then.
        """
        if not 0 <= frame <= self.run.computed:
            raise ParameterError("frame", frame, f"a frame computed already, 0 to {self.run.computed}")
        self._limit_change(values, frame)
        self._runs[name] = self.run.branch(frame, values, on_step=self._on_step)
        self._left[name] = self.active
        self._show(name)

    def activate(self, name: str, recipe: Recipe) -> bool:
        """Show another branch; return whether it had to be computed again because this worker did not hold it."""
        missing = name not in self._runs
        if any(len(texts) > len(self._recipe.filters.get(each, ())) for each, texts in recipe.filters.items()):
            self._adopt({**self._recipe.filters, **recipe.filters})
        if missing:
            self._runs[name] = self._begin(recipe)
        self._show(name)
        if missing:
            self._recall()
        return missing

    def restart(self, seed: int | None = None, values: Mapping[str, object] = MappingProxyType({})) -> None:
        """Restart the active branch with the values in force and an empty past.

        Args:
            seed: What to begin with instead of the seed so far; it is then the seed of all branches to come.
            values: What to change of the values in force.
        """
        if seed is not None:
            self._recipe = self._recipe.model_copy(update={"seed": seed})
        run = self.run
        following = run.position + 1
        tracker: Any = values.get("tracker", run.tracker_at(following))
        defaults = flat(self._setup.parameters)
        inforce: dict[str, Any] = {
            key: value for key, value in flat(run.parameters_at(following)).items() if value != defaults[key]
        }
        inforce.update(parameter_values(values))
        timeline = (Change(0, inforce),) if inforce else ()
        self._runs[self.active] = self._begin(
            self._recipe.model_copy(update={"tracker": tracker, "timeline": timeline})
        )
        self.restarts += 1

    def save(self, path: Path) -> dict[str, Any]:
        """Write the active branch to a file and return its summary."""
        record.save(self.run, path)
        return self.run.summary().as_dict()

    def revise_filter(self, name: str, text: str, branch: str) -> None:
        """Go on with another version of a filter's file.

        Where the active branch was computed with it, this makes a branch, from the frame that is shown or from the
        start if that is the last; otherwise the version is at hand. Tracker and parameters stay as they were chosen.

        Args:
            name: Of its tracker.
            text: The file's content, which is trusted from now on.
            branch: What to call the new branch.

        Raises:
            FilterFileError: It cannot be used; nothing has changed then.
        """
        trust(text)
        versions = self._recipe.filters.get(name, ())
        if versions[-1:] == (digest_of(text),):
            return
        if not any(_uses(run, name) for run in self._runs.values()):
            versions = ()  # nobody needs them
        self._adopt({**self._recipe.filters, name: (*versions, digest_of(text))})
        used = _uses(self.run, name)
        run = self.run.rewire(self.experiment, self._setup)
        frame = 0 if self.ended else run.position
        following = run.position + 1
        values = new_defaults(name, self._recipe.filters[name], flat(run.parameters_at(following)))
        if used:
            # A branch shares what was in force in its frame; what was chosen since is not given up for a new text.
            values = {**_changes_between(run, frame, following), **values}
            self._runs[branch] = run.branch(frame, values, on_step=self._on_step)
            self._left[branch] = self.active
            self._show(branch)
        else:
            # No number hangs on it, so it is in force from the beginning.
            run.timeline = run.timeline.insert(Change(0, values)) if versions else run.timeline
            self._runs[self.active] = run

    def try_filter(self, name: str) -> None:
        """Compute the next frame by the newest version of a filter's file, beside the runs, which stay as they are.

        After the last frame it is the one after the first.

        Args:
            name: Of its tracker, which need not be the one that is chosen.

        Raises:
            FilterFileError: It cannot compute the frame.
        """
        run, frame = self.run, 0 if self.ended else self.run.position
        if run.frames == 1:
            return
        values = _changes_between(run, frame, frame + 1)
        values |= new_defaults(name, self._recipe.filters[name], flat(run.parameters_at(frame + 1)))
        run.branch(frame, {**values, "tracker": name}, on_step=self._on_step).advance()

    def _adopt(self, filters: Mapping[str, tuple[str, ...]]) -> None:
        """Have the trackers of these filters at hand.

        Raises:
            FilterFileError: One cannot be used; nothing has changed then.
        """
        experiment, setup = extend(self._recipe.experiment, filters), widen(self._bare, filters)
        self.experiment: Experiment = experiment
        self._setup: Setup = setup
        self._recipe = self._recipe.model_copy(update={"filters": dict(filters)})

    def _show(self, name: str) -> None:
        self._runs[self.active] = self._runs.pop(self.active)
        self.active = name
        if self.run.experiment is not self.experiment:  # of before another version of a filter came
            self._runs[name] = self.run.rewire(self.experiment, self._setup)

    def _begin(self, recipe: Recipe) -> Run:
        experiment, parameters = self.experiment, self._setup.parameters
        tracker, changes = recipe.tracker or experiment.default_tracker, recipe.changes(flat(parameters))
        # A run computes its first frame at once: what is too much is refused before there is one.
        for each in Timeline.begin(parameters, tracker, experiment.trackers, changes).segments:
            self._limit(each.parameters, each.tracker)
        return Run.from_recipe(recipe, experiment, self._setup)

    def _limit_change(self, values: Mapping[str, object], frame: int) -> None:
        """Refuse a change of what is in force in a frame of the active branch, if it makes too many particles."""
        changed = revise(self.run.parameters_at(frame), parameter_values(values))
        self._limit(changed, str(values.get("tracker", self.run.tracker_at(frame))))

    def _limit(self, parameters: Parameters, tracker: str) -> None:
        declared = self.experiment.declarations(type(parameters))
        limit_particles(declared, flat(parameters), tracker, self._max_particles)


def _wire(config: WorkerConfig) -> Setup:
    """Wire the recipe's footage, which is the upload, or the simulated scene.

    Raises:
        RefusedError: The experiment is unknown, or the upload cannot be opened, is another one, or shows no target.
    """
    footage, experiment = config.run.recipe.footage, find(config.run.recipe.experiment)
    recording = config.recording
    if footage is None or recording is None:
        return experiment.simulate()
    setup = reproduction.wire(experiment, footage, lambda named: recording.open(square=named.square))
    if setup.footage is None or not footage.name:
        return setup
    # A saved run speaks of the recording by the name that people know.
    return dataclasses.replace(setup, footage=setup.footage.model_copy(update={"name": footage.name}))


def problem_of(error: FilterFileError) -> Problem:
    """Return what a session tells of a filter's file that cannot be used."""
    return Problem(file=error.file, line=error.line, text=error.problem)


def _usable_filters(recipe: Recipe) -> tuple[Mapping[str, tuple[str, ...]], Problem | None]:
    """Return the filters of a recipe; where the run needs none that cannot be used, without those, and why.

    Raises:
        FilterFileError: One that the run needs cannot be used.
    """
    needed = {recipe.tracker, *(change.values.get("tracker") for change in recipe.timeline)}
    usable, problem = dict(recipe.filters), None
    for name, texts in recipe.filters.items():
        try:
            extend(recipe.experiment, {name: texts})
        except FilterFileError as error:
            if name in needed:
                raise
            problem = problem_of(error)
            del usable[name]
    return usable, problem


def _changes_between(run: Run, frame: int, later: int) -> dict[str, Any]:
    """Return what is in force in a later frame and was not in an earlier one."""
    before, chosen = flat(run.parameters_at(frame)), flat(run.parameters_at(later))
    values: dict[str, Any] = {name: value for name, value in chosen.items() if value != before[name]}
    tracker = run.tracker_at(later)
    return values if tracker == run.tracker_at(frame) else {"tracker": tracker, **values}


def _uses(run: Run, tracker: str) -> bool:
    """Return whether a tracker computes any frame of a run."""
    return any(each.tracker == tracker for each in run.timeline.segments)
