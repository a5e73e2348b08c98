"""The figures of the lawn: success over the number of particles and over lambda, scene by scene, ours and reference."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from pftrack.output.figures.style import CURVE_COLOURS, LETTERS_PT, new_figure, write_title
from pftrack.reproduce.histogram.trials import Outcome

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]

PARTICLES = {"N = 25": 25, "N = 50": 50, "N = 100": 100, "N = 300": 300, "N = 1000": 1000}
LAMBDAS = {"lambda = 2": 2, "lambda = 5": 5, "lambda = 10": 10, "N = 300": 20} | {
    f"lambda = {number}": number for number in (50, 100, 200)
}


def draw(
    outcomes: Mapping[str, Sequence[Outcome]], references: Mapping[str, Sequence[float]], scenes: Sequence[int]
) -> "dict[str, Figure]":
    """Return the figures by name.

    Args:
        outcomes: By row of the table and scene.
        references: Success of the reference, by row and scene.
        scenes: Their numbers.
    """
    return {
        "histogram-success-by-particles": _figure("Particles", PARTICLES, outcomes, references, scenes),
        "histogram-success-by-lambda": _figure("lambda", LAMBDAS, outcomes, references, scenes),
    }


def _figure(
    label: str,
    places: Mapping[str, int],
    outcomes: Mapping[str, Sequence[Outcome]],
    references: Mapping[str, Sequence[float]],
    scenes: Sequence[int],
) -> "Figure":
    known = {name: place for name, place in places.items() if name in outcomes}
    figure, panels = new_figure(3.4, columns=2, share="y")
    for title, panel in zip(("Ours", "Reference"), panels, strict=True):
        for place, scene in enumerate(scenes):
            values = [outcomes[name][place].success if title == "Ours" else references[name][place] for name in known]
            number = scene if title == "Ours" else place
            colour = CURVE_COLOURS[place]
            panel.plot(list(known.values()), values, "o-", color=colour, label=f"scene {number}", markersize=4)
        panel.set_xscale("log")
        panel.set_xticks(list(known.values()), [str(value) for value in known.values()])
        panel.minorticks_off()
        panel.set_xlabel(label)
        write_title(panel, title)
        panel.legend(frameon=False, fontsize=LETTERS_PT)
    panels[0].set_ylabel("Success")
    return figure
