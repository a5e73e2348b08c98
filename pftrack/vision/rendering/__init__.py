"""Rendering: drawings and worlds as pictures and films."""

from pftrack.vision.rendering.raster import png, render, render_beside

__all__ = ["png", "render", "render_beside"]
