"""The workbench and the pipe, without processes."""

import asyncio
import dataclasses
import json
import socket
from typing import Any

import numpy as np
import pytest

from pftrack.experiments import EXPERIMENTS
from pftrack.parameters import ParameterError
from pftrack.run import Change
from server.sessions.pipe import WebEnd, WorkerEnd, pair
from server.sessions.protocol import Beat, Card, Credit, Order, Picture, Reply, Request
from server.sessions.spec import BranchSpec, SessionSpec
from server.sessions.view import view
from server.sessions.workbench import Workbench
from tests.server.apart import run


def order(**more: Any) -> Order:
    known: dict[str, Any] = {
        "session": "s",
        "experiment": "ball",
        "tracker": None,
        "seed": 3,
        "frames": 60,
        "timeline": (),
        "branch": "b0",
    }
    return Order(**{**known, **more})


def forward(bench: Workbench, frames: int) -> None:
    for _ in range(frames):
        bench.forward()


class TestWorkbench:
    def test_only_new_frames_have_news(self) -> None:
        """Going forward tells of a frame when it is computed, and not when it is seen again."""
        bench = Workbench(order())
        first = bench.forward()
        assert first is not None
        assert first["frame"] == 1
        bench.run.seek(0)
        assert bench.forward() is None

    @pytest.mark.parametrize("name", EXPERIMENTS)
    def test_a_card_that_was_stored_shows_the_same_plots(self, name: str) -> None:
        """What is drawn and written is told to the page as the experiment declares it, also from a file."""
        experiment = EXPERIMENTS[name]
        card = Workbench(order(experiment=name, frames=2)).card()
        spec = SessionSpec(id="s", experiment=name, branches={"b0": BranchSpec(id="b0", title="Main", tracker="t")})
        for known in (card, Card(**json.loads(json.dumps(dataclasses.asdict(card))))):
            shown = view(spec, known, "ready", None, playing=False)
            assert tuple(shown.plots) == experiment.plots
            assert tuple(shown.readings) == experiment.readings
            assert (shown.features, shown.target) == (list(experiment.features), experiment.target)
            told = json.loads(shown.model_dump_json())
            assert told["plots"] == json.loads(json.dumps([dataclasses.asdict(plot) for plot in experiment.plots]))

    def test_changes_in_one_frame_are_one(self) -> None:
        """Several changes before the same frame are one change on the timeline."""
        bench = Workbench(order())
        forward(bench, 5)
        for count in (100, 150, 200):
            bench.change({"sample_count": count}, "b1")
        assert bench.run.timeline == (Change(6, {"sample_count": 200}),)
        assert bench.standing(playing=False, speed=1).values["sample_count"] == 200

    def test_a_refused_change_changes_nothing(self) -> None:
        """A refused change leaves run, timeline and branches as they were."""
        bench = Workbench(order())
        forward(bench, 5)
        bench.run.seek(2)
        before = bench.standing(playing=False, speed=1)
        with pytest.raises(ParameterError):
            bench.change({"sample_count": 100, "gamma_px": -1}, "b1")
        assert bench.standing(playing=False, speed=1) == before

    def test_restart_keeps_the_values(self) -> None:
        """A restart keeps tracker and values in force, and nothing else."""
        bench = Workbench(order(timeline=(Change(0, {"sample_count": 100}), Change(3, {"tracker": "apf"}))))
        forward(bench, 10)
        bench.restart()
        now = bench.standing(playing=False, speed=1)
        assert (now.head, now.tracker, now.beginnings) == (0, "apf", 1)
        assert now.values["sample_count"] == 100

    def test_every_branch_stands_on_its_own(self) -> None:
        """A branch made again from its timeline alone has the same numbers."""
        bench = Workbench(order())
        forward(bench, 20)
        bench.branch("b1", 10, {"tracker": "condensation"})
        forward(bench, 8)
        there = bench.standing(playing=False, speed=1)
        alone = Workbench(order(timeline=there.timeline, tracker=there.first_tracker))
        forward(alone, 18)
        assert alone.run.estimates_sha256 == bench.run.estimates_sha256

    def test_a_branch_is_compared_with_the_one_it_left(self) -> None:
        """The same frame of the branch that was left is drawn beside, as far as that one came, where they differ."""
        bench = Workbench(order())
        forward(bench, 20)
        first = bench.run.diagnostics
        assert bench.other is None
        bench.branch("b1", 10, {"tracker": "condensation"})
        assert bench.other is None
        forward(bench, 8)
        assert bench.other is first[18]
        second = bench.drawing().primitives["second"]
        assert np.allclose(second.segments[..., :2].mean(axis=(0, 1)), first[18].estimate)  # type: ignore[union-attr]
        forward(bench, 5)
        assert bench.other is None
        assert "second" not in bench.drawing().primitives

    def test_a_branch_with_another_seed_is_not_compared(self) -> None:
        """It sees another scene, so that what is estimated there says nothing of this one."""
        bench = Workbench(order())
        forward(bench, 20)
        bench.branch("b1", 10, {"tracker": "condensation"})
        bench.restart(seed=8)
        forward(bench, 5)
        assert bench.other is None
        assert bench.standing(playing=False, speed=1).second is None

    def test_the_first_branch_is_compared_with_the_last_that_was_shown(self) -> None:
        """It left none, so that the one shown before it is what a person compares it with."""
        bench = Workbench(order())
        forward(bench, 20)
        for name, tracker in (("b1", "condensation"), ("b2", "apf")):
            bench.branch(name, 10, {"tracker": tracker})
            forward(bench, 10)
            bench.activate("b0", "h-spf", ())
        bench.run.seek(20)
        assert bench.other is bench._runs["b2"].diagnostics[20]
        bench.activate("b1", "h-spf", ())
        bench.activate("b0", "h-spf", ())
        assert bench.other is bench._runs["b1"].diagnostics[20]
        bench.activate("b2", "h-spf", ())
        assert bench.other is bench._runs["b0"].diagnostics[20]

    def test_unknown_experiment(self) -> None:
        """An experiment that is not there is refused."""
        with pytest.raises(LookupError):
            Workbench(order(experiment="chess"))


class TestPipe:
    def test_there_and_back(self) -> None:
        """Messages arrive whole and in order, however large they are, and a hang-up is noticed on both sides."""

        async def talk() -> None:
            ours, theirs = pair()
            heard: list[Any] = []
            lost = asyncio.Event()
            both = asyncio.Event()

            def hear(event: Any) -> None:
                heard.append(event)
                if len(heard) == 2:
                    both.set()

            web = await WebEnd.connect(ours, hear, lost.set)
            worker = WorkerEnd(theirs)
            web.send(Credit())
            web.send(Request(7, Picture()))
            assert await asyncio.to_thread(worker.receive, 5) == Credit()
            assert await asyncio.to_thread(worker.receive, 5) == Request(7, Picture())
            assert worker.receive(0) is None
            large = b"x" * 5_000_000
            await asyncio.to_thread(worker.send, Reply(1, large))
            await asyncio.to_thread(worker.send, Beat())
            await asyncio.wait_for(both.wait(), 5)
            assert heard == [Reply(1, large), Beat()]
            web.close()
            await asyncio.wait_for(lost.wait(), 5)
            with pytest.raises((EOFError, ConnectionResetError)):
                worker.receive(5)
            theirs.close()

        run(talk())

    def test_half_a_message(self) -> None:
        """A worker that stops in the middle of a message stops nobody else."""

        async def talk() -> None:
            ours, theirs = pair()
            heard: list[Any] = []
            web = await WebEnd.connect(ours, heard.append, lambda: None)
            theirs.sendall(b"\0\0\0\0\0\0\0\x10half")
            await asyncio.sleep(0.05)
            assert heard == []
            web.close()
            await asyncio.sleep(0)
            theirs.close()

        run(talk())

    def test_an_absurd_length(self) -> None:
        """A length that cannot be closes the pipe rather than fill the memory."""

        async def talk() -> None:
            ours, theirs = pair()
            lost = asyncio.Event()
            await WebEnd.connect(ours, lambda _: None, lost.set)
            theirs.sendall(b"\xff" * 8)
            await asyncio.wait_for(lost.wait(), 5)
            theirs.close()

        run(talk())

    def test_ends_are_sockets(self) -> None:
        """The two ends are what a forkserver can hand to a child."""
        ends = pair()
        assert all(isinstance(end, socket.socket) for end in ends)
        for end in ends:
            end.close()
