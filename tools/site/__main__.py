"""Build the site: `python -m tools.site`, which `make docs` runs."""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

from sphinx.cmd.build import main as sphinx

from tools.pictures.browser import find_chromium

ROOT = Path(__file__).parents[2]
BUILD = ROOT / "build"
MEDIA = BUILD / "media" / "media"
SHOWN = ("pftrack", "server", "frontend_static", "tools/pictures")
"""Files on which pictures depend: the program, and the tools that make them."""


def main() -> int:
    """Build the site and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=BUILD / "site", help="where to")
    parser.add_argument("--pictures", choices=("changed", "all", "none"), default="changed", help="pictures to make")
    given = parser.parse_args()
    wanted = given.pictures == "all" or (given.pictures == "changed" and _pictures_are_old())
    if wanted and (status := _make_pictures()):
        return status
    MEDIA.parent.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(given.out, ignore_errors=True)
    folders = ["-c", str(ROOT / "tools" / "site"), "-d", str(BUILD / "doctrees"), str(ROOT / "docs"), str(given.out)]
    return sphinx(["-q", "-W", "--keep-going", "-b", "html", *folders])


def _pictures_are_old() -> bool:
    """Return whether the program has changed since the pictures were made."""
    made = MEDIA.stat().st_mtime if MEDIA.is_dir() else 0.0
    files = (path for place in SHOWN for path in (ROOT / place).rglob("*") if "__pycache__" not in path.parts)
    return any(path.is_file() and path.stat().st_mtime > made for path in files)


def _make_pictures() -> int:
    """Make all pictures again, in a process that has closed server and browser when it ends; return its exit status."""
    if find_chromium() is None:
        print("No Chromium was found, so the site has no new pictures", file=sys.stderr, flush=True)
        return 0
    print("Making pictures and films; this takes some minutes", flush=True)
    shutil.rmtree(MEDIA, ignore_errors=True)
    status = subprocess.run([sys.executable, "-m", "tools.pictures", str(MEDIA)], cwd=ROOT, check=False).returncode
    if status:
        shutil.rmtree(MEDIA, ignore_errors=True)  # the next build makes all again
        print("The pictures could not be made; --pictures none builds the site without", file=sys.stderr, flush=True)
    else:
        (MEDIA / "made").touch()
        (MEDIA / "made").unlink()  # its folder then has the time of the last picture
    return status


if __name__ == "__main__":
    sys.exit(main())
