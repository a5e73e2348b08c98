"""Sequences of benchmarks as they lie on a disk: a folder each, with pictures and a text of true boxes.

| form | pictures | boxes | a line |
|---|---|---|---|
| OTB (Wu, Lim, Yang 2013) | `img/` | `groundtruth_rect.txt` | x, y, w, h; first pixel 1; commas, tabs or spaces |
| VOT (Kristan et al. 2016) | the folder, or `color/` | `groundtruth.txt` | x, y, w, h, or x and y of four corners |

Of four corners the smallest upright box around them is taken. A line whose numbers are not finite, or whose box has no
area, is a frame without truth. Where there are fewer lines than pictures, lines begin with the picture that `cfg.json`
names as `startFrame`, as jwlim/tracker_benchmark has it, or with the first.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pftrack.sources.errors import SourceError
from pftrack.sources.results.numbers import rectangle

__all__ = ["BenchmarkError", "BenchmarkSequence", "find_sequences"]

Rectangle = tuple[float, float, float, float]

LARGEST_TEXT_BYTES = 16 * 1024 * 1024


class BenchmarkError(ValueError):
    """A folder that is no sequence of a benchmark; the message says what was expected."""


@dataclass(frozen=True, slots=True)
class BenchmarkSequence:
    """A sequence of a benchmark.

    Attributes:
        name: Of its folder.
        pictures: The folder of its pictures.
        start: Number of the picture of the first line, from 0.
        frames: How many lines there are.
        boxes: (x, y, w, h) in px by number of the picture, the first pixel being 0; frames without truth are missing.
    """

    name: str
    pictures: Path
    start: int
    frames: int
    boxes: Mapping[int, Rectangle]


def find_sequences(folder: Path) -> list[BenchmarkSequence]:
    """Return the sequence that a folder is, or those of the folders in it, by name.

    Raises:
        BenchmarkError: There is none, or one cannot be read.
    """
    if not folder.is_dir():
        raise BenchmarkError(f"there is no folder {folder}")
    folders = [folder] if _form_of(folder) else sorted(place for place in folder.iterdir() if _form_of(place))
    if not folders:
        raise BenchmarkError(
            f"{folder.name} is no sequence and holds none: expected img/ with groundtruth_rect.txt (OTB), or pictures "
            "with groundtruth.txt (VOT)"
        )
    return [_read(place) for place in folders]


def _form_of(folder: Path) -> tuple[Path, Path, float] | None:
    """Return the pictures, the text, and the number of the first pixel, of a folder that is a sequence."""
    otb, vot = folder / "groundtruth_rect.txt", folder / "groundtruth.txt"
    if otb.is_file() and (folder / "img").is_dir():
        return folder / "img", otb, 1.0
    if vot.is_file():
        return (folder / "color" if (folder / "color").is_dir() else folder), vot, 0.0
    return None


def _read(folder: Path) -> BenchmarkSequence:
    form = _form_of(folder)
    if form is None:
        raise BenchmarkError(f"{folder.name} is no sequence")
    pictures, text, first_pixel = form
    start = _start(folder, pictures)
    place = f"{folder.name}/{text.name}"
    try:
        if text.stat().st_size > LARGEST_TEXT_BYTES:
            raise BenchmarkError(f"{place} is larger than the {LARGEST_TEXT_BYTES // 1024**2} MiB allowed")
        lines = [line for line in text.read_text(encoding="utf-8-sig").splitlines() if line.strip()]
    except (OSError, UnicodeDecodeError):
        raise BenchmarkError(f"{place} cannot be read as text") from None
    boxes = {}
    for number, line in enumerate(lines):
        try:
            x, y, w, h = rectangle(f"{place}, line {number + 1}", line)
        except SourceError as error:
            raise BenchmarkError(str(error)) from None
        if all(math.isfinite(value) for value in (x, y, w, h)) and w > 0 and h > 0:
            boxes[start + number] = (x - first_pixel, y - first_pixel, w, h)
    if start not in boxes:
        raise BenchmarkError(f"{place}, line 1: a tracker begins there, so it must be a box with an area")
    return BenchmarkSequence(folder.resolve().name, pictures, start, len(lines), boxes)


def _start(folder: Path, pictures: Path) -> int:
    """Return which picture the first line is of: the one whose name is the number that `cfg.json` says."""
    try:
        wanted = int(json.loads((folder / "cfg.json").read_text(encoding="utf-8"))["startFrame"])
    except (OSError, ValueError, KeyError, TypeError):
        return 0
    numbers = sorted(int(path.stem) for path in pictures.iterdir() if path.stem.isdecimal())
    return numbers.index(wanted) if wanted in numbers else 0
