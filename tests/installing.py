"""Packages installed for a test: a folder on the path with metadata, which is what an installed package is."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]

COMMANDS = """
import json, os, sys, tempfile
import pftrack.runs.record
from pftrack.cli.app import main
told = []
for arguments in json.loads(sys.argv[1]):
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        child = os.fork()
        if not child:
            os.dup2(out.fileno(), 1)
            os.dup2(err.fileno(), 2)
            try:
                main(arguments)
            finally:
                ended = sys.exception()
                sys.stderr.flush()
                os._exit(ended.code if isinstance(ended, SystemExit) else 99)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        words = [(file.seek(0), file.read().decode())[1] for file in (out, err)]
        told.append([status, *words])
print(json.dumps(told))
"""


def install(place: Path, name: str, source: str, entry_point: str, version: str = "1.0") -> None:
    """Install a package of one module into a folder.

    Args:
        place: The folder, which is to be on the path.
        name: Name of the distribution; the module has it with underscores.
        source: The module's text.
        entry_point: The line of its experiment, `name = module:ATTRIBUTE`.
        version: Version of the distribution.
    """
    (place / f"{name.replace('-', '_')}.py").write_text(source)
    metadata = place / f"{name.replace('-', '_')}-{version}.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    (metadata / "entry_points.txt").write_text(f"[pftrack.experiments]\n{entry_point}\n")


def install_project(place: Path, project: Path) -> None:
    """Install a package from its source into a folder, as pip does, without a network."""
    options = ["--quiet", "--no-index", "--no-deps", "--no-build-isolation", "--disable-pip-version-check"]
    command = [sys.executable, "-m", "pip", "install", *options, "--target", str(place), str(project)]
    subprocess.run(command, check=True, capture_output=True, text=True)


def environment(place: Path) -> dict[str, str]:
    """Return the environment of a process that finds the project and what is installed in a folder."""
    paths = [str(ROOT), str(place), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


def python(place: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python beside what is installed in a folder."""
    return subprocess.run(
        [sys.executable, *arguments], env=environment(place), capture_output=True, text=True, check=False
    )


class Said(NamedTuple):
    """What a command has said, and its exit status."""

    status: int
    out: str
    err: str


def commands(place: Path, *lines: list[str]) -> list[Said]:
    """Run command lines of `pftrack` one after the other beside what is installed in a folder.

    Each runs in a process of its own, forked from one that has imported the library.
    """
    done = python(place, "-c", COMMANDS, json.dumps(lines))
    assert done.returncode == 0, done.stderr
    return [Said(*each) for each in json.loads(done.stdout)]
