"""Parameters and the refusals of their values."""

import pickle
from typing import Any, Literal

import pytest
from pydantic import BaseModel, ValidationError, create_model, model_validator

from pftrack.core.model.parameters import Parameters, declarations, limit_particles, nearest, parameter, parse, revise
from pftrack.core.refusal import ConflictError, ParameterError, RefusedError, first_problem
from pftrack.experiments.own.code import FilterFileError


class Model(Parameters):
    """Parameters of every kind."""

    count: int = parameter(8, "Count", "How many.", within=(1, 100, 1))
    width_px: float = parameter(2.5, "Width", "How wide.", unit="px", within=(0, 10, 0.5))
    mode: Literal["a", "b"] = parameter("a", "Mode", "Which way.")
    on: bool = parameter(False, "On")
    """Whether it is on,
    in every frame."""
    colour: str = parameter("#ffffff", "Colour", "Which colour.", colour=True)
    text: str = parameter("", "Text", "What a file says.", accept=".txt")


@pytest.mark.parametrize(
    ("name", "value", "bound"),
    [
        ("count", 0, "between 1 and 100"),
        ("count", 10**9, "between 1 and 100"),
        ("count", float("nan"), "whole number"),
        ("count", 1.5, "whole number"),
        ("count", True, "whole number"),
        ("width_px", True, "finite number"),
        ("width_px", float("nan"), "finite number between 0 and 10 px"),
        ("mode", "c", "one of a, b"),
        ("on", "maybe", "true or false"),
        ("colour", "red", "#rrggbb"),
        ("text", 5, "the text of a file .txt of at most 100000 characters, or nothing"),
        ("unknown", 1, "known parameter"),
    ],
)
def test_refusals_name_field_bound_and_value(name: str, value: object, bound: str) -> None:
    """A value that cannot be accepted is refused with its field, what is allowed and what was given."""
    with pytest.raises(ParameterError) as caught:
        revise(Model(), {"width_px": 3, name: value})
    assert caught.value.field == name
    assert bound in str(caught.value)
    assert repr(value) in str(caught.value)


def test_a_refused_file_is_not_quoted() -> None:
    """For the content of a file the message says how long it is; a long line is shortened."""
    assert str(ParameterError("learned", "{\n}", "a learned motion")).endswith("got a text of 3 characters")
    assert str(ParameterError("name", "a" * 80, "short")).endswith("aaa...")


def test_what_was_dragged_becomes_the_nearest_that_is_allowed() -> None:
    """A number comes within its bounds and onto its step; whatever else there is stays for `revise` to refuse."""
    dragged = {"count": 7.6, "width_px": 3.3, "mode": "c", "on": 1, "unknown": 5}
    assert nearest(Model, dragged) == {"count": 8, "width_px": 3.5, "mode": "c", "on": 1, "unknown": 5}
    assert nearest(Model, {"count": -4.0, "width_px": 99}) == {"count": 1, "width_px": 10.0}
    assert isinstance(nearest(Model, {"count": 7.6})["count"], int)
    assert nearest(Model, {"width_px": float("inf"), "count": float("nan")})["width_px"] == float("inf")


def test_text_is_read_by_kind() -> None:
    """Text from a command line becomes a value of the declared kind, or is refused."""
    read = {name: parse(Model, name, text) for name, text in {"count": "12", "on": "Yes", "mode": "b"}.items()}
    assert read == {"count": 12, "on": True, "mode": "b"}
    assert read["on"] is True
    assert parse(Model, "width_px", "1e-1") == pytest.approx(0.1)
    for name, text in (("count", "1.5"), ("on", "perhaps"), ("nothing", "1")):
        with pytest.raises(ParameterError):
            parse(Model, name, text)


class Crowd(Parameters):
    count: int = parameter(50, "Count", "", within=(1, 1000, 1), role="particles", sets=11, trackers=("layered",))
    joint: int = parameter(500, "Joint", "", within=(1, 10_000, 1), role="particles", trackers=("joint",))
    other: int = parameter(9999, "Other", "A number of something else.", within=(1, 10_000, 1))


CROWD = {"count": 50, "joint": 500, "other": 9999}


def test_particles_are_limited() -> None:
    """A limit on particles holds for all sets together, and only for the numbers that the tracker reads."""
    for tracker, most, field in (("layered", 550, "count"), ("joint", 500, "joint")):
        limit_particles(declarations(Crowd), CROWD, tracker, most)
        with pytest.raises(ParameterError) as refused:
            limit_particles(declarations(Crowd), CROWD, tracker, most - 1)
        assert refused.value.field == field
    limit_particles(declarations(Crowd), CROWD, "kalman", 1)


NO_BOUNDS = "the number 'Width' must be declared with bounds"
NO_RANGE = "the useful range of 'Width' must lie within 0 to 9 and hold the default, 2"
NO_ROLE = "a threshold and no other role names a series"


@pytest.mark.parametrize(
    ("default", "declared", "sentence"),
    [
        (2, {}, NO_BOUNDS),
        *((2, {"within": (0, 9, 1), "useful": useful}, NO_RANGE) for useful in ((-1, 5), (0, 10), (3, 5))),
        (1.0, {"role": "threshold", "threshold_of": ""}, NO_ROLE),
        (1.0, {"role": "particles", "threshold_of": "sigma"}, NO_ROLE),
    ],
)
def test_what_every_page_rests_on_is_declared(default: float, declared: dict[str, Any], sentence: str) -> None:
    """A number has bounds, a useful range lies within them and holds the default; only a threshold names a series."""
    with pytest.raises(ValueError, match=sentence):
        parameter(default, "Width", "How wide.", **declared)
    for other in (True, "text"):
        parameter(other, "Width", "How wide.")


def test_a_class_declares_group_and_readers_of_its_fields() -> None:
    """A field may say otherwise, and an inherited one keeps what its own class says."""

    class Base(Parameters, group="Base", trackers=("kalman",)):
        one: bool = parameter(False, "One", "One.")
        other: bool = parameter(False, "Other", "Other.", group="Another", trackers=())

    class Derived(Base, group="Derived"):
        more: int = parameter(4, "More", "More.", within=(0, 100, 1), useful=(0, 9))

    known = {each.name: each for each in declarations(Derived)}
    assert {name: (each.group, each.trackers) for name, each in known.items()} == {
        "one": ("Base", ("kalman",)),
        "other": ("Another", ()),
        "more": ("Derived", ()),
    }
    assert (known["more"].useful, known["more"].maximum, known["one"].useful) == ((0, 9), 100, None)


def test_a_former_parameter_is_accepted_with_the_value_of_its_constant() -> None:
    """A recipe of before may name it; any other value is refused in one sentence, and so is an unknown name."""

    class Base(Parameters, constants={"passes": 2}):
        one: bool = parameter(False, "One", "One.")

    class Derived(Base, constants={"tightened": True}):
        pass

    assert revise(Derived(), {"passes": 2, "tightened": True, "one": True}) == Derived(one=True)
    with pytest.raises(ParameterError, match=r"^passes must be 2: it is a constant now, got 3$"):
        revise(Derived(), {"passes": 3})
    with pytest.raises(ParameterError, match="tightened must be the value of a known parameter"):
        revise(Base(), {"tightened": True})


class Heir(Model):
    """Declares two fields of its base anew."""

    on: bool = parameter(True, "On")
    """Whether it is off."""
    count: int = parameter(9, "Count", within=(1, 100, 1))


def help_of(model: type[Parameters]) -> dict[str, str]:
    return {it.name: it.description for it in declarations(model)}


def test_the_docstring_below_a_field_describes_it() -> None:
    """It is read as one line, in declarations as in the schema; a description that is given has precedence.

    A field that is declared anew needs its own docstring; classes that are made of others keep theirs.
    """
    known, heirs = help_of(Model), help_of(Heir)
    assert (known["mode"], known["on"]) == ("Which way.", "Whether it is on, in every frame.")
    assert Model.model_json_schema()["properties"]["on"]["description"] == known["on"]
    made = create_model("Made", __base__=Heir, more=(int, parameter(1, "More", "How many more.", within=(0, 2, 1))))
    assert (heirs["mode"], heirs["on"], heirs["count"]) == ("Which way.", "Whether it is off.", "")
    assert help_of(made) == {**heirs, "more": "How many more."}


# Refusals: their sentences, and their fields on the way between processes.


class _Odd(BaseModel):
    count: int

    @model_validator(mode="after")
    def _is_odd(self) -> "_Odd":
        if self.count % 2 == 0:
            raise ParameterError("count", self.count, "odd")
        return self


@pytest.mark.parametrize(
    "error",
    [
        RefusedError("The sweep is too large.", field="trials", bound="at most 10 runs", value=11),
        ConflictError("the run ends at frame 9"),
        ParameterError("frame", 12, "a frame of the run, 0 to 9"),
        FilterFileError("own.py", 3, "the name x is not defined"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_a_refusal_travels_whole(error: RefusedError) -> None:
    """Between processes it keeps its sentence and all that a page needs to point at the wrong field."""
    again = pickle.loads(pickle.dumps(error))  # noqa: S301 - our own
    assert (type(again), str(again), vars(again)) == (type(error), str(error), vars(error))


def test_the_refusal_of_a_validator_is_raised_as_it_is() -> None:
    """What pydantic has wrapped comes out again, a value's or any other; else the first problem is returned."""
    with pytest.raises(ValidationError) as even:
        _Odd(count=2)
    with pytest.raises(ParameterError, match="count must be odd, got 2"):
        first_problem(even.value.errors())
    with pytest.raises(ValidationError) as none:
        _Odd(count="many")
    assert first_problem(none.value.errors())["loc"] == ("count",)
    error = FilterFileError("own.py", 3, "the name x is not defined")
    wrapped = [{"type": "value_error", "loc": (), "ctx": {"error": error}}, {"type": "missing", "loc": ("a",)}]
    with pytest.raises(FilterFileError) as raised:
        first_problem(wrapped)
    assert raised.value is error
