"""What everything is declared and described with: parameters, series, measures, plots, drawings, marks, recipes.

Nothing here knows a filter, an experiment or a picture's file; every other room builds on it.
"""
