"""Migrations of the database, run by Alembic where it has not the newest of them."""

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory
from sqlalchemy import Connection

__all__ = ["find_revisions", "upgrade"]


def find_revisions() -> tuple[str, ...]:
    """Return the names of all migrations, the newest first."""
    return tuple(each.revision for each in ScriptDirectory.from_config(_configuration()).walk_revisions())


def upgrade(connection: Connection) -> None:
    """Create the tables of a database, or bring them up to date."""
    config = _configuration()
    config.attributes["connection"] = connection
    command.upgrade(config, "head")


def _configuration() -> Config:
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent).replace("%", "%%"))
    return config
