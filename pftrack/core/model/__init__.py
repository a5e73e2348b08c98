"""What everything is declared and described with: parameters, series, measures, plots, drawings, marks, recipes.

Nothing here knows a filter, an experiment or a picture's file; the rest of the library builds on it.
"""
