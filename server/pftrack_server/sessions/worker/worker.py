"""The worker: one process that owns a session's run and computes it at the chosen speed.

Between two frames it reads the pipe. It reports all computed frames, at most thirty times a second, and draws only when
the web process has taken the last drawing. Many frames, for a seek or to resume a session, are computed in the same
loop, so that people can watch, and a pause or another seek can interrupt.
"""

import logging
import os
import socket
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, get_args

from pftrack.core.model.drawing import Drawing, from_front
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.doctor.compiling import cases, run_case, watch
from pftrack.doctor.memory import cache_folder
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.own.code import FilterFileError, trust
from pftrack.process import BlockingEnd, confine, end_with_parent, give_way, leave_interrupts_to_parent
from pftrack.vision.rendering import png, render
from pftrack_server.core.pictures import PictureEncoder
from pftrack_server.sessions.spec import Goal, Problem, RunSnapshot, differences
from pftrack_server.sessions.worker import protocol
from pftrack_server.sessions.worker.codec import DrawingEncoder
from pftrack_server.sessions.worker.run_tree import RunTree, problem_of

FORMS: tuple[protocol.Form, ...] = get_args(protocol.Form)
TELL_S = 1 / 30
# A slightly early frame must not be skipped, or thirty a second would become fifteen.
EARLY = 0.8
HEARTBEAT_S = 1.0
MEASURED_EVERY_S = 1.0
"""Interval of measures while frames are computed, s; they read all frames so far."""
KEEP_AFTER_S = 5.0
LARGEST_SHARE = 0.05
"""Most of the time that checkpoints may take, as a share."""
# How long a command or a start may take before it becomes a seek that can be watched and interrupted.
AT_ONCE_S = 0.5

NICENESS, GIVING_WAY = 3, 8
"""Niceness of a worker: the web process comes first, and sweeps, with 10, last."""
OPEN_FILES = 256

log = logging.getLogger(__name__)


@dataclass
class Way:
    """A seek to a goal, one step at a time, and the request that waits for its end.

    Attributes:
        goal: The goal.
        number: Number of the request.
        steps: The remaining steps.
        known: The last frame that had been computed before; another goal meanwhile does not give it up.
    """

    goal: Goal
    number: int
    steps: Iterator[dict[str, Any] | None]
    known: int


class Checkpoints:
    """When a worker stores its computed states, so that a resumed session need not wait.

    The computing time decides: a run that can be computed again in a moment is never stored; one that takes minutes is
    stored after every few seconds of computing. Writing takes at most a small share of the time.
    """

    def __init__(self, tree: RunTree) -> None:
        self._tree = tree
        self._unkept_s: dict[str, float] = {}
        """Computing time of each branch that is not in a checkpoint yet, s."""
        self._write_s = 0.0

    def on_frame(self, seconds: float) -> None:
        """Note the computing time of a frame of the active branch, and write a checkpoint if one is due."""
        name = self._tree.active
        unkept = self._unkept_s.get(name, 0.0) + seconds
        self._unkept_s[name] = unkept
        if unkept < max(KEEP_AFTER_S, self._write_s / LARGEST_SHARE):
            return
        self._unkept_s[name] = 0.0
        begun = time.monotonic()
        try:
            self._tree.keep_states()
        except (OSError, ValueError) as error:
            # The run can be computed again: only time is lost.
            log.warning("the states of branch %s were not stored: %s", name, error)
        self._write_s = time.monotonic() - begun


class Worker:
    """The loop of a worker."""

    def __init__(self, pipe: BlockingEnd, config: protocol.WorkerConfig) -> None:
        self._pipe = pipe
        self._told = time.monotonic()
        self._compiled = 0
        with watch(lambda _: self._heartbeat(), self._count_compiled):
            self._tree = RunTree(config, self._keep_alive)
        self._checkpoints = Checkpoints(self._tree)
        self._playing = False
        self._speed = config.run.speed
        self._stop_at = config.run.stop_at
        self._stopped = ""
        self._due = 0.0
        self._behind_s = 0.0
        self._measures: dict[str, float | int] = {}
        self._look = ""
        self._broken: Problem | None = self._tree.problem
        """Why a filter file cannot be used; reported until a usable version is saved, whatever happens meanwhile."""
        self._problem: Problem | None = None
        """Why the next frame cannot be computed."""
        self._measured = 0.0
        self._rows: list[dict[str, Any]] = []
        self._news = False
        self._credits: set[protocol.Form] = set()
        self._undrawn: set[protocol.Form] = set(FORMS)
        self._drawing: Drawing | None = None
        self._pictures = PictureEncoder()
        self._encoder = DrawingEncoder(self._pictures)
        self._way: Way | None = None
        self._request = protocol.Request(protocol.OPENING, protocol.Order())
        """The present or last order."""
        self._left: Way | None = None
        """The seek that the present order has stopped."""
        self._reported = config.run
        with watch(lambda _: self._heartbeat(), self._count_compiled):
            self._start_seek(config.run.bound, protocol.OPENING, known=config.run.bound.computed)

    def serve(self) -> None:
        """Report that the run is ready, then read commands and compute until the web process hangs up."""
        self._rows = []
        self._reported = self._snapshot()
        self._pipe.send(protocol.Ready(self._tree.describe(), self._reported, self._tree.rows(0)))
        self._told = time.monotonic()
        if self._way is None:
            self._pipe.send(protocol.Reply(protocol.OPENING))
        with watch(self._tell_compiling, self._count_compiled):
            while True:
                message = self._pipe.receive(self._time_to_wait_s())
                if isinstance(message, protocol.Credit):
                    self._credits.add(message.form)
                elif isinstance(message, protocol.Request):
                    self._answer(message)
                try:
                    self._compute()
                except FilterFileError as error:
                    self._halt(error)
                self._tell()

    # ------------------------------------------------------------ time

    def _time_to_wait_s(self) -> float:
        """Return the time until the next duty, s."""
        if self._way is not None or (self._playing and self._speed == 0):
            return 0.0
        now = time.monotonic()
        waits = [self._told + HEARTBEAT_S - now]
        if self._playing:
            waits.append(self._due - now)
        if self._news or (self._undrawn & self._credits):
            waits.append(self._told + EARLY * TELL_S - now)
        return min(waits)

    @property
    def _period(self) -> float:
        """Time between two frames, s; 0 for as fast as possible."""
        return 1 / (self._tree.run.source.frame_rate_hz * self._speed) if self._speed else 0.0

    def _compute(self) -> None:
        """Compute one frame if one is due.

        Raises:
            FilterFileError: A person's filter cannot continue.
        """
        if (way := self._way) is not None:
            if not self._step(way):
                self._reply(way.number)
        elif self._playing and time.monotonic() >= self._due:
            begun = time.monotonic()
            self._note_step(self._tree.forward(), begun)
            self._stop_if_lost()
            if self._speed:
                # After a stall the clock continues from now, so that the lost time is not played in fast motion.
                due = self._due + self._period
                self._due = max(due, time.monotonic() - self._period)
                self._behind_s += self._due - due
            if self._tree.ended:
                self._playing = False

    def _stop_if_lost(self) -> None:
        """Stop at a frame in which the target is probably lost, unless it was in the frame before.

        On a recording no probability is calibrated; there marks and the tracker's own report decide.
        """
        limit, run = self._stop_at, self._tree.run
        frame = run.position
        if limit is None or frame == 0:
            return
        if run.setup.footage is None:
            before, now = (self._tree.loss_probability(one) for one in (frame - 1, frame))
            words = f"probably lost, {100 * now:.0f} %"
        else:
            before, now = (float(run.diagnostics[one].is_lost) for one in (frame - 1, frame))
            words = "lost"
        if now >= limit and not before >= limit:
            self._playing = False
            self._stopped = f"Stopped: {words}"

    def _halt(self, error: FilterFileError) -> None:
        """Stop at the present frame, since a filter cannot continue, and report why."""
        way, self._way, self._playing = self._way, None, False
        self._news = True
        # A broken file saved since is reported instead: the run continues with the version before it.
        if self._broken is None or self._broken.file != error.file:
            self._problem = problem_of(error)
        if way is not None:
            self._report(draw=True)
            self._pipe.send(protocol.Reply(way.number, error=error))

    def _note_step(self, row: dict[str, Any] | None, begun: float) -> None:
        """Note a step, and the computing time of its frame if it had to be computed."""
        if row is not None:
            self._problem = None
            self._rows.append(row)
            self._checkpoints.on_frame(time.monotonic() - begun)
        self._redraw()

    def _start_seek(self, goal: Goal, number: int, *, known: int, at_once_s: float = AT_ONCE_S) -> None:
        """Go to a goal: at once if that takes only a moment, otherwise step by step."""
        goal = self._tree.reachable_goal(goal)
        way = self._way = Way(goal, number, self._tree.seek_steps(goal), known)
        end = time.monotonic() + at_once_s
        while time.monotonic() < end and self._step(way):
            pass

    def _step(self, way: Way) -> bool:
        """Take one step; return whether there was one left."""
        begun = time.monotonic()
        try:
            self._note_step(next(way.steps), begun)
        except StopIteration:
            self._way = None
            return False
        return True

    def _redraw(self) -> None:
        """Have the shown frame drawn again."""
        self._news, self._undrawn, self._drawing = True, set(FORMS), None

    def _keep_alive(self) -> None:
        """Send a heartbeat if no event was sent for a while."""
        if time.monotonic() - self._told >= HEARTBEAT_S:
            self._heartbeat()

    def _heartbeat(self) -> None:
        self._pipe.send(protocol.Heartbeat())
        self._told = time.monotonic()

    def _tell_compiling(self, name: str) -> None:
        """Report, within a step, that a function has to be compiled before it can continue.

        Nothing else is reported: the snapshot must not be read before the step is done. The end of compiling is
        reported in any case.
        """
        del name
        self._reported = self._reported.model_copy(update={"compiling": self._compiled})
        # No drawing will come for a while, so messages must not wait for one.
        self._pipe.send(protocol.Progress({"compiling": self._compiled}, is_ahead=False))
        self._told, self._news = time.monotonic(), True

    def _count_compiled(self, name: str, seconds: float) -> None:
        del name, seconds
        self._compiled += 1

    # ------------------------------------------------------------ events

    def _snapshot(self) -> RunSnapshot:
        """Return the snapshot of the run."""
        goal = self._way.goal if self._way is not None else None
        now = time.monotonic()
        if not (self._playing or self._way) or now - self._measured > MEASURED_EVERY_S:
            self._measures, self._look, self._measured = self._tree.measures(), self._tree.look(), now
        return self._tree.snapshot().model_copy(
            update={
                "playing": self._playing,
                "speed": self._speed,
                "stop_at": self._stop_at,
                "stopped": self._stopped,
                "behind_s": round(self._behind_s, 1) if self._playing and self._speed else 0.0,
                "goal": goal and goal.computed,
                "goal_position": goal and goal.position,
                "measured": self._measures,
                "look": self._look,
                "problem": self._problem or self._broken,
            }
        )

    def _tell(self) -> None:
        """Send what is new, at most thirty times a second, or a heartbeat."""
        now = time.monotonic()
        if (self._news or self._undrawn & self._credits) and now - self._told >= EARLY * TELL_S:
            self._report(draw=True)
            self._told = time.monotonic()
        else:
            self._keep_alive()

    def _report(self, *, draw: bool) -> None:
        rows, self._rows = self._tree.with_loss(self._rows), []
        forms = self._undrawn & self._credits if draw else set[protocol.Form]()
        scene = flat = None
        if forms:
            # The other form, requested a little later, uses the same drawing.
            self._drawing = self._drawing or self._tree.drawing()
            # The finer pictures come first: the scene can use them too.
            seen = from_front(self._drawing, self._tree.run.experiment.display.layers)
            flat = self._encoder.encode(seen, self._tree.run.position) if "flat" in forms else None
            scene = self._pictures.for_scene(self._drawing) if "scene" in forms else None
            self._credits -= forms
            self._undrawn -= forms
        after = self._snapshot()  # which may report that it compiles
        changes, self._reported = differences(self._reported, after), after
        self._pipe.send(protocol.Progress(changes, rows, scene, flat, is_ahead="flat" in self._undrawn))
        self._news = False

    def _reply(self, number: int, result: object = None) -> None:
        # Changes are sent before the answer, so that it never contradicts them; while playing, without a drawing: so
        # the next frame, which shows the command's effect, can be sent at once.
        self._report(draw=not self._playing)
        self._pipe.send(protocol.Reply(number, result))

    # ------------------------------------------------------------ orders

    def _answer(self, request: protocol.Request) -> None:
        order = request.order
        self._request, self._left = request, None
        if order.interrupts:
            self._left, self._way, self._stopped = self._way, None, ""
        left = self._left
        try:
            result = self._carry_out(order)
        except (OSError, RefusedError) as error:
            self._way = self._way or left
            if self._news or self._rows:
                self._report(draw=not self._playing)
            self._pipe.send(protocol.Reply(request.number, error=error))
            return
        if order.interrupts and result is None:
            self._redraw()
        if left is not None:
            self._reply(left.number)
        if self._way is None or not order.interrupts:
            self._reply(request.number, result)

    def _carry_out(self, order: protocol.Order) -> Any:  # noqa: ANN401 - each has an answer of its own
        """Carry out an order; return its answer, or None if the session itself is the answer."""
        tree = self._tree
        match order:
            case protocol.ChangeValues() | protocol.MoveBelief():
                return self._change(order.values if isinstance(order, protocol.ChangeValues) else self._landing(order))
            case protocol.MakeBranch(frame=frame, values=values, seed=seed):
                self._flush()
                tree.branch(self._request.branch, frame, values if seed is None else {**values, "seed": seed})
            case protocol.ShowBranch() if self._request.known is not None:
                self._activate(self._request.known)
            case protocol.ReviseFilter(name=name, text=text):
                self._revise_filter(name, text)
            case protocol.Inspect():
                found = tree.inspect(order)
                self._redraw()
                return found
            case protocol.Save(path=path):
                return {"summary": tree.save(Path(path)), "thumbnail": self._picture()}
            case protocol.Picture():
                return self._picture()
            case protocol.Explain(frame=frame, branch=branch):
                return tree.explain(frame, branch)
            case _:
                self._steer(order)
        return None

    def _steer(self, order: protocol.Order) -> None:
        """Play, stop, seek or restart."""
        tree = self._tree
        match order:
            case protocol.Play():
                if tree.ended:
                    tree.run.seek(0)
                self._playing, self._due, self._behind_s = True, time.monotonic(), 0.0
            case protocol.Pause():
                self._playing = False
            case protocol.Step(kind=kind):
                # During a seek, from its goal.
                position = tree.run.position if self._left is None else self._left.goal.position
                self._seek(min(max(position + (1 if kind == "step" else -1), 0), tree.run.frames - 1))
            case protocol.Seek(frame=frame):
                self._seek(frame)
            case protocol.BeforeLoss():
                self._seek(tree.before_loss())
            case protocol.SetSpeed(speed=speed):
                # The next frame is due at the new speed at the latest, but not at once: a correction is not a frame.
                self._speed, self._behind_s = speed, 0.0
                self._due = min(self._due, time.monotonic() + self._period)
            case protocol.StopAt(probability=probability):
                self._stop_at, self._stopped = probability, ""
            case protocol.Restart(seed=seed):
                tree.restart(seed)
                self._report_restart()

    def _seek(self, frame: int) -> None:
        """Go to a frame; frames known before an interrupted seek are still computed again.

        Raises:
            ParameterError: The frame is outside the run.
        """
        last = self._tree.run.frames - 1
        if not 0 <= frame <= last:
            raise ParameterError("frame", frame, f"a frame of the run, 0 to {last}")
        self._playing = False
        known = max(self._tree.run.computed, self._left.known if self._left is not None else 0)
        at_once_s = AT_ONCE_S if max(frame, known) <= self._tree.run.computed else 0.0
        self._start_seek(Goal(max(frame, known), frame), self._request.number, known=known, at_once_s=at_once_s)

    def _landing(self, order: protocol.MoveBelief) -> dict[str, Any]:
        return self._tree.run.landing(order.frame, order.particle, order.place)

    def _change(self, values: dict[str, Any]) -> protocol.Changed:
        tree = self._tree
        restarts = tree.restarts
        if values:
            self._flush()
            tree.change(values, self._request.branch)
        restarted = tree.restarts != restarts
        if restarted:
            self._report_restart()
        elif tree.redraws(values):
            self._redraw()
        run = tree.snapshot()
        frame = 0 if restarted else run.position + 1
        return protocol.Changed(parameters=run.parameters, tracker=run.tracker, frame=frame, branch=run.branch)

    def _revise_filter(self, name: str, text: str) -> None:
        """Continue with another version of a filter file, and try it at once in any phase.

        An unusable version is reported and changes nothing; one that fails in the next frame stops the run.
        """
        self._flush()
        try:
            self._tree.revise_filter(name, text, self._request.branch)
        except FilterFileError as error:
            self._problem, self._broken, self._news, self._playing = None, problem_of(error), True, False
            return
        self._problem = self._broken = None
        self._report(draw=False)
        self._pipe.send(protocol.Described(self._tree.describe()))
        try:
            self._tree.try_filter(name)
        except FilterFileError as error:
            self._halt(error)

    def _activate(self, run: RunSnapshot) -> None:
        """Show another branch; compute it again if this worker does not hold it."""
        self._flush()
        again = self._tree.activate(run.branch, run.recipe)
        self._playing = False
        if again:
            # The web process may lack them: it forgets all diagnostics when the server ends.
            self._rows = self._tree.rows(0)
            self._start_seek(run.bound, self._request.number, known=run.bound.computed)

    def _picture(self) -> bytes:
        """Return the shown frame as PNG, enlarged up to a width of 640 px."""
        drawing = self._tree.drawing()
        layers = self._tree.experiment.display.shown
        scale = max(1.0, min(4.0, 640 / max(drawing.width, 1)))
        return png(render(drawing, layers=layers, scale=scale, caption=False))

    def _report_restart(self) -> None:
        """Report the rows of a restarted run."""
        self._rows = self._tree.rows(0)
        self._due = time.monotonic()
        self._redraw()

    def _flush(self) -> None:
        """Send the active branch's rows before another branch becomes active."""
        if self._rows:
            self._report(draw=False)


def main(end: socket.socket, config: protocol.WorkerConfig) -> None:
    """Run a session's worker until the web process hangs up."""
    leave_interrupts_to_parent()
    confine(memory_bytes=config.memory_bytes, cpu_seconds=config.cpu_seconds, open_files=OPEN_FILES)
    # It leads a process session of its own, like every other computing child. Where the kernel weighs such sessions
    # before processes (see `give_way`), a worker in the web process's session would have only a part of one weight: an
    # exploration, with a whole weight, would take much of the run's time.
    os.setsid()
    end_with_parent()
    # A person waits for the first picture.
    give_way(GIVING_WAY if config.gives_way else NICENESS, patience_s=0.0)
    trust(*config.filters)
    pipe = BlockingEnd(end)
    try:
        try:
            worker = Worker(pipe, config)
        except RefusedError as error:
            pipe.send(protocol.Failed(str(error), error))
            return
        worker.serve()
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return
    except MemoryError:
        mebibytes = config.memory_bytes >> 20
        message = f"The run needed more than the {mebibytes} MiB of memory that a session may use."
    except Exception as error:  # noqa: BLE001 - whatever it was, it is reported once and ends this session alone
        traceback.print_exc()
        message = f"The computation failed ({type(error).__name__}); the server's log says where."
    with suppress(OSError):
        pipe.send(protocol.Failed(message))
    sys.exit(1)


def load_compiled(name: str) -> None:
    """Step and draw an experiment at its defaults for some frames, which takes 0.1 to 0.5 s.

    Workers load the code of other trackers and settings when they use them. If compiled code cannot be kept on disk,
    everything is compiled here, or each worker would compile it. An experiment of another package is skipped: its
    faults shall occur in its own workers.
    """
    if name in EXPERIMENTS.own:
        experiment = EXPERIMENTS[name]
        for tracker, values in islice(cases(experiment), 1 if cache_folder() else None):
            drawing = run_case(experiment, tracker, values)
        png(render(drawing))
