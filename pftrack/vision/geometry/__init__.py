"""Geometry: the shape of a face and a head.

`face` has eleven named points with their mean and their spread over people, a smooth surface through these points as a
mesh, and yaw, pitch and roll as people say them. Rotations are in `pftrack.core.geometry`, cameras in
`pftrack.core.numerics.matrices`.
"""
