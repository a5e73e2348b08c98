"""Exercises: right solutions pass with any seed, and each kind of mistake is found by its property."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pftrack.experiments.own.code import trust
from pftrack.teaching.exercises import Verdict, exercise_named_in, read_exercises
from pftrack.teaching.exercises.grading import check, check_text, results, table_of
from pftrack.teaching.exercises.properties import PROPERTIES
from pftrack.teaching.exercises.submission import Check, Exercise, Submission, bernstein_margin, moments_on_grid

SOLUTIONS = {path.stem.replace("_", "-"): path for path in sorted((Path(__file__).parent / "solutions").glob("*.py"))}
SHIPPED = read_exercises()


def exercise(name: str) -> Exercise:
    return SHIPPED.exercises[name]


def text_of(name: str) -> str:
    return SOLUTIONS[name].read_text()


def fewer(of: Exercise, **most: int) -> Exercise:
    """Return an exercise whose checks compute at most so much; their margins are those of what they compute."""

    def smaller(check: Check) -> Check:
        options = {**PROPERTIES[check.property].options, **check.options}
        less = {name: min(options[name], value) for name, value in most.items() if name in options}
        return check.model_copy(update={"options": {**check.options, **less}})

    return of.model_copy(update={"checks": tuple(map(smaller, of.checks))})


def verdict(name: str, text: str, asked: str, seed: int = 0) -> Verdict:
    """Return the verdict on one property of a file."""
    wanted = exercise(name)
    known = [each for each in wanted.checks if each.property == asked] or [Check(property=asked)]
    of = fewer(wanted.model_copy(update={"checks": tuple(known)}), draws=1000)
    (finding,) = check_text(of, "mine", text, seed=seed).findings
    return finding.verdict


def changed(name: str, old: str, new: str) -> str:
    text = text_of(name)
    assert old in text
    return text.replace(old, new)


# The exercises of pftrack.


@pytest.mark.parametrize("name", SOLUTIONS)
def test_a_skeleton_has_no_points(name: str) -> None:
    """It can be loaded, defines all functions, and its report names the line that is still to be written."""
    assert SHIPPED.problems == ()
    assert SHIPPED.exercises.keys() == SOLUTIONS.keys()
    each = exercise(name)
    trust(each.skeleton)
    assert set(each.functions) <= set(Submission(each, "mine", each.skeleton).defined)
    assert exercise_named_in(each.skeleton) == each.id
    assert each.hints
    report = check_text(each, "mine", each.skeleton)
    assert report.points == 0
    assert re.search(r"mine\.py, line \d+.*NotImplementedError", report.findings[0].verdict.words)


def test_every_property_belongs_to_an_exercise() -> None:
    """No property is unused."""
    assert {check.property for each in SHIPPED.exercises.values() for check in each.checks} == PROPERTIES.keys()


FEWER = {"runs": 6, "needed": 6, "draws": 300, "large": 4000}
AS_SHIPPED = [pytest.param(seed, {}, marks=pytest.mark.slow) for seed in range(0, 6_000, 1_000)]


@pytest.mark.parametrize(("seed", "most"), [(0, FEWER), *AS_SHIPPED])
@pytest.mark.parametrize("name", SOLUTIONS)
def test_the_right_solution_has_all_points(name: str, seed: int, most: dict[str, int]) -> None:
    """A right solution passes with any seed."""
    report = check(fewer(exercise(name), **most), SOLUTIONS[name], seed=seed)
    assert report.passed, [each.verdict.words for each in report.findings if not each.verdict.holds]
    assert report.points == exercise(name).points


def test_no_solution_is_in_the_package() -> None:
    """A student who installs pftrack finds no solution in it."""
    folder = Path(__file__).parents[3] / "pftrack" / "teaching" / "exercises"
    solved = [re.search(r"    .*=.*\n.*", text_of(name)) for name in SOLUTIONS]
    everything = "".join(path.read_text() for path in folder.rglob("*.*") if path.suffix != ".pyc")
    assert not [found[0] for found in solved if found is not None and found[0] in everything]


# Kinds of mistakes.

RETURN = "return np.searchsorted(reached / reached[-1], points)"
POWER = "w = np.exp(1.3 * log_weights)\n    return rng.choice(len(w), count, p=w / w.sum())"
QUADRATIC = "return (reached[None, :] < points[:, None]).sum(axis=1)"
SUM = "log_weights - log_sum, log_sum"
EQUAL = "np.log(np.exp(log_weights - log_sum) * 0 + 1 / len(log_weights)), log_sum"
PROPAGATE = "\n\n\ndef propagate(states, parameters, rng):\n"
MEMORY = f"\nmemory = np.random.default_rng().random(){PROPAGATE}    states = states + memory\n"
LOOKING = """    variance = 1 / (1 / moving + 1 / measuring)
    mean = variance * (predicted / moving + frame.signal[0] / measuring)
"""
NORMAL = "rng.standard_normal"
MISTAKES: dict[str, list[tuple[str, ...]]] = {
    "systematic-resampling": [
        ("rng.random() +", "0.5 +", "unbiased"),
        (RETURN, POWER, "unbiased"),
        (RETURN, "return rng.choice(len(log_weights), len(log_weights))", "keeps-count", "parents where"),
        (RETURN, "return rng.integers(0, len(log_weights), count)", "keeps-count", "whose weight is zero"),
        (RETURN, "return rng.random(count)", "keeps-count", "instead of whole numbers"),
        (RETURN, "return np.arange(count)", "keeps-count", "returned the parent"),
        (RETURN, QUADRATIC, "linear"),
        (RETURN, "return nothing", "unbiased", "mine.py, line 11: NameError"),
    ],
    "adaptive-resampling": [
        ("should_resample", "resampled", "unbiased", "mine.py does not define should_resample."),
        ("len(log_weights) / 2", "len(log_weights) / 3", "threshold"),
    ],
    "importance-weights": [
        ("top = log_weights.max()", "top = 0.0", "distribution", "around -2,000"),
        (SUM, "log_weights - top, log_sum", "evidence", "weights that sum to"),
        (SUM, "log_weights - log_sum, np.exp(log_sum)", "distribution", "logarithm of their sum"),
        (SUM, "log_weights - log_sum", "distribution", "must return log_weights and"),
        (SUM, EQUAL, "distribution", "the weight"),
        (SUM, "log_weights - log_sum, 0.0", "evidence"),
        ("if top == -np.inf:", "if False:", "distribution", "that are all -inf"),
        ("    top =", "    log_weights[0] = 1\n    top =", "unchanged", "normalise changes log_weights"),
    ],
    "auxiliary-filter": [("np.full(count, log_sum - np.log(count))", "np.full(count, -np.log(count))", "evidence")],
    "bootstrap-filter": [
        ("noise = parameters", "noise = 1.3 * parameters", "evidence"),
        ("-0.5 * off**2", "-off**2", "moments"),
        ("2 * newest - before +", "newest + 0.3 +", "held"),
        ("    noise =", "    frame.signal[:] = 0\n    noise =", "unchanged", "changes frame.signal"),
        (NORMAL, "np.random.standard_normal", "replays", "different numbers with the same seed"),
        (NORMAL, "np.random.default_rng(7).standard_normal", "replays", "for every seed"),
        (PROPAGATE, MEMORY, "replays", "the file is loaded again"),
    ],
    "optimal-proposal": [(LOOKING, "    variance, mean = moving, predicted\n", "steadier")],
}
"""By exercise: the text replaced in its solution, the new text, and the property and words that report it."""

SHOWN: dict[str, Callable[[Verdict], bool]] = {
    "unbiased": lambda it: it.seed == 0 and abs(it.numbers["children"] - it.numbers["expected"]) > it.numbers["margin"],
    "threshold": lambda it: it.numbers["effective_sample_size"] <= it.numbers["count"],
    "steadier": lambda it: it.numbers["ratio"] > it.numbers["most"],
    "linear": lambda it: it.numbers["exponent"] > 1.5,
    "held": lambda it: it.seed is not None and it.numbers["held"] < 19,
    "moments": lambda it: bool(it.words),
    "evidence": lambda it: (
        abs(it.numbers["mean"] - it.numbers["expected"]) > it.numbers["margin"]
        or it.numbers["spread"] > it.numbers["most_spread"]
    ),
}
"""By property: how the numbers of a verdict show the mistake."""


@pytest.mark.parametrize(("name", "row"), [(name, row) for name, rows in MISTAKES.items() for row in rows])
def test_a_mistake_is_found(name: str, row: tuple[str, ...]) -> None:
    """The verdict names the case, or has a number that is further off than chance explains."""
    old, new, asked, *words = row
    found = verdict(name, changed(name, old, new), asked)
    assert not found.holds
    assert all(each in found.words for each in words)
    assert words or SHOWN[asked](found)


def test_every_unbiased_scheme_passes() -> None:
    """Multinomial resampling fails only for its uneven copies, and does so again with the reported seed."""
    text = changed("systematic-resampling", "(rng.random() + np.arange(count)) / count", "rng.random(count)")
    assert verdict("systematic-resampling", text, "unbiased").holds
    assert verdict("systematic-resampling", text, "keeps-count").holds
    uneven = verdict("systematic-resampling", text, "even")
    assert not uneven.holds
    assert uneven.seed is not None
    assert not verdict("systematic-resampling", text, "even", uneven.seed).holds


def test_the_bound_holds() -> None:
    """Sums of 0-or-1 numbers lie within the margin at least as often as stated."""
    rng = np.random.default_rng(1)
    chances = np.array([0.001, 0.1, 0.5, 0.9])
    sums = rng.binomial(500, chances, (20_000, 4))
    beyond = np.abs(sums - 500 * chances) > bernstein_margin(500 * chances * (1 - chances), 0.05)
    assert np.mean(beyond.any(axis=1)) < 0.05


def test_the_grid_is_the_kalman_filter() -> None:
    """Two ways to the exact answer agree."""
    trust(text_of("bootstrap-filter"))
    submission = Submission(exercise("bootstrap-filter"), "mine", text_of("bootstrap-filter"))
    for seed in range(3):
        row = submission.rows(seed, "kalman")[-1]
        exact = pytest.approx((row.estimate[0], row.sigma[0]), rel=1e-6)
        assert moments_on_grid(submission, seed, noise="process_noise_sd") == exact


# Exercises of lecturers.

MINE = """---
id: mine
title: Mine
experiment: sine
functions: [resample]
checks: [{property: unbiased}]
---
Do it.

```python
EXERCISE = "mine"
```
"""


def test_a_file_in_a_folder_is_an_exercise(tmp_path: Path) -> None:
    """Its text ends before the skeleton; the exercise of an answer is read without executing the file."""
    (tmp_path / "mine.md").write_text(MINE)
    found = read_exercises(tmp_path)
    assert found.problems == ()
    mine = found.exercises["mine"]
    assert (mine.text, mine.skeleton, mine.points) == ("Do it.", 'EXERCISE = "mine"\n', 1)
    assert exercise_named_in("import nothing\nEXERCISE = 'it'\n") == "it"
    assert exercise_named_in("x = 1\n") is None


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("sine", "sinus", 4, "got 'sinus'"),
        ("[resample]", "[resampel]", 5, "did you mean resample?"),
        ("unbiased", "unbaised", 6, "did you mean unbiased?"),
        ("unbiased", "unbiased, options: {drawn: 5}", 6, "did you mean draws?"),
        ("unbiased", "evidence", 6, "needs the option exact"),
        ("title: Mine\n", "", 2, "docs/how-to/exercises.md"),
        ("mine", "switching", 2, "is taken by"),
        ("```python", "```", 8, "between ```python"),
        ('EXERCISE = "mine"', "x = 1", 8, 'EXERCISE = "mine"'),
    ],
)
def test_mistakes_in_a_file_are_reported_with_lines(old: str, new: str, line: int, words: str, tmp_path: Path) -> None:
    """Each message names the line and the remedy."""
    (tmp_path / "mine.md").write_text(MINE.replace(old, new))
    problems = read_exercises(tmp_path).problems
    assert any(each.line == line and words in each.message for each in problems), problems


def test_reports_have_the_form_of_gradescope() -> None:
    """They have a score, and a test with a score for each property."""
    text = changed("importance-weights", SUM, "log_weights - top, 0")
    found = results(check_text(exercise("importance-weights"), "mine", text))
    assert found["score"] == sum(test["score"] for test in found["tests"]) < found["max_score"]
    for test in found["tests"]:
        assert test["status"] == ("passed" if test["score"] else "failed")
        assert test["output"]
    columns, (row,) = table_of({"ada": found})
    assert columns[0] == "name"
    assert dict(zip(columns, row, strict=True))["score"] == f"{found['score']:g}"
