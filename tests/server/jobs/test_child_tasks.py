"""Confined children: a task, or a probed file, that goes wrong harms its own process alone."""

import asyncio
import signal
import time
from collections.abc import Callable
from contextlib import closing
from functools import partial
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
from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.jobs.child_tasks import ChildTasks, Queues
from pftrack_server.uploads import intake as module
from pftrack_server.uploads.intake import BUDGET
from tests.apart import run
from tests.server import hostile
from tests.server.confined import ask
from tests.server.uploads.test_uploads import video

pytestmark = pytest.mark.usefixtures("nothing_is_left")

MEBIBYTE = 1024**2


def test_the_process_limits_itself_and_has_nothing_of_its_parents() -> None:
    """It gives up memory, processor time, files, core dumps and all writing before it looks at a file.

    It leads its own group, ends with its parent, has no threads and holds open its answer alone, though other tasks are
    at work.
    """

    async def with_others() -> Any:
        tasks = ChildTasks(Queues())
        others = [asyncio.ensure_future(tasks.run_beside(hostile.hang)) for _ in range(3)]
        await asyncio.sleep(0.5)
        answer = await tasks.run_beside(hostile.surroundings, budget=BUDGET)
        for other in others:
            other.cancel()
        await asyncio.gather(*others, return_exceptions=True)
        return answer

    found = run(with_others())
    limits = found["limits"]
    # Memory is counted from what the process had when it was forked.
    assert abs(limits["AS"][0] - BUDGET.memory_bytes - found["size"]) < 64 * MEBIBYTE
    assert 120 <= limits["CPU"][0] < 130
    assert [limits[name] for name in ("FSIZE", "NOFILE", "CORE")] == [[0, 0], [BUDGET.open_files] * 2, [0, 0]]
    # A thread of the parent's would have left its locks behind, for ever locked.
    assert (found["threads"], found["threads_of_parent"], found["leads"]) == (1, 1, True)
    assert found["at_parents_end"] == signal.SIGKILL
    assert {found["descriptors"].pop(number) for number in "012"} == {"/dev/null"}
    (pipe,) = found["descriptors"].values()
    assert pipe.startswith("socket:")
    assert (found["dispositions"], found["blocked"]) == (["0"] * 3, 0)  # the system's own: they end the process


def test_the_process_writes_nothing(tmp_path: Path, clip: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """No file becomes longer, whether it existed or not; what a decoder prints fills no log, and it sees no tokens."""
    (tmp_path / "there").write_bytes(b"before")
    assert ask(hostile.write, str(tmp_path)) == ["OSError", "OSError"]
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"there": b"before", "new": b""}
    assert ask(hostile.talk_and_decode, str(clip)) == {}, "tokens and passwords may be in the environment"
    assert "COMPLAINT" not in "".join(capfd.readouterr())


def test_work_that_continues_is_not_silent() -> None:
    """A task that reports progress may take any time, in the web process and by its own alarm."""
    told: list[tuple[int, int]] = []
    budget, steps, tasks = Budget(silence_s=4.0), 10, ChildTasks(Queues())
    work = tasks.run_beside(hostile.take_long, steps, 0.5, budget=budget, on_step=lambda *step: told.append(step))
    left_s = run(work)["left_s"]
    assert left_s[0] - left_s[-1] < 0.5 * (steps - 1), "the alarm is set anew"
    assert told == [(step, steps) for step in range(1, steps + 1)]


@pytest.mark.parametrize("mistake", [hostile.fail, hostile.miss])
def test_a_mistake_of_ours_is_in_the_log(
    mistake: Callable[..., None], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The log has the reason why a task failed; the client gets one plain sentence."""
    monkeypatch.setattr("pftrack_server.jobs.child_tasks.warnings", RateLimitedLogger("tasks"))
    with pytest.raises(RefusedError, match="cannot be read safely"):
        run(ChildTasks(Queues()).run(mistake))
    assert "on purpose" in capsys.readouterr().out


def probe(
    path: Path,
    limits: Limits = DEFAULT_LIMITS,
    stopped: Callable[[], bool] = lambda: False,
    columns: dict[str, int] | None = None,
    **budget: Any,
) -> FrameIndex:
    """Probe a file within the usual budget, except for the given limits."""
    wanted = Budget(**{name: getattr(BUDGET, name) for name in Budget.__slots__} | budget)
    return run(module.probe(ChildTasks(Queues()), path, limits, budget=wanted, columns=columns, stopped=stopped))


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("clips") / "clip.mp4"
    path.write_bytes(video())
    return path


def test_a_probe_tells_what_a_survey_finds(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A good file gives the same index as opening it, and the next reader of the file needs no survey.

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


def test_animations_are_probed_too(tmp_path: Path) -> None:
    """An animated GIF is distinguished from a video."""
    images = [Image.new("L", (40, 30), 40 * number) for number in range(3)]
    images[0].save(tmp_path / "a.gif", save_all=True, append_images=images[1:], duration=40)
    index = probe(tmp_path / "a.gif")
    assert (index.kind, index.frame_count) == ("gif", 3)


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


# ---------------------------------------------------------------- harm


@pytest.mark.parametrize(
    ("budget", "error", "sentence"),
    [
        ({"silence_s": 0.5}, ApiError, r"did not respond for 0\.5 s and was stopped"),
        ({"memory_bytes": 20 * MEBIBYTE}, RefusedError, "needs more than the allowed 20 MiB of memory"),
    ],
)
def test_a_decoder_without_end_is_given_up(
    endless: Path, budget: dict[str, Any], error: type[Exception], sentence: str
) -> None:
    """It ends after its time or its memory, and the refusal names the limit."""
    with pytest.raises(error, match=sentence):
        probe(endless, **budget)


def test_a_probe_may_be_stopped(endless: Path) -> None:
    """The caller may give up, and the process ends at once."""
    begun = time.monotonic()
    with pytest.raises(ApiError, match="could not be finished: its process was killed"):
        probe(endless, stopped=lambda: time.monotonic() > begun + 0.3)


def test_a_probe_may_be_dropped(endless: Path) -> None:
    """When its caller is cancelled, the process ends as well, at any stage of the probe."""

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
    partial(hostile.end_by, signal.SIGXCPU): r"needs more than the 120 s of processor time that it may use",
    partial(hostile.end_by, signal.SIGKILL): "its process was killed",
    hostile.unfold: "needs more memory than the 1024 MiB",
    hostile.hang: "did not respond for 1 s",
}
DAMAGING = (hostile.crash, hostile.leave, *hostile.ANSWERS, hostile.hang_up)


@pytest.mark.parametrize("harm", [*SENTENCES, *DAMAGING])
def test_a_process_that_goes_wrong_becomes_a_sentence(
    clip: Path, monkeypatch: pytest.MonkeyPatch, harm: Callable[..., Any]
) -> None:
    """A crash, silence, nonsense, a flood or a hang of the process is reported in one sentence."""
    monkeypatch.setattr(module, "index_frames", harm)
    monkeypatch.setattr("pftrack.process.pool.LAST_WORDS_S", 0.3)
    with pytest.raises(RefusedError, match=SENTENCES.get(harm, "Its input may be damaged")):
        probe(clip, silence_s=1 if harm is hostile.hang else 60)
    assert not hostile.HARM.exists()
