"""The pages' colours."""

import re
from pathlib import Path

from pftrack.core.model.drawing import COLOURS, OKABE_ITO, hexadecimal
from tools.page_palette import files

PAGES = Path(__file__).parents[2] / "frontend_static"


def test_the_files_are_of_this_palette() -> None:
    """The files are what the palette gives now; `python -m tools.page_palette` writes them again."""
    for path, text in files().items():
        assert path.read_text(encoding="utf-8") == text, path.name


def test_no_other_file_of_the_pages_has_a_colour_of_the_palette() -> None:
    """A colour that carries a meaning is written nowhere else, neither in hexadecimal nor in decimal."""
    chromatic = {name: colour for name, colour in {**OKABE_ITO, **COLOURS}.items() if len(set(colour)) > 1}
    words = {hexadecimal(colour) for colour in chromatic.values()}
    words |= {"{}[, ]+{}[, ]+{}".format(*colour) for colour in chromatic.values()}
    pattern = re.compile("|".join(words), re.IGNORECASE)
    for path in sorted(PAGES.rglob("*")):
        if path.suffix in {".js", ".css", ".html"} and not path.name.startswith("palette."):
            assert not pattern.search(path.read_text(encoding="utf-8")), path.name


def test_whatever_a_legend_may_name_has_a_colour() -> None:
    """A key takes its colour from a variable of its name; one that is not there would leave the key empty."""
    sheet = (PAGES / "shared" / "palette.css").read_text(encoding="utf-8")
    assert set(re.findall(r"--([a-z]+):", sheet)) == set(COLOURS)
