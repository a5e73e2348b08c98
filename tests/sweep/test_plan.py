"""Plans: every run has its number, and its number says everything of it."""

import json
from collections.abc import Mapping
from dataclasses import replace
from itertools import product

import pytest

from pftrack.sweep import Plan
from pftrack.sweep.axis import Axis, SweepError
from pftrack.sweep.cells import quantity_named
from pftrack.sweep.plan import Single
from pftrack.sweep.work import sweep_code

WIDTHS = Axis("occlusion_width_px", (10.0, 20.0, 30.0))
LAYOUTS = Axis("layout", (0, 5))


def test_runs_are_numbered_by_condition_trial_and_tracker() -> None:
    """The last axis is the fastest, then trials, then trackers within a trial."""
    plan = Plan("ball", (WIDTHS, LAYOUTS), ("h-spf", "apf"), trials=2, frames=10)
    assert (plan.conditions, plan.runs, plan.shape) == (6, 24, (3, 2))
    expected = product(WIDTHS.values, LAYOUTS.values, range(2), ("h-spf", "apf"))
    for number, (width, layout, trial, tracker) in enumerate(expected):
        single = plan.single(number)
        assert single.recipe.timeline[0].values == {"occlusion_width_px": width, "layout": layout}
        assert (single.number, single.trial, single.recipe.tracker, single.recipe.frames) == (
            number,
            trial,
            tracker,
            10,
        )
    with pytest.raises(SweepError, match="between 0 and 23, got 24"):
        plan.single(24)


def seeds_of(plan: Plan) -> dict[tuple[object, ...], int]:
    runs = (plan.single(number) for number in range(plan.runs))
    return {(*sorted(values_of(run).items()), run.trial, run.recipe.tracker): run.recipe.seed for run in runs}


def values_of(run: Single) -> Mapping[str, object]:
    return run.recipe.timeline[0].values


def test_a_seed_depends_on_condition_and_trial_alone() -> None:
    """Other values of an axis, the order of axes and values, more trials and other trackers do not move it."""
    small = seeds_of(Plan("ball", (WIDTHS, LAYOUTS), ("h-spf",), trials=2))
    wider = Axis("occlusion_width_px", (30.0, 25.0, 20.0, 10.0))
    large = seeds_of(Plan("ball", (LAYOUTS, wider), ("apf", "h-spf"), trials=3))
    assert all(large[key] == seed for key, seed in small.items())


def test_trackers_share_seeds_and_cells_do_not() -> None:
    """All trackers meet the same scene, and no two scenes are the same; seeds are exact in JSON and JavaScript."""
    seeds = seeds_of(Plan("ball", (WIDTHS, LAYOUTS), ("h-spf", "apf", "s-spf"), trials=5))
    assert len(set(seeds.values())) == len(seeds) / 3
    assert all(0 <= seed < 2**48 for seed in seeds.values())
    for key, seed in seeds.items():
        assert seeds[(*key[:-1], "apf")] == seed


def test_the_seed_of_the_plan_moves_all_seeds() -> None:
    """Another seed gives other runs throughout."""
    first, second = (seeds_of(Plan("ball", (WIDTHS,), ("apf",), seed=seed)) for seed in (0, 1))
    assert not set(first.values()) & set(second.values())


def test_seeds_stay_what_they_are() -> None:
    """A published seed must not change with a later version."""
    plan = Plan("ball", (Axis("occlusion_width_px", (30.0,)),), ("h-spf",), trials=2, seed=7)
    assert [plan.single(number).recipe.seed for number in range(2)] == [118270177670406, 191187609328111]


def test_an_axis_of_trackers_names_the_trackers() -> None:
    """It multiplies like any other, and is no axis of a map."""
    plan = Plan("ball", (Axis("tracker", ("apf", "h-spf")), WIDTHS), trials=2)
    assert plan.trackers == ("apf", "h-spf")
    assert plan.axes == (WIDTHS,)
    assert plan.runs == 12


def test_a_plan_survives_json() -> None:
    """What is written is what is read, kinds of values included."""
    plan = Plan(
        "ball",
        (WIDTHS, LAYOUTS, Axis("learn_dynamics", (True, False)), Axis("apf_weights", ("corrected",))),
        ("h-spf",),
        trials=4,
        seed=2**53 - 1,
        frames=33,
        values={"sample_count": 100, "image_width_px": 128},
    )
    again = Plan.from_dict(json.loads(json.dumps(plan.as_dict())))
    assert again == plan
    assert [again.single(number) for number in range(8)] == [plan.single(number) for number in range(8)]


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"experiment": "balls"}, "got 'balls'"),
        ({"axes": (WIDTHS, WIDTHS)}, "the axis occlusion_width_px can be given only once"),
        ({"axes": (Axis("tracker", ("apf",)),)}, "the trackers can be given only once"),
        ({"axes": (Axis("occlusion_width_px", ()),)}, "is empty"),
        ({"trackers": ("nobody",)}, "a tracker of ball is one of"),
        ({"trackers": ("apf", "apf")}, "twice"),
        ({"trials": 0}, "trials must be a whole number between 1 and 2000000, got 0"),
        ({"trials": True}, "trials must be a whole number"),
        ({"seed": -1}, "seed must be a whole number"),
        ({"frames": -5}, "frames must be a whole number"),
        ({"values": {"occlusion_width_px": 5.0}}, "is an axis of the sweep and cannot have a fixed value"),
        ({"values": {"sample_count": 0}}, "sample_count must be a whole number between 1 and 100000, got 0"),
        ({"values": {"sampel_count": 5}}, "did you mean sample_count"),
        ({"values": {"tracker": "apf"}}, "tracker is not a fixed value"),
        ({"trials": 400_000}, "3 occlusion_width_px x 2 trackers x 400,000 trials are 2,400,000"),
        ({"values": {"gamma_min_px": 30.0}}, "every condition of the sweep is impossible"),
    ],
)
def test_an_impossible_plan_is_refused(changes: dict[str, object], reason: str) -> None:
    """One sentence says what is wrong before anything is computed."""
    given: dict[str, object] = {"experiment": "ball", "axes": (WIDTHS,), "trackers": ("h-spf", "apf"), **changes}
    with pytest.raises(SweepError) as refused:
        Plan(**given)  # type: ignore[arg-type]
    assert reason in str(refused.value)


@pytest.mark.parametrize(
    ("changes", "reason", "field"),
    [
        ({"axes": None}, "lacks axes", "axes"),
        ({"axes": 5}, "has axes in another form", "axes"),
        ({"axes": [{"name": "layout"}]}, "has axes.0.values in another form", "axes.0.values"),
        ({"axes": [{"name": "layout", "values": [20]}]}, "layout must be a whole number", "axes.0.values"),
        ({"trackers": ["nobody"]}, "a tracker of ball is one of", "trackers"),
        ({"values": {"layout": 20}}, "layout must be a whole number", "values.layout"),
        ({"trials": "2"}, "trials must be a whole number", "trials"),
    ],
)
def test_a_wrong_description_is_refused_with_its_field(changes: dict[str, object], reason: str, field: str) -> None:
    """A plan that lacks something, or has it in another form or out of bounds, is refused, and the error says where."""
    raw = {**Plan("ball", (WIDTHS,)).as_dict(), **changes}
    with pytest.raises(SweepError, match=reason) as refused:
        Plan.from_dict({name: value for name, value in raw.items() if value is not None})
    assert refused.value.field == field


def test_how_probable_a_loss_is_is_a_measure_where_it_is_asked_for() -> None:
    """The plan says so in its text, a plan without says nothing of it, and where no tracker can tell it is refused."""
    plain = Plan("ball", (WIDTHS,), ("h-spf", "apf"))
    asked = replace(plain, loss_probability=True)
    assert [one.name for one in asked.measures] == [*(one.name for one in plain.measures), "mean_loss_probability"]
    assert "loss_probability" not in plain.as_dict()
    assert Plan.from_dict(json.loads(json.dumps(asked.as_dict()))) == asked
    assert "--loss-probability" in sweep_code(asked).command
    assert quantity_named(asked, "mean_loss_probability").better == "lower"
    with pytest.raises(SweepError, match=r"kalman of sine cannot tell how probable .* none can"):
        Plan("sine", trackers=("kalman",), loss_probability=True)
