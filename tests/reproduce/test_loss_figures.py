"""Figures of loss probabilities have a panel a tracker, and show what was found of it."""

import numpy as np

from pftrack.experiments.shared.loss_probability import delays, reliability, roc
from pftrack.reproduce.loss_probability import FIGURES, LAST_FRAME, draw_scores


def test_each_tracker_has_a_panel_that_shows_its_numbers() -> None:
    """Bins lie where they are, a curve ends at all and all, and the losses that were told come to their share."""
    told, lost = np.array([0.1, 0.1, 0.3, 0.9, 0.9, 0.9, 0.9, 0.9]), np.arange(8) >= 2
    scores = reliability(told, lost), roc(told, lost), delays([(told, lost)])
    figures = draw_scores({("ball", "apf"): scores, ("ball", "upf"): scores, ("hand", "beam"): scores})
    assert tuple(figures) == FIGURES
    for figure in figures.values():
        shown = [panel for panel in figure.axes if panel.get_visible()]
        assert [panel.get_title() for panel in shown] == ["ball, apf", "ball, upf", "hand, beam"]
    bins, curve, waits = ([np.asarray(line.get_data()) for line in figure.axes[0].lines] for figure in figures.values())
    assert np.allclose(bins[1], [[0.1, 0.3, 0.9], [0.0, 1.0, 1.0]])
    assert curve[1][:, -1].tolist() == [1.0, 1.0]
    assert (waits[0][1, 0], waits[0][1, 1], waits[0][0, -1]) == (0.0, 1.0, LAST_FRAME)
