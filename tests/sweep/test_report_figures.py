"""The pictures of a report: what they show is where it belongs, and every text has its room."""

import io
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from PIL import Image

from pftrack.sweep import Plan, Result, carry_out
from pftrack.sweep.axis import Axis
from pftrack.sweep.cells import quantity_named, samples
from pftrack.sweep.report.files import curves, figures
from pftrack.sweep.report.study import Study

COLOURS = ("#c83232", "#32c832", "#3232c8", "#c8c832", "#ffffff", "#000000")
TRACKERS = ("h-spf", "s-spf", "pc-pf", "condensation", "apf")
COUNTS = Axis("sample_count", (20, 50, 100))


@pytest.fixture(scope="module")
def named(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Of an axis whose values are names, with as many methods as make two rows of maps."""
    plan = Plan("ball", (Axis("ball_colour", COLOURS), COUNTS), TRACKERS, trials=1, frames=4)
    return carry_out(plan, tmp_path_factory.mktemp("named") / "named.parquet")


@pytest.fixture(scope="module")
def counted(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Of one axis of numbers."""
    plan = Plan("ball", (COUNTS,), ("h-spf", "s-spf"), trials=6, frames=10)
    return carry_out(plan, tmp_path_factory.mktemp("counted") / "counted.parquet")


def pixels(figure: Figure) -> np.ndarray:
    """Return the picture of a figure, 100 pixels an inch."""
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=100)
    return np.asarray(Image.open(buffer).convert("RGB"))


def test_maps_have_the_colours_of_their_cells(finished: Result) -> None:
    """In the middle of every cell of every map is the colour of its value; what is not known is hatched."""
    study = Study.of(finished, level=0.2)
    for name in ("success", "error", "measure-inside_share"):
        figure = figures(study)[name]()
        picture = pixels(figure)
        for panel, image in maps_of(figure):
            cells = image.get_array()
            expected = image.cmap(image.norm(cells), bytes=True)[..., :3]
            for row, column in np.ndindex(*cells.shape):
                x, y = panel.transData.transform((column, row)) * 100 / figure.dpi
                found = picture[picture.shape[0] - int(y) - 1, int(x)]
                if not np.ma.getmaskarray(cells)[row, column]:
                    assert np.abs(found.astype(int) - expected[row, column]).max() <= 1, (name, row, column)


def maps_of(figure: Figure) -> list[tuple[Axes, AxesImage]]:
    """Return the maps of a figure with their panels."""
    return [(panel, image) for panel in figure.axes for image in panel.images]


def texts_of(figure: Figure) -> Iterator[Text]:
    """Yield what can be read on a figure."""
    for part in figure.subfigs:
        yield from part.texts
        for key in part.legends:
            yield from key.get_texts()
    for panel in figure.axes:
        if panel.axison and panel.get_visible():
            yield from (panel.title, panel.xaxis.label, panel.yaxis.label)
            yield from ticks_of(panel)


def ticks_of(panel: Axes) -> Iterator[Text]:
    for axis in (panel.xaxis, panel.yaxis):
        low, high = sorted(axis.get_view_interval())
        yield from (tick.label1 for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high)
        yield from (tick.label2 for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high)


def assert_readable(figure: Figure) -> None:
    """No text reaches beyond the figure, onto a map, or onto another text."""
    figure.draw_without_rendering()
    boxes = [
        (text.get_text(), text.get_window_extent())
        for text in texts_of(figure)
        if text.get_visible() and text.get_text()
    ]
    for text, box in boxes:
        assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1, text
        assert figure.bbox.y0 <= box.y0 <= box.y1 <= figure.bbox.y1, text
    maps = [("a map", image.get_window_extent()) for _, image in maps_of(figure)]
    for (one, first), (other, second) in combinations([*boxes, *maps], 2):
        common = Bbox.intersection(first, second)
        assert common is None or min(common.width, common.height) <= 1, (one, other)


# Thirteen figures are drawn whole.
@pytest.mark.slow
def test_every_text_has_its_room(named: Result, counted: Result, finished: Result) -> None:
    """Titles, values along the axes, and keys stand apart, with long names and with short ones."""
    counts, colours = named.plan.axis("sample_count"), named.plan.axis("ball_colour")
    for study in (Study.of(finished), Study(named, counts, colours, 0.01), Study(named, colours, counts, 0.01)):
        for name in ("success", "curves"):
            assert_readable(figures(study)[name]())
    for study in (Study.of(counted), Study(named, colours, None, 0.01)):
        for name in ("success", "error", "curves"):
            assert_readable(figures(study)[name]())


def test_one_axis_of_numbers_gives_boxes(counted: Result) -> None:
    """Every quantity has a picture of boxes and, below, of differences; there is no map of a single row."""
    plan, study = counted.plan, Study.of(counted)
    drawn = figures(study)
    measures = {f"measure-{it.name}" for it in plan.wiring.run_measures}
    assert set(drawn) == {"curves", "success", "error", *measures}
    boxes, differences = drawn["measure-median_error_px"]().axes
    assert boxes.get_ylabel() == "Median error, px"
    assert len(boxes.patches) == 2 * 3
    assert differences.get_ylabel() == "Difference, px, + if 1 is better"
    rates, _ = drawn["success"]().axes
    assert not rates.patches


def test_many_values_are_not_wider_than_a_picture_can_be(counted: Result) -> None:
    """Boxes become narrow rather than the picture endless, and the values that are written do not touch."""
    many = replace(counted.plan, axes=(Axis("sample_count", tuple(range(1, 1001))),))
    drawn = figures(Study.of(replace(counted, plan=many)))
    for name in ("success", "error", "curves"):
        assert pixels(drawn[name]()).shape[1] <= 2000
    assert_readable(drawn["error"]())


def test_a_box_has_the_quartiles_of_its_runs(counted: Result) -> None:
    """Boxes stand side by side by tracker, around their value of the axis; the scale begins at 0."""
    panel = figures(Study.of(counted))["measure-median_error_px"]().axes[0]
    values = samples(counted, quantity_named(counted.plan, "median_error_px"), "sample_count").values
    for tracker, container in zip(("h-spf", "s-spf"), panel.containers, strict=True):
        for place, (patch, runs) in enumerate(zip(container.patches, values[tracker], strict=True)):
            ends = patch.get_y(), patch.get_y() + patch.get_height()
            assert ends == pytest.approx(np.quantile(runs, (0.25, 0.75)))
            middle = patch.get_x() + patch.get_width() / 2
            assert middle == pytest.approx(place + (-0.2 if tracker == "h-spf" else 0.2))
    assert panel.get_ylim()[0] == 0.0


def test_curves_have_an_axis_each(finished: Result) -> None:
    """The rates along every axis that was varied, with a band of their interval by tracker."""
    study = Study.of(finished)
    figure = curves(study, list(finished.plan.axes))
    assert [panel.get_xlabel() for panel in figure.axes] == ["Occluder width, px", "Look-alike radius, px"]
    for panel, axis in zip(figure.axes, finished.plan.axes, strict=True):
        for line, name in zip(panel.lines, finished.plan.trackers, strict=True):
            assert line.get_xdata().tolist() == list(axis.values)
            assert line.get_ydata() == pytest.approx(study.by_axis[axis.name][name].rate[0])
        assert len(panel.collections) == 2
    twice = curves(study, [*finished.plan.axes] * 3)
    assert_readable(twice)
    above, below = (panel.get_position() for panel in (twice.axes[0], twice.axes[3]))
    assert below.y1 < above.y0
