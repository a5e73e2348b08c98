import os

import pytest

from pftrack.core.numerics import machine


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
