"""Reproduction: published results, recomputed and compared within stated tolerances.

Each study here reproduces a publication: it runs the product and computes its statistic. The reference figures and the
sentences of its findings are in the YAML file next to it. Where the publication has no figures, or leaves details open,
an independent implementation of the readings in docs/methods, the *reference implementation*, measured figures on the
same protocol. A *finding* compares our figure with theirs. A published claim that could not be confirmed is still
computed and reported as different, never hidden.

- `signals`: the Kalman and particle filters of Bando 2007, ch. 2, and one step whose exact answer is known;
- `ball`: occlusion, the number of particles, what the result hangs on, and learned dynamics, ch. 3;
- `prism`: features in two layers with an adaptive sampling distribution, ch. 4 section 3;
- `head`: the same on the face of a driver who turns the head, ch. 4 section 4;
- `structure`: the shape of prism and face from their tracks, ch. 4 section 5;
- `histogram`: a window by its colours, past a look-alike and behind a column;
- `trajectories`: tracks with outliers under three laws of the noise, simulated and in pictures (Ichimura and Ikoma);
- `fish`: guided diffusion on a fish that bends, Mitsugami et al. 2009;
- `hand`: the pose of a hand from its silhouette, with one hypothesis and with four, Shimada 1997;
- `linkage`: a chain of links by filters, mirrored hypotheses and regions, Shimada 1997;
- `calibration`: how often the bands of a pose hold the truth.

In addition, `finding` compares figures and records findings with the files that they depend on, and `pool` computes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from time import process_time

from pydantic import with_config

from pftrack.core.refusal import ParameterError
from pftrack.core.texts import CLOSED, read_as
from pftrack.reproduce.finding import Entry, Finding, Form, Record, hash_sources, not_run
from pftrack.reproduce.pool import Pool

__all__ = ["RESULTS", "is_older", "reproduce"]


@with_config(CLOSED)
@dataclass(frozen=True, slots=True)
class Result:
    """A result that can be computed.

    Attributes:
        name: In commands and records.
        study: Module of this package.
        function: The study's, which yields findings, given a pool and whether the whole protocol is to be run.
        full_s: Processor time of the full form, s, as measured on one core. The cheap ones come first, and a bar says
            how long is left.
        quick_s: The same of the quick one.
        only_full: Why it has no quick form; empty if it has one.
        origin: File and line where it is declared.
    """

    name: str
    study: str
    function: str
    full_s: float
    quick_s: float = 0.0
    only_full: str = ""
    origin: str = ""

    @property
    def module(self) -> str:
        """Full name of the study's module."""
        return f"pftrack.reproduce.{self.study}"

    def compute(self, pool: Pool, full: bool) -> list[Finding]:
        """Compute it; without a quick form, report why."""
        if self.only_full and not full:
            return [not_run(self.name, self.only_full)]
        return list(getattr(import_module(self.module), self.function)(pool, full))


RESULTS = {one.name: one for one in read_as(Result, Path(__file__).with_name("results.yaml"), "name")}
"""All results by name."""


def reproduce(
    names: Sequence[str] = (),
    *,
    full: bool = False,
    jobs: int = 1,
    cluster: str | None = None,
    progress: Callable[[float, float], object] | None = None,
    folder: Path | None = None,
    record: Record | None = None,
) -> list[Finding]:
    """Compute results again, the cheap ones first; those that were not asked for come last, as not run.

    Args:
        names: Names of the results; all if empty.
        full: All trials of the protocol, or fewer, with tolerances that allow for it.
        jobs: Processes that compute.
        cluster: Address of a Dask scheduler whose workers compute in their place.
        progress: Called with the processor time of what is done and of all, s, as `Result` has it.
        folder: Folder of sweeps and figures; existing ones are not computed again.
        record: File of finished results; those in this form, from the same sources, are not computed again.

    Raises:
        ParameterError: A result is unknown; the sentence lists all of them.
        SweepError: The folder holds other sweeps under the same names, or the workers failed.
        OSError: The folder or the record cannot be written.
    """
    for name in names:
        if name not in RESULTS:
            raise ParameterError("result", name, f"one of {', '.join(RESULTS)}")
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
    form: Form = "full" if full else "quick"
    costs = {name: RESULTS[name].full_s if full else RESULTS[name].quick_s for name in names or RESULTS}
    found: dict[str, list[Finding]] = {}
    spent = 0.0
    for name in sorted(costs, key=lambda one: costs[one]):
        sources = "" if record is None else hash_sources(RESULTS[name].module)
        if record is not None and record.has(name, form, sources):
            found[name] = record.findings(name)
        else:
            tell = partial(_tell, progress, spent, costs[name], sum(costs.values()))
            with Pool(jobs, tell, folder, cluster) as pool:
                began = process_time()
                found[name] = RESULTS[name].compute(pool, full)
                seconds = process_time() - began if jobs == 1 else 0.0
            if record is not None:
                spent_s = max(seconds, pool.seconds)
                record.keep(name, form, found[name], sources=sources, pieces=pool.pieces, seconds=spent_s)
        spent += costs[name]
    findings = [finding for name in costs for finding in found[name]]
    return findings + [not_run(name) for name in RESULTS if name not in costs]


def is_older(name: str, entry: Entry) -> bool:
    """Return whether a result was computed from other sources than those here, or from sources that are not known."""
    return entry.sources != hash_sources(RESULTS[name].module)


def _tell(
    progress: Callable[[float, float], object] | None, spent: float, cost: float, total: float, done: int, known: int
) -> None:
    """Report the overall progress, given the finished pieces of one result."""
    if progress is not None:
        progress(spent + cost * done / max(known, 1), total)
