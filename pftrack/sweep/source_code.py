"""What computes a sweep again: a few lines of Python, and a command."""

import shlex

from pftrack.core.model.recipe import Footage
from pftrack.runs.source_code import SourceCode
from pftrack.sweep.plan import Plan

__all__ = ["sweep_code"]

OUT = "sweep.parquet"


def sweep_code(plan: Plan) -> SourceCode:
    """Return what carries out a plan and prints its table; a recording is looked for where the command runs."""
    recording = plan.footage.name or "recording.mp4" if plan.footage else None
    trackers = [f"{name}.py" if name in plan.filters else name for name in plan.trackers]
    words = ["pftrack", "sweep", plan.experiment]
    for axis in plan.axes:
        words += ["--axis", f"{axis.name}={','.join(map(str, axis.values))}"]
    words += ["--trackers", ",".join(trackers), "--trials", str(plan.trials), "--frames", str(plan.frames)]
    words += ["--seed", str(plan.seed), *(["--loss-probability"] if plan.loss_probability else [])]
    for name, value in plan.values.items():
        words += ["--set", f"{name}={value}"]
    said = [] if plan.footage is None else _footage_options(plan.footage, recording or "")
    where = "" if recording is None else f", recording=Recording({recording!r})"
    python = _python(plan, where)
    if said is None:
        return SourceCode(python, f"python - <<'EOF'\n{python}EOF\n")
    command = " ".join(map(shlex.quote, [*words, *said, "--out", OUT]))
    return SourceCode(python, f"{command}\n")


def _footage_options(footage: Footage, recording: str) -> list[str] | None:
    """Return the options that say what a plan does of its recording; None where only the plan itself can say it."""
    mark = footage.mark
    if footage.truth or (mark is not None and mark.get("kind") != "box"):
        return None
    box = [] if mark is None else ["--box", ",".join(str(mark[name]) for name in ("x", "y", "width", "height"))]
    return ["--video", recording, *box, "--start", str(footage.start)]


def _python(plan: Plan, recording: str) -> str:
    told = "".join(f"        {key!r}: {value!r},\n" for key, value in plan.as_dict().items() if value is not None)
    names = "Plan, Recording, carry_out, summary" if recording else "Plan, carry_out, summary"
    return (
        f"from pathlib import Path\n\nfrom pftrack.sweep import {names}\n\n"
        f'if __name__ == "__main__":  # its processes import this file\n'
        f"    plan = Plan.from_dict({{\n{told}    }})\n"
        f'    result = carry_out(plan, Path("{OUT}"), jobs=2{recording})\n'
        f"    print(summary(result))\n"
    )
