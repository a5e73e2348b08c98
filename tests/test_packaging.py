"""What is installed holds all that is needed: the commands, the pages, and nothing that is not ours."""

import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import av
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

import pftrack
from tools.release import check_contents

ROOT = Path(__file__).parents[1]


def test_the_version_is_stated_once() -> None:
    """The version of the package is the version of its metadata, and of how to cite it."""
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert declared == pftrack.__version__
    assert f"\nversion: {declared}\n" in (ROOT / "CITATION.cff").read_text()


def test_the_entry_points_exist() -> None:
    """`pftrack` is a console script, and `serve` is a command that the server adds."""
    (script,) = metadata.entry_points(group="console_scripts", name="pftrack")
    assert callable(script.load())
    (serve,) = metadata.entry_points(group="pftrack.commands", name="serve")
    assert callable(serve.load())


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
    """It has every module and page of the source, nothing else, and what the project states; `make release` uses it."""
    build = [sys.executable, "-m", "build", "--no-isolation", "--wheel", "--outdir", str(tmp_path), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    check_contents(wheel)


# The floors of the dependencies: no version with a known hole may be installed.

PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
REQUIRED = {
    found.name: found
    for found in map(Requirement, [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["cluster"]])
}
LAST_WITH_A_HOLE = {
    "av": "18.0.99",
    "fonttools": "4.60.99",
    "h11": "0.15.0",
    "jinja2": "3.1.5",
    "opencv-python-headless": "4.13.0.92",
    "pillow": "12.99",
    "pyarrow": "23.0.0",
    "python-multipart": "0.0.26",
    "starlette": "1.3.0",
    "tornado": "6.5.7",
    "viser": "1.0.99",
}
"""The newest affected version of each package, by name; pyproject.toml names the advisories."""
FFMPEG = Version("8.1.2")
"""The first without the known writes out of bounds in its decoders."""


@pytest.mark.parametrize("name", REQUIRED)
def test_floors_exist_and_exclude_versions_with_holes(name: str) -> None:
    """The installed version of each dependency is allowed; one with a known hole, and any older one, is not."""
    allowed, installed = REQUIRED[name].specifier, metadata.version(name)
    assert allowed.contains(installed, prereleases=True), f"{name} {installed}"
    if name in LAST_WITH_A_HOLE:
        assert not allowed.contains(LAST_WITH_A_HOLE[name])
        floors = [Version(each.version) for each in allowed if each.operator == ">="]
        assert max(floors) > Version(LAST_WITH_A_HOLE[name])


def test_holes_are_those_of_dependencies() -> None:
    """Every version with a hole is of a package that the project asks for."""
    assert LAST_WITH_A_HOLE.keys() <= REQUIRED.keys()


def test_the_decoder_of_films() -> None:
    """The FFmpeg that decodes uploads is one without known holes, whatever the version of its wrapper is."""
    assert Version(av.ffmpeg_version_info.split("-")[0]) >= FFMPEG
