"""Figures in print, in one style: of runs, sweeps, reproductions, lessons and failures.

The others hand in what is to be drawn. Of a run that is the plots that its experiment declares
(`pftrack.core.model.series`): they show what a session's page shows and read the same declarations. `sheet` puts panels
below each other over one axis of frames and draws each kind of plot, from the arrays that `panels` takes from a run's
rows; a new kind of plot is a function there and a line in its table. `maps` draws heat maps, `panels`
finds places and draws curves and boxes over a few values, `comparison` draws errors of several runs. `style` has sizes,
letters and colours, and the figure of a failure beside its cure, and makes files.
"""
