"""Which texts may be executed: those that the owner of this machine has named, and no others.

A recipe, a saved run and a link hold the text of a filter, and may come from anybody. So nothing of that is executed in
a process until somebody has said there that this very text is trusted. Where texts are trusted already, a recipe may
name them by their hash alone.
"""

import hashlib

from pftrack.core.model.recipe import FILTER_HASH, Recipe

__all__ = ["digest_of", "is_trusted", "text_of", "trust", "trust_filters", "with_digests", "with_texts"]

_TRUSTED: dict[str, str] = {}


def digest_of(text: str) -> str:
    """Return the hash by which a text is known, a `FILTER_HASH`; that of a hash is itself."""
    return text if FILTER_HASH.fullmatch(text) else f"sha256:{hashlib.sha256(text.encode()).hexdigest()}"


def trust(*texts: str) -> None:
    """Allow these texts to be executed in this process and in those that it forks."""
    _TRUSTED.update({digest_of(text): text for text in texts if not FILTER_HASH.fullmatch(text)})


def trust_filters(recipe: Recipe) -> None:
    """Allow all filters that a recipe brings to be executed."""
    for texts in recipe.filters.values():
        trust(*texts)


def is_trusted(text: str) -> bool:
    """Return whether a text, which may be named by its hash, may be executed."""
    return digest_of(text) in _TRUSTED


def text_of(text: str) -> str | None:
    """Return a trusted text, which may be named by its hash; None if it is not trusted."""
    return _TRUSTED.get(digest_of(text))


def with_texts(recipe: Recipe) -> Recipe:
    """Return a recipe that holds the texts that it names by their hashes, as far as they are trusted here."""
    filters = {name: tuple(text_of(each) or each for each in texts) for name, texts in recipe.filters.items()}
    return recipe.model_copy(update={"filters": filters}) if filters else recipe


def with_digests(recipe: Recipe) -> Recipe:
    """Return a recipe that names all texts by their hashes."""
    filters = {name: tuple(map(digest_of, texts)) for name, texts in recipe.filters.items()}
    return recipe.model_copy(update={"filters": filters}) if filters else recipe
