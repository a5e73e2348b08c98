"""The store: tables, names and whole files."""

import os
import sqlite3
from contextlib import closing
from functools import partial
from pathlib import Path

import pytest
from sqlalchemy import inspect

from pftrack_server.core.errors import ApiError
from pftrack_server.core.settings import Settings
from pftrack_server.store import Store
from pftrack_server.store.database import VERSION, Base, UploadRow, connect
from pftrack_server.store.files import DataDirectory, is_name, new_name


def test_the_tables_are_made_once(tmp_path: Path) -> None:
    """The first start makes them, also after it was cut short; later ones find them."""
    for _ in range(2):
        engine = connect(f"sqlite:///{tmp_path / 'x.sqlite'}")
        with engine.begin() as connection:
            assert set(inspect(connection).get_table_names()) == set(Base.metadata.tables)
            assert connection.exec_driver_sql("PRAGMA journal_mode").scalar() == "wal"
            assert connection.exec_driver_sql("PRAGMA user_version").scalar() == VERSION
            connection.exec_driver_sql("DROP TABLE polls")
            connection.exec_driver_sql("PRAGMA user_version=0")
        engine.dispose()


def test_a_database_that_is_locked_at_the_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A server that cannot open it says who keeps it, and what to do."""
    url = f"sqlite:///{tmp_path / 'x.sqlite'}"
    connect(url).dispose()
    monkeypatch.setattr("pftrack_server.store.database.BUSY_S", 0)
    with closing(sqlite3.connect(tmp_path / "x.sqlite", isolation_level=None)) as other:
        other.execute("PRAGMA locking_mode=EXCLUSIVE")
        other.execute("BEGIN EXCLUSIVE")
        with pytest.raises(RuntimeError, match="is locked by another program: close that"):
            connect(url)


def test_names(tmp_path: Path) -> None:
    """Names are long, different each time, and recognised; a name that the server did not make opens nothing."""
    assert len({new_name() for _ in range(100)}) == 100
    assert is_name(new_name())
    assert not any(map(is_name, ["", "..", "a/b", "../../etc/passwd", "A" * 16, "a" * 33, "0123456789abcde\n"]))
    with closing(DataDirectory(tmp_path)) as files:
        for path_of in (files.upload, files.record, files.thumbnail, partial(files.remove, "uploads")):
            with pytest.raises(ValueError, match="made by the server"):
                path_of("../x")


def test_one_server_at_a_time(tmp_path: Path) -> None:
    """A data directory has one server at a time, and another one when that is gone; its owner alone can read it."""
    settings = Settings(data_dir=tmp_path / "new")
    with closing(Store(settings)), pytest.raises(RuntimeError, match="in use"):
        Store(settings)
    Store(settings).close()
    assert (tmp_path / "new").stat().st_mode & 0o077 == 0


def test_uploads_are_found_by_their_content(tmp_path: Path) -> None:
    """The newest of several uploads with the same content is found, through the index on it."""
    with closing(Store(Settings(data_dir=tmp_path))) as store:
        for number, sha256 in enumerate(("a", "b", "a")):
            shape = {"frames": 2, "width": 4, "height": 4, "frame_rate_hz": 25.0, "duration_s": 1.0, "size_bytes": 9}
            made = {"id": f"{number}" * 16, "name": f"{number}.mp4", "created": f"2026-0{number + 1}"}
            store.add(UploadRow(kind="video", sha256=sha256, warnings=[], **shape, **made))
        assert [row and row.name for row in map(store.upload_of, "abc")] == ["2.mp4", "1.mp4", None]
        with store._engine.connect() as database:
            plan = database.exec_driver_sql("EXPLAIN QUERY PLAN SELECT * FROM uploads WHERE sha256 = 'a'").fetchall()
        assert "USING INDEX" in str(plan)


def test_what_was_coming_or_going_is_cleared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At the start unfinished uploads and exports that were not fetched are deleted.

    Previews are kept up to a limit, and checkpoints too, where the least recently used ones are deleted.
    """
    monkeypatch.setattr("pftrack_server.store.files.MOST_PREVIEWS", 2)
    with closing(DataDirectory(tmp_path)) as files:
        files.new_incoming().mkdir()
        files.new_outgoing().mkdir()
        name = new_name()
        (files.uploads / name).mkdir()
        for frame in range(4):
            files.keep_preview(name, frame, b"picture")
        assert [files.preview(name, frame).exists() for frame in range(4)] == [True, True, False, False]
        for number in range(3):
            folder = files.states_of(f"{number:016x}")
            folder.mkdir()
            (folder / "b0.states").write_bytes(bytes(100))
            os.utime(folder / "b0.states", (number, number))
        files.trim_states(250)
        assert [path.parent.name[-1] for path in sorted(files.states.glob("*/*"))] == ["1", "2"]
    with closing(DataDirectory(tmp_path)) as again:
        assert [*again.incoming.iterdir(), *again.outgoing.iterdir()] == []


def test_links_are_not_followed(tmp_path: Path) -> None:
    """A link in one of the server's folders that leads out of it opens nothing, and is deleted as a link.

    The server's own folders may be links of its owner.
    """
    secret = tmp_path / "secret"
    (secret / "content").mkdir(parents=True)
    (secret / "index.json").write_text("secret")
    (tmp_path / "large").mkdir()
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "uploads").symlink_to(tmp_path / "large")
    with closing(DataDirectory(tmp_path / "data")) as files:
        name, inner = new_name(), new_name()
        assert files.upload(inner).name == "content"
        for folder in (files.uploads, files.states):
            (folder / name).symlink_to(secret)
        for path in (files.runs / f"{name}.pft", files.runs / f"{name}.png", files.sweeps / f"{name}.parquet"):
            path.symlink_to(secret / "index.json")
        (files.uploads / inner / "content").mkdir(parents=True)
        (files.uploads / inner / "content" / "000000").symlink_to(secret / "index.json")
        paths = [files.upload, files.index, files.record, files.thumbnail, files.sweep, files.states_of]
        paths += [lambda name: files.truth(name, "boxes"), lambda name: files.preview(name, 0)]
        for path_of, named in (*((path_of, name) for path_of in paths), (files.upload, inner)):
            with pytest.raises(ApiError, match="links are not followed"):
                path_of(named)
        for kind in ("uploads", "runs", "sweeps"):
            files.remove(kind, name)
        files.remove_states(name)
        assert not any(path.is_symlink() for path in tmp_path.rglob(f"{name}*"))
        assert (secret / "index.json").read_text() == "secret"
