"""The maps of a report, drawn by matplotlib: means, differences, and what is significant.

Cells are drawn in the order of their values, equally wide, since the values need not be equally spaced or be numbers.
What is better is bright, whichever direction that is; differences are blue where the first is better and orange where
the second is.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, Normalize
from matplotlib.figure import Figure, FigureBase
from matplotlib.image import AxesImage
from matplotlib.patches import Patch
from numpy.typing import NDArray

from pftrack.sweep.axis import declared
from pftrack.sweep.cells import Code
from pftrack.sweep.comparison import TEST_TITLES
from pftrack.sweep.quantities import Quantity
from pftrack.sweep.report.colours import CODE_NAMES, CODES, GREYS, amounts, diverging, largest_difference, scale_of
from pftrack.sweep.report.study import Study, label, shown

__all__ = ["mean_maps", "sheet", "significance_maps"]

PANEL_IN = 3.4
NARROWEST_IN = 5.6
MOST_TICKS = 10
MOST_COLUMNS = 4
FEWER_COLUMNS = 3

Panels = dict[str, NDArray[np.float64]]


def sheet(study: Study, quantity: Quantity) -> Figure:
    """Draw all maps of a quantity under each other: of the trackers, of the differences, of what is significant."""
    parts = [len(study.trackers), *([len(study.pairs)] * 2 if study.pairs else [])]
    sizes = [_size(study, count) for count in parts]
    heights = [height for _, height in sizes]
    figure = Figure(figsize=(max(width for width, _ in sizes), sum(heights)), layout="constrained")
    below = figure.subfigures(len(parts), 1, height_ratios=heights, squeeze=False)[:, 0]
    _draw_means(below[0], [study], quantity)
    if study.pairs:
        _draw_differences(below[1], study, quantity)
        _draw_significance(below[2], study, quantity)
    return figure


def mean_maps(studies: Sequence[Study], quantity: Quantity) -> Figure:
    """Draw the mean of a quantity in every cell, of one or several studies on the same axes, on one colour scale."""
    count = sum(len(study.trackers) for study in studies)
    figure = Figure(figsize=_size(studies[0], count), layout="constrained")
    _draw_means(figure, studies, quantity)
    return figure


def significance_maps(study: Study, quantity: Quantity) -> Figure:
    """Draw where one tracker is better by a quantity, each cell tested by itself, a map for every pair."""
    figure = Figure(figsize=_size(study, len(study.pairs)), layout="constrained")
    _draw_significance(figure, study, quantity)
    return figure


def _draw_means(parent: FigureBase, studies: Sequence[Study], quantity: Quantity) -> None:
    panels = {
        "\n".join([study.title(name), *([_fixed(study)] if len(studies) > 1 else [])]): quantity.means(cells)
        for study in studies
        for name, cells in study.maps.items()
    }
    scale = Normalize(*scale_of(quantity, panels.values()))
    _maps(parent, studies[0], panels, amounts(quantity), scale, f"{quantity.label}\n{quantity.better} is better")


def _draw_differences(parent: FigureBase, study: Study, quantity: Quantity) -> None:
    pairs = study.comparisons[quantity.name]
    panels = {f"1: {study.title(it.first)}\n2: {study.title(it.second)}": it.difference for it in pairs}
    most = largest_difference(pairs)
    unit = f", {quantity.unit}" if quantity.unit else ""
    _maps(parent, study, panels, diverging(), Normalize(-most, most), f"Difference{unit}\npositive where 1 is better")


def _draw_significance(parent: FigureBase, study: Study, quantity: Quantity) -> None:
    pairs = study.comparisons[quantity.name]
    places = _grid(parent, study, len(pairs))
    colours, scale = ListedColormap([CODES[code] for code in Code]), BoundaryNorm(np.arange(-0.5, 4.5), 4)
    for axes, pair in zip(places, pairs, strict=True):
        _draw(axes, study, pair.significance(study.level).codes.astype(float), colours, scale)
        axes.set_title(f"1: {study.title(pair.first)}\n2: {study.title(pair.second)}", fontsize=9)
    names = {code: name.format(first="1", second="2") for code, name in CODE_NAMES.items()}
    handles = [Patch(facecolor=CODES[code], edgecolor=GREYS["outline"], label=name) for code, name in names.items()]
    parent.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    parent.suptitle(
        f"{quantity.title}, {TEST_TITLES[pairs[0].test]} test at {study.level:g}, each cell by itself", fontsize=11
    )


def _fixed(study: Study) -> str:
    experiment = study.result.plan.wiring
    return ", ".join(
        f"{declared(experiment, name).title.lower()} {shown(value)}" for name, value in study.result.plan.values.items()
    )


def _maps(parent: FigureBase, study: Study, panels: Panels, colours: Colormap, scale: Normalize, title: str) -> None:
    """Draw maps side by side on one colour scale."""
    places = _grid(parent, study, len(panels))
    for axes, (name, values) in zip(places, panels.items(), strict=True):
        image = _draw(axes, study, values, colours, scale)
        axes.set_title(name, fontsize=10)
    bar = parent.colorbar(image, ax=places, shrink=0.9, pad=0.02)
    bar.set_label(title)
    bar.outline.set_visible(False)


def _rows_and_columns(count: int) -> tuple[int, int]:
    columns = count if count <= MOST_COLUMNS else FEWER_COLUMNS
    return -(-count // columns), columns


def _size(study: Study, count: int) -> tuple[float, float]:
    """Return width and height of so many maps, inches."""
    rows, columns = _rows_and_columns(count)
    across, down = (len(axis.values) if axis else 1 for axis in (study.x, study.y))
    height = PANEL_IN * min(max(down / across, 0.6), 1.4)
    return max(PANEL_IN * columns + 1.0, NARROWEST_IN), (height + 0.6) * rows + 0.4


def _grid(parent: FigureBase, study: Study, count: int) -> list[Axes]:
    """Return the places of so many maps, row by row."""
    rows, columns = _rows_and_columns(count)
    panels = parent.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for row in panels[:, 0]:
        if study.y:
            row.set_ylabel(label(study, study.y))
    for column in range(columns):
        last = (count - 1 - column) // columns
        panels[last, column].tick_params(labelbottom=True)
        if study.x:
            panels[last, column].set_xlabel(label(study, study.x))
    for place in range(count, rows * columns):
        panels.ravel()[place].remove()
    return list(panels.ravel()[:count])


def _draw(axes: Axes, study: Study, values: NDArray[np.float64], colours: Colormap, scale: Normalize) -> AxesImage:
    axes.patch.set(facecolor="white", edgecolor=GREYS["hatching"], hatch="////", linewidth=0)  # where nothing is known
    masked = np.ma.masked_invalid(values)
    image = axes.imshow(masked, cmap=colours, norm=scale, origin="lower", aspect="auto", interpolation="nearest")
    for axis, ticks in ((study.x, axes.set_xticks), (study.y, axes.set_yticks)):
        if axis is not None:
            stride = -(-len(axis.values) // MOST_TICKS)
            places = range(0, len(axis.values), stride)
            ticks(list(places), [shown(axis.values[place]) for place in places])
    axes.tick_params(length=2, labelsize=8)
    axes.spines[:].set(color=GREYS["frame"], linewidth=0.6)
    return image
