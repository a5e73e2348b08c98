"""Arithmetic with the same bits on every processor: random numbers, sums, matrices, cameras, elementary functions."""
