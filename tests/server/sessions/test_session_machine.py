"""A session under any order of requests does what a small model says, with the library's numbers."""

import os
import signal
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import httpx
import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, initialize, invariant, rule, run_state_machine_as_test

from pftrack.core.model.parameters import flat
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.runs.run import Run
from pftrack.runs.scoring import estimates_hash
from tests.server.asking import columns, get, resume, timeline_of
from tests.server.host import Server, begin, change_values, command, error_of, granted, own_server, post, steer
from tests.waiting import wait_for

EXPERIMENT, FRAMES = "ball", 24
FIXED = "initial_sd_px"
"""A parameter that cannot change in the middle of a run."""

MOST_BRANCHES = 6
LAST = FRAMES - 1

frames = st.integers(0, LAST) | st.just(LAST)
seeds = st.integers(0, 3) | st.just(2**53 - 1)
trackers = st.sampled_from(["h-spf", "condensation", "apf", "pc-pf", "kalman"])
live = st.fixed_dictionaries(
    {},
    optional={
        "sample_count": st.integers(20, 60),
        "process_noise_px": st.sampled_from([1.0, 3.0, 8.0]),
        "occlusion_width_px": st.sampled_from([0, 40, 90]),
        "frame_rate_hz": st.sampled_from([15.0, 30.0]),
        "tracker": trackers,
    },
)
some = live.filter(bool)


@dataclass(frozen=True)
class BranchModel:
    """A branch: what makes its run, and how far it is.

    Attributes:
        seed: The seed of its run.
        tracker: At frame 0.
        changes: By the frame from which they count; those of frame 0 are the values at the beginning.
        position: The frame that is shown.
        computed: The furthest frame computed.
    """

    seed: int
    tracker: str
    changes: dict[int, dict[str, Any]] = field(default_factory=dict)
    position: int = 0
    computed: int = 0

    def at(self, frame: int) -> tuple[dict[str, Any], str]:
        """Return the parameters and the tracker in force in a frame."""
        values = flat(find(EXPERIMENT).simulate().parameters)
        tracker = self.tracker
        for change in (self.changes[each] for each in sorted(self.changes) if each <= frame):
            given = dict(change)
            tracker = given.pop("tracker", tracker)
            values |= given
        return values, tracker

    @property
    def timeline(self) -> list[dict[str, Any]]:
        """Its changes as a client writes them."""
        return [{"frame": frame, "values": values} for frame, values in sorted(self.changes.items()) if values]

    @property
    def branch_point(self) -> int | None:
        """Frame at which a change leaves it; None where a change counts from its next frame on."""
        if self.position == FRAMES - 1:
            return 0
        return self.position if self.position < self.computed else None

    def change(self, frame: int, values: dict[str, Any]) -> "BranchModel":
        """Return it with values that change from a frame on."""
        return replace(self, changes={**self.changes, frame: {**self.changes.get(frame, {}), **values}})

    def go(self, frame: int) -> "BranchModel":
        """Return it at a frame, computed at least as far."""
        return replace(self, position=frame, computed=max(self.computed, frame))

    def leave(self, frame: int, values: dict[str, Any]) -> "BranchModel":
        """Return the branch that leaves it at a frame with these values."""
        shared = {each: change for each, change in self.changes.items() if each <= frame}
        twin = replace(self, changes=shared, position=frame, computed=frame)
        return twin.change(frame + 1, values) if values else twin

    def restart(self, seed: int, values: dict[str, Any]) -> "BranchModel":
        """Return it with an empty past, begun with what was in force and these values."""
        inforce, tracker = self.at(self.position + 1)
        given = {**inforce, **values}
        tracker = given.pop("tracker", tracker)
        defaults = flat(find(EXPERIMENT).simulate().parameters)
        return BranchModel(seed, tracker, {0: {name: given[name] for name in given if given[name] != defaults[name]}})

    @property
    def estimates_sha256(self) -> str:
        """The hash of its estimates, by the library."""
        changes = tuple((frame, tuple(values.items())) for frame, values in sorted(self.changes.items()))
        return hash_of(self.seed, self.tracker, changes, self.computed)


@dataclass
class SessionModel:
    """A session.

    Attributes:
        id: Its name on the server.
        branches: Its branches by name.
        active: The shown branch.
    """

    id: str
    branches: dict[str, BranchModel]
    active: str

    @property
    def branch(self) -> BranchModel:
        """The branch that is shown."""
        return self.branches[self.active]

    @branch.setter
    def branch(self, branch: BranchModel) -> None:
        self.branches[self.active] = branch


@cache
def hash_of(seed: int, tracker: str, changes: tuple[tuple[int, tuple[tuple[str, Any], ...]], ...], last: int) -> str:
    """Compute a run up to a frame by the library, and return the hash of its estimates."""
    experiment = find(EXPERIMENT)
    timeline = [Change(frame, dict(values)) for frame, values in changes]
    run = Run(experiment, experiment.simulate(), tracker=tracker, seed=seed, frames=FRAMES, timeline=timeline)
    run.seek(last)
    return run.estimates_sha256


class SessionMachine(RuleBasedStateMachine):
    """One session of a real server, and what a client may do to it or a kernel to its worker."""

    saved = Bundle("saved")

    def __init__(self, server: Server) -> None:
        super().__init__()
        self.server = server
        self.client = httpx.Client(base_url=server.url, timeout=60, verify=False)  # noqa: S501 - a local server

    def teardown(self) -> None:
        for session in self.client.get("/api/v1/sessions").json():
            self.client.delete(f"/api/v1/sessions/{session['id']}")
        self.client.close()

    # ------------------------------------------------------------ what is done

    @initialize(
        seed=seeds, tracker=trackers, values=live, later=st.dictionaries(st.integers(1, LAST), some, max_size=2)
    )
    def start(self, seed: int, tracker: str, values: dict[str, Any], later: dict[int, dict[str, Any]]) -> None:
        """Start it, with a timeline of changes to come."""
        first = {name: value for name, value in values.items() if name != "tracker"} | {"sample_count": 40}
        timeline = [{"frame": frame, "values": change} for frame, change in sorted(later.items())]
        wish = {"tracker": tracker, "seed": seed, "frames": FRAMES, "parameters": first, "timeline": timeline}
        told = begin(self.client, **wish)
        self.model = SessionModel(
            told["id"], {told["branch"]: BranchModel(seed, tracker, {0: first, **later})}, told["branch"]
        )

    @rule(frame=frames)
    def seek(self, frame: int) -> None:
        """Seek; what is missing on the way is computed."""
        steer(self.client, self.model.id, "seek", frame=frame)
        self.model.branch = self.model.branch.go(frame)

    @rule(forward=st.booleans())
    def step(self, forward: bool) -> None:
        """Step by a frame; both ends hold."""
        steer(self.client, self.model.id, "step" if forward else "back")
        following = self.model.branch.position + (1 if forward else -1)
        self.model.branch = self.model.branch.go(min(max(following, 0), LAST))

    @rule()
    def play(self) -> None:
        """Play to the end; from there it begins at frame 0 again."""
        self.begin_playing(0)
        wait_for(lambda: get(self.client, self.model.id)["state"] == "ended", what="it has played to the end")
        self.model.branch = self.model.branch.go(LAST)

    @rule(speed=st.sampled_from([1.0, 10.0]))
    def play_and_pause(self, speed: float) -> None:
        """Play and pause; it stands somewhere on the way, which the server alone knows."""
        self.begin_playing(speed)
        self.take_position(steer(self.client, self.model.id, "pause"))

    @rule(values=some)
    def change(self, values: dict[str, Any]) -> None:
        """Change parameters from the next frame on; in the past this makes a branch, at the end one from the start."""
        before = self.model.branch
        answer = change_values(self.client, self.model.id, values)
        if before.branch_point is None:
            self.model.branch = before.change(before.position + 1, values)
        elif len(self.model.branches) == MOST_BRANCHES:
            error_of(answer, 409)
            return
        else:
            self.add(answer.json()["branch"], before.leave(before.branch_point, values))
        self.check_changed(answer, self.model.branch.position + 1)

    @rule(values=some)
    def change_while_it_plays(self, values: dict[str, Any]) -> None:
        """A change while it plays counts from the frame that the answer names, or makes a branch at the end."""
        if self.model.branch.computed == LAST or len(self.model.branches) == MOST_BRANCHES:
            return
        self.seek(self.model.branch.computed)
        before = self.model.branch
        self.begin_playing(1.0)
        changed = change_values(self.client, self.model.id, values).json()
        paused = steer(self.client, self.model.id, "pause")
        if changed["branch"] == self.model.active:
            assert before.position < changed["frame"] <= LAST
            self.model.branch = before.change(changed["frame"], values)
        else:
            assert changed["frame"] == 1
            self.model.branch = before.go(LAST)
            self.add(changed["branch"], before.leave(0, values))
        self.take_position(paused)

    @rule(value=st.sampled_from([0.0, 1.0, 4.0]), tracker=st.none() | trackers)
    def change_what_is_fixed(self, value: float, tracker: str | None) -> None:
        """A parameter that cannot change in the middle of a run restarts it."""
        before = self.model.branch
        values = {FIXED: value, **({"tracker": tracker} if tracker else {})}
        answer = change_values(self.client, self.model.id, values)
        if before.branch_point is not None and len(self.model.branches) == MOST_BRANCHES:
            error_of(answer, 409)
            return
        self.model.branch = before.restart(before.seed, values)
        self.check_changed(answer, 0)

    @rule(frame=frames, values=live)
    def leave(self, frame: int, values: dict[str, Any]) -> None:
        """Leave the active branch at a frame that is computed."""
        answer = command(self.client, self.model.id, "branch", frame=frame, values=values, title="another")
        before = self.model.branch
        if len(self.model.branches) == MOST_BRANCHES:
            error_of(answer, 409)
        elif frame > before.computed or (frame == LAST and values):
            error_of(answer, 422)
        else:
            self.add(granted(answer)["branch"], before.leave(frame, values))

    @rule(number=st.integers(0, MOST_BRANCHES - 1))
    def activate(self, number: int) -> None:
        """Show a branch, where it was."""
        # Not drawn from the present ones: their number depends on the clock, and Hypothesis repeats what it draws.
        names = sorted(self.model.branches)
        self.model.active = names[number % len(names)]
        steer(self.client, self.model.id, "activate", branch=self.model.active)

    @rule(seed=st.none() | seeds)
    def restart(self, seed: int | None) -> None:
        """Restart with what is in force; another seed is for a session of one branch."""
        before = self.model.branch
        answer = command(self.client, self.model.id, "restart", seed=seed)
        if seed not in {None, before.seed} and len(self.model.branches) > 1:
            error_of(answer, 409)
            return
        granted(answer)
        self.model.branch = before.restart(before.seed if seed is None else seed, {})

    @rule(target=saved)
    def save(self) -> Any:
        """Save the active branch; the summary's hash is the library's."""
        run, branch = post(self.client, "runs", session=self.model.id), self.model.branch
        assert run["summary"]["estimates_sha256"] == branch.estimates_sha256
        return run["id"], branch

    @rule(run=saved)
    def reopen(self, run: tuple[str, BranchModel]) -> None:
        """Continue with a saved run in the place of this session."""
        name, branch = run
        told = post(self.client, f"runs/{name}/open")
        assert told["remark"] is None
        self.client.delete(f"/api/v1/sessions/{self.model.id}")
        self.model = SessionModel(told["id"], {told["branch"]: branch}, told["branch"])
        self.model.branch = replace(branch, position=self.arrived()["position"])

    @rule(plays=st.booleans(), how=st.sampled_from([signal.SIGKILL, signal.SIGSEGV]))
    def kill(self, plays: bool, how: signal.Signals) -> None:
        """Kill the worker, also while it plays: the session says so, takes no command, and resumes where it was."""
        if plays:
            self.begin_playing(1.0)
        os.kill(self.server.pid_of(self.model.id), how)
        wait_for(lambda: get(self.client, self.model.id)["state"] == "crashed", what="the session knows")
        error_of(command(self.client, self.model.id, "step"), 409)
        resume(self.client, self.model.id)
        resumed = self.arrived()
        if plays:
            self.take_position(resumed)

    # ------------------------------------------------------------ what always holds

    @invariant()
    def is_what_the_model_says(self) -> None:
        """Branches, position, values in force and estimates are those of the model."""
        told, branch = get(self.client, self.model.id), self.model.branch
        assert (told["state"], told["playing"]) == ("ended" if branch.position == LAST else "ready", False)
        assert told["branch"] == self.model.active
        assert {each["id"] for each in told["branches"]} == self.model.branches.keys()
        assert (told["position"], told["computed"], told["frames"]) == (branch.position, branch.computed, FRAMES)
        assert told["branch_point"] == branch.branch_point
        assert changes_of(timeline_of(told)) == changes_of(branch.timeline)
        assert (told["parameters"], told["tracker"]) == branch.at(branch.position + 1)
        estimates = np.array(columns(self.client, self.model.id)["estimate"])
        assert len(estimates) == branch.computed + 1
        assert estimates_hash(estimates) == branch.estimates_sha256

    # ------------------------------------------------------------ how

    def begin_playing(self, speed: float) -> None:
        steer(self.client, self.model.id, "speed", speed=speed)
        steer(self.client, self.model.id, "play")

    def arrived(self) -> dict[str, Any]:
        """Wait until a session with a new worker is where it was."""
        return wait_for(lambda: (told := get(self.client, self.model.id))["goal"] is None and told)

    def add(self, name: str, branch: BranchModel) -> None:
        assert name not in self.model.branches
        self.model.branches[name] = branch
        self.model.active = name

    def take_position(self, told: dict[str, Any]) -> None:
        """Take over where it stands after it has played."""
        before = self.model.branch
        begun = 0 if before.position == LAST else before.position
        assert begun <= told["position"] <= LAST
        assert told["computed"] == max(before.computed, told["position"])
        self.model.branch = before.go(told["position"])

    def check_changed(self, answer: httpx.Response, frame: int) -> None:
        """The answer to a change says what is in force, and from which frame on."""
        changed, branch = granted(answer), self.model.branch
        assert (changed["branch"], changed["frame"]) == (self.model.active, frame)
        assert (changed["parameters"], changed["tracker"]) == branch.at(branch.position + 1)


def changes_of(timeline: list[dict[str, Any]]) -> list[tuple[int, dict[str, Any]]]:
    """Return changes without what a run begins with anyway: a default may be told at frame 0, or left out."""
    defaults = flat(find(EXPERIMENT).simulate().parameters)
    told = [(one["frame"], one["values"]) for one in timeline]
    first = {name: value for frame, values in told if frame == 0 for name, value in values.items()}
    begun = {name: value for name, value in first.items() if value != defaults.get(name)}
    return [(0, begun), *((frame, values) for frame, values in told if frame > 0)]


own = own_server(max_branches=MOST_BRANCHES)


QUICK = settings(
    max_examples=5,
    stateful_step_count=14,
    derandomize=True,
    database=None,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)


def test_a_few_orders(own: Server) -> None:
    """The same few in every run of the tests, which have each of the rules."""
    assert {"h-spf", "condensation", "apf", "pc-pf", "kalman"} <= find(EXPERIMENT).trackers.keys()
    run_state_machine_as_test(lambda: SessionMachine(own), settings=QUICK)


@pytest.mark.slow
def test_many_orders(own: Server) -> None:
    """Others each time; what fails is printed as a program that repeats it."""
    many = settings(QUICK, max_examples=200, stateful_step_count=40, derandomize=False, print_blob=True)
    run_state_machine_as_test(lambda: SessionMachine(own), settings=many)
