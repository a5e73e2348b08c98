"""A run that is played for a viewer, in a thread of its own: what a session's worker does, for one run in this process.

It has a branch of the run that it was given, so that whoever has that one can go on with it. What is asked for comes
from viser's loop, where nobody may wait: the newest wish of each kind stays until the player comes to it. On a long way
to a frame it looks after each step whether there is a newer wish.
"""

import threading
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from pftrack.core.model.drawing import drawn_keys
from pftrack.core.model.faults import without_faults
from pftrack.core.model.parameters import ParameterError, Value, declarations, flat
from pftrack.core.model.recipe import Change
from pftrack.runs.manifest import title_of
from pftrack.runs.run import EndOfRun, PastError, Run
from pftrack_server.core.panel import PanelDescription, PanelValues
from pftrack_server.core.pictures import PictureEncoder
from pftrack_server.viewer.viewer import Viewer


class Player:
    """Shows a run in a viewer, and does what is asked for beside it.

    Args:
        run: It is not moved. Where it stands is where the player begins.

    Attributes:
        run: What is shown: a branch of the run that was given, or of that.
        viewer: Where it is shown.
    """

    def __init__(self, run: Run) -> None:
        self.run = run.branch(run.computed)
        self.run.seek(run.position)
        self._speed, self._is_playing, self._due = 1.0, False, 0.0
        self._wishes: dict[str, Any] = {}
        self._news, self._is_closed = threading.Condition(), False
        self._encoder = PictureEncoder()
        self.viewer = Viewer(_describe(run), self._in_force, on_command=self._request_command)
        self._thread = threading.Thread(target=self._work, name="pftrack-player", daemon=True)
        self._thread.start()

    def go(self, frame: int) -> None:
        """Pause, and show a frame as soon as it can be had."""
        self._request("seek", frame)

    def follow(self, run: Run) -> None:
        """Take a longer run of the same in the place of the present one, unless an earlier frame is being looked at."""
        self._request("follow", run)

    def close(self) -> None:
        """End player and viewer; a second call does nothing."""
        with self._news:
            self._is_closed = True
            self._news.notify()
        self._thread.join()
        self.viewer.close()

    @property
    def _in_force(self) -> PanelValues:
        run = self.run
        following = min(run.position + 1, run.frames - 1)
        return PanelValues(flat(run.parameters_at(following)), run.tracker_at(following), run.seed, self._speed)

    def _request_command(self, command: dict[str, Any]) -> None:
        """Take down a command of the panel; new values go together with those that wait."""
        kind = command["kind"]
        value = command.get({"change": "values", "restart": "seed", "seek": "frame"}.get(kind, kind), True)
        with self._news:
            self._wishes[kind] = {**self._wishes.get(kind, {}), **value} if kind == "change" else value
            self._news.notify()

    def _request(self, what: str, value: object) -> None:
        with self._news:
            self._wishes[what] = value
            self._news.notify()

    def _work(self) -> None:
        self._show()
        while not self._is_closed:
            wishes = self._wait_for()
            try:
                for what, value in wishes.items():
                    self._do(what, value)
                if not wishes and self._is_playing:
                    self._play()
            except (ParameterError, PastError, EndOfRun) as error:
                self.viewer.refuse(str(error))
            except Exception as error:  # noqa: BLE001 - an experiment's own, which must not end the picture
                self._is_playing = False
                self.viewer.refuse(f"{type(error).__name__}: {error}")
            if wishes:
                self.viewer.tell(self._in_force)
            self._show()

    def _wait_for(self) -> dict[str, Any]:
        """Wait until there is something to do, and return what is wished for."""
        with self._news:
            while not (self._wishes or self._is_closed):
                rest = self._due - time.monotonic() if self._is_playing else None
                if rest is not None and rest <= 0.0:
                    break
                self._news.wait(rest)
            wishes, self._wishes = self._wishes, {}
            return wishes

    def _do(self, what: str, value: Any) -> None:  # noqa: ANN401 - as the wish has it
        match what:
            case "seek":
                self._is_playing = False
                self._seek(min(max(0, int(value)), self.run.frames - 1))
            case "follow":
                if self.run.position == self.run.frames - 1:
                    self.run = value
            case "toggle":
                self._is_playing = not self._is_playing
                if self._is_playing and self.run.position == self.run.frames - 1:
                    self.run.seek(0)
            case "speed":
                self._speed = value
            case "change":
                self._change(value)
            case "restart":
                self._restart({}, int(value))

    def _seek(self, frame: int) -> None:
        for _ in self.run.seeking(frame):
            with self._news:
                if self._wishes or self._is_closed:
                    return

    def _play(self) -> None:
        rate_hz = self.run.source.frame_rate_hz * self._speed
        now = time.monotonic()
        self._due = max(self._due, now - 1.0) + 1.0 / rate_hz if rate_hz else now
        if self.run.position == self.run.frames - 1:
            self._is_playing = False
        else:
            self.run.seek(self.run.position + 1)

    def _change(self, values: Mapping[str, Value]) -> None:
        run = self.run
        fixed = {item.name for item in declarations(type(run.setup.parameters)) if not item.live}
        if fixed & values.keys():
            self._restart(values, run.seed)
        elif run.position == run.computed or run.is_only_drawn(values):
            run.change(values)
        else:
            self.run = run.branch(run.position, values)

    def _restart(self, values: Mapping[str, Value], seed: int) -> None:
        run = self.run
        known = {"tracker": run.tracker_at(run.position), **flat(run.parameters_at(run.position)), **values}
        tracker = str(known.pop("tracker"))
        changes = (Change(0, known),)
        made = Run(run.experiment, run.setup, tracker=tracker, seed=seed, frames=run.frames, timeline=changes)
        self.run = made

    def _show(self) -> None:
        run = self.run
        drawing = without_faults(run.experiment.draw(run.current, run.diagnostics))
        keyed = replace(drawing, legend=drawn_keys(drawing, run.experiment.layers))
        self.viewer.show(self._encoder.for_scene(keyed), run.position)


def _describe(run: Run) -> PanelDescription:
    experiment = run.experiment
    return PanelDescription(
        title=title_of(run),
        declarations=experiment.declarations(type(run.setup.parameters)),
        trackers={name: tracker.title for name, tracker in experiment.trackers.items()},
        layers=experiment.layers,
        worlds=experiment.worlds,
        about=experiment.subjects(None),
        frames=run.frames,
    )
