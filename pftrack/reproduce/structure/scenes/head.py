"""Tracks of a driver's face: eleven features over 360 frames, with noise by how they look.

In place of a tracker, each feature's true position is measured with noise whose standard deviation is
10^((1 - NCC) / 0.7) px, at least 1 and at most 10, NCC being the correlation of the picture there with the frontal
template. (Bando 2007, ch. 4 section 5.4, takes the inverse of a probability of the patch, which is not to be had.) So
nothing hides for long, and the noise changes all the time. Every second frame of the script of motions is used.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.core.numerics.elementary import exponential
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.head.scene import HeadSceneParameters, HeadSource
from pftrack.experiments.head.scene.truth import HeadTarget
from pftrack.experiments.head.trackers.templates import EYE_DISTANCE_PX, template_sizes
from pftrack.reproduce.structure.scenes.simulated import SimulatedTracks
from pftrack.vision.geometry.face_model import FEATURES
from pftrack.vision.likelihoods import template
from pftrack.vision.structure.tracks import Tracks

__all__ = ["FRAMES", "head_tracks"]

FRAMES = 360
EVERY = 2
VIDEO_SEED = 0
"""Of the pictures: all trials see one video."""

LN_10 = 2.302585092994046
SPAN = 0.7
"""How far below 1 a correlation must be for the greatest noise, ten times the least."""


def head_tracks(driver: int, seed: int, *, frames: int = FRAMES) -> SimulatedTracks:
    """Return the tracks; the same arguments give the same, to the bit.

    Args:
        driver: The person's seed.
        seed: Of the noise.
        frames: How many, of every second of the script's.
    """
    video = _video(driver, frames)
    true, sd = video.true_px, np.sqrt(video.tracks.variances)
    noise = np.stack([Stream(seed, index, Purpose.SCENE).standard_normal(true.shape[1:]) for index in range(frames)])
    return replace(video, tracks=Tracks(true + sd * noise, video.tracks.variances))


@lru_cache(maxsize=4)
def _video(driver: int, frames: int) -> SimulatedTracks:
    """Return the tracks without noise; drawing the pictures takes seconds."""
    scene = revise(HeadSceneParameters(), {"person": driver})
    source, history = HeadSource(VIDEO_SEED, scene), History(((0, scene),))
    sizes = template_sizes(FEATURES, EYE_DISTANCE_PX)
    templates: template.Templates | None = None
    targets: list[HeadTarget] = []
    correlations: list[NDArray[np.float64]] = []
    for index in range(0, EVERY * frames, EVERY):
        frame = source.frame(index, history)
        target = frame.target
        if frame.image_rgb is None or not isinstance(target, HeadTarget) or target.landmarks is None:
            raise RuntimeError("the simulated head has pictures and knows its features")
        grey, points = template.luma(frame.image_rgb), target.landmarks.points_px
        if templates is None:
            templates = template.cut(grey, points, sizes)
        targets.append(target)
        correlations.append(template.correlations(grey, points[:, None], templates)[:, 0])
    lack = np.clip((1.0 - np.array(correlations)) / SPAN, 0.0, 1.0)
    landmarks = [target.landmarks for target in targets if target.landmarks is not None]
    true = np.array([one.points_px for one in landmarks]) - source.centre_px
    variances = np.broadcast_to(exponential(2.0 * LN_10 * lack)[..., None], true.shape)
    return SimulatedTracks(
        Tracks(true, variances),
        source.model.points_mm,
        FEATURES,
        source.focal_px,
        np.array([target.position for target in targets]),
        np.array([target.translation_mm for target in targets]),
        true,
        np.array([one.visible for one in landmarks]),
    )
