"""Arithmetic whose bits are the same on every processor: random numbers, sums, matrices, elementary functions."""
