"""Geometry: how solid things turn, and how a camera sees them.

The camera's frame has X to the right, Y down and Z away from the camera, in millimetres; pixels count x to the right
and y down. Angles are radians.

- `rotation`: R = R_Y R_X R_Z, its derivatives and its inverse; differences of angles;
- `camera`: the pinhole with its derivatives, and the affine camera;
- `gaze`: yaw, pitch and roll of a face, as people say them, from the angles of its rotation;
- `face_model`: eleven named points of a face, their mean and their spread over people;
- `head_surface`: a smooth head through these points, as a mesh;
- `fish_shape`: the outline of a fish from above that bends at the root of its tail, in pixels;
- `hand_model`: a hand of sixteen parts, its joints and its silhouette, in pixels;
- `polygons`: convex polygons on a grid of pixels, what they hold and how far they are.
"""

__all__ = ["camera", "face_model", "fish_shape", "gaze", "hand_model", "head_surface", "polygons", "rotation"]
