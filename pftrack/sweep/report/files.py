"""Files of a sweep: its report in a folder, its rows as a table, and any of its figures as a picture at print size."""

import hashlib
import json
import re
from base64 import b64encode
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from jinja2 import Environment, PackageLoader
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.files import csv_text, part_of, settle, write_whole
from pftrack.core.model.drawing import VERDICTS, hexadecimal
from pftrack.core.model.parameters import with_role
from pftrack.core.refusal import ConflictError
from pftrack.core.version import __version__
from pftrack.output.figures import layout, style
from pftrack.runs.manifest import FORMAT
from pftrack.sweep.axis import Axis, SweepError, find_declaration
from pftrack.sweep.cells import (
    COMMON,
    SUCCESS,
    TEST_TITLES,
    CellMap,
    Code,
    Comparison,
    Correction,
    Quantity,
    samples,
    summary,
)
from pftrack.sweep.journal import Result, csv_pieces
from pftrack.sweep.report.study import Study, Table, format_value, label, tables

# Figures of a report: curves and boxes over one axis at a time, and maps over two.
#
# A map shows means, differences or what is significant. Better values are bright, in either direction; differences are
# blue where the first is better and orange where the second is. Figures are made without pyplot, so there is no global
# state.

Key: TypeAlias = list[Line2D]
MOST_BOXES = 16


def figures(study: Study) -> dict[str, Callable[[], Figure]]:
    """Return how to draw each figure that a study has, by the name of its file; no measure can take another's."""
    wanted: dict[str, Callable[[], Figure]] = {}
    several = [axis for axis in study.result.plan.axes if len(axis.values) > 1]
    if several:
        wanted["curves"] = partial(curves, study, several)
    boxed = _boxed_axis(study)
    for quantity in study.quantities:
        if study.y is not None:
            wanted[file_of(quantity)] = partial(sheet, study, quantity)
            if quantity.name == "error" and boxed is not None:
                wanted["boxes"] = partial(boxes, study, boxed, quantity)
        elif study.x is not None:
            wanted[file_of(quantity)] = partial(along, study, study.x, quantity)
    return wanted


def file_of(quantity: Quantity) -> str:
    """Return the name of the file, without its suffix, with the picture of a quantity."""
    return quantity.name if quantity.name in COMMON else f"measure-{quantity.name}"


def _boxed_axis(study: Study) -> Axis | None:
    """Return the axis that boxes are drawn over: the number of particles, or the only one with several numbers."""
    several = [axis for axis in study.result.plan.axes if axis.numerical and 1 < len(axis.values) <= MOST_BOXES]
    model = type(study.result.plan.parameters)
    particles = {declaration.name for declaration in with_role(model, "particles")}
    counts = [axis for axis in several if axis.name in particles]
    return counts[0] if counts else several[0] if len(several) == 1 else None


WIDE_IN, HIGH_IN = 3.3, 2.5
"""Size of a panel."""

EDGE_IN, BELOW_IN = 0.9, 0.55
"""Space for the values and the title of an axis beside and below a panel."""

BOX_IN, NARROWEST_IN, WIDEST_IN = 0.35, 5.0, 16.0
PERCENTILES = 5, 25, 50, 75, 95
"""Percentiles of a box: ends of the whiskers, edges of the box, and median."""


def curves(study: Study, axes: Sequence[Axis]) -> Figure:
    """Draw the success with its interval along every axis, all others pooled; error where nothing is judged."""
    wide = max(WIDE_IN, NARROWEST_IN / len(axes))
    size = wide + EDGE_IN, HIGH_IN + BELOW_IN + max(_values(study, axis).below(wide) for axis in axes)
    heading = "Success and its 95 % interval" if study.judged else "Mean error"
    figure, (panels,) = layout.lay_out([layout.Part(heading, len(axes), size, _key(study), shared=False)])
    for panel, axis in zip(panels, axes, strict=True):
        positions = np.array(axis.values, dtype=float) if axis.numerical else np.arange(len(axis.values))
        _curves(panel, study, positions, study.by_axis[axis.name])
        layout.finish(panel, label(study, axis), "Success rate" if study.judged else "Mean error")
        if not axis.numerical:
            layout.write_across(panel, _values(study, axis), wide)
    return figure


def boxes(study: Study, axis: Axis, quantity: Quantity) -> Figure:
    """Draw the runs' values of a quantity except success over one axis, one box per tracker and value."""
    figure, (panel,) = _over(study, axis, [(f"{quantity.title}\n{_of_boxes()}", _key(study, of_boxes=True))])
    _boxes(panel, study, axis, quantity)
    return figure


def along(study: Study, axis: Axis, quantity: Quantity) -> Figure:
    """Draw a quantity over the only axis: boxes, or rates with their interval, above the differences of the pairs."""
    is_success = quantity.name == SUCCESS
    better = f"{quantity.title}; {quantity.better} is better"
    parts = [(f"{better}\n{'95 % intervals' if is_success else _of_boxes()}", _key(study, of_boxes=not is_success))]
    if study.pairs:
        test = TEST_TITLES[study.comparisons[quantity.name][0].test]
        title = f"On the same scenes, 95 % intervals\nFilled where different, {test} test at {study.level:g}"
        parts.append((title, _key_of_pairs(study)))
    figure, panels = _over(study, axis, parts)
    if is_success:
        _curves(panels[0], study, np.arange(len(axis.values)), study.maps)
        layout.finish(panels[0], label(study, axis), quantity.label)
    else:
        _boxes(panels[0], study, axis, quantity)
    if study.pairs:
        _differences(panels[1], study, axis, quantity)
    return figure


def _of_boxes() -> str:
    low, lower, _, upper, high = PERCENTILES
    return f"Boxes {lower} to {upper} %, whiskers {low} to {high} %"


def _over(study: Study, axis: Axis, parts: Sequence[tuple[str, Key]]) -> tuple[Figure, list[Axes]]:
    """Return panels over an axis below each other, given the heading and the key of each."""
    values = _values(study, axis)
    wide = min(max(BOX_IN * len(axis.values) * len(study.trackers), NARROWEST_IN), WIDEST_IN)
    size = wide + EDGE_IN, HIGH_IN + BELOW_IN + values.below(wide)
    figure, rows = layout.lay_out([layout.Part(heading, 1, size, key) for heading, key in parts])
    panels = [panel for (panel,) in rows]
    for panel in panels:
        panel.set_xlim(-0.6, len(axis.values) - 0.4)
        layout.write_across(panel, values, wide)
    return figure, panels


def _values(study: Study, axis: Axis | None) -> layout.Values:
    if axis is None:
        return layout.Values()
    return layout.Values(
        label(study, axis), tuple(format_value(value) for value in axis.values), is_named=not axis.numerical
    )


def _curves(panel: Axes, study: Study, positions: NDArray[Any], found: Mapping[str, CellMap]) -> None:
    for name, colour in zip(study.trackers, _colours(study), strict=True):
        cells = found[name]
        values = cells.rate[0] if study.judged else cells.mean_error[0]
        layout.draw_curve(panel, positions, values, colour, (cells.low[0], cells.high[0]) if study.judged else None)
    panel.set_ylim(*((-0.02, 1.02) if study.judged else (0, None)))


def _boxes(panel: Axes, study: Study, axis: Axis, quantity: Quantity) -> None:
    found = samples(study.result, quantity, axis.name).values
    panel.use_sticky_edges = False
    width = 0.8 / len(study.trackers)
    for place, (name, colour) in enumerate(zip(study.trackers, _colours(study), strict=True)):
        known = [index for index, values in enumerate(found[name]) if len(values)]
        if known:
            ends = np.array([np.percentile(found[name][index], PERCENTILES) for index in known]).T
            layout.draw_boxes(
                panel, ends, np.array(known) + (place - (len(study.trackers) - 1) / 2) * width, width, colour
            )
    if all(values.min(initial=0.0) >= 0.0 for cells in found.values() for values in cells):
        panel.set_ylim(bottom=0)
    layout.finish(panel, label(study, axis), quantity.label)


def _differences(panel: Axes, study: Study, axis: Axis, quantity: Quantity) -> None:
    """Draw the differences on the same scenes with their intervals; filled where the test finds one better."""
    pairs = study.comparisons[quantity.name]
    width = 0.5 / len(pairs)
    for place, (pair, colour) in enumerate(zip(pairs, _colours_of_pairs(study), strict=True)):
        positions = np.arange(len(axis.values)) + (place - (len(pairs) - 1) / 2) * width
        codes = pair.significance(study.level).codes[0]
        better = (codes == Code.FIRST_BETTER) | (codes == Code.SECOND_BETTER)
        found = [it[0] for it in (pair.paired.mean, pair.paired.low, pair.paired.high)]
        layout.draw_differences(panel, positions, found, better, colour)
    unit = f", {quantity.unit}" if quantity.unit else ""
    layout.finish(panel, label(study, axis), f"Difference{unit}, + if 1 is better")


def _key(study: Study, *, of_boxes: bool = False) -> Key:
    lines = zip(study.trackers, _colours(study), strict=True)
    return [layout.key_line(study.title(name), colour, is_box=of_boxes) for name, colour in lines]


def _key_of_pairs(study: Study) -> Key:
    titles = (f"1: {study.title(first)}, 2: {study.title(second)}" for first, second in study.pairs)
    return [
        layout.key_line(title, colour, size=5) for title, colour in zip(titles, _colours_of_pairs(study), strict=True)
    ]


def _colours(study: Study) -> list[str]:
    return [style.CURVE_COLOURS[place % len(style.CURVE_COLOURS)] for place in range(len(study.trackers))]


def _colours_of_pairs(study: Study) -> list[str]:
    return [
        style.CURVE_COLOURS[(len(study.trackers) + place) % len(style.CURVE_COLOURS)]
        for place in range(len(study.pairs))
    ]


# Colours can be distinguished without red and green, and mean the same in every figure. Amounts are shown in viridis.
# Better cells are blue for the first tracker and orange for the second, in the difference maps as in the tests, with a
# neutral middle. All are the palette's, in the form that matplotlib and CSS read.

CODES = {
    Code.NOT_APPLICABLE: ("untested", "not applicable"),
    Code.NOT_SIGNIFICANT: ("none", "not significant"),
    Code.FIRST_BETTER: ("first", "1 better"),
    Code.SECOND_BETTER: ("second", "2 better"),
}
"""Names of colours in the palette, and their meanings, in the order of the codes."""


def amounts(quantity: Quantity) -> Colormap:
    """Return the map of a quantity's values, on which what is better is bright."""
    return style.viridis(is_reversed=quantity.better != "higher")


def scale_of(quantity: Quantity, means: Iterable[Floats]) -> tuple[float, float]:
    """Return the values at the two ends of a colour scale, which includes 0, and all of 0..1 for a share.

    Args:
        quantity: The shown quantity.
        means: Means of the cells of each map, any shape, NaN where missing.
    """
    if quantity.share:
        return 0.0, 1.0
    known = np.concatenate([np.ravel(values[np.isfinite(values)]) for values in means])
    low, high = float(known.min(initial=0.0)), float(known.max(initial=0.0))
    return (low, high) if high > low else (0.0, 1.0)


def largest_difference(pairs: Iterable[Comparison]) -> float:
    """Return the value at the ends of a scale of differences, 1 if no cell has a difference."""
    return max(float(np.nanmax(np.abs(pair.difference), initial=0.0)) for pair in pairs) or 1.0


def sheet(study: Study, quantity: Quantity) -> Figure:
    """Draw all maps of a quantity below each other: of the trackers, of the differences, of what is significant."""
    blocks = [_mean_block([study], quantity)]
    if study.pairs:
        blocks += [_difference_block(study, quantity), _significance_block(study, study.comparisons[quantity.name])]
        if quantity.name == SUCCESS:
            blocks.append(_significance_block(study, study.comparisons[quantity.name], "holm"))
    return _map_stack(study, blocks)


def mean_maps(studies: Sequence[Study], quantity: Quantity) -> Figure:
    """Draw the mean of a quantity in every cell, of one or several studies on the same axes, on one colour scale."""
    return _map_stack(studies[0], [_mean_block(studies, quantity)])


def significance_maps(study: Study, quantity: Quantity) -> Figure:
    """Draw where one tracker is better by a quantity, each cell by Bando's tests by itself, a map for every pair."""
    return _map_stack(study, [_significance_block(study, study.published(quantity))])


@dataclass(frozen=True)
class Block:
    """Maps on one scale, under a heading.

    Attributes:
        heading: Their heading.
        maps: Cells (rows, columns) by what stands above each.
        colours: Colours of the values.
        scale: From values to colours.
        key: Meanings of the colours of codes; without it a scale is drawn.
    """

    heading: str
    maps: Mapping[str, Floats]
    colours: Colormap
    scale: Normalize
    key: tuple[Patch, ...] = ()


def _map_stack(study: Study, blocks: Sequence[Block]) -> Figure:
    across, up = _values(study, study.x), _values(study, study.y)
    high = WIDE_IN * study.proportion
    size = WIDE_IN + EDGE_IN, high + BELOW_IN + across.below(WIDE_IN) + 0.4
    parts = [layout.Part(block.heading, len(block.maps), size, block.key) for block in blocks]
    figure, rows = layout.lay_out(parts)
    for part, block, panels in zip(parts, blocks, rows, strict=True):
        for place, (panel, (title, values)) in enumerate(zip(panels, block.maps.items(), strict=True)):
            image = layout.draw_map(panel, title, values, block.colours, block.scale)
            panel.set_ylabel(up.title if place % part.columns == 0 else "")
            panel.set_xlabel(across.title if place + part.columns >= part.count else "")
        layout.write_across(panels[0], across, WIDE_IN)
        layout.write_up(panels[0], up, high)
        if not block.key:
            layout.draw_scale(panels, image)
    return figure


def _mean_block(studies: Sequence[Study], quantity: Quantity) -> Block:
    maps = {
        "\n".join([study.title(name), *([_fixed(study)] if len(studies) > 1 else [])]): quantity.means(cells)
        for study in studies
        for name, cells in study.maps.items()
    }
    ends = scale_of(quantity, maps.values())
    return Block(f"{quantity.label}; {quantity.better} is better", maps, amounts(quantity), Normalize(*ends))


def _difference_block(study: Study, quantity: Quantity) -> Block:
    pairs = study.comparisons[quantity.name]
    maps = {_pair_title(study, pair): pair.difference for pair in pairs}
    most = largest_difference(pairs)
    unit = f", {quantity.unit}" if quantity.unit else ""
    return Block(f"Difference{unit}; positive where 1 is better", maps, style.diverging(), Normalize(-most, most))


def _significance_block(study: Study, pairs: Sequence[Comparison], correction: Correction = "none") -> Block:
    maps = {_pair_title(study, pair): pair.significance(study.level, correction).codes.astype(float) for pair in pairs}
    cells = "each cell by itself" if correction == "none" else "Holm's correction over the map"
    heading = f"{pairs[0].quantity.title}, {TEST_TITLES[pairs[0].test]} test at {study.level:g}, {cells}"
    colours = [hexadecimal(VERDICTS[name].light) for name, _ in CODES.values()]
    named = zip(colours, CODES.values(), strict=True)
    key = tuple(Patch(facecolor=colour, edgecolor=style.INK["outline"], label=words) for colour, (_, words) in named)
    return Block(heading, maps, ListedColormap(colours), BoundaryNorm(np.arange(-0.5, len(Code)), len(Code)), key)


def _pair_title(study: Study, pair: Comparison) -> str:
    return f"1: {study.title(pair.first)}\n2: {study.title(pair.second)}"


def _fixed(study: Study) -> str:
    plan = study.result.plan
    return ", ".join(
        f"{find_declaration(plan.wiring, name, plan.kind).title.lower()} {format_value(value)}"
        for name, value in plan.values.items()
    )


@dataclass(frozen=True)
class Report:
    """A report that was written.

    Attributes:
        tables: Its tables.
        files: Its files.
        page: The page among them.
        figures: The sweep's main numbers.
    """

    tables: tuple[Table, ...]
    files: tuple[Path, ...]
    page: Path
    figures: dict[str, Any]

    def as_dict(self) -> dict[str, Any]:
        """Return the report as JSON values."""
        shown = [
            {"title": it.title, "columns": it.columns, "rows": [[*map(_numbers_in, row)] for row in it.rows]}
            for it in self.tables
        ]
        return {**self.figures, "tables": shown, "files": [str(path) for path in self.files], "page": str(self.page)}


NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.])")


def _numbers_in(cell: str) -> Any:  # noqa: ANN401 - JSON
    """Return the number in a cell, several as a list, of another text itself, and None of an empty cell."""
    bare = re.sub(r"(?<=\d)-(?=\d)", " ", cell)  # an interval
    found = [float(text.replace(",", "")) for text in NUMBER.findall(bare)]
    if not found or NUMBER.sub("", bare).strip(" ()to"):
        return cell or None
    return found[0] if len(found) == 1 else found


def write_report(
    result: Result,
    folder: Path,
    *,
    x: str | None = None,
    y: str | None = None,
    level: float = 0.01,
    form: Literal["png", "svg"] | None = "png",
) -> Report:
    """Write the report of a result into a folder; a report that is there already is replaced.

    Args:
        result: Finished, or as far as it came.
        folder: Output folder; it is made if needed.
        x: Name of the axis across the maps; the first with several numbers if not given.
        y: Name of the axis down the maps; the next one if not given.
        level: Level of significance.
        form: Kind of the pictures, next to the page and on it; None draws none, which takes longest.

    Raises:
        SweepError: The result is empty or damaged, or has no such axis.
        OSError: The folder cannot be written.
    """
    figures_of_all = summary(result)
    if not figures_of_all["runs"]:
        raise SweepError("the sweep has no rows yet, so there is nothing to report")
    study = Study.of(result, x=x, y=y, level=level)
    made = tables(study)
    folder.mkdir(parents=True, exist_ok=True)
    files, pictures = [], {}
    manifest = manifest_of_result(result)
    if form is not None:
        for name, draw in figures(study).items():
            drawn = style.encode(draw(), form, f"{manifest['title']}: {name}", manifest, style.SCREEN_DOTS_PER_INCH)
            files.append(folder / f"{name}.{form}")
            files[-1].write_bytes(drawn)
            pictures[name] = f"data:{MEDIA[form]};base64,{b64encode(drawn).decode()}"
    files.append(folder / "tables.csv")
    files[-1].write_text("".join(csv_text([[it.title], it.columns, *it.rows, []]) for it in made), encoding="utf-8")
    index = folder / "index.html"
    index.write_text(page(study, made, pictures), encoding="utf-8")
    return Report(made, (*files, index), index, {**figures_of_all, "complete": result.complete})


def page(study: Study, tables: Sequence[Table], pictures: Mapping[str, str]) -> str:
    """Return the page of a study as self-contained HTML.

    Success and error are open, every other measure is a separate section that a reader unfolds.

    Args:
        study: The study.
        tables: All of its tables.
        pictures: Addresses of its figures by name, as data.
    """
    folder = Environment(loader=PackageLoader("pftrack.sweep", "report"), autoescape=True, trim_blocks=True)
    sections = [
        {
            "quantity": it,
            "picture": file_of(it),
            "is_open": it.name in COMMON,
            "better": _count_better(study, it),
            "tables": [table for table in tables if table.quantity == it.name],
        }
        for it in study.quantities
    ]
    return folder.get_template("page.html").render(
        title=f"{study.result.plan.wiring.title}: a sweep",
        question=study.result.plan.wiring.texts.question,
        facts=_facts(study),
        tables=[table for table in tables if not table.quantity],
        sections=sections,
        pictures=pictures,
        judged=study.judged,
        share=f"{100 * study.level:g}",
    )


def _count_better(study: Study, quantity: Quantity) -> list[str]:
    """Return the numbers of cells in which each tracker is better, as a summary of the folded section."""
    said = []
    for pair in study.comparisons[quantity.name] if study.pairs and study.x else ():
        codes = pair.significance(study.level).codes
        first, second = (int((codes == code).sum()) for code in (Code.FIRST_BETTER, Code.SECOND_BETTER))
        tested = int((codes != Code.NOT_APPLICABLE).sum())
        said.append(f"{pair.first} {first}, {pair.second} {second} of {tested} tested")
    return said


def _facts(study: Study) -> dict[str, str]:
    """Return what was computed, in words."""
    plan = study.result.plan
    fixed = ", ".join(f"{name} = {format_value(value)}" for name, value in plan.values.items())
    return {
        "Experiment": f"{plan.experiment} ({'; '.join(citation.short for citation in plan.wiring.texts.references)})",
        "Runs": f"{sum(int(total.runs[0, 0]) for total in study.totals.values()):,} of {plan.runs:,}",
        "Trackers": ", ".join(plan.trackers),
        **{
            label(study, axis): f"{', '.join(format_value(value) for value in axis.values)} ({axis.name})"
            for axis in plan.axes
        },
        "Trials": f"{plan.trials} a tracker and condition, {plan.frames} frames each",
        "Fixed": fixed or "all as by default",
        "Seed": str(plan.seed),
    }


SUFFIXES = ("csv", "manifest.json", "png", "svg")
MEDIA = {"png": "image/png", "svg": "image/svg+xml"}


def export_result(result: Result, path: Path, *, plot: str | None = None) -> tuple[Path, ...]:
    """Write a result as a file of the kind that its name asks for, and return what was written.

    Args:
        result: Finished, or as far as it came.
        path: Output file; an existing file is replaced. Beside a table lies its manifest.
        plot: Name of the map or of the curves that a picture shows.

    Raises:
        ConflictError: The kind of file, its folder or the map does not exist; the sentence names those that do.
        OSError: The file cannot be written; what was there before is still there.
    """
    name, folder = path.name.lower(), path.absolute().parent
    form = next((suffix for suffix in SUFFIXES if name.endswith(f".{suffix}")), None)
    if form is None:
        known = ", ".join(f".{suffix}" for suffix in SUFFIXES)
        raise ConflictError(f"a sweep can be exported as {known}; got {path.name!r}")
    if not folder.is_dir():
        raise ConflictError(f"{path} cannot be written: the folder {folder} does not exist")
    if form in {"png", "svg"}:
        write_whole(path, _picture(result, "png" if form == "png" else "svg", plot))
        return (path,)
    if plot is not None:
        raise ConflictError(f"a plot can be written as a picture, .png or .svg; got {path.name!r}")
    manifest = f"{json.dumps(manifest_of_result(result), indent=1, ensure_ascii=False)}\n".encode()
    if form == "manifest.json":
        write_whole(path, manifest)
        return (path,)
    beside = path.with_name(f"{path.name}.manifest.json")
    _write_table(result, path)
    write_whole(beside, manifest)
    return path, beside


def _picture(result: Result, form: style.PictureForm, name: str | None) -> bytes:
    known = figures(Study.of(result))
    if name not in known:
        wanted = "say which one is wanted" if name is None else f"got {name!r}"
        raise ConflictError(f"the plots of this sweep are {', '.join(known) or 'none'}; {wanted}")
    manifest = manifest_of_result(result)
    return style.encode(known[name](), form, f"{manifest['title']}: {name}", manifest)


def manifest_of_result(result: Result) -> dict[str, Any]:
    """Return what a result is and all that is needed to compute it again, as JSON values."""
    plan, experiment = result.plan.as_dict(), result.plan.wiring
    trackers = ", ".join(result.plan.trackers)
    title = f"Sweep of {experiment.title}, {trackers}"
    computed = summary(result)["runs"]
    return {
        "format": FORMAT,
        "version": 1,
        "pftrack": __version__,
        "title": title,
        "runs": {"computed": computed, "of": result.plan.runs},
        "plan": plan,
        "sha256": {"plan": hashlib.sha256(json.dumps(plan, sort_keys=True).encode()).hexdigest()},
        "quantities": [{"name": it.column, "title": it.title, "unit": it.unit} for it in Study.of(result).quantities],
        "citation": f"Computed with pftrack {__version__}: {title}; {computed:,} of {result.plan.runs:,} runs.",
        "references": [one.as_dict() for one in experiment.texts.references],
    }


def _write_table(result: Result, path: Path) -> None:
    part = part_of(path)
    try:
        with part.open("wb") as file:
            file.writelines(csv_pieces(result))
        settle(part, path)
    finally:
        part.unlink(missing_ok=True)
