"""The figures of coverage, the page that shows them and the declarations of experiments say the same."""

import json

import pytest

from pftrack.experiments import EXPERIMENTS
from pftrack.testing.coverage import SEEDS, declared_of, find_contradictions
from tools.coverage import DATA, PAGE, Setting, coverages, measured_settings, page, update

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
    again = update(STORED, measured)
    assert again["revisions"] == {**STORED["revisions"], "prism": "new"}
    assert again["frames"] == {**STORED["frames"], "prism": 7}
    assert coverages(again).keys() == MEASURED.keys()
    assert list(coverages(again)) == list(MEASURED)


@pytest.mark.parametrize("setting", MEASURED, ids="-".join)
def test_what_was_measured_is_what_is_declared(setting: Setting) -> None:
    """Bands that are off are declared, in the direction in which they are, and none that are not off."""
    faults = declared_of(EXPERIMENTS[setting.experiment], setting.tracker, setting.preset)
    assert list(find_contradictions(faults, MEASURED[setting])) == []
