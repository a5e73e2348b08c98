"""What is claimed for the presets of the hand; the figures are drawn."""

from itertools import product

import pytest

from pftrack.core.model.preset import Preset
from pftrack.experiments import find
from pftrack.reproduce.hand import MOTIONS, RANKINGS, WIDTHS, Outcome, mean, right_figure
from tests.making import whole_run

HAND = find("hand")


def test_the_figure_has_a_panel_for_each_motion_and_bars_for_both_rankings() -> None:
    """Best and any, of one hand kept and of four; the reference's figures are marks."""
    one = Outcome(0.1, 0.1, 0.1, 0.5, 0.75, 0.5, 20.0)
    figure = right_figure(dict.fromkeys(product(MOTIONS, WIDTHS, RANKINGS), one))
    assert [panel.get_title() for panel in figure.axes] == ["wrist", "bend", "occlusion"]
    heights = [bar.get_height() for bar in figure.axes[0].patches]
    assert heights == [0.75, 0.75, 0.5, 0.5] * 2
    assert mean([one, one]) == one


@pytest.mark.slow
@pytest.mark.parametrize("preset", HAND.presets, ids=lambda preset: preset.name)
def test_presets_do_what_they_say(preset: Preset) -> None:
    """What works is never lost, with one hand kept the turn is lost from frame 21 on, and particles are further off."""
    found, works = (
        whole_run(HAND, tracker=chosen.tracker, seed=chosen.seed, values=chosen.parameters).summary()
        for chosen in (preset, HAND.presets[0])
    )
    kind = preset.title.partition(":")[0]
    assert works.verdict.success
    if kind == "worse":
        assert found.verdict.mean_error > 1.5 * works.verdict.mean_error
    else:
        assert (found.verdict.first_lost_frame is None) == (kind == "works")
    if kind == "breaks":
        assert found.verdict.first_lost_frame == 21
