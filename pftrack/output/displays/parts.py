"""What displays are made of."""

from collections.abc import Iterable
from html import escape

__all__ = ["box", "row", "table"]

KEY = "text-align:left;opacity:.75;padding:1px 12px 1px 0;white-space:nowrap"
VALUE = "text-align:left;font-variant-numeric:tabular-nums;padding:1px 12px 1px 0"
"""Styles of a cell that says what something is, and of one that says how much."""


def box(title: str, content: str) -> str:
    """Return content under a title, side by side where there is room.

    Args:
        title: Plain text.
        content: HTML.
    """
    return (
        f'<div class="pftrack"><strong>{escape(title)}</strong>'
        f'<div style="display:flex;flex-wrap:wrap;gap:8px 24px;margin-top:6px">{content}</div></div>'
    )


def table(rows: str) -> str:
    """Return rows as a table that looks like the text around it."""
    return f'<table style="margin:0;font-size:inherit;color:inherit;border-collapse:collapse">{rows}</table>'


def row(title: str, cells: Iterable[str]) -> str:
    """Return a row of a table.

    Args:
        title: What it is about, plain text.
        cells: HTML.
    """
    filled = "".join(f'<td style="{VALUE}">{cell}</td>' for cell in cells)
    return f'<tr><td style="{KEY}">{escape(title)}</td>{filled}</tr>'
