"""Tables of true boxes are read whole or refused with the line that is wrong."""

from contextlib import closing, suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pftrack
from pftrack.core.refusal import RefusedError
from pftrack.sources import truth
from pftrack.sources.limits import DEFAULT_LIMITS
from pftrack.sources.results.parts import open_parts
from pftrack.sources.results.table import FORMS
from pftrack.sources.truth import BOX_FORM, BOXES, boxes_outside, read_table, read_truth, write_table
from tests.making import truth_file


def test_a_box_becomes_a_target_at_its_centre(tmp_path: Path) -> None:
    """A box of 5 x 3 px from (10, 20) is centred on pixel (12, 21), and its size is the longer side.

    An empty x, an empty line and an unlisted frame all mean that the truth is not known.
    """
    rows = "0,,,,,absent\n\n,,,,,\n2,10,20,5,3,labelled\n"
    table = read_truth(truth_file(tmp_path, f"frame,x,y,w,h,state\n{rows}"))
    assert table.at(0) is table.at(1) is None
    target = table.at(2)
    np.testing.assert_array_equal(target.position, [12.0, 21.0])
    assert (target.size, target.hidden) == (5.0, False)


MANY = ",".join(f"x{number},y{number}" for number in range(1, 1001))
WAY = ",".join(f"{number},{2 * number}" for number in range(1000))


@pytest.mark.parametrize(
    ("text", "boxes", "told"),
    [
        ("\ufeffnote, H,W ,y,x,Frame\nseen,8,4,2,1,7\n", {7: (1.0, 2.0, 4.0, 8.0)}, ()),
        (
            "frame,x1,y1,x2,y2,x3,y3,x4,y4\n0,10,20,30,60,30,20,10,60\n1,5,5,5,5,5,5,5,5\n2,,,,,,,,\n",
            {0: (10, 20, 20, 40)},
            ("No box with an area: line 3, line 4.",),
        ),
        (f"frame,{MANY}\n0,{WAY}\n", {0: (0, 0, 999, 1998)}, ()),
        (
            "frame,object,x,y,w,h\n0,a,1,1,2,2\n0,b,9,9,2,2\n1,b,5,5,2,2\n",
            {0: (1.0, 1.0, 2.0, 2.0)},
            ("It has 2 targets; only a counts.",),
        ),
    ],
    ids=["columns by name, in any order", "corners that cross", "a thousand", "several targets"],
)
def test_tables_are_read(tmp_path: Path, text: str, boxes: dict[int, tuple[float, ...]], told: tuple[str, ...]) -> None:
    """A polygon is the box around its corners, in any order; a point has none. The first of several targets counts."""
    table = read_truth(truth_file(tmp_path, text))
    assert (dict(table.boxes), table.warnings) == (boxes, told)


NOTHING = f"the file does not hold results; expected {', '.join(FORMS.values())}"
CORNERS = "frame,x1,y1,x2,y2,x3,y3\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", NOTHING),
        ("a,b,c,d,e\n1,2,3,4,5\n", "expected columns such as frame, id, x, y, w, h, got a, b, c, d, e"),
        ("frame,x,y,w,h\n", "the table lists no frames"),
        ("frame,x,y,w,h\n\n0,1,two,3,4\n", "line 3: y must be a number of px, got 'two'"),
        ("frame,x,y,w,h\n0,nan,2,3,4\n", "line 2: x must be a number of px, got 'nan'"),
        (f"{CORNERS}0,1,1e300,3,4,5,6\n", "line 2: the box at 1, 4 is outside every picture"),
        (f"{CORNERS}0,1,2,3,4,5,\n", "line 2: y3 must be a number of px, got ''"),
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
    marked = BOXES.mark.read({"x": 10, "y": 20, "width": 5, "height": 3}).model_dump()
    row = [marked[part] for part in BOXES.parts]
    assert BOXES.form.allows(row)
    assert write_table({4: row}, BOXES.form) == "frame,x,y,w,h\n4,10,20,5,3\n"


@given(
    st.sampled_from([b"frame,x,y,w,h\n", b"PK\x03\x04", b"{", b"<", b"1,2", b"\xff\xfe", b'"']), st.binary(max_size=200)
)
def test_any_bytes_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, head: bytes, content: bytes) -> None:
    """Whatever a file holds, reading it ends in a table or in a `RefusedError`."""
    path = tmp_path_factory.mktemp("truth") / "truth.csv"
    path.write_bytes(head + content)
    with suppress(RefusedError):
        read_truth(path)


# True boxes that cannot belong to their pictures.

INSIDE = (10.0, 20.0, 30.0, 40.0)
PARTLY = (-29.5, 118.0, 30.0, 40.0)
RIGHT, ABOVE = (160.0, 20.0, 30.0, 40.0), (10.0, -40.0, 30.0, 40.0)


def told(*boxes: tuple[float, ...]) -> tuple[str, ...]:
    return boxes_outside(enumerate(boxes), 160, 120)


@pytest.mark.parametrize("boxes", [(), (INSIDE,), (PARTLY,) * 9, (INSIDE, RIGHT), (PARTLY, PARTLY, ABOVE, RIGHT)])
def test_a_target_may_leave_the_picture(boxes: tuple[tuple[float, ...], ...]) -> None:
    """Nothing is said of boxes that are partly in the picture, nor where half of them or fewer are outside."""
    assert told(*boxes) == ()


def test_boxes_of_another_picture_are_told_by_frame() -> None:
    """The sentence has their number, their frames, the first of them, and what to do."""
    (sentence,) = told(INSIDE, RIGHT, RIGHT, ABOVE, INSIDE, RIGHT)
    assert sentence == (
        "4 of 6 true boxes lie wholly outside the picture of 160 x 120 px: frames 1 to 3 and 5; that of frame 1 is "
        "160, 20, 30, 40. If they were drawn on a clip of another size, scale them to this one, and check the order of "
        "the columns: x, y, w, h."
    )
    (sentence,) = told(ABOVE)
    assert sentence.startswith("The only true box lies wholly outside the picture of 160 x 120 px: frame 0; that of ")
    (sentence,) = told(*(RIGHT, INSIDE, RIGHT, RIGHT) * 5)
    assert ": frames 0, 2 to 4, 6 to 8 and 8 more; " in sentence


def test_a_recording_of_a_loop_tells_it(tmp_path: Path) -> None:
    """A recording of a loop with pictures reports it; on paper, no box is outside."""
    for name, pictures in (("seen", np.zeros((6, 120, 160), np.uint8)), ("paper", None)):
        with pftrack.record(tmp_path / f"{name}.pft", source=pictures) as rec:
            for t in range(6):
                rec(t, box=INSIDE, true_box=RIGHT if t > 1 else INSIDE)
        told = "4 of 6 true boxes lie wholly outside the picture of 160 x 120 px: frames 2 to 5"
        with closing(open_parts({"results": tmp_path / f"{name}.pft"}, DEFAULT_LIMITS)) as sequence:
            assert [one.partition(";")[0] for one in sequence.index.warnings] == ([told] if name == "seen" else [])
