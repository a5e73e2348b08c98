"""Recordings: checks before an experiment sets up a run."""

from typing import Any

import pytest

from pftrack.core.model.marks import Box, LongBody, Mark
from pftrack.core.model.setup import Setup
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.experiments.experiment import NO_VIDEO, Video
from tests.experiments.head.heads import Pictures, pictures

BALL = find("ball").simulate()
CLIP = Pictures(pictures(3, width=320))
LONG = LongBody(head=(9, 9), root=(9, 30), tip=(9, 40), half_width=4)
BOX = Box.of(10, 10, 20, 20)


def wire(*_: Any) -> Setup:
    """Return the setup of the scene for any clip."""
    return Setup(BALL.open_source, BALL.parameters)


MARKED = Video(wire, marks=(Box,), wanted="a box")
REFUSED: dict[str, tuple[Video, Mark | None, int, str]] = {
    "no mark": (MARKED, None, 0, "mark must be a box"),
    "another mark": (MARKED, LONG, 0, "mark must be a box"),
    "a mark beyond the picture": (MARKED, Box.of(310, 10, 20, 20), 0, "mark must be a box of at least 1 px within"),
    "a mark where none is needed": (Video(wire), BOX, 0, "left out: all of the recording is followed"),
    "a start before the first picture": (MARKED, BOX, -1, "start must be a frame of the recording, 0 to 2"),
    "a start after the last one": (Video(wire), None, 3, "start must be a frame of the recording, 0 to 2"),
    "any recording": (NO_VIDEO, None, 0, "no recording is taken"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_unusable_marks_and_starts_are_refused(name: str) -> None:
    """A mark that is missing, wrong or outside and a start outside the recording are refused by name."""
    video, mark, start, sentence = REFUSED[name]
    with pytest.raises(ParameterError, match=sentence):
        video.on_video(CLIP, mark, start=start)


def test_a_setup_has_its_footage() -> None:
    """Mark and start of the recording are added to every setup."""
    footage = MARKED.on_video(CLIP, BOX, start=1).footage
    assert (footage.start, footage.mark) == (1, BOX.model_dump(mode="json"))
