"""The maps of a report as pictures: means, differences, and what is significant.

Cells are drawn in the order of their values, equally wide, since the values need not be equally spaced or be numbers.
What is better is bright, whichever direction that is; differences are blue where the first is better and orange where
the second is.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from pftrack.figures.style import INK, diverging
from pftrack.sweep.axis import find_declaration
from pftrack.sweep.cells import Code
from pftrack.sweep.comparison import TEST_TITLES, Comparison
from pftrack.sweep.quantities import Quantity
from pftrack.sweep.report.colours import CODE_NAMES, CODES, amounts, largest_difference, scale_of
from pftrack.sweep.report.labels import format_value
from pftrack.sweep.report.panels import Block, stack
from pftrack.sweep.report.study import Study

__all__ = ["mean_maps", "sheet", "significance_maps"]


def sheet(study: Study, quantity: Quantity) -> Figure:
    """Draw all maps of a quantity below each other: of the trackers, of the differences, of what is significant."""
    compared = [_differences(study, quantity), _significance(study, quantity)] if study.pairs else []
    return stack(study, [_means([study], quantity), *compared])


def mean_maps(studies: Sequence[Study], quantity: Quantity) -> Figure:
    """Draw the mean of a quantity in every cell, of one or several studies on the same axes, on one colour scale."""
    return stack(studies[0], [_means(studies, quantity)])


def significance_maps(study: Study, quantity: Quantity) -> Figure:
    """Draw where one tracker is better by a quantity, each cell tested by itself, a map for every pair."""
    return stack(study, [_significance(study, quantity)])


def _means(studies: Sequence[Study], quantity: Quantity) -> Block:
    maps = {
        "\n".join([study.title(name), *([_fixed(study)] if len(studies) > 1 else [])]): quantity.means(cells)
        for study in studies
        for name, cells in study.maps.items()
    }
    scale = Normalize(*scale_of(quantity, maps.values()))
    return Block(f"{quantity.label}; {quantity.better} is better", maps, amounts(quantity), scale)


def _differences(study: Study, quantity: Quantity) -> Block:
    pairs = study.comparisons[quantity.name]
    maps = {_title(study, pair): pair.difference for pair in pairs}
    most = largest_difference(pairs)
    unit = f", {quantity.unit}" if quantity.unit else ""
    return Block(f"Difference{unit}; positive where 1 is better", maps, diverging(), Normalize(-most, most))


def _significance(study: Study, quantity: Quantity) -> Block:
    pairs = study.comparisons[quantity.name]
    maps = {_title(study, pair): pair.significance(study.level).codes.astype(float) for pair in pairs}
    heading = f"{quantity.title}, {TEST_TITLES[pairs[0].test]} test at {study.level:g}, each cell by itself"
    names = {code: name.format(first="1", second="2") for code, name in CODE_NAMES.items()}
    key = tuple(Patch(facecolor=CODES[code], edgecolor=INK["outline"], label=name) for code, name in names.items())
    colours, scale = ListedColormap([CODES[code] for code in Code]), BoundaryNorm(np.arange(-0.5, 4.5), 4)
    return Block(heading, maps, colours, scale, key)


def _title(study: Study, pair: Comparison) -> str:
    return f"1: {study.title(pair.first)}\n2: {study.title(pair.second)}"


def _fixed(study: Study) -> str:
    experiment = study.result.plan.wiring
    return ", ".join(
        f"{find_declaration(experiment, name).title.lower()} {format_value(value)}"
        for name, value in study.result.plan.values.items()
    )
