"""What a lecturer's page sends: what cannot be told to the class is refused before it is kept."""

import json
from typing import Any

import pytest
from pydantic import BaseModel, ValidationError

from pftrack_server.sessions.duplex import encode
from pftrack_server.teaching.messages import FollowCreate, FollowUpdate, PollCreate


class Told(BaseModel):
    """Any message that carries an arrangement."""

    arrangement: dict[str, Any]


@pytest.mark.parametrize(
    "arrangement",
    [
        {"x": "\ud800"},
        {"\ud800": 1},
        {"x": "y" * 17_000},
        {"x": ["\N{SNOWMAN}" * 6_000]},
        {"x": json.loads("[" * 900 + "]" * 900)},
    ],
)
def test_arrangements_that_cannot_be_passed_on(arrangement: dict[str, Any]) -> None:
    """Half a character, too much, or too deep."""
    with pytest.raises(ValidationError):
        FollowUpdate(arrangement=arrangement)


@pytest.mark.parametrize(
    "arrangement", [{}, {"x": [None, 1.5, {"y": "\N{SNOWMAN}"}]}, {"x": float("nan")}, {"x": 10**400}]
)
def test_arrangements_that_are_passed_on(arrangement: dict[str, Any]) -> None:
    """Whatever is accepted can be told."""
    kept = FollowUpdate(arrangement=arrangement).arrangement
    assert kept is not None
    assert json.loads(encode(Told(arrangement=kept)))["arrangement"].keys() == arrangement.keys()


@pytest.mark.parametrize(
    "wrong",
    [
        {},
        {"sessions": ["a", "b", "c", "d", "e"]},
        {"sessions": ["a", "a"]},
        {"sessions": ["a"], "most_followers": -1},
        {"sessions": ["a"], "most_followers": 1001},
        {"sessions": ["a"], "hours": float("nan")},
        {"sessions": ["a"], "hours": 0},
        {"sessions": ["a"], "title": ""},
        {"sessions": ["a"], "title": "\ud800"},
        {"sessions": ["a"], "surprise": 1},
    ],
)
def test_follows_that_are_none(wrong: dict[str, Any]) -> None:
    """Nothing to follow, too many, limits out of bounds."""
    with pytest.raises(ValidationError):
        FollowCreate(**wrong)


@pytest.mark.parametrize(
    "wrong",
    [{"answers": ["a"]}, {"answers": ["a"] * 9}, {"question": ""}, {"question": "x" * 301}, {"answers": ["", "b"]}],
)
def test_polls_that_are_none(wrong: dict[str, Any]) -> None:
    """A question has words and two to eight answers."""
    with pytest.raises(ValidationError):
        PollCreate(**{"question": "?", "answers": ["a", "b"], **wrong})
