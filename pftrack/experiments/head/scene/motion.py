"""How the head moves: its script, and how changes of speed and amplitude enter it.

Rest, two turns to either side, rest, two nods, rest, two rolls, rest, with a small wobble on all axes throughout. At
speed 1 the script takes 900 frames, 330 of them with an axis beyond 20 degrees; then it repeats without a jump.

What is asked for in mid-run must not make the head jump either, and a frame must remain a function of the history of
parameters alone. So the place in the script is the sum of all past speeds, and the amplitude in force follows the one
asked for with a lag of half a second, written in closed form over the spans of the history.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.head.scene.parameters import HeadSceneParameters

__all__ = ["SCRIPT_FRAMES", "angles_rad", "eased_amplitude", "script_time"]

SCRIPT_FRAMES = 900
UNITS = 600.0
"""The script's own measure of time."""

SEGMENTS = ((30.0, 190.0, 1, 35.0), (210.0, 370.0, 0, 25.0), (390.0, 550.0, 2, 25.0))
"""First and last unit, axis of rotation (0 is the nod) and amplitude in degrees."""

EASE = 0.06
WOBBLE_FROM, WOBBLE_FULL = 10.0, 50.0
"""Frames between which the wobble fades in, so that the head begins at theta = 0."""

LAG_FRAMES = 15.0

Spans = Sequence[tuple[int, HeadSceneParameters]]


def script_time(spans: Spans) -> float:
    """Return how many runs of the script have passed: 1 at the end of the first.

    Args:
        spans: How many steps were taken with which parameters.
    """
    return sum(steps * parameters.speed for steps, parameters in spans) / SCRIPT_FRAMES


def eased_amplitude(spans: Spans, initial: float) -> float:
    """Return the amplitude in force, which follows the one asked for with a lag.

    Args:
        spans: How many steps were taken with which parameters.
        initial: The amplitude at frame 0.
    """
    amplitude = initial
    for steps, parameters in spans:
        amplitude = parameters.amplitude + (amplitude - parameters.amplitude) * math.exp(-steps / LAG_FRAMES)
    return float(amplitude)


def angles_rad(time: float, amplitude: float) -> NDArray[np.float64]:
    """Return theta (3,) in rad: nod (down is positive), turn (to image left), roll (clockwise in the image).

    Args:
        time: Runs of the script, from 0.
        amplitude: Factor on all angles; 1 is the script's.
    """
    unit = UNITS * (time % 1.0)
    degrees = _wobble_deg(time)
    for first, last, axis, peak in SEGMENTS:
        part = (unit - first) / (last - first)
        if 0.0 <= part < 1.0:
            ease = min(min(part, 1.0 - part) / EASE, 1.0)
            degrees[axis] += peak * ease * np.sin(4.0 * np.pi * part)
    return np.deg2rad(amplitude * degrees)


def _wobble_deg(time: float) -> NDArray[np.float64]:
    fade = min(max((SCRIPT_FRAMES * time - WOBBLE_FROM) / (WOBBLE_FULL - WOBBLE_FROM), 0.0), 1.0)
    turn = 2.0 * np.pi * time
    nod, yaw, roll = np.sin(5.3 * turn), np.sin(4.1 * turn + 1.0) - np.sin(1.0), np.sin(3.7 * turn)
    return fade * np.array([2.0 * nod, 2.0 * yaw, 1.5 * roll])
