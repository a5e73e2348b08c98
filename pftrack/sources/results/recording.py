"""Results with their clip and their truth as one recording of beliefs."""

from os import PathLike
from pathlib import Path
from typing import BinaryIO

from pftrack.sources.beliefs.recorder import Recorder
from pftrack.sources.results.table import ResultTable


def record_results(
    table: ResultTable,
    to: str | PathLike[str] | BinaryIO,
    *,
    clip: Path | None = None,
    truth: ResultTable | None = None,
) -> None:
    """Write what a tracker has said, as it says it, to a recording.

    Args:
        table: Its results.
        to: Where to.
        clip: The video that they are of.
        truth: True boxes of the same frames.

    Raises:
        OSError: The file cannot be written, or the clip not be read.
    """
    with Recorder(to, clip, remarks=table.remarks) as record:
        for box in table.boxes:
            record(box.frame, box=box[2:6], score=box.score, target=box.target)
        for box in truth.boxes if truth else ():
            record.truth(box.frame, box=box[2:6], target=box.target)
