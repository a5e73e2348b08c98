"""Tools for those who work on pftrack; nothing of it is installed."""
