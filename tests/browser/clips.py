"""Clips for the upload page, encoded from pictures."""

from collections.abc import Iterable
from io import BytesIO
from typing import Any

import av
import numpy as np


def encoded(pictures: Iterable[Any], *, rate: int = 30, crf: int = 12) -> bytes:
    """Return an MP4 file of pictures (height, width, 3), RGB."""
    file, pictures = BytesIO(), list(pictures)
    with av.open(file, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=rate, options={"crf": str(crf)})
        stream.height, stream.width, stream.pix_fmt = *pictures[0].shape[:2], "yuv420p"
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")))
        container.mux(stream.encode(None))
    return file.getvalue()
