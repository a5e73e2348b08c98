"""The floors of the pages: a folder imports those below it, and nothing of its own floor or above."""

import re
from collections.abc import Iterator
from pathlib import Path

PAGES = Path(__file__).parents[1] / "frontend_static"
FLOORS = (
    {"follow", "gallery", "failures", "lectures", "work"},
    {"compare", "glossary", "help", "learn", "references", "sweep", "upload"},
    {"session"},
    {"lecturer"},
    {"shared"},
    {"vendor"},
)
"""From the top: each page with what is its own, the session that others embed, a lecturer's class, what all share, and
what other people have written."""
IMPORT = re.compile(r"""(?:\bfrom|\bimport)\s*\(?\s*["'](\.[^"']+)["']""")


def imports(pages: Path) -> Iterator[tuple[str, str]]:
    """Pairs of a script and a script that it imports, as paths from the pages' folder."""
    for path in sorted(pages.rglob("*.js")):
        for name in IMPORT.findall(path.read_text(encoding="utf-8")):
            target = (path.parent / name).resolve().relative_to(pages.resolve())
            yield str(path.relative_to(pages)), str(target)


def climbs(pages: Path) -> list[tuple[str, str]]:
    """Imports of another folder that does not lie on a lower floor."""
    floor = {folder: number for number, folders in enumerate(FLOORS) for folder in folders}
    pairs = ((one, other, one.split("/")[0], other.split("/")[0]) for one, other in imports(pages))
    return [(one, other) for one, other, above, below in pairs if above != below and floor[above] >= floor[below]]


def test_every_folder_has_its_floor() -> None:
    """No folder of the pages is without a floor, and no floor names one that is gone."""
    assert {path.name for path in PAGES.iterdir() if path.is_dir()} == set().union(*FLOORS)


def test_folders_import_only_what_lies_below() -> None:
    """So there is no circle among them, and who reads one needs to know only those below."""
    assert climbs(PAGES) == []


def test_no_script_imports_that_of_a_page() -> None:
    """It would run there, and look for parts that the other page does not have."""
    pages = [path.read_text(encoding="utf-8") for path in PAGES.rglob("*.html")]
    entries = {entry for page in pages for entry in re.findall(r'type="module" src="static/([^"]+)"', page)}
    assert len(entries) > 10
    assert [(one, other) for one, other in imports(PAGES) if other in entries] == []


def test_a_climb_is_found(tmp_path: Path) -> None:
    """The search finds imports of each form, and passes over those of the same folder and of a lower floor."""
    for folder in ("session", "shared", "compare"):
        (tmp_path / folder).mkdir()
    (tmp_path / "session" / "a.js").write_text(
        'import { one } from "../compare/b.js";\nimport "./c.js";\nexport * from "../shared/d.js";\n'
        'const e = await import("../compare/e.js");\n/** @import { F } from "../compare/f.js" */\n'
    )
    (tmp_path / "shared" / "g.js").write_text("import '../session/a.js';\n")
    wrong = [("session/a.js", f"compare/{name}.js") for name in "bef"] + [("shared/g.js", "session/a.js")]
    assert climbs(tmp_path) == wrong
