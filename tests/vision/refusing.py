"""How the tests of pictures check that what makes no sense is refused."""

from collections.abc import Callable

import pytest


def refuse(words: str, call: Callable[..., object], *arguments: object, **named: object) -> None:
    """Check that a call is refused with a ValueError in words that match."""
    with pytest.raises(ValueError, match=words):
        call(*arguments, **named)
