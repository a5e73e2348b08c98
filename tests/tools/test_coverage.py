"""The figures of coverage, the page that shows them and the declarations of experiments say the same."""

import json

import pytest

from pftrack.experiments import EXPERIMENTS
from pftrack.testing.coverage import declared_of, find_contradictions, judge
from tools import coverage
from tools.coverage import DATA, PAGE, SEEDS, Setting, coverages, measured_settings, page

STORED = json.loads(DATA.read_text())
MEASURED = coverages(STORED)


def test_all_trackers_are_measured_and_on_the_page() -> None:
    """The default scene and two presets have forty seeds; `python -m tools.coverage table` writes the page."""
    assert page(PAGE.read_text(), STORED) == PAGE.read_text()
    assert set(MEASURED) == set(measured_settings())
    calibrations = [EXPERIMENTS[name].quality.calibration for name in EXPERIMENTS.own]
    assert {len(one.presets) for one in calibrations if one.bands} == {2}
    assert {one.runs for some in MEASURED.values() for one in some} == {len(SEEDS)} == {STORED["seeds"]}


@pytest.mark.parametrize("setting", MEASURED, ids="-".join)
def test_declarations_agree_with_measurements(setting: Setting) -> None:
    """No declared band contradicts its measurement; a clear result in the default scene is declared."""
    declared = declared_of(EXPERIMENTS[setting.experiment], setting.tracker, setting.preset)
    found = {of: judge([one for one in MEASURED[setting] if one.of == of]) for of in declared}
    assert list(find_contradictions(declared, MEASURED[setting])) == []
    assert not [of for of in declared if {declared[of], found[of]} == {"overconfident", "underconfident"}]
    assert setting.preset or declared == found


def test_bands_that_are_off_at_random_settings_are_not_declared_right() -> None:
    """At most one in twenty wrong bands is declared right, and at least a quarter of the right ones is."""
    rows = [row for row in coverage.read_drawn() if row["number"] >= coverage.ASIDE]
    judged = [it for row in rows for it in coverage.judge_drawn(row)]
    off = [it.claimed for it in judged if it.found != "right"]
    right = [it.claimed for it in judged if it.found == "right"]
    assert len(off) >= 200
    assert sum(off) <= 0.05 * len(off)
    assert sum(right) >= 0.25 * len(right)
