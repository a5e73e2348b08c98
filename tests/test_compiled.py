import os
import time
from pathlib import Path

from pftrack.compiled import forget_stale


def test_what_was_compiled_before_a_file_changed_is_forgotten(tmp_path: Path) -> None:
    """A function of another file may have the changed one inside; what is newer than every change stays."""
    caches = tmp_path / "filters" / "__pycache__"
    caches.mkdir(parents=True)
    now = time.time_ns()
    for place, (name, age_s) in enumerate((("old", 20), ("new", 1))):
        source, cache = caches.parent / f"{name}.py", caches / f"{name}.step-{place}.py311.nbi"
        for path in (source, cache):
            path.touch()
        os.utime(source, ns=(now, now - 10 * 10**9))
        os.utime(cache, ns=(now, now - age_s * 10**9))
    (caches / "data.nbc").touch()
    forget_stale(tmp_path)
    assert sorted(path.name for path in caches.iterdir()) == ["data.nbc", "new.step-1.py311.nbi"]


def test_a_file_without_compiled_functions_does_not_matter(tmp_path: Path) -> None:
    """Only files that own compiled functions count, so that editing a page of text costs nothing."""
    caches = tmp_path / "__pycache__"
    caches.mkdir()
    for path in (tmp_path / "loop.py", caches / "loop.step-1.py311.nbi", tmp_path / "text.py"):
        path.touch()
    os.utime(tmp_path / "loop.py", (0, 0))
    future = time.time() + 100
    os.utime(tmp_path / "text.py", (future, future))
    forget_stale(tmp_path)
    assert (caches / "loop.step-1.py311.nbi").exists()


def test_an_empty_package_is_no_problem(tmp_path: Path) -> None:
    """Before anything was compiled there is nothing to forget."""
    forget_stale(tmp_path)
