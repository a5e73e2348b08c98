"""The figures of coverage, the page that shows them and the declarations of experiments say the same."""

import json

import pytest

from pftrack.core.model.parameters import revise
from pftrack.experiments import EXPERIMENTS
from pftrack.testing.coverage import SEEDS, declared_of, find_contradictions, judge
from tools import coverage
from tools.coverage import DATA, PAGE, Setting, coverages, draw, measured_settings, page

STORED = json.loads(DATA.read_text())
MEASURED = coverages(STORED)


def test_the_page_shows_what_is_stored() -> None:
    """`python -m tools.coverage table` writes it anew."""
    assert page(PAGE.read_text(), STORED) == PAGE.read_text()


def test_all_trackers_are_measured() -> None:
    """In the default scene and two presets, over forty seeds."""
    assert set(MEASURED) == set(measured_settings())
    said = [EXPERIMENTS[name].quality.calibration for name in EXPERIMENTS.own]
    assert {len(one.presets) for one in said if one.bands} == {2}
    assert {one.runs for some in MEASURED.values() for one in some} == {len(SEEDS)} == {STORED["seeds"]}


def test_an_experiment_can_be_measured_again() -> None:
    """Its rows take the places of those that are stored, in the same order, and the others stay."""
    some = [row for row in STORED["coverage"] if row["experiment"] == "prism"]
    measured = {"revisions": {"prism": "new"}, "seeds": 40, "frames": {"prism": 7}, "coverage": some[::-1]}
    again = coverage.update(STORED, measured)
    assert again["revisions"] == {**STORED["revisions"], "prism": "new"}
    assert again["frames"] == {**STORED["frames"], "prism": 7}
    assert coverages(again).keys() == MEASURED.keys()
    assert list(coverages(again)) == list(MEASURED)


@pytest.mark.parametrize("setting", MEASURED, ids="-".join)
def test_what_was_measured_is_what_is_declared(setting: Setting) -> None:
    """No band is declared otherwise than it was measured; those of the default scene are declared if that is clear."""
    said = declared_of(EXPERIMENTS[setting.experiment], setting.tracker, setting.preset)
    assert list(find_contradictions(said, MEASURED[setting])) == []
    if not setting.preset:
        assert said == {of: judge([one for one in MEASURED[setting] if one.of == of]) for of in said}


@pytest.mark.parametrize("name", sorted({setting.experiment for setting in MEASURED}))
def test_settings_at_random_are_useful_ones(name: str) -> None:
    """Each number is a setting of its own within the sliders, of which some turn one parameter and some turn many."""
    experiment = EXPERIMENTS[name]
    defaults = experiment.simulate().parameters
    declared = {it.name: it for it in experiment.declarations(type(defaults))}
    drawn = [draw(experiment, number) for number in range(20)]
    assert drawn == [draw(experiment, number) for number in range(20)]
    for chosen in drawn:
        assert chosen
        assert revise(defaults, chosen)
        for parameter, value in chosen.items():
            low, high = declared[parameter].useful or (value, value)
            assert low <= value <= high
    assert min(map(len, drawn)) <= 2 < max(map(len, drawn))


def test_bands_that_are_off_at_random_settings_are_not_declared_right() -> None:
    """At most one in twenty where nothing was chosen, and a quarter of those that are right is declared so."""
    rows = [row for row in coverage.read_drawn() if row["number"] >= coverage.ASIDE]
    judged = [it for row in rows for it in coverage.judge_drawn(row)]
    off = [it.claimed for it in judged if it.found != "right"]
    right = [it.claimed for it in judged if it.found == "right"]
    assert len(off) >= 200
    assert sum(off) <= 0.05 * len(off)
    assert sum(right) >= 0.25 * len(right)
