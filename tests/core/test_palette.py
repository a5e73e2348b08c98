"""The palette: which colours mean what, everywhere."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib import colormaps

from pftrack.core.model import drawing
from pftrack.core.model.drawing import BRANCHES, COLOURS, CURVES, OKABE_ITO, VIRIDIS, Palette, hexadecimal
from pftrack.core.texts import read_whole

ROOT = Path(__file__).parents[2]


def test_a_wrong_colour_is_refused_with_its_line(tmp_path: Path) -> None:
    """A channel beyond 255 and a list that nobody knows are named with file and line."""
    known = Path(drawing.__file__).with_name("palette.yaml").read_text(encoding="utf-8")
    path = tmp_path / "palette.yaml"
    wrong = {
        known.replace("black [0, 0, 0]", "black [0, 0, 256]"): "line 6: okabe_ito.black has a wrong '2'",
        f"{known}\nblacks: [0, 0, 0]\n": "palette.yaml has an unknown field 'blacks'",
    }
    for text, problem in wrong.items():
        path.write_text(text, encoding="utf-8")
        with pytest.raises(ValueError, match=problem):
            read_whole(Palette, path)


def test_distinct() -> None:
    """No two curves, and no two branches, have the same colour; nor have two meanings."""
    for colours in (CURVES, BRANCHES, tuple(COLOURS.values())):
        assert len(set(colours)) == len(colours)


def test_viridis() -> None:
    """The stops of the map of amounts are matplotlib's."""
    theirs = colormaps["viridis"](np.linspace(0, 1, len(VIRIDIS)), bytes=True)[:, :3]
    np.testing.assert_allclose(np.array(VIRIDIS), theirs, atol=1)


def test_declared_once() -> None:
    """No other module of Python writes one of the eight colours by its digits."""
    digits = "|".join(hexadecimal(colour) for name, colour in OKABE_ITO.items() if name != "black")
    found = [
        str(path.relative_to(ROOT))
        for room in ("pftrack", "server")
        for path in (ROOT / room).rglob("*.py")
        if re.search(digits, path.read_text(encoding="utf-8"), re.IGNORECASE)
    ]
    assert not found
