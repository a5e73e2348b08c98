"""Plans: the runs of a sweep and their numbers.

The runs of a plan are numbered by condition (in the order of the axes, the last one fastest), then by trial, then by
tracker. So a number identifies a run, whatever the order of computing. The seed of a run is a hash of the plan's seed,
the condition and the trial; other axis values, workers or chunks do not change it. It does not depend on the tracker,
so that all trackers meet the same scenes (common random numbers).
"""

import json
from collections.abc import Mapping
from dataclasses import field
from functools import cached_property, partial
from hashlib import blake2b
from math import prod
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, ConfigDict, SkipValidation, TypeAdapter, ValidationError, ValidationInfo
from pydantic.dataclasses import dataclass

from pftrack.core.model.measures import Measure
from pftrack.core.model.parameters import Parameters, Value, revise
from pftrack.core.model.recipe import LONGEST_RUN, Change, Footage, Recipe
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Kind
from pftrack.core.numerics.random import LARGEST_SEED
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own.extension import extend, outline
from pftrack.runs.reproduction import OpenSequence, wire
from pftrack.runs.run import Run
from pftrack.sweep.axis import MOST_RUNS, TRACKER, Axis, SweepError, check, find_declaration, value_of

SEED_BYTES = 6
"""Bytes of a run's seed: JSON and JavaScript represent 48 bits exactly."""

DESCRIBED = ("experiment", "axes", "trackers", "trials", "seed", "frames", "values")
"""Fields in the description of every plan."""

LOOKED_AT = 64
"""Conditions to check, spread over the plan, before all of them count as impossible."""


@dataclass(frozen=True, slots=True)
class Single:
    """One run of a plan, ready to be opened live.

    Attributes:
        number: Number of the run in the plan.
        trial: Number of the trial in its condition, from 0.
        recipe: Recipe of the run; its timeline holds the parameters that differ from the experiment's defaults.
    """

    number: int
    trial: int
    recipe: Recipe


def _whole(low: int, high: int, value: object, info: ValidationInfo) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        bound, name = f"a whole number between {low} and {high}", info.field_name or ""
        raise SweepError(f"{name} must be {bound}, got {value!r}", name, bound=bound, value=value)
    return value


@dataclass(frozen=True, config=ConfigDict(extra="ignore"))
class Plan:
    """An experiment over a grid of conditions; validated on construction.

    Attributes:
        experiment: Name of the experiment.
        axes: Axes of the grid. An axis named `tracker` stands for `trackers`.
        trackers: Names of the trackers (default: the experiment's own).
        trials: Runs of each tracker in each condition.
        seed: Seed from which all seeds of runs follow.
        frames: Length of a run; 0 stands for the experiment's own.
        values: Parameters that differ from the defaults in every run.
        footage: The recording of all runs with its target; None for the simulated scene.
        kind: Kind of the recording.
        filters: Texts of filter files, by the names of their trackers; see `Recipe`.
        loss_probability: Whether to measure the probability that the target is lost, too.
        outlined: Whether the plan is only shown: filter files are then named but not executed, and their parameters
            can be neither varied nor fixed.

    Raises:
        SweepError: A value is unknown, out of bounds or given twice, or there are too many runs.
    """

    experiment: str
    axes: tuple[Axis, ...] = ()
    trackers: tuple[str, ...] = ()
    trials: Annotated[int, BeforeValidator(partial(_whole, 1, MOST_RUNS))] = 1
    seed: Annotated[int, BeforeValidator(partial(_whole, 0, LARGEST_SEED))] = 0
    frames: Annotated[int, BeforeValidator(partial(_whole, 0, LONGEST_RUN))] = 0
    values: Mapping[str, Annotated[Value, SkipValidation]] = field(default_factory=dict)
    footage: Footage | None = None
    kind: Kind | None = None
    filters: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    loss_probability: bool = False
    outlined: bool = field(default=False, compare=False)

    def __post_init__(self) -> None:
        try:
            experiment = self.wiring
        except RefusedError as error:
            raise SweepError(str(error), error.field or "trackers", value=error.value) from None
        self._check_recording()
        axes, trackers = _axes(experiment, self.axes, self.trackers, self.kind)
        changed = {
            "axes": axes,
            "trackers": trackers,
            "frames": self.frames or experiment.frames,
            "values": _values(experiment, self.values, axes, self.kind),
        }
        for name, value in changed.items():
            object.__setattr__(self, name, value)
        if self.runs > MOST_RUNS:
            sizes = " x ".join(f"{len(axis.values):,} {axis.name}" for axis in self.axes) or "1 condition"
            raise SweepError(
                f"a sweep has at most {MOST_RUNS:,} runs; {sizes} x {len(self.trackers)} trackers x {self.trials:,} "
                f"trials are {self.runs:,}",
                "axes",
            )
        self._check_loss_probability()
        self._check_possible()

    @cached_property
    def wiring(self) -> Experiment:
        """The experiment, with the trackers of filter files."""
        if self.outlined:
            return outline(self.experiment, self.filters)
        return extend(self.experiment, self.filters)

    @property
    def parameters(self) -> Parameters:
        """The parameters of the runs before the recording is opened."""
        return self.wiring.parameters_on(self.kind)

    @property
    def has_truth(self) -> bool:
        """Whether a truth is known by which to judge the runs."""
        return self.footage is None or self.footage.is_labelled

    @property
    def judged(self) -> bool:
        """Whether runs succeed or fail: the experiment defines success, and a truth is known."""
        return self.wiring.judge.has_loss and self.has_truth

    @property
    def measures(self) -> tuple[Measure, ...]:
        """Measures of the runs besides success and error."""
        return self.wiring.measures_on(self.footage, loss_probability=self.loss_probability)

    def setup(self, open_recording: OpenSequence | None = None) -> Setup:
        """Return the source of all runs.

        Args:
            open_recording: Opens the recording.

        Raises:
            RefusedError: The recording is missing or has another hash.
            ParameterError: The experiment does not accept the recording.
        """
        return wire(self.wiring, self.footage, open_recording)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def conditions(self) -> int:
        """Number of conditions; all trackers and trials run in each."""
        return prod(self.shape)

    @property
    def runs(self) -> int:
        """Number of runs."""
        return self.conditions * self.trials * len(self.trackers)

    def axis(self, name: str) -> Axis:
        """Return an axis by name.

        Raises:
            SweepError: The plan has no axis of that name.
        """
        for axis in self.axes:
            if axis.name == name:
                return axis
        names = ", ".join(axis.name for axis in self.axes) or "none"
        raise SweepError(f"the sweep has no axis {name!r}; its axes are {names}")

    def condition(self, index: int) -> dict[str, Value]:
        """Return the axes' values of a condition, 0..conditions-1, by name."""
        values: dict[str, Value] = {}
        for axis in reversed(self.axes):
            index, place = divmod(index, len(axis.values))
            values[axis.name] = axis.values[place]
        return {axis.name: values[axis.name] for axis in self.axes}

    def seeds(self, condition: Mapping[str, Value], start: int, stop: int) -> list[int]:
        """Return the seeds of the trials start..stop-1 of a condition."""
        known = blake2b(json.dumps([self.seed, sorted(condition.items())]).encode(), digest_size=SEED_BYTES)
        seeds = []
        for trial in range(start, stop):
            hashed = known.copy()
            hashed.update(b"/%d" % trial)
            seeds.append(int.from_bytes(hashed.digest(), "big"))
        return seeds

    def single(self, number: int) -> Single:
        """Return one run by its number, 0..runs-1.

        Raises:
            SweepError: The number is out of range.
        """
        if not 0 <= number < self.runs:
            raise SweepError(f"a run of this sweep is a whole number between 0 and {self.runs - 1}, got {number}")
        index, rest = divmod(number, self.trials * len(self.trackers))
        trial, tracker = divmod(rest, len(self.trackers))
        condition = self.condition(index)
        (seed,) = self.seeds(condition, trial, trial + 1)
        values = {**self.values, **condition}
        recipe = Recipe(
            experiment=self.experiment,
            tracker=self.trackers[tracker],
            seed=seed,
            frames=self.frames,
            timeline=(Change(0, values),) if values else (),
            footage=self.footage,
            filters=dict(self.filters),
        )
        return Single(number, trial, recipe)

    def live(self, number: int, open_recording: OpenSequence | None = None) -> Run:
        """Return one run at frame 0, to be stepped through; its estimates have the row's `estimates_sha256`.

        Args:
            number: Number of the run.
            open_recording: Opens the recording, if there is one.

        Raises:
            SweepError: The number is out of range.
            ParameterError: Parameters of the run contradict each other; its row names the problem.
        """
        return Run.from_recipe(self.single(number).recipe, self.wiring, self.setup(open_recording))

    def as_dict(self) -> dict[str, Any]:
        """Return the plan as JSON values."""
        recording = {}
        if self.footage is not None:
            recording = {"kind": self.kind, "footage": self.footage.model_dump(mode="json", exclude_defaults=True)}
        return {
            "experiment": self.experiment,
            "axes": [{"name": axis.name, "values": list(axis.values)} for axis in self.axes],
            "trackers": list(self.trackers),
            "trials": self.trials,
            "seed": self.seed,
            "frames": self.frames,
            "values": dict(self.values),
            **recording,
            **({"loss_probability": True} if self.loss_probability else {}),
            **({"filters": {name: list(texts) for name, texts in self.filters.items()}} if self.filters else {}),
        }

    @classmethod
    def from_dict(cls, raw: Mapping[str, Any], *, outlined: bool = False) -> Self:
        """Return the plan with this description.

        Args:
            raw: Result of `as_dict`.
            outlined: Whether the plan is only shown; see the attribute.

        Raises:
            SweepError: The description is incomplete, or the plan is impossible here.
        """
        if missing := [name for name in DESCRIBED if name not in raw]:
            raise SweepError(f"the description of a sweep lacks {', '.join(missing)}", missing[0])
        try:
            return TypeAdapter(cls).validate_python({**raw, "outlined": outlined})
        except ValidationError as error:
            field = ".".join(str(part) for part in error.errors()[0]["loc"])
            raise SweepError(f"the description of a sweep has {field} in another form", field) from None

    def _check_recording(self) -> None:
        """Refuse a recording that the experiment does not accept, or whose description is incomplete."""
        if (self.footage is None) != (self.kind is None):
            raise SweepError("a sweep on a recording names the recording and its kind")
        if self.footage is None or self.kind is None:
            return
        if self.footage.sha256 is None:
            raise SweepError("a sweep on a recording needs the hash of its content, by which workers identify it")
        if not self.frames:
            raise SweepError("a sweep on a recording needs the number of its frames")
        try:
            self.wiring.parameters_on(self.kind)
            if self.footage.mark is not None:
                self.wiring.video.mark(self.footage.mark)
        except ParameterError as error:
            raise SweepError(str(error)) from None
        if self.footage.mark is None and self.wiring.video.needs_mark(self.kind):
            raise SweepError(f"{self.experiment} needs the mark of its target in a recording")

    def _check_loss_probability(self) -> None:
        """Refuse to measure P(lost) where a tracker does not have it."""
        told = self.wiring.quality.loss_probability.models_on(self.footage)
        if self.loss_probability and told.keys().isdisjoint(self.trackers):
            if self.footage is not None:
                raise SweepError(
                    "P(lost) is not calibrated on recordings; loss_probability needs a simulated scene",
                    "loss_probability",
                )
            able = f"only {', '.join(told)} can" if told else "none can"
            raise SweepError(
                f"{', '.join(self.trackers)} of {self.experiment} cannot tell how probable it is that the target is "
                f"lost; {able}",
                "loss_probability",
            )

    def _check_possible(self) -> None:
        """Refuse a plan if all of its conditions are impossible; single impossible conditions get rows that say so.

        On a recording, parameters follow from the target and can only be checked when it is open.
        """
        if self.footage is not None:
            return
        parameters = self.parameters
        last: ParameterError | None = None
        looked_at = min(self.conditions, LOOKED_AT)
        for step in range(looked_at):
            condition = self.condition(step * self.conditions // looked_at)
            try:
                revise(parameters, {**self.values, **condition})
            except ParameterError as error:
                last = error
            else:
                return
        if last is not None and looked_at == self.conditions:
            raise SweepError(f"every condition of the sweep is impossible: {last}") from None


def _axes(
    experiment: Experiment, given: tuple[Axis, ...], trackers: tuple[str, ...], kind: Kind | None
) -> tuple[tuple[Axis, ...], tuple[str, ...]]:
    """Return the axes except `tracker`, and the trackers."""
    axes: list[Axis] = []
    for index, axis in enumerate(given):
        if axis.name in {other.name for other in axes} or (axis.name == TRACKER and trackers):
            what = "the trackers" if axis.name == TRACKER else f"the axis {axis.name}"
            raise SweepError(f"{what} can be given only once", f"axes.{index}.name", value=axis.name)
        try:
            checked = check(experiment, axis, kind)
        except SweepError as error:
            raise error.within(f"axes.{index}") from None
        if axis.name == TRACKER:
            trackers = tuple(map(str, checked.values))
        else:
            axes.append(checked)
    try:
        named = check(experiment, Axis(TRACKER, trackers or (experiment.default_tracker,)))
    except SweepError as error:
        raise SweepError(str(error), "trackers", bound=error.bound, value=error.value) from None
    return tuple(axes), tuple(map(str, named.values))


def _values(
    experiment: Experiment, given: Mapping[str, Value], axes: tuple[Axis, ...], kind: Kind | None
) -> dict[str, Value]:
    varied = {axis.name for axis in axes}
    values = {}
    for name, value in given.items():
        field = f"values.{name}"
        if name == TRACKER:
            raise SweepError("tracker is not a fixed value of a sweep; name the trackers as such", field)
        if name in varied:
            raise SweepError(f"{name} is an axis of the sweep and cannot have a fixed value ({value}) as well", field)
        try:
            values[name] = value_of(find_declaration(experiment, name, kind), value)
        except SweepError as error:
            raise SweepError(str(error), field, bound=error.bound, value=error.value) from None
    return values
