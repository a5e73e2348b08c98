"""Compile all compiled functions, for a release that includes them.

`python -m tools.precompile FOLDER` fills a folder with the package's code compiled by this machine's Python, Numba and
llvmlite, in the form that `pftrack.core.numerics.compiled` reads, and with the list of experiments that it covers. A
wheel built with `PFTRACK_PRECOMPILED=FOLDER` contains it (`tools/build_hook.py`).
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

__all__ = ["collect", "main"]


def main(destination: Path) -> None:
    """Compile into a separate cache, in a new process, and copy the result."""
    with tempfile.TemporaryDirectory() as cache:
        program = f"from tools.precompile import compile_all; compile_all({str(destination)!r})"
        subprocess.run(  # noqa: S603
            [sys.executable, "-c", program], check=True, env={**os.environ, "NUMBA_CACHE_DIR": cache}
        )


def compile_all(destination: str) -> None:
    """Compile all functions into Numba's cache folder, which the environment names, and copy the result.

    Raises:
        RuntimeError: An experiment does not run, or compiled functions are missing.
    """
    from pftrack.doctor.warming import Warming  # noqa: PLC0415
    from pftrack.experiments import EXPERIMENTS  # noqa: PLC0415 - they read the environment when they are loaded

    done = Warming(EXPERIMENTS.own, low_priority=False).wait()
    if done.failed:
        raise RuntimeError(f"not all can be compiled: {dict(done.failed)}")
    copied = collect(Path(destination))
    if copied < done.done:
        raise RuntimeError(f"{copied} of {done.done} compiled functions were found: is pftrack installed twice?")


def collect(destination: Path) -> int:
    """Copy the compiled code of all functions of experiments that are known to be compiled.

    Args:
        destination: A folder, which is emptied first.

    Returns:
        Number of functions with compiled code.
    """
    from pftrack.core.numerics.compiled import FUNCTIONS, precompiled_folder  # noqa: PLC0415
    from pftrack.core.numerics.machine import PACKAGE, PRECOMPILED  # noqa: PLC0415
    from pftrack.doctor.memory import memory_folder  # noqa: PLC0415
    from pftrack.experiments import EXPERIMENTS  # noqa: PLC0415

    dict(EXPERIMENTS)  # imports them, and with them what they call
    shutil.rmtree(destination, ignore_errors=True)
    copied = 0
    for function in FUNCTIONS:
        folder = precompiled_folder(Path(function.py_func.__code__.co_filename))
        if folder is None or not function.py_func.__module__.startswith(f"{PACKAGE.name}."):
            continue
        place = destination / folder.relative_to(PRECOMPILED)
        place.mkdir(parents=True, exist_ok=True)
        name = function._cache._impl.filename_base  # noqa: SLF001 - Numba has no public name for it
        files = list(Path(function._cache.cache_path).glob(f"{name}.*"))  # noqa: SLF001
        for file in files:
            shutil.copy(file, place)
        copied += bool(files)
    memory = memory_folder()
    if memory is not None and memory.exists():
        shutil.copytree(memory, destination / memory.name)
    return copied


if __name__ == "__main__":
    main(Path(sys.argv[1]))
