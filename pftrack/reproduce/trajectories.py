"""Trajectories with outliers under three laws of the noise, simulated and in pictures (Ichimura and Ikoma 2000)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import History
from pftrack.experiments import find
from pftrack.experiments.trajectories import corners
from pftrack.experiments.trajectories.corner_scene import FRAMES, CornerSceneParameters, CornerSource
from pftrack.experiments.trajectories.corners import CornerParameters
from pftrack.experiments.trajectories.scene import REFERENCE_PX, TRUE_PATH, TracksSceneParameters, simulate
from pftrack.filters.trajectories.cloud import Cloud
from pftrack.filters.trajectories.gaussian import logs_mode
from pftrack.filters.trajectories.whole import GRID, Method, Settings, Smoothed, follow, likelihood_surface, track_error
from pftrack.output.figures.picture import save
from pftrack.output.figures.style import CURVE_COLOURS, INK, draw_scale, explain_below, new_figure, viridis, write_title
from pftrack.reproduce.finding import CHOSEN, FEWER, PROTOCOL, TRIALS, Finding, Unexplained, claim, compare, not_run
from pftrack.reproduce.pool import Pool
from pftrack.runs.run import Run
from pftrack.vision.rendering import png, render_beside

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLES = {"lg": "Gaussian noise (LG)", "lng": "Cauchy noise (LNG)", "nlng": "Self-organising (NLNG)"}
DEEPEST = 100.0
"""Further below the maximum the likelihood is shown as this."""


def draw(found: Mapping[str, Smoothed], surfaces: Mapping[str, Floats]) -> "dict[str, Figure]":
    """Return the figures by name: of the runs of each method, and of log likelihoods (20, 20) over the grid."""
    return {"trajectories-track": _track(found), "trajectories-likelihood": _likelihood(surfaces)}


def _track(found: Mapping[str, Smoothed]) -> "Figure":
    """Draw how far measurements and positions are aside of the truth, of the run whose error is the median."""
    figure, panels = new_figure(5.6, rows=len(found), share="xy")
    frames = np.arange(len(TRUE_PATH))
    for panel, (name, one) in zip(panels, found.items(), strict=True):
        panel.axhline(0.0, color=INK["truth"], linewidth=0.8)
        aside = REFERENCE_PX[:, 0] - TRUE_PATH[:, 0]
        panel.plot(frames, aside, ".", color=INK["observation"], label="measured")
        off = track_error(one.filtered, TRUE_PATH[:, None])
        middle = int(np.argsort(off)[len(off) // 2])
        for kind, colour, positions in zip(
            ("smoothed", "filtered"), CURVE_COLOURS, (one.smoothed, one.filtered), strict=False
        ):
            panel.plot(frames, positions[:, middle, 0] - TRUE_PATH[:, 0], color=colour, label=kind)
        write_title(panel, TITLES[name])
        panel.set_ylabel("aside, px")
        panel.set_ylim(-25.0, 15.0)
    panels[-1].set_xlabel("frame")
    explain_below(figure, panels[0], 3)
    return figure


def _likelihood(surfaces: Mapping[str, Floats]) -> "Figure":
    """Draw maps of the log likelihood less its maximum, and where that is."""
    colours = viridis()
    figure, panels = new_figure(3.4, columns=len(surfaces), share="y")
    for panel, (name, surface) in zip(panels, surfaces.items(), strict=True):
        panel.pcolormesh(GRID, GRID, (surface - surface.max()).T, cmap=colours, vmin=-DEEPEST, vmax=0.0, zorder=2)
        noise, drive = np.unravel_index(surface.argmax(), surface.shape)
        panel.plot(GRID[noise], GRID[drive], "o", color=INK["lost"], mfc="none")
        write_title(panel, f"{TITLES[name]}: best at ({GRID[noise]:g}, {GRID[drive]:g})")
        panel.set_xlabel("σ², px²")
    panels[0].set_ylabel("τ², px²")
    draw_scale(figure, panels, colours, (-DEEPEST, 0.0), "log likelihood less its maximum")
    return figure


# Section 5.2: corners that block matching mistakes for each other, filtered and smoothed. Their own sequence is not
# public, and they report no numbers: mismatches of 8 to 25 px are suppressed by both filters with Cauchy noise and not
# by the Kalman filter. The reference has figures for a simulated stand-in. Scenes differ much from each other, since
# how often the light jumps, and whether it does so twice in a row, is a matter of the seed; so means over several are
# compared, within a quarter. What must hold of nearly every scene is the order.
#
# Ours are drawn from the same description with other random numbers, and are a little harder: where one jump of the
# light follows another, a match gets two cells away, further than the search reaches back, and goes on from there. Such
# tracks weigh most where the filters have removed all else, so that the smoothed errors under Cauchy noise are up to a
# third above the reference's. These rows are known to differ.
#
# A track is *mixed* if it is mismatched, more than 5 px off, in some but fewer than 30 % of the frames.

SOURCE = "Ichimura and Ikoma 2000, section 5.2; reference implementation"
FEW, MANY = 4, 16
JUMP = 27
"""A frame in which the light of the preset jumps."""
QUARTER = 0.25
FAR_PX, MIXED_BELOW = 5.0, 0.3

QUICK_WIDER = 2.0
"""Of four scenes of sixteen."""
HARD = "our scenes are harder: after two jumps of the light in a row a match does not come back"

NO_RECORDING = (
    "the recording is not part of pftrack; docs/experiments/trajectories.md tells what was measured: none is better, "
    "since what covers a corner stays for longer than the lag, and a mismatch that lasts is a consistent track"
)

METHODS: tuple[Method, ...] = ("lg", "lng", "nlng")
POINTS = 59.75
MIXED = 38.75
MISMATCHED = 0.19
TABLE = {
    "raw": (4.03, 14.18, 0.40),
    "lg": (2.43, 5.78, 0.86),
    "lng": (1.81, 2.55, 0.54),
    "nlng": (1.32, 1.58, 0.36),
}
"""Means over the reference's four scenes: error of mixed tracks, and of their mismatched and clean frames, px."""

MISMATCHES = "mean error at mismatched frames"
WHAT = "rms error of mixed tracks", MISMATCHES, "mean error at clean frames"

HARDER = "lng", "nlng"
"""Methods whose error is hardly but that of tracks that are lost for long."""


@dataclass(frozen=True, slots=True)
class Scene:
    """What came of one scene.

    Attributes:
        points: Corners that were followed.
        mixed: How many of them are mismatched now and then.
        mismatched: Share of all measurements that are mismatched.
        errors: By method, "raw" for the measurements: as in `TABLE`; all methods are smoothed.
    """

    points: int
    mixed: int
    mismatched: float
    errors: dict[str, tuple[float, float, float]]


def pictures(pool: Pool, full: bool) -> list[Finding]:
    """Errors of corners on the simulated sequence, measured and smoothed by each filter."""
    scenes = pool.map(scene, range(MANY if full else FEW))
    wider = 1.0 if full else QUICK_WIDER
    findings = [
        _compare(what, float(np.mean([getattr(one, name) for one in scenes])), reference, wider)
        for what, name, reference in (
            ("followed", "points", POINTS),
            ("mixed tracks", "mixed", MIXED),
            ("share of mismatches", "mismatched", MISMATCHED),
        )
    ]
    for name, references in TABLE.items():
        means = np.mean([one.errors[name] for one in scenes], axis=0)
        title = "measured" if name == "raw" else f"{name} smoothed"
        findings += [
            _compare(
                f"{title}, {what}, px",
                float(mean),
                reference,
                wider,
                known=HARD if name in HARDER and what == MISMATCHES else "",
            )
            for what, mean, reference in zip(WHAT, means, references, strict=True)
        ]
    orders = [tuple(one.errors[name][0] for name in TABLE) for one in scenes]
    ordered = float(np.mean([sorted(order, reverse=True) == list(order) for order in orders]))
    if pool.folder is not None:
        (pool.folder / "trajectories-search.png").write_bytes(png(search_figure()))
    statement = "corners: scenes in which each of measured, lg, lng and nlng is better than the one before (share)"
    return [
        *findings,
        claim(statement, ordered, holds=ordered >= 0.75, source=SOURCE),
        not_run("corners: on a recording, each filter is better than the measured track", NO_RECORDING),
    ]


def _compare(what: str, ours: float, reference: float, wider: float, *, known: str = "") -> Finding:
    ground = PROTOCOL if wider == 1.0 else FEWER
    allowed = QUARTER * wider * reference
    return compare(f"corners: {what}", ours, reference, allowed, SOURCE, known=known, ground=ground)


def scene(seed: int) -> Scene:
    """Follow the corners of a scene by block matching, filter and smooth them, and compare with the truth."""
    measured, truth = _follow(seed)
    settings = Settings(noise=3.0, drive=1.0, lag=25, count=2000, seed=seed)
    found = {"raw": measured} | {method: follow(method, measured, settings).smoothed for method in METHODS}
    far = _distances(measured, truth) > FAR_PX
    shares = far.mean(axis=0)
    mixed = (shares > 0.0) & (shares < MIXED_BELOW)
    errors = {}
    for name, positions in found.items():
        off = _distances(positions, truth)[:, mixed]
        means = [float(np.nanmean(off[which])) for which in (far[:, mixed], ~far[:, mixed])]
        errors[name] = (float(np.sqrt(np.nanmean(np.square(off)))), means[0], means[1])
    return Scene(measured.shape[1], int(mixed.sum()), float(far.mean()), errors)


def _follow(seed: int) -> tuple[Floats, Floats]:
    """Return measured and true positions (frames, K, 2), px."""
    parameters, matching = CornerSceneParameters(), CornerParameters()
    source, history = CornerSource(seed, parameters), History(((0, parameters),))
    first = np.zeros(len(source.points_px), np.int64)
    state, positions = None, source.points_px
    measured, truths = [], []
    for index in range(FRAMES):
        frame = source.frame(index, history)
        if frame.image_rgb is None:
            raise RuntimeError("the scene is made of pictures")
        if state is None:
            state, positions = corners.begin(frame.image_rgb, matching, source.points_px)
        else:
            state, positions = corners.follow(state, frame.image_rgb, matching, index)
        measured.append(positions)
        truths.append(source.motion(index, history).path(source.points_px, index, first))
    return np.array(measured), np.array(truths)


def search_figure() -> NDArray[np.uint8]:
    """Draw the preset's frame in which the light jumps, beside how its selected corner is looked for."""
    experiment = find("trajectories")
    (preset,) = (each for each in experiment.presets if each.name == "lattice")
    timeline = (Change(0, dict(preset.parameters)),)
    run = Run(experiment, experiment.simulate(), tracker=preset.tracker, frames=JUMP + 1, timeline=timeline)
    for step in run:
        if step.frame.index == JUMP:
            drawing = experiment.draw(step, run.diagnostics)
    worlds = tuple(each for each in drawing.worlds if each.world.name == "search")
    return render_beside(replace(drawing, worlds=worlds), scale=1.5)


def _distances(one: Floats, other: Floats) -> Floats:
    return np.asarray(np.hypot(*np.moveaxis(one - other, -1, 0)))


# Section 5.1: errors on the simulated track, and the likelihood of the scales of the noise. What they say: where
# outliers are, both filters with Cauchy noise beat the Kalman filter, filtered and smoothed; the one that finds the
# scales itself is worse than the one that is given the best, and as good once it is smoothed. That holds. Two readings
# were needed, and were chosen since no others agree with the figures: "scale 50" is the square of the scale, and the
# "mean squared errors" are sqrt(sum |e|^2) / N. One figure, the smoothed error of the Kalman filter, agrees with no
# reading; an exact smoother is better than that.

TRACKS_SOURCE = "Ichimura and Ikoma 2000, table 1; reference implementation"
LIKELIHOOD = "Ichimura and Ikoma 2000, section 5.1; reference implementation"
READING = "reference implementation"
CHECK = "reference implementation: particles under Gaussian noise"

LEARNED_LATE = (
    "scales have no noise and begin too wide, so that a smoother of 25 frames cannot undo what the first "
    "frames cost; the reference is behind by as much, 0.021"
)

TRACKS_METHODS: tuple[tuple[Method, float], ...] = (("lg", 10.0), ("lng", 1.0), ("nlng", 3.0))
"""With the sigma^2 that is given to each in section 5.1; tau^2 is 1."""

RUNS = 101
TRACKS_TABLE: dict[str, tuple[float, float, float, float]] = {
    "lg": (0.338, 0.224, 0.0005, 0.0005),
    "lng": (0.134, 0.108, 0.02, 0.008),
    "nlng": (0.158, 0.129, 0.025, 0.015),
}
"""Errors filtered and smoothed, medians over the runs, and how far they may be from that."""

ENSEMBLE: dict[str, tuple[float, float]] = {"lg": (0.321, 0.192), "lng": (0.164, 0.122), "nlng": (0.188, 0.140)}
"""Medians over data sets whose likelihood has its maximum where Ichimura and Ikoma report it."""
SCATTER = 0.025
"""Of a median of 60 data sets, three standard deviations of that of the self-organising filter."""

OUTLIERS: Ints = np.arange(15, 100, 15)
AT_OUTLIERS = {
    "lg": (6.7, 0.5, 21.7, 2.1, 1.4, 12.3),
    "lng": (1.6, 0.6, 1.5, 2.3, 2.4, 1.5),
    "nlng": (1.5, 0.6, 1.5, 2.4, 1.9, 1.4),
}
"""Median errors at the six frames with outliers, px."""
ROUNDED = 0.05 + 1e-9

LAWS = (0.62, 0.54)
"""sigma^2 and tau^2 that the self-organising filter ends with, px^2, medians."""

EXACT_DIFFERENCES = {500: (0.21, 0.58), 2000: (0.09, 0.31), 8000: (0.05, 0.17)}
"""Of particles and the Kalman filter, filtered and smoothed, px, by the number of particles."""
ELEVEN = "this project: as far as eleven runs of so few particles scatter"


def errors(pool: Pool, full: bool) -> list[Finding]:
    """Table 1 on the reference track, the likelihood, and the particles beside the exact filter."""
    found = dict(zip(TRACKS_TABLE, pool.map(_runs, TRACKS_METHODS), strict=True))
    table = {name: _medians(one) for name, one in found.items()}
    findings = [finding for name in TRACKS_TABLE for finding in _compare_tracks(name, table[name])]
    findings += _orderings(table)
    for name, one in found.items():
        off = np.linalg.norm(one.filtered - TRUE_PATH[:, None], axis=2)[OUTLIERS]
        for frame, errors_px, reference in zip(OUTLIERS, off, AT_OUTLIERS[name], strict=True):
            row = f"trajectories: {name}, error at the outlier in frame {frame}, px"
            allowed = ROUNDED if name == "lg" else ROUNDED + _three_errors_of_median(errors_px)
            findings.append(compare(row, float(np.median(errors_px)), reference, allowed, TRACKS_SOURCE, ground=TRIALS))
    findings += _laws(found["nlng"])
    methods: tuple[Method, ...] = ("lg", "lng")
    surfaces = pool.map(_surface, methods)
    findings += [
        _maximum("lg", surfaces[0], (10.0, 1.0), LIKELIHOOD),
        _maximum("lng", surfaces[1], (1.0, 1.0), LIKELIHOOD),
        *_beside_the_exact(pool, full),
    ]
    if full:
        findings += [*_readings(pool), *_ensemble(pool)]
    if pool.folder is not None:
        for name, figure in draw(found, dict(zip(("lg", "lng"), surfaces, strict=True))).items():
            save(figure, pool.folder / f"{name}.png", name)
    return findings


def _three_errors_of_median(values: Floats) -> float:
    """Return three standard errors of the difference of two medians of so many runs, by the order of ours.

    Errors may gather around two values, between which a median jumps: the farther side counts.
    """
    aside = 1.5 / np.sqrt(len(values))
    low, middle, high = np.quantile(values, (0.5 - aside, 0.5, 0.5 + aside))
    return float(np.sqrt(2.0) * max(high - middle, middle - low))


def _runs(item: tuple[Method, float]) -> Smoothed:
    """Follow the reference track with 101 different sets of random numbers."""
    method, noise = item
    return follow(method, np.repeat(REFERENCE_PX[:, None], 1 if method == "lg" else RUNS, axis=1), Settings(noise, 1.0))


def _medians(found: Smoothed, truth: Floats = TRUE_PATH) -> tuple[float, float]:
    filtered, smoothed = (track_error(one, truth[:, None]) for one in (found.filtered, found.smoothed))
    return float(np.median(filtered)), float(np.median(smoothed))


def _compare_tracks(name: str, ours: tuple[float, float]) -> list[Finding]:
    *references, of_filtered, of_smoothed = TRACKS_TABLE[name]
    return [
        compare(f"trajectories: {name}, {what}, error E", value, reference, tolerance, TRACKS_SOURCE, ground=PROTOCOL)
        for what, value, reference, tolerance in zip(
            ("filtered", "smoothed"), ours, references, (of_filtered, of_smoothed), strict=True
        )
    ]


def _orderings(table: dict[str, tuple[float, float]]) -> list[Finding]:
    (lg, lng, nlng) = (table[name] for name in TRACKS_TABLE)
    gains = [
        ("Cauchy noise beats Gaussian, filtered (gain)", lg[0] - lng[0]),
        ("Cauchy noise beats Gaussian, smoothed (gain)", lg[1] - lng[1]),
        ("self-organising beats Gaussian, filtered (gain)", lg[0] - nlng[0]),
        ("self-organising beats Gaussian, smoothed (gain)", lg[1] - nlng[1]),
        ("the best scales beat learned ones, filtered (gain)", nlng[0] - lng[0]),
    ]
    rows = [claim(f"trajectories: {text}", gain, holds=gain > 0.0, source=TRACKS_SOURCE) for text, gain in gains]
    behind = nlng[1] - lng[1]
    statement = "trajectories: learned scales are as good as the best ones, smoothed (behind by at most 0.008)"
    rows.append(
        claim(statement, behind, holds=behind <= TRACKS_TABLE["lng"][3], source=TRACKS_SOURCE, known=LEARNED_LATE)
    )
    statement = "trajectories: lg, smoothed, error E as published"
    return [
        *rows,
        compare(
            statement,
            lg[1],
            0.277,
            0.02,
            TRACKS_SOURCE,
            ground=CHOSEN,
            known=Unexplained("no reading of the paper gives it; an exact smoother is better"),
        ),
    ]


def _laws(found: Smoothed) -> list[Finding]:
    """Compare the scales that the runs end with, by the modes of their logarithms."""
    belief = found.last
    if not isinstance(belief, Cloud):
        raise TypeError("a filter that learns has particles")
    laws = [belief.laws(track) for track in range(RUNS)]
    ends = np.exp([[logs_mode(logs, shares) for logs in values.T] for values, shares in filter(None, laws)])
    return [
        compare(
            f"trajectories: nlng, {name} at the end, px²",
            float(np.median(ends[:, place])),
            reference,
            0.2,
            TRACKS_SOURCE,
            ground=CHOSEN,
        )
        for place, (name, reference) in enumerate(zip(("σ²", "τ²"), LAWS, strict=True))
    ]


def _surface(method: Method) -> Floats:
    return likelihood_surface(method, REFERENCE_PX, Settings())


def _maximum(name: str, surface: Floats, best: tuple[float, float], source: str) -> Finding:
    noise, drive = (1.0 + float(place) for place in np.unravel_index(surface.argmax(), surface.shape))
    statement = f"trajectories: {name}, most likely at σ² = {best[0]:g}, τ² = {best[1]:g} (ours: σ², at τ² = {drive:g})"
    return claim(statement, noise, holds=(noise, drive) == best, source=source)


def _clean() -> Floats:
    track = REFERENCE_PX.copy()
    track[OUTLIERS, 0] = TRUE_PATH[OUTLIERS, 0]
    return track


def _beside_the_exact(pool: Pool, full: bool) -> list[Finding]:
    counts = tuple(EXACT_DIFFERENCES) if full else (500, 2000)
    findings = []
    for count, ours in zip(counts, pool.map(_difference, counts), strict=True):
        for what, value, reference in zip(("filtered", "smoothed"), ours, EXACT_DIFFERENCES[count], strict=False):
            row = f"trajectories: Gaussian noise, {what} from the exact, {count} particles, px"
            findings.append(compare(row, value, reference, 0.3 * reference, CHECK, ground=ELEVEN))
        allowed, ground = (0.2, PROTOCOL) if count == 8000 else (1.0, ELEVEN)
        row = f"trajectories: Gaussian noise, log likelihood less the exact, {count} particles"
        findings.append(compare(row, ours[2], 0.0, allowed, CHECK, ground=ground))
    return findings


def _difference(count: int) -> tuple[float, float, float]:
    settings = Settings(10.0, 1.0, count=count, by_mode=False)
    exact = follow("lg", _clean()[:, None], settings)
    found = follow("mcf-gaussian", np.repeat(_clean()[:, None], 11, axis=1), settings)
    filtered, smoothed = (
        float(np.sqrt(np.square(one - other).mean()))
        for one, other in ((found.filtered, exact.filtered), (found.smoothed, exact.smoothed))
    )
    return filtered, smoothed, float(found.log_likelihoods.mean() - exact.log_likelihoods[0])


@dataclass(frozen=True, slots=True)
class Trial:
    """One set of data.

    Attributes:
        seed: Of its noise.
        scale_px2: Square of the scale of its outliers.
    """

    seed: int
    scale_px2: float = 50.0


def _track_of(trial: Trial) -> Floats:
    values = {"track_count": 1, "reference_track": False, "outlier_scale_px2": trial.scale_px2}
    return simulate(trial.seed, TracksSceneParameters.model_validate(values))[0][:, 0]


def _best_pair(trial: Trial) -> tuple[int, int]:
    """Return the most likely sigma^2 and tau^2 of the linear model, px^2."""
    surface = likelihood_surface("lg", _track_of(trial), Settings())
    noise, drive = np.unravel_index(surface.argmax(), surface.shape)
    return int(noise) + 1, int(drive) + 1


def _readings(pool: Pool) -> list[Finding]:
    """By which reading of "scale 50" the likelihood has its maximum where it was reported."""
    count = 1000
    shares = []
    for scale, corner in ((2500.0, True), (50.0, False)):
        pairs = pool.map(_best_pair, [Trial(seed, scale) for seed in range(count)])
        if corner:
            shares.append(np.mean([pair == (20, 20) for pair in pairs]))
        else:
            shares.append(np.mean([abs(noise - 10) <= 2 and drive == 1 for noise, drive in pairs]))
    literal, root = (float(share) for share in shares)
    return [
        compare(
            "trajectories: scale 50 px, data sets with the best pair in the corner",
            literal,
            0.93,
            0.08,
            READING,
            ground=CHOSEN,
        ),
        compare(
            "trajectories: scale √50 px, data sets with the best pair near (10, 1)",
            root,
            0.11,
            0.1,
            READING,
            ground=CHOSEN,
        ),
    ]


def _ensemble(pool: Pool) -> list[Finding]:
    """Errors on data sets in order whose likelihood has its maximum where it was reported, five runs on each."""
    chosen: list[Trial] = []
    first, size = 0, 500
    while len(chosen) < 60:
        trials = [Trial(seed) for seed in range(first, first + size)]
        pairs: Sequence[tuple[int, int]] = pool.map(_best_pair, trials)
        chosen += [trial for trial, pair in zip(trials, pairs, strict=True) if pair == (10, 1)]
        first += size
    findings = []
    for method, noise in TRACKS_METHODS:
        outcomes = np.array(pool.map(partial(_trial_errors, method, noise), chosen[:60]))
        medians = np.median(outcomes, axis=0)
        for what, value, reference in zip(("filtered", "smoothed"), medians, ENSEMBLE[method], strict=True):
            row = f"trajectories: {method}, {what}, error E, median of 60 data sets"
            findings.append(compare(row, float(value), reference, SCATTER, TRACKS_SOURCE, ground=CHOSEN))
    return findings


def _trial_errors(method: Method, noise: float, trial: Trial) -> tuple[float, float]:
    tracks = np.repeat(_track_of(trial)[:, None], 1 if method == "lg" else 5, axis=1)
    return _medians(follow(method, tracks, Settings(noise, 1.0, seed=trial.seed)))
