"""Checks of pftrack's requirements on this machine, with remedies.

Each check gives one sentence and a status: `ok`, `warning` if something optional is missing, or `broken` if pftrack
will not work.
"""

import os
import re
import shutil
import socket
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from importlib import import_module, metadata
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from pftrack.core.entry_points import find
from pftrack.doctor.memory import existing, writable

if TYPE_CHECKING:
    from pftrack.experiments.experiment import Experiment


DEFAULT_DATA_DIR = "~/.local/share/pftrack"
LEAST_MEMORY_MIB = 512
COMFORTABLE_MEMORY_MIB = 2048
BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")

Status = Literal["ok", "warning", "broken"]


@dataclass(frozen=True)
class Check:
    """One check."""

    name: str
    status: Status
    found: str
    seconds: Mapping[str, float] = field(default_factory=dict)

    def as_dict(self) -> dict[str, object]:
        """Return the check as JSON shows it; `seconds` is how long each function took that was compiled now."""
        return {key: value for key, value in asdict(self).items() if key != "seconds" or value}


def examine(*, port: int = 8000, data_dir: Path | None = None, warm: bool = False) -> list[Check]:
    """Look at everything that pftrack needs.

    Args:
        port: The port that the server is to use.
        data_dir: The folder that the server is to use.
        warm: Whether to run every tracker of every experiment, which compiles all that is compiled.
    """
    looks: dict[str, Callable[[], tuple[Status, str] | Check]] = {
        "Python": _python,
        "libraries": _libraries,
        "compiled code": lambda: _compilation(everything=warm),
        "experiments": lambda: _experiments(everything=warm),
        "video": _codecs,
        "pages": _pages,
        "data folder": lambda: _data_folder(data_dir),
        "port": lambda: _port(port),
        "memory": _memory,
        "browser": _browser,
    }
    return [_check(name, look) for name, look in looks.items()]


def _check(name: str, look: Callable[[], tuple[Status, str] | Check]) -> Check:
    try:
        found = look()
        return found if isinstance(found, Check) else Check(name, *found)
    except Exception as error:  # noqa: BLE001 - whatever is broken here is what the doctor was asked for
        return Check(name, "broken", _one_line(error))


def _one_line(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0]


def _python() -> tuple[Status, str]:
    version = ".".join(map(str, sys.version_info[:3]))
    return ("ok" if sys.version_info >= (3, 11) else "broken"), f"{version}; 3.11 or newer is needed"


def _libraries() -> tuple[Status, str]:
    wrong = []
    needed = [text for text in metadata.requires("pftrack") or () if "extra ==" not in text]
    for text in needed:
        name = re.split(r"[\s<>=!~\[;]", text, maxsplit=1)[0]
        try:
            found = metadata.version(name)
        except metadata.PackageNotFoundError:
            wrong.append(f"{name} is missing")
            continue
        bounds = re.findall(r"(>=|<)\s*([\d.]+)", text.split(";")[0])
        if not all((_numbers(found) >= _numbers(bound)) == (sign == ">=") for sign, bound in bounds):
            wrong.append(f"{name} is {found}, {' and '.join(sign + bound for sign, bound in bounds)} is needed")
    if wrong:
        return "broken", "; ".join(wrong)
    return "ok", f"{len(needed)} libraries in the versions needed"


def _numbers(version: str) -> tuple[int, ...]:
    """Turn 4.14.0 into (4, 14): trailing zeros are ignored."""
    parts = [int(part) for part in re.findall(r"\d+", re.split(r"[^\d.]", version)[0])]
    while parts and parts[-1] == 0:
        parts.pop()
    return tuple(parts)


def _compilation(*, everything: bool) -> Check:
    """Run the default tracker of each experiment, or have all compiled that is."""
    from pftrack.core.numerics.compiled import FUNCTIONS, count_precompiled
    from pftrack.doctor.memory import cache_folder
    from pftrack.doctor.warming import Warming
    from pftrack.experiments import EXPERIMENTS

    if everything:
        compiled = Warming(EXPERIMENTS.own, low_priority=False).wait()
        if compiled.failed:
            return Check(
                "compiled code", "broken", "; ".join(f"{name}: {why}" for name, why in compiled.failed.items())
            )
        what = f"{len(compiled.seconds)} functions compiled now, in {compiled.elapsed_s:.0f} s"
        seconds = dict(sorted(compiled.seconds.items(), key=lambda item: -item[1]))
    else:
        what = f"{sum(_run_default(EXPERIMENTS[name]) for name in EXPERIMENTS.own)} trackers ran"
        seconds = {}
    place, brought = cache_folder(), count_precompiled()
    if brought:
        what = f"{what}; {brought} of {len(FUNCTIONS)} functions came compiled with the package"
    if place is None:
        found = f"{what}, but no folder to keep more in: every start compiles it again; set NUMBA_CACHE_DIR"
        return Check("compiled code", "warning", found, seconds)
    return Check("compiled code", "ok", f"{what}; kept in {place}", seconds)


def _experiments(*, everything: bool) -> tuple[Status, str]:
    """Check the experiments of other packages; a broken one affects nothing else, so it is a warning."""
    from pftrack.doctor.warming import Warming
    from pftrack.experiments import EXPERIMENTS

    problems, added = [], []
    for plugin in EXPERIMENTS.plugins:
        if plugin.reason:
            problems.append(plugin.report)
            continue
        try:
            _run_default(EXPERIMENTS[plugin.name])
            reason = Warming([plugin.name]).wait().failed.get(plugin.name) if everything else None
        except Exception as error:  # noqa: BLE001 - what foreign code may raise is open, and it is to be reported
            reason = _one_line(error)
        if reason:
            problems.append(f"The experiment {plugin.name} of {plugin.package} does not run: {reason}")
        else:
            added.append(f"{plugin.name} of {plugin.package}")
    if problems:
        return "warning", " ".join(problems)
    return "ok", f"{len(EXPERIMENTS.own)} of pftrack{', and ' if added else ''}{', '.join(added)}"


def _run_default(experiment: "Experiment") -> int:
    """Run some frames of the default tracker; return the number of trackers that ran."""
    from pftrack.doctor.compiling import run_case

    run_case(experiment, experiment.default_tracker, {})
    return 1


def _codecs() -> tuple[Status, str]:
    import av

    missing = [name for name in ("h264", "libx264", "hevc", "vp9", "mpeg4", "gif") if name not in av.codecs_available]
    if missing:
        return "broken", f"PyAV {av.__version__} lacks {', '.join(missing)}"
    return "ok", f"PyAV {av.__version__} reads and writes H.264"


def _pages() -> tuple[Status, str]:
    plugin = find("pftrack.commands", "serve")
    if plugin is None:
        return "broken", "the command serve is not installed; reinstall pftrack with pip"
    plugin.load()
    place: Path = import_module(f"{plugin.module.partition('.')[0]}.core.frontend").FRONTEND
    if not (place / "gallery" / "gallery.html").is_file():
        return "broken", "the pages are missing; reinstall pftrack with pip"
    return "ok", f"{sum(1 for it in islice(place.rglob('*'), 10_000) if it.is_file())} files"


def _data_folder(given: Path | None) -> tuple[Status, str]:
    place = (given or Path(os.environ.get("PFTRACK_DATA_DIR") or DEFAULT_DATA_DIR)).expanduser().absolute()
    if not writable(place):
        return "broken", f"{place} cannot be written; choose another with --data-dir or PFTRACK_DATA_DIR"
    free = shutil.disk_usage(existing(place)).free // 1024**2
    return ("warning" if free < LEAST_MEMORY_MIB else "ok"), f"{place}, {free:,} MiB free"


def _port(port: int) -> tuple[Status, str]:
    with socket.socket() as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind(("127.0.0.1", port))
        except OSError:
            return "warning", f"{port} is in use; serve with another --port"
    return "ok", f"{port} is free"


def _memory() -> tuple[Status, str]:
    import psutil

    free = psutil.virtual_memory().available // 1024**2
    status: Status = "broken" if free < LEAST_MEMORY_MIB else "warning" if free < COMFORTABLE_MEMORY_MIB else "ok"
    return status, f"{free:,} MiB available; {LEAST_MEMORY_MIB} at least, {COMFORTABLE_MEMORY_MIB:,} for many sessions"


def _browser() -> tuple[Status, str]:
    for name in BROWSERS:
        if place := shutil.which(name):
            return "ok", place
    return "warning", f"none of {', '.join(BROWSERS)}; only the browser tests need one here"
