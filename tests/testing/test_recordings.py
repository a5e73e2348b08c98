"""The checks on recordings: a film of the scene is marked, tracked, drawn, saved and opened, or refused."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.drawing import Picture
from pftrack.core.model.marks import Box
from pftrack.core.model.recipe import Footage
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.shared.recording import RecordingSource
from pftrack.testing import CheckError, drawings
from tests.testing.test_marks import Disc

BALL = find("ball")


def test_a_kind_that_knows_no_target_is_placed_as_an_editor_begins() -> None:
    """Its handles are where the editor has them in the film's own size, and the mark may be refused in a sentence."""
    seen: list[Any] = []

    def wire(sequence: Any, mark: Any, *_: Any) -> Any:
        seen.append((sequence.size, mark.centre, mark.radius_px))
        raise ParameterError("mark", "this", "something else")

    drawings._a_film_is_tracked(on_clips(wire, marks=(Disc,)))
    assert seen == [((320, 240), (159.5, 119.5), 20)] * 2


MARK = Box.of(50, 110, 20, 20).model_dump(mode="json")


def on_clips(wire: Callable[..., Any], **more: Any) -> Experiment:
    """Return the ball with another wiring of recordings."""
    return replace(BALL, video=replace(BALL.video, wire=wire, **more))


def wiring(alter: Callable[[Any], Any]) -> Experiment:
    """Return the ball with another setup on recordings."""
    return on_clips(lambda *given: alter(BALL.video.wire(*given)))


def crashing(*_: Any, **__: Any) -> Any:
    raise ZeroDivisionError("somewhere")


def shorter(setup: Any) -> Any:
    def open_source(seed: int, parameters: Any) -> Any:
        source = setup.open_source(seed, parameters)
        source.frame_count -= 1
        return source

    return replace(setup, open_source=open_source)


def at_sea() -> Experiment:
    """Begin where there is nothing, and never say so."""
    tracker = BALL.trackers[BALL.default_tracker]

    def start(*given: Any) -> Any:
        state = tracker.start(*given)
        return replace(state, posterior=replace(state.posterior, mean=np.full_like(state.posterior.mean, np.nan)))

    trackers = {**BALL.trackers, BALL.default_tracker: replace(tracker, start=start)}
    return replace(wiring(lambda setup: replace(setup, beside=None)), trackers=trackers)


BROKEN: dict[str, tuple[Callable[[], Experiment], str]] = {
    "an exception that says nothing": (
        lambda: on_clips(crashing),
        "a box in a film of the scene must be taken or refused by a ValueError, got ZeroDivisionError: somewhere",
    ),
    "another file": (
        lambda: wiring(lambda setup: replace(setup, footage=Footage(sha256="0" * 64, mark=MARK))),
        "the footage of a recording with a box must have the hash of its file, got",
    ),
    "a frame too few": (lambda: wiring(shorter), "has 8 pictures to track, and the run has 7 frames"),
    "an estimate that is no number": (
        at_sea,
        r"the estimate in frame 0 of a recording with a box with the tracker h-spf is \(nan, nan\)",
    ),
    "a drawing that cannot be shown": (
        lambda: replace(BALL, draw=lambda *given: replace(BALL.draw(*given), primitives={"p": Picture(np.zeros(3))})),
        "p in frame 0 of a recording with a box .* cannot be shown: image_rgb must be",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_wrong_on_a_recording_is_said(name: str) -> None:
    """An experiment that is broken in one way fails with a sentence."""
    make, sentence = BROKEN[name]
    with pytest.raises(CheckError, match=sentence):
        drawings._a_film_is_tracked(make())


def test_the_film_is_of_the_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is tracked are the pictures of the scene as a decoder has them, from the mark of the true place on."""
    starts: list[Any] = []
    begin = RecordingSource.__init__

    def noting(self: Any, sequence: Any, *given: Any, **named: Any) -> None:
        begin(self, sequence, *given, **named)
        starts.append((sequence, self.start.position))

    monkeypatch.setattr(RecordingSource, "__init__", noting)
    drawings._a_film_is_tracked(BALL)
    (sequence, first), (_, later) = starts[0], starts[-1]
    assert sequence.frame_count == 8
    assert first.tolist() == pytest.approx([60.0, 120.0], abs=0.5)
    assert later[0] > 60.5
