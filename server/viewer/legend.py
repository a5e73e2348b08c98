"""The legend: which colour means what, in the same colours as in scene, plots and video."""

from collections.abc import Iterable
from html import escape

from pftrack.layer import Layer, legend
from pftrack.palette import COLOURS

__all__ = ["caption_html", "legend_html"]


def legend_html(layers: Iterable[Layer]) -> str:
    """Return the legend as one paragraph of coloured dots, for what these layers can show."""
    entries = "".join(
        f'<span class="pf-key"><i style="background:rgb{COLOURS[key.colour]}"></i>{escape(key.meaning)}</span>'
        for key in legend(layers)
    )
    return f'<div class="pf-legend" role="note" aria-label="Legend">{entries}</div>'


def caption_html(caption: str) -> str:
    """Return the line about the frame that is shown."""
    return f'<div class="pf-caption">{escape(caption) or "&nbsp;"}</div>'
