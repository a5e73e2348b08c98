"""Folders of benchmarks, as they lie on a disk."""

from pathlib import Path

import pytest

from pftrack.analysis.evaluation import find_sequences
from pftrack.core.refusal import RefusedError
from tests.analysis.clips import BOX, FRAMES, write_otb, write_pictures


@pytest.mark.parametrize("separator", [",", "  "])
def test_otb_counts_from_one(tmp_path: Path, separator: str) -> None:
    """Boxes of OTB are read with commas, tabs or spaces, and their first pixel is 1."""
    (found,) = find_sequences(write_otb(tmp_path / "Clip", separator=separator))
    assert (found.name, found.start, found.frames) == ("Clip", 0, FRAMES)
    assert found.boxes[0] == BOX
    assert found.boxes[1] == (22, 14, 12, 16)


@pytest.mark.parametrize("colour", ["color", "."])
def test_vot_may_have_corners(tmp_path: Path, colour: str) -> None:
    """Four corners of VOT become the upright box around them; what is not finite is a frame without truth."""
    write_pictures(tmp_path / "clip" / colour, frames=3)
    (tmp_path / "clip" / "groundtruth.txt").write_text("20,14,12,16\n22,14,34,15,33,30,21,29\nNaN,NaN,NaN,NaN\n")
    (found,) = find_sequences(tmp_path)
    assert found.frames == 3
    assert found.boxes == {0: (20, 14, 12, 16), 1: (21, 14, 13, 16)}


@pytest.mark.parametrize(
    ("text", "said"), [("1,2,3", "4 numbers"), ("1,2,0,4", "no box with an area"), ("", "is not a sequence")]
)
def test_what_is_no_box_or_no_sequence_is_refused(tmp_path: Path, text: str, said: str) -> None:
    """A refusal names the file, and the line or what is missing; so is a folder without any, and one that is none."""
    write_pictures(tmp_path / "clip")
    if text:
        (tmp_path / "clip" / "groundtruth.txt").write_text(text)
    with pytest.raises(RefusedError, match=said):
        find_sequences(tmp_path)
    with pytest.raises(RefusedError, match="does not exist"):
        find_sequences(tmp_path / "none")


def test_lines_that_nobody_can_place_are_refused(tmp_path: Path) -> None:
    """cfg.json says where the lines begin; without it fewer lines than pictures may begin anywhere: no guess."""
    folder = write_otb(tmp_path / "Clip")
    (folder / "cfg.json").write_text('{"startFrame": 3}')
    text = folder / "groundtruth_rect.txt"
    for lines in (6, 3):
        text.write_text("".join(text.read_text().splitlines(keepends=True)[:lines]))
        assert find_sequences(tmp_path)[0].start == 2
    (folder / "cfg.json").unlink()
    with pytest.raises(RefusedError, match=r"has 3 lines: write the number of the picture of the first line"):
        find_sequences(tmp_path)


def test_two_targets_are_two_sequences(tmp_path: Path) -> None:
    """As Jogging of OTB has it; an empty text, as in Human4, does not count."""
    folder = write_otb(tmp_path / "Clip")
    text = folder / "groundtruth_rect.txt"
    (folder / "groundtruth_rect.2.txt").write_text(text.read_text())
    text.rename(folder / "groundtruth_rect.1.txt")
    (folder / "groundtruth_rect.3.txt").touch()
    assert [found.name for found in find_sequences(tmp_path)] == ["Clip-1", "Clip-2"]
