"""The other reading of the scene: 200 px to either side, twice the frame rate, a larger picture.

Bando leaves open what "amplitude 200 px" means. In this reading wide occluders are no longer hopeless, success
hardly depends on their width, and switching is ahead by little.
"""

from dataclasses import replace

from pftrack.core.model.parameters import Value
from pftrack.reproduce.ball.study import COARSE, SIXTEEN, cells, compare_cells, rows, tally
from pftrack.reproduce.finding import FEWER, PROTOCOL, TRIALS, Finding, claim, compare
from pftrack.reproduce.pool import Pool
from pftrack.sweep import Axis

__all__ = ["wide_swing"]

SOURCE = "reference implementation, reading B"
SOURCE_COUNTS = "reference implementation, reading B"
REFERENCE_RUNS = 100

VALUES: dict[str, Value] = {
    "amplitude_px": 200,
    "frame_rate_hz": 60,
    "image_width_px": 640,
    "image_height_px": 480,
    "process_noise_px": 1.5,
    "slot_spacing_px": 120,
    "slot_offset_px": 30,
}
CELLS: dict[str, tuple[tuple[float, ...], ...]] = {
    "h-spf": (
        (1.00, 1.00, 0.99, 0.70, 0.25),
        (1.00, 1.00, 0.98, 0.69, 0.15),
        (1.00, 1.00, 0.91, 0.47, 0.07),
        (1.00, 1.00, 0.92, 0.43, 0.04),
        (1.00, 1.00, 0.87, 0.36, 0.01),
    ),
    "s-spf": (
        (1.00, 1.00, 0.97, 0.67, 0.09),
        (1.00, 1.00, 0.95, 0.67, 0.12),
        (1.00, 0.99, 0.86, 0.36, 0.02),
        (1.00, 1.00, 0.92, 0.41, 0.01),
        (1.00, 0.99, 0.85, 0.21, 0.03),
    ),
    "pc-pf": (
        (1.00, 0.56, 0.0, 0.0, 0.0),
        (1.00, 0.51, 0.0, 0.0, 0.0),
        (1.00, 0.42, 0.0, 0.0, 0.0),
        (1.00, 0.40, 0.0, 0.0, 0.0),
        (0.98, 0.27, 0.0, 0.0, 0.0),
    ),
}
POOLED: dict[str, tuple[float, float]] = {
    "h-spf": (0.714, 5.20),
    "s-spf": (0.685, 5.26),
    "pc-pf": (0.286, 8.18),
    "condensation": (0.615, 6.35),
    "apf": (0.903, 2.46),
}
CORRECTED = {"h-spf": (0.595, 7.54), "s-spf": (0.625, 6.88)}
ERROR_ALLOWANCE = {"pc-pf": 2.5}
ERROR_ALLOWANCE_OTHERS = 1.0
"""In px. A run that is lost in its last frames still counts, with errors as wide as the picture: with other seeds
the pooled error moves by as much as this. The reference states no tolerance here."""

SCATTER = "as far as it moves with other seeds: a run that is lost in its last frames still counts"

SMALL_COUNT_ALLOWANCE = 0.15
"""Below 200 particles runs with the same seed are lost alike in all cells. The reference shares forty seeds between
cells, where ours differ: three standard errors of forty runs."""

COUNTS: dict[str, dict[int, float]] = {
    "h-spf": {50: 0.042, 100: 0.339, 200: 0.845, 400: 0.959, 800: 0.919, 1600: 0.875},
    "s-spf": {50: 0.084, 100: 0.237, 200: 0.756, 400: 0.955, 800: 0.922, 1600: 0.906},
}


def wide_swing(pool: Pool, full: bool) -> list[Finding]:
    """Success and error on 25 cells and over the number of particles; the quick form has two layouts of the twenty."""
    layouts = 20 if full else 2
    scene = replace(COARSE, layouts=layouts, values=VALUES)
    allowance, ground = (0.04, PROTOCOL) if full else (0.12, FEWER)
    table = rows(pool, scene.plan(tuple(POOLED), 5 if full else 1))
    findings = []
    for tracker, (success, error) in POOLED.items():
        whole = tally(table, tracker=tracker)
        findings.append(
            compare(f"wide-swing: {tracker}, pooled success", whole.success, success, allowance, SOURCE, ground=ground)
        )
        if full:
            allowed = ERROR_ALLOWANCE.get(tracker, ERROR_ALLOWANCE_OTHERS)
            findings.append(
                compare(f"wide-swing: {tracker}, pooled error, px", whole.error, error, allowed, SOURCE, ground=SCATTER)
            )
    if not full:
        return findings
    for tracker, references in CELLS.items():
        found = cells(table, scene, tracker=tracker)
        title = f"wide-swing: {tracker}, success"
        findings += compare_cells(title, found, scene, references, REFERENCE_RUNS, SOURCE)
    corrected = rows(pool, scene.plan(tuple(CORRECTED), 2, apf_weights="corrected"))
    for tracker, (success, error) in CORRECTED.items():
        whole = tally(corrected, tracker=tracker)
        name = f"wide-swing: {tracker} with corrected weights, pooled"
        findings.append(compare(f"{name} success", whole.success, success, 0.04, SOURCE, ground=PROTOCOL))
        findings.append(
            compare(f"{name} error, px", whole.error, error, ERROR_ALLOWANCE_OTHERS, SOURCE, ground=SCATTER)
        )
    return findings + _counts(pool)


def _counts(pool: Pool) -> list[Finding]:
    scene = replace(SIXTEEN, values=VALUES, axes=(Axis("sample_count", tuple(COUNTS["h-spf"])),))
    table = rows(pool, scene.plan(tuple(COUNTS), 2))
    findings = []
    for tracker, references in COUNTS.items():
        whole = {count: tally(table, tracker=tracker, sample_count=count) for count in references}
        for count, reference in references.items():
            name = f"wide-swing: {tracker}, success with N = {count}"
            allowed = 0.05 if count >= 200 else SMALL_COUNT_ALLOWANCE
            ground = PROTOCOL if count >= 200 else TRIALS
            findings.append(compare(name, whole[count].success, reference, allowed, SOURCE_COUNTS, ground=ground))
        change = whole[200].error - whole[1600].error
        name = f"wide-swing: {tracker}, the error falls with N from 1600 to 200, px"
        findings.append(claim(name, change, holds=change < -0.25, source=SOURCE_COUNTS))
    return findings
