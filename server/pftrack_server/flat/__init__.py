"""The flat view: a session's drawings as binary messages, for pages that paint them from the front on a canvas.

`codec` is the form of a message, and is used by the worker, which has the drawing first; `feed` hands the newest
message to all pages that look on, each at its own pace.
"""

from pftrack_server.flat.codec import DrawingEncoder, EncodedDrawing, decode
from pftrack_server.flat.feed import DrawingFeed

__all__ = ["DrawingEncoder", "DrawingFeed", "EncodedDrawing", "decode"]
