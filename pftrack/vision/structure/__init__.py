"""Structure: the shape of a rigid body from where its points were seen in many views (Bando 2007, ch. 4 section 5).

A camera that is far away maps a body linearly, so the positions of its points over all frames are a product of two
factors: motion, two rows a frame, and shape, three numbers a point. The members, from the plainest on:

- `factorization`: what is given, positions and the variances of their noise, where what was not seen has an infinite
  variance; how far a reconstruction is from the truth; and the factors by singular values, and the map that makes
  cameras of them;
- `variational`: the factors by variational Bayes, each position weighed by its own noise; of all frames, or frame by
  frame over a sliding window with forgetting;
- `recursive`: the project's own way frame by frame, the joint covariance of all points with each frame's pinhole
  integrated out, from a prior or from the first frames;
- `growing`: from the mean of other bodies to the body's own shape, as far as its predictions are better; and
  measurements that are silently wrong.

A view's camera is in `cameras`.
"""
