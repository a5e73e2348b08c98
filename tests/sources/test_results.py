"""Results of trackers: each form is known by its content, read to the pixel, and written so that it is read again."""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pftrack
from pftrack.core.refusal import RefusedError
from pftrack.sources.formats import sniff
from pftrack.sources.limits import HEAD_BYTES
from pftrack.sources.results.parts import part_names
from pftrack.sources.results.table import FORMS, Box, ResultTable, columns_in, form_of, preview, rename
from pftrack.sources.results.writing import read_results, write_results
from pftrack.sources.sequence import open_sequence
from pftrack.vision.film import FilmWriter

# Lines of MOT16's own example of a result, and of its ground truth (motchallenge.net/instructions).
MOT = "1, 3, 794.27, 247.59, 71.245, 174.88, -1, -1, -1, -1\n1, 6, 1648.1, 119.61, 66.504, 163.24, -1, -1, -1, -1\n"
MOT += "2, 3, 791.27, 247.59, 71.245, 174.88, -1, -1, -1, -1\n"
MOT_TRUTH = "1,1,912,484,97,109,0,7,1\n2,1,912,484,97,109,0,7,1\n"
MOT_TRUTH += "1,2,1338,418,167,379,1,1,1\n2,2,1342,417,168,380,1,1,1\n"

# As CVAT 2 writes "CVAT for video 1.1", shortened.
CVAT = """<?xml version="1.0" encoding="utf-8"?>
<annotations>
  <meta><task><size>4</size></task></meta>
  <track id="0" label="person" source="manual">
    <box frame="0" keyframe="1" outside="0" occluded="0" xtl="10.50" ytl="20.00" xbr="40.50" ybr="60.00" z_order="0"/>
    <box frame="1" keyframe="0" outside="0" occluded="0" xtl="11.50" ytl="20.00" xbr="41.50" ybr="60.00" z_order="0"/>
    <box frame="2" keyframe="1" outside="1" occluded="0" xtl="11.50" ytl="20.00" xbr="41.50" ybr="60.00" z_order="0"/>
  </track>
  <track id="1" label="dog" source="manual">
    <box frame="3" keyframe="1" outside="0" occluded="0" xtl="1.00" ytl="2.00" xbr="3.00" ybr="5.00" z_order="0"/>
    <polygon frame="1" keyframe="1" outside="0" occluded="0" points="1,2;3,4;5,6" z_order="0"/>
  </track>
</annotations>
"""

# As MMTracking's CocoVID has it, and YouTube-VIS.
COCO = {
    "videos": [{"id": 1, "name": "walk"}],
    "images": [{"id": n + 5, "video_id": 1, "frame_id": n, "file_name": f"{n}.jpg"} for n in range(3)],
    "annotations": [
        {"id": 1, "image_id": 5, "video_id": 1, "category_id": 1, "instance_id": 9, "bbox": [1, 2, 3, 4]},
        {"id": 2, "image_id": 7, "video_id": 1, "category_id": 1, "instance_id": 9, "bbox": [2.5, 2, 3, 4]},
    ],
    "categories": [{"id": 1, "name": "person"}],
}
VIS = {
    "videos": [{"id": 1, "length": 3}],
    "annotations": [{"id": 4, "video_id": 1, "category_id": 1, "bboxes": [[1, 2, 3, 4], None, [2, 2, 3, 4]]}],
}


def read(data: object, **options: Any) -> ResultTable:
    """Read a text, or anything else as JSON."""
    return read_results((data if isinstance(data, str) else json.dumps(data)).encode(), **options)


def places(data: object, **options: Any) -> list[tuple[float, ...]]:
    return [tuple(box[:6]) for box in read(data, **options).boxes]


TEN = (0, 1, 10, 20, 30, 40)


def test_mot_counts_from_one() -> None:
    """Frames and pixels of MOTChallenge begin at 1, unless there is a frame 0; those of other tables begin at 0.

    A table whose first frame is 1 has a remark, and counts from 1 on request.
    """
    table = read(MOT)
    assert (table.form, table.targets, table.frames) == ("mot", (3, 6), 2)
    assert tuple(table.boxes[0][:6]) == pytest.approx((0, 3, 793.27, 246.59, 71.245, 174.88))
    assert table.remarks == ("Its first frame was taken as 1.",)
    zero = read(MOT.replace("1, ", "0, ", 1))
    assert zero.boxes[0].frame == 0
    assert "as there is a frame 0" in zero.remarks[0]
    assert places(MOT, first_frame=1, first_pixel=0)[0][2] == pytest.approx(794.27)
    table = read("frame,x,y,w,h\n1,1,2,3,4\n2,1,2,3,4\n")
    assert (table.boxes[0].frame, len(table.remarks)) == (1, 1)
    assert places("frame,x,y,w,h\n1,1,2,3,4\n", first_frame=1)[0][0] == 0


def test_mot_truth_leaves_out_what_does_not_count() -> None:
    """Boxes whose seventh number is 0 are no targets, and the file says how many there were.

    Truth of 2015 has as many columns as results; the seventh says 0 or 1 there, and both occur.
    """
    table = read(MOT_TRUTH)
    assert table.targets == (2,)
    assert "2 boxes that the truth marks as not to be counted" in " ".join(table.remarks)
    rows = "".join(f"{frame},1,10,20,30,40,{flag},-1,-1,-1\n" for frame, flag in ((1, 1), (2, 0), (3, 1)))
    assert [box[0] for box in places(rows)] == [0, 2]
    assert len(places(rows.replace(",0,-1", ",0.5,-1"))) == 3
    assert read("1,1,2,3,4,5,.5,-1,-1\n2,1,2,3,4,5,.9,-1,-1\n").boxes[0].score == 0.5  # not a flag


def test_otb_and_vot_are_told_apart() -> None:
    """Whole numbers from 1 on are OTB's, whatever is between them; numbers with fractions are VOT's, from 0.

    Of VOT four corners are boxed in, and one number is a frame without a box. A frame without a target is none of it.
    """
    for separator in (",", "\t", " ", ";", ", "):
        table = read("10,20,30,40\n11,20,30,40".replace(",", separator))
        assert (table.form, tuple(table.boxes[1][:6])) == ("otb", (1, 1, 10, 19, 30, 40))
        assert "first pixel was taken as 1" in table.remarks[0]
    table = read("10,20,30,40\n0,0,0,0\n11,20,30,40\n")
    assert (table.form, table.frames, len(table.boxes)) == ("otb", 3, 2)
    table = read("1\n10.5,20,30,40\n1.5,1,5,1,5,9,1.5,9\n0\n")
    assert (table.form, table.frames) == ("vot", 4)
    assert [tuple(box[:6]) for box in table.boxes] == [(1, 1, 10.5, 20, 30, 40), (2, 1, 1.5, 1, 3.5, 8)]


def test_cvat_ends_where_a_target_is_outside() -> None:
    """Edges become sizes, a box that is outside is none, and a polygon is the box around its corners.

    It turns a box about its middle: a bar of 30 x 40 at 90 degrees is one of 40 x 30, and so is the box around it.
    """
    table = read(CVAT)
    assert (table.frames, table.remarks) == (4, ())
    assert {box.target: box.label for box in table.boxes} == {0: "person", 1: "dog"}
    first = (0, 0, 10.5, 20, 30, 40)
    assert places(CVAT) == [first, (1, 0, 11.5, 20, 30, 40), (1, 1, 1, 2, 4, 4), (3, 1, 1, 2, 2, 3)]
    turned = places(CVAT.replace('xtl="10.50"', 'rotation="90.0" xtl="10.50"'))
    assert turned[0][2:6] == pytest.approx((5.5, 25, 40, 30))


ROW = ("1", "1", "49,5", "79,5", "25,5", "20", "1", "-1", "-1", "-1")


@pytest.mark.parametrize(
    ("text", "box"),
    [
        # Where semicolons, tabs or spaces separate cells, commas separate decimals.
        *((separator.join(ROW) + "\n", (0, 1, 48.5, 78.5, 25.5, 20)) for separator in (";", "\t", " ", "; ")),
        ("frame;x;y;w;h\n0;48,5;78,5;25,5;20\n", (0, 1, 48.5, 78.5, 25.5, 20)),
        ('frame,x,y,w,h\n0,"48,5","78,5","25,5",20\n', (0, 1, 48.5, 78.5, 25.5, 20)),
        ("frame;x;y;w;h\n0;1,234;2;3;4\n", (0, 1, 1.234, 2, 3, 4)),
        # All before the first number is the header; the widest line names the columns, and a comment may do so.
        ("My tracker 2\nfirst run\n\nframe,x,y,w,h\n[1],[px],[px],[px],[px]\n0,10,20,30,40\n", TEN),
        ("# frame, x, y, w, h\n0, 10, 20, 30, 40\n# end\n", TEN),
        ("# x y w h\n11,21,30,40\n", TEN),
        # Columns by the names of programs, with units behind them.
        ("Frame,x [px],y (px),w,h\n0,10,20,30,40\n", TEN),
        ("frame,id,x,y,w,h\n3,7,10,20,30,40\n", (3, 7, 10, 20, 30, 40)),
        ("Frame\tName\tleft\ttop\twidth\theight\n3\t7\t10\t20\t30\t40\n", (3, 7, 10, 20, 30, 40)),
        # In tables of the MOT challenge x, y, z are places in the world; the box is bb_left and so on.
        ("frame,id,bb_left,bb_top,bb_width,bb_height,conf,x,y,z\n0,1,10,20,30,40,1,-1,-1,-1\n", TEN),
        # Tables of object detection have width and height of the picture beside the edges of the box.
        ("frame,width,height,xmin,ymin,xmax,ymax\n0,640,480,10,20,40,60\n", TEN),
    ],
)
def test_a_box_is_read_from_tables_of_others(text: str, box: tuple[float, ...]) -> None:
    """Tables of many programs, locales and encodings give the same box."""
    assert places(text) == [box]
    assert [tuple(each[:6]) for each in read_results(text.encode("utf-16-le")).boxes] == [box]


def test_shapes_of_cvat_and_coco_have_a_box_around_them() -> None:
    """Ellipses, masks and polygons are boxed in, turned ones too; what is broken is named; ids are not shared."""
    shapes = (
        '<ellipse frame="0" cx="30" cy="40" rx="5" ry="3"/><mask frame="1" left="1" top="2" width="3" height="4"/>'
        '<box frame="2" xtl="x" ytl="1" xbr="2" ybr="3"/><skeleton frame="3"/>'
    )
    track = f'<track id="4" label="a">{shapes}</track>'
    table = read(f"<annotations>{track}{track}</annotations>")
    assert [tuple(box[:6]) for box in table.boxes if box.target == 0] == [(0, 0, 25, 37, 10, 6), (1, 0, 1, 2, 3, 4)]
    assert table.targets == (0, 1)
    assert "track 0, frame 2" in table.remarks[-1]
    turned = [{**one, "attributes": {"rotation": 90, "track_id": 9}} for one in COCO["annotations"]]
    assert places({**COCO, "annotations": turned})[0] == pytest.approx((0, 9, 0.5, 2.5, 4, 3))
    around = [{"id": 1, "image_id": 5, "category_id": 1, "segmentation": [[1, 2, 5, 2, 5, 9]]}]
    assert places({**COCO, "annotations": around}) == [(0, 1, 1, 2, 4, 7)]


def test_coco_in_its_forms() -> None:
    """By image, as a bare list of results, and by video: the same boxes in the same frames.

    CVAT has the track among the attributes; without one, boxes are of one target if no image has two. One annotation
    that is broken is named, and the others are read. Images without a frame are in the order of their names, and gaps
    in these are reported.
    """
    assert places(COCO) == [(0, 9, 1, 2, 3, 4), (2, 9, 2.5, 2, 3, 4)]
    assert places(VIS) == [(0, 4, 1, 2, 3, 4), (2, 4, 2, 2, 3, 4)]
    listed = [{**one, "track_id": 9, "score": 0.5} for one in COCO["annotations"]]
    assert [box[:2] for box in places(listed)] == [(0, 9), (1, 9)]
    bare = [{key: value for key, value in one.items() if key != "instance_id"} for one in COCO["annotations"]]
    tracked = [{**one, "attributes": {"occluded": False, "track_id": 4}} for one in bare]
    for annotations, target in ((tracked, 4), (bare, 1)):
        assert [box[:2] for box in places({**COCO, "annotations": annotations})] == [(0, target), (2, target)]
    twice = [*bare, {**bare[0], "id": 3, "bbox": [9, 9, 9, 9]}]
    assert len(read({**COCO, "annotations": twice}).targets) == 3
    table = read({**COCO, "annotations": [bare[0], {**bare[1], "bbox": [1, 2]}]})
    assert (len(table.boxes), table.remarks[-1]) == (1, "No box with an area: annotation 2.")
    images = [{"id": 9 - number, "file_name": f"{number}.jpg"} for number in (2, 4, 5)]
    boxes = [{"id": one["id"], "image_id": one["id"], "bbox": [9 - one["id"], 1, 5, 5]} for one in images]
    table = read({"images": images[::-1], "annotations": boxes})
    assert [(box.frame, box.x) for box in table.boxes] == [(0, 2), (1, 4), (2, 5)]
    assert "pictures are missing between 2 and 4" in " ".join(table.remarks)


def test_columns_and_targets_have_names() -> None:
    """A table with names of its own is read when a person says what they are, by edges or by the middle as well.

    If two columns may be the target, the preview guesses the one that the reader takes. Names of targets are numbered
    in order of appearance; numbers stay, also as pandas writes them.
    """
    table = b"bild;links;oben;rechts;unten\n0;10;20;40;60\n"
    assert form_of(table) is None
    assert places(rename(table, {"frame": 0, "x": 1, "y": 2, "right": 3, "bottom": 4}).decode()) == [TEN]
    for columns, words in (({"frame": 0, "x": 1}, "expected the frame"), ({"frame": 0, "y": 7}, "no column for y")):
        with pytest.raises(RefusedError, match=words):
            rename(table, columns)
    text = "frame,track,id,x,y,w,h\n0,9,7,10,20,30,40\n"
    guess = preview(text).guess
    assert (guess, guess["target"]) == (columns_in(text.partition("\n")[0].split(",")), 2)
    assert places(text) == [(0, 7, 10, 20, 30, 40)]
    for ids, wanted in ((("7.0", "9.0"), [(7, ""), (9, "")]), (("9", "a"), [(1, "9"), (2, "a")])):
        found = read("frame,id,x,y,w,h\n" + "".join(f"0,{one},1,2,3,4\n" for one in ids))
        assert [(box.target, box.label) for box in found.boxes] == wanted


@pytest.mark.filterwarnings("ignore:(Its first|No box)")
@pytest.mark.parametrize("suffix", ["mot.txt", "vot.txt", "cvat.xml", "coco.json"])
def test_results_survive_being_opened_and_written(tmp_path: Path, suffix: str) -> None:
    """Frames before the first box and after the last, numbers and names of targets are what they were."""
    form = suffix.partition(".")[0]
    targets = ((7, "a cup"), (9, "a ball")) if form in {"cvat", "coco"} else ((1, ""),)
    boxes = [Box(frame, number, 10 + frame, 20, 30, 40, label=name) for frame in (2, 3, 5) for number, name in targets]
    path = tmp_path / f"results.{suffix}"
    path.write_bytes(write_results(form, boxes, frames=8, size=(320, 240), rate_hz=25.0))  # type: ignore[arg-type]
    run = pftrack.load(path)
    run.finish()
    run.export(tmp_path / f"again.{suffix}")
    first, again = (read_results((tmp_path / f"{name}.{suffix}").read_bytes()) for name in ("results", "again"))
    assert [(*box[:6], box.label) for box in again.boxes] == [(*box[:6], box.label) for box in first.boxes]
    assert again.frames == first.frames


sides = st.tuples(*[st.floats(-500, 500)] * 2, *[st.floats(1.01, 500)] * 2)


@given(
    found=st.dictionaries(st.tuples(st.integers(0, 30), st.integers(0, 3)), sides, min_size=1, max_size=12),
    names=st.lists(st.text("aé &<\"'>ß", min_size=1, max_size=9).filter(str.strip), min_size=4, max_size=4),
    more=st.integers(0, 3),
)
def test_boxes_are_read_back(found: dict[tuple[int, int], tuple[float, ...]], names: list[str], more: int) -> None:
    """Whatever boxes are written, in every form, are read with their frames, numbers and labels."""
    for form in (form for form in FORMS if form != "csv"):
        single = form in {"otb", "vot"}
        kept = {(frame, 1 if single else target): box for (frame, target), box in sorted(found.items())}
        labels = [name.strip() for name in names] if form in {"cvat", "coco"} else [""] * 4
        boxes = [Box(frame, target, *box, label=labels[target]) for (frame, target), box in kept.items()]
        frames = boxes[-1].frame + 1 + more
        data = write_results(form, boxes, frames=frames, size=(640, 480), rate_hz=25.0)
        if single:
            assert data.count(b"\n") == frames
        table = read_results(data, form=form if single else None)
        assert [(*box[:2], box.label) for box in table.boxes] == [(*box[:2], box.label) for box in boxes]
        assert np.array([box[2:6] for box in table.boxes]) == pytest.approx(np.array([b[2:6] for b in boxes]), abs=1e-4)
        assert table.frames == (boxes[-1].frame + 1 if form == "mot" else frames)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        # Decimals between commas and shifted columns may be read in two ways, and so may thousands.
        ("1,1,49,5,79,5,25,5,25,5,1,-1,-1,-1\n" * 2, "line 1: expected 6 to 10 numbers"),
        ("1,1,49,5,79,5,25,5,25,5\n2,1,52,5,83,5,25,5,25,5\n", "10 whole numbers a line can be read in two ways"),
        ("10,5,20,7,30,9,40,3\n11,5,20,7,30,9,40,3\n", "8 whole numbers a line can be read in two ways"),
        ("frame,x,y,w,h\n0,48,5,78,5,25,5,25,5\n", "line 2: expected 5 values, got 9"),
        ("frame;x;y;w;h\n0;1.234;78,5;25;25\n", "line 2: 1.234 can be read in two ways"),
        ('frame,x,y,w,h\n0,"1,234",2,3,4\n', "line 2: 1,234 can be read in two ways"),
        ("frame;x;y;w;h\n0;1.048,5;78,5;25,5;20\n", "line 2: x must be a number of px, got '1.048,5'"),
        # Shares of a picture whose size the table does not say are no pixels.
        ("1,1,.2,.3,.1,.1,1,-1,-1,-1\n2,1,.2,.3,.1,.1,1,-1,-1,-1\n", "shares of the picture"),
        ("frame,x,y,w,h\n0,-.02,.3,.1,.1\n1,.9,.3,.2,.1\n", "shares of the picture"),
        # A broken line is named.
        ("10,20,30,40\n\n11,20,30,40\n", "line 2 is blank"),
        ("10,20,30,40\n11,20,x,40\n12,20,30,40\n", "line 2: expected numbers, got '11,20,x,40'"),
        ("1,1,2,3,4,5,1\n2,1,2,,4,5,1\n3,1,2,3,4,5,1\n", "line 2: expected 7 numbers"),
        ("1,1,2,3,4,5,1\n1,1,2,3,4,5,1\n", "two boxes in frame 0"),
        ("1,2,3,0\n", "no box with an area"),
        ("frame,id,x,y,w,h\n0,²,1,2,0,4\n", "no box with an area"),
        ("hello", "does not hold results"),
        ("<annotations></annotations>", "with tracks"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><annotations/>', "declares entities"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><annotations/>'.encode("utf-16"), "declares entities"),
        (f'<annotations><track id="{"9" * 5000}"/></annotations>', "whole number id"),
        ('{"images": [], "annotations": {}}', "no box"),
        ('{"images": 3', "cannot be read"),
    ],
)
def test_no_line_becomes_another_box(text: str | bytes, words: str) -> None:
    """What can be read in two ways, or not at all, is refused with what was expected, by line where one is wrong."""
    with pytest.raises(RefusedError, match=words):
        read_results(text if isinstance(text, bytes) else text.encode())


def test_many_images_are_put_in_order_at_once() -> None:
    """A frame is found by its image without a search through all images, which would take ten seconds."""
    count = 30_000
    begun = time.process_time()
    table = read([{"image_id": 3 * n, "bbox": [1, 2, 3, 4]} for n in range(count)])
    assert (table.frames, time.process_time() - begun < 5.0) == (count, True)


# Results, their clip and their truth as files that belong together.

WALK = b"1,1,10,20,30,40,1,-1,-1,-1\n2,1,11,20,30,40,1,-1,-1,-1\n"
MP4, PNG = b"\x00\x00\x00\x18ftypmp42", b"\x89PNG\r\n\x1a\n"


def test_names_tell_a_truth_from_results() -> None:
    """Contents tell the rest."""
    truth, alone = "gt.txt", "groundtruth_rect.txt"
    three = {"clip": "walk.mp4", "results": "det.txt", "truth": truth}
    assert part_names({"det.txt": WALK, truth: WALK, "walk.mp4": MP4}) == three
    assert part_names({alone: WALK, "walk.mp4": MP4}) == {"clip": "walk.mp4", "results": alone}
    assert part_names({"a.png": PNG, "b.png": PNG, "gt.txt": WALK}) is None
    assert part_names({"a.mp4": MP4, "b.mp4": MP4}) is None


@pytest.mark.parametrize("line", [b"%d,1,10.25,20,30,40,0.9,-1,-1,-1", b"1%d,20,30,40", b"%d.5\t20\t30\t40"])
def test_a_long_file_is_known_by_its_beginning(line: bytes) -> None:
    """Wherever that is cut, as within a line."""
    whole = b"\n".join(line % number for number in range(1, 200))
    for more in range(20):
        assert sniff((b"\n" * more + whole)[:HEAD_BYTES]).kind == "beliefs"


@pytest.mark.parametrize(
    ("heads", "words"),
    [
        ({"a.mp4": MP4, "b.mp4": MP4, "det.txt": WALK}, r"of one clip, got a\.mp4 and b\.mp4"),
        ({"a.txt": WALK, "b.txt": WALK}, r"call the truth gt\.txt"),
        ({"walk.mp4": MP4, "det.txt": WALK, "sound.mp3": b"ID3"}, r"sound\.mp3 does not go with results"),
        ({"det.txt": WALK, "truth.pft": b"PK\x03\x04" + bytes(26) + b"recording.json"}, "expected a truth of boxes"),
    ],
)
def test_what_does_not_go_together_is_refused(heads: dict[str, bytes], words: str) -> None:
    """In a sentence that names the files."""
    with pytest.raises(RefusedError, match=words):
        part_names(heads)


def test_a_folder_holds_them(tmp_path: Path) -> None:
    """The folder opens as one recording of beliefs with the pictures of the clip; its index is reused."""
    with FilmWriter(tmp_path / "walk.mp4", 25.0) as film:
        for t in range(2):
            film.write(np.full((96, 128, 3), 90 * t, dtype=np.uint8))
    (tmp_path / "det.txt").write_bytes(WALK)
    (tmp_path / "gt.txt").write_bytes(WALK.replace(b"20,", b"21,"))
    sequence = open_sequence(tmp_path)
    assert (sequence.index.kind, sequence.size, sequence.frame_count) == ("beliefs", (128, 96), 2)
    assert sequence.picture(1).mean() == pytest.approx(90, abs=2)
    assert sequence.index.warnings[-2:] == (
        "The truth that came along is of 1 target in 2 frames.",
        "Of the truth: Its first frame was taken as 1.",
    )
    assert open_sequence(tmp_path, index=sequence.index).index == sequence.index
    (tmp_path / "gt.txt").write_bytes(WALK)
    assert open_sequence(tmp_path).sha256 != sequence.sha256
