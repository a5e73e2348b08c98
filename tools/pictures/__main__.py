"""Make the pictures, films and live pages of the documentation: `python -m tools.pictures FOLDER [NAME ...]`."""

import argparse
import shutil
import time
from pathlib import Path

from tools.pictures import live
from tools.pictures.browser import animate, chromium
from tools.pictures.server import serve
from tools.pictures.shots import FILMS, PICTURES, take

DOCS = Path(__file__).parents[2] / "docs"
README = {"session", "slider", "sweep"}
"""Pictures that are kept next to the pages, since they are also shown without a built site."""


def main() -> None:
    """Make the named pictures, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--readme", action="store_true", help="replace the pictures that README and docs/ show")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    names = given.names or [*live.LIVE, *PICTURES, *FILMS]
    for name in names:
        if name in live.LIVE:
            live.write(name, given.folder)
            print(name, flush=True)
    seen = [name for name in names if name not in live.LIVE]
    if not seen:
        return
    with serve() as server, chromium() as browser:
        for name in seen:
            begun = time.monotonic()
            take(name, server, browser, given.folder)
            print(f"{name} ({time.monotonic() - begun:.0f} s)", flush=True)
            if given.readme and name in README & FILMS.keys():
                animate(given.folder / f"{name}.mp4", DOCS / f"{name}.webp")
            elif given.readme and name in README:
                shutil.copy(given.folder / f"{name}.png", DOCS / f"{name}.png")


if __name__ == "__main__":
    main()
