"""The run tree: the runs of one session, one per branch, and the commands on them.

It uses neither pipe nor clock: the worker drives it, and so can tests.
"""

import dataclasses
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pftrack.analysis.explanation import Explanation, explain
from pftrack.core.files import free_bytes
from pftrack.core.model.band import DOUBTS
from pftrack.core.model.drawing import Drawing
from pftrack.core.model.parameters import Parameters, declarations, flat, limit_particles, revise, with_role
from pftrack.core.model.recipe import Change, Recipe, Segment, Timeline, check_timeline, parameter_values
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
        experiment: Experiment of the run.
        active: Name of the active branch.
        restarts: Number of restarts; each drops a branch's past.
        problem: Why an optional filter of the run cannot be used.
    """

    def __init__(self, config: WorkerConfig, on_step: Callable[[], None] = lambda: None) -> None:
        """Wire the experiment and begin the run at frame 0 or at its checkpoint.

        Args:
            config: The worker's configuration.
            on_step: Called after each step that is computed again for a branch, which may take a while.

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
        # The recording's own experiment; own filters are added to it.
        self._bare = _wire(config)
        filters, self.problem = _usable_filters(recipe)
        self._adopt(filters)
        recipe = self._recipe
        self.active = config.run.branch
        self._runs: dict[str, Run] = {}  # in the order of their last use
        self._left: dict[str, str] = {}
        self.restarts = 0
        self._view = FrameView()
        self._loss = LossAccount()
        self._told: tuple[Timeline | None, Segment | None, dict[str, Any]] = None, None, {}
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
        """Whether the active branch is at its last frame."""
        return self.run.position >= self.run.frames - 1

    @property
    def branch_point(self) -> int | None:
        """Frame at which a change starts a new branch; None if it takes effect from the next frame."""
        if self.run.frames > 1 and self.run.position == self.run.frames - 1:
            return 0
        return None if self.run.position == self.run.computed else self.run.position

    def describe(self) -> SessionDescription:
        """Return the unchanging part of the session."""
        return describe(self.run)

    def measures(self) -> dict[str, float | int]:
        """Return the measures of the active branch so far, by name."""
        of = self.active, self.restarts, self.run.computed
        if self._measured[0] != of:
            self._measured = of, dict(self.run.measures())
        return self._measured[1]

    def look(self) -> str:
        """Return a sentence on how well the target stands out from its surroundings in the shown frame."""
        if self._setup.beside is None:
            return ""
        rows = self.run.diagnostics[: self.run.position + 1]
        said = describe_course([row.number(BESIDE.name) for row in rows])
        return said and f"{said}."

    def explain(self, frame: int | None, branch: str | None) -> Explanation | None:
        """Return why the target was lost in the active branch, or None if another branch is asked about.

        Raises:
            ParameterError: The frame has not been computed.
        """
        return explain(self.run, frame) if branch in (None, self.active) else None

    def before_loss(self) -> int:
        """Return the frame from which to watch the loss of the target.

        Raises:
            ConflictError: The target has not been lost so far.
        """
        rows = self.run.diagnostics
        frame = Loss.of(rows).approach([row.hidden is True for row in rows], self.run.position)
        if frame is None:
            raise ConflictError("the target has not been lost so far")
        return frame

    def snapshot(self) -> RunSnapshot:
        """Return the snapshot of the active branch, without the worker's own fields."""
        run = self.run
        following = run.timeline.segment_at(run.position + 1)
        # Mostly both are those of the frame before.
        if self._told[0] is not run.timeline or self._told[1] is not following:
            in_force = following.tracker, following.parameters
            told = {
                "tracker": following.tracker,
                "parameters": flat(following.parameters),
                "doubts": {it: DOUBTS[it] for it in self.experiment.doubts(in_force)},
                **describe_timeline(run),
            }
            self._told = run.timeline, following, told
        return RunSnapshot(
            branch=self.active,
            second=self.second,
            **self._told[2],
            restarts=self.restarts,
            position=run.position,
            computed=run.computed,
            branch_point=self.branch_point,
        )

    def forward(self) -> dict[str, Any] | None:
        """Go to the next frame; return its diagnostics if it had to be computed."""
        if self.run.position == self.run.computed:
            return self.run.advance().diagnostics.as_dict()
        self.run.seek(self.run.position + 1)
        return None

    def reachable_goal(self, goal: Goal) -> Goal:
        """Return a goal within the length of the run."""
        computed = min(goal.computed, self.run.frames - 1)
        position = min(goal.position, max(computed, self.run.computed))
        return Goal(max(computed, position), position)

    def seek_steps(self, goal: Goal) -> Iterator[dict[str, Any] | None]:
        """Go to a goal; after each step yield the diagnostics of its frame, or None if it was known."""
        if goal.computed > self.run.computed:
            for _ in self.run.seeking(self.run.computed):
                yield None
            while self.run.computed < goal.computed:
                yield self.forward()
        for _ in self.run.seeking(goal.position):
            yield None

    def keep_states(self) -> None:
        """Write a checkpoint of the active branch if checkpoints are kept and there is room.

        Raises:
            OSError: The checkpoint cannot be written.
            ValueError: The tracker's states cannot be stored.
        """
        if self._states is None or free_bytes(self._states.parent) < self._reserve_bytes:
            return
        self._states.mkdir(exist_ok=True, mode=0o700)
        checkpoint.write(self.run.checkpoint(), self._place(self._states))

    def _recall(self) -> None:
        """Let the active branch begin with the content of its checkpoint."""
        if self._states is not None:
            package = type(self._setup.parameters).__module__.partition(".")[0]
            place = self._place(self._states)
            found = checkpoint.read(place, package)
            if found is not None and self.run.recall(found):
                os.utime(place)  # the least recently used checkpoints are deleted first

    def _place(self, folder: Path) -> Path:
        return folder / f"{self.active}.states"

    def rows(self, first: int) -> list[dict[str, Any]]:
        """Return the diagnostics of the active branch from a frame on."""
        return self.with_loss([row.as_dict() for row in self.run.diagnostics[first:]])

    def loss_probability(self, frame: int) -> float:
        """Return the probability that the target is lost in a frame of the active branch; NaN if unknown."""
        return self._loss.follow(self.run)[frame]

    def with_loss(self, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """Return diagnostics of the active branch with the probability that the target is lost, where it is known.

        It is computed for many frames at once, which takes an eighth of the time of single frames.
        """
        return with_loss(rows, self._loss.follow(self.run)) if rows else rows

    def drawing(self) -> Drawing:
        """Return the drawing of the shown frame, without invalid primitives."""
        return self._view.draw(self.run, self.other)

    def inspect(self, wanted: Inspect) -> InspectionPublic:
        """Inspect something in the shown frame, and draw it from now on.

        Raises:
            ParameterError: It does not exist; the inspection before stays.
        """
        return self._view.inspect(self.run, wanted)

    def redraws(self, values: Mapping[str, object]) -> bool:
        """Return whether changes of these values alter the shown frame, not only later ones."""
        drawn = {item.name for item in with_role(type(self._setup.parameters), "drawing")}
        return not values.keys().isdisjoint(drawn | {"move"})

    @property
    def second(self) -> str | None:
        """The branch that the active one left, or else the one active before it; None unless it sees the same scene."""
        others = [name for name, run in self._runs.items() if name != self.active and run.seed == self.run.seed]
        left = self._left.get(self.active)
        return left if left in others else others[-1] if others else None

    @property
    def other(self) -> Diagnostics | None:
        """The shown frame in the second branch.

        None if that branch has not computed it, or its estimate is the same: branches share their past.
        """
        if self.second is None:
            return None
        rows = self._runs[self.second].diagnostics
        here = self.run.current.diagnostics
        there = rows[here.frame] if here.frame < len(rows) else None
        return there if there is not None and there.estimate != here.estimate else None

    def change(self, values: Mapping[str, object], branch: str) -> None:
        """Change parameters from the next frame on.

        In the past this makes a branch, unless it changes no number; at the end of the run it makes a branch from the
        start. A parameter that cannot change in the middle of a run restarts the run.

        Raises:
            ParameterError: A value is refused; nothing changes then.
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
        """Leave the active branch at a frame and continue under a new name.

        Raises:
            ParameterError: The frame or a value is refused; nothing changes then.
        """
        if not 0 <= frame <= self.run.computed:
            raise ParameterError("frame", frame, f"a frame computed already, 0 to {self.run.computed}")
        self._limit_change(values, frame)
        self._runs[name] = self.run.branch(frame, values, on_step=self._on_step)
        self._left[name] = self.active
        self._show(name)

    def activate(self, name: str, recipe: Recipe) -> bool:
        """Show another branch; return whether this worker had to compute it again."""
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
        """Restart the active branch with the current values and an empty past.

        Args:
            seed: New random seed, for this branch and all later ones; None for the same seed.
            values: Changes of the current values.
        """
        if seed is not None:
            self._recipe = self._recipe.model_copy(update={"seed": seed})
        run = self.run
        following = run.position + 1
        tracker: Any = values.get("tracker", run.tracker_at(following))
        defaults = flat(self._setup.parameters)
        changed = {key: it for key, it in flat(run.parameters_at(following)).items() if it != defaults[key]}
        inforce: dict[str, Any] = {**changed, **parameter_values(values)}
        timeline = (Change(0, inforce),) if inforce else ()
        again = self._recipe.model_copy(update={"tracker": tracker, "timeline": timeline})
        self._runs[self.active] = self._begin(again)
        self.restarts += 1

    def save(self, path: Path) -> dict[str, Any]:
        """Write the active branch to a file and return its summary."""
        record.save(self.run, path)
        return self.run.summary().as_dict()

    def revise_filter(self, name: str, text: str, branch: str) -> None:
        """Continue with another version of a filter file.

        If the active branch was computed with the filter, this makes a branch, from the shown frame or, if that is the
        last, from the start; otherwise the version becomes available. Tracker and parameters stay as chosen.

        Args:
            name: Name of its tracker.
            text: The file's content, which is trusted from now on.
            branch: Name for the new branch.

        Raises:
            FilterFileError: The version cannot be used; nothing changes then.
        """
        trust(text)
        versions = self._recipe.filters.get(name, ())
        if versions[-1:] == (digest_of(text),):
            return
        if not any(_uses(run, name) for run in self._runs.values()):
            versions = ()  # no run uses them
        self._adopt({**self._recipe.filters, name: (*versions, digest_of(text))})
        used = _uses(self.run, name)
        run = self.run.rewire(self.experiment, self._setup)
        frame = 0 if self.ended else run.position
        following = run.position + 1
        values = new_defaults(name, self._recipe.filters[name], flat(run.parameters_at(following)))
        if used:
            # A branch shares the values of its frame; later choices are kept with the new text.
            values = {**_changes_between(run, frame, following), **values}
            self._runs[branch] = run.branch(frame, values, on_step=self._on_step)
            self._left[branch] = self.active
            self._show(branch)
        else:
            # No number depends on it, so it applies from the beginning.
            run.timeline = run.timeline.insert(Change(0, values)) if versions else run.timeline
            self._runs[self.active] = run

    def try_filter(self, name: str) -> None:
        """Compute the next frame with the newest version of a filter file, without changing the runs.

        At the last frame, the frame after the first is computed.

        Args:
            name: Name of its tracker, which need not be the chosen one.

        Raises:
            FilterFileError: The filter cannot compute the frame.
        """
        run, frame = self.run, 0 if self.ended else self.run.position
        if run.frames == 1:
            return
        values = _changes_between(run, frame, frame + 1)
        values |= new_defaults(name, self._recipe.filters[name], flat(run.parameters_at(frame + 1)))
        run.branch(frame, {**values, "tracker": name}, on_step=self._on_step).advance()

    def _adopt(self, filters: Mapping[str, tuple[str, ...]]) -> None:
        """Add the trackers of these filters to the experiment.

        Raises:
            FilterFileError: A filter cannot be used; nothing changes then.
        """
        experiment, setup = extend(self._recipe.experiment, filters), widen(self._bare, filters)
        self.experiment: Experiment = experiment
        self._setup: Setup = setup
        self._recipe = self._recipe.model_copy(update={"filters": dict(filters)})

    def _show(self, name: str) -> None:
        self._runs[self.active] = self._runs.pop(self.active)
        self.active = name
        if self.run.experiment is not self.experiment:  # from before a new version of a filter
            self._runs[name] = self.run.rewire(self.experiment, self._setup)

    def _begin(self, recipe: Recipe) -> Run:
        experiment, parameters = self.experiment, self._setup.parameters
        tracker, changes = recipe.tracker or experiment.default_tracker, recipe.changes(flat(parameters))
        # A run computes its first frame at once, so limits are checked before it is made.
        for each in Timeline.begin(parameters, tracker, experiment.trackers, changes).segments:
            self._limit(each.parameters, each.tracker)
        return Run.from_recipe(recipe, experiment, self._setup)

    def _limit_change(self, values: Mapping[str, object], frame: int) -> None:
        """Refuse a change in a frame of the active branch that makes too many particles."""
        changed = revise(self.run.parameters_at(frame), parameter_values(values))
        self._limit(changed, str(values.get("tracker", self.run.tracker_at(frame))))

    def _limit(self, parameters: Parameters, tracker: str) -> None:
        declared = self.experiment.declarations(type(parameters))
        limit_particles(declared, flat(parameters), tracker, self._max_particles)


def _wire(config: WorkerConfig) -> Setup:
    """Wire the recipe's footage, which is the upload or the simulated scene.

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
    # A saved run names the recording by its original name.
    return dataclasses.replace(setup, footage=setup.footage.model_copy(update={"name": footage.name}))


def problem_of(error: FilterFileError) -> Problem:
    """Return a session's report of a filter file that cannot be used."""
    return Problem(file=error.file, line=error.line, text=error.problem)


def _usable_filters(recipe: Recipe) -> tuple[Mapping[str, tuple[str, ...]], Problem | None]:
    """Return the usable filters of a recipe, and the problem of an unusable one that the run does not need.

    Raises:
        FilterFileError: A filter that the run needs cannot be used.
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
    """Return the values of a later frame that differ from those of an earlier one."""
    before, chosen = flat(run.parameters_at(frame)), flat(run.parameters_at(later))
    values: dict[str, Any] = {name: value for name, value in chosen.items() if value != before[name]}
    tracker = run.tracker_at(later)
    return values if tracker == run.tracker_at(frame) else {"tracker": tracker, **values}


def _uses(run: Run, tracker: str) -> bool:
    """Return whether a tracker computes any frame of a run."""
    return any(each.tracker == tracker for each in run.timeline.segments)
