"""What the tests of videos share: how a film is opened here, and what the plainest way of decoding gives."""

from collections.abc import Callable
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.source import FrameIndex
from pftrack.sources.limits import Limits
from pftrack.sources.sequence import open_sequence
from pftrack.sources.video import VideoSequence

Film = Callable[..., Path]
Draw = Callable[..., NDArray[np.uint8]]
Read = Callable[[NDArray[np.uint8]], int]


def opened(path: Path, limits: Limits | None = None, index: FrameIndex | None = None) -> VideoSequence:
    sequence = open_sequence(path, limits or Limits(), index=index)
    assert isinstance(sequence, VideoSequence)
    return sequence


def decoded(path: Path) -> list[NDArray[np.uint8]]:
    """Decode from first to last in the plainest way."""
    with av.open(str(path)) as container:
        container.streams.video[0].codec_context.thread_count = 1
        return [np.asarray(frame.to_ndarray(format="rgb24"), np.uint8) for frame in container.decode(video=0)]
