"""Series of an experiment that the project does not know, on the page.

Hypotheses and intervals are drawn, and nothing that a method does not have.
"""

from typing import Any

import numpy as np
import pytest

from tests.browser.host import Server
from tests.browser.views import SessionPage

FAINTEST = 0.06


@pytest.fixture
def server(beside_others: Server) -> Server:
    """A server beside which a package with an experiment of its own is installed."""
    return beside_others


def opened(page: Any, server: Server, **wish: Any) -> SessionPage:
    session = server.start_session(experiment="bank", frames=40, **wish)
    page.goto(session["page"])
    shown = SessionPage(page, server)
    shown.until(lambda: shown.position is not None, "the frame counter shows a number")
    shown.until(lambda: page.locator(".play").is_enabled(), "the play button can be pressed")
    return shown


def readings(shown: SessionPage) -> list[str]:
    return [title.inner_text() for title in shown.page.locator(".readout dt:visible").all()]


def test_all_that_a_method_reports_is_drawn_and_nothing_else(page: Any, server: Server) -> None:
    """In one visit to a run that has been played to its end."""
    shown = opened(page, server)
    shown.play_to_the_end()
    hypotheses_and_intervals_are_drawn_as_they_were_written_down(shown, server)
    what_a_method_does_not_have_is_not_shown(shown)
    a_node_of_the_tree_is_shown_in_its_frame(shown, server)


def hypotheses_and_intervals_are_drawn_as_they_were_written_down(shown: SessionPage, server: Server) -> None:
    """Each possibility leads from place to place, the more opaque the more probable; intervals have both ends."""
    rows = server.column(shown.id, "series")
    count = sum(len(row["bank"]["weights"]) for row in rows)
    links = lambda: (shown.trace("hypotheses") or {"links": []})["links"]  # noqa: E731 - one line of reading
    shown.until(lambda: len(links()) == count, "all possibilities are drawn")
    drawn = {name: [link[name] for link in links()] for name in ("x0", "x1", "y1", "opacity")}
    assert drawn["y1"] == [value for row in rows for (value,) in row["bank"]["values"]]
    weights = np.array([weight for row in rows for weight in row["bank"]["weights"]])
    assert np.allclose(drawn["opacity"], FAINTEST + (1 - FAINTEST) * weights)
    # The third possibility is there in every third frame only, and so begins anew each time.
    new = np.array(drawn["x1"]) - np.array(drawn["x0"]) == 0.5
    assert new.sum() == 2 + 13
    branch = shown.session["branch"]
    shown.until(lambda: shown.lines.get(f"range {branch} low 0") == 40, "the interval is drawn")
    found, truth = shown.trace("range band 0"), shown.trace("range truth")
    assert list(zip(found["low"], found["high"], strict=True)) == [tuple(row["range"]) for row in rows]
    assert truth["y"] == [row["truth"] for row in rows]


def what_a_method_does_not_have_is_not_shown(shown: SessionPage) -> None:
    """Without particles there is no panel of their number and no line of it; the threshold is found by its role."""
    shown.until(lambda: shown.plots == ["hypotheses", "tree", "range", "sigma"], "only these panels are there")
    shown.until(lambda: readings(shown) == ["estimate", "most probable", "range", "step"], "and only these readings")
    shown.until(lambda: "threshold" in shown.plot("sigma").inner_text(), "the threshold is told")
    threshold = shown.trace("thresholds")
    assert set(threshold["y"]) == {0.3}


def a_node_of_the_tree_is_shown_in_its_frame(shown: SessionPage, server: Server) -> None:
    """A click goes to the frame of a hypothesis and shows it, arrows choose another one, and no branch comes of it."""
    rows = server.column(shown.id, "series")
    count = sum(len(row["bank"]["weights"]) for row in rows)
    shown.until(lambda: len((shown.trace("tree") or {"y": []})["y"]) == count, "all possibilities are drawn")
    way, edges = shown.trace("tree way"), shown.trace("tree edges")
    # From frame 39 back to 31, whose best comes from the mirror image, which comes from the first, and so on.
    expected = [2 if frame % 10 == 0 and frame < 39 else 1 for frame in range(39, -1, -1)]
    assert [way["x"], way["y"]] == [list(range(39, -1, -1)), expected]
    assert len(edges["links"]) == count - 2

    shown.plot("tree").locator(".figure-plot").click(position=shown.place_in("tree", 20, 2))
    shown.stands_at(20)
    shown.until(lambda: shown.session["parameters"]["shown"] == 2, "the second possibility is shown")
    ring = lambda: shown.trace("tree shown") or {"x": []}  # noqa: E731
    shown.until(lambda: (ring()["x"], ring().get("y")) == ([20], [2]), "it has a ring")
    tree = shown.page.get_by_role("slider", name="shown hypothesis")
    shown.until(lambda: tree.input_value() == "2", "it is told to who cannot see it")
    tree.press("ArrowUp")
    shown.until(lambda: shown.session["parameters"]["shown"] == 1, "the arrow chooses the one above")
    tree.press("ArrowUp")
    assert len(shown.session["branches"]) == 1
    assert shown.position == 20
