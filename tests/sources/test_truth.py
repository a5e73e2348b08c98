"""Tables of true boxes are read whole or refused with the line that is wrong."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.refusal import RefusedError
from pftrack.sources import truth
from pftrack.sources.results.table import FORMS
from pftrack.sources.truth import BOX_FORM, BOXES, read_table, read_truth, write_table
from tests.making import truth_file


def test_a_box_becomes_a_target_at_its_centre(tmp_path: Path) -> None:
    """A box of 5 x 3 px from (10, 20) is centred on pixel (12, 21), and its size is the longer side."""
    target = read_truth(truth_file(tmp_path, "frame,x,y,w,h\n4,10,20,5,3\n")).at(4)
    assert target is not None
    np.testing.assert_array_equal(target.position, [12.0, 21.0])
    assert (target.size, target.hidden) == (5.0, False)


def test_a_row_without_x_is_a_frame_without_truth(tmp_path: Path) -> None:
    """An empty x, an empty line and an unlisted frame all mean that the truth is not known."""
    table = read_truth(truth_file(tmp_path, "frame,x,y,w,h,state\n0,,,,,absent\n\n,,,,,\n2,1,1,2,2,labelled\n"))
    assert [table.at(frame) is None for frame in range(3)] == [True, True, False]


MANY = ",".join(f"x{number},y{number}" for number in range(1, 1001))
WAY = ",".join(f"{number},{2 * number}" for number in range(1000))


@pytest.mark.parametrize(
    ("text", "boxes"),
    [
        ("\ufeffnote, H,W ,y,x,Frame\nseen,8,4,2,1,7\n", {7: (1.0, 2.0, 4.0, 8.0)}),
        (
            "frame,x1,y1,x2,y2,x3,y3,x4,y4\n0,10,20,30,60,30,20,10,60\n1,5,5,5,5,5,5,5,5\n2,,,,,,,,\n",
            {0: (10, 20, 20, 40)},
        ),
        (f"frame,{MANY}\n0,{WAY}\n", {0: (0, 0, 999, 1998)}),
    ],
    ids=["columns by name, in any order, with others, spaces, capitals and a mark", "corners that cross", "a thousand"],
)
def test_boxes_and_corners_are_read(tmp_path: Path, text: str, boxes: dict[int, tuple[float, ...]]) -> None:
    """A polygon is the box around its corners, in whatever order they come; a point has none."""
    assert dict(read_truth(truth_file(tmp_path, text)).boxes) == boxes


def test_of_several_objects_the_first_is_kept_and_it_is_said(tmp_path: Path) -> None:
    """With an `object` column one object counts in all frames, and a warning says how many there are."""
    rows = "0,a,1,1,2,2\n0,b,9,9,2,2\n0,c,8,8,2,2\n1,b,5,5,2,2\n"
    table = read_truth(truth_file(tmp_path, f"frame,object,x,y,w,h\n{rows}"))
    assert table.boxes == {0: (1.0, 1.0, 2.0, 2.0)}
    assert table.warnings == ("It has 3 targets; only a counts.",)


NOTHING = f"the file does not hold results; expected {', '.join(FORMS.values())}"
FRAME = "frame must be a whole number from 0 to 10,000,000"
TWO = "line 3: target 1 has two boxes in frame 0; one is allowed"
CORNERS = "frame,x1,y1,x2,y2,x3,y3\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", NOTHING),
        ("a,b\n1,2\n", NOTHING),
        ("a,b,c,d,e\n1,2,3,4,5\n", "expected columns such as frame, id, x, y, w, h, got a, b, c, d, e"),
        ("frame,x,y,w,h\n", "the table lists no frames"),
        ("frame,x,y,w,h\n0,1,2\n", "line 2: expected 5 values, got 3"),
        ("frame,x,y,w,h\n-1,1,2,3,4\n", f"line 2: {FRAME}, got '-1'"),
        ("frame,x,y,w,h\n1.5,1,2,3,4\n", f"line 2: {FRAME}, got '1.5'"),
        (f"frame,x,y,w,h\n{10**9},1,2,3,4\n", f"line 2: {FRAME}, got '1000000000'"),
        ("frame,x,y,w,h\n\n0,1,two,3,4\n", "line 3: y must be a number of px, got 'two'"),
        ("frame,x,y,w,h\n0,nan,2,3,4\n", "line 2: x must be a number of px, got 'nan'"),
        ("frame,x,y,w,h\n0,inf,2,3,4\n", "line 2: x must be a number of px, got 'inf'"),
        ("frame,x,y,w,h\n0,1,2,0,4\n", "the table of boxes (CSV) has no box with an area"),
        ("frame,x,y,w,h\n0,1,2,3,4\n0,1,2,3,4\n", TWO),
        (f"{CORNERS}0,nan,2,3,4,5,6\n", "line 2: x1 must be a number of px, got 'nan'"),
        (f"{CORNERS}0,1,1e300,3,4,5,6\n", "line 2: the box at 1, 4 is outside every picture"),
        (f"{CORNERS}0,1,2,3,4,5,\n", "line 2: y3 must be a number of px, got ''"),
        (f"{CORNERS}0,1,2,3,4\n", "line 2: expected 7 values, got 5"),
        (f"{CORNERS}0,1,2,3,4,5,6\n0,1,2,3,4,5,6\n", TWO),
    ],
)
def test_a_wrong_table_is_refused_by_line(tmp_path: Path, text: str, message: str) -> None:
    """The message names the file, the line, what was expected and what was found."""
    with pytest.raises(RefusedError) as caught:
        read_truth(truth_file(tmp_path, text))
    assert str(caught.value) == f"truth.csv: {message}"


def test_more_than_is_read_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Some of many corners would be another box; a large file is not read; a missing one and a folder are named."""
    corners = 100_000
    header = ",".join(f"x{number},y{number}" for number in range(1, corners + 1))
    path = truth_file(tmp_path, f"frame,{header}\n0{',1,2' * corners}\n")
    with pytest.raises(RefusedError, match=r"a table with at most 16,384 columns"):
        read_truth(path)
    monkeypatch.setattr(truth, "LARGEST_FILE_BYTES", 20)
    with pytest.raises(RefusedError, match=r"truth\.csv is larger than the 0 MiB allowed"):
        read_table(path, BOX_FORM)
    with pytest.raises(RefusedError, match=r"the file .*none\.csv does not exist"):
        read_truth(tmp_path / "none.csv")
    with pytest.raises(RefusedError, match="cannot be read: Is a directory"):
        read_truth(tmp_path)


numbers = st.tuples(*[st.floats(-1e5, 1e5)] * 2, *[st.floats(1.5, 1e5)] * 2)


@given(st.dictionaries(st.integers(0, 10_000_000), numbers, min_size=1, max_size=5))
def test_a_written_table_is_read_to_the_same_boxes(
    tmp_path_factory: pytest.TempPathFactory, rows: dict[int, tuple[float, float, float, float]]
) -> None:
    """Whatever the numbers are, in the order of frames."""
    path = truth_file(tmp_path_factory.mktemp("written"), write_table(rows, BOX_FORM))
    assert read_truth(path).rows == rows


def test_a_mark_has_a_part_for_each_column() -> None:
    """In the order of the columns, so that what is marked in a picture is a row of the table."""
    assert BOXES.mark is not None
    marked = BOXES.mark.read({"x": 10, "y": 20, "width": 5, "height": 3}).model_dump()
    row = [marked[part] for part in BOXES.parts]
    assert BOXES.form.allows(row)
    assert write_table({4: row}, BOXES.form) == "frame,x,y,w,h\n4,10,20,5,3\n"


@given(content=st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    """Whatever a file holds, reading it ends in a table or in a `RefusedError`."""
    path = tmp_path_factory.mktemp("truth") / "truth.csv"
    path.write_bytes(b"frame,x,y,w,h\n" + content)
    with suppress(RefusedError):
        read_truth(path)


@pytest.mark.parametrize(("clip", "labelled"), [("ball_green_hand", 213), ("cups_red", 41), ("occlusion_person", 69)])
def test_the_tables_of_real_clips_are_read(real_clips: Path, clip: str, labelled: int) -> None:
    """The tables that come with the sample clips hold as many boxes of their first target."""
    assert len(read_truth(real_clips / clip / "gt.csv").boxes) == labelled
