"""A run on this machine, shown by a real server to a real browser, and to nobody else."""

from collections.abc import Iterator
from typing import Any

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from pftrack.core.model.recipe import Recipe
from pftrack.output.exports import formats
from pftrack.runs.reproduction import make
from pftrack.runs.run import Run
from pftrack_server.viewer.local import Player
from tests.conftest import FRUGAL
from tests.viewer.host import Loop
from tests.waiting import wait_for


def made(frames: int = 40, *, upto: int = 12) -> Run:
    run = make(Recipe(experiment="ball", frames=frames, seed=3))
    run.seek(upto)
    return run


def sought(player: Player, frame: int) -> None:
    """Send a player to a frame."""
    player.request({"kind": "seek", "frame": frame})
    wait_for(lambda: player.run.position == frame)


@pytest.fixture
def player() -> Iterator[Player]:
    playing, loop = Player(made()), Loop()
    loop.call(playing.begin)
    yield playing
    loop.call(playing.close)
    loop.close()


def test_a_player_seeks_branches_and_restarts(player: Player) -> None:
    """It begins at the frame of its run, which stays unchanged; a change in the past makes a branch."""
    first = player.run
    assert first.position == 12
    assert first.estimates_sha256 == made().estimates_sha256
    sought(player, 30)
    sought(player, 5)
    player.request({"kind": "change", "values": {"sample_count": 50}})
    wait_for(lambda: player.run is not first, what="a branch was made")
    assert player.run.position == 5
    assert player.run.parameters_at(6).sample_count == 50
    assert first.computed == 30
    player.request({"kind": "restart", "seed": 8})
    wait_for(lambda: player.run.seed == 8)
    assert player.run.parameters_at(0).sample_count == 50, "what the panel showed is in force"


def test_a_player_plays_to_the_end_and_refuses_wrong_values(player: Player, monkeypatch: pytest.MonkeyPatch) -> None:
    """It stops at the end; a value out of bounds is refused with a sentence and changes nothing."""
    refused: list[str] = []
    monkeypatch.setattr(player.viewer, "refuse", refused.append)
    player.request({"kind": "speed", "speed": 0.0})
    player.request({"kind": "toggle"})
    wait_for(lambda: player.run.position == 39)
    wait_for(lambda: not player._is_playing)
    sought(player, 10)
    player.request({"kind": "change", "values": {"sample_count": -1}})
    wait_for(lambda: refused)
    assert "sample_count" in refused[0]
    assert player.run.parameters_at(11).sample_count == 800


@pytest.mark.browser
def test_a_scene_is_shown_to_its_own_page_alone(chromium: Any) -> None:
    """A browser at the address sees the wanted frame; other pages, addresses and hosts see nothing."""
    run = made(upto=20)
    with formats.show(run, browser=False) as scene:
        context = chromium.new_context(viewport={"width": 900, "height": 600})
        context.add_init_script(FRUGAL)
        page = context.new_page()
        page.goto(scene.address)
        page.get_by_text("frame 20").first.wait_for()
        scene.go(7)
        page.get_by_text("frame 7").first.wait_for()
        context.close()
        assert run.position == 20
        assert scene.address in scene._repr_html_()
        origin = scene.address.rsplit("/", 2)[0]
        assert httpx.get(f"{origin}/").status_code == 404
        assert httpx.get(scene.address, headers={"Host": "elsewhere.example"}).status_code == 400
        with pytest.raises(InvalidStatus, match="403"):
            connect(scene.address.replace("http", "ws", 1), origin="http://elsewhere.example")
    with pytest.raises(httpx.ConnectError):
        httpx.get(scene.address)
    scene.close()


def test_a_player_follows_a_growing_run(player: Player) -> None:
    """At the newest frame it shows each new one; at an earlier frame it stays."""
    longer, longest = (made(frames, upto=frames - 1) for frames in (25, 30))
    sought(player, 39)
    player.request({"kind": "follow", "run": longer})
    wait_for(lambda: player.run is longer)
    sought(player, 3)
    player.request({"kind": "follow", "run": longest})
    sought(player, 4)
    assert player.run is longer
