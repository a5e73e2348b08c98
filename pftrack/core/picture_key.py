"""Pictures as keys of caches: a frame is tracked first and drawn then, and what it comes to is needed both times."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["PictureKey"]


class PictureKey:
    """A picture as a key: equal to itself alone. As long as it is kept, no other has its identity.

    A picture that may be written should not be kept so: it may become another.
    """

    def __init__(self, image_rgb: NDArray[np.uint8]) -> None:
        self.image_rgb = image_rgb

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PictureKey) and other.image_rgb is self.image_rgb

    def __hash__(self) -> int:
        return id(self.image_rgb)
