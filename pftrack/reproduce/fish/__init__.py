"""The study of Mitsugami et al. 2009: guided diffusion on a fish that bends."""
