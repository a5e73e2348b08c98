"""Where lessons say that their ideas are used: sessions that can be opened as they stand."""

import pytest

from pftrack.core.model.parameters import declarations
from pftrack.experiments import find
from pftrack.runs.reproduction import make
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.lesson import Scenario

SCENARIOS = [
    *((f"{name}, use {number}", use) for name, it in LESSONS.items() for number, use in enumerate(it.uses)),
    *((name, it.body) for name, it in LESSONS.items() if isinstance(it.body, Scenario)),
]


@pytest.mark.parametrize("scenario", [each for _, each in SCENARIOS], ids=[name for name, _ in SCENARIOS])
def test_it_can_be_opened(scenario: Scenario) -> None:
    """Its recipe makes a run that has the frame at which it opens, and its tracker reads what is unlocked."""
    run = make(scenario.recipe)
    experiment = find(scenario.recipe.experiment)
    assert 0 <= scenario.frame < (scenario.recipe.frames or experiment.frames)
    readers = {each.name: each.trackers for each in declarations(type(run.parameters_at(0)))}
    for name in set(scenario.unlocked) - {"tracker", "seed"}:
        assert not readers[name] or run.tracker_at(0) in readers[name] or "tracker" in scenario.unlocked, name
    assert set(scenario.plots) <= {plot.id for plot in experiment.display.plots}
    assert set(scenario.layers) <= {layer.name for layer in experiment.display.layers}
