"""What is known of a recording, to all that compare an estimate with it; tables are read by `pftrack.sources.truth`."""

from collections.abc import Mapping
from typing import Protocol

from pftrack.core.model.frame import Target

__all__ = ["Truth"]


class Truth(Protocol):
    """What is known of a recording: numbers by frame, and the target that they mean."""

    @property
    def rows(self) -> Mapping[int, tuple[float, ...]]:
        """The numbers of each frame that has any, as the file has them."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was passed over in reading, one sentence each."""

    def at(self, frame: int) -> Target | None:
        """Return the target of a frame, or None where there is no truth."""
