"""Clips that several tests of recordings read."""

from pathlib import Path

import pytest

from tests.sources.films import film, numbers


@pytest.fixture(scope="session")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two long groups of H.264 with B-frames: 120 frames, keyframes at 0 and 70."""
    options = {"x264-params": "scenecut=0:b-adapt=0"}
    return film(tmp_path_factory.mktemp("clip") / "clip.mp4", numbers(120), group=70, codec_options=options)


@pytest.fixture
def real_clips() -> Path:
    """The real clips, beside the repository."""
    folder = Path(__file__).parents[2] / ".." / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("the real clips are not beside this repository")
    return folder
