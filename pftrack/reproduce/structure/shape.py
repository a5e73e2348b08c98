"""The shape of a body from its tracks: Bando 2007, ch. 4 section 5, on the prism and on the driver's face.

What Bando says: hidden points spoil the factorization by singular values; weighed by their noise they do no
harm; online the error is a little larger, mainly at the centres of faces, which are hidden longest, for a time a frame
that does not grow. The reference could confirm this but for two things: the shape that is published at the greatest
free energy is no better than that of an average step, and on the face the online method is worse than singular values.

Both hang on the forgetting, as Bando suspects. With the forgetting of each point controlled by what was seen of
it, and with the project's own recursion, the online error falls below that of the batch; these rows are marked as ours.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.output.figures.picture import save
from pftrack.output.figures.style import (
    CURVE_COLOURS,
    INK,
    TEXT_PT,
    explain_below,
    new_figure,
    write_heading,
    write_title,
)
from pftrack.reproduce.finding import CHOSEN, PROTOCOL, TRIALS, Finding, Own, claim, compare, three_errors
from pftrack.reproduce.pool import Pool
from pftrack.reproduce.structure.trials import (
    CENTRES,
    Body,
    OnlineResult,
    Trial,
    TrialResult,
    grow,
    online,
    run_trial,
    tracks_of,
)
from pftrack.vision.structure import variational
from pftrack.vision.structure.tracks import shape_error

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBERS = {
    "prism": {"svd": "4.21", "batch": "4.22", "online": "4.23", "errors": "4.24"},
    "face": {"online": "4.27", "errors": "4.26"},
}
TITLES = {
    "svd": "Singular values",
    "batch": "Variational",
    "online": "Online",
    "own": "Online, forgetting by information",
    "recursive": "Recursion",
}
SIDES = (("From the front", 0, 1), ("From above", 0, 2))


def draw(
    body: str, courses: Sequence[TrialResult], common: Sequence[OnlineResult], own: Sequence[OnlineResult]
) -> "dict[str, Figure]":
    """Return the figures by name, given the trials of the prism or of a face."""
    errors = {
        "svd": [one.svd for one in courses],
        "batch": [one.batch for one in courses],
        "online": [one.published for one in common],
        "own": [float(one.steps[-1]) for one in own],
        "recursive": [float(one.recursive[-1]) for one in courses],
    }
    shapes = {**courses[0].shapes, "online": common[0].shape_mm}
    figures = {
        f"figure-{number}-{body}-{name}": _shape(TITLES[name], shapes[name], shapes["true"])
        for name, number in NUMBERS[body].items()
        if name != "errors"
    }
    return {**figures, f"figure-{NUMBERS[body]['errors']}-{body}-errors": _errors(errors)}


def _shape(title: str, found: Floats, truth: Floats) -> "Figure":
    """Draw a reconstructed shape over the true one from two sides."""
    figure, panels = new_figure(3.4, columns=2)
    for panel, (side, across, down) in zip(panels, SIDES, strict=True):
        for one, other in zip(found, truth, strict=True):
            panel.plot([one[across], other[across]], [one[down], other[down]], color=INK["grid"])
        panel.plot(*truth[:, [across, down]].T, "o", color=CURVE_COLOURS[1], mfc="none", label="true")
        panel.plot(*found[:, [across, down]].T, ".", color=CURVE_COLOURS[0], label="reconstructed")
        write_title(panel, side)
        panel.set_aspect("equal")
        panel.invert_yaxis()
        panel.set_xlabel("mm")
    explain_below(figure, panel, 2)
    write_heading(figure, title)
    return figure


def _errors(errors: Mapping[str, Sequence[float]]) -> "Figure":
    """Draw mean and standard deviation of the errors of each method over the trials."""
    figure, (panel,) = new_figure(3.4)
    means, spreads = [np.mean(it) for it in errors.values()], [np.std(it) for it in errors.values()]
    places = np.arange(len(errors))
    panel.bar(places, means, yerr=spreads, color=CURVE_COLOURS[0], width=0.6, capsize=4)
    for place, mean in zip(places, means, strict=True):
        panel.annotate(f"{mean:.3f}", (place + 0.05, mean), fontsize=TEXT_PT)
    panel.set_xticks(places, [TITLES[name].replace(", ", ",\n") for name in errors], fontsize=TEXT_PT)
    panel.set_ylabel("Shape error")
    write_title(panel, f"{len(errors['svd'])} trials, mean and standard deviation")
    return figure


SOURCE = "Bando 2007, ch. 4 section 5.3; reference implementation"
SOURCE_FACE = "Bando 2007, ch. 4 section 5.4; reference implementation"
CLAIM, CLAIM_FACE = "Bando 2007, ch. 4 section 5.3", "Bando 2007, ch. 4 section 5.4"
FORGETTING = (
    "the forgetting is alike for all points, so that the window forgets what it does not see; nor in the reference"
)
FORGETTING_PRISM = (
    "the window forgets all points alike, also those that it does not see: forgetting by information gives a "
    "fifth; the reference has 6.9"
)
AXES = (
    "how long what is hidden hangs on the axes about which the prism turns, which Bando leaves open: about the others "
    "centres are even better than corners; the reference has 1.08"
)
FACE_99 = "our driver 99 is another person, whose tracks have other noise: it is the look of the face that makes it"
GREATEST = "the free energy of a window says nothing of the frames before it; nor in the reference"
OURS = Own("this project, beyond Bando 2007, ch. 4 section 5.5")

TOLERANCE = {"svd": 0.03, "batch": 0.003, "online": 0.03}
MOST_RELATIVE = 0.15
"""Of the reference: renderers differ by so much even where trials hardly scatter."""

FACES: dict[Body, tuple[float, float, float]] = {
    99: (0.025, 0.014, 0.029),
    101: (0.023, 0.014, 0.056),
    102: (0.021, 0.014, 0.024),
}
"""Errors by singular values, by the batch and online."""

MEMORIES = {0.5: (0.112, 0.107), 0.9: (0.088, 0.099), 0.97: (0.083, 0.086)}
"""Errors as published and of the average step, by lambda."""

BATCHES: tuple[tuple[str, variational.Initial, float, float], ...] = (
    ("begun at zero", "zero", variational.GAMMA, 0.0164),
    ("begun at random", "random", variational.GAMMA, 0.0153),
    ("gamma = 1e-6", "svd", 1e-6, 0.0151),
    ("gamma = 1", "svd", 1.0, 0.0141),
)
"""Name, beginning, gamma and error of variations of the batch."""

GAINED = (0.9676, 0.9934)
"""Share of the rise of the free energy over ten passes that two and three have brought."""

QUICK_TRIALS, REFERENCE_TRIALS = 4, 50

REMEMBER = 1.0
"""lambda of the forgetting by information: nothing is forgotten but what is replaced by something better."""


def prism(pool: Pool, full: bool) -> list[Finding]:
    """Shape errors of all methods on the prism (figures 4.21 to 4.24)."""
    trials = [Trial("prism", seed) for seed in range(50 if full else QUICK_TRIALS)]
    courses = pool.map(run_trial, trials)
    common, own = _online(pool, trials, 0.5), _online(pool, trials, REMEMBER, own=True)
    ours = _compare("structure: prism", courses, common, (0.204, 0.0156, 0.108), SOURCE)
    steps = _steps(common)
    published = float(np.mean([one.published for one in common]))
    findings = [
        *ours,
        compare(
            "structure: prism, online, mean over all steps", steps, 0.105, TOLERANCE["online"], SOURCE, ground=PROTOCOL
        ),
        *_residuals(common),
        claim(
            "structure: prism, the shape of the greatest free energy is better than the average step's (gain)",
            steps - published,
            holds=steps - published > 0.01,
            source=CLAIM,
            known=GREATEST,
        ),
        *_online_beside_batch(courses, common),
        *_energies(courses),
        *_beyond("structure: prism", courses, common, own),
    ]
    small = [Trial("prism", trial.seed, float(np.sqrt(50.0))) for trial in trials]
    findings += _compare(
        "structure: prism, hidden variance 50",
        pool.map(run_trial, small),
        _online(pool, small, 0.5),
        (0.0105, 0.0148, 0.066),
        SOURCE,
        ordered=False,
    )
    if full:
        findings += _variations(pool)
        if pool.folder is not None:
            for name, figure in draw("prism", courses, common, own).items():
                save(figure, pool.folder / f"{name}.png", name)
    return findings


def _residuals(common: Sequence[OnlineResult]) -> list[Finding]:
    """Return how far off the corners and the centres of faces are."""
    findings = []
    for name, which, reference in (
        ("corners", slice(0, CENTRES.start), 1.33),
        ("centres of faces", CENTRES, 1.44),
    ):
        off = [float(one.residuals_mm[which].mean()) for one in common]
        allowed = three_errors(off, REFERENCE_TRIALS)
        result = f"structure: prism, online, {name}, mm"
        findings.append(compare(result, _mean(off), reference, allowed, SOURCE, ground=TRIALS))
    return findings


def _online_beside_batch(courses: Sequence[TrialResult], common: Sequence[OnlineResult]) -> list[Finding]:
    """Judge that the online method is but a little worse than the batch, and mainly at the centres of faces."""
    ratio = _mean([one.published for one in common]) / _mean([one.batch for one in courses])
    points = np.mean([one.residuals_mm for one in common], axis=0)
    centres = float(points[CENTRES].mean() / points[: CENTRES.start].mean())
    return [
        claim(
            "structure: prism, the online error is a little above the batch's (ratio, below 2)",
            ratio,
            holds=ratio < 2.0,
            source=CLAIM,
            known=FORGETTING_PRISM,
        ),
        claim(
            "structure: prism, the online error is mainly at the centres of faces (over that of corners, above 1.25)",
            centres,
            holds=centres > 1.25,
            source=CLAIM,
            known=AXES,
        ),
    ]


def faces(pool: Pool, full: bool) -> list[Finding]:
    """Shape errors on the faces of three drivers, and the pose by a face that grows."""
    findings: list[Finding] = []
    for driver, references in FACES.items() if full else list(FACES.items())[:1]:
        trials = [Trial(driver, seed) for seed in range(20 if full else 3)]
        courses = pool.map(run_trial, trials)
        common, own = _online(pool, trials, 0.5), _online(pool, trials, REMEMBER, own=True)
        name = f"structure: face, driver {driver}"
        because = FACE_99 if driver == 99 else ""
        findings += _compare(name, courses, common, references, SOURCE_FACE, ordered=False, known=because)
        gain = _mean([one.svd for one in courses]) - _steps(common)
        result = f"{name}, the online method is better than singular values (gain, mean over steps)"
        findings.append(claim(result, gain, holds=gain > 0.005, source=CLAIM_FACE, known=FORGETTING))
        findings += _beyond(name, courses, common, own)
        findings += _grow(pool, name, trials)
        if pool.folder is not None and full and driver == 99:
            for title, figure in draw("face", courses, common, own).items():
                save(figure, pool.folder / f"{title}.png", title)
    return findings


def _online(pool: Pool, trials: Sequence[Trial], memory: float, *, own: bool = False) -> list[OnlineResult]:
    return pool.map(partial(online, memory=memory, forgetting="by-information" if own else "common"), trials)


def _compare(
    name: str,
    courses: Sequence[TrialResult],
    common: Sequence[OnlineResult],
    references: tuple[float, float, float],
    source: str,
    *,
    ordered: bool = True,
    known: str = "",
) -> list[Finding]:
    """Return the errors of Bando's three methods beside the reference's, and whether they are in its order."""
    ours = {
        "svd": _mean([one.svd for one in courses]),
        "batch": _mean([one.batch for one in courses]),
        "online": _mean([one.published for one in common]),
    }
    titles = {"svd": "singular values", "batch": "variational, 10 passes", "online": "online, as published"}
    trials = {
        "svd": [one.svd for one in courses],
        "batch": [one.batch for one in courses],
        "online": [one.published for one in common],
    }
    findings = []
    for method, reference in zip(ours, references, strict=True):
        because = known if method == "online" else ""
        stated = TOLERANCE[method]
        # What is stated is for the prism with hidden points: beside errors that are far smaller it says nothing.
        scatter, other = three_errors(trials[method], len(courses)), MOST_RELATIVE * reference
        wider = (scatter, TRIALS) if scatter > other else (other, CHOSEN)
        allowed, ground = min((stated, PROTOCOL), wider)
        findings.append(
            compare(f"{name}, {titles[method]}", ours[method], reference, allowed, source, known=because, ground=ground)
        )
    if not ordered:
        return findings
    holds = ours["batch"] < ours["online"] < ours["svd"]
    result = f"{name}, weights beat equal ones, online and not (singular values less online)"
    return [*findings, claim(result, ours["svd"] - ours["online"], holds=holds, source=source)]


def _energies(courses: Sequence[TrialResult]) -> list[Finding]:
    """Return that no free energy falls, and how fast it rises."""
    energies = np.array([one.energies for one in courses])
    least = float((np.diff(energies) / np.abs(energies[:, 1:])).min())
    gained = ((energies - energies[:, :1]) / (energies[:, -1:] - energies[:, :1])).mean(axis=0)
    result = "structure: prism, the free energy never falls (least rise, relative)"
    return [
        claim(result, least, holds=least >= -1e-8, source=SOURCE),
        *(
            compare(
                f"structure: prism, free energy gained after {passes} passes of 10",
                gain,
                wanted,
                0.02,
                SOURCE,
                ground=CHOSEN,
            )
            for passes, gain, wanted in zip((2, 3), (float(gained[1]), float(gained[2])), GAINED, strict=True)
        ),
    ]


def _beyond(
    name: str, courses: Sequence[TrialResult], common: Sequence[OnlineResult], own: Sequence[OnlineResult]
) -> list[Finding]:
    """Return what the forgetting by information and the recursion bring, on the same seeds."""
    svd, batch = _mean([one.svd for one in courses]), _mean([one.batch for one in courses])
    plain, controlled = _last(common), _last(own)
    recursive = _mean([float(one.recursive[-1]) for one in courses])
    return [
        claim(
            f"{name}, online, forgetting by information, last step (below half of the common one's)",
            controlled,
            holds=controlled < 0.5 * plain,
            source=OURS,
        ),
        claim(f"{name}, the same is below singular values", controlled, holds=controlled < svd, source=OURS),
        claim(f"{name}, recursion, last step (below the batch)", recursive, holds=recursive < batch, source=OURS),
    ]


def _grow(pool: Pool, name: str, trials: Sequence[Trial]) -> list[Finding]:
    """Return how near a face comes that grows from the mean, and what that does for the pose."""
    outcomes = pool.map(grow, trials)
    mean, own = (_mean([getattr(one, side) for one in outcomes]) for side in ("mean_mm", "own_mm"))
    by_mean, published, by_truth = np.mean([one.pose_deg for one in outcomes], axis=0)
    return [
        claim(
            f"{name}, a face that grows, mm from the truth (below a third of the mean face's)",
            own,
            holds=own < mean / 3.0,
            source=OURS,
        ),
        claim(
            f"{name}, pose by the mean face less pose by the published one, degrees",
            float(by_mean - published),
            holds=bool(published < by_mean),
            source=OURS,
        ),
        claim(
            f"{name}, pose by the published face, degrees (at most a fifth above the true one's)",
            float(published),
            holds=bool(published < 1.2 * by_truth),
            source=OURS,
        ),
    ]


def _variations(pool: Pool) -> list[Finding]:
    """Return what other settings bring: lambda, the beginning, gamma."""
    few = [Trial("prism", seed) for seed in range(6)]
    findings = []
    for memory, (published, steps) in MEMORIES.items():
        outcomes = _online(pool, few, memory)
        name = f"structure: prism, online, lambda = {memory:g}"
        ours = _mean([one.published for one in outcomes])
        findings.append(compare(f"{name}, as published", ours, published, TOLERANCE["online"], SOURCE, ground=PROTOCOL))
        findings.append(
            compare(
                f"{name}, mean over all steps", _steps(outcomes), steps, TOLERANCE["online"], SOURCE, ground=PROTOCOL
            )
        )
    for title, initial, gamma, reference in BATCHES:
        ours = _mean(pool.map(partial(_batch, initial=initial, gamma=gamma), few))
        findings.append(
            compare(
                f"structure: prism, variational, {title}", ours, reference, TOLERANCE["batch"], SOURCE, ground=PROTOCOL
            )
        )
    return findings


def _batch(trial: Trial, initial: variational.Initial, gamma: float) -> float:
    body = tracks_of(trial)
    rng = Stream(trial.seed, 0, Purpose.START)
    found = variational.fit(body.tracks, initial=initial, gamma=gamma, rng=rng)
    return shape_error(found.shape, body.shape_mm)


def _steps(outcomes: Sequence[OnlineResult]) -> float:
    return _mean([float(one.steps.mean()) for one in outcomes])


def _last(outcomes: Sequence[OnlineResult]) -> float:
    return _mean([float(one.steps[-1]) for one in outcomes])


def _mean(values: Sequence[float] | Floats) -> float:
    return float(np.mean(values))
