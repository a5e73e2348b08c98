"""Clips are taken in many ways, each the same whenever it is taken, and judged by fits that have not seen them."""

import math
from pathlib import Path

import av
import numpy as np
import pytest

from pftrack.experiments import find
from pftrack.reproduce import loss_on_clips
from pftrack.reproduce.clips import FEWEST, clips_in, run_on, seed_of, take
from pftrack.reproduce.loss_on_clips import cases_on, judge_left_out, witness_clips
from pftrack.reproduce.loss_probability import Witnessed
from pftrack.reproduce.pool import Pool

BALL = find("ball")
FRAMES, WIDTH, HEIGHT, SIDE = 60, 160, 96, 12


@pytest.fixture(scope="module")
def clips(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one clip, of a red square that walks to the right by a pixel in each picture, and its truth."""
    folder = tmp_path_factory.mktemp("clips")
    (folder / "walk").mkdir()
    with av.open(folder / "walk" / "clip.mp4", "w") as container:
        stream = container.add_stream("libx264", rate=30, options={"crf": "4"})
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for index in range(FRAMES):
            picture = np.full((HEIGHT, WIDTH, 3), 110, np.uint8)
            picture[40 : 40 + SIDE, 30 + index : 30 + index + SIDE] = (210, 40, 40)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode(None))
    lines = [f"{index},{30 + index},40,{SIDE},{SIDE}" for index in range(FRAMES)]
    (folder / "walk" / "gt.csv").write_text("\n".join(["frame,x,y,w,h", *lines]) + "\n", "utf-8")
    return folder


def test_boxes_go_with_the_pictures(clips: Path) -> None:
    """In whatever direction a clip is taken, its first box lies on the square, which no pillar hides there."""
    assert clips_in(clips) == ["walk"]
    for number in range(6):
        taken = take(clips, "walk", number)
        assert taken is not None
        assert taken.frame_count >= FEWEST
        x, y, w, h = (round(value) for value in taken.boxes[0])
        inside = taken.picture(0)[y + 2 : y + h - 2, x + 2 : x + w - 2].astype(float).mean(axis=(0, 1))
        assert inside[0] > 2 * inside[1]


def test_a_number_is_the_same_run_again(clips: Path) -> None:
    """Its pictures, particles and estimates are the same to the bit; another clip's name gives other numbers."""
    runs = []
    for _ in range(2):
        taken = take(clips, "walk", 3)
        assert taken is not None
        runs.append(run_on(BALL, "h-spf", taken, seed_of("walk", 3)))
    first, again = runs
    assert first is not None
    assert again is not None
    assert first.estimates_sha256 == again.estimates_sha256
    assert seed_of("walk", 3) != seed_of("wall", 3)


def test_a_clip_is_judged_by_the_others() -> None:
    """What is true of two clips alike is well said of each by the other; a reversed one is told wrong."""
    rng = np.random.default_rng(1)

    def clip(sign: float) -> list[Witnessed]:
        lost = rng.random(200) < 0.5
        features = rng.standard_normal((200, 24))
        features[:, 3] += 4.0 * sign * lost
        return [Witnessed(features, lost)]

    alike = judge_left_out(BALL, "h-spf", {"a": clip(1.0), "b": clip(1.0)})
    assert alike.roc.area > 0.95
    assert judge_left_out(BALL, "h-spf", {"a": clip(1.0), "b": clip(-1.0)}).roc.area < 0.1


def test_what_is_declared_is_judged_on_the_clips_of_a_folder(clips: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a folder it is not run; runs on clips have the features of the declared models."""
    (unknown,) = loss_on_clips.on_clips(Pool(1), True)
    assert (unknown.verdict, math.isnan(unknown.ours)) == ("not run", True)
    assert "--clips" in unknown.reason
    monkeypatch.setattr(loss_on_clips, "RUNS", 1)
    (case,) = cases_on("ball", ("h-spf",), clips)
    seen = witness_clips(case)["h-spf"]
    model = BALL.loss_probability.on_recordings["h-spf"]
    assert seen.features.shape == (len(seen.lost), len(model.regression.weights))
    assert model.regression.probabilities(seen.features).min() >= 0.0
