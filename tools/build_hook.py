"""How wheels are built: as they are for any machine, or with compiled code for one Python.

With `PFTRACK_PRECOMPILED` naming a folder that `python -m tools.precompile` has filled, the wheel holds it, and fits
this version of Python on x86-64 with the C library on which compiled code calls (`pftrack.numerics.machine`). Where it
fits, pip prefers it to the one for any machine.
"""

import os
import sys
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

__all__ = ["CompiledCode"]

PLATFORM = "manylinux_2_28_x86_64"


class CompiledCode(BuildHookInterface):  # type: ignore[type-arg]
    """Adds compiled code to a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Take the folder into the wheel, and say in its name what it fits."""
        folder = os.environ.get("PFTRACK_PRECOMPILED")
        if folder and version == "standard":
            build_data["force_include"][folder] = "pftrack/precompiled"
            build_data["pure_python"] = False
            build_data["tag"] = f"cp{sys.version_info[0]}{sys.version_info[1]}-none-{PLATFORM}"
