"""The tools for the pages' scripts."""

import json
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_lock_names_versions_and_no_registry() -> None:
    """Every tool has one exact version and a checksum; where it is fetched from is each machine's own affair."""
    lock = json.loads((ROOT / "package-lock.json").read_text(encoding="utf-8"))
    packages = {name: entry for name, entry in lock["packages"].items() if name}
    assert all(entry["integrity"].startswith("sha512-") and "resolved" not in entry for entry in packages.values())
    wanted = json.loads((ROOT / "package.json").read_text(encoding="utf-8"))["devDependencies"]
    assert {name: packages[f"node_modules/{name}"]["version"] for name in wanted} == wanted
