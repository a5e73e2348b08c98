"""What becomes of a recording: nothing that repeats is written twice, and what is large is made to fit."""

import gzip
import json

import cv2
import numpy as np
import pytest

from pftrack_server.viewer.standalone.lines import Lines
from pftrack_server.viewer.standalone.packing import Packing
from pftrack_server.viewer.standalone.pictures import shrink
from pftrack_server.viewer.viser_adapter import NodeState


def _unpacked(packed: bytes) -> tuple[dict, bytes]:
    data = gzip.decompress(packed)
    length = int.from_bytes(data[:4], "little")
    return json.loads(data[4 : 4 + length]), data[4 + length :]


def _column(described: dict, blob: bytes, index: int) -> np.ndarray:
    form, count, at = described["columns"][index]
    kind = np.dtype("i4" if form == "steps" else form)
    rows = np.frombuffer(blob, np.uint8, count * kind.itemsize, at).reshape(kind.itemsize, count)
    values = rows.T.copy().view(kind)[:, 0]
    return np.cumsum(values, dtype=np.int32) if form == "steps" else values


def test_a_growing_path_costs_one_line_a_frame() -> None:
    """A line that was there before is the same row of the table, whatever was drawn in between."""
    lines, rng = Lines(), np.random.default_rng(1)
    path = rng.integers(-2000, 2000, (50, 6), dtype=np.int32)
    for length in range(51):
        rows = lines.add(path[:length])
        np.testing.assert_array_equal(lines.table[rows] if length else path[:0], path[:length])
    assert len(lines.table) == 50


def test_the_same_line_twice_in_a_frame_is_one_row() -> None:
    """A frame may draw a line twice; the table has it once."""
    lines = Lines()
    rows = lines.add(np.array([[1, 2, 3, 4, 5, 6], [0, 0, 0, 1, 1, 1], [1, 2, 3, 4, 5, 6]], np.int32))
    assert rows.tolist() == [0, 1, 0]
    assert len(lines.table) == 2


def test_places_come_back_within_a_32nd_of_a_pixel() -> None:
    """Places are rounded to a 16th of a pixel; one that is not finite stays so, and none is too far."""
    points = np.random.default_rng(2).normal(0, 300, (200, 3)).astype(np.float32)
    points[3, 1], points[5] = np.nan, 1e20
    packing = Packing()
    states = packing.moment({"/cloud": NodeState(1, "PointCloudMessage", {"points": points.ravel()})}, {})
    described, blob = _unpacked(packing.pack([[states, states]]))
    columns = described["nodes"][0]["props"]["points"]["columns"]
    read = np.stack([_column(described, blob, index) for index in columns], axis=1) / 16.0
    assert read[3, 1] == -(2**31) / 16.0
    assert (read[5] == 1e6).all()
    known = np.isfinite(points) & (np.abs(points) < 1e6)
    assert np.abs(read - points)[known].max() <= 1 / 32 + 1e-4


def test_what_does_not_change_is_written_once() -> None:
    """A node that stays as it is has one state in all frames, and an array one column, even under two names."""
    colours = np.arange(300, dtype=np.uint8)
    node = NodeState(1, "PointCloudMessage", {"colors": colours})
    twin = NodeState(2, "PointCloudMessage", {"colors": colours.copy()})
    packing = Packing()
    first = packing.moment({"/a": node, "/b": twin}, {})
    assert packing.moment({"/a": node, "/b": twin}, {}) == first
    described, _ = _unpacked(packing.pack([[first, first]]))
    assert len(described["states"]) == 2
    assert len(described["columns"]) == 3


def _noise(seed: int) -> bytes:
    image = np.random.default_rng(seed).integers(0, 255, (240, 320, 3), dtype=np.uint8)
    return cv2.imencode(".jpg", image, (cv2.IMWRITE_JPEG_QUALITY, 88))[1].tobytes()


def test_pictures_that_are_too_large_are_made_coarser_until_they_fit() -> None:
    """All pictures of a recording together keep to what they may take; those that fit stay as they are."""
    files = [_noise(seed) for seed in range(6)]
    whole = sum(map(len, files))
    assert shrink(files, whole) == files
    assert sum(map(len, shrink(files, whole // 3))) <= whole // 3
    smallest = shrink(files, 1)
    assert sum(map(len, smallest)) < whole // 3, "what cannot fit is as small as it gets"


def test_a_damaged_picture_is_refused() -> None:
    """What is no JPEG file cannot be made coarser, and says so."""
    with pytest.raises(ValueError, match="no JPEG"):
        shrink([b"no picture"], 1)
