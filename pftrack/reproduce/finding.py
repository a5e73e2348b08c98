"""Findings: our figure, the reference's statement, and the verdict of the comparison.

Statements are in YAML next to the studies, one per name: a sentence, a source, and either figures with the tolerance
and its ground, or the bounds for our figure. A table of figures is a mapping by row and column, and the sentence has a
place for each of their names:

    pooled:
      result: "occlusion: {0}, pooled success"
      source: Bando 2007, ch. 3 sections 3.1 and 3.2; reference implementation
      reference: {h-spf: 0.407, s-spf: 0.292}
      tolerance: 0.04

A file may have `settings` besides: values of parameters by a group and a name, as of scenes or of variations.

A study computes figures and asks for `judge("pooled", figure, "h-spf")`. A published claim that could not be confirmed
has a `known` reason, for all of its cells or for some, and is reported as different all the same.
"""

import ast
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, Literal, SupportsFloat, TypeAlias

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, RootModel, TypeAdapter, ValidationError, model_validator

from pftrack.core.arrays import Floats
from pftrack.core.files import write_whole
from pftrack.core.model.parameters import Value
from pftrack.core.texts import read_as, read_texts, read_whole, refusal
from pftrack.experiments import EXPERIMENTS

Verdict: TypeAlias = Literal["reproduced", "better", "differs", "our own figure", "not run"]
VERDICTS: tuple[Verdict, ...] = ("reproduced", "better", "differs", "our own figure", "not run")

Ground: TypeAlias = Literal[
    "stated", "chosen", "share", "trials", "fewer", "own", "half", "lawns", "eleven", "seeds", "successes", "ends"
]

GROUNDS = read_whole(RootModel[dict[Ground, str]], Path(__file__).with_name("grounds.yaml")).root
"""The reason of a tolerance."""

Key: TypeAlias = str | int | float
"""Key of a row, a column or another part of a table."""

Stated: TypeAlias = Any
"""A number, several whose mean counts, or a mapping of these by key; of `between` the leaves are two bounds."""

OfSide: TypeAlias = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]


@dataclass(frozen=True, slots=True)
class Finding:
    """One result.

    Attributes:
        result: Name of the study and the quantity.
        ours: Our figure; NaN if it was not run.
        reference: The reference's figure, or None for an ordering.
        tolerance: Largest accepted distance from the reference; None for an ordering.
        verdict: The verdict. "reproduced" is within the tolerance, or holds; "better" is outside of it on the good
            side, for a stated reason, since a criterion may have become easier; "differs" is neither; "our own figure"
            has no reference and is as it was.
        source: Source of the reference.
        known: Whether a difference was expected. One that was not is a mistake somewhere.
        reason: Why it is better, why it was expected to differ, or why it was not run.
        ground: Reason of the tolerance.
        timed: Whether it is a time, which no second run repeats.
        explained: Whether it differs and the cause is known.
    """

    result: str
    ours: OfSide
    reference: float | None
    tolerance: float | None
    verdict: Verdict
    source: str
    known: bool = False
    reason: str = ""
    ground: str = ""
    timed: bool = False
    explained: bool = False

    @property
    def fails(self) -> bool:
        """Whether it differs unexpectedly."""
        return self.verdict == "differs" and not self.known

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """Result, our figure, the reference with its tolerance, and the verdict: a line that fits into a terminal."""
        reference = "" if self.reference is None else f"{self.reference:.4g} ± {self.tolerance or 0.0:.2g}"
        return self.result, f"{self.ours:.4g}", reference, self.verdict

    def as_dict(self) -> dict[str, object]:
        """Return the values by name, ready for JSON."""
        return asdict(self) | {"ours": self.ours if math.isfinite(self.ours) else None}


Findings: TypeAlias = Iterator[Finding]
"""Results that a study yields one after the other."""


class Exemption(BaseModel):
    """Why some cells of a table, or all, may differ.

    Attributes:
        reason: In words.
        of: Keys of the cells, enough to identify each; all cells if empty.
        explained: Whether the reason explains the cause.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    reason: str
    of: tuple[tuple[Key, ...], ...] = ()
    explained: bool = True


class Statement(BaseModel):
    """A statement on a figure, or on a table of figures, and its source.

    Attributes:
        result: The sentence, with places for keys and words.
        source: Its source; may have places, too.
        own: Whether the source is this project, so the figure has no reference and only guards against mistakes.
        reference: Figures.
        between: Lowest and highest figure, in place of a reference.
        tolerance: Largest accepted distance from these.
        relative: The same, as a share of the reference.
        runs: Number of runs of the reference, whose figures are shares of them; the tolerance follows from both numbers
            of runs.
        ground: Reason of the tolerance. above, below, least, most: Bounds, in place of a reference.
        known: Why figures may differ.
        better: The good side of the tolerance.
        reason: Why ours may be there; or why the figure is not computed.
        timed: Whether it is a time.
        name: In the file.
        origin: File and line.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    result: str
    source: str = ""
    own: bool = False
    reference: Stated = None
    between: Stated = None
    tolerance: Stated = 0.0
    relative: Stated = 0.0
    runs: Stated = None
    ground: Ground | None = None
    above: float | None = None
    below: float | None = None
    least: float | None = None
    most: float | None = None
    known: tuple[Exemption, ...] = ()
    better: Literal["higher", "lower"] | None = None
    reason: str = ""
    timed: bool = False
    name: str = ""
    origin: str = ""

    @model_validator(mode="before")
    @classmethod
    def _in_short(cls, given: Any) -> Any:  # noqa: ANN401 - what a file says
        """Take a sentence, or a single exemption, for a list of one."""
        known = given.get("known", ())
        said = [known] if isinstance(known, str | Mapping) else known
        return {**given, "known": [{"reason": one} if isinstance(one, str) else one for one in said]}

    @model_validator(mode="after")
    def _whole(self) -> "Statement":
        for name in ("reference", "between", "tolerance", "relative", "runs"):
            _check_numbers(name, getattr(self, name))
        compared = self.reference is not None or self.between is not None or self.tolerance or self.relative
        if compared and self.runs is None and self.ground is None:
            raise ValueError(f"lacks the ground of its tolerance, one of {', '.join(GROUNDS)}")
        if self.better is not None and not self.reason:
            raise ValueError("may be better than its reference, for which a reason must be stated")
        return self

    def judge(
        self,
        ours: SupportsFloat,
        *keys: Key,
        holds: bool | None = None,
        runs: int = 0,
        wider: float = 1.0,
        more: float = 0.0,
        reference: float | None = None,
        tolerance: float | None = None,
        ground: Ground | None = None,
        **words: object,
    ) -> Finding:
        """Judge a figure by its distance from the reference, or by the bounds; NaN differs.

        Args:
            ours: Our figure.
            *keys: Keys of the cell.
            holds: Whether the statement holds, if figures and bounds are not stated.
            runs: Number of our runs, if the figure is a share of them.
            wider: Factor that widens the tolerance for fewer trials.
            more: The same, as a summand.
            reference: Replaces the stated one.
            tolerance: Replaces the stated one.
            ground: Reason of the tolerance, if different.
            **words: Values for places of the sentence that are not keys.

        Raises:
            LookupError: The cell is missing; the error names file and line.
        """
        found, why = float(ours), ground
        stated, allowed = self._figures(keys)
        reference = stated if reference is None else float(reference)
        if reference is not None:
            if runs:
                both = 1 / runs + 1 / self._number("runs", keys)
                allowed, ground = 3 * math.sqrt(reference * (1 - reference) * both) + 0.03, "share"
            allowed = wider * allowed + more if tolerance is None else float(tolerance)
            holds = abs(found - reference) <= allowed
            why = ground or ("fewer" if wider != 1.0 or more else self.ground)
        elif holds is None:
            holds = self._bounded(found)
        good = found > (reference or 0.0) if self.better == "higher" else found < (reference or 0.0)
        verdict: Verdict = "our own figure" if self.own else "reproduced"
        if not holds:
            verdict = "better" if self.better and good else "differs"
        exempt = next((one for one in self.known if not one.of or any(set(cell) <= set(keys) for cell in one.of)), None)
        differs = verdict == "differs" and exempt is not None
        return Finding(
            self.result.format(*keys, **words),
            found,
            reference,
            None if reference is None else allowed,
            verdict,
            self.source.format(*keys, **words),
            exempt is not None,
            self.reason if verdict == "better" else exempt.reason if differs and exempt else "",
            GROUNDS[why] if reference is not None and why is not None else "",
            self.timed,
            bool(differs and exempt and exempt.explained),
        )

    def _figures(self, keys: tuple[Key, ...]) -> tuple[float | None, float]:
        """Return reference and tolerance of a cell; no reference if bounds are stated."""
        if self.between is not None:
            low, high = _leaf(self.between, keys, self)
            return 0.5 * (low + high), 0.5 * (high - low) + self._number("tolerance", keys)
        if self.reference is None:
            return None, self._number("tolerance", keys)
        reference = self._number("reference", keys)
        return reference, self._number("tolerance", keys) + self._number("relative", keys) * reference

    def _number(self, name: str, keys: tuple[Key, ...]) -> float:
        found = _leaf(getattr(self, name), keys, self)
        return float(np.mean(found)) if isinstance(found, list) else float(found)

    def _bounded(self, ours: float) -> bool:
        bounds = (
            self.above is None or ours > self.above,
            self.below is None or ours < self.below,
            self.least is None or ours >= self.least,
            self.most is None or ours <= self.most,
        )
        return all(bounds) and not math.isnan(ours)


SETTINGS = "settings"
_SETTINGS: TypeAdapter[Mapping[str, Mapping[str, Mapping[str, Value]]]] = TypeAdapter(
    Mapping[str, Mapping[str, Mapping[str, Value]]]
)


class References:
    """The statements of a study, by name, and its settings; the file is read when the first of them is asked for."""

    def __init__(self, study: str) -> None:
        """Know the file.

        Args:
            study: Path of the study's module; the file beside it has the same name.
        """
        self.path = Path(study).with_suffix(".yaml")

    @cached_property
    def statements(self) -> Mapping[str, Statement]:
        """All of them.

        Raises:
            ValueError: The file is not YAML, or a statement is not one; it names file and line.
        """
        return {one.name: one for one in read_as(Statement, self.path, "name", passed=(SETTINGS,))}

    @cached_property
    def settings(self) -> Mapping[str, Mapping[str, Mapping[str, Value]]]:
        """Values of parameters by a group and a name.

        Raises:
            ValueError: They are something else; it names file and line.
        """
        declared, places = read_texts(self.path)
        try:
            return _SETTINGS.validate_python(declared.get(SETTINGS, {}))
        except ValidationError as error:
            raise refusal(error, places, self.path.name, SETTINGS) from None

    def judge(self, name: str, ours: SupportsFloat, *keys: Key, **more: Any) -> Finding:  # noqa: ANN401 - see `Statement`
        """Judge a figure by a statement; see `Statement.judge`."""
        return self.statements[name].judge(ours, *keys, **more)

    def judge_all(self, name: str, ours: Mapping[Any, SupportsFloat], *keys: Key, **more: Any) -> list[Finding]:  # noqa: ANN401
        """Judge figures by key, or by several, beyond those that they have in common."""
        return [
            self.judge(name, figure, *keys, *(key if isinstance(key, tuple) else (key,)), **more)
            for key, figure in ours.items()
        ]

    def table(self, name: str) -> Any:  # noqa: ANN401 - a mapping of what the file has
        """Return the figures of a table, by key."""
        stated = self.statements[name]
        return stated.between if stated.reference is None else stated.reference

    def not_run(self, name: str, *keys: Key, **words: object) -> Finding:
        """Return the finding on a result that is not computed in this form, with the stated reason."""
        stated = self.statements[name]
        return not_run(stated.result.format(*keys, **words), stated.reason.format(*keys, **words))


def three_errors(values: Iterable[float] | Floats, reference_trials: int) -> float:
    """Return three standard errors of the difference of two means of trials, ours and as many of the reference.

    The trials of the reference are taken to scatter as ours do.

    Args:
        values: Values of our trials.
        reference_trials: Number of trials of the reference.
    """
    known = np.asarray(values)
    return 3.0 * float(np.std(known, ddof=1)) * math.sqrt(1 / len(known) + 1 / reference_trials)


def mean_of(values: Iterable[SupportsFloat]) -> float:
    """Return the mean of some figures."""
    return float(np.mean([float(value) for value in values]))


def not_run(result: str, reason: str = "") -> Finding:
    """Return the remark on a result that was not requested, or not computed in this form for a reason."""
    return Finding(result, math.nan, None, None, "not run", "", reason=reason)


def describe_verdicts(findings: Iterable[Finding]) -> str:
    """Return the numbers of findings by verdict, in words, and the number of explained differences."""
    found = list(findings)
    counts = Counter(one.verdict for one in found)
    words = ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICTS if counts[verdict])
    explained, failed = sum(one.explained for one in found), sum(one.fails for one in found)
    other = counts["differs"] - explained - failed
    return f"{words}; differences: {explained} with a known cause, {other} without, {failed} not expected"


def _check_numbers(name: str, stated: Stated) -> None:
    """Refuse a leaf that is not a number or a list of numbers."""
    if isinstance(stated, Mapping):
        for key, value in stated.items():
            _check_numbers(f"{name} of {key}", value)
    elif stated is not None:
        for value in stated if isinstance(stated, list) else [stated]:
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise ValueError(f"the {name} must be a number, got {value!r}")  # noqa: TRY004 - of a file


def _leaf(stated: Stated, keys: tuple[Key, ...], of: Statement) -> Any:  # noqa: ANN401 - a number or some
    """Return a mapping's value for keys, ignoring keys that it does not distinguish."""
    rest = list(keys)
    while isinstance(stated, Mapping):
        key = next((one for one in rest if one in stated), None)
        if key is None:
            raise LookupError(f"{of.origin}: {of.name} states nothing for {', '.join(map(str, keys))}")
        stated = stated[key]
        rest.remove(key)
    return stated


# Records: findings stored as they are computed, with the sources that each result depends on.
#
# A second call continues with the missing results, and recomputes those whose sources have changed. The file is JSON,
# by the name of a result; docs/explanation/reproduction.md is written from it. The sources of a result are the module
# of its study and all modules of pftrack that it imports, directly or not, with the data beside them. Experiments are
# imported by name: a study that names one depends on it, and one that goes through all depends on all.

Form: TypeAlias = Literal["full", "quick"]

ROOT = Path(__file__).parents[2]
STUDIES = Path(__file__).parent
DATA = frozenset({".csv", ".json", ".yaml"})


@dataclass(frozen=True, slots=True)
class Entry:
    """A result that was computed.

    Attributes:
        form: All trials of the protocol, or few.
        revision: Revision of pftrack.
        sources: SHA-256 of the sources that it depends on (`hash_sources`); empty if that was not kept.
        pieces: Number of pieces of work; of most studies they are trials, of those of the ball 120 runs each.
        seconds: Processor time of these.
        findings: Its findings.
    """

    form: Form
    revision: str
    sources: str
    pieces: int
    seconds: float
    findings: tuple[Finding, ...]


class _Kept(BaseModel):
    """The file."""

    model_config = ConfigDict(extra="forbid")

    results: dict[str, Entry]


class Record:
    """The results in a file; one that is kept is on disk before the next one begins."""

    def __init__(self, path: Path, revision: str) -> None:
        """Begin a record, or go on with the one in the file.

        Args:
            path: The file; it need not be there.
            revision: Revision of the results stored from now on.

        Raises:
            ValueError: The file holds something else.
            OSError: It cannot be read.
        """
        self.path, self.revision = path, revision
        self._entries = dict(read_record(path)) if path.exists() else {}

    def has(self, name: str, form: Form, sources: str) -> bool:
        """Return whether a result of these sources is there in this form, or for a quick one the full one of any."""
        entry = self._entries.get(name)
        return entry is not None and (
            (entry.form, entry.sources) == (form, sources) or (entry.form, form) == ("full", "quick")
        )

    def findings(self, name: str) -> list[Finding]:
        """Return the findings of a result that is there."""
        return list(self._entries[name].findings)

    def keep(
        self, name: str, form: Form, findings: Sequence[Finding], *, sources: str, pieces: int, seconds: float
    ) -> None:
        """Write a result into the file."""
        self._entries[name] = Entry(form, self.revision, sources, pieces, round(seconds, 2), tuple(findings))
        text = _Kept(results=dict(sorted(self._entries.items()))).model_dump_json(indent=1)
        write_whole(self.path, f"{text}\n".encode())


def read_record(path: Path) -> Mapping[str, Entry]:
    """Return the results in a file by name.

    Raises:
        ValueError: The file holds something else.
        OSError: It cannot be read.
    """
    try:
        return _Kept.model_validate_json(path.read_bytes()).results
    except ValidationError as error:
        said = error.errors()[0]
        place = ".".join(map(str, said["loc"]))
        raise ValueError(f"{path} is not a record of reproduced results: {place}: {said['msg']}") from None


@cache
def hash_sources(study: str) -> str:
    """Return the SHA-256 of all files that a study depends on, with their paths; what only people read does not count.

    Args:
        study: Module of the study, such as `pftrack.reproduce.signals`.
    """
    found = sha256()
    for path in list_sources(study):
        found.update(f"{path.relative_to(ROOT).as_posix()} {_read_source(path)[0]}\n".encode())
    return found.hexdigest()


def list_sources(study: str) -> list[Path]:
    """Return the files that a study depends on, sorted; see `hash_sources`."""
    waiting, seen = [study], set[Path]()
    while waiting:
        module = waiting.pop()
        path = _path_of(module)
        if path is not None and path not in seen:
            seen.add(path)
            waiting += _imports_of(path, module)
    data = {each for folder in {path.parent for path in seen} for each in folder.iterdir() if each.suffix in DATA}
    # Studies lie side by side; what is stated of the others does not count.
    mine = tuple(path.stem for path in seen if path.parent == STUDIES)
    return sorted(seen | {each for each in data if each.parent != STUDIES or each.stem.startswith(mine)})


def _imports_of(path: Path, module: str) -> list[str]:
    """Return the modules that a module imports anywhere in it, and the experiments that a study names."""
    _, modules, experiments = _read_source(path)
    is_study = module.startswith("pftrack.reproduce.") and module != __name__
    return modules + [f"pftrack.experiments.{name}.experiment" for name in experiments if is_study]


@cache
def _read_source(path: Path) -> tuple[str, list[str], list[str]]:
    """Return the SHA-256 of a file's code, the modules that it imports, and the experiments that it names.

    Blank lines, comments and docstrings are not code.
    """
    lines, modules, experiments = path.read_text(encoding="utf-8").splitlines(), list[str](), list[str]()
    for node in ast.walk(ast.parse(path.read_bytes())) if path.suffix == ".py" else ():
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            lines[node.lineno - 1 : node.end_lineno] = [""] * len(lines[node.lineno - 1 : node.end_lineno])
        elif isinstance(node, ast.Import):
            modules += [each.name for each in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            modules += [node.module, *(f"{node.module}.{each.name}" for each in node.names)]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value in EXPERIMENTS.own:
            experiments.append(node.value)
        elif isinstance(node, ast.Name) and node.id == "EXPERIMENTS":
            experiments += EXPERIMENTS.own
    code = "\n".join(line for line in lines if line.strip() and not line.lstrip().startswith("#"))
    return sha256(code.encode()).hexdigest(), modules, experiments


@cache
def _path_of(module: str) -> Path | None:
    """Return the file of a module of pftrack; None if there is none of that name."""
    if module.partition(".")[0] != "pftrack":
        return None
    path = ROOT.joinpath(*module.split("."))
    return next((each for each in (path.with_suffix(".py"), path / "__init__.py") if each.is_file()), None)
