"""Measure how often the diagnosis is right of runs lost by any flaw; write it into docs/explanation/diagnosis.md.

    python -m tools.diagnosis measure     # judges all cases that are not stored; `measure 2` in two processes
    python -m tools.diagnosis table       # writes what is stored into the pages, and into what the library says

A *case* is a number, from which all else is drawn: an experiment, a tracker, a preset to begin with, a seed, and one
flaw: a parameter of any role with a value anywhere in its range, or pictures that are noisy, in another light, blank,
frozen or left out. What is lost with the flaw and holds without it, on the same seed, was lost because of it. Which
answers are right follows from what was changed (`diagnosis_flaws.yaml`) and not from how the run looks; where that
names no cause, only *unclear* is right. Rules were made on the cases before `FIRST`, which do not count.

Each run is told twice: with the truth, and as on a recording without any truth. Somebody asks then about the frame in
which it is lost, and there is nothing to go by but the frames and what the tracker itself computes.

Cases are stored in tests/data/open_set.jsonl, a line each, and judged once: after a change of the rules, or to begin
anew, delete the file.
"""

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from textwrap import fill
from typing import Any, NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import with_config

from pftrack.analysis.diagnosis import course_of_run, diagnose_course, picture_size
from pftrack.analysis.diagnosis.course import Course, course_of
from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Declaration, Parameters, Value, declarations, flat, revise
from pftrack.core.model.preset import CAUSES, CauseId
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.model.source import Frame, History, Source, Target
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.core.refusal import RefusedError
from pftrack.core.texts import CLOSED, read_as
from pftrack.experiments import EXPERIMENTS, find
from pftrack.reproduce.pool import Pool, begin
from pftrack.runs.loss import LASTING_FRAMES, Loss
from pftrack.runs.run import Run
from tools.reproduction import README, ROOT, fill_page, table

__all__ = [
    "DATA",
    "OPEN_SET",
    "PICTURES",
    "Case",
    "Judgement",
    "Spoiled",
    "draw",
    "figures_of",
    "judge_case",
    "meanings",
    "measure",
    "numbers",
    "open_set",
    "pages",
    "read_judged",
    "without_truth",
]

DATA = ROOT / "tests/data/open_set.jsonl"
PAGE, WHY = ROOT / "docs/explanation/diagnosis.md", ROOT / "docs/how-to/why.md"
OPEN_SET = ROOT / "pftrack/analysis/diagnosis/open_set.toml"
OF_TRUTH = ("mirrored", "excess", "visible")
"""Roles of series that compare with the truth."""

AT_END = 5
HELD_SHARE = 0.1
AROUND = 10, 20
"""Frames at the end in which a run must hold, and share of all that it may lose before; and so many frames before and
after one must it hold that is asked about it."""

FIRST, LAST, LAST_SLOW = 2764, 4200, 2824
"""The first case that no rule was made on, the one after the last of the study, and the same of slow experiments."""
SLOW = {"fish", "trajectories", "head", "structure"}
"""Experiments with fewer cases, since their runs cost more."""
PIECE = 92
"""Cases after which those that came are written."""
SHARES = {"ball": 20, "histogram": 10, "linkage": 10, "prism": 10, "sine": 6}
"""How many of a round of cases are of an experiment; one of those that are not named, whose runs cost more."""
FRAMES = 60
"""Frames of a run, if its scene has so many."""
PICTURES = {
    True: ("noise", "light", "colour", "blur", "blank", "frozen", "rate", "size"),
    False: ("noise", "blank", "frozen", "rate"),
}
"""What may be wrong with pictures, and with numbers that are measured."""
PICTURES_SHARE = 0.3
"""How many of the flaws are of pictures or measurements, and not of parameters."""
SCENES = {"scene_number", "person", "tank_number", "body_seed"}
"""Parameters that say which scene of a kind it is: drawn for each case."""
NEW = frozenset(tuple(CAUSES)[11:-1])
"""Causes that were added for this study: what they are right for was outside the list before."""
WAYS = ("with the truth", "without the truth")


@with_config(CLOSED)
@dataclass(frozen=True)
class Meaning:
    """Which causes are right where something was lowered, raised or changed either way; see the file."""

    name: str
    causes: tuple[CauseId, ...] = ()
    lowered: tuple[str, ...] = ()
    raised: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    pictures: tuple[str, ...] = ()
    left: tuple[str, ...] = ()


@cache
def meanings() -> tuple[Meaning, ...]:
    """Return what the file declares."""
    return read_as(Meaning, Path(__file__).with_name("diagnosis_flaws.yaml"), "name")


@dataclass(frozen=True)
class Case:
    """A run that may be lost by a flaw.

    Attributes:
        number: From which all was drawn.
        base: The run without the flaw.
        changed: Name of the parameter, or what is wrong with the pictures.
        before: The parameter's value in the base; None of pictures.
        after: Its value, or how wrong the pictures are, 0..1.
        at: Frame in which the flaw comes.
    """

    number: int
    base: Recipe
    changed: str
    before: Value | None
    after: Value
    at: int

    @property
    def right(self) -> frozenset[CauseId]:
        """The causes that would be right; none where only unclear is."""
        names = {self.changed, f"{self.base.experiment}.{self.changed}"}
        ways = ("pictures",) if self.before is None else ("changed", *self._direction)
        return frozenset(
            cause for one in meanings() if any(names & set(getattr(one, way)) for way in ways) for cause in one.causes
        )

    @property
    def _direction(self) -> tuple[str, ...]:
        if isinstance(self.after, str) or isinstance(self.before, str | None):
            return ()
        return ("raised",) if self.after > self.before else ("lowered",)

    def begin(self) -> Run:
        """Return the run with the flaw, at its frame 0."""
        if self.before is None:
            return begin(self.base, self._spoil)
        first, change = self.base.timeline[0], {self.changed: self.after}
        wrong = (first, Change(self.at, change)) if self.at else (Change(0, {**first.values, **change}),)
        return begin(self.base.model_copy(update={"timeline": wrong}))

    def _spoil(self, seed: int, parameters: Parameters) -> "Spoiled":
        source = find(self.base.experiment).simulate().open_source(seed, parameters)
        return Spoiled(source, self.changed, float(self.after), self.at, seed)


def draw(number: int) -> Case:
    """Return a case."""
    chances = Stream(number, 0, Purpose.SCENE)
    experiment = find(_experiment_of(number))
    setup = experiment.simulate()
    declared = declarations(type(setup.parameters))
    left = {name for meaning in meanings() for name in meaning.left}
    preset = _one(experiment.presets, chances)
    tracker = _one((preset.tracker, *experiment.trackers), chances)
    scene = {it.name: _draw(it, it.default, chances) for it in declared if it.name in left and it.name in SCENES}
    values = {**(preset.parameters if chances.random() < 0.5 else {}), **scene}
    parameters = revise(setup.parameters, values)
    source = setup.open_source(number, parameters)
    length = min(source.frame_count or FRAMES, experiment.frames, FRAMES)
    base = Recipe(experiment=experiment.id, tracker=tracker, seed=number, frames=length, timeline=(Change(0, values),))
    at = int(chances.random() * length / 2) if chances.random() < 0.5 else 0
    seen = source.frame(0, History(((0, parameters),)))
    if chances.random() < PICTURES_SHARE and seen.beliefs is None:
        kind = _one(PICTURES[seen.measurements is None and seen.signal is None], chances)
        return Case(number, base, kind, None, float(chances.random()), max(at, 1))
    it = _one([each for each in declared if each.name not in left and _is_turned(each, tracker)], chances)
    before = flat(parameters)[it.name]
    return Case(number, base, it.name, before, _draw(it, before, chances), at if it.live else 0)


def numbers() -> list[int]:
    """Return the cases of the study."""
    return [each for each in range(FIRST, LAST) if each < LAST_SLOW or _experiment_of(each) not in SLOW]


def _experiment_of(number: int) -> str:
    round_of = [name for name in EXPERIMENTS.own for _ in range(SHARES.get(name, 1))]
    return round_of[number % len(round_of)]


def _is_turned(it: Declaration, tracker: str) -> bool:
    """Whether a parameter can lose a target of a tracker."""
    idle = it.role in {"loss_share", "drawing", "smoothing"} or it.kind == "file"
    return not idle and (not it.trackers or tracker in it.trackers)


def _draw(it: Declaration, now: Value, chances: Stream) -> Value:
    """Return another value of a parameter: of a number one on the way to an end of its range, by ratios if it can."""
    chance = float(max(chances.random(3)))  # far ones more often than near ones
    if it.kind == "boolean":
        return not now
    if it.kind == "choice":
        return _one([one for one in it.choices if one != now], chances)  # type: ignore[no-any-return]
    if it.kind == "colour":
        return "#" + "".join(f"{int(256 * chances.random()):02x}" for _ in "rgb")
    here, allowed = float(now), (it.minimum or 0.0, it.maximum or 0.0)
    low, high = allowed if chances.random() < 0.5 else it.useful or allowed
    end = low if it.role == "particles" or chances.random() < 0.5 else high  # more particles only cost more
    end = low + high - end if end == here else end
    value = here * (end / here) ** chance if here > 0 and end > 0 else here + (end - here) * chance
    return round(value) if it.kind == "integer" else value


def _one(some: Sequence[Any], chances: Stream) -> Any:  # noqa: ANN401 - one of what is given
    return some[int(len(some) * chances.random())]


class Spoiled:
    """A source with faulty pictures or measurements from a frame on."""

    def __init__(self, source: Source[Any], kind: str, degree: float, at: int, seed: int) -> None:
        """Spoil a source.

        Args:
            source: It.
            kind: What is wrong, of `PICTURES`.
            degree: How wrong, 0..1.
            at: Frame from which on.
            seed: Seed of the noise.
        """
        self.size, self.frame_rate_hz, self.start = source.size, source.frame_rate_hz, source.start
        self.frame_count, self.noisy = source.frame_count, True
        self._source, self._kind, self._degree, self._at, self._seed = source, kind, degree, at, seed

    def frame(self, index: int, history: History[Any]) -> Frame:
        """Return a frame of it."""
        late = index - self._at
        if late < 0:
            return self._source.frame(index, history)
        if self._kind == "rate":
            there = self._at + late * (2 + round(6 * self._degree))
            there = there if self.frame_count is None else min(there, self.frame_count - 1)
            return replace(self._source.frame(there, history), index=index)
        frame = self._source.frame(index, history)
        noise = Stream(self._seed, index, Purpose.SCENE).standard_normal
        old = self._source.frame(self._at, history) if self._kind == "frozen" else frame
        if frame.measurements is not None and old.measurements is not None:
            points = self._numbers(old.measurements.points_px, noise, 20.0)
            sds = np.full_like(old.measurements.sd_px, np.inf) if self._kind == "blank" else old.measurements.sd_px
            return replace(frame, measurements=replace(frame.measurements, points_px=points, sd_px=sds))
        if frame.signal is not None and old.signal is not None:
            return replace(frame, signal=self._numbers(old.signal, noise, 2.0))
        if self._kind == "size" and frame.target is not None and len(frame.target.position) == len(self.size):
            factor = 2.0 ** ((2.0 * self._degree - 1.0) * min(1.0, late / 20.0))
            return replace(frame, image_rgb=_scaled(frame.picture, factor), target=_grown(frame, factor))
        return replace(frame, image_rgb=self._picture(old.picture, noise))

    def _numbers(self, values: Floats, noise: Any, most: float) -> Floats:  # noqa: ANN401 - a generator's
        if self._kind == "blank":
            return np.full_like(values, np.nan)
        return values + self._degree * most * noise(values.shape) if self._kind == "noise" else values

    def _picture(self, picture: NDArray[np.uint8], noise: Any) -> NDArray[np.uint8]:  # noqa: ANN401 - a generator's
        degree = self._degree
        values: Floats = picture.astype(np.float64)
        if self._kind == "noise":
            values += 100.0 * degree * noise(picture.shape)
        elif self._kind == "light":
            values *= 4.0 ** (2.0 * degree - 1.0)
        elif self._kind == "colour":
            values += degree * (np.roll(values, 1, axis=2) - values)
        elif self._kind == "blur":
            values = np.asarray(cv2.GaussianBlur(values, (0, 0), 1.0 + 12.0 * degree), dtype=np.float64)
        elif self._kind == "blank":
            values[:] = 255.0 * degree
        spoiled = np.clip(np.rint(values), 0, 255).astype(np.uint8)
        spoiled.setflags(write=False)
        return spoiled


def _scaled(picture: NDArray[np.uint8], factor: float) -> NDArray[np.uint8]:
    """Return a picture that is larger or smaller about its middle."""
    height, width = picture.shape[:2]
    turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), 0.0, factor)
    scaled = cv2.warpAffine(picture, turn, (width, height), borderMode=cv2.BORDER_REPLICATE)
    scaled.setflags(write=False)
    return np.asarray(scaled, dtype=np.uint8)


def _grown(frame: Frame, factor: float) -> Target | None:
    """Return the target of such a picture."""
    target, (height, width) = frame.target, frame.picture.shape[:2]
    if target is None:
        return None
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    extent = target.extent and (target.extent[0] * factor, target.extent[1] * factor)
    place = middle + factor * (target.position - middle)
    return replace(target, position=place, size=target.size * factor, extent=extent)


class Judgement(NamedTuple):
    """What is said of a lost run, and of the one that holds in its place.

    Attributes:
        right: The causes that would be right; none where only unclear is.
        aided: With the truth.
        unaided: Without.
        calm_aided: Whether nothing is said of the run that holds, if it is asked about the same frame; None where it is
            lost shortly before or after.
        calm_unaided: The same without the truth.
    """

    right: Sequence[CauseId]
    aided: CauseId
    unaided: CauseId
    calm_aided: bool | None = None
    calm_unaided: bool | None = None


Judged: TypeAlias = Mapping[int, Judgement | None]
"""What is said of cases, by their number; None of one that is not lost by its flaw."""


def read_judged(path: Path = DATA) -> dict[int, Judgement | None]:
    """Return the stored cases."""
    lines = path.read_text("utf-8").splitlines() if path.exists() else []
    return {number: said and Judgement(*said) for number, said in map(json.loads, lines)}


def measure(pool: Pool, numbers: Iterable[int], path: Path = DATA) -> None:
    """Judge the cases that are not stored, and store each piece of them as it comes."""
    known = read_judged(path)
    left = [number for number in numbers if number not in known]
    for piece in (left[first : first + PIECE] for first in range(0, len(left), PIECE)):
        came = zip(piece, pool.map(judge_case, piece), strict=True)
        with path.open("a", encoding="utf-8") as file:
            file.writelines(f"{json.dumps(each)}\n" for each in came)


class Figures(NamedTuple):
    """What comes of lost runs, told in one way.

    Attributes:
        cases: How many there are.
        right: Share of the named causes that are right.
        outside: Share of the flaws outside the list that are unclear or right.
        alarms: Share of the runs that hold that get a cause.
        named: Share of the lost runs that get a cause.
        causes: By cause, how often it is named, and how often rightly; of unclear, where no cause is right.
    """

    cases: int
    right: float
    outside: float
    alarms: float
    named: float
    causes: Mapping[CauseId, tuple[int, int]]


SHOWN = {
    "right": "named causes that are right",
    "outside": "of the flaws outside the list, *unclear* or right",
    "alarms": "of the runs that hold, given a cause",
    "named": "of the lost runs, given a cause",
}


def figures_of(judged: Judged, way: str) -> Figures:
    """Return what comes of the cases that are lost by their flaw, told in one of the ways."""
    mine = [said for said in judged.values() if said]
    aided = way == WAYS[0]
    told = [(said.right, said.aided if aided else said.unaided) for said in mine]
    calm = [said.calm_aided if aided else said.calm_unaided for said in mine if said.calm_aided is not None]
    named = [cause in right for right, cause in told if cause != "unclear"]
    outside = [cause in {"unclear", *right} for right, cause in told if set(right) <= NEW]
    rights = {
        each: [each in right if each != "unclear" else not right for right, cause in told if cause == each]
        for each in CAUSES
    }
    causes = {cause: (len(some), sum(some)) for cause, some in rights.items() if some}
    return Figures(
        len(mine), _share(named), _share(outside), 1.0 - _share(calm), len(named) / max(len(mine), 1), causes
    )


def _share(holds: Sequence[bool | None]) -> float:
    return sum(map(bool, holds)) / max(len(holds), 1)


def pages(judged: Judged) -> dict[Path, dict[str, str]]:
    """Return the generated parts of pages by name: shares, those of each cause, and the same in short twice."""
    found = {way: figures_of(judged, way) for way in WAYS}
    cases = found[WAYS[0]].cases
    shares = [
        (title, *(f"{getattr(figures, name):.0%}" for figures in found.values())) for name, title in SHOWN.items()
    ]
    causes = [
        (title, *("{1} of {0}".format(*it.causes[cause]) if cause in it.causes else "" for it in found.values()))
        for cause, title in CAUSES.items()
    ]
    right, outside, alarms = (
        " and ".join(f"{getattr(figures, name):.0%} {way}" for way, figures in found.items())
        for name in ("right", "outside", "alarms")
    )
    told = f"In {cases} lost runs kept aside, with flaws of any kind, a named cause was right in {right}."
    more = (
        f"Where the flaw was outside the list, the answer was *unclear* or right in {outside}. "
        f"Runs that held got a cause in {alarms}."
    )
    return {
        PAGE: {
            "diagnosis": f"Lost runs kept aside: {cases} of {len(judged)}.\n\n{table(('', *WAYS), shares)}",
            "diagnosis by cause": table(("diagnosed as", *WAYS), [row for row in causes if any(row[1:])]),
        },
        WHY: {"diagnosis in short": fill(f"{told} {more}", 140)},
        README: {"diagnosis in README": fill(f"*Why?* names causes of losses. {told}", 130)},
    }


def open_set(judged: Judged) -> str:
    """Return the file of what the library says of its diagnosis."""
    shares = "".join(f'"{way}" = {figures_of(judged, way).right:.3f}\n' for way in WAYS)
    return f"cases = {sum(said is not None for said in judged.values())}\n{shares}"


class Played(NamedTuple):
    """What is judged of a run that is lost by a flaw: its course with the truth and without, and the moment.

    Attributes:
        frame: First of the loss.
        failing: The run with the flaw.
        holding: The one without; None where it is lost shortly before or after.
    """

    frame: int
    failing: tuple[Course, Course]
    holding: tuple[Course, Course] | None

    def judge(self, right: Iterable[CauseId]) -> Judgement:
        """Return what is said of it, where these causes would be right."""
        aided, unaided = (diagnose_course(course, self.frame).cause for course in self.failing)
        calm = [diagnose_course(course, self.frame).cause == "unclear" for course in self.holding or ()]
        return Judgement(sorted(right), aided, unaided, *calm)


def play(case: Case) -> Played | None:
    """Return what is judged of a case; None if its flaw loses nothing that was not lost before it came."""
    failing = case.begin()
    failing.finish()
    loss = Loss.of(failing.diagnostics)
    begun = loss.lasting
    if begun is None or begun < case.at or int(loss.lost[begun:].sum()) < LASTING_FRAMES:
        return None
    holding = begin(case.base)
    holding.finish()
    lost = [row.lost is True for row in holding.diagnostics]
    at_end = all(row.lost for row in failing.diagnostics[-AT_END:])
    if any(lost[-AT_END:]) or not (at_end or sum(lost) <= HELD_SHARE * len(lost)):
        return None
    before, after = AROUND
    near = holding.diagnostics[max(begun - before, 0) : begun + after]
    calm = begun < len(lost) and not any(row.is_lost for row in near)
    return Played(begun, _courses(failing), _courses(holding) if calm else None)


def _courses(run: Run) -> tuple[Course, Course]:
    told = course_of_run(run)
    return told, without_truth(run, told)


def judge_case(number: int) -> Judgement | None:
    """Return what is said of a case; None if it is not lost by its flaw, or its value is at odds with another."""
    case = draw(number)
    try:
        played = play(case)
    except RefusedError:
        return None
    return played and played.judge(case.right)


def without_truth(run: Run, told: Course | None = None) -> Course:
    """Return the course of a run as on a recording without truth.

    Args:
        run: The run.
        told: Its course with the truth, if it is there already: its frames are then looked at once.
    """
    rows = [replace(row, truth=None, error=None, lost=None, hidden=None) for row in run.diagnostics]
    declared = [series for series in run.experiment.all_series() if series.role not in OF_TRUTH]
    blind = course_of(rows, declared, unit=run.experiment.judge.unit, size=picture_size(run))
    return replace(blind, sights=(told or course_of_run(run)).sights)


def main() -> None:
    """Carry out a command, see above."""
    command, *jobs = sys.argv[1:] or ["table"]
    if command == "measure":
        with Pool(int(jobs[0]) if jobs else 1) as pool:
            measure(pool, numbers())
    else:
        judged = read_judged()
        for page, texts in pages(judged).items():
            fill_page(page, texts)
        OPEN_SET.write_text(open_set(judged), encoding="utf-8")


if __name__ == "__main__":
    from tools import diagnosis  # noqa: PLW0406 - processes of a pool find its functions in it, not in `__main__`

    diagnosis.main()
