"""Parameters and the refusals of their values."""

import importlib
import pickle
import zipfile
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Literal

import pytest
from pydantic import BaseModel, ValidationError, create_model, model_validator

from pftrack.core.model.parameters import (
    Parameters,
    declarations,
    flat,
    limit_particles,
    nearest,
    parameter,
    parse,
    revise,
    with_role,
)
from pftrack.core.refusal import ConflictError, ParameterError, RefusedError, first_problem
from pftrack.experiments.ball.experiment import RecordedBallParameters
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
        ("count", -1, "between 1 and 100"),
        ("count", 10**9, "between 1 and 100"),
        ("count", float("nan"), "whole number"),
        ("count", "abc", "whole number"),
        ("count", 1.5, "whole number"),
        ("count", None, "whole number"),
        ("count", True, "whole number"),
        ("width_px", True, "finite number"),
        ("width_px", float("inf"), "finite number between 0 and 10 px"),
        ("width_px", float("nan"), "finite number between 0 and 10 px"),
        ("width_px", -0.1, "between 0 and 10 px"),
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
    assert (repr(value) if "\n" not in str(value) else "a text of 3 characters") in str(caught.value)


def test_what_was_dragged_becomes_the_nearest_that_is_allowed() -> None:
    """A number comes within its bounds and onto its step; whatever else there is stays for `revise` to refuse."""
    dragged = {"count": 7.6, "width_px": 3.3, "mode": "c", "on": 1, "unknown": 5}
    assert nearest(Model, dragged) == {"count": 8, "width_px": 3.5, "mode": "c", "on": 1, "unknown": 5}
    assert nearest(Model, {"count": -4.0, "width_px": 99}) == {"count": 1, "width_px": 10.0}
    assert isinstance(nearest(Model, {"count": 7.6})["count"], int)
    assert nearest(Model, {"width_px": float("inf"), "count": float("nan")})["width_px"] == float("inf")


def test_a_refused_file_is_not_quoted() -> None:
    """Of the content of a file the message says how long it is; a long line is shortened."""
    assert str(ParameterError("learned", "{\n}", "a learned motion")).endswith("got a text of 3 characters")
    assert str(ParameterError("name", "a" * 80, "short")).endswith("aaa...")


def test_revision_is_whole_and_leaves_the_original() -> None:
    """A revision changes what was asked for and nothing else."""
    before = Model()
    after = revise(before, {"count": 9, "mode": "b"})
    assert flat(after) == {**flat(before), "count": 9, "mode": "b"}
    assert before == Model()


def test_text_is_read_by_kind() -> None:
    """Text from a command line becomes a value of the declared kind, or is refused."""
    read = {name: parse(Model, name, text) for name, text in {"count": "12", "on": "Yes", "mode": "b"}.items()}
    assert read == {"count": 12, "on": True, "mode": "b"}
    assert read["on"] is True
    assert parse(Model, "width_px", "1e-1") == pytest.approx(0.1)
    for name, text in (("count", "1.5"), ("on", "perhaps"), ("nothing", "1")):
        with pytest.raises(ParameterError):
            parse(Model, name, text)


def test_equal_parameters_hash_alike() -> None:
    """Parameters serve as keys: equal ones hash alike, also after the hash was kept."""
    first, second = Model(count=5), Model(count=5)
    assert hash(first) == hash(first) == hash(second)
    assert first == second
    assert len({first, second, Model()}) == 2


def test_thresholds_are_ordered() -> None:
    """A lower threshold above the upper one is refused, whichever of the two was changed."""
    parameters = RecordedBallParameters()
    for changes in ({"gamma_min_px": 30}, {"gamma_max_px": 1}):
        with pytest.raises(ParameterError, match="gamma_min_px must be at most gamma_max_px"):
            revise(parameters, changes)


class Crowd(Parameters):
    count: int = parameter(50, "Count", "", within=(1, 1000, 1), role="particles", sets=11, trackers=("layered",))
    joint: int = parameter(500, "Joint", "", within=(1, 10_000, 1), role="particles", trackers=("joint",))
    other: int = parameter(9999, "Other", "A number of something else.", within=(1, 10_000, 1))


def test_roles_find_declarations() -> None:
    """General code finds parameters by what they are for, not by name."""
    assert [declaration.name for declaration in with_role(Crowd, "particles")] == ["count", "joint"]
    assert with_role(Crowd, "loss_share") == ()


@pytest.mark.parametrize(
    ("tracker", "most", "refused"),
    [("layered", 550, ""), ("layered", 549, "count"), ("joint", 500, ""), ("joint", 499, "joint"), ("kalman", 1, "")],
)
def test_particles_are_limited(tracker: str, most: int, refused: str) -> None:
    """A limit on particles holds for all sets together, and only for the numbers that the tracker reads."""
    with pytest.raises(ParameterError) if refused else nullcontext() as error:
        limit_particles(declarations(Crowd), flat(Crowd()), tracker, most)
    assert not refused or error.value.field == refused


NO_BOUNDS = "the number 'Width' must be declared with bounds"
NO_RANGE = "the useful range of 'Width' must lie within 0 to 9 and hold the default, 2"
NO_ROLE = "a threshold and no other role names a series"


@pytest.mark.parametrize(
    ("default", "declared", "sentence"),
    [
        (2, {}, NO_BOUNDS),
        (2.5, {}, NO_BOUNDS),
        *((2, {"within": (0, 9, 1), "useful": useful}, NO_RANGE) for useful in ((-1, 5), (0, 10), (3, 5), (0, 1))),
        (1.0, {"role": "threshold", "threshold_of": ""}, NO_ROLE),
        (1.0, {"role": "particles", "threshold_of": "sigma"}, NO_ROLE),
        (1.0, {"role": "", "threshold_of": "sigma"}, NO_ROLE),
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


def test_a_file_has_a_kind_of_its_own() -> None:
    """The text of a file is declared as such, so that a page can tell it from a value."""
    known = {declaration.name: declaration for declaration in declarations(Model)}
    assert (known["text"].kind, known["text"].accept) == ("file", ".txt")
    assert (known["count"].kind, known["colour"].kind, known["mode"].kind) == ("integer", "colour", "choice")
    assert revise(Model(), {"text": "a"}).text == "a"
    with pytest.raises(ParameterError, match="of at most 100000 characters"):
        revise(Model(), {"text": "a" * 100_001})


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


CODE = '''from pftrack.core.model.parameters import Parameters, parameter

class Zipped(Parameters):
    on: bool = parameter(False, "On")
    """Whether it is on."""
    off: bool = parameter(False, "Off", "Whether it is off.")
'''


def test_docstrings_need_the_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A class in a zip file has its help; one without source has only descriptions that are given."""
    with zipfile.ZipFile(tmp_path / "package.zip", "w") as package:
        package.writestr("zipped.py", CODE)
    monkeypatch.syspath_prepend(tmp_path / "package.zip")
    assert help_of(importlib.import_module("zipped").Zipped) == {"on": "Whether it is on.", "off": "Whether it is off."}
    known: dict[str, Any] = {"__name__": "nowhere"}
    exec(CODE, known)  # noqa: S102 - our own lines
    assert help_of(known["Zipped"]) == {"on": "", "off": "Whether it is off."}


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
