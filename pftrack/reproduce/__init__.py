"""Reproducing: published results, computed again and compared within stated tolerances.

Each study here reproduces a publication and knows the reference figures. Where the publication has none, and for what
it leaves open, these were measured on the same protocol by an independent implementation, the *reference
implementation*, of the readings in docs/methods. A *finding* holds ours and theirs side by side. A published claim that
could not be confirmed is computed all the same and reported as different, never hidden.

- `signals`: the Kalman and particle filters of Bando 2007, ch. 2;
- `ball`: occlusion, the number of particles, what the result hangs on, and learned dynamics, ch. 3;
- `prism`: features in two layers with an adaptive sampling distribution, ch. 4 section 3;
- `head`: the same on the face of a driver who turns the head, ch. 4 section 4;
- `structure`: the shape of prism and face from their tracks, ch. 4 section 5;
- `histogram`: a window by its colours, past a look-alike and behind a column;
- `trajectories`: tracks with outliers under three laws of the noise, simulated and in pictures (Ichimura and Ikoma);
- `fish`: guided diffusion on a fish that bends, Mitsugami et al. 2009;
- `hand`: the pose of a hand from its silhouette, with one hypothesis and with four, Shimada 1997;
- `linkage`: a chain of links by filters, mirrored hypotheses and regions, Shimada 1997;
- `loss_probability`: how true the probabilities are by which trackers say that they have lost their target;
- `calibration`: how often bands hold the truth;
- `diagnosis`: why runs were lost, told from their numbers, against what was put there.

Beside them `finding` compares and records, `pool` computes, and `sources` says on which files a result depends.
"""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from time import process_time

from pftrack.reproduce import calibration, hand, loss_probability, prism, signals, trajectories
from pftrack.reproduce.ball import motion, occlusion, study
from pftrack.reproduce.costs import SECONDS
from pftrack.reproduce.diagnosis import confusion as diagnosis
from pftrack.reproduce.finding import Entry, Finding, Form, Record, describe_verdicts, not_run, read_record
from pftrack.reproduce.fish import success as fish
from pftrack.reproduce.fish import trials as fish_learning
from pftrack.reproduce.head import pose as head
from pftrack.reproduce.histogram import table as histogram
from pftrack.reproduce.linkage import kalman, regions
from pftrack.reproduce.pool import Pool
from pftrack.reproduce.sources import hash_sources
from pftrack.reproduce.structure import shape as structure

__all__ = ["RESULTS", "Entry", "Finding", "Pool", "Record", "describe_verdicts", "is_older", "read_record", "reproduce"]

UNKNOWN = (5.0, 60.0)
"""What a result is taken to cost of which nothing is known, s."""

RESULTS: dict[str, Callable[[Pool, bool], list[Finding]]] = {
    "kalman-sine": signals.kalman_sine,
    "sample-count-signal": signals.sample_count,
    "dimension": signals.dimension,
    "one-step": study.one_step,
    "occlusion": occlusion.coarse_map,
    "sensitivity": study.variations,
    "wide-swing": occlusion.wide_swing,
    "sample-count": study.sample_count,
    "maps": occlusion.whole_protocol,
    "learning": motion.unobstructed,
    "learning-clutter": motion.clutter,
    "prism": prism.pose,
    "prism-readings": prism.readings,
    "prism-perspective": prism.perspective,
    "pose-filters": prism.pose_filters,
    "head": head.pose,
    "calibration": calibration.coverage,
    "loss": loss_probability.loss_probabilities,
    "structure": structure.prism,
    "structure-face": structure.faces,
    "histogram": histogram.table,
    "histogram-trackers": histogram.trackers,
    "trajectories": trajectories.errors,
    "corners": trajectories.pictures,
    "fish-offline": fish_learning.offline,
    "fish": fish.table,
    "fish-ablations": fish.ablations,
    "hand": hand.table,
    "hand-switches": hand.switches,
    "hand-scoring": hand.scorings,
    "hand-particles": hand.compare_with_particles,
    "hand-steps": hand.steps,
    "linkage-algebra": kalman.algebra,
    "linkage-cross": kalman.cross,
    "linkage-static": kalman.static,
    "linkage-confident": kalman.confident,
    "linkage-recovery": kalman.recovery,
    "linkage-space": kalman.space,
    "linkage-strips": regions.algebra,
    "linkage-regions": regions.containment,
    "linkage-ingredients": regions.ingredients,
    "linkage-regions-space": regions.space,
    "linkage-variants": regions.variants,
    "linkage-lines": kalman.lines,
    "diagnosis": diagnosis.confusion,
}
"""All results by name: functions of a pool and of whether the whole protocol is to be run."""


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
        names: Which; all if none.
        full: All trials of the protocol, or fewer, with tolerances that allow for it.
        jobs: Processes that compute.
        cluster: Address of a Dask scheduler whose workers compute in their place.
        progress: Called with the processor time of what is done and of all, s, as `costs` has it.
        folder: Where sweeps and figures are kept; what is there already is not computed again.
        record: Where results are kept as they come; what is there in this form, of these sources, is not computed
            again.

    Raises:
        LookupError: There is no result of that name; the sentence lists those that there are.
        SweepError: The folder holds other sweeps under the same names, or the workers failed.
        OSError: The folder or the record cannot be written.
    """
    for name in names:
        if name not in RESULTS:
            raise LookupError(f"there is no result {name!r}; there are {', '.join(RESULTS)}")
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
    form: Form = "full" if full else "quick"
    costs = {name: SECONDS.get(name, UNKNOWN)[full] for name in names or RESULTS}
    found: dict[str, list[Finding]] = {}
    spent = 0.0
    for name in sorted(costs, key=lambda one: costs[one]):
        sources = "" if record is None else hash_sources(RESULTS[name].__module__)
        if record is not None and record.has(name, form, sources):
            found[name] = record.findings(name)
        else:
            tell = partial(_tell, progress, spent, costs[name], sum(costs.values()))
            with Pool(jobs, tell, folder, cluster) as pool:
                began = process_time()
                found[name] = RESULTS[name](pool, full)
                seconds = process_time() - began if jobs == 1 else 0.0
            if record is not None:
                spent_s = max(seconds, pool.seconds)
                record.keep(name, form, found[name], sources=sources, pieces=pool.pieces, seconds=spent_s)
        spent += costs[name]
    findings = [finding for name in costs for finding in found[name]]
    return findings + [not_run(name) for name in RESULTS if name not in costs]


def is_older(name: str, entry: Entry) -> bool:
    """Return whether a result was computed from other sources than those here, or from sources that are not known."""
    return entry.sources != hash_sources(RESULTS[name].__module__)


def _tell(
    progress: Callable[[float, float], object] | None, spent: float, cost: float, total: float, done: int, known: int
) -> None:
    """Tell how much is done of all, given how many pieces of one result are."""
    if progress is not None:
        progress(spent + cost * done / max(known, 1), total)
