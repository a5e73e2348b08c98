"""Each browser is sent frames as fast as it takes them up, and none waits for another."""

import itertools

import pytest

from server.viewer.pacing import LATE_S, Pace
from tests.viewer.host import Peer, Session, Site, drawing, wait_for


class Line:
    """A connection that remembers from when on it is held."""

    held_after_s: float | None = None

    def hold(self, after_s: float) -> None:
        self.held_after_s = after_s

    def release(self) -> None:
        self.held_after_s = None


def test_a_line_is_held_once_the_answer_is_overdue() -> None:
    """The best answer is the distance, which leaving out frames would not shorten; an answer frees the line."""
    line = Line()
    pace = Pace(line)
    pace.answered(0.4)
    pace.asked()
    assert line.held_after_s == pytest.approx(0.4 + LATE_S)
    pace.answered(0.9)
    assert line.held_after_s is None
    pace.asked()
    assert line.held_after_s == pytest.approx(0.4 + LATE_S)
    pace.answered(0.02)
    pace.asked()
    assert line.held_after_s == pytest.approx(0.02 + LATE_S)


def test_a_browser_that_is_loading_is_not_held() -> None:
    """Its first answer may take seconds."""
    line = Line()
    pace = Pace(line)
    pace.asked()
    pace.silent()
    pace.asked()
    assert line.held_after_s is None


def test_a_question_that_was_given_up_frees_the_line() -> None:
    """A frozen tab gets a few frames, so that it finds the newest when it thaws, and is held again."""
    line = Line()
    pace = Pace(line)
    pace.answered(0.02)
    pace.asked()
    pace.silent()
    assert line.held_after_s is None
    pace.asked()
    assert line.held_after_s == pytest.approx(0.02 + LATE_S)


def frame_of(peer: Peer) -> int:
    """Return the frame that a browser shows, by the number of its particles."""
    return len(peer.nodes["/particles"]["points"]) // 12 - 50


def test_a_still_scene_is_not_asked(session: Session, peer: Peer) -> None:
    """Each question would make the browser draw for a while; what has been asked is asked once for each frame."""
    for frame in range(3):
        session.viewer.show(drawing(frame, 50 + frame), {"frame": frame})
        wait_for(lambda frame=frame: "/particles" in peer.nodes and frame_of(peer) == frame)
    wait_for(lambda: peer.asked > 0)
    for value in range(10, 40):
        peer.move("Occluder width (px)", value)
        wait_for(lambda value=value: session.values["occlusion_width_px"] == value)
    assert peer.asked <= 3


def test_one_that_does_not_answer_holds_nobody_else(session: Session, site: Site, peer: Peer) -> None:
    """It is sent a few frames more, then none until it answers, and then the newest; the others see every frame."""
    with Peer(site.scene) as silent:
        wait_for(lambda: session.viewer.clients == 2)
        frames = itertools.count()

        def show() -> int:
            frame = next(frames)
            session.viewer.show(drawing(frame, 50 + frame), {"frame": frame})
            wait_for(lambda: "/particles" in peer.nodes and frame_of(peer) == frame)
            return frame

        show()
        # One that has never answered is taken to be loading still, and is not held.
        wait_for(lambda: silent.asked > 0)
        for _ in range(4):
            show()
        silent.echo = False
        asked = silent.asked
        wait_for(lambda: show() and silent.asked > asked)
        wait_for(lambda: show() - frame_of(silent) > 3)
        held = frame_of(silent)
        newest = max(show() for _ in range(20))
        assert frame_of(silent) <= held + 1  # what was on its way when it was held
        silent.echo = True
        silent.answer()
        wait_for(lambda: frame_of(silent) == newest)
