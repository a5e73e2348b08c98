"""How like the model things of a scene are: the target itself, its look-alike, and the lawn."""

from dataclasses import dataclass

import numpy as np

from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.experiments.histogram.scene import look_alike_place
from pftrack.reproduce.histogram.trials import lecture
from pftrack.runs.run import Run
from pftrack.vision.likelihoods.histogram import similarity

FRAME = 30
LAWN_ROWS, LAWN_COLUMNS = (40.0, 205.0), (20.0, 60.0, 100.0, 140.0, 180.0, 270.0, 300.0)
"""Middles of windows that show nothing but lawn in that frame, px."""


@dataclass(frozen=True, slots=True)
class Likenesses:
    """What a scene looks like to the model.

    Attributes:
        model_sum: Of the model's shares.
        itself: rho of the model's own window, in frame 0.
        target: rho of the window around the target, in frame 30.
        look_alike: rho of the window around the look-alike, in frame 30.
        lawn: Mean rho of windows of lawn, in frame 30.
    """

    model_sum: float
    itself: float
    target: float
    look_alike: float
    lawn: float


def likenesses(scene: int) -> Likenesses:
    """Return how alike the things of a scene are, by the model that is made of its first picture."""
    experiment = find("histogram")
    run = Run(
        experiment, experiment.simulate(), frames=FRAME + 1, timeline=(Change(0, {**lecture(), "scene_number": scene}),)
    )
    first, state = run.current.frame, run.current.state
    later = run.seek(FRAME).frame
    if first.image_rgb is None or later.image_rgb is None or first.target is None or later.target is None:
        raise ValueError("a lawn has pictures and a target")
    lawn = [np.array((column, row)) for row in LAWN_ROWS for column in LAWN_COLUMNS]
    places = [later.target.position, np.array(look_alike_place(FRAME)), *lawn]
    window, space, model = state.first_window, state.space, state.model
    rho = [similarity(later.image_rgb, place, window, space, model) for place in places]
    itself = similarity(first.image_rgb, first.target.position, window, space, model)
    return Likenesses(float(model.sum()), itself, rho[0], rho[1], float(np.mean(rho[2:])))
