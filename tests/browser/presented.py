"""What keeps a presented page from being read at once, from the last row: what scrolls, is cut, or is too small."""

from typing import Any

__all__ = ["LEAST_PX", "faults", "places"]

LEAST_PX = 16
"""Of letters at 720 lines."""

FAULTS = """(least) => {
    const found = new Set();
    const named = (it) => `${it.tagName}.${it.className} "${it.textContent.trim().slice(0, 40)}"`;
    const over = (it) => [it.scrollWidth - it.clientWidth > 1, it.scrollHeight - it.clientHeight > 1];
    const hides = (it, what = /hidden|clip/) => what.test(getComputedStyle(it).overflow);
    const around = (it) => it && it !== document.body ? [it, ...around(it.parentElement)] : [];
    const isApart = (one, other) => one.left >= other.right - 1 || one.right <= other.left + 1
        || one.top >= other.bottom - 1 || one.bottom <= other.top + 1;
    const root = document.documentElement;
    const screen = { left: 0, top: 0, right: innerWidth, bottom: innerHeight };
    const scrolls = /auto|scroll/;
    if (over(root).some(Boolean)) found.add('the page scrolls');
    for (const it of document.querySelectorAll('body *')) {
        if (!it.checkVisibility({ visibilityProperty: true, opacityProperty: true })) continue;
        if (it.closest('.visually-hidden, math, .figure-letter')) continue;
        const { display, fontSize, overflowX, overflowY, textOverflow, webkitLineClamp } = getComputedStyle(it);
        const [isWider, isHigher] = display === 'inline' || it.clientWidth < 2 ? [false, false] : over(it);
        const isMore = isWider && scrolls.test(overflowX) || isHigher && scrolls.test(overflowY);
        if (isMore) found.add(`scrolls ${named(it)}`);
        const isShort = isWider && textOverflow === 'ellipsis' || isHigher && webkitLineClamp !== 'none';
        const words = [...it.childNodes].filter((node) => node.nodeType === Node.TEXT_NODE && node.data.trim());
        for (const node of words) {
            const range = document.createRange();
            range.selectNodeContents(node);
            for (const box of range.getClientRects()) {
                const outer = around(it).map((other) => [other, other.getBoundingClientRect()]);
                if (box.width <= 1 || outer.some(([other, edge]) => hides(other) && isApart(box, edge))) continue;
                if (parseFloat(fontSize) < least) found.add(`of ${fontSize}: ${named(it)}`);
                if (isShort) found.add(`shortened: ${named(it)}`);
                const spare = box.height / 4; // above and below the letters
                for (const [other, edge] of [[root, screen], ...outer]) {
                    if (other !== root && !hides(other, /hidden|clip|auto|scroll/)) continue;
                    const isCut = box.left < edge.left - 1 || box.right > edge.right + 1
                        || box.top < edge.top - spare || box.bottom > edge.bottom + spare;
                    if (isCut) found.add(`cut by ${other.tagName}.${other.className}: ${named(it)}`);
                }
            }
        }
    }
    return [...found];
}"""

PARTS = "body, header, main, section, article, aside, footer, canvas"
PLACES = """(parts) => [...document.querySelectorAll(parts)]
    .filter((it) => it.checkVisibility({ visibilityProperty: true }) && !it.closest('.toasts, .figure-plot'))
    .map((it) => {
        const { left, top, width, height } = it.getBoundingClientRect();
        return [it.tagName, ...[left, top, width, height].map(Math.round)].join(' ');
    })"""


def faults(page: Any) -> list[str]:
    """Return what is wrong with the page as it stands."""
    return page.evaluate(FAULTS, LEAST_PX)


def places(page: Any) -> list[str]:
    """Return where the parts of the page stand, to be compared."""
    return page.evaluate(PLACES, PARTS)


def settled_places(page: Any) -> list[str]:
    """Return where they stand, once they have not moved for five frames of the display, which draw components."""
    found, same = places(page), 0
    while same < 5:
        page.evaluate("new Promise(requestAnimationFrame)")
        before, found = found, places(page)
        same = same + 1 if found == before else 0
    return found
