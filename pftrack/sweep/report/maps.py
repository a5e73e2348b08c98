"""The maps of a report as pictures: means, differences, and what is significant.

What is better is bright, whichever direction that is; differences are blue where the first is better and orange where
the second is.
"""

from collections.abc import Sequence

from matplotlib.figure import Figure

from pftrack.output.figures.maps import Block, MapAxis, code_block, stack, value_block
from pftrack.output.figures.style import diverging
from pftrack.sweep.axis import Axis, find_declaration
from pftrack.sweep.cells import Code, Quantity
from pftrack.sweep.comparison import TEST_TITLES, Comparison
from pftrack.sweep.report.frame import CODE_NAMES, CODES, amounts, format_value, label, largest_difference, scale_of
from pftrack.sweep.report.study import Study


def sheet(study: Study, quantity: Quantity) -> Figure:
    """Draw all maps of a quantity below each other: of the trackers, of the differences, of what is significant."""
    compared = [_differences(study, quantity), _significance(study, quantity)] if study.pairs else []
    return _stack(study, [_means([study], quantity), *compared])


def mean_maps(studies: Sequence[Study], quantity: Quantity) -> Figure:
    """Draw the mean of a quantity in every cell, of one or several studies on the same axes, on one colour scale."""
    return _stack(studies[0], [_means(studies, quantity)])


def significance_maps(study: Study, quantity: Quantity) -> Figure:
    """Draw where one tracker is better by a quantity, each cell tested by itself, a map for every pair."""
    return _stack(study, [_significance(study, quantity)])


def _stack(study: Study, blocks: Sequence[Block]) -> Figure:
    return stack(_axis(study, study.x), _axis(study, study.y), blocks, study.proportion)


def _axis(study: Study, axis: Axis | None) -> MapAxis:
    if axis is None:
        return MapAxis()
    return MapAxis(label(study, axis), tuple(format_value(value) for value in axis.values), is_named=not axis.numerical)


def _means(studies: Sequence[Study], quantity: Quantity) -> Block:
    maps = {
        "\n".join([study.title(name), *([_fixed(study)] if len(studies) > 1 else [])]): quantity.means(cells)
        for study in studies
        for name, cells in study.maps.items()
    }
    ends = scale_of(quantity, maps.values())
    return value_block(f"{quantity.label}; {quantity.better} is better", maps, amounts(quantity), ends)


def _differences(study: Study, quantity: Quantity) -> Block:
    pairs = study.comparisons[quantity.name]
    maps = {_title(study, pair): pair.difference for pair in pairs}
    most = largest_difference(pairs)
    unit = f", {quantity.unit}" if quantity.unit else ""
    return value_block(f"Difference{unit}; positive where 1 is better", maps, diverging(), (-most, most))


def _significance(study: Study, quantity: Quantity) -> Block:
    pairs = study.comparisons[quantity.name]
    maps = {_title(study, pair): pair.significance(study.level).codes.astype(float) for pair in pairs}
    heading = f"{quantity.title}, {TEST_TITLES[pairs[0].test]} test at {study.level:g}, each cell by itself"
    colours = [(CODES[code], CODE_NAMES[code].format(first="1", second="2")) for code in Code]
    return code_block(heading, maps, colours)


def _title(study: Study, pair: Comparison) -> str:
    return f"1: {study.title(pair.first)}\n2: {study.title(pair.second)}"


def _fixed(study: Study) -> str:
    plan = study.result.plan
    return ", ".join(
        f"{find_declaration(plan.wiring, name, plan.kind).title.lower()} {format_value(value)}"
        for name, value in plan.values.items()
    )
