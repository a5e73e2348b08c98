"""Seven ways to lose the window on the lawn, each with its cure."""

from collections.abc import Sequence
from itertools import pairwise
from statistics import fmean, median

from pftrack.model.diagnostics import Diagnostics
from pftrack.model.failure import Cure, Failure, Finding

__all__ = ["FAILURES"]

BEFORE_COLUMN = 80
"""So many frames are over before the target goes behind the column."""

Rows = Sequence[Diagnostics]


def _off(row: Diagnostics) -> float:
    """Return how far the estimate is off, px."""
    return 0.0 if row.error is None else row.error


def _impoverishment(rows: Rows) -> Finding:
    """Count the velocities that are left just before the target is lost, or at the end."""
    before = next((row.frame - 1 for row in rows if row.is_lost), len(rows) - 1)
    left = rows[before].number("velocities")
    return Finding(
        left <= 3 and before < len(rows) - 1,
        "Different velocities among {count:.0f} particles in frame {frame:.0f}: {left:.0f}. In the last frame the "
        "estimate is {error:.1f} px off.",
        {"frame": before, "count": rows[before].number("particles"), "left": left, "error": _off(rows[-1])},
    )


def _overconfident(rows: Rows) -> Finding:
    """Compare the error at the end with the deviation that the weights leave."""
    last = rows[-1]
    sigma = max(last.sigma)
    return Finding(
        _off(last) > 5 * sigma,
        "In the last frame the estimate is {error:.1f} px off, and the particles' standard deviation is {sigma:.1f} "
        "px: the error is {ratio:.1f} times as large.",
        {"error": _off(last), "sigma": sigma, "ratio": _off(last) / sigma},
    )


def _capture(rows: Rows) -> Finding:
    """Ask how alike that is which is followed while the target is lost."""
    lost = [row for row in rows if row.is_lost]
    if not lost:
        return Finding(
            False, "In no frame is anything else followed; the estimate ends {error:.1f} px off.", _end(rows)
        )
    likeness = fmean(row.number("likeness") for row in lost)
    return Finding(
        likeness > 0.8 and len(lost) >= 20,
        "In {frames:.0f} frames the target is lost, and what is followed instead looks like it by {likeness:.2f} on "
        "average; in the last frame it is {error:.1f} px away.",
        {"frames": len(lost), "likeness": likeness, **_end(rows)},
    )


def _end(rows: Rows) -> dict[str, float]:
    return {"error": _off(rows[-1])}


def _forgotten(rows: Rows) -> Finding:
    """Compare how far the target goes on while nothing of it is seen with how far the estimate does."""
    hidden = [row for row in rows if row.hidden and row.truth is not None]
    true = hidden[-1].truth[0] - hidden[0].truth[0] if hidden and hidden[-1].truth and hidden[0].truth else 0.0
    believed = hidden[-1].estimate[0] - hidden[0].estimate[0] if hidden else 0.0
    return Finding(
        believed < 0.5 * true and rows[-1].is_lost,
        "While it is hidden for {frames:.0f} frames the target goes {true:.1f} px on, and the estimate {believed:.1f} "
        "px; in the last frame it is {error:.1f} px off.",
        {"frames": len(hidden), "true": true, "believed": believed, **_end(rows)},
    )


def _degenerate(rows: Rows) -> Finding:
    """Ask of how many particles the weights consist."""
    ess = median(row.number("ess") for row in rows)
    return Finding(
        ess < 2,
        "In the median frame {ess:.1f} of {count:.0f} particles carry the weight; in the last frame the estimate is "
        "{error:.1f} px off.",
        {"ess": ess, "count": rows[-1].number("particles"), **_end(rows)},
    )


def _drift(rows: Rows) -> Finding:
    """Compare how alike the window is to the model with how alike the model is to the first look."""
    last = rows[-1]
    now, first = last.number("likeness"), last.number("first_likeness")
    return Finding(
        now > 0.9 and first < 0.7 and last.is_lost,
        "In the last frame the window looks like the model by {now:.2f}, and the model like the first look by "
        "{first:.2f}; the estimate is {error:.1f} px off.",
        {"now": now, "first": first, **_end(rows)},
    )


def _search_result(rows: Rows) -> Finding:
    """Ask where the first search through the whole picture ends."""
    found = next((row for before, row in pairwise(rows) if before.searching and not row.searching), None)
    if found is None:
        return Finding(
            False, "Nothing was found again; in the last frame the estimate is {error:.1f} px off.", _end(rows)
        )
    return Finding(
        _off(found) > 50,
        "The search begins in frame {begun:.0f} and ends in frame {frame:.0f} at a place that is alike by "
        "{likeness:.2f} and {error:.1f} px away from the target.",
        {
            "begun": next(row.frame for row in rows if row.searching),
            "frame": found.frame,
            "likeness": found.number("likeness"),
            "error": _off(found),
        },
    )


FAILURES = (
    Failure(
        "sample-impoverishment",
        "Sample impoverishment",
        "weights",
        "Nothing is ever added to a velocity, so each resampling can only lose some of the 300 that there were at the "
        "start. Two are left in frame 30 and one in frame 44, and when the target turns, nobody goes "
        "its way.",
        "condensation",
        44,
        _impoverishment,
        Cure(
            "Noise on the velocity, 0.3 px/frame: each copy gets a velocity of its own, so that all stay different.",
            {"velocity_noise_px": 0.3},
        ),
        {"velocity_noise_px": 0, "process_noise_px": 0.5},
        frames=BEFORE_COLUMN,
    ),
    Failure(
        "overconfident-weights",
        "Overconfident weights",
        "weights",
        "At lambda 200 a difference of 0.01 in likeness makes a weight seven times as large, also where nothing of the "
        "target is seen. Behind the column the cloud settles on the patches of lawn that happen to be more alike, sure "
        "of itself, and never comes out.",
        "condensation",
        91,
        _overconfident,
        Cure(
            "Lambda 20: the same difference makes a weight larger by a fifth, and the cloud widens until it meets the "
            "target again.",
            {"sharpness": 20},
        ),
        {"sharpness": 200},
    ),
    Failure(
        "look-alike-capture",
        "Look-alike capture",
        "dynamics",
        "Without a velocity the cloud lags behind the target. When a look-alike comes the other way through it, both "
        "fit as well, and the cloud goes away with the wrong one.",
        "condensation",
        48,
        _capture,
        Cure(
            "A velocity that is kept: the look-alike is as alike as before, but it moves the other way, and particles "
            "that move so have died out.",
            {"velocity_retention": 1},
        ),
        {"velocity_retention": 0},
        frames=BEFORE_COLUMN,
    ),
    Failure(
        "occlusion-longer-than-memory",
        "Occlusion longer than memory",
        "dynamics",
        "A fifth of the velocity is lost in each frame without news, a memory of five frames, and the column hides the "
        "target for ten. The cloud stops behind the column while the target goes on.",
        "condensation",
        83,
        _forgotten,
        Cure("The whole velocity is kept: a memory longer than the occlusion.", {"velocity_retention": 1}),
        {"velocity_retention": 0.8},
        seed=1,
    ),
    Failure(
        "degenerate-resampling",
        "Degenerate resampling",
        "collapse",
        "The threshold is 0, so that parents are never drawn again: weights are only multiplied, and after twenty "
        "frames one particle carries all of them. The others are computed for nothing, and one guess is no filter.",
        "condensation",
        29,
        _degenerate,
        Cure(
            "Resample when fewer than half of the particles carry the weight: the bad ones make room for copies of the "
            "good ones.",
            {"resampling_threshold": 0.5},
        ),
        {"resampling_threshold": 0},
        frames=60,
    ),
    Failure(
        "template-drift",
        "Template drift",
        "appearance",
        "A fifth of the model is renewed in every frame by whatever the window shows. As the target goes behind the "
        "column the model learns lawn, little by little; from then on lawn is what it is looking for, and it fits.",
        "condensation",
        90,
        _drift,
        Cure(
            "A guard: a frame renews only if the window is alike by 0.95 and the particles agree within half of it, so "
            "that nothing is learned from a target that is half hidden.",
            {"renewal_likeness": 0.95, "renewal_spread": 0.5},
        ),
        {"renewal_rate": 0.2, "renewal_likeness": 0, "renewal_spread": 10},
        seed=6,
    ),
    Failure(
        "detector-seized-by-background",
        "Detector seized by background",
        "appearance",
        "A search through the whole picture always has a best place. While the target is hidden that is a redder thing "
        "in the background, and a threshold of 0.6 takes it for the target.",
        "condensation",
        92,
        _search_result,
        Cure(
            "A threshold of 0.92, which the background does not reach: the search goes on until the target comes out.",
            {"found_likeness": 0.92},
        ),
        {"find_again": True, "found_likeness": 0.6, "look_alike_red": 0.9},
        frames=110,
    ),
)
