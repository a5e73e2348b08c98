"""The legend: which colour means what, in the same colours as in scene, plots and video."""

from collections.abc import Iterable
from html import escape

from pftrack.core.model.drawing import COLOURS, Key, sort_keys


def legend_html(keys: Iterable[Key]) -> str:
    """Return the legend as one paragraph of coloured dots, each meaning once, in the palette's order."""
    entries = "".join(
        f'<span class="pf-key"><i style="background:rgb{COLOURS[key.colour]}"></i>{escape(key.meaning)}</span>'
        for key in sort_keys(keys)
    )
    return f'<div class="pf-legend" role="note" aria-label="Legend">{entries}</div>'


def caption_html(caption: str, branch_point: int | None = None) -> str:
    """Return the line about the frame that is shown, and where a change would make a branch, if it would."""
    what = "" if branch_point is None else f"<br>A change makes a branch from frame {branch_point}."
    return f'<div class="pf-caption">{escape(caption) or "&nbsp;"}{what}</div>'
