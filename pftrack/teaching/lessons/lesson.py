"""A lesson: one idea, shown, asked and checked; the judgement of its prediction, and its question as a poll.

A lesson asks for a prediction, then shows the result, and explains the error of the prediction. It shows a
*demonstration*, a figure that is a pure function of parameters and a seed, or a *scenario*, a run of an experiment with
some adjustable parameters. Its *checks* compare computed with exact values.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from pftrack.core.model.parameters import Parameters, revise
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.refusal import ParameterError
from pftrack.runs.reproduction import make
from pftrack.teaching.lessons.figure import Shown

LONGEST_RUN: Final = 2000
"""Largest number of frames: each reader computes the lesson's run, and a class does not wait longer."""

Line = Annotated[str, Field(min_length=1, max_length=120)]
Words = Annotated[str, Field(min_length=1, max_length=600)]
Name = Annotated[str, Field(min_length=1, max_length=64)]
Scalar = bool | int | float | Annotated[str, Field(max_length=200)]


class Part(BaseModel):
    """A part of a file's head, as it is written there; it has nothing but what is declared."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


ONCE_MINUTES: Final = 5.0
"""For the idea, the figure and the question of a lesson; each thing to try takes another minute."""


@dataclass(frozen=True)
class Demonstration:
    """A figure that is a pure function of parameters and a seed.

    Attributes:
        parameters: The defaults.
        show: (parameters, seed) -> the result, within 20 ms at the defaults.
        random: Whether the seed matters: there is a "new draw" then.
        seed: To begin with.
    """

    parameters: Parameters
    show: Callable[[Any, int], Shown]
    random: bool = False
    seed: int = 1


class Setting(Part):
    """Values that take effect in a frame."""

    frame: Annotated[int, Field(ge=0, le=LONGEST_RUN)] = 0
    values: Annotated[dict[Name, Scalar], Field(min_length=1, max_length=100)]


class RunPart(Part):
    """Recipe and display of a run.

    Attributes:
        tracker: The experiment's own choice if not given.
        seed: 0 if not given.
        frames: Length of the run; the experiment's own if not given.
        timeline: Values of parameters, `tracker` among them.
        unlocked: Names of the parameters that may be turned, "tracker" and "seed" among them where these may.
        frame: First shown frame.
        plots: Ids of the shown plots of the experiment; empty for all of them.
        layers: Names of layers shown from the beginning, in addition to those of the experiment.
    """

    tracker: Name | None = None
    seed: Annotated[int, Field(ge=0)] | None = None
    frames: Annotated[int, Field(ge=2, le=LONGEST_RUN)] | None = None
    timeline: Annotated[tuple[Setting, ...], Field(max_length=200)] = ()
    unlocked: Annotated[tuple[Name, ...], Field(max_length=8)] = ()
    plots: Annotated[tuple[Name, ...], Field(max_length=8)] = ()
    layers: Annotated[tuple[Words, ...], Field(max_length=8)] = ()
    frame: Annotated[int, Field(ge=0)] = 0


class Scenario(RunPart):
    """A run of an experiment with some adjustable parameters.

    Attributes:
        experiment: Its name.
        words: What to look for in it, one sentence, for a run that shows where an idea is used.
    """

    experiment: Name
    words: Words | Literal[""] = ""

    @property
    def recipe(self) -> Recipe:
        """The run."""
        return Recipe(
            experiment=self.experiment,
            tracker=self.tracker,
            seed=self.seed or 0,
            frames=self.frames,
            timeline=tuple(Change(each.frame, each.values) for each in self.timeline),
        )


Given: TypeAlias = float | str
"""An answer: a number (a point is the number on its axis), or the name of a choice."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The computed answer of a question.

    Attributes:
        exact: The right answer.
        measured: The lesson's measurement of it, where that is another number.
        words: The computation, a sentence: "2.04 measured over 40 repeats".
        frame: Frame of a run that shows the answer, if there is one.
    """

    exact: Given
    measured: float | None = None
    words: str = ""
    frame: int | None = None


class Mistake(Part):
    """A wrong answer of a usual kind.

    Attributes:
        given: The number or choice that this mistake leads to; or (lowest, highest) of a range of numbers.
        words: The probable reasoning, and its error; a sentence or two.
    """

    given: float | tuple[float, float] | Name
    words: Words


class Question(Part):
    """A prediction that is asked for before the answer is shown.

    Attributes:
        text: The question, one sentence.
        kind: "number" is typed, "choice" is chosen, a "point" is placed in a panel of the figure.
        words: Why the right answer is right, for everybody to read afterwards; a sentence or two.
        tolerance: Error up to which a number is right.
        unit: Unit of a number.
        bounds: Lowest and highest number that is an answer at all.
        choices: Names of the choices with their words.
        panel: For a "point": id of the panel in which it is placed.
        along: For a "point": the axis that counts.
        at: Values of parameters at which it is asked, where these are not the defaults.
        mistakes: Usual wrong answers; the first that fits is explained.
        expected: The answer that its author saw.
    """

    text: Words
    kind: Literal["number", "choice", "point"] = "number"
    words: Words
    tolerance: Annotated[float, Field(gt=0)] = 0.0
    unit: Annotated[str, Field(max_length=20)] = ""
    bounds: tuple[float, float] = (-1e6, 1e6)
    choices: Annotated[dict[Name, Words], Field(min_length=2, max_length=8)] | None = None
    panel: Annotated[str, Field(max_length=64)] = ""
    along: Literal["x", "y"] = "x"
    at: Annotated[dict[Name, Scalar], Field(max_length=100)] = {}
    mistakes: Annotated[tuple[Mistake, ...], Field(max_length=12)] = ()
    expected: float | Name | None = None


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of a check.

    Attributes:
        ours: The computed value.
        exact: The exact value, or the reference's figure.
        tolerance: Largest accepted distance from the exact value.
        words: Why nothing could be computed, where ours is NaN; a sentence.
    """

    ours: float
    exact: float
    tolerance: float
    words: str = ""

    @property
    def passed(self) -> bool:
        """Whether it passes; what is not finite never does."""
        return abs(self.ours - self.exact) <= self.tolerance

    def __str__(self) -> str:
        """Return it as a line: "0.2825, exact 0.2861, within 0.0106"."""
        failed = "" if self.passed else ", which it is not"
        return f"{self.ours:.4g}, exact {self.exact:.4g}, within {self.tolerance:.3g}{failed}"


@dataclass(frozen=True, slots=True)
class Check:
    """A claim of a lesson that is computed.

    Attributes:
        name: Among the lesson's checks, in lower case with hyphens.
        title: The claim, one sentence.
        run: Compute it; seeds are fixed.
    """

    name: str
    title: str
    run: Callable[[], Outcome]


@dataclass(frozen=True)
class Lesson:
    """One idea on one screen.

    Attributes:
        id: Name in commands and addresses.
        title: On the screen.
        idea: The idea, Markdown with formulas between dollar signs, at most 90 words.
        body: The demonstration or scenario.
        notice: What to notice in it, one sentence.
        tries: What to try, one sentence each.
        question: The prediction that is asked for.
        answer: (parameters, seed) -> the right answer. For a scenario: (run, computed to its end) -> the same.
        checks: Claims and their computations.
        uses: Applications of the idea: runs that can be opened.
        number: Place in the course; 0 for one outside it.
        origin: File or package that it comes from; empty for the project's own.
        source: Text of the file, where it comes from one.
        declared_minutes: Its duration in a class, if the author states it.
    """

    id: str
    title: str
    idea: str
    body: Demonstration | Scenario
    notice: str
    tries: tuple[str, ...]
    question: Question
    answer: Callable[..., Answer]
    checks: tuple[Check, ...] = ()
    uses: tuple[Scenario, ...] = ()
    number: int = 0
    origin: str = ""
    source: str = ""
    declared_minutes: float | None = None

    @property
    def minutes(self) -> float:
        """Its duration in a class: as stated by its author, or by the text, the figure, the question and the trials."""
        return ONCE_MINUTES + len(self.tries) if self.declared_minutes is None else self.declared_minutes


@dataclass(frozen=True)
class Computed:
    """Computations of a course module for its lesson, whose texts are in the file next to it.

    Attributes:
        answer: As `Lesson.answer`.
        checks: `Check.run` of each check, by name.
        figure: The demonstration; None where the file names a run.
    """

    answer: Callable[..., Answer]
    checks: Mapping[str, Callable[[], Outcome]]
    figure: Demonstration | None = None


class AnswerHead(Part):
    """The right answer, by name: a measure of the run, a number of the figure, or a lesson of the course."""

    measure: Line
    first_frame: Annotated[int, Field(ge=0, le=LONGEST_RUN)] = 0
    choices: Annotated[dict[Name, float], Field(min_length=2, max_length=8)] | None = None


def _named(given: object) -> object:
    """Return the head of an answer that is given by its name alone."""
    return {"measure": given} if isinstance(given, str) else given


class Head(RunPart):
    """All that stands in the head of a lesson's file; what each field means stands in docs/how-to/lessons.md."""

    id: Annotated[str, Field(max_length=64, pattern=r"^[a-z][a-z0-9]*(-[a-z0-9]+)*$")]
    title: Line
    experiment: Name | None = None
    figure: Name | None = None
    parameters: Annotated[dict[Name, Scalar], Field(max_length=100)] = {}
    question: Question
    answer: Annotated[AnswerHead, BeforeValidator(_named)]
    tries: Annotated[tuple[Words, ...], Field(min_length=1, max_length=6)]
    minutes: Annotated[float, Field(gt=0, le=180)] | None = None
    notice: Words
    checks: Annotated[dict[Name, Words], Field(max_length=20)] = {}
    uses: Annotated[tuple[Scenario, ...], Field(max_length=8)] = ()


@dataclass(frozen=True, slots=True)
class Verdict:
    """The feedback on a prediction.

    Attributes:
        right: Whether it is within the question's tolerance.
        given: The prediction.
        exact: The right answer.
        measured: The lesson's measurement of it, if any.
        frame: Frame of a run that shows the answer, if there is one.
        words: The verdict and its reason, in sentences.
    """

    right: bool
    given: Given
    exact: Given
    measured: float | None
    frame: int | None
    words: tuple[str, ...]


DECIMAL_COMMA = re.compile(r"([-+]?\d*),(\d+)")
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")
"""To some a thousand and more, to others one and three decimals."""


def judge(question: Question, answer: Answer, given: Given) -> Verdict:
    """Judge a prediction.

    Args:
        question: The question.
        answer: The right answer.
        given: The prediction: a number, or the name of a choice.

    Raises:
        ParameterError: It is not an answer to this question.
    """
    value = read_answer(question, given)
    if isinstance(value, str) or isinstance(answer.exact, str):
        right = value == answer.exact
    else:
        right = abs(value - answer.exact) <= question.tolerance * (1 + 1e-12)
    mistake = None if right else next((each for each in question.mistakes if _fits(each, value, question)), None)
    # The probable reasoning comes right after the answer, to which it refers.
    said = (_how_far(question, value, answer, right), mistake.words if mistake else "", answer.words, question.words)
    return Verdict(right, value, answer.exact, answer.measured, answer.frame, tuple(words for words in said if words))


def read_answer(question: Question, given: object) -> Given:
    """Return a prediction as its question understands it: of a number also as a person types it, with its unit.

    Raises:
        ParameterError: It is not an answer to this question.
    """
    if question.kind == "choice":
        choices = question.choices or {}
        if not isinstance(given, str) or given not in choices:
            raise ParameterError("answer", given, f"one of {', '.join(choices)}")
        return given
    low, high = question.bounds
    unit = f" {question.unit}" if question.unit else ""
    allowed = f"a number between {_write(low)} and {_write(high)}{unit}"
    value = _parse(given, question.unit) if isinstance(given, str) else given
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ParameterError("answer", given, allowed)
    if not low <= value <= high:
        raise ParameterError("answer", given, allowed)
    return float(value)


def _parse(text: str, unit: str) -> float | None:
    """Return the number that a person has typed, with a comma or a point, its unit, or as percent; None of others."""
    bare, factor = text.strip().replace("\N{MINUS SIGN}", "-"), 1.0
    if unit and bare.endswith(unit):
        bare = bare.removesuffix(unit)
    elif bare.endswith("%"):
        bare, factor = bare.removesuffix("%"), 0.01
    bare = bare.strip()
    if THOUSANDS.fullmatch(bare):
        return None  # rather asked for again than taken for what was not meant
    if (found := DECIMAL_COMMA.fullmatch(bare)) is not None:
        bare = ".".join(found.groups())
    try:
        return factor * float(bare)
    except ValueError:
        return None


def _fits(mistake: Mistake, value: Given, question: Question) -> bool:
    if isinstance(value, str) or isinstance(mistake.given, str):
        return value == mistake.given
    low, high = mistake.given if isinstance(mistake.given, tuple) else (mistake.given, mistake.given)
    return low - question.tolerance <= value <= high + question.tolerance


def _how_far(question: Question, value: Given, answer: Answer, right: bool) -> str:
    if isinstance(value, str) or isinstance(answer.exact, str):
        # Both are named: what follows speaks of "that", the one that was chosen.
        exact, said = ((question.choices or {}).get(str(each), each) for each in (answer.exact, value))
        return "Right." if right else f"The right answer is “{exact}”, not “{said}”."
    unit = f" {question.unit}" if question.unit else ""
    # The lesson's measurement, another number, is reported as well.
    exact = f"{_write(answer.exact)}{unit}" + (" in theory" if answer.measured is not None else "")
    if right:
        return f"Right: it is {exact}."
    return f"You said {_write(value)}{unit}; it is {exact}, which is {_write(abs(value - answer.exact), 3)}{unit} off."


def _write(value: float, digits: int = 4) -> str:
    """Return a number in a few digits, a large one whole: "10,000", not "1e+04"."""
    return f"{value:,.0f}" if abs(value) >= 10**digits - 0.5 else f"{value:.{digits}g}"


# The answers of a poll are the choices of a question. For a number or a point the range of answers is cut between the
# right one and the usual mistakes, so each lies in its own interval; where two lie far apart the cut is at their
# geometric mean.

MOST_ANSWERS: Final = 8
"""Number of answers that fits a phone and the number keys."""
FEWEST_VALUES: Final = 3
FAR: Final = 4.0
"""Ratio of two positive numbers from which on their geometric mean lies between them, to the eye."""
UNBOUNDED: Final = 1e6
"""Default bounds of a question."""


def poll_answers(question: Question, exact: Given | None = None) -> tuple[str, ...]:
    """Return the answers among which a class chooses, in ascending order where they are intervals.

    Args:
        question: Question of the lesson.
        exact: Its right answer, in the question's unit; not needed for a choice.

    Raises:
        ValueError: The question asks for a number, and its right answer is none.
    """
    if question.choices:
        return tuple(question.choices.values())
    if not isinstance(exact, float | int) or not math.isfinite(exact):
        raise ValueError("the right answer of this question is not a number, so no answers can be offered")
    between_values = (_cut(low, high) for low, high in pairwise(_values(question, float(exact))))
    cuts = dict.fromkeys(float(f"{cut:.2g}") for cut in between_values)  # two that are equal when rounded become one
    unit = f" {question.unit}" if question.unit else ""
    texts = [f"{cut:,.10g}" for cut in cuts]
    between = (f"{low} to {high}{unit}" for low, high in pairwise(texts))
    return (f"Below {texts[0]}{unit}", *between, f"Above {texts[-1]}{unit}")


def _values(question: Question, exact: float) -> list[float]:
    """Return the right answer and what is answered in its place, ascending, no two closer than the tolerance."""
    apart = max(question.tolerance, 1e-9 * abs(exact), 1e-12)
    found = [exact]
    for value in (*_mistakes(question), *_ends(question, exact)):
        is_spare = len(found) >= FEWEST_VALUES and value in _ends(question, exact)
        if len(found) < MOST_ANSWERS and not is_spare and all(abs(value - other) > apart for other in found):
            found.append(value)
    return sorted(found)


def _mistakes(question: Question) -> Iterator[float]:
    for mistake in question.mistakes:
        given = mistake.given
        if isinstance(given, tuple):
            yield sum(given) / 2
        elif not isinstance(given, str):
            yield float(given)


def _ends(question: Question, exact: float) -> tuple[float, ...]:
    """Return what is answered where few mistakes are declared: the bounds, or half and twice the right answer."""
    low, high = question.bounds
    if low > -UNBOUNDED and high < UNBOUNDED:
        return low, high
    return (exact / 2, 2 * exact) if exact else (-1.0, 1.0)


def _cut(low: float, high: float) -> float:
    return math.sqrt(low * high) if low > 0 and high > FAR * low else (low + high) / 2


# A demonstration's answer is a function of parameters and a seed; a scenario's is a function of the run that the
# question speaks of, computed to its end.


def question_recipe(lesson: Lesson) -> Recipe:
    """Return the run that a scenario's question is about: the scenario's own, with the values at which it is asked.

    Raises:
        TypeError: The lesson is not a scenario.
    """
    if not isinstance(lesson.body, Scenario):
        raise TypeError(f"the lesson {lesson.id} is a demonstration, which has no run")
    recipe, values = lesson.body.recipe, dict(lesson.question.at)
    seed = values.pop("seed", recipe.seed)
    timeline = (*recipe.timeline, Change(0, values)) if values else recipe.timeline
    return Recipe(**{**dict(recipe), "seed": seed, "timeline": timeline})


def answer_of(lesson: Lesson) -> Answer:
    """Compute the answer of a lesson's question from the run or the figure that it asks about.

    Raises:
        RefusedError: The run cannot be computed, or does not have the number that is asked for.
    """
    body, question = lesson.body, lesson.question
    if isinstance(body, Scenario):
        run = make(question_recipe(lesson))
        run.finish()
        return lesson.answer(run)
    return lesson.answer(revise(body.parameters, question.at), body.seed)
