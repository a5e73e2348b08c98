"""A fork server for tests."""

from collections.abc import Iterator

import pytest

from pftrack.process import ForkServer


@pytest.fixture(scope="module")
def server() -> Iterator[ForkServer]:
    """One for all tests of a module that do not close it."""
    made = ForkServer("pftrack.process")
    yield made
    made.close()
