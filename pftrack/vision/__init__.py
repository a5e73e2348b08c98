"""What several experiments need of pictures: likelihoods, detection, shapes, structure from motion, rendering."""
