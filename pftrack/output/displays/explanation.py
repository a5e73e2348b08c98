"""An explanation in a notebook: why the target was lost, and what would have saved it, the best first."""

from html import escape
from typing import TYPE_CHECKING

from pftrack.analysis.counterfactuals.report import CAVEAT
from pftrack.output.displays.parts import box, row, table

if TYPE_CHECKING:
    from pftrack.analysis.counterfactuals import Report
    from pftrack.analysis.explanation import Explanation

__all__ = ["explanation_html"]

SHOWN = 12
"""Changes that are listed; all are in `Explanation.lines`."""


def explanation_html(explanation: "Explanation") -> str:
    """Return an explanation as HTML."""
    diagnosis, report = explanation.diagnosis, explanation.what_if
    signs = "".join(f"<li>{escape(sign.words)}</li>" for sign in diagnosis.signs)
    said = f"<div><p style='margin:4px 0'>{escape(diagnosis.sentence)}</p><ul>{signs}</ul></div>"
    untried = f"<p>{escape(explanation.untried)}</p>" if explanation.untried else ""
    return box("Why it was lost", said + (_what_if(report) if report else untried))


def _what_if(report: "Report") -> str:
    lines = report.best_first[: SHOWN + 1]
    rows = "".join(
        row(
            each.alternative.title,
            (
                _bar(each.share, each.interval),
                f"{each.holding} of {each.runs}",
                f"{each.step_ms:.2g} ms a step",
                escape(report.words(each)),
            ),
        )
        for each in lines
    )
    left = len(report.best_first) - len(lines)
    more = f" {left} further changes hold no more often." if left else ""
    return (
        f"<div><p style='margin:4px 0'>{escape(report.sentence)}</p>{table(rows)}"
        f"<p>{escape(f'{report.progress}{more} {report.correction} {CAVEAT}')}</p></div>"
    )


def _bar(share: float, interval: tuple[float, float]) -> str:
    """Return a share as a bar with its interval as a line, in the colour of the text around it."""
    low, high = (f"{120 * end:.1f}" for end in interval)
    return (
        f'<svg width="120" height="12" role="img" aria-label="{share:.0%}">'
        '<rect width="120" height="12" fill="currentColor" opacity=".12"/>'
        f'<rect width="{120 * share:.1f}" height="12" fill="currentColor" opacity=".45"/>'
        f'<path d="M{low} 6H{high}" stroke="currentColor" stroke-width="2"/></svg>'
    )
