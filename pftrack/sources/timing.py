"""Timing: when the frames of a video are shown, and whether its own account of that can be trusted.

Frames are counted; a tracker steps from one to the next. Their times matter for speeds on a screen, and as names by
which a seek knows a frame again, for which they must rise from frame to frame.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pftrack.sources.decoder import Decoder

__all__ = ["USUAL_RATE_HZ", "Timing", "measure"]

USUAL_RATE_HZ = 25.0
"""The rate of a sequence that does not tell its own."""

_SLOWEST_HZ, _FASTEST_HZ = 0.01, 1000.0
_SAME_RATE = 0.01
_STEADY = 0.25
_SHORT = 0.9


@dataclass(frozen=True, slots=True)
class Timing:
    """The times of a video's frames.

    Attributes:
        stamps: In the container's ticks, rising; empty if its times are of no use.
        times_s: From 0, s.
        rate_hz: Frames a second, in the mean.
        warnings: Sentences for people about what is odd.
    """

    stamps: tuple[int, ...]
    times_s: tuple[float, ...]
    rate_hz: float
    warnings: tuple[str, ...]


def measure(stamps: Sequence[int | None], decoder: Decoder) -> Timing:
    """Judge the times of all frames that a pass has decoded.

    Args:
        stamps: One a frame, in the container's ticks, as decoded.
        decoder: The one that made the pass.
    """
    tick_s = float(decoder.stream.time_base or 0)
    declared = decoder.stream.average_rate or decoder.stream.guessed_rate
    declared_hz = float(declared) if declared else USUAL_RATE_HZ
    warnings = []
    known = tuple(stamp for stamp in stamps if stamp is not None)
    rising = len(known) == len(stamps) and all(one < other for one, other in pairwise(known))
    if rising and tick_s > 0:
        times_s = (np.array(known) - known[0]) * tick_s
        rate_hz = (len(known) - 1) / times_s[-1] if len(known) > 1 else declared_hz
        if abs(declared_hz / rate_hz - 1) < _SAME_RATE:
            rate_hz = declared_hz  # exact, where measured times are rounded to ticks
        warnings += _unsteady(times_s, tick_s)
    else:
        known, rate_hz = (), declared_hz
        times_s = np.arange(len(stamps)) / rate_hz
    if not _SLOWEST_HZ <= rate_hz <= _FASTEST_HZ:
        warnings.append(f"the frame rate is given as {rate_hz:.4g} Hz; {USUAL_RATE_HZ:g} Hz are taken instead")
        rate_hz = USUAL_RATE_HZ
        times_s = np.arange(len(stamps)) / rate_hz
    warnings = _missing(len(stamps), float(times_s[-1]) + 1 / rate_hz, decoder) + warnings
    return Timing(known, tuple(times_s.tolist()), float(rate_hz), tuple(warnings))


def _unsteady(times_s: np.ndarray[tuple[int, ...], np.dtype[np.float64]], tick_s: float) -> list[str]:
    gaps = np.diff(times_s)
    if gaps.size == 0 or np.ptp(gaps) <= _STEADY * np.median(gaps) + 2 * tick_s:
        return []
    slowest, fastest = 1 / gaps.max(), 1 / gaps.min()
    return [f"the frame rate varies between {slowest:.3g} and {fastest:.3g} Hz; frames play at the mean rate"]


def _missing(frames: int, lasting_s: float, decoder: Decoder) -> list[str]:
    announced, announced_s = decoder.stream.frames, (decoder.duration_us or 0) / 1e6
    if announced > frames:
        return [f"the file announces {announced} frames and {frames} decode; it is cut short or damaged"]
    if announced == 0 and lasting_s < _SHORT * announced_s:
        return [f"the file announces {announced_s:.3g} s and its pictures end after {lasting_s:.3g} s"]
    if decoder.damaged:
        return [f"{decoder.damaged} pictures are damaged and left out"]
    return []
