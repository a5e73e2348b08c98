"""Looking into the frame that a session shows: what is told, and what is drawn."""

from typing import Any

import httpx
import numpy as np
import pytest

from pftrack.core.model.drawing import Drawing, Ellipse, Picture, Polyline
from pftrack.core.refusal import ParameterError
from pftrack_server.sessions.worker.protocol import Inspect
from pftrack_server.sessions.worker.run_tree import RunTree
from tests.server.host import command, steer
from tests.server.sessions.test_run_tree import config, forward


def tree_at(frame: int, **more: Any) -> RunTree:
    tree = RunTree(config(**more))
    forward(tree, frame)
    return tree


def picture_of(drawing: Drawing) -> np.ndarray:
    return next(item.image_rgb for item in drawing.primitives.values() if isinstance(item, Picture))


def test_who_does_not_look_has_the_drawing_of_the_experiment() -> None:
    """Nothing is added to a drawing before somebody looks, nor after he has stopped."""
    tree = tree_at(12)
    before = tree.drawing()
    looked = tree.inspect(Inspect(likelihood=True, place=(20, 30)))
    assert looked.scale == pytest.approx((np.log(0.1), np.log(1.1)), abs=1e-6)
    seen = tree.drawing()
    assert seen.primitives.keys() - before.primitives.keys() == {"inspected ring", "inspected cross"}
    assert not np.array_equal(picture_of(seen), picture_of(before))
    assert "log likelihood from -2.3, purple, to 0.0953, yellow" in seen.caption
    tree.inspect(Inspect())
    after = tree.drawing()
    assert (after.primitives.keys(), after.caption) == (before.primitives.keys(), before.caption)
    assert np.array_equal(picture_of(after), picture_of(before))


def test_a_picked_particle_is_followed_while_the_run_goes_on() -> None:
    """The particle nearest to a place is pinned; frames on it is its heaviest child, with the way behind it."""
    tree = tree_at(12)
    estimate = tree.run.current.state.estimate
    found = tree.inspect(Inspect(place=tuple(estimate), picks=True))
    assert (found.subject, found.particle.count, len(found.particle.ancestors)) == ("particle", 800, 12)
    pinned = found.particle.particle
    forward(tree, 2)
    drawn = tree.drawing().primitives
    again = tree.inspect(Inspect(particle=pinned, frame=12))
    assert again.frame == 14
    if again.subject == "particle":
        assert again.particle.ancestors[1] == pinned
        path = drawn["inspected path"]
        ring = drawn["inspected ring"]
        assert isinstance(path, Polyline)
        assert isinstance(ring, Ellipse)
        assert ring.centre[:2] == pytest.approx(again.place, abs=1e-3)
        assert path.positions[0][:2] == pytest.approx(again.place, abs=1e-3)
        assert len(path.positions) == 15
    gone = next(place for place in range(800) if tree.inspect(Inspect(particle=place, frame=12)).subject == "gone")
    assert "inspected ring" not in tree.drawing().primitives
    assert gone >= 0


def test_a_refused_look_changes_nothing() -> None:
    """A particle that is not there is refused, and what was looked at before still is."""
    tree = tree_at(3)
    tree.inspect(Inspect(place=(20, 30)))
    with pytest.raises(ParameterError, match="below 800"):
        tree.inspect(Inspect(particle=800))
    assert "inspected ring" in tree.drawing().primitives


def test_what_is_drawn_is_that_of_the_branch_that_is_shown() -> None:
    """The likelihood follows a threshold at once, though no frame is computed, and another branch has its own."""
    tree = tree_at(12)
    tree.inspect(Inspect(likelihood=True))
    tree.change({"background_level": 0.5}, "b1")
    assert "from -0.693, purple" in tree.drawing().caption


class TestRoute:
    def test_a_place_is_told_with_its_parts(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """The answer says what the likelihood is there and what it is made of, and how the cloud came about."""
        steer(client, session["id"], "seek", frame=10)
        answer = command(client, session["id"], "inspect", place=[5, 5], likelihood=True, genealogy=True)
        assert answer.status_code == 200
        found = answer.json()
        assert (found["frame"], found["subject"], found["title"]) == (10, "place", "colour of the pixel")
        assert [part["kind"] for part in found["parts"]] == ["residual", "amount", "patches"]
        assert found["parts"][2]["found"].startswith("data:image/png;base64,")
        assert {value["name"]: value["value"] for value in found["state"]}["u"] == 5
        lineage = found["genealogy"]
        assert (lineage["first"], len(lineage["counts"])) == (0, 11)
        assert all(len(line) == 11 for line in lineage["lines"])
