"""Runs with one flaw added, and the diagnosis of their losses."""

from contextlib import suppress

import numpy as np
import pytest

from pftrack.core.model.parameters import declarations
from pftrack.core.model.source import History
from pftrack.core.refusal import RefusedError
from pftrack.experiments import EXPERIMENTS, find
from tools import diagnosis
from tools.diagnosis import PICTURES, Case, Judgement, Spoiled, draw, figures_of, judge_case, read_judged

STORED = read_judged()
FEW = Judgement(["sample-impoverishment"], "sample-impoverishment", "unclear", calm_aided=True, calm_unaided=False)


def test_the_pages_and_the_library_agree_with_the_record() -> None:
    """`python -m tools.diagnosis table` writes them; all cases of the study are there."""
    for file, texts in diagnosis.pages(STORED).items():
        page = file.read_text(encoding="utf-8")
        for name, text in texts.items():
            assert f"<!-- reproduction {name} -->\n\n{text}\n\n<!-- end -->" in page, name
    assert diagnosis.OPEN_SET.read_text(encoding="utf-8") == diagnosis.open_set(STORED)
    assert list(STORED) == diagnosis.numbers()


def test_a_number_stands_for_one_case() -> None:
    """The run with the flaw has the seed, tracker and length of the run without it."""
    cases = [draw(number) for number in range(62)]
    assert cases == [draw(number) for number in range(62)]
    for case in cases[::3]:
        with suppress(RefusedError):  # at odds with another value, and not counted
            flawed = case.begin()
            assert (flawed.seed, flawed.tracker, flawed.frames) == (case.number, case.base.tracker, case.base.frames)
    assert {case.base.experiment for case in cases} == set(EXPERIMENTS.own)


def test_all_names_of_the_file_exist() -> None:
    """Each name is a parameter of its experiment, or a flaw of pictures."""
    models = {name: type(find(name).simulate().parameters) for name in EXPERIMENTS.own}
    names = {f"{owner}.{it.name}" for owner, model in models.items() for it in declarations(model)}
    names |= {name.partition(".")[2] for name in names}
    for meaning in diagnosis.meanings():
        named = {*meaning.lowered, *meaning.raised, *meaning.changed, *meaning.left}
        assert named <= names, meaning.name
        assert {*meaning.pictures} <= {*PICTURES[True]}, meaning.name


@pytest.mark.parametrize(
    ("changed", "before", "after", "experiment", "right"),
    [
        ("sample_count", 800, 12, "ball", {"sample-impoverishment"}),
        ("sample_count", 12, 800, "ball", set()),
        ("measurement_noise_px", 20.0, 1.0, "ball", {"overconfident-weights", "shrinking-covariance"}),
        ("measurement_noise_px", 1.0, 20.0, "linkage", {"noisy-picture"}),
        ("noise", None, 0.5, "ball", {"noisy-picture"}),
        ("largest_cost", 255.0, 300.0, "trajectories", set()),
    ],
)
def test_the_right_cause_follows_from_the_change(
    changed: str, before: float | None, after: float, experiment: str, right: set[str]
) -> None:
    """The cause depends on direction and experiment; a parameter outside the file has no cause."""
    base = draw(2).base.model_copy(update={"experiment": experiment})
    assert Case(2, base, changed, before, after, 0).right == right


@pytest.mark.parametrize("kind", [*PICTURES[True], *(f"sine {kind}" for kind in PICTURES[False])])
def test_measurements_are_spoiled_from_a_frame_on(kind: str) -> None:
    """Pictures and numbers before the frame are unchanged; later ones differ, and one frame is always the same."""
    name, kind = ("sine", kind.removeprefix("sine ")) if kind.startswith("sine ") else ("ball", kind)
    setup = find(name).simulate()
    history = History(((0, setup.parameters),))
    source = setup.open_source(3, setup.parameters)
    spoiled = Spoiled(source, kind, 0.9, 5, 3)
    for frame in (4, 9):
        was, one, again = (it.frame(frame, history) for it in (source, spoiled, spoiled))
        seen = [it.signal if name == "sine" else it.picture for it in (was, one, again)]
        assert np.array_equal(seen[0], seen[1]) is (frame == 4)
        assert np.array_equal(seen[1], seen[2], equal_nan=name == "sine")


def test_a_case_that_the_flaw_does_not_lose_does_not_count() -> None:
    """A lost case is judged with the truth and without; one that holds is not. The record has the same."""
    assert STORED[2790] is None
    for number in (2790, 2793):
        assert judge_case(number) == STORED[number], "delete tests/data/open_set.jsonl, and measure again"


def test_shares_of_named_causes() -> None:
    """Right counts among named causes; without a right cause unclear is right; alarms count among the held runs."""
    size = FEW._replace(right=[])
    told = {0: FEW, 1: size, 2: size._replace(aided="unclear", unaided="wrong-dynamics"), 3: None}
    found = figures_of(told, "with the truth")
    assert found[:5] == (3, 0.5, 0.5, 0.0, 2 / 3)
    assert found.causes == {"sample-impoverishment": (2, 1), "unclear": (1, 1)}
    found = figures_of(told, "without the truth")
    assert (found.right, found.alarms) == (0.0, 1.0)
