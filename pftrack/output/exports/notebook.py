"""Jupyter notebooks: cells of words and of code, as the content of a file."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

__all__ = ["Cell", "code", "markdown", "notebook"]


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell of a notebook.

    Attributes:
        kind: Whether it holds words or Python.
        source: What it holds.
    """

    kind: Literal["markdown", "code"]
    source: str


def markdown(text: str) -> Cell:
    """Return a cell of words, Markdown with formulas between dollar signs."""
    return Cell("markdown", text)


def code(source: str) -> Cell:
    """Return a cell of Python."""
    return Cell("code", source)


def notebook(cells: Sequence[Cell]) -> bytes:
    """Return a notebook that has not been run, the same bytes for the same cells."""
    # The schema of notebooks is loaded with it, for which only who exports one has to wait.
    import nbformat  # noqa: PLC0415
    from nbformat import v4  # noqa: PLC0415

    make: dict[str, Any] = {"markdown": v4.new_markdown_cell, "code": v4.new_code_cell}
    made = v4.new_notebook(
        cells=[make[cell.kind](cell.source, id=f"cell-{place}") for place, cell in enumerate(cells)],
        metadata={
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        },
    )
    nbformat.validate(made)
    return f"{nbformat.writes(made)}\n".encode()
