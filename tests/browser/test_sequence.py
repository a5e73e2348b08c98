"""The control of a sequence, on the page of the lesson that has one."""

import re
from typing import Any

import pytest

from tests.browser.views import View


class Recursion(View):
    """Lesson 5, without its question."""

    def open(self) -> "Recursion":
        self.page.goto("/learn/recursion")
        self.press("Skip")
        self.until(lambda: not self.page.locator(".lesson-fields").is_disabled(), "everything can be turned")
        return self

    @property
    def steps(self) -> str:
        return str(self.page.inner_text(".sequence-steps"))

    def variance(self) -> float:
        """Return the variance that the page shows, m^2."""
        found = re.search(r"([\d.]+) m²\s+Variance now", str(self.page.inner_text("main")))
        return float(found[1]) if found else float("nan")

    def press(self, name: str) -> None:
        self.page.get_by_role("button", name=name, exact=True).click()

    def becomes(self, steps: str, variance: float) -> None:
        self.until(lambda: self.steps == steps, steps)
        self.until(lambda: self.variance() == pytest.approx(variance, abs=0.006), f"the variance is {variance}")


@pytest.fixture
def recursion(page: Any) -> Recursion:
    return Recursion(page).open()


def test_steps_are_appended_and_taken_back(recursion: Recursion) -> None:
    """By buttons and by keys on them: each step counts, also those pressed faster than the server answers.

    Whoever takes the last one back keeps the focus; the sixty-first is not taken.
    """
    recursion.press("Start again")
    recursion.becomes("nothing yet", 9.0)
    recursion.press("Predict")
    recursion.becomes("1 step: predict", 10.0)
    recursion.press("Measure")
    recursion.becomes("2 steps: predict, measure", 1.667)
    for _ in range(10):
        recursion.page.keyboard.press("p")
    recursion.becomes("12 steps: … predict, predict", 11.667)
    recursion.press("Undo")
    recursion.page.keyboard.press("Backspace")
    recursion.becomes("10 steps: … predict, predict", 9.667)
    recursion.page.keyboard.press("Delete")
    recursion.becomes("nothing yet", 9.0)
    undo = recursion.page.get_by_role("button", name="Undo", exact=True)
    assert undo.get_attribute("aria-disabled") == "true"
    assert undo.evaluate("(button) => button === document.activeElement")

    recursion.press("Predict")
    for _ in range(64):
        recursion.page.keyboard.press("p")
    recursion.becomes("60 steps: … predict, predict", 69.0)
    predict = recursion.page.get_by_role("button", name="Predict", exact=True)
    assert predict.get_attribute("aria-disabled") == "true"
    recursion.press("Undo")
    recursion.becomes("59 steps: … predict, predict", 68.0)
    assert predict.get_attribute("aria-disabled") == "false"
