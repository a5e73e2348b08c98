"""Probing: what a stranger's file does to its decoder harms the confined child alone, and one sentence says so."""

import asyncio
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from pftrack.core.model.source import FrameIndex
from pftrack.core.refusal import RefusedError
from pftrack.process import Budget
from pftrack.sources.limits import DEFAULT_LIMITS, Limits
from pftrack.sources.sequence import open_sequence
from pftrack_server.core.errors import ApiError
from pftrack_server.jobs.child_tasks import ChildTasks, Queues
from pftrack_server.uploads import intake as module
from pftrack_server.uploads.intake import BUDGET
from tests.apart import run
from tests.server import hostile
from tests.server.confined import ask
from tests.server.uploads.test_uploads import png, video

pytestmark = pytest.mark.usefixtures("nothing_is_left")

MEBIBYTE = 1024**2


def probe(
    path: Path,
    limits: Limits = DEFAULT_LIMITS,
    stopped: Callable[[], bool] = lambda: False,
    columns: dict[str, int] | None = None,
    **budget: Any,
) -> FrameIndex:
    """Probe a file within the usual budget, but for what is told."""
    wanted = Budget(**{name: getattr(BUDGET, name) for name in Budget.__slots__} | budget)
    return run(module.probe(ChildTasks(Queues()), path, limits, budget=wanted, columns=columns, stopped=stopped))


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("clips") / "clip.mp4"
    path.write_bytes(video())
    return path


def test_a_probe_tells_what_a_survey_finds(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A good file gives the same index as opening it would, and spares the next reader of the file the survey.

    The process that asks could not even open a file.
    """
    with closing(open_sequence(clip)) as sequence:
        survey = sequence.index
    monkeypatch.setattr("pftrack_server.jobs.functions.open_sequence", None)
    monkeypatch.setattr("pftrack.sources.video.VideoSequence._survey", None)
    found = probe(clip)
    assert found == survey
    assert (found.kind, found.frame_count, found.width, found.height) == ("video", 24, 64, 48)
    assert (found.frame_rate_hz, found.duration_s, found.warnings) == (25.0, pytest.approx(0.96), ())
    with closing(open_sequence(clip, index=found)) as sequence:
        assert sequence.picture(20).shape == (48, 64, 3)


def test_folders_animations_and_tables_are_probed_too(tmp_path: Path) -> None:
    """Folders of pictures, animated GIFs and tables of tracks are told from videos."""
    folder = tmp_path / "pictures"
    folder.mkdir()
    for number in range(3):
        (folder / f"{number}.png").write_bytes(png(40 * number))
    images = [Image.open(path) for path in sorted(folder.iterdir())]
    images[0].save(tmp_path / "a.gif", save_all=True, append_images=images[1:], duration=40)
    rows = [f"{frame},{point},{10 * point + frame},{point * point}" for frame in range(2) for point in range(5)]
    (tmp_path / "a.csv").write_text("\n".join(("frame,point,x_px,y_px", *rows)))
    kinds = [(index.kind, index.frame_count) for index in map(probe, (folder, tmp_path / "a.gif", tmp_path / "a.csv"))]
    assert kinds == [("images", 3), ("gif", 3), ("tracks", 2)]


def test_columns_are_named_in_the_confined_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A header is rewritten where its length harms nobody, and may name 16,384 columns at most."""
    monkeypatch.setattr("pftrack_server.jobs.functions.rename", None)
    path = tmp_path / "a.csv"
    said = {"frame": 0, "x": 1, "y": 2, "w": 3, "h": 4}
    path.write_bytes(b"f,a,b,c,d\n0,1,2,3,4\n")
    assert (probe(path, columns=said).kind, path.read_bytes()[:13]) == ("beliefs", b"frame,x,y,w,h")
    for count, got in ((16_385, "16,385"), (1 << 20, "1,048,576")):
        path.write_bytes(b"," * (count - 1) + b"\n")
        with pytest.raises(RefusedError, match=f"Expected a table with at most 16,384 columns, got {got}"):
            probe(path, columns=said)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "The file is empty"),
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
    with pytest.raises(RefusedError, match=sentence) as refusal:
        probe(path)
    assert str(tmp_path) not in str(refusal.value)


def test_any_name_may_be_probed(clip: Path, tmp_path: Path) -> None:
    """Names that look like options, addresses or no text at all are just names."""
    for name in ("-c import os", "http:x?y#z", "a\udcff\n.mp4"):
        path = tmp_path / name
        path.symlink_to(clip)
        assert probe(path).frame_count == 24


# ---------------------------------------------------------------- harm


@pytest.mark.parametrize(
    ("budget", "error", "sentence"),
    [
        # The system counts whole seconds, from what was used already.
        ({"cpu_seconds": 0.9}, RefusedError, r"needs more than the 0\.9 s of processor time that it may use"),
        ({"silence_s": 0.5}, ApiError, r"did not respond for 0\.5 s and was stopped"),
        ({"memory_bytes": 20 * MEBIBYTE}, RefusedError, "needs more than the allowed 20 MiB of memory"),
    ],
)
def test_a_decoder_without_end_is_given_up(
    endless: Path, budget: dict[str, Any], error: type[Exception], sentence: str
) -> None:
    """After the processor time, the time or the memory that it may use, which is told."""
    with pytest.raises(error, match=sentence):
        probe(endless, **budget)


def test_a_probe_may_be_stopped(endless: Path) -> None:
    """Who asks may give up, and the process is gone at once."""
    begun = time.monotonic()
    with pytest.raises(ApiError, match="could not be finished: its process was killed"):
        probe(endless, stopped=lambda: time.monotonic() > begun + 0.3)
    assert time.monotonic() < begun + 5.0


def test_a_probe_may_be_dropped(endless: Path) -> None:
    """When nobody waits any more, the process is gone as well, wherever the probe has come to."""

    async def drop(after_s: float) -> None:
        probing = asyncio.ensure_future(module.probe(ChildTasks(Queues()), endless, DEFAULT_LIMITS))
        await asyncio.sleep(after_s)
        probing.cancel()
        with pytest.raises(asyncio.CancelledError):
            await probing

    for after_s in (0.0, 0.005, 0.05, 0.3):
        run(drop(after_s))


SENTENCES = {
    hostile.fail: "see the server's log",
    hostile.be_killed: "its process was killed",
    hostile.unfold: "needs more memory than the 1024 MiB",
    hostile.hang: "did not respond for 1 s",
}
DAMAGING = (hostile.crash, hostile.abort, hostile.leave, hostile.leave_with_status, *hostile.ANSWERS, hostile.hang_up)


@pytest.mark.parametrize("harm", [*SENTENCES, *DAMAGING])
def test_a_process_that_goes_wrong_becomes_a_sentence(
    clip: Path, monkeypatch: pytest.MonkeyPatch, harm: Callable[..., Any]
) -> None:
    """A crash, silence, nonsense, a flood or a hang of the process is told in one sentence."""
    monkeypatch.setattr(module, "index_frames", harm)
    monkeypatch.setattr("pftrack.process.pool.LAST_WORDS_S", 0.3)
    with pytest.raises(RefusedError, match=SENTENCES.get(harm, "Its input may be damaged")):
        probe(clip, silence_s=1 if harm is hostile.hang else 60)
    assert not hostile.HARM.exists()


def test_the_server_goes_on(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """After all that, and at the same time, other files are probed by children of the same fork server."""
    parent = ask(hostile.surroundings)["parent"]

    async def side_by_side() -> list[FrameIndex | BaseException]:
        tasks = ChildTasks(Queues())
        good = [asyncio.ensure_future(module.probe(tasks, clip, DEFAULT_LIMITS)) for _ in range(4)]
        await asyncio.sleep(0)  # each has begun
        monkeypatch.setattr(module, "index_frames", hostile.crash)
        return await asyncio.gather(*good, module.probe(tasks, clip, DEFAULT_LIMITS), return_exceptions=True)

    *good, bad = run(side_by_side())
    assert [index.frame_count for index in good] == [24] * 4
    assert isinstance(bad, RefusedError)
    assert ask(hostile.surroundings)["parent"] == parent
