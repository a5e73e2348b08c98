"""Lectures: lessons, failures, sessions, comparisons and polls in an order, each with its minutes.

A lecture is one small text file, kept as it was written: a Markdown file whose head lists the items and whose text is
the lecturer's notes.

- `file`: from text to what it says, with the line of whatever is wrong, and back
- `items`: what is known of an item here: its title, its page, how long it takes
- `service`: the lectures that are kept
"""

__all__: list[str] = []
