"""What keeps a server from starting is told in one sentence that says what to do."""

import socket
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from pftrack_server.core.settings import Settings
from pftrack_server.store import Store
from tests.server.command import Wish, refused


def database_of(folder: Path) -> Path:
    """The database of a data directory, empty but for its tables."""
    Store(Settings(data_dir=folder)).close()
    return folder / "pftrack.sqlite"


def execute(path: Path, statement: str) -> None:
    """Carry out a statement behind the server's back."""
    with sqlite3.connect(path) as database:
        database.execute(statement)
    database.close()


def databases(below: Path) -> dict[str, Path]:
    """Folders with a file that is not a database, and with one that is damaged, newer or another program's."""
    folders = {name: below / name for name in ("none", "damaged", "newer", "older", "foreign")}
    folders["none"].mkdir()
    (folders["none"] / "pftrack.sqlite").write_bytes(b"certainly no database" * 100)
    path = database_of(folders["damaged"])
    content = bytearray(path.read_bytes())
    content[4096 + 8 : 3 * 4096] = b"\xff" * (2 * 4096 - 8)
    path.write_bytes(content)
    execute(database_of(folders["newer"]), "PRAGMA user_version = 9999")
    execute(database_of(folders["older"]), "PRAGMA application_id = 0")
    execute(folders["older"] / "pftrack.sqlite", "CREATE TABLE alembic_version (version_num)")
    folders["foreign"].mkdir()
    execute(folders["foreign"] / "pftrack.sqlite", "CREATE TABLE invoices (number INTEGER)")
    return folders


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What each server says that cannot start, and the port that is in use."""
    below = tmp_path_factory.mktemp("refused")
    (below / "file").write_text("")
    held = Store(Settings(data_dir=below / "held"))
    with closing(held), socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        data = f"data_dir=Path({str(below / 'data')!r})"
        place = f"port=0, {data}"
        wishes = {
            "port in use": Wish(f"port={port}, {data}"),
            "elsewhere": Wish(f"{place}, host='203.0.113.7'"),
            "held": Wish(f"port=0, data_dir=Path({str(below / 'held')!r})"),
            "no folder": Wish(f"port=0, data_dir=Path({str(below / 'file')!r})"),
            "no port": Wish("port=70000", status=2),
            "few files": Wish(place, "import resource; resource.setrlimit(resource.RLIMIT_NOFILE, (200, 200))"),
            **{name: Wish(f"port=0, data_dir=Path({str(folder)!r})") for name, folder in databases(below).items()},
        }
        return {**dict(zip(wishes, refused(*wishes.values()), strict=True)), "port": str(port)}


def test_where_it_cannot_listen_or_write(said: dict[str, str]) -> None:
    """A port in use, an address of another machine, a file in the place of a folder, one that another server has."""
    assert f"Port {said['port']} is in use" in said["port in use"]
    assert "address" in said["elsewhere"]
    assert "--data-dir" in said["no folder"]
    assert "in use by another" in said["held"]
    assert "port" in said["no port"]


def test_what_the_shell_allows(said: dict[str, str]) -> None:
    """With too few open files it is said what to raise."""
    assert "200 open files (ulimit -n)" in said["few files"]
    assert "at least 256" in said["few files"]


def test_what_is_no_database_of_ours(said: dict[str, str]) -> None:
    """A file that is not a database, is damaged, or is another version's or program's."""
    assert "is not a database, or is damaged" in said["none"]
    assert "--data-dir" in said["none"]
    assert "is damaged: restore a copy of it" in said["damaged"]
    assert "newer version of pftrack" in said["newer"]
    assert "9999" in said["newer"]
    assert "update pftrack" in said["newer"]
    assert "before the first release: move it away" in said["older"]
    assert "belongs to another program, since it has tables invoices" in said["foreign"]
