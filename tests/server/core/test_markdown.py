"""Markdown: formulas become MathML, and nothing that a lecturer writes becomes markup of its own."""

from xml.etree import ElementTree as ET

import pytest

from pftrack_server.core.markdown import inline, paragraphs


def test_formulas_become_mathml() -> None:
    """A formula within a line, and one that stands alone, with their signs as characters."""
    text = paragraphs("Bayes' rule *turns* it:\n\n$$p(x \\mid z) \\propto p(z \\mid x)\\,p(x)$$\n\nfor $N \\le 50$.")
    assert "<em>turns</em>" in text
    assert 'display="block"' in text
    assert "∝" in text
    assert '<math xmlns="http://www.w3.org/1998/Math/MathML" display="inline">' in text
    assert "<mo>≤</mo>" in text


@pytest.mark.parametrize(
    "hostile",
    [
        "<script>alert(1)</script>",
        "<img src=x onerror=alert(1)>",
        "$\\text{<svg/onload=alert(1)>}$",
        "$\\text{&lt;svg/onload=alert(1)&gt;}$",
        "$<script>$",
        "$\\href{javascript:alert(1)}{x}$",
        "[here](javascript:alert(1))",
        "![a picture](https://elsewhere.example/x.png)",
    ],
)
def test_nothing_of_a_text_becomes_markup_of_its_own(hostile: str) -> None:
    """The elements of the answer are those that Markdown and formulas have, without scripts, events and pictures."""
    root = ET.fromstring(f"<body>{inline(hostile)}</body>")  # noqa: S314 - what is tested is that it is well formed
    elements = [element.tag.rpartition("}")[2] for element in root.iter()]
    assert not {"script", "img", "svg", "iframe"} & set(elements)
    for element in root.iter():
        assert not [name for name in element.attrib if name.startswith("on")]
        assert "javascript" not in element.attrib.get("href", "")


def test_an_unreadable_formula_is_shown_as_it_was_written() -> None:
    """The rest of the line keeps its emphasis, without a paragraph around it."""
    text = inline("This $\\frac{$ is *half* a formula.")
    assert '<code class="unread" title="This formula cannot be read">\\frac{</code>' in text
    assert text.endswith("is <em>half</em> a formula.")
