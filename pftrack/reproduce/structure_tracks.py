"""Simulated tracks of bodies that are known: a driver's face, and the turning prism (docs/methods/heads.md)."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.geometry.rotation import rotation
from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.core.numerics.elementary import exponential
from pftrack.core.numerics.matrices import pinhole, product
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.head.appearance import EYE_DISTANCE_PX, template_sizes
from pftrack.experiments.head.scene import HeadSource, HeadTarget
from pftrack.experiments.head.scene_parameters import HeadSceneParameters
from pftrack.experiments.prism.scene import FACES, NAMES, VERTICES_MM, visible_faces
from pftrack.vision.geometry.face import FEATURES
from pftrack.vision.likelihoods import template
from pftrack.vision.structure.tracks import Tracks


@dataclass(frozen=True, eq=False)
class SimulatedTracks:
    """Tracks of a body that is known.

    Attributes:
        tracks: Measured positions, px from the principal point, and the variances of their noise.
        shape_mm: (n, 3) the body's points in its own frame.
        names: (n,) of the points.
        focal_px: Focal length of the camera.
        theta_rad: (T, 3) how the body is turned.
        translation_mm: (T, 3) where its origin is in the camera's frame.
        true_px: (T, n, 2) where the points truly are, px from the principal point.
        visible: (T, n) whether each is seen.
    """

    tracks: Tracks
    shape_mm: Floats
    names: tuple[str, ...]
    focal_px: float
    theta_rad: Floats
    translation_mm: Floats
    true_px: Floats
    visible: Bools


# In place of a tracker, each feature's true position on the face is measured with noise whose standard deviation is
# 10^((1 - NCC) / 0.7) px, at least 1 and at most 10, NCC being the correlation of the picture there with the frontal
# template. (Bando 2007, ch. 4 section 5.4, takes the inverse of a probability of the patch, which is not to be had.) So
# nothing hides for long, and the noise changes all the time. Every second frame of the script of motions is used.

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
    correlations: list[Floats] = []
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


# The prism has eight corners and the centres of its six faces. It turns by 1 degree a frame about the vertical axis and
# by 2 about the horizontal one, so that in no frame all fourteen points are seen: a corner is while one of its faces
# is, a centre while its face is. What is hidden is measured all the same, with noise of 50 px (Bando 2007, ch. 4
# section 5.3, with the readings of docs/methods/heads.md).

POINTS_MM: Floats = np.concatenate([VERTICES_MM, VERTICES_MM[np.array(FACES)].mean(axis=1)])
"""(14, 3) corners, then the centres of front, rear, left, right, top and bottom."""
POINTS_MM.flags.writeable = False

CENTRES = slice(len(VERTICES_MM), None)
POINT_NAMES = (*NAMES, "front", "rear", "left", "right", "top", "bottom")

FOCAL_PX = 400.0
TURN_DEG: Floats = np.array([2.0, 1.0, 0.0])
"""A frame, about the horizontal axis, the vertical axis and the line of sight."""

TOUCHING = np.array([[vertex in corners for corners in FACES] for vertex in range(len(VERTICES_MM))])


def prism_tracks(
    seed: int, *, frames: int = FRAMES, distance_mm: float = 150.0, hidden_sd_px: float = 50.0
) -> SimulatedTracks:
    """Return the tracks; the same arguments give the same, to the bit.

    Args:
        seed: Of the noise.
        frames: How many.
        distance_mm: From the camera to the prism's centre.
        hidden_sd_px: Standard deviation of the noise of a hidden point; that of a visible one is 1 px.
    """
    theta, true, visible = _motion(frames, distance_mm)
    sd = np.where(visible, 1.0, hidden_sd_px)[..., None]
    noise = np.stack([Stream(seed, index, Purpose.SCENE).standard_normal(true.shape[1:]) for index in range(frames)])
    tracks = Tracks(true + sd * noise, np.broadcast_to(sd**2, true.shape))
    translation = np.tile([0.0, 0.0, distance_mm], (frames, 1))
    return SimulatedTracks(tracks, POINTS_MM, POINT_NAMES, FOCAL_PX, theta, translation, true, visible)


@lru_cache(maxsize=4)
def _motion(frames: int, distance_mm: float) -> tuple[Floats, Floats, Bools]:
    """Return theta (T, 3), true positions (T, 14, 2) and which points are seen (T, 14)."""
    theta = np.deg2rad(np.arange(frames)[:, None] * TURN_DEG)
    translation = np.array([0.0, 0.0, distance_mm])
    true = np.array([pinhole(product(POINTS_MM, rotation(one).T) + translation, FOCAL_PX) for one in theta])
    faces = np.array([visible_faces(one, translation) for one in theta])
    corners = (faces[:, None] & TOUCHING).any(axis=2)
    return theta, true, np.concatenate([corners, faces], axis=1)
