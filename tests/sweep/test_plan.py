"""Plans of sweeps: their axes, the numbers of their runs, and the chunks in which these are computed."""

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.model.parameters import declarations
from pftrack.experiments import find
from pftrack.sweep import Plan
from pftrack.sweep.axis import Axis, SweepError, parse_axis
from pftrack.sweep.cells import quantity_named
from pftrack.sweep.table import Chunks
from pftrack.sweep.work import sweep_code

WIDTHS = Axis("occlusion_width_px", (10.0, 20.0, 30.0))
LAYOUTS = Axis("layout", (0, 5))


def test_runs_are_numbered_by_condition_trial_and_tracker() -> None:
    """The last axis is the fastest, then trials, then trackers, which an axis may name, within a trial."""
    plan = Plan("ball", (WIDTHS, LAYOUTS), ("h-spf", "apf"), trials=2, frames=10)
    assert Plan("ball", (Axis("tracker", ("h-spf", "apf")), WIDTHS, LAYOUTS), trials=2, frames=10) == plan
    assert (plan.conditions, plan.runs, plan.shape) == (6, 24, (3, 2))
    expected = product(WIDTHS.values, LAYOUTS.values, range(2), ("h-spf", "apf"))
    for number, (width, layout, trial, tracker) in enumerate(expected):
        single = plan.single(number)
        assert single.recipe.timeline[0].values == {"occlusion_width_px": width, "layout": layout}
        told = single.number, single.trial, single.recipe.tracker, single.recipe.frames
        assert told == (number, trial, tracker, 10)
    with pytest.raises(SweepError, match="between 0 and 23, got 24"):
        plan.single(24)


def seeds_of(plan: Plan) -> dict[tuple[object, ...], int]:
    runs = (plan.single(number) for number in range(plan.runs))
    return {
        (*sorted(run.recipe.timeline[0].values.items()), run.trial, run.recipe.tracker): run.recipe.seed for run in runs
    }


def test_a_seed_depends_on_condition_and_trial_alone() -> None:
    """Other values of an axis, the order of axes and values, more trials and other trackers do not move it.

    All trackers have the same scene, and no two scenes are alike; seeds are exact in JSON and JavaScript. Another seed
    of the plan gives other runs throughout; a published seed must not change with a later version.
    """
    small = seeds_of(Plan("ball", (WIDTHS, LAYOUTS), ("h-spf",), trials=2))
    wider = Axis("occlusion_width_px", (30.0, 25.0, 20.0, 10.0))
    large = seeds_of(Plan("ball", (LAYOUTS, wider), ("apf", "h-spf"), trials=3))
    assert all(large[key] == seed for key, seed in small.items())
    assert len(set(large.values())) == len(large) / 2
    assert all(0 <= seed < 2**48 and large[(*key[:-1], "apf")] == seed for key, seed in large.items())
    first, second = (seeds_of(Plan("ball", (WIDTHS,), ("apf",), seed=seed)) for seed in (0, 1))
    assert not set(first.values()) & set(second.values())
    published = seeds_of(Plan("ball", (Axis("occlusion_width_px", (30.0,)),), ("h-spf",), trials=2, seed=7))
    assert list(published.values()) == [118270177670406, 191187609328111]


def test_a_plan_survives_json() -> None:
    """What is written is what is read, kinds of values included."""
    axes = WIDTHS, LAYOUTS, Axis("learn_dynamics", (True, False)), Axis("apf_weights", ("corrected",))
    fixed = {"sample_count": 100, "image_width_px": 128}
    plan = Plan("ball", axes, ("h-spf",), trials=4, seed=2**53 - 1, frames=33, values=fixed)
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
        ({"values": {"occlusion_width_px": 5.0}}, "is an axis of the sweep and cannot have a fixed value"),
        ({"values": {"sample_count": 0}}, "sample_count must be a whole number between 1 and 100000, got 0"),
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


# Axes: what is written is what is swept, and what cannot be swept is refused with a sentence that names both sides.

BALL = find("ball")


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("occlusion_width_px=0:10:4", (0.0, 4.0, 8.0)),
        ("sample_count=50,100, 200", (50, 100, 200)),
        ("learn_dynamics=true,false", (True, False)),
        ("ball_colour=#c83232,#00ff00", ("#c83232", "#00ff00")),
        ("tracker=h-spf,s-spf", ("h-spf", "s-spf")),
    ],
)
def test_an_axis_is_what_was_written(text: str, values: tuple[object, ...]) -> None:
    """Both ends are included where they fall on the grid; values are of the parameter's own kind."""
    axis = parse_axis(BALL, text)
    assert axis.values == values
    assert [type(value) for value in axis.values] == [type(value) for value in values]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("oclusion_width_px=1,2", "no parameter 'oclusion_width_px'; did you mean occlusion_width_px"),
        ("xyz=1,2", "no parameter 'xyz'; `pftrack show ball` lists them"),
        ("occlusion_width_px=0:700:10", "occlusion_width_px must be a finite number between 0 and 640 px, got 700.0"),
        ("occlusion_width_px=", "the axis occlusion_width_px is empty"),
        ("occlusion_width_px=1,,2", "has an empty value"),
        ("occlusion_width_px=5:1:1", "never reaches 1 from 5 in steps of 1"),
        ("occlusion_width_px=1:5:0", "step of the axis occlusion_width_px must not be 0"),
        ("occlusion_width_px=1:5", "start:stop:step, 3 numbers, got 2"),
        ("occlusion_width_px=a:b:c", "3 numbers, got 'a:b:c'"),
        ("occlusion_width_px=0:640:0.00005", "2,000,000 runs; the axis occlusion_width_px has 12,800,001 values"),
        ("occlusion_width_px=nan,1", "got nan"),
        ("occlusion_width_px=5,5.0", "has the value 5.0 twice"),
        ("sample_count=50:100:0.5", "sample_count must be a whole number between 1 and 100000, got 50.5"),
        ("apf_weights=sharp", "must be one of sharpened, corrected"),
        ("tracker=h-spf,kalman-x", "a tracker of ball is one of"),
        ("occlusion_width_px", "an axis is name=start:stop:step or name=a,b,c"),
    ],
)
def test_an_impossible_axis_is_refused(text: str, reason: str) -> None:
    """One sentence says what is wrong and what would be right."""
    with pytest.raises(SweepError) as refused:
        parse_axis(BALL, text)
    assert reason in str(refused.value)
    assert "\n" not in str(refused.value)


def test_every_parameter_can_be_an_axis() -> None:
    """Every declared parameter of every experiment takes an axis that holds its default, but for files."""
    for name in ("ball", "sine"):
        experiment = find(name)
        for declaration in declarations(type(experiment.simulate().parameters)):
            if declaration.kind == "file":
                with pytest.raises(SweepError, match="is a file parameter, which cannot be varied"):
                    parse_axis(experiment, f"{declaration.name}=text")
                continue
            axis = parse_axis(experiment, f"{declaration.name}={declaration.default}")
            assert axis.values == (declaration.default,), declaration.name


@given(st.integers(0, 400), st.integers(0, 80), st.integers(1, 40))
def test_steps_are_exact(start: int, steps: int, tenths: int) -> None:
    """A value is the nearest number to what was written, not what adding up makes of it."""
    steps = min(steps, (640 - start) * 10 // tenths)
    stop = start + steps * tenths / 10
    axis = parse_axis(BALL, f"occlusion_width_px={start}:{stop:.1f}:{tenths / 10}")
    assert axis.values == tuple(float(f"{start + index * tenths / 10:.1f}") for index in range(steps + 1))


# Chunks: every run is in one chunk, in order, and they are computed evenly over the grid.


def plan_of(widths: int, radii: int, trackers: int, trials: int) -> Plan:
    counts = {"occlusion_width_px": widths, "distracter_radius_px": radii}
    axes = tuple(Axis(name, tuple(map(float, range(count)))) for name, count in counts.items())
    return Plan("ball", axes, ("h-spf", "s-spf", "apf")[:trackers], trials=trials)


@given(st.integers(1, 7), st.integers(1, 7), st.integers(1, 3), st.integers(1, 9), st.floats(0.1, 500))
def test_chunks_cover_the_plan(widths: int, radii: int, trackers: int, trials: int, wanted: float) -> None:
    """Chunks are contiguous ranges of runs, one after the other, of whole trials, and none is much too large."""
    plan = plan_of(widths, radii, trackers, trials)
    chunks, expected = Chunks.of(plan, wanted), 0
    for number, chunk in enumerate(chunks):
        assert (chunk.number, chunk.first) == (number, expected)
        assert chunk.runs == sum((piece.stop - piece.start) * trackers for piece in chunk.pieces)
        assert chunk.runs <= max(wanted, trackers)
        piece = chunk.pieces[0]
        assert chunk.first == (piece.condition * trials + piece.start) * trackers
        expected += chunk.runs
    assert expected == plan.runs
    assert sorted(chunks.spread()) == list(range(len(chunks)))


def test_a_map_fills_evenly() -> None:
    """At any time every row, column and quarter of the map has about its share of the cells."""
    chunks = Chunks.of(plan_of(20, 20, 1, 1), 1)
    for part in (0.1, 0.25, 0.5):
        done = np.zeros((20, 20))
        done.ravel()[chunks.spread()[: int(400 * part)]] = 1
        for axis in (0, 1):
            assert np.abs(done.mean(axis=axis) - part).max() <= 0.11
        quarters = done.reshape(2, 10, 2, 10).mean(axis=(1, 3))
        assert np.abs(quarters - part).max() <= 0.05
    with pytest.raises(IndexError, match="there are 400 chunks, got 400"):
        chunks[400]
