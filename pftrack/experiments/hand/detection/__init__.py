"""Silhouettes, fingers and first poses of a hand in a picture."""
