"""What is claimed for the fish, on few runs; the figures are with those of all studies."""

import numpy as np
import pytest

from pftrack.experiments.fish.parameters import GUIDANCE
from pftrack.reproduce import fish
from pftrack.reproduce.fish import COUNTS, Clip, Successes

TRACKERS = "ordinary", "guided"


@pytest.mark.slow
def test_a_track_that_is_learned_from_holds() -> None:
    """Both fish of a clip are followed by the offline filter, to the accuracy of the reference's table."""
    found = fish.track_training_clip(Clip(100, True))
    assert found.tracked.all()
    off = found.tracks[..., :2] - found.truths[..., :2]
    assert np.sqrt(np.square(off).mean()) < 2.0
    alone = fish.learn_from_tracks([found])
    assert alone.diffusion("document").sd[0] == pytest.approx(GUIDANCE.parse("").diffusion("document").sd[0], rel=0.2)


def test_the_true_motion_is_narrower_than_what_is_learned() -> None:
    """The noise of the estimates is most of the learned spread of accelerations."""
    truth, learned = fish.learn_from_truth(100).diffusion("document"), GUIDANCE.parse("").diffusion("document")
    assert (truth.sd[:2] < 0.5 * learned.sd[:2]).all()
    assert truth.correlation[2, 3] < learned.correlation[2, 3] < -0.7


def test_the_figure_has_both_methods() -> None:
    """Figures 6 and 7 of Mitsugami et al. 2009: all fish, and the sharp turns."""
    found = {(tracker, count): Successes(20.0, 5.0, 0.1) for tracker in TRACKERS for count in COUNTS}
    assert [len(panel.lines) for panel in fish.draw(found).axes] == [2, 2]
