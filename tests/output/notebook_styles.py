"""The rules of notebooks for parts of an output, and the faults of displays under them."""

from typing import Any

__all__ = ["STYLES", "faults"]

CELLS = (
    "vertical-align: middle; padding: .5em; line-height: normal; white-space: normal; text-align: right; border: none"
)
STYLES = {
    "jupyterlab": f"""
        .output img, .output svg {{ max-width: 100%; height: auto }}
        .output table {{ color: #222; font-size: 13px; table-layout: fixed; margin: 0 auto 1em }}
        .output table {{ border-collapse: collapse }}
        .output :is(td, th, tr) {{ {CELLS} }}
        .output p {{ margin: 0 0 1em; text-align: left }}
        .output {{ font: 14px/1.7 sans-serif; overflow: auto; max-height: 100% }}""",
    "nbconvert-classic": f"""
        .output img, .output svg {{ max-width: 100%; height: auto }}
        .output img {{ display: block; margin-inline: auto }}
        .output * + img, .output * + p, .output * + table {{ margin-top: 1em }}
        .output table {{ color: black; font-size: 12px; table-layout: fixed; margin-inline: auto }}
        .output :is(td, th, tr) {{ {CELLS} }}
        .output {{ overflow-x: auto; padding: .4em; max-width: calc(100% - 14ex) }}""",
    "vscode": """
        img, svg { max-width: 100%; max-height: 100% }
        table { width: 100%; border-collapse: collapse }
        th, td { padding: 4px 8px; border: none !important }
        table, th, tr { text-align: left !important }
        .output > * { overflow-x: scroll }""",
}
"""Rules of JupyterLab 4 and of the template lab of nbconvert 7, of its classic one, and of Visual Studio Code."""

FAULTS = """(displays) => displays.flatMap((display) => {
    const within = (inner, outer) => inner.left >= outer.left - 1 && inner.top >= outer.top - 1
        && inner.right <= outer.right + 1 && inner.bottom <= outer.bottom + 1;
    const meet = (one, other) => one.left < other.right - 1 && other.left < one.right - 1
        && one.top < other.bottom - 1 && other.top < one.bottom - 1;
    const box = (it) => it.getBoundingClientRect();
    const found = display.scrollWidth > display.clientWidth ? ['wider than its place'] : [];
    for (const picture of display.querySelectorAll('img, svg')) {
        const { width, height } = box(picture);
        if (width < 40 || height < 20) found.push(`${picture.tagName} of ${width} x ${height}`);
        for (let it = picture.parentElement; it !== display.parentElement; it = it.parentElement)
            if (!within(box(picture), box(it))) found.push(`${picture.tagName} leaves ${it.tagName}`);
        for (const other of display.querySelectorAll('img, svg, p, td, figcaption'))
            if (other !== picture && !other.contains(picture) && meet(box(picture), box(other)))
                found.push(`${picture.tagName} lies on ${other.tagName} ${other.textContent}`);
    }
    return found;
})"""


def faults(page: Any) -> list[str]:
    """Return the faults of a page's displays: pictures that are cut, or that cover their neighbours."""
    displays = page.locator(".pftrack")
    assert displays.count() > 0
    found: list[str] = displays.evaluate_all(FAULTS)
    return found
