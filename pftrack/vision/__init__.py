"""Image processing that several experiments share: likelihoods, detection, shapes, structure from motion, rendering."""
