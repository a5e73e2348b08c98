"""Whether true boxes can be of the pictures that they are given for.

A target may leave the picture, partly or for some frames entirely, and its true box with it. Where most boxes lie
wholly outside, they were drawn on a clip of another size, or hold other numbers than their columns say.
"""

from collections.abc import Iterable, Iterator, Sequence

__all__ = ["boxes_outside"]

MOST = 0.5
"""A larger share of boxes outside is no target that has left the picture."""
LISTED = 3
"""Of so many stretches of frames the numbers are told."""


def boxes_outside(boxes: Iterable[tuple[int, Sequence[float]]], width: int, height: int) -> tuple[str, ...]:
    """Return a warning if most boxes lie wholly outside the picture, a sentence; nothing otherwise.

    Args:
        boxes: (frame, (x, y, w, h)) of every box, px, of frames that the recording has.
        width: Of the pictures, px.
        height: Of the pictures, px.
    """
    known = list(boxes)
    outside = [
        (frame, box)
        for frame, box in known
        if not (-box[2] < box[0] < width and -box[3] < box[1] < height)  # it covers [x, x + w) and [y, y + h)
    ]
    if len(outside) <= MOST * len(known):
        return ()
    frame, box = min(outside, key=lambda one: one[0])
    these = "The only true box lies" if len(known) == 1 else f"{len(outside):,} of {len(known):,} true boxes lie"
    where = _frames({number for number, _ in outside})
    place = ", ".join(f"{value:g}" for value in box)
    sentences = (
        f"{these} wholly outside the picture of {width} x {height} px: {where}; that of frame {frame} is {place}. "
        "If they were drawn on a clip of another size, scale them to this one, and check the order of the columns: "
        "x, y, w, h."
    )
    return (sentences,)


def _frames(numbers: Iterable[int]) -> str:
    """Return numbers of frames in words, such as "frames 0 to 8 and 11"."""
    spans = list(_spans(sorted(numbers)))
    told = [f"{first}" if first == last else f"{first} to {last}" for first, last in spans[:LISTED]]
    if more := sum(last - first + 1 for first, last in spans[LISTED:]):
        told.append(f"{more:,} more")
    several = len(told) > 1 or spans[0][0] != spans[0][1]
    words = told[0] if len(told) == 1 else f"{', '.join(told[:-1])} and {told[-1]}"
    return f"{'frames' if several else 'frame'} {words}"


def _spans(numbers: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Yield first and last of each stretch of numbers without a gap."""
    first = last = numbers[0]
    for number in numbers[1:]:
        if number != last + 1:
            yield first, last
            first = number
        last = number
    yield first, last
