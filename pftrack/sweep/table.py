"""Rows: the results of a sweep as Arrow tables, one row per run.

| column | content |
|---|---|
| `run` | number of the run in the plan |
| one per axis | the condition |
| `tracker`, `trial`, `seed` | the run within its condition |
| `success` | whether the decisive measure is high enough; null if unknown |
| `mean_error` | mean over the frames with known truth, in the experiment's unit |
| `lost_frames`, `first_lost_frame` | number of lost frames, and the first of them |
| `labelled_frames` | number of frames with known truth |
| one per measure | measures defined by `pftrack.core.model.measures`; null without a value |
| one per reduction | reductions of the declared series of trackers and experiment; null for a method without them |
| `step_ms` | mean time of a step; the only column that is not reproducible |
| `estimates_sha256` | hash of all estimates, as for a live run, 32 bytes |
| `problem` | why the run was not computed; the columns of its outcome are then null |
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from pftrack.core.arrays import Ints
from pftrack.core.model.parameters import Value
from pftrack.core.model.series import Reduction
from pftrack.core.model.setup import Setup
from pftrack.core.refusal import ParameterError
from pftrack.runs.many import Outcome, outcomes
from pftrack.sweep import arrow
from pftrack.sweep.plan import Plan

# A chunk is a contiguous range of run numbers that takes about a second: complete conditions, or trials of one. So the
# final file is the sequence of chunks. They are computed in an order that covers the grid evenly from the start: by the
# fractional part of a linear form of the chunk's place on the axes (the additive recurrence of quasi-Monte Carlo, used
# as a dither mask). Its factors are the golden ratio and square roots, which fractions approximate badly, so that
# finished chunks are evenly spaced along each axis and on a map of any two axes.

MOST_CHUNKS = 20_000
"""Most chunks of a plan, because a folder with more files is slow to list."""


FACTORS = ((5**0.5 - 1) / 2, 2**0.5, 3**0.5, 7**0.5, 13**0.5, 6**0.5, 10**0.5, 14**0.5)
"""Factors of the axes from the last to the first, independent over the rational numbers."""


@dataclass(frozen=True, slots=True)
class Piece:
    """Some trials, start..stop-1, of one condition."""

    condition: int
    start: int
    stop: int


@dataclass(frozen=True, slots=True)
class Chunk:
    """A contiguous range of runs.

    Attributes:
        number: Number of the chunk.
        first: Number of its first run.
        runs: Number of runs.
        pieces: The runs by condition.
    """

    number: int
    first: int
    runs: int
    pieces: tuple[Piece, ...]


@dataclass(frozen=True, slots=True)
class Chunks:
    """A plan cut into chunks.

    Attributes:
        plan: The plan.
        conditions: Number of complete conditions in a chunk.
        trials: Number of trials in a chunk; all of them if a chunk has several conditions.
    """

    plan: Plan
    conditions: int
    trials: int

    @classmethod
    def of(cls, plan: Plan, runs: float) -> "Chunks":
        """Cut a plan into at most `MOST_CHUNKS` chunks of about this many runs."""
        wanted = max(runs, plan.runs / MOST_CHUNKS)
        whole = int(wanted // (plan.trials * len(plan.trackers)))
        if whole >= 1:
            return cls(plan, min(whole, plan.conditions), plan.trials)
        return cls(plan, 1, min(max(int(wanted // len(plan.trackers)), 1), plan.trials))

    def __len__(self) -> int:
        return -(-self.plan.conditions // self.conditions) * self._splits

    def __getitem__(self, number: int) -> Chunk:
        """Return a chunk by its number, 0..len-1."""
        if not 0 <= number < len(self):
            raise IndexError(f"there are {len(self)} chunks, got {number}")
        plan = self.plan
        group, split = divmod(number, self._splits)
        start, stop = split * self.trials, min((split + 1) * self.trials, plan.trials)
        first = group * self.conditions
        last = min(first + self.conditions, plan.conditions)
        pieces = tuple(Piece(condition, start, stop) for condition in range(first, last))
        width = len(plan.trackers)
        return Chunk(number, (first * plan.trials + start) * width, len(pieces) * (stop - start) * width, pieces)

    def __iter__(self) -> Iterator[Chunk]:
        return (self[number] for number in range(len(self)))

    def spread(self) -> Ints:
        """Return all numbers in the order of computing, which covers the grid evenly from the start."""
        numbers = np.arange(len(self))
        groups, splits = np.divmod(numbers, self._splits)
        shape = (*self.plan.shape, 1)
        places = [*np.unravel_index(groups * self.conditions, shape)[:-1], *([splits] if self._splits > 1 else [])]
        form = np.zeros(len(self))
        for axis, place in enumerate(reversed(places)):
            form += place * FACTORS[axis % len(FACTORS)]
        order: Ints = np.argsort(form % 1.0, kind="stable")
        return order

    @property
    def _splits(self) -> int:
        return -(-self.plan.trials // self.trials)


TIMING = "step_ms"
"""The measured column, which is not reproducible."""

OUTCOME = (
    ("success", "bool"),
    ("mean_error", "float64"),
    ("lost_frames", "int32"),
    ("first_lost_frame", "int32"),
    ("labelled_frames", "int32"),
)

WHICH = (("tracker", "string"), ("trial", "int32"), ("seed", "int64"))

WITNESS = ("estimates_sha256", "problem")

FIXED = ("run", TIMING, *(name for name, _ in (*WHICH, *OUTCOME)), *WITNESS)
"""Names of the columns of every table, which no axis, measure or reduction may have."""

REDUCED = {"mean": "float64", "share": "float64", "count": "int32"}


def schema(plan: Plan) -> arrow.Schema:
    """Return the columns of a plan's rows."""
    axes = [(axis.name, _kind(axis.values[0])) for axis in plan.axes]
    scores = [(measure.name, "float64") for measure in plan.measures]
    kept = [(reduction.name, REDUCED[reduction.how]) for reduction in reductions(plan)]
    witness = zip(WITNESS, (arrow.binary(32), "string"), strict=True)
    return arrow.schema([("run", "int64"), *axes, *WHICH, *OUTCOME, *scores, *kept, (TIMING, "float64"), *witness])


def reductions(plan: Plan) -> list[Reduction]:
    """Return the reductions of the series that the plan's trackers and its experiment declare."""
    return [reduction for series in plan.wiring.all_series(*plan.trackers) for reduction in series.reductions]


def conform(table: arrow.Table, columns: arrow.Schema) -> arrow.Table:
    """Return a table with these columns, with null for those that an earlier version did not write."""
    arrays = [
        table[field.name].cast(field.type) if field.name in table.column_names else arrow.nulls(len(table), field.type)
        for field in columns
    ]
    return arrow.table(arrays, schema=columns)


def compute(plan: Plan, chunk: Chunk, setup: Setup) -> arrow.Table:
    """Compute the runs of a chunk on the plan's source, and return their rows in the order of run numbers.

    Refused combinations of values give rows with the refusal as their problem, and so does a run that fails; the other
    runs of its condition are computed.
    """
    rows: list[dict[str, object]] = []
    for piece in chunk.pieces:
        condition = plan.condition(piece.condition)
        seeds = plan.seeds(condition, piece.start, piece.stop)
        found = iter(_carry_out(plan, setup, {**plan.values, **condition}, seeds))
        for trial, seed in enumerate(seeds, piece.start):
            for tracker in plan.trackers:
                which = {"run": chunk.first + len(rows), **condition, "tracker": tracker, "trial": trial, "seed": seed}
                rows.append({**which, **_values(next(found))})
    return arrow.as_table(arrow.RecordBatch.from_pylist(rows, schema=schema(plan)))


def _values(found: Outcome | str) -> dict[str, object]:
    """Return the values of a row from the outcome of its run, or from its problem."""
    if isinstance(found, str):
        return {"problem": found}
    names = (name for name, _ in (*OUTCOME, (TIMING, "")))
    values = {name: getattr(found, name) for name in names}
    witness = bytes.fromhex(found.estimates_sha256)
    return {**values, **found.measures, **found.reductions, "estimates_sha256": witness}


def carry_out_trials(
    plan: Plan, setup: Setup, values: Mapping[str, Value], trackers: Sequence[str], seeds: Sequence[int], frames: int
) -> list[Outcome]:
    """Return the outcomes of runs of a condition, trial by trial."""
    found = outcomes(
        plan.wiring,
        setup,
        values=values,
        trackers=trackers,
        seeds=seeds,
        frames=frames,
        loss_probability=plan.loss_probability,
    )
    return list(chain.from_iterable(found))


def _carry_out(plan: Plan, setup: Setup, values: Mapping[str, Value], seeds: list[int]) -> Sequence[Outcome | str]:
    """Return outcome or problem of all runs of a condition, trial by trial."""
    try:
        return carry_out_trials(plan, setup, values, plan.trackers, seeds, plan.frames)
    except ParameterError as error:
        return [str(error)] * (len(seeds) * len(plan.trackers))
    except MemoryError:
        raise
    except Exception:  # noqa: BLE001 - it belongs in the row of the run that it ended
        alone = [(tracker, seed) for seed in seeds for tracker in plan.trackers]
        return [_carry_out_one(plan, setup, values, *case) for case in alone]


def _carry_out_one(plan: Plan, setup: Setup, values: Mapping[str, Value], tracker: str, seed: int) -> Outcome | str:
    """Return outcome or problem of a single run."""
    try:
        (outcome,) = carry_out_trials(plan, setup, values, [tracker], [seed], plan.frames)
    except Exception as error:  # noqa: BLE001 - see above
        return f"failed: {type(error).__name__}: {error}"
    return outcome


def _kind(value: Value) -> str:
    if isinstance(value, bool):
        return "bool"
    if isinstance(value, int):
        return "int64"
    return "float64" if isinstance(value, float) else "string"
