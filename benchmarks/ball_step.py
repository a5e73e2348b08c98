"""One frame of a live run: every tracker of the ball experiment on the simulated scene.

`step` is the tracker alone, as a run reports it with each frame; `frame` is all work of a run for a frame, including
the simulated picture and the diagnostics; `drawing` is the additional drawing for the viewer. The goal is a step of
h-SPF at N = 800 within 0.06 ms.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from statistics import median  # noqa: E402
from time import perf_counter  # noqa: E402

from pftrack.core.model.recipe import Change  # noqa: E402
from pftrack.experiments import find  # noqa: E402
from pftrack.runs.run import Run  # noqa: E402


def measure(tracker: str, count: int, frames: int) -> dict[str, object]:
    """Run a tracker on the scene and return its row."""
    ball = find("ball")
    timeline = (Change(0, {"sample_count": count}),)
    run = Run(ball, ball.simulate(), tracker=tracker, frames=frames, timeline=timeline)
    whole, drawing = [], []
    for _ in range(frames - 1):
        begun = perf_counter()
        step = run.advance()
        computed = perf_counter()
        ball.draw(step, run.diagnostics)
        whole.append(computed - begun)
        drawing.append(perf_counter() - computed)
    warm = frames // 10
    steps = [row.step_ms for row in run.diagnostics[warm:]]
    return {
        "tracker": tracker,
        "N": count,
        "step ms": median(steps),
        "step ms, p95": sorted(steps)[int(0.95 * len(steps))],
        "frame ms": 1e3 * median(whole[warm:]),
        "drawing ms": 1e3 * median(drawing[warm:]),
    }


def main() -> None:
    """Measure and report."""
    given = arguments(__doc__.splitlines()[0], frames=Size(600, 12, "frames a tracker"))
    rows = []
    for tracker in find("ball").trackers:
        progress(tracker)
        rows.append(measure(tracker, 800, given.frames))
    rows += [measure("h-spf", count, given.frames) for count in (200, 5_000)]
    reference = next(row["step ms"] for row in rows if row["tracker"] == "condensation")
    for row in rows:
        row["ratio"] = row["step ms"] / reference  # type: ignore[operator]
    report("One frame of the ball scene, 320 x 240, live run", rows, as_json=given.json)


if __name__ == "__main__":
    main()
