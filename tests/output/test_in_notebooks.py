"""Displays in notebooks, whose style sheets have rules of their own for pictures and tables."""

from typing import Any

import pytest

import pftrack
from tests.conftest import CHROMIUM
from tests.output.notebook_styles import STYLES, faults

pytestmark = [pytest.mark.browser, pytest.mark.skipif(not CHROMIUM.exists(), reason="needs Debian's chromium")]


@pytest.fixture(scope="module")
def displays() -> list[str]:
    run = pftrack.run("ball", frames=60, seed=3, occlusion_width_px=70.0)
    other = pftrack.run("ball", tracker="condensation", frames=60, seed=3, occlusion_width_px=70.0)
    return [run._repr_html_(), pftrack.compare(run, other)._repr_html_()]


@pytest.mark.parametrize("style", STYLES)
def test_nothing_is_cut_or_covered(chromium: Any, displays: list[str], style: str) -> None:
    """Pictures and curves keep their places under the rules of each notebook, in wide and in narrow cells."""
    outputs = "".join(f'<div class="output"><div>{display}</div></div>' for display in displays)
    page = chromium.new_page()
    try:
        page.set_content(f"<style>{STYLES[style]}</style>{outputs}")
        for width in (1200, 700):
            page.set_viewport_size({"width": width, "height": 900})
            assert faults(page) == [], f"at {width} px"
    finally:
        page.close()
