"""Refusals: their sentences, and their fields on the way between processes."""

import pickle

import pytest
from pydantic import BaseModel, ValidationError, model_validator

from pftrack.core.refusal import ConflictError, ParameterError, RefusedError, first_problem
from pftrack.experiments.own.code import FilterFileError


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
    """What pydantic has wrapped comes out again; of anything else the first problem is returned."""
    with pytest.raises(ValidationError) as even:
        _Odd(count=2)
    with pytest.raises(ParameterError, match="count must be odd, got 2"):
        first_problem(even.value.errors())
    with pytest.raises(ValidationError) as none:
        _Odd(count="many")
    assert first_problem(none.value.errors())["loc"] == ("count",)


def test_any_refusal_of_a_validator_is_raised_as_it_is() -> None:
    """Not only that of a value."""
    error = FilterFileError("own.py", 3, "the name x is not defined")
    wrapped = [{"type": "value_error", "loc": (), "ctx": {"error": error}}, {"type": "missing", "loc": ("a",)}]
    with pytest.raises(FilterFileError) as raised:
        first_problem(wrapped)
    assert raised.value is error
