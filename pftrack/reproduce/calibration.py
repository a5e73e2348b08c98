"""How often the bands of a pose hold the truth: Bando's and the calibrated ones (docs/explanation/calibration.md).

Seeds and people are others than those on which the calibrated band was chosen. Bando states no coverage: what a band
says of itself is the reference.
"""

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from pftrack.core.model.parameters import Value
from pftrack.experiments.head.parameters import AS_PUBLISHED
from pftrack.reproduce.finding import Findings, References
from pftrack.reproduce.pool import Pool, recipe, rows_of
from pftrack.runs.run import Run

REFERENCES = References(__file__)
SHARES = {50: "within_50", 95: "within_95"}
PRISM_SEEDS = range(2000, 2020)
QUICK_SEEDS = 2
PEOPLE = range(300, 312)
HEAD_FRAMES, HEAD_SPEED = 600, 1.5
VIEWS: dict[str, dict[str, Value]] = {
    "affine": AS_PUBLISHED,
    "pinhole": {**AS_PUBLISHED, "upper_layer": "perspective"},
    "pinhole, relief": {"upper_layer": "perspective", "templates": "relief"},
}


def coverage(pool: Pool, full: bool) -> Findings:
    """Coverage of both bands and the error of both estimates, the angles pooled: prisms, and in full heads as well."""
    seeds = PRISM_SEEDS if full else PRISM_SEEDS[:QUICK_SEEDS]
    for upper in ("affine", "perspective"):
        yield from _judge(pool, "prism", f"prism, {upper}", 625, [({"upper_layer": upper}, seed) for seed in seeds])
    for (view, values), face in product(VIEWS.items(), ("mean", "personal")) if full else ():
        # What Bando did has a face of its own.
        chosen: dict[str, Value] = {**values, "speed": HEAD_SPEED, "face_model": face}
        heads = [({**chosen, "person": person}, 0) for person in PEOPLE]
        yield from _judge(pool, "head", f"head, {face} face, {view}", HEAD_FRAMES, heads)


def _judge(
    pool: Pool, experiment: str, name: str, frames: int, trials: Sequence[tuple[Mapping[str, Value], int]]
) -> Findings:
    """Compare both bands with what they say, on values and seeds."""
    errors = []
    runs = {
        band: [recipe(experiment, "pf-asd", {**it, "pose_band": band}, seed=seed, frames=frames) for it, seed in trials]
        for band in ("document", "calibrated")
    }
    for band, outcomes in pool.run_groups(_measure, runs).items():
        *shares, error = np.mean(outcomes, axis=0)
        errors.append(float(error))
        yield from REFERENCES.judge_all("band", dict(zip(SHARES, shares, strict=True)), name, band)
    yield REFERENCES.judge("band-error", errors[1] / errors[0], name)


def _measure(run: Run) -> tuple[float, ...]:
    """Return the shares of frames and angles within both bands, and the mean error, degrees."""
    rows = rows_of(run)
    shares = (float(np.mean([row.series[name] for row in rows])) for name in SHARES.values())
    return *shares, float(np.mean([row.error for row in rows if row.error is not None]))
