"""What a lesson is: one idea, shown, asked and checked.

A lesson asks for a prediction before it shows, then shows, and says how far off the prediction was and why. What it
shows is a *demonstration*, a figure that is a pure function of parameters and a seed, or a *scenario*, a run of an
experiment of which some parameters may be turned. Its *checks* compare what it computes with what is exact.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias

from pftrack.core.model.parameters import Parameters, Value
from pftrack.core.model.recipe import Recipe
from pftrack.teaching.lessons.figure import Figure

__all__ = [
    "Answer",
    "Check",
    "Demonstration",
    "Lesson",
    "Mistake",
    "Number",
    "Outcome",
    "Question",
    "Scenario",
    "Shown",
    "Use",
]


ONCE_MINUTES: Final = 5.0
"""For the idea, the figure and the question of a lesson; each thing to try takes another minute."""


@dataclass(frozen=True, slots=True)
class Number:
    """A number that a lesson shows, with its exact value where that is known.

    Attributes:
        title: What it is.
        value: As computed here.
        exact: What it should be.
        tolerance: How far from the exact value it may be expected to be at these parameters.
        unit: Empty for a pure number.
        digits: Significant digits that are worth showing.
        reveals: Whether it gives the question's answer away, and is left out until that was answered.
    """

    title: str
    value: float
    exact: float | None = None
    tolerance: float | None = None
    unit: str = ""
    digits: int = 4
    reveals: bool = False

    def __str__(self) -> str:
        """Say it in a line: "Mean: 0.982 m, exact 1 m, within 0.05 m"."""
        known = (("", self.value), ("exact ", self.exact), ("within ", self.tolerance))
        unit = f" {self.unit}" if self.unit else ""
        said = (f"{word}{value:.{self.digits}g}{unit}" for word, value in known if value is not None)
        return f"{self.title}: {', '.join(said)}"


@dataclass(frozen=True, slots=True)
class Shown:
    """What a demonstration comes to at some parameters.

    Attributes:
        figure: What is drawn.
        numbers: The one that counts first.
    """

    figure: Figure
    numbers: tuple[Number, ...]


@dataclass(frozen=True)
class Demonstration:
    """A figure that is a pure function of parameters and a seed.

    Attributes:
        parameters: The defaults.
        show: (parameters, seed) -> what they come to, within 20 ms at the defaults.
        random: Whether the seed matters: there is a "new draw" then.
        seed: To begin with.
    """

    parameters: Parameters
    show: Callable[[Any, int], Shown]
    random: bool = False
    seed: int = 1


@dataclass(frozen=True)
class Scenario:
    """A run of an experiment, of which some parameters may be turned.

    Attributes:
        recipe: The run.
        unlocked: Names of the parameters that may be turned, "tracker" and "seed" among them where these may.
        frame: Where it stands at first.
        plots: Ids of the experiment's plots that are shown beside it; none for all of them.
        layers: Names of layers that are shown from the beginning, beside those that the experiment shows.
    """

    recipe: Recipe
    unlocked: tuple[str, ...] = ()
    frame: int = 0
    plots: tuple[str, ...] = ()
    layers: tuple[str, ...] = ()


Given: TypeAlias = float | str
"""What a person answers: a number (a point is the number on its axis), or the name of a choice."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What a question's answer is, computed.

    Attributes:
        exact: The right answer.
        measured: What the lesson measures in its place, where that is another number.
        words: What was computed, a sentence: "2.04 measured over 40 repeats".
    """

    exact: Given
    measured: float | None = None
    words: str = ""


@dataclass(frozen=True, slots=True)
class Mistake:
    """A wrong answer of a usual kind.

    Attributes:
        given: The number or choice that this mistake leads to; or (lowest, highest) of a range of numbers.
        words: What was probably thought, and why it is not so; a sentence or two.
    """

    given: float | str | tuple[float, float]
    words: str


@dataclass(frozen=True)
class Question:
    """A prediction that is asked for before the answer is shown.

    Attributes:
        text: What is asked, one sentence.
        kind: "number" is typed, "choice" is chosen, a "point" is placed in a panel of the figure.
        answer: (parameters, seed) -> the right answer. Of a scenario: (columns of the run, by name) -> the same.
        tolerance: By how much a number may be off and be right.
        words: Why the right answer is right, for everybody to read afterwards; a sentence or two.
        unit: Of a number.
        bounds: Lowest and highest number that is an answer at all.
        choices: Names of the choices with their words.
        panel: Of a "point": id of the panel in which it is placed.
        along: Of a "point": the axis that counts.
        at: Values of parameters at which it is asked, where these are not the defaults.
        mistakes: Usual wrong answers; the first that fits is explained.
    """

    text: str
    kind: Literal["number", "choice", "point"]
    answer: Callable[..., Answer]
    words: str
    tolerance: float = 0.0
    unit: str = ""
    bounds: tuple[float, float] = (-1e6, 1e6)
    choices: Mapping[str, str] | None = None
    panel: str = ""
    along: Literal["x", "y"] = "x"
    at: Mapping[str, Value] | None = None
    mistakes: tuple[Mistake, ...] = ()


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a check came to.

    Attributes:
        ours: What is computed here.
        exact: What is exact, or the reference's figure.
        tolerance: It passes if ours is no further than that from the exact value.
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
        """Say it in a line: "0.2825, exact 0.2861, within 0.0106"."""
        failed = "" if self.passed else ", which it is not"
        return f"{self.ours:.4g}, exact {self.exact:.4g}, within {self.tolerance:.3g}{failed}"


@dataclass(frozen=True, slots=True)
class Check:
    """A claim of a lesson that is computed.

    Attributes:
        name: Among the lesson's checks, in lower case with hyphens.
        title: What is claimed, one sentence.
        run: Compute it; seeds are fixed.
    """

    name: str
    title: str
    run: Callable[[], Outcome]


@dataclass(frozen=True, slots=True)
class Use:
    """Where an idea is used: a session that can be opened beside the lesson.

    Attributes:
        words: What to look for there, one sentence.
        scenario: The session.
    """

    words: str
    scenario: Scenario


@dataclass(frozen=True)
class Lesson:
    """One idea on one screen.

    Attributes:
        id: Name in commands and addresses.
        title: On the screen.
        idea: The idea, Markdown with formulas between dollar signs, at most 90 words.
        body: What is shown.
        notice: What to notice in it, one sentence.
        tries: What to try, one sentence each.
        question: The prediction that is asked for.
        checks: What is claimed and computed.
        uses: Where it is used.
        number: Place in the course; 0 for one that stands beside it.
        origin: File or package that it comes from; empty for the project's own.
        source: Text of the file, where it comes from one.
        declared_minutes: How long it takes a class, where its author says so.
    """

    id: str
    title: str
    idea: str
    body: Demonstration | Scenario
    notice: str
    tries: tuple[str, ...]
    question: Question
    checks: tuple[Check, ...] = ()
    uses: tuple[Use, ...] = ()
    number: int = 0
    origin: str = ""
    source: str = ""
    declared_minutes: float | None = None

    @property
    def minutes(self) -> float:
        """How long it takes a class: what its author says, or the text, the figure, the question and what to try."""
        return ONCE_MINUTES + len(self.tries) if self.declared_minutes is None else self.declared_minutes
