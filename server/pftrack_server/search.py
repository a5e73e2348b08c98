"""Finding what somebody has made by words: each word has to occur in what is known of a thing."""

import re
from collections.abc import Iterable
from datetime import datetime

from pftrack.experiments import EXPERIMENTS


class Words:
    """The words of a search, in any order and either case; parts of words do as well, but not parts of numbers.

    A seed is not to be found in the minutes of a clock, nor in the month of a date in digits.
    """

    def __init__(self, text: str) -> None:
        self._words = [_pattern(word) for word in text.casefold().split()]

    def occur_in(self, *texts: object) -> bool:
        """Tell whether all of them occur in what these texts say together."""
        said = " ".join(str(text) for text in texts).casefold()
        return all(word.search(said) for word in self._words)


def _pattern(word: str) -> re.Pattern[str]:
    """Return what matches a word anywhere, and a number only where no digits, clock or date go on."""
    return re.compile(rf"(?<![\d:-]){word}(?![\d:-])" if word.isdecimal() else re.escape(word))


def experiment_words(experiment: str, trackers: Iterable[str]) -> str:
    """Return an experiment and trackers of it by names and titles; of what there is no more, the names alone."""
    names = [experiment, *trackers]
    known = EXPERIMENTS.get(experiment)
    if known is not None:
        names += [
            known.title,
            known.video.clip_title,
            known.target,
            *(known.trackers[name].title for name in names if name in known.trackers),
        ]
    return " ".join(names)


def date_words(created: str, now: datetime) -> str:
    """Return a moment as it may be looked for: in digits, in words, and "today" on that day.

    Args:
        created: The moment, as ISO 8601 has it.
        now: When somebody looks for it, in the zone of who does: in another zone it may be another day.
    """
    try:
        moment = datetime.fromisoformat(created).astimezone(now.tzinfo)
    except ValueError:
        return created
    today = "today" if moment.date() == now.date() else ""
    return f"{moment:%Y-%m-%d %H:%M} {moment.day} {moment:%B %Y} {today}"
