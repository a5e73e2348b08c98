"""Pictures leave a worker as files, each encoded once for all that want it."""

from typing import Any

import cv2
import numpy as np
import pytest

from pftrack.core.model.drawing import COLOURS, Drawing, Picture, Polyline
from pftrack_server.core import pictures
from pftrack_server.core.pictures import PictureEncoder
from pftrack_server.sessions.worker.codec import DrawingEncoder


@pytest.fixture
def encoded(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, ...]]:
    """Shapes of the pictures that were encoded."""
    shapes: list[tuple[int, ...]] = []
    encode = cv2.imencode

    def counted(suffix: str, image: Any, form: Any) -> Any:
        shapes.append(image.shape)
        return encode(suffix, image, form)

    monkeypatch.setattr(pictures.cv2, "imencode", counted)
    return shapes


def drawing(level: int = 200, size: tuple[int, int] = (60, 80)) -> Drawing:
    line = Polyline(np.zeros((2, 3), np.float32), COLOURS["truth"], 1.0, "truth")
    picture = Picture(np.full((*size, 3), (level, 40, 90), np.uint8), "video")
    return Drawing(80, 60, {"line": line, "picture": picture}, "Frame 3")


def test_a_scene_is_sent_files_and_no_pixels() -> None:
    """Pictures keep their name, layer and place in the painting order; everything else is as it was."""
    before = drawing()
    sent = PictureEncoder().for_scene(before)
    assert list(sent.drawing.primitives) == ["line", "picture"]
    assert sent.drawing.primitives["line"] is before.primitives["line"]
    assert sent.drawing.caption == "Frame 3"
    bare = sent.drawing.primitives["picture"]
    assert isinstance(bare, Picture)
    assert (bare.image_rgb.size, bare.layer) == (0, "video")
    picture = sent.pictures["picture"]
    assert (picture.width, picture.height) == (80, 60)
    seen = cv2.imdecode(np.frombuffer(picture.file, np.uint8), cv2.IMREAD_COLOR)
    assert seen.shape == (60, 80, 3)
    np.testing.assert_allclose(seen[30, 30, ::-1], (200, 40, 90), atol=4)


def test_a_picture_that_stays_is_encoded_once(encoded: list[tuple[int, ...]]) -> None:
    """It has the same key as long as it stays; an equal copy is the same picture, another one has another key."""
    encoder = PictureEncoder()
    first, again = (encoder.for_scene(drawing()).pictures["picture"] for _ in range(2))
    assert first is again
    other = encoder.for_scene(drawing(100)).pictures["picture"]
    assert other.key != first.key
    larger = encoder.for_scene(drawing(100, (120, 160))).pictures["picture"]
    assert (larger.width, larger.height) == (160, 120)
    assert encoded == [(60, 80, 3), (60, 80, 3), (120, 160, 3)]


def test_a_picture_may_be_drawn_over_the_last_one() -> None:
    """An experiment that keeps one array for all frames is shown each of them."""
    encoder, shown = PictureEncoder(), drawing()
    picture = shown.primitives["picture"]
    assert isinstance(picture, Picture)
    first = encoder.for_scene(shown).pictures["picture"]
    picture.image_rgb[:] = 7
    second = encoder.for_scene(shown).pictures["picture"]
    assert first.key != second.key
    picture.image_rgb.flags.writeable = False
    assert encoder.for_scene(shown).pictures["picture"] is second


def test_a_scene_and_flat_views_share_a_picture(encoded: list[tuple[int, ...]]) -> None:
    """What is fine enough for a flat view does for the scene; what was made for the scene alone is made again."""
    encoder = PictureEncoder()
    flat = DrawingEncoder(encoder)
    (fine,) = flat.encode(drawing(), 0).pictures
    assert encoder.for_scene(drawing()).pictures["picture"] is fine
    assert len(encoded) == 1
    coarse = encoder.for_scene(drawing(100)).pictures["picture"]
    (finer,) = flat.encode(drawing(100), 1).pictures
    assert len(encoded) == 3
    assert finer.key != coarse.key
    assert len(finer.file) >= len(coarse.file)
    assert encoder.for_scene(drawing(100)).pictures["picture"] is finer
