"""How many particles: the study of document 1, ch. 3 section 3.3.

Sixteen cells pooled. In the document fewer particles do better until too few collapse, since more particles populate
the tails, which then find look-alikes. Success confirms it; whether the error falls as well depends on how the scene
is read.
"""

from itertools import product

from pftrack.reproduce.finding import Finding, claim, compare
from pftrack.reproduce.pool import Pool
from pftrack.reproduce.trials import Trial, run_all, tally
from pftrack.sources.overlay import LAYOUTS

__all__ = ["sample_count"]

SOURCE = "document 1, ch. 3 section 3.3 (specification 7)"
WIDTHS = (30, 45, 60, 75)
RADII = (5, 8, 11, 14)
FRAMES = 60

SUCCESS: dict[str, dict[int, float]] = {
    "h-spf": {50: 0.040, 100: 0.267, 200: 0.622, 400: 0.596, 800: 0.523, 1200: 0.460, 1600: 0.381},
    "s-spf": {50: 0.022, 100: 0.193, 200: 0.441, 400: 0.426, 800: 0.316, 1200: 0.257, 1600: 0.229},
}


def sample_count(pool: Pool, full: bool) -> list[Finding]:
    """Success over the number of particles, pooled over sixteen cells."""
    counts = tuple(SUCCESS["h-spf"]) if full else (50, 100, 200, 800, 1600)
    repeats = 4 if full else 1
    findings = []
    for tracker, references in SUCCESS.items():
        success, error = {}, {}
        for count in counts:
            work = enumerate(product(WIDTHS, RADII, range(len(LAYOUTS)), range(repeats)))
            trials = [
                Trial(
                    tracker,
                    seed,
                    FRAMES,
                    {
                        "occlusion_width_px": width,
                        "distracter_radius_px": radius,
                        "layout": layout,
                        "sample_count": count,
                    },
                )
                for seed, (width, radius, layout, _) in work
            ]
            whole = tally(run_all(pool, trials))
            success[count], error[count] = whole.success, whole.mean_error_px
            name = f"sample-count: {tracker}, success with N = {count}"
            findings.append(compare(name, whole.success, references[count], 0.05, SOURCE))
        holds = success[200] > success[800] > success[1600] and success[50] < success[100] < success[200]
        name = f"sample-count: {tracker}, success peaks between too few and too many (N = 200 less N = 1600)"
        findings.append(claim(name, success[200] - success[1600], holds=holds, source=SOURCE))
        name = f"sample-count: {tracker}, the error falls as well with N from 1600 to 200, px"
        change = error[200] - error[1600]
        source = "document 1, ch. 3 section 3.3; in the other reading of the scene only (specification 7)"
        findings.append(claim(name, change, holds=change < -0.25, source=source, confirmed=False))
    return findings
