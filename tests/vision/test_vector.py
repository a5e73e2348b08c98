"""The same drawing as shapes: every kind is there, in its colour, and where its coordinates say."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from pftrack.core.model.drawing import Drawing, Picture, Text
from pftrack.core.model.palette import COLOURS
from pftrack.vision.rendering.vector import svg
from tests.vision.test_rendering import EVERY, f32

SVG = "{http://www.w3.org/2000/svg}"
UNSEEN = {"frustum"}


@pytest.mark.parametrize("name", sorted(EVERY))
def test_every_kind_is_drawn(name: str) -> None:
    """As well-formed XML, with something to be seen unless the camera does not see itself."""
    root = ET.fromstring(svg(Drawing(40, 30, {"it": EVERY[name]})))  # noqa: S314 - made here
    (layer,) = (each for each in root.iter(f"{SVG}g") if "data-layer" in each.attrib)
    assert (len(list(layer)) > 0) == (name not in UNSEEN)


def test_layers_are_left_out_and_words_are_words() -> None:
    """What is not shown is not in the file, and no name becomes markup."""
    words = Text(f32(3, 4, 0), "<b> & σ", (0, 0, 0), "names")
    picture = Picture(np.zeros((30, 40, 3), np.uint8))
    drawing = Drawing(40, 30, {"picture": picture, "words": words}, caption="a < b")
    root = ET.fromstring(svg(drawing))  # noqa: S314 - made here
    (text,) = root.iter(f"{SVG}text")
    assert (text.text, text.get("x"), text.get("y")) == ("<b> & σ", "3.00", "4.00")
    (image,) = root.iter(f"{SVG}image")
    assert image.get("href", "").startswith("data:image/png;base64,")
    assert b"<text" not in svg(drawing, layers={"names": False})


def test_a_point_is_where_it_is() -> None:
    """The middle of the first pixel is half a pixel from the corner."""
    root = ET.fromstring(svg(Drawing(40, 30, {"it": EVERY["points"]})))  # noqa: S314 - made here
    (circle,) = root.iter(f"{SVG}circle")
    blue = "#{:02x}{:02x}{:02x}".format(*COLOURS["estimate"])
    assert (circle.get("cx"), circle.get("cy"), circle.get("fill")) == ("20.00", "15.00", blue)
    assert any(each.get("transform") == "translate(.5 .5)" for each in root.iter(f"{SVG}g"))
