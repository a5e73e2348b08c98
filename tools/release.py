"""Build a release, and use each of its files as a new user would: `python -m tools.release [FOLDER]`.

The files are a source distribution, a wheel for any machine, and one with compiled code for this Python. Each is
installed into an environment of its own, outside the tree, under the oldest and the newest Python that the metadata
allow and this machine has; the wheel for any machine also with the oldest libraries that `pyproject.toml` allows.
Any failure stops it, with the failed command and its output.
"""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tarfile
import tempfile
import time
import tomllib
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from packaging.metadata import Metadata
from packaging.specifiers import SpecifierSet
from packaging.version import Version

from tools import precompile
from tools.pictures.browser import chromium

__all__ = ["Installation", "build", "check_contents", "main", "pythons"]

ROOT = Path(__file__).parents[1]
PROJECT: Mapping[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
INSTALLED = {"pftrack/": "pftrack/", "server/": "", "frontend_static/": "pftrack_server/frontend_static/"}
"""Places of the source folders in a wheel."""

MADE = ("pftrack/precompiled/", "pftrack_server/help_site/")
"""Generated files in wheels."""

UV = [sys.executable, "-m", "uv"]
LONGEST_S = 600.0
MOVED = "Number(document.querySelector('.flat-canvas')?.dataset.frame) > 5"
FRAMES = 30


def main(folder: Path) -> None:
    """Build, check and try everything."""
    shutil.rmtree(folder, ignore_errors=True)
    source, wheel, compiled = build(folder)
    for path in (wheel, compiled):
        check_contents(path)
    hashes = set()
    for title, installation in installations(source, wheel, compiled):
        with installation:
            told = installation.check()
        hashes.add(told.pop("hash"))
        print(f"{title}: " + ", ".join(f"{what} {seconds:.1f} s" for what, seconds in told.items()), flush=True)  # noqa: T201
    if len(hashes) != 1:
        raise SystemExit(f"the same run gives different numbers: {hashes}")
    print("\n".join(f"{path.stat().st_size / 2**20:6.1f} MiB  {path}" for path in (source, wheel, compiled)))  # noqa: T201


# ------------------------------------------------------------ the files


def build(folder: Path) -> tuple[Path, Path, Path]:
    """Build the source distribution, and both wheels from its content; return all three."""
    run(sys.executable, "-m", "build", "--no-isolation", "--sdist", "--outdir", folder, ROOT)
    (source,) = folder.glob("*.tar.gz")
    with tempfile.TemporaryDirectory() as place:
        with tarfile.open(source) as archive:
            archive.extractall(place, filter="data")
        (unpacked,) = Path(place).iterdir()
        # Made from the packed source; its pictures need a browser and two minutes.
        if (ROOT / "build" / "site").exists():
            shutil.copytree(ROOT / "build" / "site", unpacked / "build" / "site")
        wheel = [sys.executable, "-m", "build", "--no-isolation", "--wheel", "--outdir", str(folder), str(unpacked)]
        run(*wheel)
        code = Path(place) / "precompiled"
        precompile.main(code)
        run(*wheel, PFTRACK_PRECOMPILED=str(code))
    (plain,) = folder.glob("*-any.whl")
    (compiled,) = folder.glob("*_x86_64.whl")
    return source, plain, compiled


def check_contents(wheel: Path) -> None:
    """Demand that a wheel has the project's metadata, and contains exactly its tracked files.

    Raises:
        SystemExit: The wheel does not.
    """
    with zipfile.ZipFile(wheel) as archive:
        packed = set(archive.namelist())
        (described,) = (name for name in packed if name.endswith(".dist-info/METADATA"))
        stated = Metadata.from_email(archive.read(described), validate=True)
    demand(str(stated.version) == PROJECT["version"], f"{wheel.name} is of version {stated.version}")
    demand(str(stated.requires_python) == PROJECT["requires-python"], f"{wheel.name}: {stated.requires_python}")
    tracked = run("git", "ls-files", cwd=ROOT).splitlines()
    wanted = {
        place + name.removeprefix(folder)
        for name in tracked
        for folder, place in INSTALLED.items()
        if name.startswith(folder)
    }
    demand(wanted <= packed, f"{wheel.name} lacks {sorted(wanted - packed)}")
    own = {name for name in packed if not name.startswith(MADE) and ".dist-info/" not in name}
    demand(own == wanted, f"{wheel.name} holds {sorted(own - wanted)}, which is not tracked")


# ------------------------------------------------------------ their installations


def pythons() -> list[str]:
    """Return the oldest and the newest Python that the metadata allow and this machine has."""
    allowed = SpecifierSet(PROJECT["requires-python"])
    told = json.loads(run(*UV, "python", "list", "--only-installed", "--output-format", "json"))
    found = {each["version"]: each["path"] for each in told if each["implementation"] == "cpython"}
    fitting = sorted((Version(version), path) for version, path in found.items() if version in allowed)
    newest_patches = {version.release[:2]: path for version, path in fitting}
    return [newest_patches[minor] for minor in sorted({min(newest_patches), max(newest_patches)})]


def installations(source: Path, wheel: Path, compiled: Path) -> "Iterator[tuple[str, Installation]]":
    """Yield the installations to check, with their titles."""
    for python in pythons():
        yield f"{wheel.name}, {python}", Installation(python, wheel)
    yield source.name, Installation(sys.executable, source)
    yield compiled.name, Installation(sys.executable, compiled)
    yield f"{wheel.name}, oldest libraries", Installation(sys.executable, wheel, oldest=True)


@dataclass
class Installation:
    """A file of the release, installed in an environment of its own while the context lasts.

    Attributes:
        python: Python that installs it.
        file: The file.
        oldest: Whether to use the oldest allowed libraries instead of those in `constraints.txt`.
    """

    python: str
    file: Path
    oldest: bool = False

    def __enter__(self) -> Self:
        """Make the environment, and install the file there."""
        self._home = tempfile.TemporaryDirectory()
        self._place = Path(self._home.name)
        interpreter = self._place / "env" / "bin" / "python"
        run(*UV, "venv", "--quiet", "--python", self.python, self._place / "env")
        versions = ROOT / "constraints.txt"
        if self.oldest:
            versions = self._place / "oldest.txt"
            oldest = ["--quiet", "--resolution", "lowest-direct", "--python", interpreter, "--output-file", versions]
            run(*UV, "pip", "compile", *oldest, ROOT / "pyproject.toml")
        # With bytecode, as pip compiles it; without, the first start takes twice as long.
        install = ["--quiet", "--compile-bytecode", "--python", interpreter, "-c", versions]
        run(*UV, "pip", "install", *install, self.file.absolute())
        self._command = interpreter.parent / "pftrack"
        return self

    def __exit__(self, *_: object) -> None:
        """Remove it."""
        self._home.cleanup()

    def check(self) -> dict[str, Any]:
        """Use pftrack as a new user would; return the time of each step, s, and the hash of a run."""
        begun = time.monotonic()
        told: dict[str, Any] = {}

        def note(what: str) -> None:
            nonlocal begun
            now = time.monotonic()
            told[what], begun = now - begun, now

        demand(PROJECT["version"] in self.call("--version"), "--version")
        names = [each["id"] for each in json.loads(self.call("list", "--json"))]
        demand({"ball", "histogram"} <= set(names), f"list --json names {names}")
        note("list")
        film = self._place / "film.mp4"
        ran = json.loads(self.call("run", "ball", "--frames", str(FRAMES), "--video-out", str(film), "--json"))
        told["hash"] = ran["estimates_sha256"]
        note("run ball")
        clip = json.loads(self.call("run", "histogram", "--video", str(film), "--box", "100,60,60,60", "--json"))
        demand(clip["frames"] == FRAMES, f"the clip has {clip['frames']} frames")
        note("run on a clip")
        told["serve, and a ball that moves"] = self.serve()
        return told

    def call(self, *arguments: str) -> str:
        """Run a command of pftrack outside the tree, and return what it prints."""
        return run(self._command, *arguments, cwd=self._place, **self._environment())

    def serve(self) -> float:
        """Serve, open the ball in a browser, check that it moves without an error, and end the server as a system does.

        Returns:
            Time until the ball moved, s.
        """
        begun = time.monotonic()
        command = [self._command, "serve", "--port", "0", "--data-dir", self._place / "data"]
        server = subprocess.Popen(  # noqa: S603
            command, stdout=subprocess.PIPE, text=True, cwd=self._place, env={**os.environ, **self._environment()}
        )
        try:
            links = (re.search(r"http://\S+", line) for line in server.stdout or ())
            link = next(filter(None, links), None)
            if link is None:
                raise SystemExit("serve prints no link")
            look_at_ball(link[0])
            moved = time.monotonic() - begun
        finally:
            server.send_signal(signal.SIGTERM)
            ended = server.wait(60)
        demand(ended == 0, f"serve ended with {ended}")
        return moved

    def _environment(self) -> dict[str, str]:
        """Return an environment without the caller's own settings."""
        return {"HOME": str(self._place), "PYTHONPATH": "", "PFTRACK_BASE_PATH": "", "NUMBA_CACHE_DIR": ""}


def look_at_ball(address: str) -> None:
    """Open the ball's session from the start page, and wait until it plays."""
    with chromium() as browser:
        page = browser.new_page()
        wrong: list[str] = []
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.goto(address)
        page.locator("[data-experiment=ball] h4 a").click()
        page.wait_for_url("**/session/*", timeout=1000 * LONGEST_S)
        deadline = time.monotonic() + LONGEST_S
        while not page.evaluate(MOVED):
            demand(time.monotonic() < deadline, "the ball does not move")
            page.wait_for_timeout(100)
        demand(not wrong, f"the page reports errors: {wrong}")


def run(*command: object, cwd: Path | None = None, **variables: str) -> str:
    """Run a command and return what it prints.

    Raises:
        SystemExit: The command fails.
    """
    environment = {key: value for key, value in {**os.environ, **variables}.items() if value or key not in variables}
    words = [str(word) for word in command]
    done = subprocess.run(  # noqa: S603
        words, cwd=cwd, env=environment, capture_output=True, text=True, check=False, timeout=3 * LONGEST_S
    )
    demand(done.returncode == 0, f"{' '.join(words)}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return done.stdout


def demand(holds: object, sentence: str) -> None:
    """End with a sentence unless something holds."""
    if not holds:
        raise SystemExit(sentence)


if __name__ == "__main__":
    main(Path(sys.argv[1] if sys.argv[1:] else ROOT / "dist").absolute())
