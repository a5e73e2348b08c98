"""Plots of a run for its page: the figures that the library prints, as wide as a column, in the page's own ink.

A page is light or dark, so what is black or faint grey on paper takes the page's colours there. The page moves a line
over each of them; it is told where the first and the last frame lie.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from pftrack.core.model.setup import ExportError
from pftrack.output.figures.sheet import drawable, figure_of
from pftrack.output.figures.style import INK, encode
from pftrack.runs.run import Run

WIDE_IN, LEFT_IN, LEFT_WITH_NAMES_IN, RIGHT_IN, HEAD_IN, FOOT_IN, HIGH_IN = 3.7, 0.46, 1.5, 0.1, 0.2, 0.24, 0.85
"""Of a figure, its margins, and what a panel is high; one of rows is as high as it is on paper."""
HIGHEST_ON_PAPER_IN = 2.4
"""Of a panel without rows."""
PAGE_INK = {INK["truth"]: "currentColor", INK["grid"]: "var(--line)", INK["frame"]: "var(--muted)"}
"""What a colour on paper is on the page."""
ID = re.compile(r' id="([^"]+)"')


@dataclass(frozen=True, slots=True)
class PagePlot:
    """A plot in a page.

    Attributes:
        title: With its unit.
        description: What is to be seen, one sentence.
        svg: The picture.
        first: Where frame 0 is, as a share of the picture's width.
        last: Where the last frame is.
    """

    title: str
    description: str
    svg: str
    first: float
    last: float


def plots_of(run: Run) -> Iterator[PagePlot]:
    """Yield the plots for which a run has something to draw; one with more than a picture can show is left out."""
    for plot in drawable(run):
        try:
            figure = figure_of(run, plot.id)
        except ExportError:
            continue
        (axes,) = figure.axes
        rows = axes.get_position().height * figure.get_figheight()
        high = rows if plot.row_titles or rows > HIGHEST_ON_PAPER_IN else HIGH_IN
        whole = HEAD_IN + high + FOOT_IN
        named = LEFT_WITH_NAMES_IN if plot.row_titles else LEFT_IN
        figure.set_size_inches(WIDE_IN, whole)
        figure.texts.clear()
        title = axes.get_title(loc="left")
        axes.set_title("", loc="left")
        axes.set_xlabel("")
        axes.set_facecolor("none")
        left, width = named / WIDE_IN, (WIDE_IN - named - RIGHT_IN) / WIDE_IN
        axes.set_position((left, FOOT_IN / whole, width, high / whole))
        svg = encode(figure, "svg", plot.title, salt=plot.id, transparent=True).decode()
        low, top = axes.get_xlim()
        ends = [left + width * (frame - low) / (top - low) for frame in (0, max(run.computed, 1))]
        yield PagePlot(title, plot.description, _inline(svg), *ends)


def _inline(svg: str) -> str:
    """Return a picture as a part of a page: in its ink, and without names that nothing refers to."""
    body = svg[svg.index("<svg") :]
    for paper, page in PAGE_INK.items():
        body = body.replace(paper, page)
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    return ID.sub(lambda found: found[0] if f"#{found[1]}" in body else "", body)
