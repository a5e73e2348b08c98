"""Set membership: possible states rather than probable ones (Shimada 1997, chapter 5).

Where noise and motion have hard bounds, the states that fit all observations form a set. It is followed as a few
*regions*, each an ellipsoid in a box of guides. Every step keeps every point that fits, so the truth is in one of them
as long as the bounds hold; the price is that the sets are larger than need be.

- `ellipsoids`: ellipsoids that contain a cut and a motion, and the test of inclusion;
- `regions`: an ellipsoid and its guides, their mutual bounds, and one whole frame of a family of them;
- `cells`: the angles of a link that fit, the runs that they form, and their cuts of a region in the plane;
- `space`: the same in space, and the bounds of each link's image.
"""
