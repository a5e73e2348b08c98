"""Settings that keep a run's numbers from depending on the machine, and a description of the machine for its file.

A run should have the same bits on every x86-64 processor with AVX2 (and FMA, which came with it: from 2013 on). Three
libraries would choose their instructions by the processor:

- Numba compiles for the host: wider vectors, other fused operations, Intel's vector mathematics where it is installed.
  Here it compiles for one processor, Haswell, everywhere. Compiled code may not be reordered, so another version of the
  compiler gives the same numbers (`pftrack.core.numerics.compiled`).
- OpenCV's Intel primitives have code of their own for AVX-512, which gives other last digits in resizing and
  correlation; they are limited to the code for AVX2. OpenCV's own dispatch does not matter for the functions that are
  used here.
- NumPy's transcendental functions and the BLAS below `@` and `numpy.linalg` differ by processor and cannot be limited.
So everything that affects states uses `pftrack.core.numerics.elementary` and `pftrack.core.numerics.matrices`.

What remains is the C library: `log`, `exp`, `sin`, `cos` and the like of glibc 2.28 or newer have one variant for all
processors with FMA. Without AVX2 everything still runs, with numbers that repeat on that machine only.

The libraries read their settings from the environment when they are loaded, and child processes inherit it. So this
module is imported before any of them, by `pftrack` itself, and it must not import them. A program that imports Numba
before `pftrack` compiles again for the host, with the same numbers.
"""

import functools
import os
import platform
import sys
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

PACKAGE = Path(__file__).parents[2]
PRECOMPILED = PACKAGE / "precompiled"
"""Compiled code in a release; a checkout has none."""

SETTINGS = {
    "NUMBA_CPU_NAME": "haswell",
    "NUMBA_CPU_FEATURES": "",
    "NUMBA_DISABLE_INTEL_SVML": "1",
    "OPENCV_IPP": "avx2",
}
"""Numba's features follow from its processor, not from the host."""

NEEDED = frozenset({"avx2", "fma"})
LIBRARIES = {"numba": "numba", "llvmlite": "llvmlite", "numpy": "numpy", "opencv": "opencv-python-headless"}


def settle() -> None:
    """Set the environment so that libraries loaded from now on give the same numbers on all processors with AVX2."""
    if is_capable():
        os.environ.update(SETTINGS)


@functools.cache
def is_capable() -> bool:
    """Return whether this processor is one of those on which all numbers are the same."""
    features = _processor()[1]
    # Where the system does not report them, as on macOS, every x86-64 that still gets updates has them.
    return platform.machine() in {"x86_64", "AMD64"} and (not features or features >= NEEDED)


@functools.cache
def describe_platform() -> Mapping[str, str]:
    """Return what a run is computed on, for its file: processor, compiled target, and the libraries' versions."""
    name, features = _processor()
    wide = sorted(it for it in features if it.startswith(("avx", "fma", "sse4")))
    return {
        "processor": name,
        "features": " ".join(wide),
        "target": SETTINGS["NUMBA_CPU_NAME"] if is_capable() else "this processor",
        "system": f"{platform.system()} {platform.machine()}, {' '.join(platform.libc_ver()).strip() or 'C library'}",
        "python": ".".join(map(str, sys.version_info[:3])),
        **{title: metadata.version(package) for title, package in LIBRARIES.items()},
    }


@functools.cache
def _processor() -> tuple[str, frozenset[str]]:
    """Return name and features of the processor, as far as the system reports them."""
    told: dict[str, str] = {}
    try:
        with Path("/proc/cpuinfo").open(encoding="utf-8", errors="replace") as lines:
            for line in lines:
                key, _, value = line.partition(":")
                told.setdefault(key.strip(), value.strip())
                if not line.strip():  # the first of its cores is enough
                    break
    except OSError:
        return platform.processor() or platform.machine(), frozenset()
    return told.get("model name") or platform.machine(), frozenset(told.get("flags", "").split())
