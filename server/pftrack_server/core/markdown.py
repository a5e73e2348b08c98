"""Markdown with formulas as HTML with MathML, which browsers draw and read aloud without a library.

A lecturer's file is not trusted. Its HTML is shown as text, pictures are left out, and formulas are written here
element by element: the converter's own printer would let through markup in the words of a formula.
"""

import re
from functools import lru_cache
from html import escape, unescape
from xml.etree import ElementTree as ET

from latex2mathml.converter import convert_to_element
from markdown_it import MarkdownIt
from mdit_py_plugins.dollarmath import dollarmath_plugin

MOST_TEXTS = 1000
HARMLESS = re.compile(
    r"accent|(column|row)(align|lines|spacing)|depth|display(style)?|fence|form|height|linethickness|[lr]space|"
    r"mathvariant|(max|min)size|movablelimits|notation|scriptlevel|separator|stretchy|width|xmlns"
)
"""Attributes for the look of a formula. All others, such as links, are removed."""


@lru_cache(MOST_TEXTS)
def paragraphs(markdown: str) -> str:
    """Return the HTML of a text of some paragraphs."""
    return str(_reader().render(markdown))


@lru_cache(MOST_TEXTS)
def inline(markdown: str) -> str:
    """Return the HTML of a sentence."""
    return str(_reader().renderInline(markdown))


def formula(latex: str, *, display: bool) -> str:
    """Return the MathML of a formula.

    Args:
        latex: The formula.
        display: Whether it stands on a line of its own, not within text.

    Raises:
        ValueError: The formula is not valid LaTeX.
    """
    try:
        element = convert_to_element(latex, display="block" if display else "inline")
    except Exception as error:  # its own errors, and any failure on an untrusted text
        raise ValueError(f"this formula cannot be read: {latex}") from error
    for part in element.iter():
        part.text = unescape(part.text) if part.text else None
        for name in [name for name, _ in part.items() if not HARMLESS.fullmatch(name)]:
            del part.attrib[name]
    return ET.tostring(element, encoding="unicode", short_empty_elements=False)


@lru_cache(1)
def _reader() -> MarkdownIt:
    return with_formulas(MarkdownIt("commonmark", {"html": False}).disable("image"))


def with_formulas(reader: MarkdownIt) -> MarkdownIt:
    """Return a Markdown reader that turns formulas between dollar signs into MathML."""
    return reader.use(dollarmath_plugin, allow_space=False, double_inline=True, renderer=_formula)


def _formula(latex: str, options: dict[str, bool]) -> str:
    """Return the MathML of a formula, or its source text if it cannot be read."""
    try:
        return formula(latex, display=options["display_mode"])
    except ValueError:
        return f'<code class="unread" title="This formula cannot be read">{escape(latex)}</code>'
