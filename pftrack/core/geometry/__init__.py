"""Rotations and polygons.

The camera frame has X to the right, Y down and Z away from the camera, in millimetres; pixels count x to the right and
y down. Angles are radians.
"""
