"""Mitsugami et al. 2009 on a simulated tank: how many particles it takes to follow a fish, guided and not.

The protocol is that of docs/methods/diffusion.md: ten clips for learning, twelve others for testing, two fish each; a
success is an estimate that is inside the fish in every frame. The reference's clips cannot be drawn again, so ours are
other clips of the same tank. Both of its sets of seeds, the main and the fresh one, are 24 draws of fish and differ
between themselves by up to 2.8 fish; what is compared is the mean of both.

The claim of the paper holds: 500 guided particles do as well as 3,000 others. It does not examine the cause. With all
learned correlations set to zero the same filter does better, and constant velocity almost as well: the benefit comes
from a velocity with a learned spread. These rows are a finding of the reference implementation.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import process_time
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.recipe import Change, Timeline
from pftrack.core.model.source import History
from pftrack.experiments import find
from pftrack.experiments.fish.model import find_edges
from pftrack.experiments.fish.parameters import FISH, GUIDANCE
from pftrack.experiments.fish.scene import FishSource, FishTarget
from pftrack.experiments.fish.swimming import FRAMES, TankName, clip
from pftrack.filters.learning.diffusion import Learned, learn
from pftrack.output.figures.style import CURVE_COLOURS, new_figure, write_title
from pftrack.reproduce.finding import Findings, References
from pftrack.reproduce.pool import Pool, begin, preset_recipe
from pftrack.runs.many import FrameBlock, Trial, side_by_side
from pftrack.runs.run import Run
from pftrack.vision.rendering import render

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REFERENCES = References(__file__)
FISHES = 2
"""In each clip."""

LESSONS, LIVELY_LESSONS, TESTS, LIVELY_TESTS = 10, 8, 12, 9
OFFLINE: dict[str, Value] = {"sample_count": 3000, "walk_steps": "wide"}
FIRST, MAIN, FRESH = 100, 200, 3200
"""First clips that are learned from, and of the two test sets; each of these learns from the clips a hundred before."""


class Clip(NamedTuple):
    """A clip of two fish: its number, whether the first of them is lively, and the tank."""

    number: int
    lively: bool
    tank: TankName = "goldfish"


class Condition(NamedTuple):
    """A tracker with a number of particles, and other values that differ from the defaults."""

    tracker: str
    particles: int
    more: tuple[tuple[str, Value], ...] = ()

    @property
    def values(self) -> dict[str, Value]:
        """All values."""
        return {"sample_count": self.particles, **dict(self.more)}

    def taught(self, learned: str) -> "Condition":
        """Return the same with what was learned."""
        return self._replace(more=(*((name, it) for name, it in self.more if name != "learned"), ("learned", learned)))


@dataclass(frozen=True)
class TrainingClip:
    """Results of a clip for learning: tracks and truths (fish, FRAMES, 4), and which fish were tracked."""

    tracks: Floats
    truths: Floats
    tracked: Bools


class Outcome(NamedTuple):
    """Successes (fish, runs) of a condition on a clip, and processor time of a frame of the filter alone, ms."""

    successes: Bools
    frame_ms: float


def track_training_clip(shown: Clip) -> TrainingClip:
    """Follow both fish of a clip with the offline filter."""
    tracks, truths = np.empty((FISHES, FRAMES, 4)), np.empty((FISHES, FRAMES, 4))
    tracked = np.ones(FISHES, np.bool_)
    fish = find("fish")
    for number in range(FISHES):
        (run,) = side_by_side(
            fish,
            fish.simulate(),
            [("ordinary", shown.number)],
            changes=(Change(0, {**OFFLINE, **_clip_values(shown, number)}),),
            frames=FRAMES,
            watch=partial(_note, truths[number]),
        )
        tracks[number] = [row.vector("body") for row in run.diagnostics]
        tracked[number] = not any(row.lost for row in run.diagnostics)
    return TrainingClip(tracks, truths, tracked)


def _note(truths: Floats, run: Run) -> None:
    """Write down how the fish truly is in this frame."""
    target = run.current.frame.target
    if isinstance(target, FishTarget):
        truths[run.position] = target.pose


def track_training_clips(pool: Pool, first: int, tank: TankName = "goldfish") -> list[TrainingClip]:
    """Return the results of the ten clips for learning, numbered from this number on."""
    return pool.map(track_training_clip, [Clip(first + i, i < LIVELY_LESSONS, tank) for i in range(LESSONS)])


def learn_from_truth(first: int) -> Learned:
    """Return what the true motion in these clips teaches, without the noise of estimates."""
    clips = [clip(first + i, FISHES, i < LIVELY_LESSONS, "goldfish") for i in range(LESSONS)]
    return learn([poses[:, fish] for poses in clips for fish in range(FISHES)], FISH, "fish")


def learn_from_tracks(found: Sequence[TrainingClip]) -> Learned:
    """Return what tracks teach; those that were lost are left out, as a person would who looks at them."""
    pairs = [(track, held) for one in found for track, held in zip(one.tracks, one.tracked, strict=True)]
    return learn([track for track, held in pairs if held], FISH, GUIDANCE.experiment)


def follow(work: tuple[Clip, tuple[Condition, ...], int]) -> list[Outcome]:
    """Follow both fish of a clip under several conditions, a number of runs each.

    All runs process each picture together, so its edges are found once.
    """
    shown, conditions, runs = work
    fish = find("fish")
    setup, names = fish.simulate(), tuple(fish.trackers)
    parameters: Any = revise(setup.parameters, _clip_values(shown, 0))
    sources = [FishSource(0, revise(parameters, _clip_values(shown, number))) for number in range(FISHES)]
    trials: dict[tuple[int, int, int], Trial] = {}
    for place, condition in enumerate(conditions):
        for number, source in enumerate(sources):
            changes = (Change(0, {**condition.values, **_clip_values(shown, number)}),)
            timeline = Timeline.begin(setup.parameters, condition.tracker, names, changes)
            for run in range(runs):
                seed = 10_000 * run + FISHES * shown.number + number
                trials[place, number, run] = Trial(fish, source, timeline, seed)
    going, history = dict(trials), History(((0, parameters),))
    for index in range(FRAMES):
        picture = sources[0].frame(index, history)
        find_edges(picture, parameters)  # no run pays for what all of them look at
        blocks = [FrameBlock((replace(picture, target=one.target(index, parameters)),), 1, 2) for one in sources]
        for (_, number, _), trial in going.items():
            trial.take(blocks[number])
        going = {key: trial for key, trial in going.items() if trial.lost[-1] == 0.0}
    outcomes = []
    for place in range(len(conditions)):
        held = np.array([[(place, number, run) in going for run in range(runs)] for number in range(FISHES)])
        mine = [trial for key, trial in trials.items() if key[0] == place]
        seconds, steps = sum(trial.seconds for trial in mine), sum(trial.steps for trial in mine)
        outcomes.append(Outcome(held, 1e3 * seconds / steps))
    return outcomes


def _clip_values(shown: Clip, number: int) -> dict[str, Value]:
    return {"tank_number": shown.number, "lively": shown.lively, "tank": shown.tank, "followed_fish": number + 1}


def edge_ms(shown: Clip, frames: int = 30) -> float:
    """Return the processor time of finding the edges of a frame, ms."""
    parameters: Any = revise(find("fish").simulate().parameters, _clip_values(shown, 0))
    source, history = FishSource(0, parameters), History(((0, parameters),))
    pictures = [source.frame(frame, history) for frame in range(frames)]
    began = process_time()
    for picture in pictures:
        find_edges(picture, parameters)
    return 1e3 * (process_time() - began) / frames


class Successes(NamedTuple):
    """Mean successes over the runs: of all 24 fish, of the nine that turn sharply, and ms of a frame's filter."""

    fish: float
    sharp: float
    frame_ms: float


def successes(
    pool: Pool, first: int, conditions: list[Condition], runs: int, tank: TankName = "goldfish", every: int = 1
) -> dict[Condition, Successes]:
    """Return the successes of each condition on the twelve clips, numbered from this number on.

    Args:
        pool: Pool that computes.
        first: Number of the first clip.
        conditions: Trackers with their values.
        runs: Number of runs of each condition on each fish.
        tank: The tank.
        every: Step through the clips; successes on fewer clips are scaled to all.
    """
    clips = [Clip(first + i, i < LIVELY_TESTS, tank) for i in range(0, TESTS, every)]
    lively = sum(shown.lively for shown in clips)
    by_clip = pool.map(follow, [(shown, tuple(conditions), runs) for shown in clips])
    found = {}
    for place, condition in enumerate(conditions):
        table = np.array([outcomes[place].successes for outcomes in by_clip])
        sharp = table[:lively, 0]
        found[condition] = Successes(
            float(table.sum() / runs * TESTS / len(clips)),
            float(sharp.sum() / runs * LIVELY_TESTS / lively),
            float(np.mean([outcomes[place].frame_ms for outcomes in by_clip])),
        )
    return found


# Offline, ten clips are followed by the ordinary filter with 3,000 particles and wide noise (Mitsugami et al. 2009,
# eqs. 10 to 15). `pftrack reproduce fish-offline --full --figures FOLDER` writes what was learned to
# FOLDER/learned.json; it is the file that comes with the trackers, `pftrack/experiments/fish/learned.json`, and here it
# is compared with that.


def offline(pool: Pool, full: bool) -> Findings:
    """Tracks that are learned from: how many hold, how exact they are, and what they teach."""
    del full
    found = track_training_clips(pool, FIRST)
    learned = learn_from_tracks(found)
    if pool.folder is not None:
        (pool.folder / "learned.json").write_text(learned.text, encoding="utf-8")
    off = np.concatenate([(one.tracks - one.truths)[one.tracked].reshape(-1, 4) for one in found])
    off[:, 2] = np.remainder(off[:, 2] + np.pi, 2.0 * np.pi) - np.pi
    rms = np.sqrt(np.square(off).mean(axis=0))
    tracked = sum(int(one.tracked.sum()) for one in found)
    yield REFERENCES.judge("tracks", tracked, of=FISHES * len(found))
    yield from REFERENCES.judge_all("rms", dict(zip(FISH.names, rms, strict=True)))
    yield from _judge_learned(learned)


def _judge_learned(learned: Learned) -> Findings:
    diffusion = learned.diffusion("document")
    names = FISH.change_names
    pairs = {(names[one], names[other]): diffusion.correlation[one, other] for one, other in ((2, 3), (1, 2))}
    apart = np.abs(diffusion.covariance - GUIDANCE.parse("").diffusion("document").covariance).max()
    yield from REFERENCES.judge_all("step-sd", dict(zip(FISH.names, learned.step_sd, strict=True)))
    yield from REFERENCES.judge_all("change-sd", dict(zip(names, diffusion.sd, strict=True)))
    yield from REFERENCES.judge_all("eigenvalue", dict(enumerate(diffusion.eigenvalues, 1)))
    yield from REFERENCES.judge_all("correlation", pairs)
    yield from REFERENCES.judge_all("stroke", dict(zip(("turn", "bend"), diffusion.modes[2:, 2], strict=True)))
    yield REFERENCES.judge("learned", apart)


AT_FRAME, AROUND_PX = 12, 110
"""In the middle of a sharp turn, and how much of the picture around the fish is shown."""

TITLES = {"guided": "Guided diffusion", "ordinary": "Ordinary filter"}


def draw(found: Mapping[tuple[str, int], Successes]) -> "Figure":
    """Return figures 6 and 7 of Mitsugami et al. 2009 as one, given successes by tracker and number of particles."""
    figure, panels = new_figure(3.2, columns=2)
    counts = sorted({count for _, count in found})
    for panel, title, most in zip(panels, ("All fish", "Sharp turns"), (24, 9), strict=True):
        for (tracker, name), colour in zip(TITLES.items(), CURVE_COLOURS, strict=False):
            values = [found[tracker, count] for count in counts]
            rates = [one.fish if most == 24 else one.sharp for one in values]
            panel.plot(counts, rates, "o-", color=colour, linewidth=1.5, markersize=4, label=name)
        panel.set_xscale("log")
        panel.set_xticks(counts, [f"{count}" for count in counts])
        panel.minorticks_off()
        panel.set_ylim(0, most + 0.5)
        write_title(panel, f"{title}, of {most}")
        panel.set_xlabel("Particles")
    panel.legend(loc="lower right", frameon=False)
    figure.axes[0].set_ylabel("Successes")
    return figure


def ten_particles() -> NDArray[np.uint8]:
    """Return ten particles of the ordinary filter, and of the guided one, side by side in a sharp turn (RGB)."""
    experiment = find("fish")
    parts = []
    for name in ("ordinary", "same-turn"):
        run = begin(preset_recipe("fish", name))
        step = run.seek(AT_FRAME)
        picture = render(
            experiment.draw(step, run.diagnostics), layers=experiment.display.shown, scale=2.0, caption=False
        )
        target = step.frame.target
        x, y = np.rint(2.0 * target.position).astype(int) if target is not None else (0, 0)
        reach = 2 * AROUND_PX
        left, top = (
            min(max(x - reach, 0), picture.shape[1] - 2 * reach),
            min(max(y - reach, 0), picture.shape[0] - 2 * reach),
        )
        parts.append(picture[top : top + 2 * reach, left : left + 2 * reach])
    return np.concatenate(parts, axis=1)


COUNTS = (100, 200, 300, 500, 1000, 2000, 3000)
VARIED = (100, 300, 500, 1000)
FREE, TRUTH = "correlations set to zero", "covariance of the true motion"
OTHER = "constant-velocity"

Key: TypeAlias = tuple[str, int]
"""A tracker or a variant, and a number of particles."""


def table(pool: Pool, full: bool) -> Findings:
    """Successes by method and number of particles, the sharp turns alone, and the factors at equal success."""
    counts = COUNTS if full else (500, 3000)
    keys = [(tracker, count) for tracker in ("ordinary", "guided") for count in counts]
    found = _means(pool, {key: Condition(*key) for key in keys}, 4 if full else 1, full=full)
    name = "successes" if full else "quick-successes"
    yield from REFERENCES.judge_all(name, {key: ours.fish for key, ours in found.items()})
    guided, few, many = found["guided", 500], found["ordinary", 500], found["ordinary", 3000]
    yield REFERENCES.judge("as-good", guided.fish - many.fish)
    least = 1.5 if full else 0.0  # of a single run of each
    for title, gain in (
        ("guided with 500 less ordinary with 500", guided.fish - few.fish),
        ("the same on the nine sharp turns", guided.sharp - few.sharp),
    ):
        yield REFERENCES.judge("gain", gain, title, holds=gain >= least, least=least)
    if full:
        # The paper's figures: with few particles both are poor; in sharp turns many help little.
        yield REFERENCES.judge("figure-6", found["guided", 100].fish - found["ordinary", 100].fish)
        yield REFERENCES.judge("figure-7", found["ordinary", 3000].sharp - found["ordinary", 500].sharp)
        yield from _factors(found)
        pool.draw(lambda: {"figure-fish-success": draw(found), "figure-fish-particles": ten_particles()})


def _factors(found: Mapping[Key, Successes]) -> Findings:
    """How many fewer particles, and how much less time, the guided filter needs for as many successes."""
    many = found["ordinary", 3000]
    enough = min(count for name, count in found if name == "guided" and found[name, count].fish >= many.fish - 0.5)
    few_ms, edges = found["guided", enough].frame_ms, edge_ms(Clip(MAIN, True))
    slower, whole = many.frame_ms / few_ms, (edges + many.frame_ms) / (edges + few_ms)
    yield REFERENCES.judge("fewer", 3000 / enough, enough=enough)
    yield REFERENCES.judge("time", slower)
    yield REFERENCES.judge("time-published", slower)
    yield REFERENCES.judge("time-whole", whole)


def ablations(pool: Pool, full: bool) -> Findings:
    """The guided filter with one thing changed, and constant velocity beside it."""
    truth, variants = learn_from_truth(MAIN - 100).text, REFERENCES.settings["variants"]
    conditions = {
        (title, count): Condition("guided", count, tuple(values.items()))
        for title, values in variants.items()
        for count in VARIED
    }
    conditions |= {(TRUTH, count): Condition("guided", count).taught(truth) for count in VARIED}
    conditions |= {(name, count): Condition(name, count) for name in ("guided", OTHER) for count in VARIED}
    found = {key: one.fish for key, one in _means(pool, conditions, 4, full=full).items()}
    yield from REFERENCES.judge_all("variant", {key: ours for key, ours in found.items() if key[0] in variants})
    for count in VARIED:
        yield REFERENCES.judge("free", found[FREE, count] - found["guided", count], count)
        yield REFERENCES.judge("kept", found[OTHER, count] - found["guided", count], count)
    yield from _rudder(pool, 4)


def _rudder(pool: Pool, runs: int) -> Findings:
    """A tank in which the return stroke turns the same way as the bend: here the paper's claim does not hold."""
    text = learn_from_tracks(track_training_clips(pool, MAIN - 100, "strong rudder")).text
    conditions = [
        Condition("guided", 500).taught(text),
        Condition("ordinary", 3000).taught(text),
        Condition("guided", 500, (("correlated_changes", False),)).taught(text),
    ]
    found = successes(pool, MAIN, conditions, runs, "strong rudder")
    guided, ordinary, free = (found[one].fish for one in conditions)
    yield REFERENCES.judge("rudder", guided - ordinary)
    yield REFERENCES.judge("rudder-free", free - guided)


def _means(pool: Pool, conditions: Mapping[Key, Condition], runs: int, *, full: bool) -> dict[Key, Successes]:
    """Return the mean of both test sets, or of quick runs the main one; the fresh one has learned from fresh clips."""
    sets = [successes(pool, MAIN, list(conditions.values()), runs, every=1 if full else 2)]
    if full:
        fresh = learn_from_tracks(track_training_clips(pool, FRESH - 100)).text
        truth = learn_from_truth(FRESH - 100).text
        anew = {key: one.taught(truth if "learned" in one.values else fresh) for key, one in conditions.items()}
        found = successes(pool, FRESH, list(anew.values()), runs)
        sets.append({conditions[key]: found[condition] for key, condition in anew.items()})
    return {
        key: Successes(*(sum(column) / len(sets) for column in zip(*(one[condition] for one in sets), strict=True)))
        for key, condition in conditions.items()
    }
