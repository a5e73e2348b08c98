"""Experiments that are broken in one way each, with the check that finds it and a part of its sentence."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import count
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field, field_validator

from pftrack.core.model.band import ALL, BandTest, Calibration, Finding, FlagBand
from pftrack.core.model.drawing import Ellipse, Points, Primitive, World, WorldDrawing
from pftrack.core.model.marks import Editor, Handle, Mark, MarkNumber
from pftrack.core.model.measures import PICTURE_MEASURES
from pftrack.core.model.model import NoiseScale
from pftrack.core.model.parameters import parameter
from pftrack.core.model.preset import Cure, ExampleSweep, Preset
from pftrack.core.model.series import Series
from pftrack.core.model.source import Frame
from pftrack.core.model.tracker import Step
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment, Measured, Quality
from pftrack.experiments.shared.loss_probability import Logistic, LossDeclaration, LossModel
from pftrack.experiments.sine.experiment import SignalSource, SineParameters

TRACKERS = find("sine").trackers
KALMAN = TRACKERS["kalman"]
BALL = find("ball")
SOUND = replace(
    find("sine"),
    id="under-test",
    trackers={"kalman": KALMAN, **TRACKERS},
    presets=(Preset("works", "works", "kalman"),),
    quality=Quality(Calibration()),
)

SPACE = World("space", "Space", "mm", 5.0)


class Altered:
    """A state that differs from the one within."""

    def __init__(self, state: Any, **other: Any) -> None:
        self.within = state
        self.__dict__.update(other)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.within, name)


def tracking(alter: Callable[[Any, Frame], dict[str, Any]]) -> Experiment:
    """Return an experiment whose tracker alters each state after the first."""

    def step(state: Any, frame: Frame, parameters: Any, rng: Any) -> Altered:
        within = state.within if isinstance(state, Altered) else state
        return Altered(KALMAN.step(within, frame, parameters, rng), **alter(state, frame))

    return replace(SOUND, trackers={**SOUND.trackers, "kalman": replace(KALMAN, step=step)})


def drawing(alter: Callable[[Any, Step, Any, Any], Any]) -> Experiment:
    """Return an experiment that alters its drawings."""

    def draw(step: Step, past: Any, other: Any = None) -> Any:
        return alter(SOUND.draw(step, past, other), step, past, other)

    return replace(SOUND, draw=draw)


def changing_now(change: Callable[[int], dict[str, Any]]) -> Experiment:
    """Return an experiment whose drawings have one primitive with other fields, by the frame."""

    def alter(drawn: Any, step: Step, *_: Any) -> Any:
        changed = {"now": replace(drawn.primitives["now"], **change(step.diagnostics.frame))}
        return replace(drawn, primitives={**drawn.primitives, **changed})

    return drawing(alter)


def displaying(experiment: Experiment, **other: Any) -> Experiment:
    return replace(experiment, display=replace(experiment.display, **other))


def in_world(item: Primitive) -> Experiment:
    """Return an experiment that draws in the world `SPACE`."""
    drawn = WorldDrawing(SPACE, {"it": item})
    return displaying(drawing(lambda flat, *_: replace(flat, worlds=(drawn,))), worlds=(SPACE,))


def declaring(model: type[SineParameters]) -> Experiment:
    return replace(SOUND, simulate=lambda: replace(SOUND.simulate(), parameters=model()))


def showing(source: Callable[[int, Any], Any]) -> Experiment:
    return replace(SOUND, simulate=lambda: replace(SOUND.simulate(), open_source=source))


class NoUnit(SineParameters, group="Signal"):
    """The unit is in the name alone."""

    width_px: float = parameter(1.0, "Width", "How wide.", within=(0, 2, 1))


class Smoothed(SineParameters, group="Signal"):
    """The role of a noise is only to smooth."""

    process_noise_sd: float = parameter(0.001, "Process noise", "How free.", within=(1e-6, 1, 0.0005), role="smoothing")


def refusing(*_: Any, **__: Any) -> Any:
    raise ValueError("too dark")


class Forgiving(SineParameters, group="Signal"):
    """Replaces values that are too large by the largest."""

    width: float = parameter(1.0, "Width", "How wide.", within=(0, 2, 1))

    @field_validator("width", mode="before")
    @classmethod
    def _cut(cls, value: object) -> object:
        return min(value, 2.0) if isinstance(value, float | int) else value


class Restless(SignalSource):
    """Shows another signal at each call."""

    calls = 0

    def frame(self, index: int, history: Any) -> Frame:
        frame = super().frame(index, history)
        self.calls += 1
        return replace(frame, signal=frame.signal + self.calls)


class Quiet(SignalSource):
    """Claims that its noise does not depend on the seed."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.noisy = False


def boasting(factor: float, found: Finding = "right") -> Experiment:
    """Return an experiment whose tracker reports a multiple of its standard deviations."""

    def alter(state: Any, frame: Frame) -> dict[str, Any]:
        made = KALMAN.step(getattr(state, "within", state), frame, SineParameters(), None)
        return {"sigma": factor * made.sigma}

    return replace(tracking(alter), quality=Quality(Calibration(tested=(BandTest(("kalman",), found=found),))))


def escaping() -> Experiment:
    """Return an experiment with a region that should contain the truth, and loses it in one frame."""
    flag = Series("contained", "truth contained", role="flag")
    measured = Measured((flag,), lambda frame, _: {"contained": float(frame.index != 7)})
    calibration = Calibration((FlagBand("region", {ALL: "contained"}),), (BandTest(tuple(SOUND.trackers)),))
    return replace(SOUND, measured=measured, quality=Quality(calibration))


def hidden_state() -> Experiment:
    """Return an experiment whose tracker counts its calls outside its state."""
    calls = count()
    return tracking(lambda *_: {"estimate": np.array([float(next(calls))])})


def changing_states() -> Experiment:
    kept = np.zeros(3)

    def alter(*_: Any) -> dict[str, Any]:
        kept[:] += 1
        return {"arrays": lambda: {"kept": kept}}

    begin = lambda *given: Altered(KALMAN.start(*given), arrays=lambda: {"kept": kept})  # noqa: E731 - a stub
    tracker = replace(tracking(alter).trackers["kalman"], start=begin)
    return replace(SOUND, trackers={**SOUND.trackers, "kalman": tracker})


def jealous_trackers() -> Experiment:
    def step(state: Any, *given: Any) -> Any:
        known = isinstance(state, Altered)
        made = KALMAN.step(state.within if known else state, *given)
        return Altered(made) if known else Altered(made, estimate=np.array([np.nan]))

    start = lambda *given: Altered(KALMAN.start(*given))  # noqa: E731 - a stub
    other = replace(KALMAN, id="jealous", start=start, step=step)
    return replace(SOUND, trackers={**SOUND.trackers, "jealous": other})


def folding(alter: Callable[[Any], dict[str, Any]]) -> Experiment:
    """Return an experiment whose tracker alters its result of many frames at once."""
    tracker = BALL.trackers["h-spf"]

    def fold(*given: Any) -> Any:
        done = tracker.fold(*given)  # type: ignore[misc] # this one has it
        return done and replace(done, **alter(done))

    return replace(BALL, trackers={"h-spf": replace(tracker, fold=fold)}, quality=Quality(Calibration()))


def caption_of_all_frames(drawn: Any, _step: Step, past: Any, _other: Any) -> Any:
    return replace(drawn, caption=f"{len(past)} frames")


def measuring(**other: Any) -> Experiment:
    return replace(SOUND, measured=Measured(measures=(replace(PICTURE_MEASURES[0], **other),)))


SIGNAL = type(TRACKERS["condensation"].model)


def believing(tracker: str, **other: Any) -> Experiment:
    """Return an experiment of one tracker, whose model differs from the sound one."""
    model = type("Broken", (SIGNAL,), other)()
    return replace(SOUND, trackers={tracker: replace(TRACKERS[tracker], model=model)}, presets=())


def heavier(model: Any, state: Any) -> Any:
    cloud = SIGNAL.cloud(model, state)
    return replace(cloud, log_weights=cloud.log_weights + 1.0)


def impossible(_model: Any, states: Any, *_: Any) -> Any:
    return np.full(len(states), -np.inf)


def choosy(state: Any, frame: Frame, parameters: Any, rng: Any) -> Any:
    if parameters.process_noise_sd != 0.001:
        raise ValueError("only .001 will do")
    return KALMAN.step(state, frame, parameters, rng)


def tracking_with(step: Callable[..., Any]) -> Experiment:
    return replace(SOUND, trackers={**SOUND.trackers, "kalman": replace(KALMAN, step=step)})


def told_by_likeness() -> Experiment:
    """Return an experiment whose loss probability rises with the likelihood of the target."""
    histogram = find("histogram")
    series = {one.name: one for one in histogram.trackers["condensation"].series}
    regression = Logistic((0.0,) * 6, (1.0,) * 6, (1.0, *(0.0,) * 5), 0.0)
    return losing(histogram, "condensation", LossModel(("likeness",), regression, series))


def losing(experiment: Experiment, tracker: str, model: LossModel) -> Experiment:
    declared = LossDeclaration(models={tracker: model})
    return replace(experiment, quality=replace(experiment.quality, loss_probability=declared))


class Disc(Mark):
    """A sound kind of mark, which the project does not have."""

    title: ClassVar[str] = "Disc"
    instruction: ClassVar[str] = "Put the disc on the target."

    kind: Literal["disc"] = "disc"
    centre: tuple[float, float]
    radius_px: float = Field(ge=1, le=200)

    def check(self, size: tuple[int, int]) -> None:
        if not all(0 <= place <= extent - 1 for place, extent in zip(self.centre, size, strict=True)):
            raise ParameterError("mark.centre", self.centre, f"within the picture of {size[0]} x {size[1]} px")

    def draw(self) -> Mapping[str, Primitive]:
        axes = np.diag([self.radius_px, self.radius_px]).astype(np.float32)
        return {"disc": Ellipse(np.array([*self.centre, 1.0], np.float32), axes, (0, 114, 178), 2.0, "mark")}

    @classmethod
    def editor(cls) -> Editor:
        radius = MarkNumber(
            name="radius_px", title="Radius", unit="px", minimum=1, maximum=200, step=1, default=20, about="centre"
        )
        return cls.describe(handles=(Handle(name="centre", title="Centre"),), numbers=(radius,))


class Elsewhere(Disc):
    """Drawn on another layer."""

    def draw(self) -> Mapping[str, Primitive]:
        return {"disc": replace(super().draw()["disc"], layer="picture")}


class Anywhere(Disc):
    """Fits every picture."""

    def check(self, size: tuple[int, int]) -> None:
        """Refuse nothing."""


def marked(*kinds: type[Mark], experiment: Experiment = BALL) -> Experiment:
    return replace(experiment, video=replace(experiment.video, marks=kinds))


def wired(wire: Callable[..., Any], **more: Any) -> Experiment:
    """Return the ball with another wiring of recordings."""
    return replace(BALL, video=replace(BALL.video, wire=wire, **more))


AFAR = Points(np.array([[0.0, 0.0, 7.0]], np.float32), np.zeros((1, 3), np.uint8), 1.0, "estimate")


BROKEN: dict[str, tuple[Callable[[], Experiment], str]] = {
    "the registry finds it by its id": (lambda: replace(SOUND, id="unlisted"), "must be registered by an entry point"),
    "it says what it is": (lambda: replace(SOUND, texts=replace(SOUND.texts, question="Why.")), "got 'Why.'"),
    "its parameters are declared whole": (lambda: declaring(NoUnit), "width_px has a unit in its name"),
    "bad values are refused with their field": (lambda: declaring(Forgiving), "width = inf must be refused, and was"),
    "each failure fails in its way, and its cure cures": (
        lambda: replace(BALL, failures=(replace(BALL.failures[0], cure=Cure("Hope.", {})),)),
        "the cure of wrong-dynamics must cure, got: Since frame 4",
    ),
    "its presets run": (
        lambda: replace(SOUND, presets=(Preset("few", "few", "kalman", {"sample_count": 0}),)),
        "the preset few does not fit the experiment: sample_count must be",
    ),
    "its example sweep is a plan": (
        lambda: replace(SOUND, example_sweep=ExampleSweep({"sample_count": (0,)}, ("kalman",), 1, 5)),
        "the example sweep does not fit the experiment: sample_count",
    ),
    "its plots and readings are complete": (lambda: displaying(SOUND, plots=2 * SOUND.display.plots), "twice error"),
    "its layers are named once, and one explains the estimate": (
        lambda: displaying(SOUND, layers=SOUND.display.layers * 2),
        "layers must have unique names, got twice",
    ),
    "its measures are declared whole": (lambda: measuring(description="inside"), "must be a sentence .*, got 'inside'"),
    "estimates are finite and as long as positions are": (
        lambda: tracking(lambda *_: {"estimate": np.zeros(2)}),
        r"the estimate of frame 1 must have the shape \(1,\), got \(2,\)",
    ),
    "its states are values": (changing_states, "kept of the state of frame 0 changed"),
    "measures are a number a frame": (
        lambda: measuring(frames=lambda _: np.zeros(3)),
        "must give numbers .*one a frame",
    ),
    "series are as declared": (
        lambda: replace(SOUND, measured=Measured(measure=lambda frame, _: {f"s{frame.index}": 1.0})),
        "frame 0 has a series 's0', which",
    ),
    "bands hold the truth as often as they say": (
        lambda: boasting(0.02),
        "kalman: the band of the estimate of 50 % holds the truth in .*: it is declared right, and is overconfident",
    ),
    "frames are the same when asked for again": (lambda: showing(Restless), "depends on which frames were asked for"),
    "only a noisy source depends on the seed": (lambda: showing(Quiet), "frame 0 depends on the seed"),
    "another process gives the same numbers": (lambda: replace(SOUND, id="unlisted"), "cannot compute .*'unlisted'"),
    "a batch gives the numbers of live runs": (
        lambda: folding(lambda done: {"estimates": done.estimates + 1e-9}),
        "a batch gives other estimates than a live run",
    ),
    "any tracker takes over from any other": (jealous_trackers, r"frame \d is \(nan,\) after the tracker changed"),
    "seeking gives the same numbers": (hidden_state, "a run that seeks to and fro must reach the same estimates"),
    "a branch shares the past and gives the same numbers": (hidden_state, "a branch that changes nothing must give"),
    "what only smooths changes no estimate": (lambda: declaring(Smoothed), "which only smooths, is 1e-06 must give"),
    "a saved run gives the same numbers": (hidden_state, "the run from its file .* differs from frame 1 on"),
    "its kinds of mark describe themselves": (lambda: marked(Disc, experiment=SOUND), "no recordings, and has 1 kind"),
    "bad marks are refused with their field": (lambda: marked(Anywhere), "of 320 x 240 px, and was accepted"),
    "marks survive their JSON and can be drawn": (lambda: marked(Elsewhere), "be drawn on the layer 'mark', got"),
    "drawings keep to the picture and to declared layers": (
        lambda: changing_now(lambda _: {"layer": "secret"}),
        "now is drawn on the undeclared layer 'secret'",
    ),
    "what is drawn in a world keeps to it": (lambda: in_world(AFAR), "within 5 mm of .* 'space', got 7 mm"),
    "a film of its scene is tracked from a mark": (lambda: wired(refusing), "must be taken, and is refused: too dark"),
    "its loss probability rises when it searches, or when little is like its target": (
        told_by_likeness,
        "the loss probability of condensation must not fall when nothing is like its target",
    ),
    "its loss probability is one, told at once or frame by frame": (
        lambda: losing(SOUND, "kalman", LossModel(("evidence",), Logistic((), (), (), 0.0))),
        "the loss probability of kalman must weigh 6 features, got 0",
    ),
    "particles can be laid open": (lambda: believing("condensation", cloud=heavier), "must sum to 1 in frame 1"),
    "a likelihood can be asked at any state, and says what the filter weighs by": (
        lambda: believing("condensation", log_likelihood=lambda *asked: 2.0 * SIGNAL.log_likelihood(*asked)),
        "the likelihood differs from the weights that the filter gave in frame 1 by",
    ),
    "a linear model is that of the filter, and its noises are scaled as declared": (
        lambda: believing("kalman", scales={"assumed_noise_sd": NoiseScale("observation", is_variance=True)}),
        "assumed_noise_sd must scale the observation noise, and nothing else",
    ),
    "a likelihood covers the picture": (
        lambda: believing("condensation", axes=(0, 1), weighs=False, log_likelihood=impossible),
        "a likelihood must be possible somewhere in the picture",
    ),
    "other seeds from a frame on are a branch with these seeds": (hidden_state, "frame .* other errors than a branch"),
    "every change that is tried of a run can be computed": (lambda: tracking_with(choosy), "only .001 will do"),
    "a drawing holds what can be shown": (
        lambda: changing_now(lambda _: {"width": math.nan}),
        "now in frame 0 cannot be shown: width must be a finite number that is not negative, got nan",
    ),
    "what has a name in a drawing stays what it is": (
        lambda: changing_now(lambda frame: {"layer": ("estimate", "truth")[frame % 2]}),
        "now is a Ellipse on the layer 'truth' in frame 1, and was a Ellipse on 'estimate' before",
    ),
    "a drawing shows no future": (lambda: drawing(caption_of_all_frames), "frame 6 is drawn differently once later"),
    "a second run can be drawn beside it": (
        lambda: drawing(lambda _, step, past, __: SOUND.draw(step, past)),
        "nothing is drawn of a second run",
    ),
    "a tracker that joins it is drawn": (
        lambda: drawing(lambda drawn, step, *_: replace(drawn, caption=TRACKERS[step.tracker].title)),
        "a step of a tracker that joins the experiment must be drawn, got KeyError: 'joined-later'",
    ),
}
