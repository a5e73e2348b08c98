"""Links: short enough to be typed, and nobody can make one up."""

import pytest

from pftrack_server.teaching.links import LETTERS, Claim, Links


@pytest.fixture(scope="module")
def links() -> Links:
    return Links()


def test_a_link_says_class_and_role(links: Links) -> None:
    """What was signed is read, and the roles have links of their own."""
    follower, owner = links.of("k7q2", "follower"), links.of("k7q2", "owner")
    assert links.read(follower) == Claim("k7q2", "follower", follower)
    assert links.read(owner) == Claim("k7q2", "owner", owner)
    assert len(follower) == 14
    assert follower[:5] == owner[:5] == "k7q2-"
    assert owner[5:].startswith(follower[5:]) is False


def test_a_link_is_read_however_it_is_typed(links: Links) -> None:
    """Capitals, missing dashes and letters that look alike lead to the same class."""
    name = next(name for name in iter(links.new_name, None) if {"0", "1"} & set(links.of(name, "follower")))
    link = links.of(name, "follower")
    for typed in (
        link.upper(),
        link.replace("-", ""),
        link.replace("-", " "),
        link.replace("0", "O"),
        link.replace("1", "l"),
    ):
        claim = links.read(typed)
        assert claim.link == link


def test_every_other_letter_is_refused(links: Links) -> None:
    """A link with any one letter changed is refused."""
    link = links.of("k7q2", "follower").replace("-", "")
    others = [
        link[:at] + letter + link[at + 1 :] for at in range(len(link)) for letter in LETTERS if letter != link[at]
    ]
    assert len(others) == 12 * 31
    assert [other for other in others if links.read(other)] == []


@pytest.mark.parametrize("typed", ["", "k7q2", "-", "k7q2-" * 50, "k7q2-\N{SNOWMAN}", "\ud800", "../../etc", "%00"])
def test_what_is_no_link(links: Links, typed: str) -> None:
    """Nothing else is read as one."""
    assert links.read(typed) is None


def test_a_part_of_a_lecturers_link_is_no_followers(links: Links) -> None:
    """Each role is signed for itself, and a signature that is cut or longer does not hold."""
    owner, follower = (links.of("k7q2", role).replace("-", "") for role in ("owner", "follower"))  # type: ignore[arg-type]
    assert all(links.read(owner[:length]) is None for length in range(len(owner)))
    assert links.read(follower + "0") is None
    assert links.read(follower[:-1]) is None


def test_another_server_signs_otherwise(links: Links) -> None:
    """The key is a server's own, and of one life."""
    assert Links().read(links.of("k7q2", "follower")) is None


def test_a_seat_belongs_to_one_class(links: Links) -> None:
    """What a browser keeps is read for the class that gave it, and not when it was changed."""
    kept = links.new_seat("k7q2")
    seat = links.read_seat("k7q2", kept)
    assert seat
    assert links.new_seat("k7q2") != kept
    assert links.read_seat("m4xb", kept) is None
    assert links.read_seat("k7q2", kept.replace(".", ".A")) is None
    assert links.read_seat("k7q2", "other." + kept.partition(".")[2]) is None
    assert [links.read_seat("k7q2", text) for text in ("", ".", "\N{SNOWMAN}", seat, "\ud800")] == [None] * 5
