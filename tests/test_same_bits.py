"""Every run has the same bits on every x86-64 processor with AVX2, whatever its libraries would choose."""

import ast
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__

from pftrack.core.numerics import machine
from tests import same_bits

ROOT = Path(__file__).parents[1]
STORED: dict[str, str] = json.loads((ROOT / "tests/data/same_bits.json").read_text())

WIDE = " ".join(name for name in __cpu_dispatch__ if "AVX512" in name or name == "X86_V4")
"""What NumPy has for AVX-512."""

OTHER_PROCESSORS: dict[str, str] = {
    "NUMBA_CPU_NAME": "znver4",
    "NUMBA_CPU_FEATURES": "+avx512f,+avx512vl",
    "OPENBLAS_CORETYPE": "Prescott",
    "OPENBLAS_NUM_THREADS": "2",
    "NPY_DISABLE_CPU_FEATURES": WIDE,
    "OPENCV_CPU_DISABLE": "AVX512-SKX",
    "OPENCV_IPP": "sse42",
}
"""Other processors asked of every library."""

ALONE: dict[str, dict[str, str]] = {
    "all of them": OTHER_PROCESSORS,
    "NUMBA_CPU_NAME=haswell": {"NUMBA_CPU_NAME": "haswell"},
    "BLAS for Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "BLAS for Prescott": {"OPENBLAS_CORETYPE": "Prescott"},
    "NumPy without AVX-512": {"NPY_DISABLE_CPU_FEATURES": WIDE},
    "OpenCV without AVX-512": {"OPENCV_CPU_DISABLE": "AVX512-SKX"},
    "OpenCV without Intel's primitives": {"OPENCV_IPP": "disabled"},
    "the C library without wide vectors": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX512F,-AVX512VL"},
}

pytestmark = pytest.mark.skipif(not machine.is_capable(), reason="numbers are the same on x86-64 with AVX2")


def hashes(settings: Mapping[str, str]) -> dict[str, str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **settings}
    command = [sys.executable, str(ROOT / "tests/same_bits.py")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    found: dict[str, str] = json.loads(done.stdout)
    return found


def test_every_case_has_the_stored_numbers() -> None:
    assert same_bits.hashes() == STORED


@pytest.mark.slow
@pytest.mark.parametrize("settings", ALONE.values(), ids=ALONE)
def test_no_library_decides(settings: Mapping[str, str]) -> None:
    """Every tracker, choice and switch has the stored numbers with all libraries so, and with each alone."""
    assert hashes(settings) == STORED


@pytest.mark.slow
@pytest.mark.parametrize("target", ["x86-64-v3", "znver3", "nehalem"])
def test_the_compiler_has_no_freedom(target: str, tmp_path: Path) -> None:
    """Code that is compiled for another processor computes the same: no operation is reordered or fused."""
    assert hashes({"COMPILE_FOR": target, "NUMBA_CACHE_DIR": str(tmp_path)}) == STORED


COMPUTING = ["filters", "sources", "vision", "experiments", "core/geometry.py"]
COMPUTING += ["core/numerics/matrices.py", "core/numerics/random.py"]

SHOWING = {"draw.py", "drawing.py", "exports.py", "experiment.py", "recording.py", "rendering.py", "model_files.py"}
SHOWING |= {"vector.py", "sketch.py", "quality.py", "loss_probability.py", "example_filter.py"}
WITH_TRACKERS = {f"experiments/{family}/experiment.py" for family in ("histogram", "prism", "sine")}
"""Files whose numbers are shown, or lie before a run, and are not part of a state; and those of them that hold
trackers, too."""

BY_PROCESSOR = {
    *("exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "logaddexp", "power", "float_power", "cbrt"),
    *("tan", "arcsin", "arccos", "arctan", "arctan2", "sinh", "cosh", "tanh", "arcsinh", "arccosh", "arctanh"),
    *("dot", "vdot", "inner", "matmul", "tensordot", "einsum", "linalg", "cov", "corrcoef", "polyfit"),
}
"""What NumPy computes by the processor, or leaves to a BLAS that does."""

REPORTS = {
    ("experiments/shared/sampling.py", "log"): "compiled, though not by its decorator",
    ("experiments/shared/pose/methods.py", "exp"): "a share for the screen",
    ("experiments/own/extension.py", "exp"): "a filter in a person's file",
    ("experiments/histogram/experiment.py", "@"): "colours of what is drawn",
    ("experiments/prism/experiment.py", "@"): "a drawing",
    ("vision/face.py", "arctan2"): "angles as a person would say them, for the screen",
    ("vision/face.py", "arcsin"): "angles as a person would say them, for the screen",
}
"""Where that is not a part of a state, and why."""


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT / "pftrack"))


def computing() -> Iterator[Path]:
    for room in COMPUTING:
        place = ROOT / "pftrack" / room
        files = sorted(place.rglob("*.py")) if place.is_dir() else [place]
        yield from (path for path in files if path.name not in SHOWING or name_of(path) in WITH_TRACKERS)


def interpreted(tree: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a module without those of compiled functions, which have the C library's functions."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef) and any(is_name(it, "compiled") for it in node.decorator_list):
            continue
        yield node
        yield from interpreted(node)


def test_states_use_nothing_that_differs_by_processor() -> None:
    """States use `matrices` and `elementary` of `pftrack.core.numerics`, no BLAS and no transcendental NumPy."""
    found = [f"{path.relative_to(ROOT)}:{line} {what}" for path in computing() for line, what in differing(path)]
    assert found == []


def differing(path: Path) -> Iterator[tuple[int, str]]:
    """Yield each line of a file that may come to other bits on another processor, with what does so there."""
    text, name = path.read_text(encoding="utf-8"), name_of(path)
    tree, lines = ast.parse(text), text.splitlines()
    for node in ast.walk(tree):
        if isinstance(getattr(node, "op", None), ast.MatMult) and (name, "@") not in REPORTS:
            yield node.lineno, "has @; use pftrack.core.numerics.matrices.product"  # type: ignore[attr-defined]
    for node in interpreted(tree):
        if isinstance(node, ast.Attribute) and is_name(node.value, "np") and node.attr in BY_PROCESSOR:
            if (name, node.attr) not in REPORTS and node.attr != "linalg":
                yield node.lineno, f"uses np.{node.attr}"
        elif isinstance(node, ast.Attribute) and is_linalg(node.value):
            if node.attr != "LinAlgError" and not (node.attr == "norm" and "axis=" in lines[node.lineno - 1]):
                yield node.lineno, f"uses np.linalg.{node.attr}"
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            whole = isinstance(node.left, ast.Constant) or ast.unparse(node.right) in {"2", "2.0", "-1"}
            if not whole and name != "filters/learning/online_em.py":
                yield node.lineno, f"has {ast.unparse(node)}"


def is_name(node: ast.expr, name: str) -> bool:
    return isinstance(node, ast.Name) and node.id == name


def is_linalg(node: ast.expr) -> bool:
    return isinstance(node, ast.Attribute) and node.attr == "linalg" and is_name(node.value, "np")
