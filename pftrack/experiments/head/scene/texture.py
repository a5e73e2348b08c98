"""The albedo of a face in near-infrared light, as a frontal map over the model's x and y.

Everything is painted from the eleven points of the person: eyes with iris, pupil and glint, lashes and lids, brows,
nostrils, lips and hair, on a skin of smooth noise. Skin is bright in near-infrared light and the iris grey, whatever
their colour. The map is 0.5 mm fine, and edges are soft, so that the picture shows no steps.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.elementary import exponential, power
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.vision.geometry.face_model import FaceModel

__all__ = ["LEFT_MM", "STEP_MM", "TOP_MM", "albedo"]

STEP_MM = 0.5
LEFT_MM, TOP_MM = -80.0, -110.0
COLUMNS, ROWS = 321, 481

SKIN, SCLERA, IRIS, PUPIL, GLINT = 0.62, 0.80, 0.38, 0.08, 1.0
BROW, NOSTRIL, LIPS, MOUTH, HAIR, LASHES = 0.22, 0.12, 0.45, 0.15, 0.15, 0.14
IRIS_RADIUS_MM, PUPIL_RADIUS_MM = 5.8, 2.2
OPENING_UP_MM, OPENING_DOWN_MM = 5.5, 4.0
BROW_LENGTH_MM = 36.0

Map = NDArray[np.float64]


def albedo(model: FaceModel, seed: int) -> NDArray[np.float32]:
    """Return the albedo (rows, columns), 0..1, at x = LEFT_MM + STEP_MM * column and y = TOP_MM + STEP_MM * row.

    Args:
        model: The person's face.
        seed: Of the skin's and the hair's fine structure.
    """
    x, y = np.meshgrid(LEFT_MM + STEP_MM * np.arange(COLUMNS), TOP_MM + STEP_MM * np.arange(ROWS))
    noise = [_smooth_noise(seed, draw, sd_mm) for draw, sd_mm in enumerate((10.0, 2.0, 0.6, 1.0))]
    face = SKIN + 0.02 * noise[0] + 0.012 * noise[1] + 0.01 * noise[2]
    face = _nose(face, x, y, model)
    face = _mouth(face, x, y, model)
    for side in "lr":
        face = _eye(face, x, y, model, side)
        face = _brow(face, x, y, model, side, noise[3])
    line = -72.0 + 0.011 * x**2 + 1.5 * noise[1]
    face = _mix(face, HAIR + 0.03 * noise[3], _below(y - line, 2.0))
    return np.clip(face, 0.03, 1.0).astype(np.float32)


def _eye(face: Map, x: Map, y: Map, model: FaceModel, side: str) -> Map:
    eye, inner, outer = (model[side + name][:2] for name in ("eye", "mc", "lc"))
    # Along the line of the corners, -1..1 inside the opening, and across it, downwards.
    middle, half = (inner + outer) / 2.0, (outer - inner) / 2.0
    length = float(np.hypot(*half))
    along = ((x - middle[0]) * half[0] + (y - middle[1]) * half[1]) / length**2
    across = ((y - middle[1]) * half[0] - (x - middle[0]) * half[1]) / length * np.sign(half[0])
    arc = np.sqrt(np.maximum(1.0 - along**2, 0.0))
    up, down = across + OPENING_UP_MM * arc, across - OPENING_DOWN_MM * arc
    reach = _below(np.abs(along) - 1.0, 0.08)
    fade = exponential(-_fourth(along / 1.15))
    face = face * (1.0 - 0.22 * exponential(-(((x - eye[0]) / 21.0) ** 2 + ((y - eye[1] + 4.0) / 12.0) ** 2) / 1.4))
    face = _mix(
        face, 0.42, 0.55 * fade * exponential(-(((across + 1.75 * OPENING_UP_MM * np.sqrt(fade) - 0.5) / 0.9) ** 2))
    )
    face = face + 0.05 * fade * exponential(-(((across + 1.35 * OPENING_UP_MM * np.sqrt(fade)) / 1.6) ** 2))
    opening = _below(-up, 0.6) * _below(down, 0.6) * reach
    away = np.hypot(x - eye[0], y - eye[1])
    ball = SCLERA - 0.16 * np.abs(along) * along**2 - 0.25 * exponential(-((up / 2.2) ** 2))
    ball = _mix(ball, IRIS + 0.04 * np.sin(0.9 * away), _below(away - IRIS_RADIUS_MM, 0.5))
    ball = _mix(ball, IRIS - 0.12, 0.7 * exponential(-(((away - IRIS_RADIUS_MM + 0.4) / 0.5) ** 2)))
    ball = _mix(ball, PUPIL, _below(away - PUPIL_RADIUS_MM, 0.4))
    ball = _mix(ball, GLINT, _below(np.hypot(x - eye[0] - 2.0, y - eye[1] + 2.0) - 0.8, 0.5))
    face = _mix(face, ball, opening)
    face = _mix(face, LASHES, 0.9 * reach * exponential(-(((up + 0.3) / 1.0) ** 2)))
    face = _mix(face, 0.35, 0.5 * reach * exponential(-((down / 0.6) ** 2)))
    return _mix(face, 0.5, 0.5 * _below(np.hypot(x - inner[0], y - inner[1]) - 1.2, 0.8))


def _brow(face: Map, x: Map, y: Map, model: FaceModel, side: str, grain: Map) -> Map:
    start = model[side + "bro"]
    along = (x - start[0]) * np.sign(start[0]) / BROW_LENGTH_MM
    inside = np.clip(along, 0.0, 1.0)
    arch = start[1] - 5.5 * np.sin(np.pi * power(inside, 0.8)) * (1.0 - 0.35 * inside) + 1.5 * inside
    thickness = (4.2 - 3.0 * inside * np.sqrt(inside)) * np.sqrt(np.clip(along / 0.06 + 1.0, 0.0, 1.0))
    cover = _below(np.abs(y - arch) - thickness, 1.2) * _below(-along * BROW_LENGTH_MM, 0.8)
    return _mix(face, BROW + 0.04 * grain, 0.92 * cover * _below((along - 1.0) * BROW_LENGTH_MM, 1.5))


def _nose(face: Map, x: Map, y: Map, model: FaceModel) -> Map:
    tip_x, tip_y = model["nose"][:2]
    x = x - tip_x
    face = face + 0.05 * exponential(-(((x / 4.0) ** 2 + ((y - tip_y + 2.0) / 5.0) ** 2) / 2.0))
    beside = np.abs(x)
    # The wings of the nose end in a crease, from which a fold runs down beside the mouth.
    crease = np.abs(np.hypot((beside - 9.0) / 1.0, y - tip_y - 3.5) - 7.0)
    outer = _below(9.5 - beside, 1.5) * _below(np.abs(y - tip_y - 4.0) - 6.5, 1.5)
    face = _mix(face, 0.34, 0.6 * outer * exponential(-((crease / 1.1) ** 2)))
    fold = beside - 17.0 - 0.42 * (y - tip_y - 4.0)
    along = _below(tip_y + 6.0 - y, 3.0) * _below(y - tip_y - 24.0, 5.0)
    face = face - 0.05 * along * exponential(-((fold / 1.8) ** 2))
    under = exponential(-_fourth(x / 9.0)) * exponential(-(((y - tip_y - 10.5) / 2.4) ** 2))
    face = face * (1.0 - 0.28 * under)
    nostril = np.hypot((beside - 7.0) / 3.6, (y - tip_y - 9.0 + 0.25 * (beside - 7.0)) / 2.0)
    return _mix(face, NOSTRIL, _below(nostril - 1.0, 0.35))


def _mouth(face: Map, x: Map, y: Map, model: FaceModel) -> Map:
    left, right = model["lmou"], model["rmou"]
    half = (left[0] - right[0]) / 2.0
    along = (x - (left[0] + right[0]) / 2.0) / half
    base = (left[1] + right[1]) / 2.0 + along * (left[1] - right[1]) / 2.0
    arc = np.maximum(1.0 - along**2, 0.0)
    line = base + 0.8 * arc * np.cos(2.2 * np.pi * along)
    upper = line - power(arc, 0.8) * (6.5 - 1.8 * exponential(-((along / 0.13) ** 2)))
    lower = line + power(arc, 0.7) * 8.5
    inside = _below(np.abs(along) - 1.0, 0.03)
    face = face * (1.0 - 0.12 * exponential(-_fourth(along / 0.7) - ((y - lower - 3.0) / 3.5) ** 2))
    lips = _below(upper - y, 0.9) * _below(y - lower, 0.9) * inside
    shade = LIPS + 0.06 * exponential(-(((y - line - 4.0) / 2.5) ** 2)) - 0.04 * _below(y - line, 0.8)
    face = _mix(face, shade, 0.9 * lips)
    width = 0.6 + 0.3 * arc
    face = _mix(face, MOUTH, _below(np.abs(y - line) - width, 0.5) * _below(np.abs(along) - 1.02, 0.03))
    for corner in (left, right):
        face = face * (1.0 - 0.3 * exponential(-((np.hypot(x - corner[0], y - corner[1]) / 2.2) ** 2)))
    return face


def _smooth_noise(seed: int, draw: int, sd_mm: float) -> Map:
    """Return noise of unit variance that is smooth over a distance, (rows, columns)."""
    white = Stream(seed, draw, Purpose.START).standard_normal((ROWS, COLUMNS))
    smooth = cv2.GaussianBlur(white, (0, 0), sd_mm / STEP_MM, borderType=cv2.BORDER_REFLECT)
    unit: Map = (smooth - smooth.mean()) / smooth.std()
    return unit


def _fourth(value: Map) -> Map:
    square: Map = value * value
    return square * square


def _below(value: Map, softness: float) -> Map:
    """Return 1 where a value is below 0, 0 where it is above, and a soft step between."""
    step = np.clip(0.5 - value / (2.0 * softness), 0.0, 1.0)
    soft: Map = step * step * (3.0 - 2.0 * step)
    return soft


def _mix(under: Map, over: Map | float, share: Map) -> Map:
    mixed: Map = under + (over - under) * share
    return mixed
