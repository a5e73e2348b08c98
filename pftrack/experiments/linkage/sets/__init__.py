"""Set membership: what is possible, rather than what is probable (Shimada 1997, chapter 5).

Where noise and motion have hard bounds, the states that fit all that was seen are a set. It is followed as a few
*regions*, each an ellipsoid in a box of guides. Every step keeps every point that fits, so the truth is in one of them
as long as the bounds hold; the price is that the sets are larger than need be.

- `strips`: an ellipsoid cut by a strip, of least trace or volume;
- `prediction`: an ellipsoid after a bounded motion, and two constructions that lose the truth;
- `guides`: the box, shrunk by interval arithmetic and by the ellipsoid, and cutting it in turn;
- `regions`: the two together as one array, and how they are treated; `steps`: what is done to a region;
- `cells`: where a link can be that shows a given length, as cells of its direction, in the plane;
- `connected`: which cells belong together;
- `observation`: from cells to strips and guides, and to several regions where the cells fall apart;
- `polygons`: where a point can be that lies in several strips of the picture;
- `space_cells`, `space_observation`: the same in space, with cells of the attitude as well;
- `merging`: whether a region lies in another;
- `frame`: all of it for one frame, with merging, refutation and the rule for outliers.
"""
