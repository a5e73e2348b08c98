"""The wiring: scene or upload, trackers, drawing, plots and an example sweep."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from pftrack.core.model.diagnostics import Diagnostics, Step
from pftrack.core.model.drawing import Drawing, Key, Layer, Mesh, Picture
from pftrack.core.model.glossary import Citation, Reference
from pftrack.core.model.palette import COLOURS
from pftrack.core.model.plot import ERROR, Plot, Reading
from pftrack.core.model.preset import ExampleSweep, Preset
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import FrameSequence, Truth
from pftrack.core.model.tracker import Tracker
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.shared.recording import RecordingSource
from pftrack.experiments.shared.sketch import SECOND_RUN, at_height, circle
from pftrack.experiments.video import Video
from pftrack_turning.mark import Circle
from pftrack_turning.scene import Scene
from pftrack_turning.tracker import SERIES, Bank, BankParameters, measure, start, step


def simulate() -> Setup:
    """Wire the scene, with a strip in front of where the disc turns."""
    return Setup(Scene, BankParameters(occlusion_width_px=40, occlusion_offset_px=75))


def wire(sequence: FrameSequence, mark: Circle, start: int, truth: Truth | None) -> Setup:
    """Wire a recording on which a person has drawn a circle."""
    (x, y), r = mark.centre, mark.radius
    source = RecordingSource(sequence, (x - r, y - r, 2 * r + 1, 2 * r + 1), start, truth.at if truth else None)
    return Setup(lambda _seed, _parameters: source, BankParameters())


def draw(step: Step, _past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw truth, estimate, and an arrow for each hypothesis."""
    state, image, target = step.state, step.frame.image_rgb, step.frame.target
    drawn = {"picture": Picture(image), "hypotheses": arrows(state)}
    if target is not None:
        drawn["truth"] = circle(target.position, target.size / 2, COLOURS["truth"], "truth")
    drawn["estimate"] = circle(state.estimate, state.radius_px, COLOURS["estimate"], "estimate")
    if other is not None:
        drawn["second"] = circle(np.array(other.estimate), state.radius_px, COLOURS["second"], "second run")
    return Drawing(*image.shape[1::-1], drawn, f"frame {step.diagnostics.frame} · {len(state.parts)} hypotheses")


def arrows(state: Bank) -> Mesh:
    """Return a triangle for each hypothesis, at its place and along its way, the more opaque the more probable."""
    x, y, vx, vy = np.array([part.mean for part in state.parts]).T[:, :, None]
    corners = x + 1j * y + np.exp(1j * np.arctan2(vy, vx)) * state.radius_px * np.array([3, -1 + 1j, -1 - 1j])
    vertices = at_height(np.stack([corners.real, corners.imag], axis=-1).reshape(-1, 2), 2.0)
    faces = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    colours = np.tile([COLOURS["lost"], COLOURS["prediction"], COLOURS["prediction"]], (len(faces), 1))
    return Mesh(vertices, faces, colours.astype(np.uint8), np.repeat(state.weights, 3).astype(np.float32), "hypotheses")


TRACKERS = {
    name: Tracker(name, title, text, partial(start, several), partial(step, several), None, SERIES, measure)
    for name, title, text, several in (
        ("bank", "Bank of turns", "Weighs several rates of turn.", True),
        ("straight", "Straight on", "Expects no turn.", False),
    )
}
BLOM = Reference(
    "blom1988",
    "article",
    ("Henk A. P. Blom", "Yaakov Bar-Shalom"),
    "The interacting multiple model algorithm for systems with Markovian switching coefficients",
    1988,
    {"journal": "IEEE Transactions on Automatic Control", "volume": "33", "number": "8", "pages": "780--783"},
)
LAYERS = (
    Layer("picture"),
    Layer("hypotheses", legend=(Key("prediction", "hypotheses, the more opaque the more probable"),)),
    *(Layer(name, legend=(Key(name, name),)) for name in ("truth", "estimate")),
    SECOND_RUN,
)
EXPERIMENT = Experiment(
    id="turning",
    title="A turn out of sight",
    question="Which way did it turn while nobody could see it?",
    references=(Citation(BLOM),),
    description="A disc turns behind a strip. A filter that expects no turn misses it, a bank of filters does not.",
    unit="px",
    trackers=TRACKERS,
    default_tracker="bank",
    frames=240,
    presets=(Preset("works", "works", "bank"), Preset("straight", "breaks: expects no turn", "straight")),
    layers=LAYERS,
    simulate=simulate,
    video=Video(wire, marks=(Circle,), wanted="a circle around the target"),
    draw=draw,
    error=lambda estimates, truths: np.linalg.norm(estimates - truths, axis=-1),
    target="disc",
    plots=(
        ERROR,
        Plot("places", "y", "hypotheses", "How far down each hypothesis is.", "px", ("places",), component=1),
        Plot("turn", "turn", "interval", "The rates of turn that remain probable.", "deg", ("turn",)),
    ),
    readings=(Reading("estimate", "estimate"), Reading("likeliest", "hypotheses", "px", "places")),
    example_sweep=ExampleSweep({"occlusion_width_px": (0, 20, 40, 60, 80)}, ("bank", "straight"), 4, 120),
    interface=3,
)
