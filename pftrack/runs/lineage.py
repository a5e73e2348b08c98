"""Lines of particles through the clouds of successive frames, back to ancestors and on to children.

Each cloud knows the places of its particles' parents in the cloud before. A frame without particles, or with those
of other filters, or one whose parents are not known, ends all lines.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.cloud import Cloud

__all__ = ["find_ancestor", "find_heir", "known_parents", "parents_onward"]


def find_ancestor(particle: int, clouds: Sequence[Cloud | None]) -> int | None:
    """Return what a particle of the last of some clouds was in the first; None if its line began in between."""
    for before, cloud in zip(clouds[-2::-1], clouds[:0:-1], strict=True):
        parents = _parents(before, cloud)
        if parents is None or not 0 <= particle < len(parents):
            return None
        particle = int(parents[particle])
    return particle if particle >= 0 else None


def find_heir(particle: int, clouds: Sequence[Cloud | None]) -> int | None:
    """Return what has become of a particle of the first of some clouds in the last; None if its line has ended."""
    for before, cloud in pairwise(clouds):
        parents = _parents(before, cloud)
        if cloud is None or parents is None:
            return None
        children = np.flatnonzero(parents == particle)
        if not len(children):
            return None
        particle = int(children[cloud.log_weights[children].argmax()])
    return particle


def known_parents(clouds: Sequence[Cloud | None]) -> list[NDArray[np.int64]]:
    """Return the parents of the particles of clouds that end with the last one, as far back as all are known.

    Those of the first cloud are left out: their parents are not among the clouds.
    """
    pairs = zip(clouds[-2::-1], clouds[:0:-1], strict=True)
    return _until_unknown(pairs)[::-1]


def parents_onward(clouds: Sequence[Cloud | None]) -> list[NDArray[np.int64]]:
    """Return the parents of the particles of clouds after the first one, as far on as all are known."""
    return _until_unknown(pairwise(clouds))


def _until_unknown(pairs: Iterable[tuple[Cloud | None, Cloud | None]]) -> list[NDArray[np.int64]]:
    found: list[NDArray[np.int64]] = []
    for before, cloud in pairs:
        parents = _parents(before, cloud)
        if parents is None:
            break
        found.append(parents)
    return found


def _parents(before: Cloud | None, cloud: Cloud | None) -> NDArray[np.int64] | None:
    """Return the parents of particles among those of the frame before; None if these are of other filters."""
    if cloud is None or cloud.ancestors is None or before is None or cloud.filters != before.filters:
        return None
    return None if cloud.ancestors.max(initial=0) >= len(before) else cloud.ancestors
