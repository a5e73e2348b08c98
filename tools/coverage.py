"""Measure how often the bands of all trackers contain the truth; write them into docs/explanation/calibration.md.

    python -m tools.coverage measure              # everything, for an hour; stores it in tests/data/coverage.json
    python -m tools.coverage measure ball head    # only these experiments; stored figures of others stay
    python -m tools.coverage table                # writes the stored figures into the page

A test checks that page, figures and declarations agree.
"""

import json
import subprocess
import sys
from collections.abc import Container, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from pftrack.core.model.band import ALL, HALF, MOST
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.experiment import Experiment
from pftrack.reproduce.pool import Pool
from pftrack.runs.coverage import Counts, Coverage, count_held, measured_run, pool_counts
from pftrack.testing.coverage import SEEDS, declared_of

__all__ = ["DATA", "PAGE", "Setting", "coverages", "measured_settings", "page", "table", "update"]

ROOT = Path(__file__).parents[1]
DATA = ROOT / "tests/data/coverage.json"
PAGE = ROOT / "docs/explanation/calibration.md"

BEGIN, END = "<!-- tools.coverage: from here -->", "<!-- tools.coverage: to here -->"
MARKS = {"overconfident": "▼", "underconfident": "▲"}


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
    """Return the page with these figures."""
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}\n{table(stored)}\n{END}{rest.split(END)[1]}"


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
                cells = [_cell(experiment, found, Setting(experiment.id, tracker, name), band.of) for name in presets]
                lines.append(f"| `{tracker}` | {band.of} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _cell(experiment: Experiment, found: Mapping[Setting, list[Coverage]], setting: Setting, of: str) -> str:
    shares = {one.promised: one.share for one in found.get(setting, []) if one.of == of}
    told = "/".join(_percent(shares[one]) if one in shares else "–" for one in (HALF, MOST))
    if ALL in shares:
        told = f"{_percent(shares[ALL])} %"
    faults = declared_of(experiment, setting.tracker, setting.preset)
    directions = dict.fromkeys(fault.direction for fault in faults if not fault.bands or of in fault.bands)
    return " ".join([told, *(MARKS[direction] for direction in directions)])


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


def main(what: str, *experiments: str) -> None:
    """Measure, or write the page."""
    if what == "measure":
        store(update(json.loads(DATA.read_text()), measure(experiments or EXPERIMENTS.own)))
    PAGE.write_text(page(PAGE.read_text(), json.loads(DATA.read_text())))


if __name__ == "__main__":
    main(*sys.argv[1:])
