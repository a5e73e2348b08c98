"""Inspecting a frame: the likelihood over the picture and the genealogy of the particles, compared with a step.

`map` is the likelihood over the picture, `particle` the inspection of one particle, `genealogy` the ancestors of all
over thirty frames whose steps are kept; `ratio` is map over step. The goal is a map within 100 ms. Without an
inspection none of this is called.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from collections.abc import Callable  # noqa: E402
from statistics import median  # noqa: E402
from time import perf_counter  # noqa: E402

from pftrack.experiments import find  # noqa: E402
from pftrack.runs.inspection import Inspection  # noqa: E402
from pftrack.runs.run import Run  # noqa: E402

SHOWN = (
    ("ball", "condensation"),
    ("ball", "kalman"),
    ("histogram", "condensation"),
    ("fish", "guided"),
    ("prism", "pf-asd"),
    ("head", "pf-asd"),
)


def timed(work: Callable[[], object], repeats: int) -> float:
    """Return the median time of a call, ms; the first call, which may compile, does not count."""
    taken = []
    for _ in range(repeats + 1):
        begun = perf_counter()
        work()
        taken.append(1e3 * (perf_counter() - begun))
    return median(taken[1:])


def measure(name: str, tracker: str, frames: int, repeats: int) -> dict[str, object]:
    """Run a tracker on its scene, inspect its last frame, and return its row."""
    experiment = find(name)
    run = Run(experiment, experiment.simulate(), tracker=tracker, frames=frames)
    run.finish()
    drawing = experiment.draw(run.current, run.diagnostics)
    size, looked = (drawing.width, drawing.height), Inspection(run)
    step_ms = median(row.step_ms for row in run.diagnostics[1:])
    map_ms = timed(lambda: looked.map(size), repeats)
    has_cloud = looked.cloud is not None
    return {
        "experiment": name,
        "tracker": tracker,
        "step ms": step_ms,
        "map ms": map_ms,
        "ratio": map_ms / step_ms,
        "place ms": timed(looked.at_estimate, repeats),
        "particle ms": timed(lambda: looked.at_particle(0), repeats) if has_cloud else None,
        "genealogy ms": timed(looked.genealogy, repeats) if has_cloud else None,
    }


def main() -> None:
    """Measure and report."""
    sizes = {"frames": Size(40, 4, "frames of a run"), "repeats": Size(20, 1, "calls of each kind")}
    given = arguments(__doc__.splitlines()[0], **sizes)
    rows = []
    for name, tracker in SHOWN:
        progress(f"{name} {tracker}")
        rows.append(measure(name, tracker, given.frames, given.repeats))
    report("Looking into a frame", rows, as_json=given.json)


if __name__ == "__main__":
    main()
