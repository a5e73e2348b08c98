"""A chain in space whose links are seen as lines, Shimada 1997, eqs. 4.9 to 4.11: by filters and by regions.

Shimada shows no run on lines, and the reference has none, so that all figures are our own. Lines with root and tip say
almost what four points say, since joints are where lines cross. Lines alone leave the root free to slide along the
first link, and the tip along the last: of the lengths they show the middle one, and only where the links bend.
"""

from collections.abc import Mapping

import numpy as np

from pftrack.core.model.parameters import Value
from pftrack.experiments import find
from pftrack.reproduce.finding import CHOSEN, Finding, Own, claim, compare
from pftrack.reproduce.linkage.kalman import IN_SPACE, ROUNDS
from pftrack.reproduce.linkage.trials import Condition, RunResult, run_condition
from pftrack.reproduce.pool import Pool

__all__ = ["lines"]

OURS = Own("this project")
SEEDS, QUICK_SEEDS = 5, 1
WIDTHS_PX: Mapping[str, tuple[float, float, float]] = {
    "lines-and-ends": (11.8, 19.5, 10.9),
    "lines": (20.0, 19.5, 20.0),
}
"""Of the final intervals of the lengths, mean, by what is seen; 20 px at first."""
WIDTH_PX, QUICK_WIDTH_PX = 1.5, 6.0
"""By how much they may differ, as means and of a single run."""

FILTERS: tuple[tuple[str, Mapping[str, Value], float], ...] = (
    ("ekf-truncated", {}, 1.5),
    ("ekf-truncated", {"linearisations": ROUNDS}, 1.0),
    ("particles", {}, 1.0),
)
"""Tracker, values, and what the final error of the worst length of any seed is below, px, with lines and ends."""


def lines(pool: Pool, full: bool) -> list[Finding]:
    """Lengths that filters find by lines with root and tip, and what regions leave of them by lines."""
    seeds = SEEDS if full else QUICK_SEEDS
    findings = []
    for tracker, values, limit in FILTERS if full else FILTERS[1:2]:
        courses = _courses(pool, tracker, {**IN_SPACE, **values, "links_seen_as": "lines-and-ends"}, seeds)
        worst = max(float(np.abs(one.lengths[-1] - one.true_lengths).max()) for one in courses)
        title = tracker + (f", linearised {ROUNDS} times" if values else "")
        result = f"linkage: lines and ends, {title}, final error of the worst length of any seed, px"
        findings.append(claim(result, worst, holds=worst < limit, source=OURS))
    scene = next(one for one in find("linkage").presets if one.name == "3d").parameters
    for way, widths in list(WIDTHS_PX.items())[: None if full else 1]:
        for tracker in ("ellipsoids", "box-guides") if full else ("ellipsoids",):
            courses = _courses(pool, tracker, {**scene, "links_seen_as": way}, seeds)
            contained = float(np.mean([one.contained.mean() for one in courses]))
            named = f"linkage: {way.replace('-', ' ')}, {tracker}"
            result = f"{named}, truth contained in all frames"
            findings.append(claim(result, contained, holds=contained == 1.0, source=OURS))
            for link, before in enumerate(widths if tracker == "ellipsoids" else ()):
                width = float(np.mean([one.high[-1, link] - one.low[-1, link] for one in courses]))
                result = f"{named}, final width of length {link + 1}, mean, px"
                findings.append(
                    compare(result, width, before, WIDTH_PX if full else QUICK_WIDTH_PX, OURS, ground=CHOSEN)
                )
    return findings


def _courses(pool: Pool, tracker: str, values: Mapping[str, Value], seeds: int) -> list[RunResult]:
    return pool.map(run_condition, [Condition(tracker, tuple(values.items()), seed) for seed in range(seeds)])
