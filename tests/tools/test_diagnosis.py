"""Runs that are lost by what was put there, and what the diagnosis says of them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.parameters import declarations
from pftrack.core.model.source import Frame, History
from pftrack.core.refusal import RefusedError
from pftrack.experiments import EXPERIMENTS, find
from pftrack.reproduce.pool import Pool
from tools import diagnosis
from tools.diagnosis import PICTURES, Case, Judgement, Spoiled, draw, figures_of, judge_case, read_judged

STORED = read_judged()
FEW = Judgement(["sample-impoverishment"], "sample-impoverishment", "unclear", calm_aided=True, calm_unaided=False)


def test_the_pages_and_the_library_say_what_is_stored() -> None:
    """`python -m tools.diagnosis table` writes them; all cases of the study are there."""
    for file, texts in diagnosis.pages(STORED).items():
        page = file.read_text(encoding="utf-8")
        for name, text in texts.items():
            assert f"<!-- reproduction {name} -->\n\n{text}\n\n<!-- end -->" in page, name
    assert diagnosis.OPEN_SET.read_text(encoding="utf-8") == diagnosis.open_set(STORED)
    assert list(STORED) == diagnosis.numbers()


def test_a_case_is_drawn_alike_again_and_leaves_the_rest_of_the_run_as_it_is() -> None:
    """A number stands for one case; with the flaw and without, the run has one seed, tracker and length."""
    for number in range(62):
        case = draw(number)
        assert case == draw(number)
        try:
            flawed = case.begin()
        except RefusedError:
            continue  # at odds with another value, and not counted
        assert (flawed.seed, flawed.tracker, flawed.frames) == (number, case.base.tracker, case.base.frames)
    assert {draw(number).base.experiment for number in range(62)} == set(EXPERIMENTS.own)


def test_all_that_the_file_names_is_there() -> None:
    """Each name is a parameter of an experiment, of the one that it says, or something that pictures can have."""
    models = {name: type(find(name).simulate().parameters) for name in EXPERIMENTS.own}
    names = {f"{owner}.{it.name}" for owner, model in models.items() for it in declarations(model)}
    names |= {name.partition(".")[2] for name in names}
    for meaning in diagnosis.meanings():
        named = {*meaning.lowered, *meaning.raised, *meaning.changed, *meaning.left}
        assert named <= names, meaning.name
        assert {*meaning.pictures} <= {*PICTURES[True]}, meaning.name


def case_of(changed: str, before: float | None, after: float, experiment: str = "ball", number: int = 2) -> Case:
    """Return a case in which this was changed."""
    base = draw(number).base.model_copy(update={"experiment": experiment})
    return Case(number, base, changed, before, after, 0)


def test_what_is_right_follows_from_what_was_changed() -> None:
    """Up or down, of the experiment or of the pictures; what the file does not name has no cause."""
    assert case_of("sample_count", 800, 12).right == {"sample-impoverishment"}
    assert case_of("sample_count", 12, 800).right == set()
    assert case_of("measurement_noise_px", 20.0, 1.0).right == {"overconfident-weights", "shrinking-covariance"}
    assert case_of("measurement_noise_px", 1.0, 20.0, "linkage").right == {"noisy-picture"}
    assert case_of("noise", None, 0.5).right == {"noisy-picture"}
    assert case_of("largest_cost", 255.0, 300.0, "trajectories").right == set()


def frames_of(name: str, frame: int, *spoiling: Any) -> list[Frame]:
    """Return a frame of an experiment's scene as it is, and twice as it is spoiled: by what, how much, from when on."""
    setup = find(name).simulate()
    history = History(((0, setup.parameters),))
    source = setup.open_source(3, setup.parameters)
    spoiled = Spoiled(source, *spoiling, 3)
    return [it.frame(frame, history) for it in (source, spoiled, spoiled)]


@pytest.mark.parametrize("kind", PICTURES[True])
def test_pictures_are_spoiled_from_a_frame_on(kind: str) -> None:
    """Before it they are as they were; from there on others, and of one frame always the same."""
    was, calm, _ = frames_of("ball", 4, kind, 0.9, 5)
    assert np.array_equal(calm.picture, was.picture)
    was, one, again = frames_of("ball", 9, kind, 0.9, 5)
    assert not np.array_equal(one.picture, was.picture)
    assert np.array_equal(one.picture, again.picture)
    assert one.index == 9


@pytest.mark.parametrize("kind", PICTURES[False])
def test_measured_numbers_are_spoiled_too(kind: str) -> None:
    """What is blank is not known; what is left out, frozen or noisy differs."""
    before, after, _ = (it.signal for it in frames_of("sine", 9, kind, 0.9, 5))
    assert before is not None
    assert after is not None
    assert not np.array_equal(before, after)
    assert np.isnan(after).all() == (kind == "blank")


def test_a_grown_picture_has_its_target_where_it_is_seen() -> None:
    """The truth grows with the picture, about its middle."""
    unchanged, larger, _ = frames_of("ball", 30, "size", 1.0, 0)
    was, grown = unchanged.target, larger.target
    assert was is not None
    assert grown is not None
    assert unchanged.picture is not None
    middle = (np.array(unchanged.picture.shape[1::-1]) - 1) / 2
    assert grown.position - middle == pytest.approx(2 * (was.position - middle))
    assert grown.size == 2 * was.size


def test_a_case_that_the_flaw_does_not_lose_does_not_count() -> None:
    """One that is lost is judged with the truth and without; one that holds all the same is not. So it is stored."""
    assert STORED[2790] is None
    for number in (2790, 2793, 2799):
        assert judge_case(number) == STORED[number], "delete tests/data/open_set.jsonl, and measure again"


def test_shares_are_of_what_is_named() -> None:
    """Right is of what is named; outside the list, unclear is right as well; alarms are of the runs that hold."""
    size = FEW._replace(right=[])
    told = {0: FEW, 1: size, 2: size._replace(aided="unclear", unaided="wrong-dynamics"), 3: None}
    found = figures_of(told, "with the truth")
    assert found[:5] == (3, 0.5, 0.5, 0.0, 2 / 3)
    assert found.causes == {"sample-impoverishment": (2, 1), "unclear": (1, 1)}
    found = figures_of(told, "without the truth")
    assert (found.right, found.alarms) == (0.0, 1.0)


def test_cases_that_are_stored_are_not_judged_again(tmp_path: Path) -> None:
    """The file is gone on with."""
    path = tmp_path / "judged.jsonl"
    path.write_text(f"{json.dumps([0, FEW])}\n[1, null]\n[2, null]\n", "utf-8")
    with Pool(1) as pool:
        for _ in range(2):
            diagnosis.measure(pool, range(4), path)
            assert pool.pieces == 1
    assert read_judged(path) == {0: FEW, 1: None, 2: None, 3: None}
