"""An experiment: a named wiring of source, trackers, parameters, drawing and measure.

It is declared with presets, setups of sources, and a drawing of each step.
"""

from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

from pftrack.core.arrays import Floats
from pftrack.core.model.band import DOUBTS, STANDARD_CALIBRATION, Calibration, Finding
from pftrack.core.model.drawing import Layer, World
from pftrack.core.model.glossary import Citation, Section, Term
from pftrack.core.model.marks import Mark, read_mark
from pftrack.core.model.measures import HIT_RATE, MEAN_LOSS_PROBABILITY, Measure, own_account
from pftrack.core.model.model import FilterModel
from pftrack.core.model.parameters import Declaration, Parameters, Value, declarations
from pftrack.core.model.preset import ExampleSweep, Failure, Preset
from pftrack.core.model.recipe import NO_PARAMETERS, Footage, Recipe, check_tracker
from pftrack.core.model.series import STANDARD_PLOTS, STANDARD_READINGS, Plot, Reading, Series, SeriesValue, join
from pftrack.core.model.setup import Export, Finder, Setup, Suits
from pftrack.core.model.source import Frame, FrameSequence, Kind, Target, Truth
from pftrack.core.model.tracker import Diagnostics, Draw, Tracker, with_readers
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.experiments.shared.loss_probability import NOTHING_DECLARED, LossDeclaration
from pftrack.filters.learning.diffusion import Guidance
from pftrack.sources.results.table import Box
from pftrack.sources.truth import BOXES, TruthKind

# Recordings: how an experiment follows a target in a user's pictures or tables.
#
# An experiment declares in one place its kinds of recording and of mark, and its wiring. The common part of all wirings
# is here: the mark and the first picture are checked before an experiment sees them.

PICTURES: tuple[Kind, ...] = ("video", "gif", "images")
"""The kinds of recording that consist of pictures."""

Wire: TypeAlias = Callable[[FrameSequence, Any, int, Truth | None], Setup]
"""(recording, mark in the picture to start at, number of that picture, truth where it is known) -> setup."""


@dataclass(frozen=True)
class Video:
    """How recordings are followed.

    Attributes:
        wire: Wires a recording. The mark is of an accepted kind and lies in the picture, or is None where that is
            allowed. A setup without footage gets that of the recording and the mark.
        footage: The accepted kinds of recording, by default of pictures; empty if recordings are not supported.
        recorded: (kind of a recording) -> the parameters of runs on it, before they are fitted to a target; they are
            needed where a sweep on a recording is planned.
        marks: The accepted kinds of mark; an editor offers the first. Without any, the whole recording is followed.
        wanted: The requirement on a mark, for the sentence that refuses another one.
        unmarked: The kinds of recording that also work without a mark, since the whole recording may be the target.
        advice: Advice for marking the target, a sentence.
        finder: How the target is found without a mark, where it can be.
        suits: Function that estimates whether a target in a recording can be followed.
        truth: The kind of truth that comes with a recording; None if it cannot be estimated.
        clip_title: Name of the experiment on the screen where a recording is tracked, by what it follows; its title if
            empty.
        clip_about: Names of the parameters to turn first on a recording; if there are none, those of presets.
    """

    wire: Wire
    footage: tuple[Kind, ...] = PICTURES
    recorded: Callable[[Kind], Parameters] | None = None
    marks: tuple[type[Mark], ...] = ()
    wanted: str = "left out: all of the recording is followed"
    unmarked: tuple[Kind, ...] = ()
    advice: str = ""
    finder: Finder | None = None
    suits: Suits | None = None
    truth: TruthKind | None = BOXES
    clip_title: str = ""
    clip_about: tuple[str, ...] = ()

    def on_video(
        self, sequence: FrameSequence, mark: Mark | None, *, start: int = 0, truth: Truth | None = None
    ) -> Setup:
        """Return the setup of a recording.

        Args:
            sequence: The pictures.
            mark: The target in the picture `start`; None to find it automatically, where possible, or if no mark is
                needed.
            start: Number of the picture to start at, or to look for the target from.
            truth: By number of the picture, where it is known.

        Raises:
            ParameterError: The mark is missing, or of a kind that is not taken; or the mark or the start is not within
                the recording.
            ValueError: It does not contain a target.
        """
        if not isinstance(mark, self.marks) and (mark is not None or self.needs_mark(sequence.index.kind)):
            raise ParameterError("mark", mark and mark.kind, self.wanted)
        if not 0 <= start < sequence.frame_count:
            raise ParameterError("start", start, f"a frame of the recording, 0 to {sequence.frame_count - 1}")
        if mark is not None and sequence.index.kind in PICTURES:
            mark.check(sequence.size)
        setup = self.wire(sequence, mark, start, truth)
        return setup if setup.footage else replace(setup, footage=Footage.of(sequence, mark, start, truth))

    def needs_mark(self, kind: str) -> bool:
        """Return whether the user must mark the target in a recording of this kind."""
        return bool(self.marks) and self.finder is None and kind not in self.unmarked

    def mark(self, raw: object) -> Mark:
        """Read a mark of an accepted kind from JSON values.

        Raises:
            ParameterError: They are not a mark of such a kind.
        """
        return read_mark(self.marks, raw)


def _take_none(sequence: FrameSequence, *_: object) -> Setup:
    raise ParameterError("footage", sequence.index.kind, "left out: no recording is taken")


NO_VIDEO = Video(_take_none, footage=(), truth=None)
"""Where only a simulated scene is followed."""

INTERFACE = 4
"""Version of the interface between experiments and the library, raised with every breaking change."""


def _check_names(origin: str, of: str, kind: str, names: Iterable[object], known: Container[object]) -> None:
    for name in names:
        if name not in known:
            place = f"{origin}: " if origin else ""
            raise ValueError(f"{place}{of} names an unknown {kind} {name!r}")


def moves_estimates(declared: Declaration) -> bool:
    """Return whether estimates may depend on a parameter, which is not only drawn or judged by."""
    return declared.role not in {"drawing", "loss_share"} and declared.group != "Scoring"


@dataclass(frozen=True)
class Quality:
    """The trackers' own error estimates.

    Attributes:
        calibration: Bands that should hold the truth, and settings at which it is known how often they do.
        loss_probability: Probability that a tracker has lost its target, for trackers with a fitted probability.
    """

    calibration: Calibration = STANDARD_CALIBRATION
    loss_probability: LossDeclaration = NOTHING_DECLARED


STANDARD_QUALITY = Quality()


@dataclass(frozen=True)
class Texts:
    """Texts about an experiment.

    Attributes:
        question: The question it answers, one sentence.
        description: What the experiment shows, a few sentences.
        references: Its sources, the main one first.
        target: The tracked object, one word.
        family: Kind of the estimated quantity, a few words. The start page groups experiments by family.
        terms: Its own terms in plots, readings and measures, for the glossary.
    """

    question: str
    description: str
    references: tuple[Citation, ...]
    target: str = "target"
    family: str = "Others"
    terms: tuple[Term, ...] = ()


@dataclass(frozen=True)
class Display:
    """The displays of a run, each in its listed order.

    Attributes:
        layers: Layers that can be drawn.
        plots: Plots of a run over its frames.
        readings: Values written for the shown frame.
        worlds: Spaces shown next to the picture; every drawing has all of them.
        thumbnail: A small WebP picture of a run for the start page, a file; None if there is none.
    """

    layers: tuple[Layer, ...]
    plots: tuple[Plot, ...] = STANDARD_PLOTS
    readings: tuple[Reading, ...] = STANDARD_READINGS
    worlds: tuple[World, ...] = ()
    thumbnail: Path | None = None

    @property
    def shown(self) -> dict[str, bool]:
        """Whether each layer is shown at first, by name."""
        return {layer.name: layer.shown for layer in self.layers}


@dataclass(frozen=True)
class Measured:
    """Measurements of runs in addition to the trackers' reports.

    Attributes:
        series: Values measured in every frame, such as distances from the truth.
        measure: (frame, state) -> the values of these series, by name; values that a frame does not have are omitted.
        measures: Numbers computed from a whole run and its truth.
        report: (diagnostics of all frames) -> further values of a whole run, JSON values.
    """

    series: tuple[Series, ...] = ()
    measure: Callable[[Frame, Any], Mapping[str, SeriesValue]] | None = None
    measures: tuple[Measure, ...] = ()
    report: Callable[[Sequence[Diagnostics]], Mapping[str, Any]] | None = None


NOTHING_MEASURED = Measured()


@dataclass(frozen=True)
class Judge:
    """How estimates are compared with the truth.

    Attributes:
        error: (estimates (..., d), true positions (..., d)) -> distances (...).
        unit: Unit of estimate and error: "px", "deg", or "" for a pure number.
        lost: (errors (...), sizes of the target (...), parameters) -> whether that is lost (...), where that
            makes sense.
        missed: (state, target) -> whether the belief misses the target, if more is known of the target than place and
            size, such as its silhouette, or if the belief is not a point; None leaves it to `lost`.
        scale: Factor that converts estimates and positions to `unit`; 180/pi for angles in rad.
    """

    error: Callable[[Floats, Floats], Any]
    unit: str
    lost: Callable[[Any, Any, Any], Any] | None = None
    missed: Callable[[Any, Target], bool | None] | None = None
    scale: float = 1.0

    @property
    def has_loss(self) -> bool:
        """Whether loss is defined."""
        return self.lost is not None or self.missed is not None


@dataclass(frozen=True)
class Experiment:
    """A named, documented wiring.

    Attributes:
        id: Name in commands, addresses and files.
        title: Name on the screen.
        texts: Its texts.
        trackers: By name, in the order in which they are shown; the first is the default.
        frames: Length of a simulated run.
        presets: Starting points that show something.
        display: Its displays of a run.
        warm_frames: Number of frames after which a run has called all functions that any further frame calls.
        simulate: Wire the simulated scene.
        draw: Draw a frame.
        judge: How estimates are compared with the truth.
        video: How recordings are followed, where the experiment takes any.
        measured: Measurements of its runs in addition to the trackers' reports.
        example_sweep: A first sweep; by default its first two numbers are varied.
        exports: Files of a frame's belief that it offers.
        guidance: Declaration for learning from its recorded states, if learned motion can guide its particles.
        boxes: (state) -> the believed boxes of all targets of a frame, if there are several; else the box around the
            estimate with the role "extent".
        quality: The trackers' own error estimates, and their reliability.
        failures: Named failures of its trackers, each with its symptoms and its cure.
        model: The belief that a filter from a file is joined with; None where it takes none.
        joined: Trackers added later, each with the tracker whose parameters it reads.
        filters: Texts of the files whose filters are among its trackers, all versions, by tracker name.
        interface: Version of the interface that it was written for. An experiment of another package must state it, or
            it is not used; 0, for the project's own, always means the present version.
    """

    id: str
    title: str
    texts: Texts
    trackers: Mapping[str, Tracker]
    presets: tuple[Preset, ...]
    display: Display
    simulate: Callable[[], Setup]
    draw: Draw
    judge: Judge
    frames: int = 240
    video: Video = NO_VIDEO
    measured: Measured = NOTHING_MEASURED
    example_sweep: ExampleSweep | None = None
    exports: tuple[Export, ...] = ()
    boxes: Callable[[Any], Sequence[Box]] | None = None
    guidance: Guidance | None = None
    failures: tuple[Failure, ...] = ()
    quality: Quality = STANDARD_QUALITY
    warm_frames: int = 2
    model: FilterModel | None = None
    joined: Mapping[str, str] = field(default_factory=dict)
    filters: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    interface: int = 0

    def __post_init__(self) -> None:
        """Refuse plots, readings and tours of undeclared series, and columns, worlds or failures with the same name.

        Raises:
            ValueError: A plot or reading names an unknown series, or two different series have one name, or two
                measures, reductions, worlds or failures have.
        """
        worlds = [world.name for world in self.display.worlds]
        if len(set(worlds)) < len(worlds):
            raise ValueError(f"{self.id} has two worlds of one name: {', '.join(worlds)}")
        files = [name for export in self.exports for name in {export.name, export.suffix}]
        if len(set(files)) < len(files):
            raise ValueError(f"{self.id} has two exports of one name or suffix: {', '.join(files)}")
        named = [failure.id for failure in self.failures]
        if len(set(named)) < len(named):
            raise ValueError(f"{self.id} has two failures of one id: {', '.join(named)}")
        known = {series.name for series in self.all_series()}
        self._check_calibration(known)
        shown = [name for plot in self.display.plots for name in plot.names]
        shown += [name for reading in self.display.readings for name in reading.names]
        for name in shown:
            if name not in known:
                raise ValueError(f"{self.id} shows an undeclared series {name!r}")
        kept = [one.name for one in self.run_measures]
        kept += [reduction.name for series in self.all_series() for reduction in series.reductions]
        for name in kept:
            if kept.count(name) > 1:
                raise ValueError(f"{self.id} declares {name!r} twice among its measures and reductions")

    @property
    def default_tracker(self) -> str:
        """Name of the default tracker: the first one."""
        return next(iter(self.trackers))

    @property
    def glossary(self) -> Section:
        """Its own terms: the declared ones, and its trackers."""
        return Section(self.title, (*self.texts.terms, *(tracker.term for tracker in self.trackers.values())), self.id)

    def check_starts(self) -> None:
        """Refuse presets and failures that name what the experiment does not have; the registry asks when it loads it.

        Raises:
            ValueError: One names an unknown tracker, parameter or plot; the sentence has its file and line.
        """
        if not (self.presets or self.failures):
            return
        try:
            parameters = {item.name for item in declarations(type(self.simulate().parameters))}
        except Exception:  # noqa: BLE001 - a scene that cannot be wired says why where a run begins with it
            return
        plots = {plot.id for plot in self.display.plots}
        tested = [name for it in self.quality.calibration.tested for name in it.within]
        _check_names(self.id, "its calibration", "parameter", tested, parameters)
        for preset in self.presets:
            named = (*preset.parameters, *preset.about, *preset.scene)
            _check_names(preset.origin, preset.name, "parameter", named, parameters)
            _check_names(preset.origin, preset.name, "tracker", [preset.tracker], self.trackers)
            _check_names(preset.origin, preset.name, "plot", [preset.tour.plot] if preset.tour else [], plots)
        for failure in self.failures:
            values = [*failure.parameters, *failure.cure.values]
            values += [name for change in failure.timeline for name in change.values]
            _check_names(failure.origin, failure.id, "parameter", values, {*parameters, "tracker"})
            trackers = {failure.tracker, failure.cure.values.get("tracker", failure.tracker)}
            _check_names(failure.origin, failure.id, "tracker", trackers, self.trackers)

    def _check_calibration(self, series: Container[str]) -> None:
        said = self.quality.calibration
        presets, bands = {preset.name for preset in self.presets}, {band.of for band in said.bands}
        named = [name for band in said.bands for name in band.trackers]
        wanted = (
            ("tracker", self.trackers, [*named, *(name for tested in said.tested for name in tested.trackers)]),
            ("series", series, [name for band in said.bands for name in band.names]),
            ("preset", presets, said.presets),
            ("band", bands, [name for tested in said.tested for name in tested.bands]),
        )
        for kind, known, names in wanted:
            for name in names:
                if name not in known:
                    raise ValueError(f"{self.id} has no {kind} {name!r}, which its calibration names")

    def declarations(self, model: type[Parameters]) -> tuple[Declaration, ...]:
        """Return the declaration of every parameter of a setup's model, each with all trackers that read it."""
        return with_readers(declarations(model), self.joined)

    def all_series(self, *trackers: str) -> tuple[Series, ...]:
        """Return all series that a run with these trackers, or with any if none is named, may have."""
        chosen = trackers or tuple(self.trackers)
        return join(*(self.trackers[name].series for name in chosen), self.measured.series)

    @property
    def run_measures(self) -> tuple[Measure, ...]:
        """All measures of a run: the hit rate, if loss is defined, and the declared ones."""
        return (*((HIT_RATE,) if self.judge.has_loss else ()), *self.measured.measures)

    def with_trackers(self, *trackers: Tracker, like: str) -> "Experiment":
        """Return this experiment with more trackers, which read the parameters that one of its own reads.

        Args:
            trackers: To join it.
            like: Name of the tracker whose parameters they read.
        """
        more = {tracker.id: tracker for tracker in trackers}
        joined = {**self.joined, **dict.fromkeys(more, like)}
        return replace(self, trackers={**self.trackers, **more}, joined=joined)

    def with_units(self, units: Mapping[str, str]) -> "Experiment":
        """Return this experiment with other units, by the name of a plot, and by "estimate" of the estimate."""
        plots = tuple(replace(plot, unit=units.get(plot.id, plot.unit)) for plot in self.display.plots)
        judge = replace(self.judge, unit=units.get("estimate", self.judge.unit))
        return replace(self, judge=judge, display=replace(self.display, plots=plots))

    def measures_on(self, footage: Footage | None, *, loss_probability: bool = False) -> tuple[Measure, ...]:
        """Return the measures of a run on a recording, or on the scene: without truth, from its own estimates alone.

        Args:
            footage: The recording, if it is on one.
            loss_probability: Whether the probability of a loss was requested.
        """
        known = self.run_measures if footage is None or footage.is_labelled else own_account(self.judge.unit)
        return (*known, MEAN_LOSS_PROBABILITY) if loss_probability else known

    def parameters_on(self, kind: Kind | None) -> Parameters:
        """Return the parameters of runs on a kind of recording, before they are fitted to it; of the scene if None.

        Raises:
            ParameterError: It takes no such recording, or does not declare them.
        """
        if kind is None:
            return self.simulate().parameters
        self.check_footage(kind)
        if self.video.recorded is None:
            raise ParameterError("footage", kind, f"left out: {self.id} does not declare the parameters of recordings")
        return self.video.recorded(kind)

    def doubts(self, *in_force: tuple[str, Any]) -> tuple[Finding, ...]:
        """Return how error bands were found to be off, else whether some are not calibrated; nothing if all are right.

        Args:
            in_force: Trackers by name with their parameters; a doubt about any of them counts.
        """
        found = {it for each in in_force for it in self.findings(*each).values()}
        off, unknown = found - {"right", "uncalibrated"}, found & {"uncalibrated"}
        return tuple(doubt for doubt in DOUBTS if doubt in (off or unknown))

    def findings(self, tracker: str, parameters: Any) -> dict[str, Finding]:  # noqa: ANN401 - the experiment's own model
        """Return what is declared of each band of a tracker with these parameters, by the band's subject."""
        said = self.quality.calibration
        tested = [it for it in said.tested if tracker in it.trackers]
        turned = self._turned(tracker, parameters) if tested else set()
        return {
            band.of: next((it.found for it in tested if it.holds(band.of, parameters, turned)), "uncalibrated")
            for band in said.bands
            if not band.trackers or tracker in band.trackers
        }

    def _turned(self, tracker: str, parameters: Any) -> set[str]:  # noqa: ANN401 - the experiment's own model
        """Return the names of the parameters a tracker reads that differ from the default scene or are missing."""
        standard, scene = self.simulate().parameters, self.quality.calibration.scene
        declared = [it for it in self.declarations(type(standard)) if moves_estimates(it) and it.name != scene]
        read = [it.name for it in declared if not it.trackers or tracker in it.trackers]
        return {name for name in read if getattr(parameters, name, None) != getattr(standard, name)}

    def preset_of(
        self, tracker: str, seed: int, values: Mapping[str, Value], defaults: Mapping[str, Value]
    ) -> Preset | None:
        """Return the preset at the start of a simulated run, if there is one.

        Args:
            tracker: Name of its tracker at frame 0.
            seed: Its seed.
            values: All its parameters at frame 0.
            defaults: The defaults of these parameters.
        """
        return next(
            (
                preset
                for preset in self.presets
                if (preset.tracker, preset.seed) == (tracker, seed) and {**defaults, **preset.parameters} == values
            ),
            None,
        )

    def title_on(self, footage: Footage | None) -> str:
        """Return its name on the screen: of a simulated scene, or of a recording."""
        return self.video.clip_title or self.title if footage else self.title

    def subjects(self, preset: Preset | None, footage: Footage | None = None) -> tuple[str, ...]:
        """Return the main parameters of a preset or a recording; without either, those that any preset sets."""
        if preset is not None:
            return preset.subjects
        if footage is not None and self.video.clip_about:
            return self.video.clip_about
        return tuple(dict.fromkeys(name for each in self.presets for name in each.parameters if name not in each.scene))

    def preset_named(self, name: str) -> Preset:
        """Return a preset.

        Raises:
            RefusedError: The preset is unknown; the sentence lists all of them.
        """
        for preset in self.presets:
            if preset.name == name:
                return preset
        known = ", ".join(preset.name for preset in self.presets)
        raise RefusedError(f"the preset of {self.id} must be one of {known}, got {name!r}", "preset", value=name)

    def measure_named(self, name: str) -> Measure:
        """Return a measure.

        Raises:
            ValueError: Nobody declares one of that name.
        """
        for measure in (HIT_RATE, *self.measured.measures):
            if measure.name == name:
                return measure
        known = ", ".join(measure.name for measure in (HIT_RATE, *self.measured.measures))
        raise ValueError(f"{self.id} has no measure {name!r}, only {known}")

    @property
    def accepts_video(self) -> bool:
        """Whether it can run on a recording."""
        return bool(self.video.footage)

    def check_footage(self, kind: str) -> None:
        """Refuse a recording of a kind that it does not take.

        Raises:
            ParameterError: It takes no recordings, or others.
        """
        if not self.accepts_video:
            raise ParameterError("footage", kind, f"left out: {self.id} takes no recording")
        if kind not in self.video.footage:
            taken = "pictures" if set(self.video.footage) & set(PICTURES) else " or ".join(self.video.footage)
            given = "pictures" if kind in PICTURES else kind
            raise ParameterError("footage", given, f"{taken}: {self.id} takes no other recording")

    def check_names(self, recipe: Recipe) -> None:
        """Refuse a recipe that names a tracker or a parameter that this experiment does not have.

        The declarations of a recipe's filter are unknown before it is executed: with one, any identifier may belong to
        it.

        Raises:
            ParameterError: The tracker or parameter does not exist, for any kind of recording.
        """
        trackers = (*self.trackers, *recipe.filters)
        if recipe.tracker is not None:
            check_tracker(trackers, recipe.tracker)
        kinds = self.video.footage if recipe.footage is not None and self.video.recorded is not None else ()
        known = {name for kind in (None, *kinds) for name in type(self.parameters_on(kind)).model_fields}
        for name, value in ((name, value) for change in recipe.timeline for name, value in change.values.items()):
            if name == "tracker":
                check_tracker(trackers, value)
            elif name not in known | NO_PARAMETERS and not (recipe.filters and name.isidentifier()):
                raise ParameterError(name, value, f"left out: {self.id} has no such parameter")
