"""What is installed holds all that is needed: the commands, the pages, and nothing that is not ours."""

import subprocess
import sys
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import pftrack

ROOT = Path(__file__).parents[1]


def test_the_version_is_stated_once() -> None:
    """The version of the package is the version of its metadata."""
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert declared == pftrack.__version__


def test_the_entry_points_exist() -> None:
    """`pftrack` is a console script, and `serve` is a command that the server adds."""
    (script,) = metadata.entry_points(group="console_scripts", name="pftrack")
    assert callable(script.load())
    (serve,) = metadata.entry_points(group="pftrack.commands", name="serve")
    assert callable(serve.load())


def test_every_lint_rule_that_is_off_says_why() -> None:
    """Each line of an ignore list in pyproject.toml ends in a reason."""
    lines = (
        (ROOT / "pyproject.toml").read_text().split("[tool.ruff.lint]")[1].split("[tool.ruff.format]")[0].splitlines()
    )
    rules = [line for line in lines if line.startswith('    "')]
    assert rules
    assert all("#" in line and len(line.split("#")[1].strip()) > 5 for line in rules)


def test_every_version_that_is_installed_is_fixed() -> None:
    """`constraints.txt` names a version of all that pftrack needs, with its extras; `make lock` writes it anew."""
    lines = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if not line.startswith("#")]
    fixed: dict[str, list[Requirement]] = {}
    for line in map(Requirement, lines):
        fixed.setdefault(canonicalize_name(line.name), []).append(line)
    extras = metadata.metadata("pftrack").get_all("Provides-Extra") or []
    waiting = [Requirement(f"pftrack[{','.join(extras)}]")]
    seen = set()
    while waiting:
        wanted = waiting.pop()
        name = canonicalize_name(wanted.name)
        if name != "pftrack":
            here = [line for line in fixed.get(name, []) if line.marker is None or line.marker.evaluate()]
            assert len(here) == 1, f"{name} has no version in constraints.txt: run `make lock`"
            (version,) = here[0].specifier
            assert wanted.specifier.contains(version.version, prereleases=True), f"{wanted}: run `make lock`"
        seen.add((name, frozenset(wanted.extras)))
        try:
            needed = map(Requirement, metadata.requires(name) or [])
        except metadata.PackageNotFoundError:  # of an extra that is not installed
            continue
        for each in needed:
            key = canonicalize_name(each.name), frozenset(each.extras)
            asked = [""] if each.marker is None else ["", *wanted.extras]
            if key not in seen and (each.marker is None or any(each.marker.evaluate({"extra": it}) for it in asked)):
                waiting.append(each)


@pytest.mark.slow
def test_the_wheel_holds_library_server_and_pages(tmp_path: Path) -> None:
    """The wheel has every module and every page of the source, and nothing of tests or benchmarks."""
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(tmp_path), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        packed = set(archive.namelist())
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.split(
        "\n"
    )
    installed = {
        "pftrack/": "pftrack/",
        "server/pftrack_server/": "pftrack_server/",
        "frontend_static/": "pftrack_server/frontend_static/",
    }
    wanted = {
        place + name.removeprefix(folder)
        for name in tracked
        for folder, place in installed.items()
        if name.startswith(folder)
    }
    assert wanted - packed == set()
    assert {name.split("/")[0] for name in packed} == {
        "pftrack",
        "pftrack_server",
        f"pftrack-{pftrack.__version__}.dist-info",
    }
    assert not [name for name in packed if "__pycache__" in name]


@pytest.mark.slow
def test_an_installed_wheel_works_without_the_source(tmp_path: Path) -> None:
    """`pip install .` alone gives a working command line and server with its pages."""
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(tmp_path), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    place = tmp_path / "site"
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(place), str(wheel)]
    subprocess.run(install, check=True, capture_output=True)
    program = (
        f"import sys; sys.path.insert(0, {str(place)!r})\n"
        "import pftrack, pftrack_server; assert pftrack.__file__.startswith(sys.path[0]), pftrack.__file__\n"
        "from pftrack.doctor import examine\n"
        "wrong = [check for check in examine() if check.status == 'broken']\n"
        "assert not wrong, wrong\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=600
    )
    assert done.returncode == 0, done.stderr
