"""Where to look when a target was lost: at the frames before, where another choice can still save it."""

from collections.abc import Sequence

__all__ = ["APPROACH_FRAMES", "LASTING_FRAMES", "approach", "before_loss", "first_loss", "loss_start", "losses"]

APPROACH_FRAMES = 10
"""Frames before a loss at which one begins to watch."""

LASTING_FRAMES = 5
"""A loss is one to ask about if it lasts so many frames, or to the end."""

GOOD_FRAMES = 3
"""Fewer frames between two losses are no track that anybody could watch being lost."""

MEMORY_FRAMES = 40
"""A target that was out of sight this many frames before it was lost was lost because of that."""


def approach(loss: int) -> int:
    """Return the frame from which to watch what happens in another one."""
    return max(0, loss - APPROACH_FRAMES)


def loss_start(frame: int, before: int | None, *, lost: bool | None) -> int | None:
    """Return the frame in which the loss began that goes on in a frame.

    Args:
        frame: The frame.
        before: The same of the frame before it.
        lost: Whether the target is lost, as `pftrack.core.model.loss_witness` has it.

    Returns:
        The frame; None if the target is not lost here.
    """
    if not lost:
        return None
    return frame if before is None else before


def losses(lost: Sequence[bool]) -> list[tuple[int, int]]:
    """Return the first and the last frame of each loss, by time, from whether the target is lost in each frame."""
    ends = [index for index, holds in enumerate(lost) if holds and not any(lost[index + 1 : index + 2])]
    return list(zip(_starts(lost), ends, strict=True))


def first_loss(lost: Sequence[bool]) -> int | None:
    """Return the frame in which the first lasting loss begins, or the first loss; None if there is none."""
    found = losses(lost)
    lasting = [first for first, last in found if last - first + 1 >= LASTING_FRAMES or last + 1 == len(lost)]
    return next(iter(lasting), found[0][0] if found else None)


def before_loss(lost: Sequence[bool], hidden: Sequence[bool], frame: int) -> int | None:
    """Return the frame from which to watch how the target was lost.

    That is some frames before the loss, or before the target went out of sight if that led to it, but after the loss
    that was before: where a good track is still to be seen. A few good frames between two losses are none.

    Args:
        lost: For each frame, whether the target is lost, as `loss_start` has it.
        hidden: For each frame, whether the target is out of sight.
        frame: The last loss that began at or before this frame is meant; failing that, the first one after it.

    Returns:
        The frame; None if the target was never lost.
    """
    begun = _lasting_starts(lost)
    if not begun:
        return None
    loss = max((start for start in begun if start <= frame), default=begun[0])
    went = max((start for start in _starts(hidden) if start <= loss), default=None)
    led_to_it = went is not None and any(hidden[max(went, loss - MEMORY_FRAMES) : loss + 1])
    first = approach(went if went is not None and led_to_it else loss)
    return max((index + 1 for index in range(first, loss) if lost[index]), default=first)


def _lasting_starts(lost: Sequence[bool]) -> list[int]:
    """Return the frames in which losses begin, those left out that follow another one after a few frames."""
    found = losses(lost)
    ends = [-GOOD_FRAMES - 1, *(last for _, last in found)]
    return [first for (first, _), end in zip(found, ends, strict=False) if first - end > GOOD_FRAMES]


def _starts(flags: Sequence[bool]) -> list[int]:
    """Return the frames in which something begins to hold."""
    return [index for index, holds in enumerate(flags) if holds and (index == 0 or not flags[index - 1])]
