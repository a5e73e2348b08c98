import os
import subprocess
import sys
from pathlib import Path

import pytest

from pftrack.core.numerics import machine

ROOT = Path(__file__).parents[2]


def told(code: str, **environment: str) -> str:
    around = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    return subprocess.check_output([sys.executable, "-c", code], text=True, env=around).strip()


@pytest.mark.skipif(not machine.is_capable(), reason="settled on x86-64 with AVX2")
def test_the_compiler_is_settled_before_it_is_used() -> None:
    """What the environment asks of Numba is overridden, and it does without Intel's vector mathematics."""
    code = "import pftrack, numba; from numba.core.registry import cpu_target; numba.njit(lambda x: x)(1)"
    code += "; print(numba.config.CPU_NAME, repr(cpu_target.target_context.codegen()._tm_features)"
    code += ", numba.config.USING_SVML, numba.config.DISABLE_INTEL_SVML)"
    assert told(code, NUMBA_CPU_NAME="znver4", NUMBA_CPU_FEATURES="+avx512f") == "haswell '' False 1"


def test_what_a_run_is_computed_on_is_told() -> None:
    """Processor, target and the versions of what computes are there, each in a few words."""
    found = machine.describe_platform()
    assert set(found) >= {"processor", "features", "target", "system", "python", "numba", "llvmlite", "numpy", "opencv"}
    assert all(isinstance(value, str) and len(value) < 200 for value in found.values())


def test_an_unknown_processor_settles_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a processor without AVX2, or of another kind, the environment is left alone and everything still runs."""
    monkeypatch.setattr(machine, "_processor", lambda: ("old", frozenset({"sse2"})))
    machine.is_capable.cache_clear()
    monkeypatch.delenv("OPENCV_IPP", raising=False)
    machine.settle()
    assert "OPENCV_IPP" not in os.environ
    machine.is_capable.cache_clear()
