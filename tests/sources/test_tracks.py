"""Tables of tracks: every form that is read, and a plain sentence for what is not."""

import time
from pathlib import Path

import numpy as np
import pytest

from pftrack.core.model.parameters import Parameters
from pftrack.core.model.source import History
from pftrack.core.refusal import RefusedError
from pftrack.experiments.structure.scene import named_body, named_shape, normalise
from pftrack.sources.limits import Limits
from pftrack.sources.sequence import open_sequence
from pftrack.sources.tracks import MOST_POINTS, RecordedTracks, TrackSequence, TrackTable, read_tracks, write
from pftrack.vision.face import FEATURES, LINKS, mean_model
from tests.sources.films import refused

SQUARE = {"a": (10.0, 10.0), "b": (300.0, 12.0), "c": (305.5, 200.0), "d": (11.0, 210.25)}
LONG = "frame,point,x_px,y_px,var_x,var_y\n" + "".join(
    f"{frame},{name},{x + frame},{y},4,9\n" for frame in (5, 6, 8) for name, (x, y) in SQUARE.items()
)


def read(text: str | bytes) -> TrackTable:
    return read_tracks(text if isinstance(text, bytes) else text.encode(), 100)


def opened(folder: Path, text: str) -> TrackSequence:
    """Return the sequence of a table, told by its content, whatever it is called."""
    path = folder / "clip.mp4"
    path.write_text(text)
    sequence = open_sequence(path)
    assert isinstance(sequence, TrackSequence)
    return sequence


def test_the_long_form() -> None:
    """A line for a point in a frame; a frame without lines is one in which nothing is seen."""
    table = read(LONG)
    assert (table.names, table.first, table.positions.shape) == (("a", "b", "c", "d"), 5, (4, 4, 2))
    np.testing.assert_array_equal(table.positions[1], [(x + 6, y) for x, y in SQUARE.values()])
    np.testing.assert_array_equal(table.variances[0], [(4, 9)] * 4)
    assert np.isnan(table.positions[2]).all()
    assert np.isinf(table.variances[2]).all()
    assert table.warnings == ("In 1 of 4 frames no point is seen.",)
    assert write(table.names, table.positions, table.variances).splitlines()[1] == "0,a,15.0,10.0,4.0,9.0"
    assert write(("=a, b",), table.positions, table.variances).splitlines()[1] == '0,"\'=a, b",15.0,10.0,4.0,9.0'


WIDE = "frame," + ",".join(f"{name}_x,{name}_y,{name}_var_x,{name}_var_y" for name in SQUARE)
WIDE += "".join(f"\n{frame}," + ",".join(f"{x + frame},{y},4,9" for x, y in SQUARE.values()) for frame in (5, 6, 8))


def numbered(name: str) -> str:
    """A table of tracks with an identity of each line beside that of its track, which counts."""
    header, *lines = LONG.replace("point", name, 1).splitlines()
    return "\n".join([f"{header},id", *(f"{line},{number}" for number, line in enumerate(lines))])


SAME = {
    "mark": LONG.encode("utf-8-sig"),
    "utf-16": LONG.encode("utf-16"),
    "tabs": LONG.replace(",", "\t"),
    "semicolons": LONG.replace(",", ";").replace("305.5", "305,5").replace("210.25", "210,25"),
    "spaces": LONG.replace("frame,point,x_px,y_px,var_x,var_y", "Frame, Point ,X,Y,Var X,Var Y"),
    "empty lines": LONG.replace("\n", "\r\n\r\n"),
    "deviations": LONG.replace("var_x,var_y", "sd_x,sd_y").replace(",4,9", ",2,3"),
    "a line for a frame": WIDE,
    **{f"{name} alone": LONG.replace("point", name, 1) for name in ("track", "track_id", "particle", "id")},
    **{name: numbered(name) for name in ("track", "track_id", "particle")},
}


@pytest.mark.parametrize("form", SAME)
def test_as_other_programs_write_it(form: str) -> None:
    """Encoding, ends of lines, delimiter, decimal commas, names and the form of the table may be others."""
    table, wanted = read(SAME[form]), read(LONG)
    assert table.names == wanted.names
    np.testing.assert_allclose(table.positions, wanted.positions)
    np.testing.assert_allclose(table.variances, wanted.variances)


def test_headers_of_deeplabcut_and_trackmate() -> None:
    """Three lines say whose x and y a column has; four lines say names, titles and units."""
    deeplabcut = "scorer,net,net,net,net,net,net\nbodyparts,nose,nose,nose,tail,tail,tail\n"
    deeplabcut += "coords,x,y,likelihood,x,y,likelihood\n0,1.5,2,.9,3,4,.9\n1,2.5,2,.9,3,4,.9\n"
    table = read(deeplabcut)
    assert table.names == ("nose", "tail")
    np.testing.assert_array_equal(table.positions[:, 0], [(1.5, 2), (2.5, 2)])
    trackmate = "LABEL,ID,TRACK_ID,POSITION_X,POSITION_Y,FRAME\nLabel,Spot ID,Track ID,X,Y,Frame\n"
    trackmate += "Label,Spot ID,Track ID,X,Y,Frame\n,,,(micron),(micron),\nID7,7,0,1.5,2,0\nID8,8,0,2.5,2,1\n"
    assert read(trackmate).names == ("0",)


@pytest.mark.parametrize(
    "text",
    ["frame,track,x,y\n9,m,5,6\n7,m,1,2\n8,m,,4\n", "frame,x,y\n7,1,2\n9,5,6\n", "X;Y\n1,0;2\n;4\n5;6\n"],
    ids=["frames that fall", "a frame left out", "no frames"],
)
def test_the_path_of_one_point(text: str, tmp_path: Path) -> None:
    """Lines come in any order; without a column of points there is one, without frames each line is the next."""
    table = read(text)
    np.testing.assert_array_equal(table.positions[:, 0], [(1, 2), (np.nan, np.nan), (5, 6)])
    sequence = opened(tmp_path, text)
    np.testing.assert_allclose(sequence.positions[0, 0] / sequence.scale + sequence.origin, (1, 2))
    assert sequence.first_frame == table.first


def test_what_is_not_seen() -> None:
    """Empty cells, NaN and infinite variances are points not seen; points never seen are left out, with a warning.

    Without variances one square pixel is taken, and a covariance is not used; both are reported.
    """
    for cells in ("8,a,,,4,9", "8,a,nan,3,4,9", "8,a,1,2,inf,9", "8,a,1,2,,"):
        table = read(LONG.replace("8,a,18.0,10.0,4,9", cells))
        assert np.isinf(table.variances[3, 0]).all()
        assert np.isfinite(table.variances[3, 1:]).all()
    table = read(LONG + "5,e,,,,\n")
    assert table.names == ("a", "b", "c", "d")
    assert table.warnings[0] == "Never seen and left out: e."
    table = read(LONG.replace("var_y", "spread"))
    assert (table.variances[0] == 1.0).all()
    assert table.warnings[0] == "There are no variances in the table; all positions count alike."
    table = read(LONG.replace("var_y", "var_y,cov_xy").replace(",4,9", ",4,9,1"))
    assert table.warnings[0] == "The covariances of x and y are not used, only the variances."


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (LONG.replace(",d,", ",a,", 1), "line 5 lists point a in frame 5 for the second time"),
        (LONG.replace("point", "body", 1), "line 3 lists frame 5 for the second time; a table of several "),
        ("\n".join(LONG.splitlines()[:5]), "expected at least 2 frames in which points are seen, got 1 in the table"),
        ("x,y\n" + "1,2\n" * 101, "the table has more than 100 frames of point 1"),
        (LONG.replace("frame,", "picture,"), "has the columns picture, point, x_px, y_px, var_x, var_y; expected"),
        (LONG.replace("5,a", "-1,a"), "line 2: frame must be a whole number from 0 to 10,000,000, got '-1'"),
        (LONG.replace("5,a,15.0", "5,a,left"), "line 2: x must be a number, got 'left'"),
        (LONG.replace("5,a,15.0", "5,a,1e9"), "a position must lie within 1,000,000 px, got 1e+09, 10"),
        (LONG.replace(",4,9", ",0,9"), "line 2: variances and standard deviations must be above 0, got 0"),
        (LONG.replace("5,a,", "5,,"), "line 2 names no point"),
        (LONG.replace("8,a", "999,a"), "the table reaches over 995 frames; at most 100 are allowed"),
        (LONG.replace("5,a", f"{10**9},a"), "frame must be a whole number from 0 to 10,000,000, got '1000000000'"),
        (LONG.replace("var_x,var_y", "sd_x,sd_y").replace(",4,9", ",1e-200,9"), "must be above 0, got 1e-200"),
        (LONG + '5,"' + "x" * 200_000 + '",1,1,1,1\n', "the table cannot be read"),
    ],
)
def test_a_plain_sentence_for_what_is_wrong(text: str, sentence: str) -> None:
    """It names the line, what is there and what is expected."""
    with pytest.raises(RefusedError) as caught:
        read(text)
    assert sentence in str(caught.value)


def wide(count: int) -> str:
    header = ",".join(f"p{number}_x,p{number}_y" for number in range(count))
    return f"frame,{header}\n0{',1' * 2 * count}\n"


def test_too_much_is_refused_at_once() -> None:
    """A hostile table is read no further than to the first point too many, and no more columns than spreadsheets have.

    Searching a header for each of thousands of names took minutes.
    """
    lines = "".join(f"0,{number},{number},1,1,1\n" for number in range(MOST_POINTS + 1))
    points = f"more than the {MOST_POINTS} points"
    before = time.process_time()
    for text, words in (
        (LONG.splitlines()[0] + "\n" + lines + "rubbish", points),
        (wide(10_000), "at most 16,384 columns"),
        (wide(8_000), points),
    ):
        with pytest.raises(RefusedError, match=words):
            read(text)
    assert time.process_time() - before < 10.0


def scaled(unit: float, variances: str) -> str:
    """Two frames of the square in another unit."""
    lines = [
        f"{frame},{name},{unit * (x + frame)},{unit * y},{variances}"
        for frame in (0, 1)
        for name, (x, y) in SQUARE.items()
    ]
    return "\n".join([LONG.splitlines()[0], *lines])


def test_numbers_too_small_are_refused_or_raised(tmp_path: Path) -> None:
    """Points at one place, or too close to be scaled to a picture, are refused; variances need an inverse."""
    for unit in (1e-310, 1e-200, 0.0):
        with pytest.raises(RefusedError, match="expected points at different places, got all at one"):
            opened(tmp_path, scaled(unit, "4,9"))
    sequence = opened(tmp_path, LONG.replace(",4,9", ",1e-320,9"))
    np.testing.assert_array_equal(sequence.variances[0], [(1e-12, 9)] * 4)
    assert sequence.index.warnings[-1] == "Variances below 1e-12 px² of the picture were raised to that."


def test_a_table_is_a_sequence(tmp_path: Path) -> None:
    """It is known by its content, opens by its index, and its frames are pictures with a dot for each point seen.

    A source of it begins at the chosen frame. A table that is too large is refused by its bytes before it is read, and
    by its frames after.
    """
    found = opened(tmp_path, LONG).index
    assert (found.kind, found.frame_count, found.warnings) == ("tracks", 4, ("In 1 of 4 frames no point is seen.",))
    sequence = open_sequence(tmp_path / "clip.mp4", index=found)
    assert sequence.size == (found.width, found.height)
    assert (sequence.positions[0, 0].tolist(), sequence.picture(0)[10, 15].tolist()) == ([15, 10], [86, 180, 233])
    assert (sequence.picture(2) == 255).all()
    with pytest.raises(IndexError):
        sequence.picture(4)
    source = RecordedTracks(sequence, named_body(sequence), 1)
    measured = source.frame(0, History(((0, Parameters()),))).measurements
    assert (source.frame_count, measured.sd_px.tolist()) == (3, [[2, 3]] * 4)
    np.testing.assert_array_equal(measured.points_px, sequence.positions[1])
    refused(tmp_path / "clip.mp4", "at most", Limits(file_bytes=100))
    refused(tmp_path / "clip.mp4", "reaches over 4 frames", Limits(frames=3))


def test_points_with_the_names_of_a_face_are_one() -> None:
    """Whatever their order, and if some are missing: what other faces look like is known of them, and of no others."""
    names = ("nose", "reye", "leye", *FEATURES[5:8])
    shape = named_shape(names)
    mean = mean_model().points_mm[[FEATURES.index(name) for name in names]]
    np.testing.assert_allclose(shape.mean, normalise(mean))
    assert {(names[one], names[other]) for one, other in shape.edges} == {it for it in LINKS if set(it) <= set(names)}
    other = named_shape(("nose", "reye", "leye", "tail"))
    assert other.mean is None
    assert len(other.edges) == 0


@pytest.mark.parametrize("scale", [1e-3, 30.0])
def test_other_units_are_scaled_to_a_picture(tmp_path: Path, scale: float) -> None:
    """Tracks in metres or in a huge picture come to a picture of usual size, their noise with them."""
    sequence = opened(tmp_path, scaled(scale, f"{4 * scale**2},{9 * scale**2}"))
    assert 600 <= max(sequence.size) <= 660
    np.testing.assert_allclose(sequence.variances[0, 0, 0] ** 0.5, 2 * 640 / (305.5 * 1.08), rtol=0.05)
    assert sequence.index.warnings[0].startswith("The positions were scaled by")
