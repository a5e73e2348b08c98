"""What a page is told of a timeline."""

from typing import Any

from pftrack.core.model.parameters import Declaration
from pftrack.core.model.recipe import Change
from pftrack_server.sessions.worker.description import threshold_views, timeline_view

DECLARATIONS = [
    Declaration(
        name="gate",
        title="Gate",
        description="",
        unit="",
        kind="number",
        default=5.0,
        role="threshold",
        threshold_of="sigma",
        trackers=("hard",),
    ),
    Declaration(name="count", title="Count", description="", unit="", kind="integer", default=800, role="particles"),
]


FIRST: dict[str, Any] = {"gate": 5.0, "count": 800, "tracker": "hard"}


def changes(*all_of_them: tuple[int, dict[str, Any]]) -> list[Change]:
    return [Change(frame, values) for frame, values in all_of_them]


def test_a_change_is_told_with_what_it_replaced() -> None:
    """Each change names the values before it: those of the beginning, or those of the change before."""
    told = timeline_view(
        changes((0, {"gate": 4.0}), (10, {"gate": 3.0, "count": 200}), (20, {"gate": 2.0, "tracker": "soft"})),
        {**FIRST, "gate": 4.0},
    )
    assert [change.before for change in told] == [
        {},
        {"gate": 4.0, "count": 800},
        {"gate": 3.0, "tracker": "hard"},
    ]


def test_what_was_moved_is_told_in_words() -> None:
    """It has no value before; one of the estimate is told without a particle."""
    moves = [{"particle": 7, "place": [312.0, 140.25]}, {"particle": None, "place": [0.42]}]
    (told,) = timeline_view(changes((10, {"gate": 3.0, "move": moves})), FIRST)
    assert told.moved == ["Particle 7 moved to (312, 140.2)", "Estimate moved to 0.42"]
    assert (told.values, told.before) == ({"gate": 3.0}, {"gate": 5.0})


def test_a_threshold_holds_while_its_tracker_is_in_charge() -> None:
    """A threshold has a step for each change, and none where another tracker is in charge; others are not told."""
    (view,) = threshold_views(changes((10, {"gate": 3.0}), (20, {"tracker": "soft"})), FIRST, DECLARATIONS)
    assert (view.name, view.of) == ("gate", "sigma")
    assert [(step.frame, step.value) for step in view.steps] == [(0, 5.0), (10, 3.0), (20, None)]
    assert threshold_views(changes((0, {"tracker": "soft"})), {**FIRST, "tracker": "soft"}, DECLARATIONS) == []
    (view,) = threshold_views([], {**FIRST, "gate": 7.0}, DECLARATIONS)
    assert [(step.frame, step.value) for step in view.steps] == [(0, 7.0)]
