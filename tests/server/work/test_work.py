"""My work: all sessions, runs, comparisons, sweeps and uploads, found by words."""

from datetime import UTC, datetime, timedelta, timezone

import httpx
import pytest

from pftrack_server.work.routes import Words, date_words
from tests.server.host import begin, error_of

KINDS = ("sessions", "runs", "comparisons", "sweeps", "uploads")


@pytest.fixture
def kept(client: httpx.Client) -> dict[str, str]:
    """A session of the ball, which was saved, and one of a signal."""
    ball, sine = (begin(client, experiment=name, seed=seed)["id"] for name, seed in (("ball", 3), ("sine", 41)))
    run = client.post("/api/v1/runs", json={"session": ball, "title": "Straße bei Nacht"}).json()
    return {"ball": ball, "sine": sine, "run": run["id"]}


def found(client: httpx.Client, words: str, **more: object) -> set[str]:
    work = client.get("/api/v1/work", params={"q": words, **more}).raise_for_status().json()  # type: ignore[dict-item]
    return {thing["id"] for kind in KINDS for thing in work[kind]}


def quiet_zone(*hours: int) -> timezone:
    """Return the first zone so many hours east of Greenwich where no day begins or ends within an hour."""
    zones = (timezone(timedelta(hours=each)) for each in hours)
    return next(zone for zone in zones if 1 <= datetime.now(zone).hour < 23)


def name_of(zone: timezone) -> str:
    """Return the zone's name in the database of zones, which counts hours westwards."""
    return f"Etc/GMT{-zone.utcoffset(None) // timedelta(hours=1):+d}"


CASES = {
    "": {"ball", "sine", "run"},
    "occluder": {"ball", "run"},
    "OCCLUDER hard SWITCHING": {"ball", "run"},
    "seed 41": {"sine"},
    "strasse nacht": {"run"},
    "today": {"ball", "sine", "run"},
    "{month} occl": {"ball", "run"},
    "occluder 41": set(),
    "%": set(),
}


def test_every_word_has_to_occur(client: httpx.Client, kept: dict[str, str]) -> None:
    """Titles, experiments, methods, dates and seeds are searched, in either case; parts of words do."""
    zone = quiet_zone(0, 2)
    for words, expected in CASES.items():
        asked = words.format(month=f"{datetime.now(zone):%B}")
        assert found(client, asked, zone=name_of(zone)) & set(kept.values()) == {kept[name] for name in expected}, words


def test_dates_are_those_of_the_reader(client: httpx.Client, kept: dict[str, str]) -> None:
    """Late on the third of March in London is early on the fourth in Tokyo, and a reader finds the date shown there."""
    late = "2026-03-03T23:30:00+00:00"
    tokyo, moment = timezone(timedelta(hours=9)), datetime.fromisoformat(late)
    assert Words("4 March 08:30 2026-03-04 today").occur_in(date_words(late, moment.astimezone(tokyo)))
    assert Words("3 March 23:30 2026-03-03 today").occur_in(date_words(late, moment))
    after = moment + timedelta(hours=1)  # past midnight in London, and still the same morning in Tokyo
    assert not Words("today").occur_in(date_words(late, after))
    assert Words("today").occur_in(date_words(late, after.astimezone(tokyo)))
    # Between the two there is always another day.
    for zone in (quiet_zone(14, 12), quiet_zone(-10, -12)):
        assert found(client, f"{datetime.now(zone):%Y-%m-%d} today", zone=name_of(zone)) >= {kept["run"]}


def test_numbers_are_found_whole() -> None:
    """A seed is found by all its digits, and neither in a longer number nor in a time of day."""
    began = date_words("2026-11-05T23:41:00+00:00", datetime(2026, 11, 6, tzinfo=UTC))
    assert Words("seed 41").occur_in("seed 41", began)
    assert not any(Words(words).occur_in("seed 7", began) for words in ("41", "23", "11", "05"))
    assert not Words("41").occur_in("seed 141", began)
    assert Words("41 2026 5 23:41 2026-11").occur_in("run41", began)


def test_one_kind_is_listed_and_all_are_counted(client: httpx.Client, kept: dict[str, str]) -> None:
    """The limit shortens the list, not the counts; other kinds than the requested one are not listed."""
    work = client.get("/api/v1/work", params={"limit": 1}).json()
    assert len(work["sessions"]) == 1
    assert work["found"]["sessions"] == work["total"]["sessions"] >= 2
    assert found(client, "", show="runs") >= {kept["run"]}
    assert not found(client, "", show="runs") & {kept["ball"], kept["sine"]}
    assert client.get("/api/v1/work", params={"q": "nothing has this"}).json()["found"] == dict.fromkeys(KINDS, 0)
    assert error_of(client.get("/api/v1/work", params={"zone": "Mars"}), 422)["field"] == "zone"
