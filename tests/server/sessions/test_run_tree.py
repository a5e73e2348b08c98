"""The run tree without processes, and looking into the frame that it shows."""

import json
from dataclasses import asdict
from typing import Any

import httpx
import numpy as np
import pytest

from pftrack.core.model.band import DOUBTS
from pftrack.core.model.drawing import Drawing, Picture
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.refusal import ParameterError
from pftrack.experiments import EXPERIMENTS, find
from pftrack_server.sessions.spec import RunSnapshot, SessionDescription
from pftrack_server.sessions.worker.protocol import Inspect, WorkerConfig
from pftrack_server.sessions.worker.run_tree import RunTree
from tests.server.host import steer


def snapshot_of(recipe: Recipe) -> RunSnapshot:
    """Return the snapshot of a run that has not begun."""
    return RunSnapshot(recipe=recipe, tracker=recipe.tracker or find(recipe.experiment).default_tracker)


def config(*, max_particles: int = 100_000, **more: Any) -> WorkerConfig:
    recipe = Recipe(**{"experiment": "ball", "seed": 3, "frames": 60, **more})
    return WorkerConfig("s", snapshot_of(recipe), max_particles=max_particles)


def forward(tree: RunTree, frames: int) -> None:
    for _ in range(frames):
        tree.forward()


def tree_at(frame: int, **more: Any) -> RunTree:
    tree = RunTree(config(**more))
    forward(tree, frame)
    return tree


class TestWorkbench:
    @pytest.mark.parametrize("name", ["ball", "head", "fish"])
    def test_a_description_is_the_same_when_it_was_stored(self, name: str) -> None:
        """What is drawn and written is told as the experiment declares it, and is read from a file as it was."""
        display = EXPERIMENTS[name].display
        described = RunTree(config(experiment=name, frames=2)).describe()
        for kind in ("plots", "readings", "layers", "worlds"):
            assert tuple(getattr(described, kind)) == getattr(display, kind)
        text = described.model_dump_json()
        assert json.loads(text)["plots"] == json.loads(json.dumps([asdict(plot) for plot in display.plots]))
        assert SessionDescription.model_validate_json(text) == described

    def test_only_new_frames_have_news(self) -> None:
        """Going forward tells of a frame when it is computed, and not when it is seen again.

        What is declared of bands is that of the tracker of the next frame, and changes with it.
        """
        tree = RunTree(config())
        first = tree.forward()
        assert first["frame"] == 1
        tree.run.seek(0)
        assert tree.forward() is None
        assert tree.snapshot().doubts == {"underconfident": DOUBTS["underconfident"]}
        tree.run.change({"tracker": "kalman"})
        assert tree.snapshot().doubts == {"overconfident": DOUBTS["overconfident"]}
        tree.run.change({"occlusion_width_px": 30})
        assert tree.snapshot().doubts == {"uncalibrated": DOUBTS["uncalibrated"]}

    def test_what_is_only_drawn_changes_in_the_frame_that_is_shown(self) -> None:
        """A ghost that is dragged along a learned mode moves while the run stands; the estimate does not."""
        tree = tree_at(2, experiment="fish", tracker="guided", frames=4)

        def label() -> str:
            written: Any = tree.drawing().worlds[0].primitives["label"]
            return str(written.text)

        tree.change({"mode_sways": False, "along_mode": -4.0, "shown_mode": 3}, "b1")
        far = label()
        tree.change({"along_mode": 0.0}, "b1")
        assert (far, label()) == ("turn +32°, bend -45°", "turn +0°, bend +0°")
        tree.run.seek(1)
        tree.change({"along_mode": 4.0}, "b1")
        assert (tree.active, label()) == (config().run.branch, "turn -32°, bend +44°")
        assert tree.redraws({"along_mode": 1.0})
        assert not tree.redraws({"sample_count": 100})

    @pytest.mark.parametrize(
        ("experiment", "tracker", "values", "most", "field"),
        [
            ("ball", "h-spf", {"sample_count": 501}, 500, "sample_count"),
            ("ball", "h-spf", {}, 799, "sample_count"),
            ("head", "pf-asd", {"sample_count": 51}, 550, "sample_count"),
            ("head", "rb-pf", {"joint_sample_count": 2001}, 2000, "joint_sample_count"),
            ("prism", "pf-asd", {"pose_sample_count": 501}, 500, "pose_sample_count"),
        ],
    )
    def test_whatever_is_particles_is_limited(
        self, experiment: str, tracker: str, values: dict[str, Any], most: int, field: str
    ) -> None:
        """The server's limit holds for every number of particles, for defaults, and for the sets of all features."""
        with pytest.raises(ParameterError, match="on this server") as error:
            RunTree(config(experiment=experiment, tracker=tracker, timeline=(Change(0, values),), max_particles=most))
        assert error.value.field == field

    def test_limits_hold_in_the_middle_of_a_run(self) -> None:
        """Neither a change nor another tracker takes a run over the limit, in the past or at its end."""
        tree = tree_at(2, experiment="prism", frames=20, max_particles=800)
        for position in (2, 0):
            tree.run.seek(position)
            for values in ({"sample_count": 101}, {"pose_sample_count": 801}, {"tracker": "rb-pf"}):
                with pytest.raises(ParameterError, match="on this server"):
                    tree.change(values, "b1")
        with pytest.raises(ParameterError, match="on this server"):
            tree.branch("b1", 1, {"sample_count": 101})
        tree.change({"tracker": "rb-pf", "joint_sample_count": 800}, "b1")
        assert tree.snapshot().tracker == "rb-pf"

    def test_measures_are_those_of_the_branch_so_far(self) -> None:
        """They are the run's own, declared with titles, and computed again only when there is another frame."""
        tree = tree_at(12)
        assert tree.measures() == tree.run.summary().measures
        assert tree.measures() is tree.measures()
        assert {"hit_rate", "inside_share"} < {one.name for one in tree.describe().measures}
        assert tree.describe().success_measure == "hit_rate"

    def test_a_branch_is_compared_with_the_one_it_left(self) -> None:
        """The same frame of the branch that was left is drawn beside, as far as that one came, where they differ.

        With another seed it sees another scene, so that what is estimated there says nothing of this one.
        """
        tree = tree_at(20)
        first = tree.run.diagnostics
        assert tree.other is None
        tree.branch("b1", 10, {"tracker": "condensation"})
        assert tree.other is None
        forward(tree, 8)
        assert tree.other is first[18]
        second: Any = tree.drawing().primitives["second"]
        assert np.allclose(second.segments[..., :2].mean(axis=(0, 1)), first[18].estimate)
        forward(tree, 5)
        assert tree.other is None
        assert "second" not in tree.drawing().primitives
        tree.restart(seed=8)
        forward(tree, 5)
        assert tree.other is tree.snapshot().second is None

    def test_the_first_branch_is_compared_with_the_last_that_was_shown(self) -> None:
        """It left none, so that the one shown before it is what a person compares it with."""
        tree = tree_at(20)
        for name, tracker in (("b1", "condensation"), ("b2", "apf")):
            tree.branch(name, 10, {"tracker": tracker})
            forward(tree, 10)
            tree.activate("b0", tree.run.recipe)
        tree.run.seek(20)
        assert tree.other is tree._runs["b2"].diagnostics[20]
        tree.activate("b1", tree.run.recipe)
        tree.activate("b0", tree.run.recipe)
        assert tree.other is tree._runs["b1"].diagnostics[20]
        tree.activate("b2", tree.run.recipe)
        assert tree.other is tree._runs["b0"].diagnostics[20]


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
        path: Any = drawn["inspected path"]
        ring: Any = drawn["inspected ring"]
        assert ring.centre[:2] == pytest.approx(again.place, abs=1e-3)
        assert path.positions[0][:2] == pytest.approx(again.place, abs=1e-3)
        assert len(path.positions) == 15
    gone = next(place for place in range(800) if tree.inspect(Inspect(particle=place, frame=12)).subject == "gone")
    assert "inspected ring" not in tree.drawing().primitives
    assert gone >= 0


def test_a_look_is_at_the_branch_that_is_shown_and_a_refused_one_changes_nothing() -> None:
    """A particle that is not there is refused, and what was looked at before still is.

    The likelihood follows a threshold at once, though no frame is computed, and another branch has its own.
    """
    tree = tree_at(3)
    tree.inspect(Inspect(place=(20, 30), likelihood=True))
    with pytest.raises(ParameterError, match="below 800"):
        tree.inspect(Inspect(particle=800))
    assert "inspected ring" in tree.drawing().primitives
    tree.change({"background_level": 0.5}, "b1")
    assert "from -0.693, purple" in tree.drawing().caption


def test_a_place_is_told_with_its_parts(client: httpx.Client, session: dict[str, Any]) -> None:
    """The answer says what the likelihood is there and what it is made of, and how the cloud came about."""
    steer(client, session["id"], "seek", frame=10)
    found = steer(client, session["id"], "inspect", place=[5, 5], likelihood=True, genealogy=True)
    assert (found["frame"], found["subject"], found["title"]) == (10, "place", "colour of the pixel")
    assert [part["kind"] for part in found["parts"]] == ["residual", "amount", "patches"]
    assert found["parts"][2]["found"].startswith("data:image/png;base64,")
    assert {value["name"]: value["value"] for value in found["state"]}["u"] == 5
    lineage = found["genealogy"]
    assert (lineage["first"], len(lineage["counts"])) == (0, 11)
    assert all(len(line) == 11 for line in lineage["lines"])
