"""The state of a session: what the worker has reported of its run, and what of that is news for the pages.

It alone changes the spec's branches and positions, and it alone decides what of that is news.
"""

from collections.abc import Callable, Sequence
from typing import Any

from pftrack.runs.loss import before_loss
from pftrack_server.errors import ConflictError
from pftrack_server.schemas import messages
from pftrack_server.schemas.description import SessionDescription
from pftrack_server.schemas.messages import Phase
from pftrack_server.schemas.sessions import Columns
from pftrack_server.schemas.spec import Bookmark, BranchSpec, Goal, SessionSpec
from pftrack_server.sessions.history import History
from pftrack_server.sessions.timeline_view import threshold_views, timeline_view
from pftrack_server.sessions.view import branch_views, last_of, view
from pftrack_server.stream.listeners import SessionListeners
from pftrack_server.worker.protocol import Ready, RunStatus

__all__ = ["SessionState"]


class SessionState:
    """Spec, state and diagnostics of one session.

    Attributes:
        spec: Everything that is kept of the session.
        phase: What it is doing.
        message: Why it is in this state, where there is something to say.
        playing: Whether the run goes on by itself.
        dirty: Whether something that people made has changed since the spec was last stored.
        moved: Whether the position has.
        frames_computed: Frames that its workers have computed.
        listeners: Who hears the news.
    """

    def __init__(self, spec: SessionSpec, state: Phase, on_values: Callable[[], None]) -> None:
        """Begin with a spec; `on_values` is called when the values in force have changed."""
        self.spec = spec
        self.phase: Phase = state
        self.message: str | None = None
        self.playing = False
        self.dirty = True
        self.moved = False
        self.frames_computed = 0
        self.listeners = SessionListeners(self.hello)
        self._on_values = on_values
        self._histories: dict[str, History] = {}
        self._columns_text: tuple[History | None, int, str] = None, 0, ""
        self._last: RunStatus | None = None

    # ------------------------------------------------------------ what is known

    @property
    def description(self) -> SessionDescription:
        """What is fixed of it.

        Raises:
            ConflictError: No worker has told that yet.
        """
        if self.spec.description is None:
            raise ConflictError("The session has not started yet.")
        return self.spec.description

    def view(self) -> messages.SessionPublic:
        """Return the session as everybody outside sees it."""
        measured = dict(self._last.measures) if self._last else {}
        return view(self.spec, self.description, self.phase, self.message, measured, playing=self.playing)

    def hello(self) -> messages.Hello:
        """Return the complete state."""
        return messages.Hello(session=self.view(), diagnostics=self.columns(self.spec.branch))

    def columns(self, branch: str) -> dict[str, list[Any]]:
        """Return the diagnostics of a branch."""
        history = self._histories.get(branch)
        return dict(history.columns) if history else {}

    def columns_text(self, branch: str) -> str:
        """Return the diagnostics of a branch as JSON, encoded once for all who ask for them at one time."""
        history = self._history(branch)
        known, changes, text = self._columns_text
        if known is not history or changes != history.changes:
            text = Columns(branch=branch, columns=dict(history.columns)).model_dump_json()
            self._columns_text = history, history.changes, text
        return text

    def before_loss(self) -> int | None:
        """Return the frame from which to watch how the target was lost; None if it has not been lost."""
        known = self.columns(self.spec.branch)
        nothing: list[bool] = []
        lost = [since is not None for since in known.get("lost_since", nothing)]
        hidden = [bool(value) for value in known.get("hidden", nothing)]
        return before_loss(lost, hidden, self.spec.active.position)

    # ------------------------------------------------------------ reports of the worker

    def begin(self, ready: Ready) -> None:
        """Take over what a new worker has made of the spec, and greet all listeners again."""
        self.spec.description = self._as_begun(ready.description)
        self._last = None
        self._histories[self.spec.branch] = History()
        self._histories[self.spec.branch].put(ready.rows)
        self.stand(ready.status)
        self.listeners.greet()

    def _as_begun(self, description: SessionDescription) -> SessionDescription:
        """Return a new worker's description with the preset's part as the first worker had it.

        What was changed since may be another preset's or nobody's, but the controls stay where a person has them.
        """
        first = self.spec.description or description
        return description.model_copy(update={"about": first.about, "watch": first.watch})

    def add(self, branch: str, rows: list[dict[str, Any]]) -> None:
        """Take down the diagnostics of frames just computed."""
        if not rows:
            return
        self.frames_computed += len(rows)
        rows = self._history(branch).put(rows)
        if len(rows) == 1:
            self.listeners.emit(messages.Frame(branch=branch, diagnostics=rows[0]))
        else:
            self.listeners.emit(messages.Frames(branch=branch, rows=rows))

    def stand(self, now: RunStatus, rows: Sequence[dict[str, Any]] = ()) -> None:
        """Take down where the run stands and the diagnostics of frames just computed, and tell what has changed.

        The diagnostics of a frame are sent before the position, so that no page stands on a frame it knows nothing of.
        While it plays they say by themselves where it is.
        """
        last, self._last = self._last, now
        branch = self.spec.branches.get(now.branch) or self._new_branch(now)
        switched = self.spec.branch != now.branch
        changed = {name: value for name, value in now.values.items() if self.spec.values.get(name) != value}
        if branch.tracker != now.tracker and not switched:
            changed["tracker"] = now.tracker
        self.spec.branch, self.spec.second, self.spec.values = now.branch, now.second, now.values
        branch.position, branch.computed = now.position, now.computed
        bound, branch.goal = branch.goal != now.goal, now.goal
        branch.tracker, branch.first_values = now.tracker, now.first_values
        self.playing, self.spec.speed = now.playing, now.speed
        reseeded, branch.recipe = branch.recipe.seed != now.recipe.seed, now.recipe
        retimed = last is None or now.recipe.timeline != last.recipe.timeline
        self.moved = True
        # While it plays only its position changes, which is worth a look now and then.
        moving = now.playing or now.goal is not None
        self.dirty = self.dirty or not moving or bound or changed != {} or switched or reseeded
        if last is not None and now.restarts != last.restarts:
            self._forget(now.branch)
        self.become("playing" if now.playing else "ended" if now.ended else "ready")
        if switched:
            self.tell_branches()
        if changed or switched or retimed:
            self._tell_values(branch, changed)
        if last is None or reseeded or last.speed != now.speed:
            self._on_values()
        self.add(now.branch, list(rows))
        if last is None or switched or not (_where(last) == _where(now) or _plays_on(last, now, rows)):
            self._tell_position(now)
        if last is not None and last.measures != now.measures:
            self.listeners.emit(messages.Measures(branch=now.branch, values=now.measures))

    def become(self, state: Phase, message: str | None = None) -> None:
        """Be in another state, and say so unless the transport says it already."""
        if state == self.phase and message == self.message:
            return
        between = {self.phase, state} <= {"ready", "playing"}
        self.phase, self.message = state, message
        if not between:
            self.listeners.emit(messages.SessionNews(state=state, message=message))

    def _history(self, branch: str) -> History:
        return self._histories.setdefault(branch, History())

    def _new_branch(self, now: RunStatus) -> BranchSpec:
        """Take note of a branch that the worker made."""
        parent = self.spec.branch
        made = BranchSpec(
            id=now.branch,
            title=f"{self.description.tracker_title(now.tracker)} from frame {now.position}",
            parent=parent,
            frame=now.position,
            recipe=now.recipe,
            tracker=now.tracker,
        )
        self.spec.branches_made += 1
        self.spec.branches[made.id] = made
        self._histories[made.id] = self._history(parent).upto(now.position)
        return made

    def _forget(self, branch: str) -> None:
        """Forget the past of a branch that was restarted."""
        self._histories[branch] = History()
        self.spec.bookmarks = [item for item in self.spec.bookmarks if item.branch != branch]
        self.listeners.greet()

    # ------------------------------------------------------------ what people do to it

    def name_branch(self, branch: str, title: str) -> None:
        """Give a branch another title."""
        self.spec.branches[branch].title = title
        self.tell_branches()

    def bookmark(self, name: str, note: str) -> Bookmark:
        """Remember the frame that is shown."""
        made = Bookmark(id=name, frame=self.spec.active.position, note=note, branch=self.spec.branch)
        self.spec.bookmarks = sorted([*self.spec.bookmarks, made], key=lambda item: item.frame)
        self._tell_bookmarks()
        return made

    def unbookmark(self, name: str) -> bool:
        """Forget a bookmark; return whether there was one."""
        kept = [item for item in self.spec.bookmarks if item.id != name]
        found = len(kept) < len(self.spec.bookmarks)
        self.spec.bookmarks = kept
        self._tell_bookmarks()
        return found

    # ------------------------------------------------------------ telling

    def tell_branches(self) -> None:
        """Tell which branches there are."""
        self.dirty = True
        self.listeners.emit(messages.Branches(branch=self.spec.branch, branches=branch_views(self.spec)))

    def _tell_values(self, branch: BranchSpec, changed: dict[str, Any]) -> None:
        self._on_values()
        declarations = self.description.declarations
        self.listeners.emit(
            messages.Parameters(
                branch=branch.id,
                frame=branch.position + 1,
                parameters=self.spec.values,
                recipe=branch.recipe,
                tracker=branch.tracker,
                values=changed,
                timeline=timeline_view(branch, declarations),
                thresholds=threshold_views(branch, declarations),
            )
        )

    def _tell_position(self, now: RunStatus) -> None:
        self.listeners.emit(
            messages.Position(
                branch=now.branch,
                frame=now.position,
                computed=now.computed,
                goal=last_of(now.goal),
                playing=now.playing,
                speed=now.speed,
            )
        )

    def _tell_bookmarks(self) -> None:
        self.dirty = True
        self.listeners.emit(messages.Bookmarks(bookmarks=self.spec.bookmarks))


def _plays_on(last: RunStatus, now: RunStatus, rows: Sequence[dict[str, Any]]) -> bool:
    """Whether nothing has changed but that the run has played on, which the rows tell by themselves."""
    at_the_end = bool(rows) and rows[-1]["frame"] == now.position == now.computed
    return at_the_end and last.playing and now.playing and _where(last)[2:] == _where(now)[2:]


def _where(status: RunStatus) -> tuple[int, int, Goal | None, bool, float]:
    return status.position, status.computed, status.goal, status.playing, status.speed
