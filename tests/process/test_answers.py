"""Answers as JSON: read as what was written, and refused otherwise, whatever they are."""

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.process import Fault, Refusal, Reply
from pftrack.process.calls import Answer, Step, pack, unpack

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats(allow_nan=False) | st.text() | st.binary(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=8,
)


@given(VALUES)
def test_a_result_comes_back(value: object) -> None:
    """Whatever JSON can say, and bytes anywhere in it, is read as it was written, to the last bit."""
    assert unpack(pack(Reply(value))) == Reply(value)


def test_no_value_is_taken_for_bytes() -> None:
    """What a file says is told from what was bytes, even if it copies the form of an answer that was seen before."""
    tag = pack(Reply(b""))[:16].decode()
    for value in ({"base64": "eHg="}, {tag: "eHg="}, {tag: "no base64"}):
        assert unpack(pack(Reply(value))) == Reply(value)


@pytest.mark.parametrize(
    "answer", [Refusal("the file is empty \udcff"), Fault("KeyError: 3", "Traceback"), Step((3, 7))]
)
def test_an_answer_comes_back(answer: Answer) -> None:
    """Refusals, faults and steps are answers as well."""
    assert unpack(pack(answer)) == answer


def test_a_number_of_numpy_is_a_number() -> None:
    """An experiment of another package need not know that its measures travel."""
    value = {"hits": np.int64(3), "share": np.float32(0.5), "success": np.bool_(True)}
    assert unpack(pack(Reply(value))) == Reply({"hits": 3, "share": 0.5, "success": True})


def test_what_is_no_number_comes_back() -> None:
    """A measure may be undefined."""
    read = unpack(pack(Reply(math.nan)))
    assert math.isnan(read.value)  # type: ignore[arg-type]


@pytest.mark.parametrize("answer", [Step(3), Reply(object()), Reply({1, 2})])
def test_what_cannot_be_said_is_refused(answer: Answer) -> None:
    """A task that returns something else is a mistake of ours, and noticed where it is made."""
    with pytest.raises(TypeError, match="not "):
        pack(answer)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"null",
        b"[]",
        b"{}",
        b'{"refusal": 3}',
        b'{"fault": ["a"], "traceback": "b"}',
        b'{"done": "1", "total": 2}',
        b'{"value": 1, "refusal": "b"}',
        b'{"value": {"0123456789abcdef": "=no="}}',
        b'{"value": {"0123456789abcdef": 7}}',
        b"\xff\xfe",
        b"[" * 100_000,
        b"1" * 10_000,
        pickle.dumps(Reply(1)),
    ],
)
def test_nonsense_is_refused(data: bytes) -> None:
    """Nothing but an answer is read as one, with its tag or without, and no other exception comes of it."""
    for text in (data, b"0123456789abcdef" + data):
        with pytest.raises(ValueError):  # noqa: PT011 - each parser has words of its own
            unpack(bytearray(text))


@given(st.binary())
def test_no_bytes_do_harm(data: bytes) -> None:
    """Random bytes are refused."""
    with pytest.raises(ValueError):  # noqa: PT011 - each parser has words of its own
        unpack(data)
