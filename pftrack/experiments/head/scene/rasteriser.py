"""Drawing a textured, lit mesh into a picture, hiding what is behind.

A depth buffer keeps, for every pixel, the inverse depth of what is nearest. Inverse depth is linear over the picture of
a flat triangle, and so are the model's coordinates divided by depth; dividing the one by the other gives the
coordinates themselves (perspective-correct interpolation), with which the albedo is looked up for every pixel. The mesh
may therefore be coarser than the texture. Light is computed at the vertices and interpolated alike.

Triangles that turn their back are left out, and nothing but the triangles' own pixels is touched.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled

__all__ = ["lit", "project", "rasterise"]


@compiled
def project(
    points_mm: NDArray[np.float64], focal_px: float, centre_px: tuple[float, float]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return pixels (n, 2) and inverse depths (n,) 1/mm of points (n, 3) in the camera's frame, in front of it."""
    count = points_mm.shape[0]
    pixels, inverse_depths = np.empty((count, 2)), np.empty(count)
    for n in range(count):
        inverse = 1.0 / points_mm[n, 2]
        pixels[n, 0] = focal_px * points_mm[n, 0] * inverse + centre_px[0]
        pixels[n, 1] = focal_px * points_mm[n, 1] * inverse + centre_px[1]
        inverse_depths[n] = inverse
    return pixels, inverse_depths


@compiled
def lit(
    normals: NDArray[np.float64], sun: NDArray[np.float64], ambient: float, lamp: float, sun_strength: float
) -> NDArray[np.float64]:
    """Return the light (n,) on a matt surface: ambient, from a lamp at the camera, and from the sun.

    Args:
        normals: (n, 3) unit vectors outwards, in the camera's frame.
        sun: (3,) unit vector towards the sun.
        ambient: Light from everywhere.
        lamp: Strength of the lamp.
        sun_strength: Strength of the sun.
    """
    light = np.empty(normals.shape[0])
    for n in range(light.shape[0]):
        facing = normals[n, 0] * sun[0] + normals[n, 1] * sun[1] + normals[n, 2] * sun[2]
        light[n] = ambient + lamp * max(-normals[n, 2], 0.0) + sun_strength * max(facing, 0.0)
    return light


@compiled
def rasterise(
    image: NDArray[np.float32],
    inverse_depth: NDArray[np.float32],
    triangles: NDArray[np.int32],
    pixels: NDArray[np.float64],
    inverse_depths: NDArray[np.float64],
    vertices_mm: NDArray[np.float64],
    light: NDArray[np.float64],
    texture: NDArray[np.float32],
    texture_frame: tuple[float, float, float],
    back: tuple[float, float],
) -> None:
    """Draw a mesh, in place.

    Args:
        image: (height, width) grey values; where the mesh is seen they become 255 albedo light.
        inverse_depth: (height, width) 1/mm, 0 where there is nothing.
        triangles: (m, 3), clockwise in the picture if they face the camera.
        pixels: (n, 2) vertices in the picture.
        inverse_depths: (n,) of the vertices, 1/mm.
        vertices_mm: (n, 3) in the model's frame.
        light: (n,) on the vertices.
        texture: (rows, columns) albedo over the model's x and y.
        texture_frame: x of the first column and y of the first row, mm, and the width of a texel, mm.
        back: The model's z from which on the surface is hair, mm, and the hair's albedo.
    """
    height, width = image.shape
    rows, columns = texture.shape
    left, top, step = texture_frame
    hair_z, hair = back
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = pixels[a, 0], pixels[a, 1]
        bx, by = pixels[b, 0] - ax, pixels[b, 1] - ay
        cx, cy = pixels[c, 0] - ax, pixels[c, 1] - ay
        area = bx * cy - by * cx
        if not area > 0.0:
            continue
        first_row = max(int(np.ceil(ay + min(0.0, by, cy))), 0)
        last_row = min(int(np.floor(ay + max(0.0, by, cy))), height - 1)
        first_column = max(int(np.ceil(ax + min(0.0, bx, cx))), 0)
        last_column = min(int(np.floor(ax + max(0.0, bx, cx))), width - 1)
        if first_row > last_row or first_column > last_column:
            continue
        scale = 1.0 / area
        ia, ib, ic = inverse_depths[a], inverse_depths[b], inverse_depths[c]
        for row in range(first_row, last_row + 1):
            py = row - ay
            for column in range(first_column, last_column + 1):
                px = column - ax
                second = (px * cy - py * cx) * scale
                third = (bx * py - by * px) * scale
                if second < 0.0 or third < 0.0 or second + third > 1.0:
                    continue
                wa, wb, wc = (1.0 - second - third) * ia, second * ib, third * ic
                inverse = wa + wb + wc
                if inverse <= inverse_depth[row, column]:
                    continue
                inverse_depth[row, column] = inverse
                depth = 1.0 / inverse
                wa, wb, wc = wa * depth, wb * depth, wc * depth
                u = (wa * vertices_mm[a, 0] + wb * vertices_mm[b, 0] + wc * vertices_mm[c, 0] - left) / step
                v = (wa * vertices_mm[a, 1] + wb * vertices_mm[b, 1] + wc * vertices_mm[c, 1] - top) / step
                z = wa * vertices_mm[a, 2] + wb * vertices_mm[b, 2] + wc * vertices_mm[c, 2]
                u, v = min(max(u, 0.0), columns - 1.001), min(max(v, 0.0), rows - 1.001)
                i, j = int(v), int(u)
                du, dv = u - j, v - i
                upper = (1.0 - du) * texture[i, j] + du * texture[i, j + 1]
                lower = (1.0 - du) * texture[i + 1, j] + du * texture[i + 1, j + 1]
                albedo = (1.0 - dv) * upper + dv * lower
                share = min(max((z - hair_z) / 4.0 + 0.5, 0.0), 1.0)
                albedo += share * (hair - albedo)
                image[row, column] = 255.0 * albedo * (wa * light[a] + wb * light[b] + wc * light[c])
