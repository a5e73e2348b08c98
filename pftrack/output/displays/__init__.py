"""Displays: what a notebook shows of a run, a comparison or an explanation that a cell ends with.

They are HTML that needs nothing else, in the colours of whoever shows it, light or dark.
"""

from pftrack.output.displays.comparison import comparison_html
from pftrack.output.displays.explanation import explanation_html
from pftrack.output.displays.run import run_html, summary_lines

__all__ = ["comparison_html", "explanation_html", "run_html", "summary_lines"]
