"""The study of document 3: guided diffusion on a fish that bends."""
