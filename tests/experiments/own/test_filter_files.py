"""Filters in files: any part may be a person's own, the numbers are the same on every way, and mistakes have a line."""

import pickle
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pftrack
from pftrack.core.model.recipe import Change, Recipe
from pftrack.experiments import EXPERIMENTS, find
from pftrack.experiments.own.code import FilterFileError, fields_of, slider, trust
from pftrack.experiments.own.extension import example_of, extend
from pftrack.runs import many
from pftrack.runs.reproduction import make
from pftrack.runs.run import Run

TAKING = [name for name in EXPERIMENTS.own if EXPERIMENTS[name].model is not None]
SMALL = {"joint_sample_count": 400, "sample_count": 60}
BALL = example_of(find("ball"))
HEAD = "import numpy as np\n"
NOTHING = HEAD + "def should_resample(log_weights):\n    return True\n"


def recipe(text: str, experiment: str = "ball", **more: Any) -> Recipe:
    """A recipe whose tracker is a file that is trusted."""
    trust(text)
    known = type(find(experiment).simulate().parameters).model_fields
    small = {name: value for name, value in SMALL.items() if name in known}
    timeline = (Change(0, {**small, **more.pop("values", {})}),)
    given = {"tracker": "mine", "frames": 12, "timeline": timeline, "filters": {"mine": (text,)}, **more}
    return Recipe(experiment=experiment, **given)


def made(text: str, experiment: str = "ball", **more: Any) -> Run:
    return make(recipe(text, experiment, **more))


def problem_of(text: str, **more: Any) -> FilterFileError:
    """What is wrong with a file, at the latest in frame 3."""
    with pytest.raises(FilterFileError) as raised:
        made(text, **more).seek(3)
    return raised.value


class TestExperiments:
    """What holds for every experiment that takes filters from files."""

    @pytest.mark.parametrize("name", TAKING)
    def test_the_example_works_and_is_the_same_on_every_way(self, name: str, tmp_path: Path) -> None:
        """It follows the target; seeking, branching, saving and batches come to the same numbers."""
        run = made(example_of(find(name)), name)
        run.finish()
        assert not any(row.lost for row in run.diagnostics)
        assert {row.series["not_repeatable"] for row in run.diagnostics} == {0.0}
        run.seek(3)
        branch = run.branch(7)
        branch.finish()
        run.save(tmp_path / "run.pft")
        again = pftrack.load(tmp_path / "run.pft")
        values, frames = run.timeline.changes[0].values, run.frames
        (outcome,) = many.outcomes(
            run.experiment, run.setup, values=values, trackers=["mine"], seeds=[0], frames=frames
        )
        assert len({each.estimates_sha256 for each in (run, branch, again, *outcome)}) == 1

    @pytest.mark.parametrize("name", TAKING)
    def test_what_a_file_leaves_out_is_the_experiments_own(self, name: str) -> None:
        """A file that decides when to resample and nothing else tracks as well."""
        # With ours a ball that starts from rest needs more than a few particles.
        run = made(NOTHING, name, values={"sample_count": 800} if name == "ball" else {}, frames=6)
        run.finish()
        assert not any(row.lost for row in run.diagnostics)

    @pytest.mark.parametrize("name", TAKING)
    def test_it_takes_over_from_every_tracker_and_hands_over_to_it(self, name: str) -> None:
        """In the middle of a run, both ways, and is drawn."""
        text = example_of(find(name))
        for tracker in find(name).trackers:
            changes = (Change(1, {"tracker": "mine"}), Change(3, {"tracker": tracker}))
            run = made(text, name, tracker=tracker, frames=5, timeline=(*recipe(text, name).timeline, *changes))
            drawings = [run.experiment.draw(step, run.diagnostics) for step in run]
            assert np.isfinite(run.diagnostics[-1].estimate).all()
            assert all(drawing.primitives for drawing in drawings)

    def test_experiments_that_take_none_say_so(self) -> None:
        """With the name of the file."""
        trust(BALL)
        with pytest.raises(FilterFileError, match=r"mine.py: fish takes no filters from files"):
            extend("fish", {"mine": (BALL,)})
        with pytest.raises(FilterFileError, match="ball has a tracker kalman; call the file otherwise"):
            extend("ball", {"kalman": (BALL,)})
        with pytest.raises(FilterFileError, match="a version of the file that is not here"):
            extend("ball", {"mine": ("sha256:" + 64 * "0",)})


LIKELIHOOD = "def log_likelihood(states, frame):\n    return -0.5 * ((states[:, 0] - 60) / 4) ** 2\n"


class TestParts:
    """Functions that a file may define."""

    def test_a_whole_step(self) -> None:
        """States and weights come from it, ancestors if it returns them, and the first particles from its start."""
        text = HEAD + (
            "def step(states, log_weights, frame, parameters, rng):\n"
            "    parents = rng.choice(len(states), len(states), p=np.exp(log_weights))\n"
            "    moved = states[parents] + [1.0, 2.0, 0.0, 0.0]\n"
            "    return moved, np.arange(len(moved)) * 1e-3, parents\n"
        )
        text += "def start(position, rng):\n    return np.tile(np.tile(position, 2), (7, 1)) + rng.random((7, 4))\n"
        run = made(text, frames=2)
        before, after = run.current.state.particles, run.advance().state.particles
        assert np.allclose(after.states[:, :2] - before.states[after.ancestors][:, :2], [1.0, 2.0])
        expected = np.exp(np.arange(7) * 1e-3)
        assert np.allclose(after.weights, expected / expected.sum())

    def test_a_proposal_with_its_correction(self) -> None:
        """A proposal that draws elsewhere, with the right correction, gives the posterior of the prior's draws."""
        prior = "def propagate(states, rng):\n    return states + 3 * rng.standard_normal(states.shape)\n"
        other = (
            "def propose(states, rng):\n"
            "    moved = states + 3 * rng.standard_normal(states.shape)\n"
            "    moved[:, 0] += 2\n"
            "    off = moved[:, 0] - states[:, 0]\n"
            "    return moved, -0.5 * (off / 3) ** 2 + 0.5 * ((off - 2) / 3) ** 2\n"
        )
        one, two = (
            made(HEAD + text + LIKELIHOOD, values={"sample_count": 40_000}, frames=2).finish().state
            for text in (prior, other)
        )
        assert one.estimate == pytest.approx(two.estimate, abs=0.15)
        assert one.sigma == pytest.approx(two.sigma, abs=0.15)
        assert one.log_evidence == pytest.approx(two.log_evidence, abs=0.05)

    def test_parameters_of_the_experiment_are_seen_beside_the_files_own(self) -> None:
        """One of the same name is the experiment's; all others are there as well, and the truth is not."""
        text = HEAD + (
            "from dataclasses import dataclass\n"
            "@dataclass\nclass Parameters:\n    sample_count: int = 5\n    mine: float = 2.5\n"
            "def propagate(states, frame, parameters):\n"
            "    assert (parameters.sample_count, parameters.mine, parameters.process_noise_px) == (60, 2.5, 3)\n"
            "    assert frame.target is None\n"
            "    return states\n"
        )
        made(text).advance()


class TestMistakes:
    """What is wrong is told with the line, and the run stands."""

    @pytest.mark.parametrize(
        ("text", "line", "words"),
        [
            ("def propagate(:\n", 1, "invalid syntax"),
            ("x = 1\n", None, "defines none of start, propagate"),
            ("import nothing_like_this\n", 1, "ModuleNotFoundError"),
            ("def propagate(states, weather):\n    return states\n", 1, "asks for weather, but it can have states"),
            ("def propagate(states):\n    y = 1\n    return states.nonsense\n", 3, "AttributeError"),
            (
                "def propagate(states):\n    return states[:, :2]\n",
                1,
                "shape (60, 2); expected (60, 4), the columns being u, v",
            ),
            ("def propagate(states):\n    return states * float('nan')\n", 1, "not finite for 60 of 60 particles"),
            ("def propagate(states):\n    states += 1\n    return states\n", 2, "read-only"),
            ("def log_likelihood(states):\n    return states[:, 0] * float('nan')\n", 1, "NaN for 60 of 60 particles"),
            ("def resample(log_weights):\n    return [0.5] * 60\n", 1, "as whole numbers"),
            ("def resample(log_weights):\n    return [60] * 60\n", 1, "the parent 60; there are 0 to 59"),
            ("def propose(states):\n    return states\n", 1, "must return states and log_correction"),
            ("def normalise(log_weights):\n    return log_weights, 0.0\n", 1, "returned weights that sum to"),
            ("def normalise(log_weights):\n    return log_weights\n", 1, "and the logarithm of their sum"),
            ("def propagate(states):\n    raise SystemExit\n", 2, "SystemExit"),
            ("class Parameters:\n    a = 1\ndef propagate(states):\n    return states\n", 1, "must be a dataclass"),
        ],
    )
    def test_by_its_line(self, text: str, line: int | None, words: str) -> None:
        """In the words of who made it."""
        told = problem_of(text)
        assert (told.file, told.line) == ("mine.py", line)
        assert words in told.problem
        assert str(pickle.loads(pickle.dumps(told))) == str(told)  # noqa: S301 - made here

    def test_an_interrupt_of_its_own(self) -> None:
        """Where Ctrl-C is ignored, as in a session's process, an interrupt is the file's; elsewhere the user's."""
        text = "def propagate(states):\n    raise KeyboardInterrupt\n"
        with pytest.raises(KeyboardInterrupt):
            problem_of(text)
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            told = problem_of(text)
        finally:
            signal.signal(signal.SIGINT, before)
        assert (told.line, told.problem) == (2, "KeyboardInterrupt")

    def test_the_run_stands_where_it_was(self) -> None:
        """What was computed stays, and goes on with another version."""
        bad = NOTHING + "def propagate(states, frame):\n    return states if frame.index < 5 else states * np.nan\n"
        run = made(bad)
        with pytest.raises(FilterFileError):
            run.finish()
        assert (run.position, run.computed) == (4, 4)
        trust(NOTHING)
        wider = recipe(bad, filters={"mine": (bad, NOTHING)})
        experiment = pftrack.experiments.own.experiment_of(wider)
        going_on = run.rewire(experiment, experiment.simulate()).branch(4, {"mine_version": 2})
        assert going_on.finish().diagnostics.frame == 11
        assert [row.estimate for row in going_on.diagnostics[:5]] == [row.estimate for row in run.diagnostics]

    def test_a_step_has_its_time(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """One that does not end is stopped in the line where it is."""
        monkeypatch.setattr("pftrack.experiments.own.code.LONGEST_STEP_S", 0.2)
        told = problem_of("def propagate(states):\n    while True:\n        pass\n")
        assert told.line in {2, 3}
        assert "took longer than 0.2 s" in told.problem

    @pytest.mark.parametrize(
        "text",
        [
            "def propagate(states):\n    return states + np.random.default_rng().random(states.shape)\n",
            "import time\ndef propagate(states):\n    return states + time.perf_counter()\n",
            "calls = []\ndef propagate(states):\n    calls.append(1)\n    return states + len(calls)\n",
        ],
        ids=["randomness", "clock", "state"],
    )
    def test_what_cannot_be_repeated_is_marked(self, text: str) -> None:
        """Its own randomness, clock or memory: the run goes on, and every later frame says so."""
        run = made(HEAD + text)
        run.finish()
        assert [row.series["not_repeatable"] for row in run.diagnostics] == [0.0] + [1.0] * 11


class TestTrust:
    """Nothing of a file is executed that nobody has named."""

    def test_a_run_of_others_is_not_executed(self, tmp_path: Path) -> None:
        """Not when it is loaded, until one says so."""
        text = BALL + f"\n# {tmp_path}\nopen({str(tmp_path / 'seen')!r}, 'w').close()\n"
        stranger = Recipe(experiment="ball", tracker="mine", filters={"mine": (text,)}, frames=3)
        (tmp_path / "recipe.json").write_text(stranger.model_dump_json())
        with pytest.raises(FilterFileError, match="which is not trusted here"):
            pftrack.load(tmp_path / "recipe.json")
        assert not (tmp_path / "seen").exists()
        assert pftrack.load(tmp_path / "recipe.json", trust=True).position == 2
        assert (tmp_path / "seen").exists()


class TestSliders:
    """Parameters from a dataclass."""

    def declared(self, body: str) -> Any:
        text = f"from dataclasses import dataclass\nfrom typing import Literal\n@dataclass\nclass Parameters:\n{body}"
        names: dict[str, Any] = {"slider": slider}
        exec(text, names)  # noqa: S102 - as a file is
        (field,) = fields_of(names["Parameters"], "mine.py", text)
        return field

    def test_bounds_unit_and_help_are_read_from_the_line(self) -> None:
        """A number gets bounds around its default, its name tells the unit, and the comment is its help."""
        field = self.declared("    noise_px: float = 3  # how far it moves\n")
        assert (field.kind, field.default, field.within) == (float, 3.0, (0.0, 30.0, 0.1))
        assert (field.title, field.unit, field.about) == ("Noise", "px", "How far it moves.")
        lines = ("share: float = 0.2", "shift: float = -2.0", "shift: float = 0.0", "count: int = 4")
        bounds = [self.declared(f"    {line}\n").within[:2] for line in lines]
        assert bounds == [(0.0, 1.0), (-20.0, 20.0), (-1.0, 1.0), (0, 40)]
        own = self.declared('    k: float = slider(2, 1, 5, step=0.5, unit="m", title="Reach", about="How far.")\n')
        assert (own.within, own.unit, own.title) == ((1, 5, 0.5), "m", "Reach")
        on = self.declared("    on: bool = True\n")
        assert (on.within, on.kind) == (None, bool)
        assert self.declared('    law: Literal["a", "b"] = "a"\n').kind is not str

    @pytest.mark.parametrize("body", ["    a: float\n", "    a: list = None\n", "    a: float = float('inf')\n"])
    def test_what_no_slider_can_have_is_refused(self, body: str) -> None:
        """With the line."""
        with pytest.raises(FilterFileError, match=r"mine\.py, line 5"):
            self.declared(body)
