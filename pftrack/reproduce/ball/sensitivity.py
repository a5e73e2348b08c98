"""What the result hangs on: the scene and the trackers, varied one by one.

Nine cells pooled. The order of the methods survives almost every variation; how far they are apart does not: it needs
a background level as high as Bando's and a motion model as rough.
"""

from pftrack.core.model.parameters import Value
from pftrack.reproduce.ball.study import Scene, rows, tally
from pftrack.reproduce.finding import Finding, claim, compare, share
from pftrack.reproduce.pool import Pool

__all__ = ["variations"]

SOURCE = "reference implementation"
WIDTHS = (30, 55, 80)
RADII = (5, 9, 13)
REFERENCE_RUNS = 360
TRACKERS = ("h-spf", "s-spf", "pc-pf")

SCATTER = "as far as the error of successful runs moves with other seeds"

Row = tuple[str, dict[str, Value], dict[str, tuple[float, float | None]]]

VARIATIONS: tuple[Row, ...] = (
    ("baseline", {}, {"h-spf": (0.550, 4.6), "s-spf": (0.317, 6.0), "pc-pf": (0.017, None)}),
    (
        "multinomial resampling",
        {"resampling": "multinomial"},
        {"h-spf": (0.544, 5.0), "s-spf": (0.333, 6.2), "pc-pf": (0.017, None)},
    ),
    (
        "rho 5 %",
        {"background_level": 0.05},
        {"h-spf": (0.544, 4.2), "s-spf": (0.525, 4.5), "pc-pf": (0.186, None)},
    ),
    (
        "rho 1 %",
        {"background_level": 0.01},
        {"h-spf": (0.850, 3.1), "s-spf": (0.825, 2.9), "pc-pf": (0.711, 2.9)},
    ),
    ("b = 2", {"process_noise_px": 2}, {"h-spf": (0.364, None), "s-spf": (0.039, None), "pc-pf": (0.003, None)}),
    ("b = 4", {"process_noise_px": 4}, {"h-spf": (0.325, None), "s-spf": (0.214, None), "pc-pf": (0.011, None)}),
    ("slots at 40 px", {"slot_offset_px": 40}, {"h-spf": (0.350, None), "s-spf": (0.219, None), "pc-pf": (0.0, None)}),
    (
        "slots at 60 px",
        {"slot_offset_px": 60},
        {"h-spf": (0.664, None), "s-spf": (0.433, None), "pc-pf": (0.019, None)},
    ),
    (
        "matched swing",
        {"assumed_period_frames": 30},
        {"h-spf": (0.731, 1.5), "s-spf": (0.686, 1.3), "pc-pf": (0.258, None)},
    ),
    (
        "60 frames/s",
        {"frame_rate_hz": 60, "process_noise_px": 0.8, "slot_offset_px": 30},
        {"h-spf": (0.869, 4.5), "s-spf": (0.856, 4.1), "pc-pf": (0.197, None)},
    ),
    (
        "amplitude 50 px",
        {"amplitude_px": 50, "process_noise_px": 1.5},
        {"h-spf": (0.322, 3.8), "s-spf": (0.286, 4.6), "pc-pf": (0.028, None)},
    ),
    ("region 10 px", {"lost_radii": 2}, {"h-spf": (0.494, None), "s-spf": (0.303, None), "pc-pf": (0.0, None)}),
    (
        "initial sd 3 px",
        {"initial_sd_px": 3},
        {"h-spf": (0.494, None), "s-spf": (0.317, None), "pc-pf": (0.014, None)},
    ),
    (
        "corrected weights",
        {"apf_weights": "corrected"},
        {"h-spf": (0.0, None), "s-spf": (0.0, None), "pc-pf": (0.017, None)},
    ),
)
"""Variation, what it changes, and success and error (px) of each tracker."""


QUICK = "baseline", "rho 5 %", "rho 1 %", "matched swing", "corrected weights"


def variations(pool: Pool, full: bool) -> list[Finding]:
    """Success and error of the three methods under each variation; the quick form has four layouts of the twenty."""
    scene = Scene(WIDTHS, RADII, layouts=20 if full else 4)
    findings = []
    for name, values, references in VARIATIONS:
        if not full and name not in QUICK:
            continue
        table = rows(pool, scene.plan(TRACKERS, 2 if full else 1, **values))
        whole = {tracker: tally(table, tracker=tracker) for tracker in TRACKERS}
        for tracker, (success, error) in references.items():
            cell = whole[tracker]
            # The layouts of a cell differ more than its trials do: it is they that count as independent.
            runs = cell.runs // (2 if full else 1)
            title = f"sensitivity: {tracker}, {name}, success"
            findings.append(share(title, round(cell.success * runs), runs, success, REFERENCE_RUNS, SOURCE))
            if full and error is not None:
                title = f"sensitivity: {tracker}, {name}, error, px"
                findings.append(compare(title, cell.error, error, 1.0, SOURCE, ground=SCATTER))
        gap = whole["h-spf"].success - whole["s-spf"].success
        over = whole["s-spf"].success - whole["pc-pf"].success
        if full and values.get("apf_weights") is None:
            holds = gap > -0.05 and over > 0
            statement = f"sensitivity: h-SPF is not behind s-SPF, nor s-SPF behind PC-PF, {name} (gap of the first two)"
            findings.append(claim(statement, gap, holds=holds, source=SOURCE))
    return findings
