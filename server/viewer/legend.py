"""The legend: which colour means what, in the same colours as in scene, plots and video."""

from collections.abc import Iterable

from pftrack.drawing import COLOURS

__all__ = ["caption_html", "legend_html"]

MEANINGS = (
    ("estimate", "estimate", ""),
    ("truth", "truth", "truth"),
    ("prediction", "particles from the prediction", "particles by sampler"),
    ("observation", "particles from the observation", "particles by sampler"),
    ("observation", "particles from the solid's pose", "particles by prediction"),
    ("prediction", "particles from the feature's own past", "particles by prediction"),
    ("lost", "not recognised", "features"),
    ("lost", "limit of success", "region of success"),
    ("second", "second run, where it differs", "second run"),
    ("second", "smoothed path", "smoothed path"),
    ("second", "exact", "exact"),
    ("hidden", "observations", "observations"),
)
"""Colour, what it means, and the beginning of the name of a layer that shows it; empty is always shown."""


def legend_html(layers: Iterable[str]) -> str:
    """Return the legend as one paragraph of coloured dots, for what these layers can show."""
    known = tuple(layers)
    entries = "".join(
        f'<span class="pf-key"><i style="background:rgb{COLOURS[name]}"></i>{meaning}</span>'
        for name, meaning, start in MEANINGS
        if not start or any(layer.startswith(start) for layer in known)
    )
    return f'<div class="pf-legend" role="note" aria-label="Legend">{entries}</div>'


def caption_html(caption: str) -> str:
    """Return the line about the frame that is shown."""
    safe = caption.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return f'<div class="pf-caption">{safe or "&nbsp;"}</div>'
