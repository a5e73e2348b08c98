"""Nothing is held back in the browser to smooth the stream."""

import time
from itertools import pairwise

from tests.viewer.host import Peer, Session, drawing

SMOOTHED_S = 0.1
"""viser's client smooths messages that were sent closer together than this."""


def test_the_times_of_frames_are_too_far_apart_to_be_smoothed(session: Session, peer: Peer) -> None:
    """Even frames that leave 30 times a second are handed on as they come."""
    peer.sent.clear()
    for frame in range(20):
        session.show(drawing(frame), frame)
        time.sleep(0.034)
    assert len(peer.sent) > 5
    assert min(after - before for before, after in pairwise(peer.sent)) > SMOOTHED_S
