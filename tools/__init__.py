"""Tools for developers of pftrack; they are not installed."""
