"""Figures: the plots that an experiment declares (`pftrack.model.plot`), of a run, at the size of a printed page.

They show what a session's page shows and read the same declarations: `sheet` puts panels below each other over one axis
of frames, `kinds` draws one kind of plot each, of the arrays that `numbers` takes from a run's rows, and `picture`
makes files of them. A new kind of plot is a function in `kinds` and a line in its table. matplotlib draws them, without
pyplot, so that nothing is kept behind.
"""

from pftrack.figures.sheet import drawable, figure_of, picture_of

__all__ = ["drawable", "figure_of", "picture_of"]
