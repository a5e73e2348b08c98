"""An experiment with several hypotheses and with an interval.

A signal is followed by three possibilities: where it is, its mirror image, and in every third frame that it stands
still. The test that installs it compares what the page draws with what it wrote down.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model import series as told
from pftrack.core.model.drawing import Drawing, Layer, Polyline
from pftrack.core.model.glossary import Citation, Reference
from pftrack.core.model.parameters import parameter
from pftrack.core.model.series import Plot, Reading, Series, SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Diagnostics, Step, Tracker
from pftrack.core.numerics.random import Generator
from pftrack.experiments.experiment import Display, Experiment, Judge, Measured, Texts
from pftrack.experiments.sine.experiment import SignalParameters, SignalSource

GAIN = 0.4


class BankParameters(SignalParameters, group="Bank"):
    """The signal, and a limit that is drawn."""

    doubt: float = parameter(
        0.3,
        "Doubt",
        "A standard deviation above this is drawn as doubtful.",
        within=(0.01, 1, 0.01),
        role="threshold",
        threshold_of="sigma",
    )
    shown: int = parameter(1, "Shown possibility", "Which possibility is marked.", within=(1, 3, 1), role="drawing")


@dataclass(frozen=True)
class Bank:
    """Possibilities (K, 1) and their weights (K,)."""

    places: NDArray[np.float64]
    weights: NDArray[np.float64]
    parents: tuple[int, ...] = (-1, -1)
    log_evidence: float = 0.0

    @property
    def estimate(self) -> NDArray[np.float64]:
        return self.places[int(self.weights.argmax())]

    @property
    def sigma(self) -> NDArray[np.float64]:
        return np.array([0.1 + 0.1 * float(1.0 - self.weights.max())])

    def arrays(self) -> Mapping[str, NDArray[np.float64]]:
        return {"places": self.places, "weights": self.weights}


def start(target: Target, frame: Frame, parameters: BankParameters, rng: Generator) -> Bank:
    del frame, parameters, rng
    return Bank(np.stack([target.position, -target.position]), np.array([0.5, 0.5]))


def step(state: Bank, frame: Frame, parameters: BankParameters, rng: Generator) -> Bank:
    del parameters, rng
    assert frame.signal is not None
    place = state.places[0] + GAIN * (frame.signal - state.places[0])
    places = [place, -place, state.places[0]][: 3 if frame.index % 3 == 0 else 2]
    raw = np.array([0.6 + 0.01 * (frame.index % 10), 0.3, 0.1])[: len(places)]
    # The best comes from the second one of every tenth frame, the mirror image and what stands still from the first.
    parents = (int(frame.index % 10 == 1), 0, 0)
    return Bank(np.stack(places), raw / raw.sum(), parents[: len(places)])


def measure(state: Bank) -> Mapping[str, SeriesValue]:
    mean, sd = float(state.estimate[0]), float(state.sigma[0])
    places = tuple((float(place),) for (place,) in state.places)
    bank = told.Hypotheses(places, tuple(state.weights.tolist()), state.parents)
    return {"bank": bank, "range": told.Interval(mean - 2 * sd, mean + 2 * sd)}


def true_value(frame: Frame, state: Bank) -> Mapping[str, SeriesValue]:
    del state
    return {"truth": float(frame.target.position[0])} if frame.target else {}


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    del past, other
    shown = min(step.parameters.shown, len(step.state.places)) - 1
    x = 100.0 + 80.0 * float(step.state.places[shown, 0])
    line = np.array([[x, 10.0, 1.0], [x, 90.0, 1.0]], np.float32)
    return Drawing(200, 100, {"estimate": Polyline(line, (0, 114, 178), 3.0, "estimate")}, f"frame {step.frame.index}")


SERIES = (
    Series("bank", "possibilities", shape="hypotheses", components=("value",)),
    Series("range", "range", shape="interval"),
)
BANK = Tracker("bank", start, step, "Bank", "Keeps two or three possibilities.", series=SERIES, measure=measure)
CITATION = Citation(Reference("tests", "phdthesis", ("N. N.",), "The tests", 2026))
EXPERIMENT = Experiment(
    id="bank",
    interface=4,
    title="A bank of possibilities",
    texts=Texts("Which of them is it?", "A signal and its mirror image.", (CITATION,), target="signal"),
    trackers={"bank": BANK},
    frames=60,
    presets=(),
    simulate=lambda: Setup(SignalSource, BankParameters()),
    draw=draw,
    judge=Judge(lambda estimates, truths: np.abs(estimates - truths).mean(axis=-1), ""),
    measured=Measured((Series("truth", "truth"),), true_value),
    display=Display(
        layers=(Layer("estimate"),),
        plots=(
            Plot("hypotheses", "possibilities", "hypotheses", "What it may be.", series=("bank",), truth="truth"),
            Plot("tree", "possibilities", "tree", "Where each comes from.", series=("bank",), shown="shown"),
            Plot("range", "range", "interval", "Where it should be.", series=("range",), truth="truth"),
            *(told.SIGMA, told.SAMPLE_SIZE, told.SAMPLERS),
        ),
        readings=(
            Reading("estimate", "estimate"),
            Reading("particles", "particles"),
            Reading("proposal", "samplers"),
            Reading("most probable", "hypotheses", series="bank"),
            Reading("range", "interval", series="range"),
            told.STEP_TIME,
        ),
    ),
)
