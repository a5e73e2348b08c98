"""What a page is told of a timeline."""

from typing import Any

from pftrack.model.parameters import Declaration
from pftrack.model.recipe import Recipe
from pftrack.runs.run import Change
from pftrack_server.schemas.spec import BranchSpec
from pftrack_server.sessions.timeline_view import threshold_views, timeline_view

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


def branch(*changes: tuple[int, dict[str, Any]], **more: Any) -> BranchSpec:
    timeline = tuple(Change(frame, values) for frame, values in changes)
    recipe = Recipe(experiment="ball", tracker="hard", timeline=timeline)
    return BranchSpec(id="b0", title="Main", tracker="hard", recipe=recipe, **more)


def test_a_change_is_told_with_what_it_replaced() -> None:
    """Each change names the values before it: those of the beginning, the defaults, or those of the change before."""
    told = timeline_view(
        branch(
            (0, {"gate": 4.0}),
            (10, {"gate": 3.0, "count": 200}),
            (20, {"gate": 2.0, "tracker": "soft"}),
            first_values={"gate": 4.0},
        ),
        DECLARATIONS,
    )
    assert [change.before for change in told] == [
        {},
        {"gate": 4.0, "count": 800},
        {"gate": 3.0, "tracker": "hard"},
    ]


def test_a_threshold_holds_while_its_tracker_is_in_charge() -> None:
    """A threshold has a step for each change, and none where another tracker is in charge; others are not told."""
    (view,) = threshold_views(branch((10, {"gate": 3.0}), (20, {"tracker": "soft"})), DECLARATIONS)
    assert (view.name, view.of) == ("gate", "sigma")
    assert [(step.frame, step.value) for step in view.steps] == [(0, 5.0), (10, 3.0), (20, None)]
    assert threshold_views(branch((0, {"tracker": "soft"})), DECLARATIONS) == []


def test_a_run_without_changes_has_its_thresholds() -> None:
    """Without any change the value of the beginning holds from the first frame on."""
    (view,) = threshold_views(branch(first_values={"gate": 7.0}), DECLARATIONS)
    assert [(step.frame, step.value) for step in view.steps] == [(0, 7.0)]
