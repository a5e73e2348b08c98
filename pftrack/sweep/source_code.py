"""What computes a sweep again: a few lines of Python, and a command."""

import shlex

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
    words += ["--seed", str(plan.seed)]
    for name, value in plan.values.items():
        words += ["--set", f"{name}={value}"]
    command = " ".join(map(shlex.quote, [*words, "--out", OUT]))
    if recording is None:
        return SourceCode(_python(plan, ""), f"{command}\n")
    # Only the plan knows mark and truth as they were given.
    where = f', recording=Recording("{recording}")'
    return SourceCode(_python(plan, where), f"python - <<'EOF'\n{_python(plan, where)}EOF\n")


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
