"""Exercises: right solutions pass whatever the seed is, and each kind of mistake is found by its property."""

import inspect
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from pftrack.experiments.own.code import trust
from pftrack.teaching.exercises import Verdict, exercise_named_in, properties, read_exercises
from pftrack.teaching.exercises.grading import check, check_text, results, table_of
from pftrack.teaching.exercises.properties import PROPERTIES
from pftrack.teaching.exercises.submission import Check, Exercise, Submission, bernstein_margin, moments_on_grid

SOLUTIONS = {path.stem.replace("_", "-"): path for path in sorted((Path(__file__).parent / "solutions").glob("*.py"))}
SHIPPED = read_exercises()


def exercise(name: str) -> Exercise:
    return SHIPPED.exercises[name]


def text_of(name: str) -> str:
    return SOLUTIONS[name].read_text()


def verdict(name: str, text: str, asked: str, seed: int = 0) -> Verdict:
    """What is found of one property in a file."""
    wanted = exercise(name)
    known = [each for each in wanted.checks if each.property == asked] or [Check(property=asked)]
    (finding,) = check_text(wanted.model_copy(update={"checks": tuple(known)}), "mine", text, seed=seed).findings
    return finding.verdict


def changed(name: str, old: str, new: str) -> str:
    text = text_of(name)
    assert old in text
    return text.replace(old, new)


class TestShipped:
    """Those that come with pftrack."""

    def test_there_are_seven_and_each_can_be_begun(self) -> None:
        """Nothing is wrong with their files; what one begins with can be loaded, and has what is to be written."""
        assert SHIPPED.problems == ()
        assert SHIPPED.exercises.keys() == SOLUTIONS.keys()
        for each in SHIPPED.exercises.values():
            trust(each.skeleton)
            assert set(each.functions) <= set(Submission(each, "mine", each.skeleton).defined)
            assert exercise_named_in(each.skeleton) == each.id
            assert each.hints

    def test_every_property_is_asked_for(self) -> None:
        """By one exercise at least."""
        assert {check.property for each in SHIPPED.exercises.values() for check in each.checks} == PROPERTIES.keys()

    def test_every_verdict_has_its_words(self) -> None:
        """The file declares what the code says by name, and nothing else."""
        source = inspect.getsource(properties)
        for name, what in re.findall(r'"([a-z-]+) ([a-z]+)"[,)]', source):
            assert name not in PROPERTIES or what in PROPERTIES[name].words
        for name, each in PROPERTIES.items():
            assert all(f'"{name} {what}"' in source or f'"{what}"' in source for what in each.words), name

    @pytest.mark.parametrize("name", SOLUTIONS)
    def test_the_right_solution_has_all_points(self, name: str) -> None:
        """With numbers for everything that was left to chance."""
        report = check(exercise(name), SOLUTIONS[name])
        assert report.passed, [each.verdict.words for each in report.findings if not each.verdict.holds]
        assert report.points == exercise(name).points

    @pytest.mark.slow
    @pytest.mark.parametrize("seed", [1_000, 2_000, 3_000, 4_000, 5_000])
    @pytest.mark.parametrize("name", SOLUTIONS)
    def test_the_right_solution_hangs_on_no_seed(self, name: str, seed: int) -> None:
        """A right solution never fails."""
        report = check(exercise(name), SOLUTIONS[name], seed=seed)
        assert report.passed, [each.verdict.words for each in report.findings if not each.verdict.holds]

    @pytest.mark.parametrize("name", SOLUTIONS)
    def test_what_one_begins_with_has_no_points(self, name: str) -> None:
        """It says in which line something is still to be written."""
        report = check_text(exercise(name), "mine", exercise(name).skeleton)
        assert report.points == 0
        assert "NotImplementedError" in report.findings[0].verdict.words
        assert re.search(r"mine\.py, line \d+", report.findings[0].verdict.words)

    def test_no_solution_is_in_the_package(self) -> None:
        """Whoever installs it finds none."""
        package = Path(__file__).parents[3] / "pftrack"
        solved = [re.search(r"    .*=.*\n.*", text_of(name)) for name in SOLUTIONS]
        everything = "".join(
            path.read_text() for path in (package / "teaching" / "exercises").rglob("*.*") if path.suffix != ".pyc"
        )
        assert not [found[0] for found in solved if found is not None and found[0] in everything]


RESAMPLE = "import numpy as np\n\ndef resample(log_weights, count, rng):\n"


class TestResampling:
    """Mistakes in drawing parents."""

    @pytest.mark.parametrize(
        "body",
        [
            "    return np.searchsorted(w / w[-1], (0.5 + np.arange(count)) / count)\n",
            "    best = np.argsort(log_weights)[len(w) // 2 :]\n    return rng.choice(best, count)\n",
            "    w = np.exp(1.15 * log_weights)\n    return rng.choice(len(w), count, p=w / w.sum())\n",
            "    return np.searchsorted(w[1:-1] / w[-1], (rng.random() + np.arange(count)) / count)\n",
        ],
        ids=["no randomness", "the best half", "another power", "the neighbour"],
    )
    def test_bias_is_found(self, body: str) -> None:
        """It is told with the particle, its children, and what is due."""
        text = f"{RESAMPLE}    w = np.cumsum(np.exp(log_weights))\n{body}"
        found = verdict("systematic-resampling", text, "unbiased")
        assert not found.holds
        assert abs(found.numbers["children"] - found.numbers["expected"]) > found.numbers["margin"]
        assert found.seed == 0

    @pytest.mark.parametrize("scheme", ["multinomial", "stratified"])
    def test_every_scheme_that_is_unbiased_passes(self, scheme: str) -> None:
        """But only even ones are even."""
        points = {"multinomial": "rng.random(count)", "stratified": "(rng.random(count) + np.arange(count)) / count"}
        body = f"    w = np.cumsum(np.exp(log_weights))\n    return np.searchsorted(w / w[-1], {points[scheme]})\n"
        assert verdict("systematic-resampling", RESAMPLE + body, "unbiased").holds
        assert verdict("systematic-resampling", RESAMPLE + body, "keeps-count").holds
        uneven = verdict("systematic-resampling", RESAMPLE + body, "even")
        assert not uneven.holds
        # The seed that is told shows it at once.
        assert uneven.seed is not None
        assert not verdict("systematic-resampling", RESAMPLE + body, "even", uneven.seed).holds

    @pytest.mark.parametrize(
        ("body", "words"),
        [
            ("    return rng.choice(len(log_weights), len(log_weights), p=np.exp(log_weights))\n", "parents where"),
            ("    return rng.integers(0, len(log_weights), count)\n", "whose weight is zero"),
            ("    return rng.random(count)\n", "instead of whole numbers"),
            ("    return np.arange(count)\n", "returned the parent"),
        ],
    )
    def test_what_no_parents_can_be_is_found(self, body: str, words: str) -> None:
        """Other numbers of them, ones of weight zero, ones that there are not."""
        assert words in verdict("systematic-resampling", RESAMPLE + body, "keeps-count").words

    @pytest.mark.parametrize("old", ["1 / np.sum(np.exp(log_weights) ** 2)", "len(log_weights) / 2"])
    def test_another_threshold_is_found(self, old: str) -> None:
        """With the effective sample size of the case."""
        text = changed("adaptive-resampling", old, "len(log_weights) / 3")
        found = verdict("adaptive-resampling", text, "threshold")
        assert not found.holds
        assert found.numbers["effective_sample_size"] <= found.numbers["count"]

    def test_the_bound_holds(self) -> None:
        """Sums of 0-or-1 numbers lie within the margin as often as it says, and more so."""
        rng = np.random.default_rng(1)
        chances = np.array([0.001, 0.1, 0.5, 0.9])
        sums = rng.binomial(500, chances, (20_000, 4))
        beyond = np.abs(sums - 500 * chances) > bernstein_margin(500 * chances * (1 - chances), 0.05)
        assert np.mean(beyond.any(axis=1)) < 0.05


class TestWeights:
    """Mistakes in weights."""

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("    top = log_weights.max()\n", "    top = 0.0\n", "around -2,000"),
            ("log_weights - log_sum, log_sum", "log_weights - top, log_sum", "weights that sum to"),
            ("log_weights - log_sum, log_sum", "log_weights - log_sum, np.exp(log_sum)", "logarithm of their sum"),
            ("    if top == -np.inf:\n", "    if False:\n", "that are all -inf"),
            (
                "    return log_weights - log_sum, log_sum",
                "    return log_weights - log_sum",
                "must return log_weights and",
            ),
            (
                "    return log_weights - log_sum, log_sum",
                "    return np.log(np.exp(log_weights - log_sum) * 0 + 1 / len(log_weights)), log_sum",
                "the weight",
            ),
        ],
        ids=["underflow", "not normalised", "no logarithm", "all -inf", "no sum", "equal"],
    )
    def test_what_is_no_distribution_is_found(self, old: str, new: str, words: str) -> None:
        """By the case in which it shows."""
        found = verdict("importance-weights", changed("importance-weights", old, new), "distribution")
        assert not found.holds
        assert words in found.words

    def test_a_run_with_weights_that_do_not_sum_to_one_stands(self) -> None:
        """So that whoever watches it sees the line."""
        text = changed("importance-weights", "log_weights - log_sum, log_sum", "log_weights - top, log_sum")
        assert "weights that sum to" in verdict("importance-weights", text, "evidence").words

    def test_a_step_that_draws_the_dead_is_found(self) -> None:
        """Parents of weight zero have no children."""
        text = changed("auxiliary-filter", "first = log_weights + fits", "first = fits")
        found = verdict("auxiliary-filter", text, "distribution")
        assert "whose weight is zero" in found.words


class TestExactAnswers:
    """Mistakes that show in the evidence and the moments."""

    def test_the_grid_is_the_kalman_filter(self) -> None:
        """Two ways to the exact answer come to the same."""
        wanted = exercise("bootstrap-filter")
        trust(text_of("bootstrap-filter"))
        submission = Submission(wanted, "mine", text_of("bootstrap-filter"))
        for seed in range(3):
            row = submission.rows(seed, "kalman")[-1]
            assert moments_on_grid(submission, seed, noise="process_noise_sd") == pytest.approx(
                (row.estimate[0], row.sigma[0]), rel=1e-6
            )

    @pytest.mark.parametrize(
        ("name", "old", "new"),
        [
            ("bootstrap-filter", " - np.log(noise * np.sqrt(2 * np.pi))", ""),
            ("bootstrap-filter", "-0.5 * off**2", "-off**2"),
            ("bootstrap-filter", "noise = parameters.assumed_noise_sd", "noise = 1.3 * parameters.assumed_noise_sd"),
            ("optimal-proposal", "axis=1), correction", "axis=1), 0 * correction"),
            ("auxiliary-filter", "np.full(count, log_sum - np.log(count))", "np.full(count, -np.log(count))"),
            ("importance-weights", "log_weights - log_sum, log_sum", "log_weights - log_sum, 0.0"),
        ],
        ids=["no constant", "no half", "noise", "no correction", "weights", "no sum"],
    )  # fmt: skip
    def test_wrong_evidence_is_found(self, name: str, old: str, new: str) -> None:
        """It lies further off than its scatter explains, or scatters more than sampling makes it."""
        found = verdict(name, changed(name, old, new), "evidence")
        assert not found.holds
        off = abs(found.numbers["mean"] - found.numbers["expected"]) / found.numbers["margin"]
        assert max(off, found.numbers["spread"] / found.numbers["most_spread"]) > 1

    @pytest.mark.parametrize(
        ("old", "new"),
        [
            ("-0.5 * off**2", "-off**2"),
            ("2 * newest - before +", "newest +"),
        ],
        ids=["no half", "no velocity"],
    )
    def test_wrong_moments_are_found(self, old: str, new: str) -> None:
        """The mean or the deviation is off."""
        assert not verdict("bootstrap-filter", changed("bootstrap-filter", old, new), "moments").holds

    def test_a_filter_that_does_not_look_ahead_is_no_steadier(self) -> None:
        """The bootstrap filter is right, and not what was asked for."""
        moved = "propagate(states, parameters, rng), np.zeros(len(states))"
        blind = f"{text_of('bootstrap-filter')}\n\ndef propose(states, parameters, rng):\n    return {moved}\n"
        found = verdict("optimal-proposal", blind, "steadier")
        assert not found.holds
        assert found.numbers["ratio"] > found.numbers["most"]

    def test_a_target_that_is_lost_is_found(self) -> None:
        """With the seed of a scene in which that happens."""
        text = changed("bootstrap-filter", "2 * newest - before +", "newest + 0.3 +")
        found = verdict("bootstrap-filter", text, "held")
        assert not found.holds
        assert found.numbers["held"] < 19
        assert found.seed is not None


class TestConduct:
    """Mistakes in how functions go about it."""

    def test_quadratic_cost_is_found(self) -> None:
        """Eight times the particles take more than twenty times as long."""
        body = """    w = np.cumsum(np.exp(log_weights))
    u = (rng.random() + np.arange(count)) / count
    return (w[None, :] < u[:, None]).sum(axis=1)
"""
        found = verdict("systematic-resampling", RESAMPLE + body, "linear")
        assert not found.holds
        assert found.numbers["exponent"] > 1.5

    @pytest.mark.parametrize(
        ("name", "old", "new", "words"),
        [
            ("importance-weights", "    top =", "    log_weights[0] = 1\n    top =", "normalise changes log_weights"),
            ("bootstrap-filter", "    noise =", "    states[:, 0] += 1\n    noise =", "log_likelihood changes states"),
            ("bootstrap-filter", "    noise =", "    frame.signal[:] = 0\n    noise =", "changes frame.signal"),
        ],
    )  # fmt: skip
    def test_mutation_is_found(self, name: str, old: str, new: str, words: str) -> None:
        """By what it changes."""
        found = verdict(name, changed(name, old, new), "unchanged")
        assert not found.holds
        assert words in found.words

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("rng.standard_normal", "np.random.standard_normal", "different numbers with the same seed"),
            ("rng.standard_normal", "np.random.default_rng().standard_normal", "different numbers with the same seed"),
            ("rng.standard_normal", "np.random.default_rng(7).standard_normal", "for every seed"),
            (
                "    newest, before",
                "    states = states + memory\n    newest, before",
                "the file is loaded again",
            ),
        ],
        ids=["global", "own", "fixed", "memory"],
    )
    def test_own_randomness_and_memory_are_found(self, old: str, new: str, words: str) -> None:
        """All numbers follow from the seed, in whatever order they are computed."""
        text = changed("bootstrap-filter", old, new).replace(
            "\n\n\n", "\nmemory = np.random.default_rng().random()\n\n\n", 1
        )
        found = verdict("bootstrap-filter", text, "replays")
        assert not found.holds
        assert words in found.words

    def test_what_breaks_is_told_by_its_line(self) -> None:
        """As everywhere else; and what is missing by its name."""
        found = verdict("systematic-resampling", RESAMPLE + "    return nothing\n", "unbiased")
        assert "mine.py, line 4: NameError" in found.words
        missing = verdict("adaptive-resampling", RESAMPLE + "    return nothing\n", "unbiased")
        assert missing.words == "mine.py does not define should_resample."


HEAD: Mapping[str, str] = {
    "id": "mine",
    "title": "Mine",
    "experiment": "sine",
    "functions": "[resample]",
    "checks": "[{property: unbiased}]",
}


class TestFiles:
    """Exercises of lecturers."""

    def written(self, folder: Path, end: str = '```python\nEXERCISE = "mine"\n```\n', **values: str) -> Path:
        head = {**HEAD, **values}
        lines = "".join(f"{key}: {value}\n" for key, value in head.items() if value)
        (folder / "mine.md").write_text(f"---\n{lines}---\nDo it.\n\n{end}")
        return folder

    def test_a_file_in_a_folder_is_an_exercise(self, tmp_path: Path) -> None:
        """Its text is what stands before the file to begin with."""
        found = read_exercises(self.written(tmp_path))
        assert found.problems == ()
        mine = found.exercises["mine"]
        assert (mine.text, mine.skeleton, mine.points) == ("Do it.", 'EXERCISE = "mine"\n', 1)

    @pytest.mark.parametrize(
        ("values", "line", "words"),
        [
            ({"experiment": "sinus"}, 4, "got 'sinus'"),
            ({"functions": "[resampel]"}, 5, "did you mean resample?"),
            ({"checks": "[{property: unbaised}]"}, 6, "did you mean unbiased?"),
            ({"checks": "[{property: unbiased, options: {drawn: 5}}]"}, 6, "did you mean draws?"),
            ({"checks": "[{property: evidence}]"}, 6, "needs the option exact"),
            ({"checks": "[{property: evidence, options: {exact: 3}}]"}, 6, "must be a text"),
            ({"checks": "[{proprety: unbiased}]"}, 6, "did you mean property?"),
            ({"title": ""}, 2, "docs/how-to/exercises.md"),
            ({"id": "switching"}, 2, "is taken by"),
            ({"end": "No file.\n"}, 8, "between ```python"),
            ({"end": "```python\nx = 1\n```\n"}, 8, 'EXERCISE = "mine"'),
        ],
    )
    def test_mistakes_are_told_by_their_lines(
        self, values: Mapping[str, str], line: int, words: str, tmp_path: Path
    ) -> None:
        """And harm no other."""
        end = {"end": '```python\nEXERCISE = "switching"\n```\n'} if values.get("id") else {}
        problems = read_exercises(self.written(tmp_path, **{**end, **values})).problems
        assert [words in each.message for each in problems].count(True) >= 1, problems
        assert line in {each.line for each in problems}, problems

    def test_whose_answer_a_file_is_is_read_and_not_executed(self) -> None:
        """By its line."""
        assert exercise_named_in("import nothing\nEXERCISE = 'it'\n") == "it"
        assert exercise_named_in("x = 1\n") is None


def test_reports_have_the_form_of_gradescope() -> None:
    """A score, and a test for each property with its own."""
    report = check_text(
        exercise("importance-weights"), "mine", changed("importance-weights", "log_sum, log_sum", "top, 0")
    )
    found = results(report)
    assert found["score"] == sum(test["score"] for test in found["tests"]) < found["max_score"]
    allowed = {"score", "max_score", "status", "name", "output", "visibility", "extra_data", "number"}
    for test in found["tests"]:
        assert test.keys() <= allowed
        assert test["status"] == ("passed" if test["score"] else "failed")
        assert test["output"]
    columns, (row,) = table_of({"ada": found})
    assert columns[0] == "name"
    assert dict(zip(columns, row, strict=True))["score"] == f"{found['score']:g}"


# The test file for otter-grader that the documentation shows, run by otter-grader where it is installed.

PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "exercises.md"
SOLUTION = Path(__file__).parent / "solutions" / "importance_weights.py"


def test_otter_gives_the_points_of_the_checks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All for a right solution; for one that does not normalise those of what holds, with words for the rest."""
    otter = pytest.importorskip("otter.test_files.exception_test")
    (text,) = re.findall(r"```py\n(from functools.*?)```", PAGE.read_text(), re.DOTALL)
    monkeypatch.chdir(tmp_path)
    right = SOLUTION.read_text()
    for solution, points in ((right, 9), (right.replace("log_weights - log_sum, log_sum", "log_weights, log_sum"), 3)):
        Path("my_filter.py").write_text(solution)
        graded = otter.ExceptionTestFile.from_string(text, "q1.py")
        graded.run({})
        assert (graded.name, graded.score, graded.possible) == ("importance-weights", points, 9)
    assert "distribution result" in graded.summary()
