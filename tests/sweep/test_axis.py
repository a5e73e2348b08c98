"""Axes: what is written is what is swept, and what cannot be swept is refused with a sentence that names both sides."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.model.parameters import declarations
from pftrack.experiments import find
from pftrack.sweep.axis import SweepError, parse_axis

BALL = find("ball")


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("occlusion_width_px=5:100:5", tuple(float(width) for width in range(5, 101, 5))),
        ("background_level=0:0.5:0.1", (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)),
        ("occlusion_width_px=0:10:4", (0.0, 4.0, 8.0)),
        ("occlusion_width_px=10:0:-5", (10.0, 5.0, 0.0)),
        ("occlusion_width_px=3:3:1", (3.0,)),
        ("layout=0:19:1", tuple(range(20))),
        ("sample_count=50,100, 200", (50, 100, 200)),
        ("image_width_px=128,256", (128, 256)),
        ("apf_weights=sharpened,corrected", ("sharpened", "corrected")),
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
        ("occlusion_width_px=-5,5", "between 0 and 640 px, got -5.0"),
        ("occlusion_width_px=", "the axis occlusion_width_px is empty"),
        ("occlusion_width_px=1,,2", "has an empty value"),
        ("occlusion_width_px=5:1:1", "never comes from 5 to 1 in steps of 1"),
        ("occlusion_width_px=1:5:-1", "never comes from 1 to 5 in steps of -1"),
        ("occlusion_width_px=1:5:0", "step of the axis occlusion_width_px must not be 0"),
        ("occlusion_width_px=1:5", "start:stop:step, 3 numbers, got 2"),
        ("occlusion_width_px=1:nan:1", "3 finite numbers"),
        ("occlusion_width_px=a:b:c", "3 numbers, got 'a:b:c'"),
        (
            "occlusion_width_px=0:640:0.00005",
            "at most 2,000,000 runs; the axis occlusion_width_px has 12,800,001 values",
        ),
        ("occlusion_width_px=wide", "must be a finite number between 0 and 640 px, got 'wide'"),
        ("occlusion_width_px=nan,1", "got nan"),
        ("occlusion_width_px=5,5.0", "has the value 5.0 twice"),
        ("sample_count=50:100:0.5", "sample_count must be a whole number between 1 and 100000, got 50.5"),
        ("sample_count=50.5,60", "sample_count must be a whole number"),
        ("layout=20", "layout must be a whole number between 0 and 19, got 20"),
        ("apf_weights=sharp", "must be one of sharpened, corrected"),
        ("learn_dynamics=maybe", "must be true or false"),
        ("ball_colour=red", "must be a colour as #rrggbb"),
        ("tracker=h-spf,kalman-x", "a tracker of ball is one of"),
        ("occlusion_width_px", "an axis is name=start:stop:step or name=a,b,c"),
        ("=1,2", "an axis is name="),
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
