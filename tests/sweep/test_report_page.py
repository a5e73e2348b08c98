"""The page of a report: it needs nothing else, and has the tables, the figures and what they mean."""

import re

import numpy as np
import pytest
from playwright.sync_api import Browser

from pftrack.sweep import Result
from pftrack.sweep.cells import Code, cells, significance
from pftrack.sweep.report.files import Report
from pftrack.sweep.report.study import number

AXES = "occlusion_width_px", "distracter_radius_px"


def test_the_page_needs_nothing_else(report: Report) -> None:
    """It loads no address, has the tables' numbers, and each picture that lies beside it."""
    text = report.page.read_text()
    addresses = re.findall(r"""(?:src|href)="([^"]*)"|(<link|<script|@import|url\()""", text)
    assert all(address.startswith("data:image/png;base64,") for address, _ in addresses)
    assert len(addresses) == sum(path.suffix == ".png" for path in report.files)
    for table in report.tables:
        for cell in table.rows[0]:
            assert f"<td>{cell}</td>" in text
    for shown in ("h-spf / condensation", "not applicable", "on the same scenes"):
        assert shown in text


def test_the_page_says_what_the_level_means(report: Report, finished: Result) -> None:
    """The share of false alarms is that of the level asked for, and cells that were not tested are not counted."""
    text = report.page.read_text()
    assert "up to 20 % come out as significant by chance" in text
    found = significance(*cells(finished, *AXES).values(), level=0.2)
    counts = [int((found.codes == code).sum()) for code in (Code.FIRST_BETTER, Code.SECOND_BETTER)]
    tested = int((found.codes != Code.NOT_APPLICABLE).sum())
    assert tested < 8
    assert f"<span>h-spf {counts[0]}, condensation {counts[1]} of {tested} tested</span>" in text


def test_numbers_are_written_to_three_digits() -> None:
    """Large ones are whole, differences have their sign, and what is not known is left blank."""
    assert [number(value) for value in (0.0012345, 12.345, 999.6, 12345.6, np.nan)] == [
        *("0.00123", "12.3", "1,000", "12,346", "")
    ]
    assert [number(value, "+") for value in (0.25, -1234.5, 2000.0)] == ["+0.25", "-1,234", "+2,000"]


@pytest.mark.browser
@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_is_read_without_a_network(report: Report, chromium: Browser, width: int) -> None:
    """Pictures are shown, a section unfolds, and nothing reaches beyond a narrow page."""
    page = chromium.new_page(viewport={"width": width, "height": 900}, offline=True)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("requestfailed", lambda request: faults.append(request.url))
    page.goto(report.page.as_uri())
    assert page.locator("details[open]").count() == 2
    assert page.locator("#success img").evaluate("picture => picture.naturalWidth") > width / 2
    folded = page.locator("#median_error_px")
    assert folded.locator("img").is_hidden()
    folded.locator("summary").click()
    assert folded.locator("img").is_visible()
    assert page.evaluate("document.documentElement.scrollWidth") == width
    assert not faults
    page.close()
