"""Markdown with formulas as HTML with MathML, which browsers draw and read out by themselves.

A lecturer's file comes from elsewhere. So its own HTML is text, pictures are left out, and a formula is written out
here element by element: the converter's own printer would let through the markup that words in a formula hold.
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
"""Attributes that say how a formula looks. Any other, such as a link, is left out."""


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
        display: It stands by itself, not in a line of text.

    Raises:
        ValueError: It cannot be read.
    """
    try:
        element = convert_to_element(latex, display="block" if display else "inline")
    except Exception as error:  # its own errors, and whatever a text from elsewhere leads it into
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
    """Return a reader of Markdown that makes formulas between dollars MathML."""
    return reader.use(dollarmath_plugin, allow_space=False, double_inline=True, renderer=_formula)


def _formula(latex: str, options: dict[str, bool]) -> str:
    """Return the MathML of a formula; one that cannot be read is shown as it was written."""
    try:
        return formula(latex, display=options["display_mode"])
    except ValueError:
        return f'<code class="unread" title="This formula cannot be read">{escape(latex)}</code>'
