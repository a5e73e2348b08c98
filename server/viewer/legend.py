"""The legend: which colour means what, in the same colours as in scene, plots and video."""

from pftrack.drawing import COLOURS

__all__ = ["caption_html", "legend_html"]

MEANINGS = {
    "estimate": "estimate",
    "truth": "truth",
    "prediction": "particles from the prediction",
    "observation": "particles from the observation",
    "lost": "lost",
}


def legend_html() -> str:
    """Return the legend as one paragraph of coloured dots."""
    entries = "".join(
        f'<span class="pf-key"><i style="background:rgb{COLOURS[name]}"></i>{meaning}</span>'
        for name, meaning in MEANINGS.items()
    )
    return f'<div class="pf-legend" role="note" aria-label="Legend">{entries}</div>'


def caption_html(caption: str) -> str:
    """Return the line about the frame that is shown."""
    safe = caption.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return f'<div class="pf-caption">{safe or "&nbsp;"}</div>'
