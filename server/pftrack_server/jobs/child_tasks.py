"""Child tasks: work that must not run in the web process, each in a process of its own with limits.

It is there in some 20 ms, and ended when it falls silent, when nobody waits for it any more, and when the web process
is gone. Short work has other places than work that may take minutes, so that the one never waits for the other.
"""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from pftrack.analysis.counterfactuals.report import LossError
from pftrack.analysis.fitting.found import FitError
from pftrack.analysis.other_seeds import ReplayError
from pftrack.core.model.parameters import ParameterError
from pftrack.core.model.setup import ExportError
from pftrack.experiments.own.sliders import FilterFileError
from pftrack.process import Budget, Ending, Fault, Outcome, Refusal, Reply, run_task
from pftrack.runs.comparison import ComparisonError
from pftrack.runs.record import RecordError
from pftrack.sources.limits import SourceError
from pftrack.sources.truth import TruthError
from pftrack_server.errors import RefusedError, UnavailableError
from pftrack_server.jobs import functions
from pftrack_server.jobs.queue import Queues, unless_gone
from pftrack_server.log import RateLimitedLogger
from pftrack_server.processes import FORK_SERVER

REFUSALS = (
    ComparisonError,
    ExportError,
    FilterFileError,
    FitError,
    LossError,
    ParameterError,
    RecordError,
    ReplayError,
    SourceError,
    TruthError,
)
"""Exceptions whose text is for whoever asked; all others are for the log."""

BUDGET = Budget()
LONG_S = 30.0
"""So long a long task may take, as far as its place in the line goes."""

warnings = RateLimitedLogger(__name__)


async def _never() -> None:
    await asyncio.Event().wait()


@dataclass(frozen=True)
class ChildTasks:
    """Sends tasks to confined processes, a few at a time.

    Attributes:
        queues: Where tasks wait for their turn.
        gone: Waits until the client that has asked is gone; its short tasks are then dropped.
    """

    queues: Queues
    gone: Callable[[], Awaitable[object]] = _never

    async def check(self) -> None:
        """Make sure that processes can be made; this waits for no other task, but one after the other.

        Raises:
            RefusedError: They die.
            UnavailableError: They do not answer.
        """
        async with self.queues.check.place():
            _result(await self.answer(functions.do_nothing), BUDGET)

    async def run(self, function: Callable[..., Any], *arguments: object) -> Any:  # noqa: ANN401 - whatever the function returns
        """Return the result of a function of `pftrack_server.jobs.functions`, of values that JSON can say and bytes.

        Raises:
            RefusedError: The function refused its arguments, with a sentence, or its process died.
            UnavailableError: It took too long.
            ClientGoneError: Its client hung up.
        """
        return _result(await unless_gone(self._in_turn(function, arguments), self.gone), BUDGET)

    async def run_long(
        self,
        function: Callable[..., Any],
        *arguments: object,
        cpu_seconds: float,
        on_step: Callable[[int, int], None],
        file_bytes: int | None = None,
        may_be_short: bool = False,
    ) -> Any:  # noqa: ANN401 - whatever the function returns
        """Return the result of a function that tells how far it is; it takes as long as it takes.

        Args:
            function: A generator of `pftrack_server.jobs.functions`.
            arguments: For it.
            cpu_seconds: Processor time that it may take.
            on_step: Called now and then with the steps that are done, and with all that there are.
            file_bytes: Length of any file that it writes; None for any.
            may_be_short: Whether it may take a moment only, so that it begins among light work.

        Raises:
            RefusedError: The function refused its arguments, with a sentence, or its process died.
            UnavailableError: It gave no sign of life for too long.
        """
        budget = Budget(cpu_seconds=cpu_seconds, file_bytes=file_bytes)
        work = partial(self.answer, function, *arguments, budget=budget, on_step=on_step)
        if may_be_short:
            return _result(await self.queues.take_turn(work, weight_s=LONG_S), budget)
        async with self.queues.heavy.place(weight_s=LONG_S):
            return _result(await work(), budget)

    async def run_beside(
        self,
        function: Callable[..., Any],
        *arguments: object,
        budget: Budget,
        on_step: Callable[..., None],
        stopped: Callable[[], bool],
    ) -> Any:  # noqa: ANN401 - whatever the function returns
        """Return the result of a function that waits for no turn, since it leaves the processors to all others.

        Raises:
            RefusedError: The function refused its arguments, with a sentence, or its process died.
            UnavailableError: It gave no sign of life for too long, or was stopped.
        """
        outcome = await self.answer(function, *arguments, budget=budget, on_step=on_step, stopped=stopped)
        return _result(outcome, budget)

    async def _in_turn(self, function: Callable[..., Any], arguments: tuple[object, ...]) -> Outcome:
        async with self.queues.light.place():
            return await self.answer(function, *arguments)

    async def answer(
        self,
        function: Callable[..., Any],
        *arguments: object,
        budget: Budget = BUDGET,
        on_step: Callable[..., None] = lambda *_: None,
        stopped: Callable[[], bool] | None = None,
    ) -> Outcome:
        """Have a task carried out now, whoever waits for a turn, and return what came of it.

        Its process, and whatever that has started, has ended when this returns or is cancelled.

        Args:
            function: One of `pftrack_server.jobs.functions`.
            arguments: For it.
            budget: What it may take.
            on_step: Called now and then with what it yields, such as the steps that are done and all that there are.
            stopped: Asked ten times a second whether to give up; the process is then killed.
        """
        outcome = await run_task(
            FORK_SERVER,
            function,
            *arguments,
            budget=budget,
            refusals=REFUSALS,
            on_step=lambda step: on_step(step) if isinstance(step, dict) else on_step(*step),
            stopped=stopped,
        )
        if isinstance(outcome, Fault):
            warnings.warn("a task failed", task=function.__name__, traceback=outcome.traceback)
        return outcome


def ending_message(how: Ending, budget: Budget) -> str:
    """Return what is told of a task whose process has ended without an answer, a sentence."""
    match how:
        case Ending.OUT_OF_TIME:
            return f"This did not respond for {budget.silence_s:g} s and was stopped."
        case Ending.OUT_OF_CPU_TIME:
            return f"This needs more than the {budget.cpu_seconds:g} s of processor time that it may use."
        case Ending.KILLED:
            return "This could not be finished: its process was killed, by the system or by somebody. Try again."
    return "This could not be finished: its process ended unexpectedly. What it reads may be damaged."


def _result(outcome: Outcome, budget: Budget) -> Any:  # noqa: ANN401 - whatever the function returns
    match outcome:
        case Reply(value=value):
            return value
        case Refusal(message=message):
            raise RefusedError(message[:1].upper() + message[1:])
        case Ending.OUT_OF_TIME | Ending.KILLED as how:
            raise UnavailableError(ending_message(how, budget))
        case Ending() as how:
            raise RefusedError(ending_message(how, budget))
    raise RefusedError("This failed, or what it reads cannot be read safely; the server's log says where.")
