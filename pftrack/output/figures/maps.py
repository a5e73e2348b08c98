"""Heat maps side by side in blocks, blocks below each other.

All lengths are inches. Maps of different blocks are equally large and stand below each other. Cells are drawn in the
order of their values, equally wide, since the values need not be equally spaced or be numbers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Patch, Rectangle

from pftrack.core.arrays import Floats
from pftrack.output.figures.panels import APART_IN, LINE_IN, axes_at, draw_key, length, ticks, write
from pftrack.output.figures.style import HEADING_PT, INK, LETTERS_PT, TEXT_PT

WIDE_IN = 2.9
MOST_COLUMNS, FEWER_COLUMNS = 4, 3
GAP_IN, EDGE_IN = 0.2, 0.1
HEADING_IN, KEY_IN = 0.36, 0.38
BAR_IN, BAR_ROOM_IN = 0.12, 0.75


@dataclass(frozen=True)
class MapAxis:
    """An axis that all maps have.

    Attributes:
        title: With the unit.
        values: In words, one a cell.
        is_named: Whether they are names, which are written upright rather than left out.
    """

    title: str = ""
    values: tuple[str, ...] = ("",)
    is_named: bool = False


@dataclass(frozen=True)
class Block:
    """Maps on one scale, side by side.

    Attributes:
        heading: Above all of them.
        maps: (values of y, values of x) each, by title; NaN where nothing is known.
        colours: Of the scale.
        scale: Of the values.
        key: What the colours mean, below; without one the scale stands at the right.
    """

    heading: str
    maps: dict[str, Floats]
    colours: Colormap
    scale: Normalize
    key: tuple[Patch, ...] = ()

    @property
    def columns(self) -> int:
        """How many maps stand side by side."""
        return len(self.maps) if len(self.maps) <= MOST_COLUMNS else FEWER_COLUMNS

    @property
    def rows(self) -> int:
        """How many stand below each other."""
        return -(-len(self.maps) // self.columns)

    @property
    def titles_in(self) -> float:
        """Height of the titles."""
        return LINE_IN * (1.5 + max(title.count("\n") for title in self.maps))


def value_block(heading: str, maps: dict[str, Floats], colours: Colormap, ends: tuple[float, float]) -> Block:
    """Return maps of values, whose scale stands at the right."""
    return Block(heading, maps, colours, Normalize(*ends))


def code_block(heading: str, maps: dict[str, Floats], colours: Sequence[tuple[str, str]]) -> Block:
    """Return maps of whole numbers, each with a colour and a name, which stand below."""
    key = tuple(Patch(facecolor=colour, edgecolor=INK["outline"], label=name) for colour, name in colours)
    scale = BoundaryNorm(np.arange(-0.5, len(colours)), len(colours))
    return Block(heading, maps, ListedColormap([colour for colour, _ in colours]), scale, key)


class _Grid:
    """The room that the axes of all maps take.

    Attributes:
        across: Values of x.
        up: Values of y.
        names: Of both axes.
        upright: Whether values of x are written upright, since they are names that need the room.
        left: Room for the values of y and the axis's name.
        below: Room for the values of x and the axis's name.
        high: Height of a map.
    """

    def __init__(self, x: MapAxis, y: MapAxis, proportion: float) -> None:
        self.across, self.up = x.values, y.values
        self.names = x.title, y.title
        longest = _longest(self.across)
        self.upright = x.is_named and longest + APART_IN > WIDE_IN / len(self.across)
        self.left = 0.45 + _longest(self.up)
        self.below = (longest if self.upright else LINE_IN) + 0.32
        self.high = WIDE_IN * proportion

    def size(self, block: Block) -> tuple[float, float]:
        """Return the width and the height of a block."""
        width = self.left + block.columns * (WIDE_IN + GAP_IN) + (0.0 if block.key else BAR_ROOM_IN)
        rows = block.rows * (block.titles_in + self.high) + (block.rows - 1) * GAP_IN
        return width, HEADING_IN + rows + self.below + (KEY_IN if block.key else 0.0)

    def write_across(self, figure: Figure, left: float, bottom: float) -> None:
        """Write the axis below a map, whose lower left corner is given."""
        step = WIDE_IN / len(self.across)
        for place, text in ticks(self.across, step, LINE_IN if self.upright else _longest(self.across) + APART_IN):
            x = left + (place + 0.5) * step
            write(figure, x, bottom - 0.05, text, LETTERS_PT, anchor="n", upright=self.upright)
        write(figure, left + WIDE_IN / 2, bottom - self.below + 0.14, self.names[0], TEXT_PT, anchor="s")

    def write_up(self, figure: Figure, left: float, bottom: float) -> None:
        """Write the axis at the left of a map, whose lower left corner is given."""
        step = self.high / len(self.up)
        for place, text in ticks(self.up, step, LINE_IN):
            write(figure, left - 0.05, bottom + (place + 0.5) * step, text, LETTERS_PT, anchor="e")
        write(
            figure, left - self.left + EDGE_IN, bottom + self.high / 2, self.names[1], TEXT_PT, anchor="w", upright=True
        )


def stack(x: MapAxis, y: MapAxis, blocks: Sequence[Block], proportion: float) -> Figure:
    """Draw blocks of maps, which all have the same axes.

    Args:
        x: Axis across.
        y: Axis up.
        blocks: From above.
        proportion: Height of a map, of its width.
    """
    grid = _Grid(x, y, proportion)
    sizes = [grid.size(block) for block in blocks]
    width, top = max(width for width, _ in sizes), sum(height for _, height in sizes) + EDGE_IN
    figure = Figure(figsize=(width, top))
    canvas = axes_at(figure, 0, 0, width, top)  # one for all maps, since axes of their own would take most of the time
    canvas.set(xlim=(0, width), ylim=(0, top), autoscale_on=False)
    canvas.set_axis_off()
    for block, (_, height) in zip(blocks, sizes, strict=True):
        _draw(figure, canvas, grid, block, top)
        top -= height
    return figure


def _draw(figure: Figure, canvas: Axes, grid: _Grid, block: Block, top: float) -> None:
    """Draw a block below a height; the canvas is in inches."""
    write(figure, grid.left, top - HEADING_IN + 0.1, block.heading, HEADING_PT)
    highest = top - HEADING_IN - block.titles_in - grid.high
    lowest = highest - (block.rows - 1) * (block.titles_in + grid.high + GAP_IN)
    for place, (title, values) in enumerate(block.maps.items()):
        row, column = divmod(place, block.columns)
        left = grid.left + column * (WIDE_IN + GAP_IN)
        bottom = highest - row * (block.titles_in + grid.high + GAP_IN)
        image = _map(canvas, (left, left + WIDE_IN, bottom, bottom + grid.high), values, block)
        write(figure, left + WIDE_IN / 2, bottom + grid.high + 0.06, title, TEXT_PT, anchor="s")
        if column == 0:
            grid.write_up(figure, left, bottom)
        if place + block.columns >= len(block.maps):
            grid.write_across(figure, left, bottom)
    if block.key:
        draw_key(figure, block.key, grid.left, lowest - grid.below - 0.08)
        return
    left = grid.left + block.columns * (WIDE_IN + GAP_IN)
    bar = figure.colorbar(image, cax=axes_at(figure, left, highest, BAR_IN, grid.high))
    bar.ax.tick_params(labelsize=LETTERS_PT)
    bar.outline.set_visible(False)


def _map(canvas: Axes, extent: tuple[float, float, float, float], values: Floats, block: Block) -> AxesImage:
    """Draw the cells of a map; what is not known is hatched."""
    left, right, bottom, top = extent
    box = (left, bottom), right - left, top - bottom
    if not np.isfinite(values).all():
        canvas.add_patch(Rectangle(*box, facecolor="white", edgecolor=INK["hatching"], hatch="////", linewidth=0))
    image = canvas.imshow(
        np.ma.masked_invalid(values),
        block.colours,
        block.scale,
        extent=extent,
        origin="lower",
        aspect="auto",
        interpolation="nearest",
        zorder=2,  # over the hatching
    )
    canvas.add_patch(Rectangle(*box, fill=False, edgecolor=INK["frame"], linewidth=0.6, zorder=3))
    return image


def _longest(texts: Sequence[str]) -> float:
    return max(length(text, LETTERS_PT) for text in texts)
