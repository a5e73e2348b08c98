"""The run tree without processes, and looks into its shown frame."""

from typing import Any

import httpx
import numpy as np
import pytest

from pftrack.core.model.band import DOUBTS
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
    @pytest.mark.parametrize("name", ["ball", "fish"])
    def test_a_stored_description_is_the_same(self, name: str) -> None:
        """Plots, readings, layers and worlds are those that the experiment declares, also when read from a file."""
        display = EXPERIMENTS[name].display
        described = RunTree(config(experiment=name, frames=2)).describe()
        for kind in ("plots", "readings", "layers", "worlds"):
            assert tuple(getattr(described, kind)) == getattr(display, kind)
        assert SessionDescription.model_validate_json(described.model_dump_json()) == described

    def test_only_new_frames_have_news(self) -> None:
        """A frame is reported when it is computed, and not when it is seen again.

        The declared properties of bands are those of the tracker of the next frame.
        """
        tree = RunTree(config())
        assert tree.forward()["frame"] == 1
        tree.run.seek(0)
        assert tree.forward() is None
        for change, doubt in (
            ({}, "underconfident"),
            ({"tracker": "kalman"}, "overconfident"),
            ({"occlusion_width_px": 30}, "uncalibrated"),
        ):
            tree.run.change(change)
            assert tree.snapshot().doubts == {doubt: DOUBTS[doubt]}

    def test_what_is_only_drawn_changes_in_the_shown_frame(self) -> None:
        """A ghost dragged along a learned mode moves while the run is paused; the estimate does not."""
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
        assert (tree.redraws({"along_mode": 1.0}), tree.redraws({"sample_count": 100})) == (True, False)

    @pytest.mark.parametrize(
        ("experiment", "tracker", "values", "most", "field"),
        [
            ("ball", "h-spf", {}, 799, "sample_count"),
            ("head", "pf-asd", {"sample_count": 51}, 550, "sample_count"),
            ("head", "rb-pf", {"joint_sample_count": 2001}, 2000, "joint_sample_count"),
            ("prism", "pf-asd", {"pose_sample_count": 501}, 500, "pose_sample_count"),
        ],
    )
    def test_every_number_of_particles_is_limited(
        self, experiment: str, tracker: str, values: dict[str, Any], most: int, field: str
    ) -> None:
        """The server's limit holds for defaults, for the sets of all features, and for poses."""
        with pytest.raises(ParameterError, match="on this server") as error:
            RunTree(config(experiment=experiment, tracker=tracker, timeline=(Change(0, values),), max_particles=most))
        assert error.value.field == field

    def test_limits_hold_in_the_middle_of_a_run(self) -> None:
        """Neither a change nor another tracker exceeds the limit, in the past or at the end of the run."""
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

    def test_measures_are_declared_and_computed_once_a_frame(self) -> None:
        """They are the run's own, and computed again only after another frame."""
        tree = tree_at(12)
        assert tree.measures() is tree.measures()
        assert tree.measures() == tree.run.summary().measures
        assert tree.describe().success_measure in {one.name for one in tree.describe().measures}

    def test_a_branch_is_compared_with_the_one_it_left(self) -> None:
        """The same frame of that branch is drawn beside it, if it was computed and differs.

        With another seed the scene differs, so the estimates cannot be compared.
        """
        tree = tree_at(20)
        first = tree.run.diagnostics
        tree.branch("b1", 10, {"tracker": "condensation"})
        assert tree.other is None
        forward(tree, 8)
        assert tree.other is first[18]
        second: Any = tree.drawing().primitives["second"]
        assert np.allclose(second.segments[..., :2].mean(axis=(0, 1)), first[18].estimate)
        forward(tree, 5)
        assert (tree.other, "second" in tree.drawing().primitives) == (None, False)
        tree.restart(seed=8)
        forward(tree, 5)
        assert tree.other is tree.snapshot().second is None


def test_a_look_is_drawn_until_it_ends() -> None:
    """Nothing is added to a drawing before a look or after it; a refused look changes nothing.

    The likelihood follows a threshold at once, without another frame, and another branch has its own.
    """
    tree = tree_at(3)

    def drawn() -> tuple[set[str], Any, str]:
        drawing = tree.drawing()
        picture: Any = drawing.primitives["picture"]
        return set(drawing.primitives), picture.image_rgb.copy(), drawing.caption

    names, picture, caption = drawn()
    looked = tree.inspect(Inspect(likelihood=True, place=(20, 30)))
    assert looked.scale == pytest.approx((np.log(0.1), np.log(1.1)), abs=1e-6)
    with pytest.raises(ParameterError, match="below 800"):
        tree.inspect(Inspect(particle=800))
    seen, mapped, words = drawn()
    assert seen - names == {"inspected ring", "inspected cross"}
    assert not np.array_equal(mapped, picture)
    assert "log likelihood from -2.3, purple, to 0.0953, yellow" in words
    tree.change({"background_level": 0.5}, "b1")
    assert "from -0.693, purple" in tree.drawing().caption
    tree.inspect(Inspect())
    after, bare, words = drawn()
    assert (after, words) == (names, caption)
    assert np.array_equal(bare, picture)


def test_a_picked_particle_is_followed_while_the_run_continues() -> None:
    """The particle nearest to a place is pinned; later its heaviest child is drawn, with the path behind it."""
    tree = tree_at(12)
    found = tree.inspect(Inspect(place=tuple(tree.run.current.state.estimate), picks=True))
    assert (found.subject, found.particle.count, len(found.particle.ancestors)) == ("particle", 800, 12)
    forward(tree, 2)
    drawn: dict[str, Any] = dict(tree.drawing().primitives)
    again = tree.inspect(Inspect(particle=found.particle.particle, frame=12))
    assert (again.frame, again.subject) == (14, "particle")
    assert again.particle.ancestors[1] == found.particle.particle
    for place in (drawn["inspected ring"].centre, drawn["inspected path"].positions[0]):
        assert place[:2] == pytest.approx(again.place, abs=1e-3)
    assert len(drawn["inspected path"].positions) == 15
    assert any(tree.inspect(Inspect(particle=place, frame=12)).subject == "gone" for place in range(800))
    assert "inspected ring" not in tree.drawing().primitives


def test_a_place_is_told_with_its_parts(client: httpx.Client, session: dict[str, Any]) -> None:
    """The answer has the parts of the likelihood at a place, and the genealogy of the particles."""
    steer(client, session["id"], "seek", frame=10)
    found = steer(client, session["id"], "inspect", place=[5, 5], likelihood=True, genealogy=True)
    assert (found["frame"], found["subject"], found["title"]) == (10, "place", "colour of the pixel")
    assert [part["kind"] for part in found["parts"]] == ["residual", "amount", "patches"]
    assert found["parts"][2]["found"].startswith("data:image/png;base64,")
    assert {value["name"]: value["value"] for value in found["state"]}["u"] == 5
    lineage = found["genealogy"]
    assert (lineage["first"], {len(line) for line in (lineage["counts"], *lineage["lines"])}) == (0, {11})
