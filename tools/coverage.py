"""Measure how often the bands of all trackers contain the truth; write them into docs/explanation/calibration.md.

    python -m tools.coverage measure              # everything, for an hour; stores it in tests/data/coverage.json
    python -m tools.coverage measure ball head    # only these experiments; stored figures of others stay
    python -m tools.coverage table                # writes the stored figures into the page
    python -m tools.coverage random 0 10 ball     # measures settings 0 to 9, drawn at random, of these experiments
    python -m tools.coverage random 10000 10      # and those that are kept aside: nothing is chosen by them

Settings at random are stored in tests/data/random_coverage.jsonl, a line each, and measured once: what is there already
is not computed again. A test compares page, figures and declarations, so that none of them can say something else.
"""

import json
import math
import subprocess
import sys
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from pftrack.core.model.band import ALL, HALF, MOST, Finding
from pftrack.core.model.parameters import Declaration, Value, revise
from pftrack.core.model.recipe import Change
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.core.refusal import ParameterError
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.experiment import Experiment, moves_estimates
from pftrack.reproduce.pool import Pool
from pftrack.runs.coverage import Counts, Coverage, count_held, measured_run, pool_counts
from pftrack.runs.run import Run
from pftrack.testing.coverage import judge

__all__ = [
    "ASIDE",
    "DATA",
    "DRAWN",
    "PAGE",
    "SEEDS",
    "Setting",
    "coverages",
    "draw",
    "judge_drawn",
    "measured_settings",
    "page",
    "read_drawn",
    "table",
    "update",
]

ROOT = Path(__file__).parents[1]
DATA = ROOT / "tests/data/coverage.json"
PAGE = ROOT / "docs/explanation/calibration.md"

BEGIN, END = "<!-- tools.coverage: from here -->", "<!-- tools.coverage: to here -->"
DRAWN = ROOT / "tests/data/random_coverage.jsonl"
ASIDE = 10_000
"""The first number of the settings that are kept aside."""
SEEDS = range(40)
"""Seeds of the measurement that declarations rest on."""
DRAWN_RUNS = 4
"""Runs of each setting, with seeds of its own: a target that is lost now and then is lost in few of them."""
WIDE = 20.0
"""Least ratio of the ends of a useful range at which the logarithm of a number is drawn evenly."""
FROM_DRAWN, TO_DRAWN = "<!-- tools.coverage random: from here -->", "<!-- tools.coverage random: to here -->"

MARKS = {"right": " ✓", "overconfident": " ▼", "underconfident": " ▲", "uncalibrated": ""}


class Setting(NamedTuple):
    """One measured setting: a tracker with the parameters of a preset, or of the default scene if it is empty."""

    experiment: str
    tracker: str
    preset: str


class _Trial(NamedTuple):
    setting: Setting
    seed: int


def measured_settings() -> Iterator[Setting]:
    """Yield all measured settings."""
    for name in _promising():
        experiment = EXPERIMENTS[name]
        for tracker in experiment.trackers:
            for preset in ("", *experiment.quality.calibration.presets):
                yield Setting(name, tracker, preset)


def coverages(stored: Mapping[str, Any]) -> dict[Setting, list[Coverage]]:
    """Return the stored coverages by setting."""
    found: dict[Setting, list[Coverage]] = {}
    for row in stored["coverage"]:
        shown = {name: row[name] for name in ("of", "promised", "share", "error", "runs")}
        found.setdefault(_setting_of(row), []).append(Coverage(**shown))
    return found


def table(stored: Mapping[str, Any]) -> str:
    """Return the tables of all experiments as Markdown."""
    found = coverages(stored)
    return "\n\n".join(_table(EXPERIMENTS[name], found, stored["frames"][name]) for name in _promising())


def _promising() -> Iterator[str]:
    """Yield the experiments that declare a coverage of their bands."""
    return (name for name in EXPERIMENTS.own if EXPERIMENTS[name].quality.calibration.bands)


def page(text: str, stored: Mapping[str, Any]) -> str:
    """Return the page with these figures in it, and those of the settings at random."""
    before, rest = text.split(BEGIN)
    text = f"{before}{BEGIN}\n{table(stored)}\n{END}{rest.split(END)[1]}"
    before, rest = text.split(FROM_DRAWN)
    return f"{before}{FROM_DRAWN}\n{drawn_table(read_drawn())}\n{TO_DRAWN}{rest.split(TO_DRAWN)[1]}"


def _table(experiment: Experiment, found: Mapping[Setting, list[Coverage]], frames: int) -> str:
    presets = ("", *experiment.quality.calibration.presets)
    columns = ["default", *(f"`{name}`" for name in presets[1:])]
    lines = [
        f"**{experiment.title}** (`{experiment.id}`), {frames} frames",
        "",
        f"| tracker | band of | {' | '.join(columns)} |",
        f"|{'---|' * (len(columns) + 2)}",
    ]
    for tracker in experiment.trackers:
        for band in experiment.quality.calibration.bands:
            if not band.trackers or tracker in band.trackers:
                cells = [_cell(found, Setting(experiment.id, tracker, name), band.of) for name in presets]
                lines.append(f"| `{tracker}` | {band.of} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _cell(found: Mapping[Setting, list[Coverage]], setting: Setting, of: str) -> str:
    known = [one for one in found.get(setting, []) if one.of == of]
    shares = {one.promised: one.share for one in known}
    told = "/".join(_percent(shares[one]) if one in shares else "–" for one in (HALF, MOST))
    if ALL in shares:
        told = f"{_percent(shares[ALL])} %"
    return told + MARKS[judge(known)]


def _percent(share: float) -> str:
    """Return a share in percent; 100 and 0 stand only for all and none."""
    rounded = round(100 * share)
    if rounded in {0, 100} and share not in {0.0, 1.0}:
        return f"{100 * share:.1f}"
    return str(rounded)


def _count(trial: _Trial) -> tuple[int, Counts]:
    experiment = EXPERIMENTS[trial.setting.experiment]
    frames = experiment.quality.calibration.frames
    run = measured_run(experiment, trial.setting.tracker, trial.setting.preset, trial.seed, frames)
    run.finish()
    return run.frames, count_held(run)


def measure(experiments: Container[str]) -> dict[str, Any]:
    """Run some experiments, and return their figures in the stored form."""
    settings = [setting for setting in measured_settings() if setting.experiment in experiments]
    trials = [_Trial(setting, seed) for setting in settings for seed in SEEDS]
    with Pool(1, lambda done, known: sys.stderr.write(f"\r{done} of {known}")) as pool:
        counted = pool.map(_count, trials)
    counts: dict[Setting, list[Counts]] = {setting: [] for setting in settings}
    frames: dict[str, int] = {}
    for trial, (length, one) in zip(trials, counted, strict=True):
        counts[trial.setting].append(one)
        frames[trial.setting.experiment] = max(length, frames.get(trial.setting.experiment, 0))
    return describe(counts, frames)


def describe(counts: Mapping[Setting, list[Counts]], frames: Mapping[str, int]) -> dict[str, Any]:
    """Return counts by setting in the stored form."""
    command = ["git", "rev-parse", "--short", "HEAD"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)  # noqa: S603
    revision = done.stdout.strip()
    rows = [
        {**setting._asdict(), **{name: _short(value) for name, value in asdict(one).items()}}
        for setting, some in counts.items()
        for one in pool_counts(some)
    ]
    return {
        "revisions": dict.fromkeys(frames, revision),
        "seeds": len(SEEDS),
        "frames": dict(frames),
        "coverage": rows,
    }


def update(stored: Mapping[str, Any], measured: Mapping[str, Any]) -> dict[str, Any]:
    """Return the stored figures, updated by new ones."""
    rows = [row for row in stored["coverage"] if row["experiment"] not in measured["frames"]]
    order = {setting: place for place, setting in enumerate(measured_settings())}
    rows = sorted([*rows, *measured["coverage"]], key=lambda row: order[_setting_of(row)])
    merged = {name: {**stored[name], **measured[name]} for name in ("revisions", "frames")}
    return {**measured, **merged, "coverage": rows}


def _setting_of(row: Mapping[str, Any]) -> Setting:
    return Setting(row["experiment"], row["tracker"], row["preset"])


def _short(value: Any) -> Any:  # noqa: ANN401 - a word or a number
    return round(value, 5) if isinstance(value, float) else value


def store(measured: Mapping[str, Any]) -> None:
    """Write the measured figures, one line per band."""
    head = {name: value for name, value in measured.items() if name != "coverage"}
    rows = ",\n".join(f"  {json.dumps(row)}" for row in measured["coverage"])
    DATA.write_text(f'{json.dumps(head)[:-1]}, "coverage": [\n{rows}\n]}}\n')


# Settings at random: a few parameters, or many, take values from the whole of their useful ranges.


def draw(experiment: Experiment, number: int) -> dict[str, Value]:
    """Return the parameters of a setting, by its number: from one to all of them, few as often as many.

    Those that are drawn, judged by or a text are left as they are, and so is one whose value the others refuse.
    """
    parameters = experiment.simulate().parameters
    declared = experiment.declarations(type(parameters))
    turned = [it for it in declared if moves_estimates(it) and it.kind not in {"colour", "file"}]
    much, *shares = Stream(number, 0, Purpose.SCENE).random(1 + 2 * len(turned)).tolist()
    order = sorted(range(len(turned)), key=lambda place: shares[place])
    chosen: dict[str, Value] = {}
    for place in sorted(order[: round(len(turned) ** much)]):
        value = {turned[place].name: _value(turned[place], shares[len(turned) + place])}
        try:
            parameters = revise(parameters, value)
        except ParameterError:
            continue
        chosen |= value
    return chosen


def _value(declared: Declaration, share: float) -> Value:
    """Return the value that lies at a share, 0..1, of what is useful."""
    if declared.kind in {"boolean", "choice"}:
        choices = declared.choices or (False, True)
        return choices[int(share * len(choices))]
    low, high = declared.useful or (0.0, 0.0)
    is_wide = low > 0.0 and high >= WIDE * low
    value = low * math.exp(share * math.log(high / low)) if is_wide else low + share * (high - low)
    return round(value) if declared.kind == "integer" else float(f"{value:.3g}")


class _Drawn(NamedTuple):
    experiment: str
    number: int
    tracker: str


def _try(drawn: _Drawn) -> dict[str, Any]:
    """Return for a tracker in a setting which shares of the reports its bands promise, and which they held."""
    experiment = EXPERIMENTS[drawn.experiment]
    chosen, counts = draw(experiment, drawn.number), []
    for seed in range(DRAWN_RUNS * (drawn.number % 100), DRAWN_RUNS * (drawn.number % 100 + 1)):
        setup, scene = experiment.simulate(), experiment.quality.calibration.scene
        values = chosen if not scene or scene in chosen else {**chosen, scene: getattr(setup.parameters, scene) + seed}
        longest = setup.open_source(seed, revise(setup.parameters, values)).frame_count or experiment.frames
        frames = min(experiment.quality.calibration.frames, longest)
        timeline = (Change(0, values),) if values else ()
        run = Run(experiment, setup, tracker=drawn.tracker, seed=seed, frames=frames, timeline=timeline)
        run.finish()
        counts.append(count_held(run))
    held: dict[str, list[tuple[float, float]]] = {}
    for it in pool_counts(counts):
        held.setdefault(it.of, []).append((it.promised, _short(it.share)))
    return {**drawn._asdict(), "runs": DRAWN_RUNS, "held": held}


def try_random(first: int, count: int, experiments: Iterable[str]) -> None:
    """Measure settings that are not stored yet, and store each as soon as it is known."""
    known = {(row["experiment"], row["number"], row["tracker"]) for row in read_drawn()}
    for number in range(first, first + count):
        for name in experiments:
            for tracker in EXPERIMENTS[name].trackers:
                if (name, number, tracker) not in known:
                    row = json.dumps(_try(_Drawn(name, number, tracker)))
                    with DRAWN.open("a", encoding="utf-8") as file:
                        file.write(row + "\n")


def read_drawn() -> list[dict[str, Any]]:
    """Return what is stored of settings at random."""
    rows = [json.loads(line) for line in DRAWN.read_text("utf-8").splitlines()] if DRAWN.exists() else []
    return sorted(rows, key=lambda row: (list(EXPERIMENTS.own).index(row["experiment"]), row["number"]))


class Judged(NamedTuple):
    """What was found of a band in a setting, and whether it is declared right there."""

    found: Finding
    claimed: bool


def judge_drawn(row: Mapping[str, Any]) -> Iterator[Judged]:
    """Yield a verdict on each band of a stored setting, by today's declarations."""
    experiment = EXPERIMENTS[row["experiment"]]
    parameters = revise(experiment.simulate().parameters, draw(experiment, row["number"]))
    said = experiment.findings(row["tracker"], parameters)
    for of, shares in row["held"].items():
        yield Judged(_found(shares), said[of] == "right")


RIGHT: Mapping[float, tuple[float, float]] = {HALF: (0.3, 0.7), MOST: (0.85, 0.995), ALL: (1.0, 1.0)}
"""The least and the greatest share of the reports with which a band of few runs is right."""


def _found(shares: Iterable[tuple[float, float]]) -> Finding:
    """Return how a band is by shares that are promised and held: too narrow, if any is."""
    known = [(share, *RIGHT[promised]) for promised, share in shares]
    if any(share < low for share, low, _ in known):
        return "overconfident"
    return "underconfident" if any(share > high for share, _, high in known) else "right"


def drawn_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return a Markdown table of settings at random: those kept aside by experiment, and those that were seen."""
    lines = ["| experiment | settings | bands off | declared right | bands right | declared right |", f"|{'---|' * 6}"]
    aside = [row for row in rows if row["number"] >= ASIDE]
    parts = {f"`{name}`": [row for row in aside if row["experiment"] == name] for name in _promising()}
    parts |= {"all": aside, "seen": [row for row in rows if row["number"] < ASIDE]}
    lines += [f"| {title} | {' | '.join(map(str, _cells(part)))} |" for title, part in parts.items() if part]
    return "\n".join(lines)


def _cells(rows: Sequence[Mapping[str, Any]]) -> tuple[int, ...]:
    judged = [it for row in rows for it in judge_drawn(row)]
    off, right = [it for it in judged if it.found != "right"], [it for it in judged if it.found == "right"]
    settings = {(row["experiment"], row["number"]) for row in rows}
    return len(settings), len(off), sum(it.claimed for it in off), len(right), sum(it.claimed for it in right)


def main(what: str, *experiments: str) -> None:
    """Measure, or write the page."""
    if what == "measure":
        store(update(json.loads(DATA.read_text()), measure(experiments or EXPERIMENTS.own)))
    if what == "random" and experiments:
        try_random(int(experiments[0]), int(experiments[1]), experiments[2:] or tuple(_promising()))
    PAGE.write_text(page(PAGE.read_text(), json.loads(DATA.read_text())))


if __name__ == "__main__":
    main(*sys.argv[1:])
