"""The floors of the dependencies: no version with a hole that is known may be installed."""

import tomllib
from importlib import metadata
from pathlib import Path

import av
import pytest
from packaging.requirements import Requirement
from packaging.version import Version

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
"""By name, the newest version of which an advisory says that it is affected; pyproject.toml names the advisories."""
FFMPEG = Version("8.1.2")
"""The first without the known writes out of bounds in its decoders."""


@pytest.mark.parametrize("name", REQUIRED)
def test_what_is_installed_is_what_is_asked_for(name: str) -> None:
    """Every dependency is installed in a version that the project allows, so that its floor is one that exists."""
    installed = metadata.version(name)
    assert REQUIRED[name].specifier.contains(installed, prereleases=True), f"{name} {installed}"


@pytest.mark.parametrize("name", LAST_WITH_A_HOLE)
def test_versions_with_holes_are_excluded(name: str) -> None:
    """No version with a hole that is known can be installed beside the project."""
    assert not REQUIRED[name].specifier.contains(LAST_WITH_A_HOLE[name])


@pytest.mark.parametrize("name", LAST_WITH_A_HOLE)
def test_every_floor_is_a_floor(name: str) -> None:
    """Older versions than the last with a hole are excluded as well."""
    floors = [Version(each.version) for each in REQUIRED[name].specifier if each.operator == ">="]
    assert floors
    assert max(floors) > Version(LAST_WITH_A_HOLE[name])


def test_the_decoder_of_films() -> None:
    """The FFmpeg that decodes uploads is one without known holes, whatever the version of its wrapper is."""
    assert Version(av.ffmpeg_version_info.split("-")[0]) >= FFMPEG
