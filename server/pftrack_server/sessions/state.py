"""The state of a session: its spec, its snapshot, and the changes that are sent to the pages.

Only this class changes the spec's branches. After every change the snapshot is made again from the spec and the phase,
and the pages receive the fields that differ from the snapshot that they have.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from pftrack.core.model.drawing import BRANCHES, hexadecimal
from pftrack.core.model.measures import judge_loss
from pftrack.core.refusal import ConflictError
from pftrack.runs.loss import loss_start
from pftrack_server.sessions import spec as snapshots
from pftrack_server.sessions.stream import Changes, Hello, SessionPublic, SessionStream
from pftrack_server.sessions.worker.protocol import Ready


class Columns(BaseModel):
    """The diagnostics of a branch, one list per column."""

    branch: str
    columns: dict[str, list[Any]]


OF_PANEL = frozenset({"branch_point", "parameters", "recipe", "speed", "tracker"})
"""Fields shown by the scene's panel."""
MOST_BOOKMARKS = 500
LONGEST_CHANGE = 40
"""Most letters of a change in a branch's title; a longer value, such as a file's text, is not shown."""


class History:
    """The diagnostics of one branch, one list per column, in the order of the frames.

    Attributes:
        changes: Number of changes so far.
    """

    def __init__(self) -> None:
        self.columns: dict[str, list[Any]] = {}
        self.changes = 0

    def __len__(self) -> int:
        return len(self.columns.get("frame", ()))

    def put(self, rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
        """Add rows; a row of a known frame replaces the old one.

        Returns:
            The rows with two more columns: `lost_by`, the source of the verdict on loss, and `lost_since`, the frame
            where the present loss began.
        """
        self.changes += 1
        return [self._put(row) for row in rows]

    def _put(self, row: dict[str, Any]) -> dict[str, Any]:
        index, since = row["frame"], self.columns.get("lost_since", [])
        before = since[index - 1] if 0 < index <= len(since) else None
        said = judge_loss(row.get("lost"), row.get("searching"))
        row = {**row, "lost_by": said.witness, "lost_since": loss_start(index, before, lost=said.lost)}
        if not self.columns:
            self.columns = {name: [] for name in row}
        if index <= len(self):
            for name, column in self.columns.items():
                column[index : index + 1] = [row[name]]
        return row

    def upto(self, frame: int) -> "History":
        """Return a copy up to and including a frame: the part that a branch shares with its parent."""
        copy = History()
        copy.columns = {name: column[: frame + 1] for name, column in self.columns.items()}
        return copy


class SessionState:
    """Spec, snapshot and diagnostics of one session.

    Attributes:
        spec: The stored part of the session.
        phase: Its phase.
        message: Why it is in this phase, if there is a reason.
        snapshot: The snapshot that the pages have.
        dirty: Whether anything made by a person has changed since the spec was last stored.
        moved: Whether the position has changed since then.
        frames_computed: Number of frames that its workers have computed.
        stream: The stream to its pages.

    Args:
        spec: The session's spec so far.
        credit: Lets the worker send one drawing for the stream.
        on_values: Called when the current values have changed.
    """

    def __init__(self, spec: snapshots.SessionSpec, credit: Callable[[], None], on_values: Callable[[], None]) -> None:
        """Begin suspended."""
        self.spec = spec
        self.phase = snapshots.Phase.SUSPENDED
        self.message: str | None = None
        self.snapshot = self._snapshot_now()
        self.dirty = True
        self.moved = False
        self.frames_computed = 0
        self.stream = SessionStream(self.hello, credit)
        self._on_values = on_values
        self._histories: dict[str, History] = {}
        self._columns_text: tuple[History | None, int, str] = None, 0, ""

    def _snapshot_now(self) -> snapshots.SessionSnapshot:
        """Return the present snapshot of the session."""
        spec, known = self.spec, self.spec.description
        return snapshots.SessionSnapshot.model_construct(
            **vars(spec.run) | {"playing": self.phase is snapshots.Phase.PLAYING},
            state=self.phase,
            message=self.message,
            name=spec.name or (known.subject or known.title if known else ""),
            remark=spec.remark,
            branches=branch_views(spec),
            bookmarks=spec.bookmarks,
        )

    # ------------------------------------------------------------ views

    @property
    def description(self) -> snapshots.SessionDescription:
        """The session's unchanging part.

        Raises:
            ConflictError: No worker has reported it yet.
        """
        if self.spec.description is None:
            raise ConflictError("The session has not started yet.")
        return self.spec.description

    def view(self) -> SessionPublic:
        """Return the public view of the session: its description, its snapshot and its addresses."""
        spec = self.spec
        return SessionPublic.model_construct(
            **vars(self.description),
            **vars(self.snapshot),
            id=spec.id,
            sweep=spec.sweep,
            upload=spec.upload,
            created=spec.created,
            page=f"session/{spec.id}",
            thumbnail=f"api/v1/sessions/{spec.id}/thumbnail.png",
            viewer=f"viz/{spec.id}/",
        )

    def hello(self) -> Hello:
        """Return the greeting with the complete state."""
        return Hello(session=self.view(), diagnostics=self.columns(self.spec.branch))

    def columns(self, branch: str) -> dict[str, list[Any]]:
        """Return the diagnostics of a branch."""
        return dict(self._history(branch).columns)

    def columns_text(self, branch: str) -> str:
        """Return the diagnostics of a branch as JSON, encoded once for concurrent requests."""
        history = self._history(branch)
        known, changes, text = self._columns_text
        if known is not history or changes != history.changes:
            text = Columns(branch=branch, columns=self.columns(branch)).model_dump_json()
            self._columns_text = history, history.changes, text
        return text

    # ------------------------------------------------------------ reports of the worker

    def begin(self, ready: Ready) -> None:
        """Apply the run of a new worker, and greet all pages again."""
        if not self._goes_to(ready.run.phase(ready.description.frames)):
            return
        self.spec.description = self._with_first_preset(ready.description)
        self.spec.active.run = ready.run
        self._histories[self.spec.branch] = History()
        self._histories[self.spec.branch].put(ready.rows)
        self.snapshot = self._snapshot_now()
        self.dirty = self.moved = True
        self._on_values()
        self.stream.greet()

    def describe(self, description: snapshots.SessionDescription) -> None:
        """Replace the description, and greet all pages again."""
        kept = self._with_first_preset(description)
        # A saved filter has sliders of its own, which come first.
        about = list(dict.fromkeys((*description.about, *kept.about)))
        self.spec.description = kept.model_copy(update={"about": about})
        self.dirty = True
        self._on_values()
        self.stream.greet()

    def _with_first_preset(self, description: snapshots.SessionDescription) -> snapshots.SessionDescription:
        """Return a new worker's description with the preset's part as the first worker had it.

        Later changes may belong to another preset or none, but the controls keep their order.
        """
        first = self.spec.description or description
        return description.model_copy(update={"about": first.about, "watch": first.watch, "subject": first.subject})

    def advance(self, changes: Mapping[str, Any], rows: Sequence[dict[str, Any]] = ()) -> None:
        """Apply the run's changes and new diagnostics, and send them to the pages."""
        run = self.spec.run.model_copy(update=changes)
        if not (changes or rows) or not self._goes_to(run.phase(self.description.frames)):
            return
        branch = self.spec.branches.get(run.branch) or self._new_branch(run)
        branch.run, self.spec.branch = run, run.branch
        self.moved = True
        # While it plays, the position is stored only at intervals.
        self.dirty = self.dirty or not (run.playing or run.goal is not None) or "recipe" in changes
        if "restarts" in changes:
            self._forget(run.branch)
        self.frames_computed += len(rows)
        self._tell(self._history(run.branch).put(rows))
        if changes.keys() & OF_PANEL:
            self._on_values()

    def enter(self, phase: snapshots.Phase, message: str | None = None) -> None:
        """Enter a phase in which the run does not play, if the table allows it.

        So a worker that ends after its session was closed does not mark it as crashed.
        """
        if self._goes_to(phase, message):
            self._tell()

    def _goes_to(self, phase: snapshots.Phase, message: str | None = None) -> bool:
        """Enter a phase if the table allows it; return whether the session is now in it."""
        leads = phase is self.phase or phase in snapshots.TRANSITIONS[self.phase]
        if leads:
            self.phase, self.message = phase, message
        return leads

    def _history(self, branch: str) -> History:
        return self._histories.setdefault(branch, History())

    def _new_branch(self, run: snapshots.RunSnapshot) -> snapshots.BranchSpec:
        """Add the branch that the worker made."""
        parent = self.spec.branch
        made = snapshots.BranchSpec(
            title=self._branch_title(run, self.spec.branches[parent].run), parent=parent, frame=run.position, run=run
        )
        self.spec.branches_made += 1
        self.spec.branches[run.branch] = made
        self._histories[run.branch] = self._history(parent).upto(run.position)
        return made

    def _branch_title(self, run: snapshots.RunSnapshot, before: snapshots.RunSnapshot) -> str:
        """Return a branch's title: its new tracker or the parameter that differs, and where it begins."""
        what = self.description.tracker_title(run.tracker)
        if run.tracker == before.tracker:
            told = (
                f"{each.title} {run.parameters[each.name]} {each.unit}".strip()
                for each in self.description.declarations
                if run.parameters.get(each.name) not in {None, before.parameters.get(each.name)}
            )
            what = next((words for words in told if len(words) <= LONGEST_CHANGE), what)
        title = f"{what} from frame {run.position}"
        taken = {branch.title for branch in self.spec.branches.values()}
        numbered = (f"{title} ({number})" for number in range(2, len(taken) + 3))
        return title if title not in taken else next(each for each in numbered if each not in taken)

    def _forget(self, branch: str) -> None:
        """Forget the past of a restarted branch."""
        self._histories[branch] = History()
        self.keep(bookmarks=[item for item in self.spec.bookmarks if item.branch != branch])
        self.stream.greet()

    # ------------------------------------------------------------ changes by people

    def keep(self, **changes: Any) -> None:  # noqa: ANN401 - the fields of a `SessionSpec`
        """Replace fields of the spec: name, truth, remark or bookmarks."""
        for name, value in changes.items():
            setattr(self.spec, name, value)
        self.dirty = True
        self._tell()

    def bookmark(self, name: str, note: str) -> snapshots.Bookmark:
        """Bookmark the shown frame.

        Raises:
            ConflictError: The session has too many bookmarks.
        """
        if len(self.spec.bookmarks) >= MOST_BOOKMARKS:
            raise ConflictError(f"A session holds at most {MOST_BOOKMARKS} bookmarks; delete one first.")
        made = snapshots.Bookmark(id=name, frame=self.spec.run.position, note=note, branch=self.spec.branch)
        self.keep(bookmarks=sorted([*self.spec.bookmarks, made], key=lambda item: item.frame))
        return made

    def unbookmark(self, name: str) -> bool:
        """Delete a bookmark; return whether it existed."""
        kept = [item for item in self.spec.bookmarks if item.id != name]
        found = len(kept) < len(self.spec.bookmarks)
        self.keep(bookmarks=kept)
        return found

    def _tell(self, rows: Sequence[dict[str, Any]] = ()) -> None:
        """Send the pages new rows and changed fields."""
        before, self.snapshot = self.snapshot, self._snapshot_now()
        news = snapshots.differences(before, self.snapshot)
        if news or rows:
            self.stream.emit(Changes(session=news, rows=list(rows)))


def branch_views(spec: snapshots.SessionSpec) -> list[snapshots.BranchPublic]:
    """Return the branches for the page's list, in the colours of the scene: active one, second run, the others."""
    order = sorted(spec.branches, key=lambda name: (name != spec.branch, name != spec.run.second))
    colours = {name: hexadecimal(BRANCHES[place % len(BRANCHES)]) for place, name in enumerate(order)}
    return [
        snapshots.BranchPublic.model_construct(
            id=name,
            title=branch.title,
            parent=branch.parent,
            frame=branch.frame,
            tracker=branch.run.tracker,
            colour=colours[name],
        )
        for name, branch in spec.branches.items()
    ]
