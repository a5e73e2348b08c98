"""The bundled libraries of the pages, and the lock file of the tools for their scripts."""

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


def test_the_lock_names_versions_and_no_registry() -> None:
    """Every tool has one exact version and a checksum; each machine chooses its own registry."""
    lock = json.loads((ROOT / "package-lock.json").read_text(encoding="utf-8"))
    packages = {name: entry for name, entry in lock["packages"].items() if name}
    assert all(entry["integrity"].startswith("sha512-") and "resolved" not in entry for entry in packages.values())
    wanted = json.loads((ROOT / "package.json").read_text(encoding="utf-8"))["devDependencies"]
    assert {name: packages[f"node_modules/{name}"]["version"] for name in wanted} == wanted
