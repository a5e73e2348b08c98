"""Put the documentation into the wheel, if it has been built (`make docs`): the server then offers it under *Help*."""

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class SiteHook(BuildHookInterface):  # type: ignore[type-arg]
    """Adds the folder that `make docs` writes."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Name what is to be packed beside what the project's file says."""
        site = Path(self.root) / "build" / "site"
        if version == "standard" and (site / "index.html").is_file():
            build_data["force_include"][str(site)] = "pftrack_server/help_site"
