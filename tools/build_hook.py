"""How wheels are built: for any machine, or with compiled code for one Python.

Both contain the documentation if it has been built (`make docs`): the server offers it under *Help*.

If `PFTRACK_PRECOMPILED` names a folder filled by `python -m tools.precompile`, the wheel contains it, and fits this
version of Python on x86-64 with the C library that compiled code calls (`pftrack.core.numerics.machine`). Where it
fits, pip prefers it to the wheel for any machine.
"""

import os
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

__all__ = ["BuildHook"]

PLATFORM = "manylinux_2_28_x86_64"


class BuildHook(BuildHookInterface):  # type: ignore[type-arg]
    """Adds generated files to a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the folders to the wheel, and set the tag of the machines that it fits."""
        if version != "standard":
            return
        site = Path(self.root) / "build" / "site"
        if (site / "index.html").is_file():
            build_data["force_include"][str(site)] = "pftrack_server/help_site"
        if folder := os.environ.get("PFTRACK_PRECOMPILED"):
            build_data["force_include"][folder] = "pftrack/precompiled"
            build_data["pure_python"] = False
            build_data["tag"] = f"cp{sys.version_info[0]}{sys.version_info[1]}-none-{PLATFORM}"
