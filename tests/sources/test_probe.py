"""Probing: whatever a stranger's file does to its decoder, the answer is a `Probe` or one sentence."""

import concurrent.futures
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from pftrack.sources import probe as module
from pftrack.sources.probe import probe
from pftrack.sources.sequence import Limits, SourceError, open_sequence

Draw = Callable[..., NDArray[np.uint8]]


def stand_in(path: Path, body: str) -> str:
    """Write an interpreter that does as told instead of probing."""
    path.write_text(f"#!/bin/sh\ncat >/dev/null\n{body}\n", encoding="ascii")
    path.chmod(0o755)
    return str(path)


@pytest.fixture
def endless(tmp_path: Path) -> Path:
    """A small GIF of 2,000 large pictures, which take long to unfold."""
    frames = [Image.new("P", (2000, 2000), colour) for colour in (0, 1)]
    for frame in frames:
        frame.putpalette([0, 0, 0, 255, 255, 255])
    path = tmp_path / "endless.gif"
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=50)
    content = path.read_bytes()
    second = content.rindex(b"\x21\xf9\x04")  # where the second picture's control block begins
    path.write_bytes(content[:second] + content[second:-1] * 2000 + b";")
    return path


def test_a_probe_tells_what_a_survey_finds(clip: Path) -> None:
    """A good file gives the same name, numbers, digest and warnings as opening it would."""
    found, sequence = probe(clip), open_sequence(clip)
    assert (found.name, found.kind, found.frames) == ("clip.mp4", "video", 120)
    assert (found.width, found.height, found.frame_rate_hz) == (96, 64, 25.0)
    assert found.duration_s == pytest.approx(4.8)
    assert found.sha256 == sequence.sha256
    assert found.warnings == ()
    assert found.index == sequence.index


def test_a_probed_file_opens_at_once(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The probe's index spares the survey to whoever opens the file next."""
    index = probe(clip).index
    monkeypatch.setattr("pftrack.sources.video.VideoSequence._survey", None)
    assert open_sequence(clip, index=index).picture(100).shape == (64, 96, 3)


def test_folders_and_animations_are_probed_too(tmp_path: Path, make_picture: Draw) -> None:
    """Folders of pictures and animated GIFs are told from videos."""
    images = [Image.fromarray(make_picture(number)) for number in range(3)]
    for number, image in enumerate(images):
        image.save(tmp_path / f"{number}.png")
    assert (probe(tmp_path).kind, probe(tmp_path).frames) == ("images", 3)
    images[0].save(tmp_path / "a.gif", save_all=True, append_images=images[1:], duration=40)
    assert (probe(tmp_path / "a.gif").kind, probe(tmp_path / "a.gif").frames) == ("gif", 3)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "the file is empty"),
        (b"ffconcat version 1.0\nfile clip.mp4\n", "a list of other files"),
        (b"#EXTM3U\nclip.mp4\n", "a playlist of other files"),
        (b"<html>", "a web page"),
        (b"\x00\x00\x00\x18ftypmp42" + bytes(100), "broken or cut short"),
    ],
)
def test_a_refusal_comes_through(tmp_path: Path, content: bytes, sentence: str) -> None:
    """What opening would refuse is refused with the same sentence, without a path."""
    path = tmp_path / "a.mp4"
    path.write_bytes(content)
    with pytest.raises(SourceError, match=sentence) as refusal:
        probe(path)
    assert str(tmp_path) not in str(refusal.value)


def test_limits_come_through(clip: Path) -> None:
    """The limits of size hold in the process as they do here."""
    with pytest.raises(SourceError, match="at most 100 are allowed"):
        probe(clip, Limits(frames=100))


def test_any_name_may_be_probed(clip: Path, tmp_path: Path) -> None:
    """Names that look like options, addresses or no text at all are just names."""
    for name in ("-c import os", "http:x?y#z", "a\udcff\n.mp4"):
        path = clip.rename(tmp_path / name)
        assert probe(path).frames == 120
        clip = path


# ---------------------------------------------------------------- harm


def test_a_decoder_without_end_runs_out_of_processor_time(endless: Path) -> None:
    """A file that keeps its decoder busy is given up after the processor time allowed."""
    with pytest.raises(SourceError, match="takes more than the 1 s of processor time that are allowed"):
        probe(endless, cpu_seconds=1)


def test_a_decoder_without_end_runs_out_of_time(endless: Path) -> None:
    """A file that takes long is given up after the time allowed."""
    with pytest.raises(SourceError, match=r"takes longer than the 0\.5 s that are allowed"):
        probe(endless, wall_seconds=0.5)


def test_a_probe_may_be_stopped(endless: Path) -> None:
    """Who asks may give up, and the process is gone at once."""
    begun = time.monotonic()
    with pytest.raises(SourceError, match="stopped before it came to an end"):
        probe(endless, stopped=lambda: time.monotonic() > begun + 1.0)
    assert time.monotonic() < begun + 5.0


def test_a_memory_bomb_is_told(endless: Path) -> None:
    """A file that unfolds to more memory than allowed is refused by saying so."""
    with pytest.raises(SourceError, match="needs more than the 20 MiB of memory that are allowed"):
        probe(endless, memory_bytes=20 * 1024**2)


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ("kill -SEGV $$", "makes the decoder crash"),
        ("kill -ABRT $$", "makes the decoder crash"),
        ("kill -KILL $$", "ended by the system, which may be short of memory"),
        ("exit 1", "makes the decoder crash"),
        ("exit 0", "makes the decoder crash"),
        ("echo nonsense", "makes the decoder crash"),
        ('echo \'{"index": {"kind": "video"}}\'', "makes the decoder crash"),
        ("head -c 20000000 /dev/zero", "makes the decoder crash"),
        ("exec sleep 30", "takes longer than the 1 s"),
    ],
)
def test_a_process_that_goes_wrong_becomes_a_sentence(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, body: str, sentence: str
) -> None:
    """A crash, silence, nonsense, a flood or a hang of the process is told in one sentence."""
    monkeypatch.setattr(module.sys, "executable", stand_in(tmp_path / "python", body))
    with pytest.raises(SourceError, match=sentence):
        probe(clip, wall_seconds=1 if "sleep" in body else 60)


def test_the_process_knows_no_secrets(clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The environment of this process, where tokens and passwords may be, is not handed on."""
    monkeypatch.setenv("PFTRACK_TOKEN", "secret")
    seen = tmp_path / "environment"
    monkeypatch.setattr(module.sys, "executable", stand_in(tmp_path / "python", f"env >{seen}"))
    with pytest.raises(SourceError):
        probe(clip)
    assert "PYTHONPATH" in seen.read_text()
    assert "secret" not in seen.read_text()


def test_the_process_limits_itself(tmp_path: Path) -> None:
    """The process gives up memory, processor time, files, core dumps and long writes before it looks at a file."""
    program = (
        "import json, resource; from pathlib import Path; from pftrack.sources import probe as m\n"
        "m._limit(m._Question('', m.Limits(), 2**28, 7, 9.5))\n"
        "names = ['AS', 'CPU', 'FSIZE', 'NOFILE', 'CORE']\n"
        "print(json.dumps({n: resource.getrlimit(getattr(resource, 'RLIMIT_' + n)) for n in names}))"
    )
    root = str(Path(module.__file__).parents[2])
    result = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, check=True, env={**os.environ, "PYTHONPATH": root}
    )
    limits = json.loads(result.stdout)
    assert 2**28 < limits["AS"][1] < 2**28 + 2**31
    assert 7 <= limits["CPU"][0] < 15
    assert limits["FSIZE"] == [8 * 1024**2] * 2
    assert limits["NOFILE"] == [64, 64]
    assert limits["CORE"] == [0, 0]


def test_no_decoder_is_loaded_here(clip: Path) -> None:
    """Probing loads no decoder into the process that asks."""
    program = (
        "import sys; from pathlib import Path; from pftrack.sources.probe import probe\n"
        f"assert probe(Path({str(clip)!r})).frames == 120\n"
        "print([name for name in ('av', 'PIL', 'cv2') if name in sys.modules])"
    )
    root = str(Path(module.__file__).parents[2])
    result = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, check=True, env={**os.environ, "PYTHONPATH": root}
    )
    assert result.stdout.strip() == b"[]"


def test_many_threads_may_probe_at_once(clip: Path, tmp_path: Path) -> None:
    """Probing works from several threads at once, and leaves no process and no descriptor behind."""
    broken = tmp_path / "broken.mp4"
    broken.write_bytes(b"<html>")

    def frames(path: Path) -> int:
        try:
            return probe(path).frames
        except SourceError:
            return -1

    before = len(list(Path("/proc/self/fd").iterdir()))
    with concurrent.futures.ThreadPoolExecutor(3) as pool:
        assert list(pool.map(frames, [clip, broken] * 3)) == [120, -1] * 3
    assert len(list(Path("/proc/self/fd").iterdir())) == before
