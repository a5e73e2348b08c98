"""The libraries of the pages, which are bundled beforehand."""

import hashlib
import json
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "frontend_static" / "vendor"
HASHES = json.loads((FOLDER / "hashes.json").read_text(encoding="utf-8"))


def test_each_library_is_what_the_bundler_wrote() -> None:
    """`npm ci && npm run bundle` in `tools/vendor` writes them and their hashes; nobody edits them."""
    found = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in FOLDER.glob("*.js")}
    assert found == HASHES["files"]


def test_they_come_from_the_packages_in_the_lock_file() -> None:
    """A newer lock file without a new bundle is noticed; name, version and licence of each are beside it."""
    locked = json.loads((ROOT / "tools" / "vendor" / "package-lock.json").read_text(encoding="utf-8"))["packages"]
    licences = (FOLDER / "LICENSES.txt").read_text(encoding="utf-8")
    for name, integrity in HASHES["packages"].items():
        assert locked[f"node_modules/{name}"]["integrity"] == integrity
        assert f"\n{name} {locked[f'node_modules/{name}']['version']} (" in licences
