"""Films hold the pictures that were written, appear whole or not at all, and play everywhere."""

import errno
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.vision.film import FilmWriter


def grey(level: int, width: int = 64, height: int = 48) -> NDArray[np.uint8]:
    return np.full((height, width, 3), level, np.uint8)


def write(path: Path, pictures: list[NDArray[np.uint8]], frame_rate_hz: float = 30.0) -> None:
    with FilmWriter(path, frame_rate_hz) as film:
        for picture in pictures:
            film.write(picture)


def test_a_film_holds_its_pictures_in_order(tmp_path: Path) -> None:
    """What was written is read again: H.264 in yuv420p, the same number, order, rate and nearly the same levels."""
    path = tmp_path / "film.mp4"
    write(path, [grey(level) for level in range(20, 220, 20)], 29.97)
    with av.open(path) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert float(stream.average_rate or 0) == pytest.approx(29.97, abs=1e-3)
        levels = [frame.to_ndarray(format="rgb24").mean() for frame in container.decode(stream)]
    np.testing.assert_allclose(levels, np.arange(20, 220, 20), atol=3)


def test_a_name_with_a_colon_is_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A relative name such as a time of day appears in the current folder, under that name."""
    monkeypatch.chdir(tmp_path)
    write(Path("2026-11-28T13:49.mp4"), [grey(0)])
    assert [path.name for path in tmp_path.iterdir()] == ["2026-11-28T13:49.mp4"]


@pytest.mark.parametrize(("width", "height"), [(65, 48), (64, 47), (65, 47), (1, 1)])
def test_odd_sides_are_made_even(tmp_path: Path, width: int, height: int) -> None:
    """An odd picture is not refused and loses nothing: it gets one more row or column."""
    path = tmp_path / "film.mp4"
    write(path, [grey(100, width, height)] * 3)
    with av.open(path) as container:
        stream = container.streams.video[0]
        assert (stream.width, stream.height) == (width + width % 2, height + height % 2)
        assert sum(1 for _ in container.decode(stream)) == 3


def test_an_error_leaves_the_old_film(tmp_path: Path) -> None:
    """When writing breaks off, the file at that place stays as it was and nothing else is left behind."""
    path = tmp_path / "film.mp4"
    path.write_bytes(b"old")
    with pytest.raises(ValueError, match="got one of"):
        write(path, [grey(0), grey(0, width=32)])
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_no_pictures_make_no_film(tmp_path: Path) -> None:
    """A film without a single picture does not appear."""
    write(tmp_path / "film.mp4", [])
    assert list(tmp_path.iterdir()) == []


def test_a_place_that_cannot_be_written_is_an_error_at_once(tmp_path: Path) -> None:
    """A missing folder is noticed before a single picture is computed."""
    with pytest.raises(OSError, match="No such file"):
        FilmWriter(tmp_path / "nowhere" / "film.mp4", 30.0)


def test_a_film_that_cannot_be_begun_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a full disk not even an empty file stays behind."""

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "no space left")

    monkeypatch.setattr(av, "open", full)
    with pytest.raises(OSError, match="no space left"):
        FilmWriter(tmp_path / "film.mp4", 30.0)
    assert list(tmp_path.iterdir()) == []
