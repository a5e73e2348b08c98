"""The experiment on a fish that bends: wiring, recordings, what is drawn, and the worlds of what was learned."""
