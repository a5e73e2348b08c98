"""Results, clip and truth in separate files, combined into one recording of beliefs.

The content of a file determines its kind; of two files of boxes, the name shows which one is the truth.
"""

import hashlib
import io
import re
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import BinaryIO, Literal, TypeAlias

from pftrack.core.model.source import FrameIndex
from pftrack.core.refusal import RefusedError
from pftrack.sources.beliefs.recorder import Recorder
from pftrack.sources.beliefs.sequence import BeliefSequence
from pftrack.sources.formats import Format, sniff
from pftrack.sources.limits import HEAD_BYTES, Limits, check_bytes
from pftrack.sources.results.table import ResultTable
from pftrack.sources.results.writing import read_results_file

Part: TypeAlias = Literal["clip", "results", "truth"]
RESULTS: Part = "results"
TABLE = (".csv", ".tsv", ".txt")
NAMED = b"frame,x,y,w,h\n0,1,1,1,1\n"
"""Beginning of a table after the user has named its columns."""

MOST_FILES = 8
"""More files than this are pictures, or do not belong together."""

TRUE = re.compile(r"(^|[^a-z])(gt|(ground[ _-]?)?truth)([^a-z]|$)", re.IGNORECASE)


def part_names(heads: Mapping[str, bytes], *, by_hand: bool = False) -> dict[Part, str] | None:
    """Return which of several files is what; None if they are something else, such as pictures.

    Args:
        heads: The first `HEAD_BYTES` or fewer of each file, by its name.
        by_hand: Whether the user names the columns of a table that is not understood.

    Raises:
        RefusedError: There are results among them, but they do not belong together.
    """
    if not 2 <= len(heads) <= MOST_FILES:
        return None
    found = {
        name: _sniffed(head) or (_sniffed(NAMED) if by_hand and name.lower().endswith(TABLE) else None)
        for name, head in heads.items()
    }
    kinds = {name: None if each is None else each.kind for name, each in found.items()}
    if "beliefs" not in kinds.values() or "picture" in kinds.values():
        return None
    if others := [name for name, kind in kinds.items() if kind not in {"video", "gif", "beliefs"}]:
        raise RefusedError(f"{others[0]} does not go with results; expected their clip, and boxes that are true")
    clips = [name for name, kind in kinds.items() if kind != "beliefs"]
    if len(clips) > 1:
        raise RefusedError(f"results are of one clip, got {' and '.join(clips)}")
    said = [name for name, kind in kinds.items() if kind == "beliefs"]
    true = [name for name in said if TRUE.search(name) and len(said) > 1]
    results = [name for name in said if name not in true]
    if len(results) != 1 or len(true) > 1:
        raise RefusedError(
            f"of {' and '.join(said)} one should be the results and one the truth; call the truth gt.txt, "
            "or open the results of each tracker for themselves"
        )
    if true and getattr(found[true[0]], "decoder", "") != "results":
        raise RefusedError(f"{true[0]} is a recording; expected a truth of boxes")
    named: dict[Part, list[str]] = {"clip": clips, "results": results, "truth": true}
    return {part: names[0] for part, names in named.items() if names}


def parts_in(folder: Path) -> dict[Part, Path] | None:
    """Return the files of a folder that go together; None if it holds something else, such as pictures."""
    files = {path.name: path for path in folder.iterdir() if path.is_file() and not path.name.startswith(".")}
    if len(files) > MOST_FILES:
        return None
    named = part_names({name: _head(path) for name, path in files.items()})
    return None if named is None else {part: files[name] for part, name in named.items()}


def open_parts(parts: Mapping[Part, Path], limits: Limits, *, index: FrameIndex | None = None) -> BeliefSequence:
    """Open results with their clip and truth.

    Args:
        parts: Files by kind; at least the results, which may be a recording of beliefs.
        limits: Their limits, together.
        index: From an earlier survey of the same content.

    Raises:
        RefusedError: A file is of the wrong kind or broken, or they exceed the limits.
    """
    results, clip, truth = parts["results"], parts.get("clip"), parts.get("truth")
    try:
        check_bytes(sum(path.stat().st_size for path in parts.values()), limits, "the files have")
        digests = []
        for path in parts.values():
            with path.open("rb") as file:
                digests.append(hashlib.file_digest(file, "sha256").digest())
        sha256 = hashlib.sha256(b"".join(digests)).hexdigest()
        known = index if index is not None and index.sha256 == sha256 else None
        recording = _recording(results, truth)
        try:
            return BeliefSequence(
                recording,
                name=results.name,
                sha256=sha256,
                limits=limits,
                index=known,
                clip=clip,
                beside=results.parent,
            )
        except BaseException:
            recording.close()
            raise
    except OSError as error:
        raise RefusedError(f"a file cannot be read ({(error.strerror or 'input or output error').lower()})") from None


def _recording(results: Path, truth: Path | None) -> BinaryIO:
    """Return results as a recording of beliefs, together with the truth."""
    said = _sniffed(_head(results))
    if said is not None and said.kind != "beliefs":
        raise RefusedError(f"{results.name} holds no results")
    if said is not None and said.decoder != "results":
        if truth is not None:
            raise RefusedError("a recording contains its own truth; open it without another truth")
        return results.open("rb")
    recording = io.BytesIO()
    known = None if truth is None else read_results_file(truth)
    record_results(read_results_file(results), recording, truth=known)
    return recording


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(HEAD_BYTES)


def _sniffed(head: bytes) -> Format | None:
    try:
        return sniff(head)
    except RefusedError:
        return None


def record_results(
    table: ResultTable,
    to: str | PathLike[str] | BinaryIO,
    *,
    clip: Path | None = None,
    truth: ResultTable | None = None,
) -> None:
    """Write a tracker's results to a recording.

    Args:
        table: Its results.
        to: Output file.
        clip: Their video.
        truth: True boxes of the same frames.

    Raises:
        OSError: The file cannot be written, or the clip not be read.
    """
    labels = {box.target: box.label for box in table.boxes if box.label}
    remarks = [*table.remarks]
    if truth is not None:
        targets = "1 target" if len(truth.targets) == 1 else f"{len(truth.targets)} targets"
        remarks.append(f"The truth that came along is of {targets} in {truth.frames} frames.")
        remarks += (f"Of the truth: {remark}" for remark in truth.remarks)
    with Recorder(to, clip, remarks=remarks, frames=table.frames, labels=labels) as record:
        for box in table.boxes:
            record(box.frame, box=box[2:6], score=box.score, target=box.target)
        for box in truth.boxes if truth else ():
            record.truth(box.frame, box=box[2:6], target=box.target)
