"""Write the pages' colours from the library's palette.

`python -m tools.page_palette` writes a style sheet with a variable for each meaning, and a module with the colours of
maps. A test fails if the files are out of date.
"""

import json
from pathlib import Path

from pftrack.core.model.drawing import COLOURS, DIVERGING, VERDICTS, VIRIDIS, Themed, hexadecimal

__all__ = ["files"]

FOLDER = Path(__file__).parents[1] / "frontend_static" / "shared"
THEMED = "truth"
MEANINGS = tuple(name for name in COLOURS if name != THEMED)
NOTE = "Generated from pftrack/core/model/palette.yaml by `python -m tools.page_palette`; changes here are lost."


def files() -> dict[Path, str]:
    """Return the text of each generated file."""
    return {FOLDER / "palette.css": _sheet(), FOLDER / "palette.js": _module()}


def _sheet() -> str:
    lines = [f"  --{name}: {hexadecimal(COLOURS[name])};" for name in MEANINGS]
    lines.append(f"  --{THEMED}: light-dark({hexadecimal(COLOURS[THEMED])}, {hexadecimal(COLOURS['paper'])});")
    return f"/* {NOTE} */\n:root {{\n" + "\n".join(lines) + "\n}\n"


def _module() -> str:
    return (
        f"// {NOTE}\n\n"
        "/** @typedef {[number, number, number]} Colour Red, green and blue, 0 to 255. */\n"
        "/** @typedef {{light: Colour, dark: Colour}} Themed */\n\n"
        "/** Colours of amounts, in equal steps.\n *\n * @type {Colour[]} */\n"
        f"export const VIRIDIS = {_rows([json.dumps(colour) for colour in VIRIDIS])};\n\n"
        "/** Colours of differences, in equal steps: the second method ahead, neither, the first method ahead.\n *\n"
        " * @type {Themed[]} */\n"
        f"export const DIVERGING = {_rows([_themed(pair) for pair in DIVERGING])};\n\n"
        "/** Colours of a test's outcome between two methods. */\n"
        "export const VERDICTS = /** @type {const} */ ({\n"
        + "".join(f"  {name}: {_themed(pair)},\n" for name, pair in VERDICTS.items())
        + "});\n"
    )


def _themed(pair: Themed) -> str:
    return f"{{ light: {json.dumps(pair.light)}, dark: {json.dumps(pair.dark)} }}"


def _rows(values: list[str]) -> str:
    return "[\n" + "".join(f"  {value},\n" for value in values) + "]"


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
