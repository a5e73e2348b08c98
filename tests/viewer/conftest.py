"""One session with its viewer, the web server before it, and those who look at it."""

from collections.abc import Iterator
from typing import Any

import pytest

from pftrack_server.core.pictures import SceneDrawing
from pftrack_server.viewer.scene import Scene
from tests.conftest import CHROMIUM
from tests.viewer.host import Peer, Session, Site
from tests.waiting import wait_for

NEEDS_CHROMIUM = [
    pytest.mark.browser,
    pytest.mark.skipif(not CHROMIUM.exists(), reason="needs Debian's chromium at /usr/bin/chromium"),
]


def until(scene: Any, expression: str, seconds: float = 60.0) -> None:
    """Await an expression by asking again and again: the page's policy forbids to evaluate text in it."""
    wait_for(lambda: scene.evaluate(expression), seconds, expression, lambda rest: scene.wait_for_timeout(1000 * rest))


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session()
    yield made
    made.close()


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[str | None]:
    """Captions of what was drawn."""
    captions: list[str | None] = []
    apply = Scene.apply

    def counted(scene: Scene, shown: SceneDrawing, *more: Any) -> None:
        captions.append(shown.drawing.caption)
        apply(scene, shown, *more)

    monkeypatch.setattr(Scene, "apply", counted)
    return captions


@pytest.fixture
def site(session: Session) -> Iterator[Site]:
    made = Site(session)
    yield made
    made.close()


@pytest.fixture
def peer(session: Session, site: Site) -> Iterator[Peer]:
    with Peer(site.scene) as made:
        wait_for(lambda: session.viewer.clients == 1)
        yield made
