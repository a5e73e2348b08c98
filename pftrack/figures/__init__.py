"""Figures: the plots that an experiment declares (`pftrack.model.plot`), of a run, at the size of a printed page.

They show what a session's page shows and read the same declarations: `sheet` puts panels below each other over one axis
of frames, `kinds` draws one kind of plot each, of the arrays that `numbers` takes from a run's rows, and `picture`
makes files of them, in the `style` of all figures in print. A new kind of plot is a function in `kinds` and a line
in its table.
"""
