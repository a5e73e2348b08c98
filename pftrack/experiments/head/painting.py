"""The picture of a simulated driver: a textured, lit mesh, background and foreground, and the sensor.

A depth buffer keeps, for every pixel, the inverse depth of the nearest surface. Inverse depth is linear over the
picture of a flat triangle, and so are the model's coordinates divided by depth; dividing the one by the other gives the
coordinates themselves (perspective-correct interpolation), with which the albedo is looked up for every pixel. The mesh
may therefore be coarser than the texture. Light is computed at the vertices and interpolated alike. Triangles that turn
their back are left out, and nothing but the triangles' own pixels is touched.
"""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponential, power
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.vision.face import FaceModel, HeadMesh, vertex_normals


@compiled
def project(points_mm: Floats, focal_px: float, centre_px: tuple[float, float]) -> tuple[Floats, Floats]:
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
def lit(normals: Floats, sun: Floats, ambient: float, lamp: float, sun_strength: float) -> Floats:
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
    pixels: Floats,
    inverse_depths: Floats,
    vertices_mm: Floats,
    light: Floats,
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


# The albedo is that of a face in near-infrared light, as a frontal map over the model's x and y. Everything is painted
# from the eleven points of the person, on a skin of smooth noise. Skin is bright in near-infrared light and the iris
# grey, whatever their colour. The map has a resolution of 0.5 mm, and edges are soft, so the picture does not show
# steps.

STEP_MM = 0.5
LEFT_MM, TOP_MM = -80.0, -110.0
COLUMNS, ROWS = 321, 481

SKIN, SCLERA, IRIS, PUPIL, GLINT = 0.62, 0.80, 0.38, 0.08, 1.0
BROW, NOSTRIL, LIPS, MOUTH, HAIR, LASHES = 0.22, 0.12, 0.45, 0.15, 0.15, 0.14
IRIS_RADIUS_MM, PUPIL_RADIUS_MM = 5.8, 2.2
OPENING_UP_MM, OPENING_DOWN_MM = 5.5, 4.0
BROW_LENGTH_MM = 36.0

Map = Floats


def albedo(model: FaceModel, seed: int) -> NDArray[np.float32]:
    """Return the albedo (rows, columns), 0..1, at x = LEFT_MM + STEP_MM * column and y = TOP_MM + STEP_MM * row.

    Args:
        model: The person's face.
        seed: Seed of the skin's and the hair's fine structure.
    """
    x, y = np.meshgrid(LEFT_MM + STEP_MM * np.arange(COLUMNS), TOP_MM + STEP_MM * np.arange(ROWS))
    noise = [_smooth_noise(seed, draw, sd_mm) for draw, sd_mm in enumerate((10.0, 2.0, 0.6, 1.0))]
    face = SKIN + 0.02 * noise[0] + 0.012 * noise[1] + 0.01 * noise[2]
    face = _nose(face, x, y, model)
    face = _mouth(face, x, y, model)
    for side in "lr":
        face = _eye(face, x, y, model, side)
        face = _brow(face, x, y, model, side, noise[3])
    line = -72.0 + 0.011 * x**2 + 1.5 * noise[1]
    face = _mix(face, HAIR + 0.03 * noise[3], _below(y - line, 2.0))
    return np.clip(face, 0.03, 1.0).astype(np.float32)


def _eye(face: Map, x: Map, y: Map, model: FaceModel, side: str) -> Map:
    eye, inner, outer = (model[side + name][:2] for name in ("eye", "mc", "lc"))
    # Along the line of the corners, -1..1 inside the opening, and across it, downwards.
    middle, half = (inner + outer) / 2.0, (outer - inner) / 2.0
    length = float(np.hypot(*half))
    along = ((x - middle[0]) * half[0] + (y - middle[1]) * half[1]) / length**2
    across = ((y - middle[1]) * half[0] - (x - middle[0]) * half[1]) / length * np.sign(half[0])
    arc = np.sqrt(np.maximum(1.0 - along**2, 0.0))
    up, down = across + OPENING_UP_MM * arc, across - OPENING_DOWN_MM * arc
    reach = _below(np.abs(along) - 1.0, 0.08)
    fade = exponential(-_fourth(along / 1.15))
    face = face * (1.0 - 0.22 * exponential(-(((x - eye[0]) / 21.0) ** 2 + ((y - eye[1] + 4.0) / 12.0) ** 2) / 1.4))
    face = _mix(
        face, 0.42, 0.55 * fade * exponential(-(((across + 1.75 * OPENING_UP_MM * np.sqrt(fade) - 0.5) / 0.9) ** 2))
    )
    face = face + 0.05 * fade * exponential(-(((across + 1.35 * OPENING_UP_MM * np.sqrt(fade)) / 1.6) ** 2))
    opening = _below(-up, 0.6) * _below(down, 0.6) * reach
    away = np.hypot(x - eye[0], y - eye[1])
    ball = SCLERA - 0.16 * np.abs(along) * along**2 - 0.25 * exponential(-((up / 2.2) ** 2))
    ball = _mix(ball, IRIS + 0.04 * np.sin(0.9 * away), _below(away - IRIS_RADIUS_MM, 0.5))
    ball = _mix(ball, IRIS - 0.12, 0.7 * exponential(-(((away - IRIS_RADIUS_MM + 0.4) / 0.5) ** 2)))
    ball = _mix(ball, PUPIL, _below(away - PUPIL_RADIUS_MM, 0.4))
    ball = _mix(ball, GLINT, _below(np.hypot(x - eye[0] - 2.0, y - eye[1] + 2.0) - 0.8, 0.5))
    face = _mix(face, ball, opening)
    face = _mix(face, LASHES, 0.9 * reach * exponential(-(((up + 0.3) / 1.0) ** 2)))
    face = _mix(face, 0.35, 0.5 * reach * exponential(-((down / 0.6) ** 2)))
    return _mix(face, 0.5, 0.5 * _below(np.hypot(x - inner[0], y - inner[1]) - 1.2, 0.8))


def _brow(face: Map, x: Map, y: Map, model: FaceModel, side: str, grain: Map) -> Map:
    start = model[side + "bro"]
    along = (x - start[0]) * np.sign(start[0]) / BROW_LENGTH_MM
    inside = np.clip(along, 0.0, 1.0)
    arch = start[1] - 5.5 * np.sin(np.pi * power(inside, 0.8)) * (1.0 - 0.35 * inside) + 1.5 * inside
    thickness = (4.2 - 3.0 * inside * np.sqrt(inside)) * np.sqrt(np.clip(along / 0.06 + 1.0, 0.0, 1.0))
    cover = _below(np.abs(y - arch) - thickness, 1.2) * _below(-along * BROW_LENGTH_MM, 0.8)
    return _mix(face, BROW + 0.04 * grain, 0.92 * cover * _below((along - 1.0) * BROW_LENGTH_MM, 1.5))


def _nose(face: Map, x: Map, y: Map, model: FaceModel) -> Map:
    tip_x, tip_y = model["nose"][:2]
    x = x - tip_x
    face = face + 0.05 * exponential(-(((x / 4.0) ** 2 + ((y - tip_y + 2.0) / 5.0) ** 2) / 2.0))
    beside = np.abs(x)
    # The wings of the nose end in a crease, from which a fold runs down beside the mouth.
    crease = np.abs(np.hypot((beside - 9.0) / 1.0, y - tip_y - 3.5) - 7.0)
    outer = _below(9.5 - beside, 1.5) * _below(np.abs(y - tip_y - 4.0) - 6.5, 1.5)
    face = _mix(face, 0.34, 0.6 * outer * exponential(-((crease / 1.1) ** 2)))
    fold = beside - 17.0 - 0.42 * (y - tip_y - 4.0)
    along = _below(tip_y + 6.0 - y, 3.0) * _below(y - tip_y - 24.0, 5.0)
    face = face - 0.05 * along * exponential(-((fold / 1.8) ** 2))
    under = exponential(-_fourth(x / 9.0)) * exponential(-(((y - tip_y - 10.5) / 2.4) ** 2))
    face = face * (1.0 - 0.28 * under)
    nostril = np.hypot((beside - 7.0) / 3.6, (y - tip_y - 9.0 + 0.25 * (beside - 7.0)) / 2.0)
    return _mix(face, NOSTRIL, _below(nostril - 1.0, 0.35))


def _mouth(face: Map, x: Map, y: Map, model: FaceModel) -> Map:
    left, right = model["lmou"], model["rmou"]
    half = (left[0] - right[0]) / 2.0
    along = (x - (left[0] + right[0]) / 2.0) / half
    base = (left[1] + right[1]) / 2.0 + along * (left[1] - right[1]) / 2.0
    arc = np.maximum(1.0 - along**2, 0.0)
    line = base + 0.8 * arc * np.cos(2.2 * np.pi * along)
    upper = line - power(arc, 0.8) * (6.5 - 1.8 * exponential(-((along / 0.13) ** 2)))
    lower = line + power(arc, 0.7) * 8.5
    inside = _below(np.abs(along) - 1.0, 0.03)
    face = face * (1.0 - 0.12 * exponential(-_fourth(along / 0.7) - ((y - lower - 3.0) / 3.5) ** 2))
    lips = _below(upper - y, 0.9) * _below(y - lower, 0.9) * inside
    shade = LIPS + 0.06 * exponential(-(((y - line - 4.0) / 2.5) ** 2)) - 0.04 * _below(y - line, 0.8)
    face = _mix(face, shade, 0.9 * lips)
    width = 0.6 + 0.3 * arc
    face = _mix(face, MOUTH, _below(np.abs(y - line) - width, 0.5) * _below(np.abs(along) - 1.02, 0.03))
    for corner in (left, right):
        face = face * (1.0 - 0.3 * exponential(-((np.hypot(x - corner[0], y - corner[1]) / 2.2) ** 2)))
    return face


def _smooth_noise(seed: int, draw: int, sd_mm: float) -> Map:
    """Return noise of unit variance that is smooth over a distance, (rows, columns)."""
    white = Stream(seed, draw, Purpose.START).standard_normal((ROWS, COLUMNS))
    smooth = cv2.GaussianBlur(white, (0, 0), sd_mm / STEP_MM, borderType=cv2.BORDER_REFLECT)
    unit: Map = (smooth - smooth.mean()) / smooth.std()
    return unit


def _fourth(value: Map) -> Map:
    square: Map = value * value
    return square * square


def _below(value: Map, softness: float) -> Map:
    """Return 1 where a value is below 0, 0 where it is above, and a soft step between."""
    step = np.clip(0.5 - value / (2.0 * softness), 0.0, 1.0)
    soft: Map = step * step * (3.0 - 2.0 * step)
    return soft


def _mix(under: Map, over: Map | float, share: Map) -> Map:
    mixed: Map = under + (over - under) * share
    return mixed


# The reference scene has smooth noise around grey 45 with blurred rectangles, a dim car out of focus. Neck and
# shoulders are an addition: without them the head hangs in the air. They stand still, since the head turns about a
# point in the neck.

GREY, NECK, CLOTHES = 45.0, 62.0, 26.0
WIDTH, HEIGHT = 640, 480


@lru_cache(maxsize=4)
def background(seed: int, width: int) -> NDArray[np.float32]:
    """Return the background (3/4 width, width) in grey levels, read-only.

    Args:
        seed: Seed of noise and rectangles.
        width: Width of the picture, px.
    """
    scene = np.full((HEIGHT, WIDTH), GREY)
    stream = Stream(seed, 1, Purpose.START)
    for across, down, wide, high, grey in stream.random((7, 5)):
        x, y = int(across * WIDTH), int(down * HEIGHT)
        cv2.rectangle(scene, (x, y), (x + 40 + int(160 * wide), y + 30 + int(140 * high)), GREY - 20 + 45 * grey, -1)
    scene = cv2.GaussianBlur(scene, (0, 0), 9.0)
    white = stream.standard_normal((HEIGHT // 8, WIDTH // 8))
    noise = cv2.resize(cv2.GaussianBlur(white, (0, 0), 3.0), (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)
    scene += 6.0 * noise / noise.std()
    scene = _body(np.asarray(scene, np.float64))
    size = (width, 3 * width // 4)
    small = cv2.resize(scene, size, interpolation=cv2.INTER_AREA if width < WIDTH else cv2.INTER_LINEAR)
    picture: NDArray[np.float32] = np.clip(small, 8.0, 255.0).astype(np.float32)
    picture.flags.writeable = False
    return picture


def _body(scene: Floats) -> Floats:
    """Paint neck and shoulders; they get darker away from the lamp's middle."""
    columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    beside = np.abs(columns - WIDTH / 2.0)
    shoulders = rows - (418.0 + 26.0 * _tanh(np.maximum(beside - 70.0, 0.0) / 90.0) + 0.0009 * beside**2)
    neck = np.maximum(beside - 84.0, 350.0 - rows)
    for distance, grey in ((neck, NECK - 0.0035 * beside**2), (shoulders, CLOTHES + 0.0 * beside)):
        share = np.clip(0.5 - distance / 6.0 if distance is neck else 0.5 + distance / 6.0, 0.0, 1.0)
        scene = scene + (grey - scene) * share
    return scene


def _tanh(values: Floats) -> Floats:
    """Return tanh x of values that are not negative."""
    shrunk = exponential(-2.0 * values)
    return (1.0 - shrunk) / (1.0 + shrunk)


# Hand and pillar are laid over the finished picture, each with a mask of what it hides. Sunglasses are part of the
# head: the surface bulges over the eyes into two lenses, and the texture is dark there, so they turn with it and hide
# the eyes from the side as well.

REFERENCE_WIDTH = 640
PILLAR_GREY = 30.0
LENS_HALF_MM = (26.0, 20.0)
LENS_ALBEDO, RIM_ALBEDO = 0.05, 0.12
LENS_FRONT_MM = -13.0
"""z of the lenses at the middle of the face; they bend back towards the temples."""


def cover(
    image: NDArray[np.float32], hidden: Bools, hand: float, pillar_width_px: float, pillar_offset_px: float
) -> None:
    """Lay hand and pillar over a picture, in place.

    Args:
        image: (height, width) grey values.
        hidden: (height, width), set where something is in front.
        hand: Height of the hand, from 0 to 1.
        pillar_width_px: Width of the pillar, and its distance to the right of the middle, px of a picture 640 px wide.
        pillar_offset_px: See there.
    """
    height, width = image.shape
    scale = width / REFERENCE_WIDTH
    if hand > 0:
        grey, share = _hand(width)
        top = round(height - hand * (height - 95.0 * scale))
        rows = min(height - top, len(grey))
        if rows > 0:
            part, ground = share[:rows], image[top : top + rows]
            ground += part * (grey[:rows] - ground)
            hidden[top : top + rows] |= part > 0.5
    if pillar_width_px > 0:
        middle, half = width / 2 + scale * pillar_offset_px, scale * pillar_width_px / 2
        first, last = (min(max(int(np.ceil(edge)), 0), width) for edge in (middle - half, middle + half))
        image[:, first:last] = (
            PILLAR_GREY + 14.0 * np.sin(np.linspace(0.0, np.pi, max(last - first, 1)))[: last - first]
        )
        hidden[:, first:last] = True


def with_lenses(mesh: HeadMesh, model: FaceModel) -> HeadMesh:
    """Return a head whose surface is lifted over the eyes to where the lenses of glasses are."""
    x, y, z = mesh.vertices_mm.T
    share = np.clip((1.0 - _lens_radius(x, y, model)) / 0.15 + 0.5, 0.0, 1.0)
    lens = LENS_FRONT_MM + 0.006 * x**2 + 0.002 * y**2
    lifted = np.where(z < 60.0, np.minimum(z, z + share * (lens - z)), z)
    vertices = np.stack([x, y, lifted], axis=1)
    return HeadMesh(vertices, mesh.triangles, vertex_normals(vertices, mesh.triangles))


def with_sunglasses(texture: NDArray[np.float32], model: FaceModel) -> NDArray[np.float32]:
    """Return a texture with dark lenses, rims, a bridge and temples; arguments as `albedo` has them."""
    rows, columns = texture.shape
    x, y = np.meshgrid(LEFT_MM + STEP_MM * np.arange(columns), TOP_MM + STEP_MM * np.arange(rows))
    radius = _lens_radius(x, y, model)
    top = float(model["leye"][1] + model["reye"][1]) / 2.0 - 6.0
    bars = np.abs(y - top) < np.where(np.abs(x) < 14.0, 2.0, np.where(np.abs(x) > 50.0, 2.5, 0.0))
    glass = LENS_ALBEDO + 0.05 * np.clip((top + 4.0 - y) / 16.0, 0.0, 1.0)
    dark = np.where(radius < 0.93, glass, RIM_ALBEDO)
    share = np.maximum(np.clip((1.08 - radius) / 0.04, 0.0, 1.0), bars)
    worn: NDArray[np.float32] = (texture + (dark - texture) * share).astype(np.float32)
    return worn


def _lens_radius(x: Floats, y: Floats, model: FaceModel) -> Floats:
    """Return the distance from the middle of the nearer lens, where 1 is its edge."""
    radii = []
    for side in "lr":
        eye = model[side + "eye"]
        u, v = (x - 1.04 * eye[0]) / LENS_HALF_MM[0], (y - eye[1] - 3.0) / LENS_HALF_MM[1]
        radii.append(power(power(np.abs(u), 2.6) + power(np.abs(v), 2.6), 1 / 2.6))
    nearer: Floats = np.minimum(*radii)
    return nearer


@lru_cache(maxsize=2)
def _hand(width: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return grey values and cover (rows, width) of a hand with its forearm, fingertips in the first rows."""
    columns, rows = np.meshgrid(np.arange(REFERENCE_WIDTH), np.arange(560))
    grey = np.full(columns.shape, 0.0)
    nearest = np.full(columns.shape, np.inf)
    # Ends and radius of each part, px at a width of 640: four fingers, thumb, palm, forearm.
    parts = (
        ((262, 62), (277, 210), 23), ((305, 30), (310, 205), 24), ((349, 40), (344, 205), 23),
        ((391, 80), (376, 215), 20), ((203, 190), (262, 285), 25), ((298, 250), (352, 250), 62),
        ((325, 290), (330, 330), 62), ((330, 330), (350, 600), 48),
    )  # fmt: skip
    for (ax, ay), (bx, by), radius in parts:
        along = ((columns - ax) * (bx - ax) + (rows - ay) * (by - ay)) / ((bx - ax) ** 2 + (by - ay) ** 2)
        inside = np.clip(along, 0.0, 1.0)
        away = np.hypot(columns - ax - inside * (bx - ax), rows - ay - inside * (by - ay)) / radius
        # A rounded part is brightest where it faces the lamp; where parts meet there is a crease.
        shade = 150.0 * (0.35 + 0.65 * np.sqrt(np.maximum(1.0 - away**2, 0.0)))
        deeper = radius * (away - 1.0)
        grey = np.where(away < 1.0, np.maximum(grey, shade), grey)
        nearest = np.minimum(nearest, deeper)
    share = np.clip(0.5 - nearest / 2.0, 0.0, 1.0)
    smooth = cv2.GaussianBlur(np.where(nearest < 0.0, grey, 60.0), (0, 0), 1.5)
    size = (width, round(len(grey) * width / REFERENCE_WIDTH))
    resized = [cv2.resize(part, size, interpolation=cv2.INTER_AREA) for part in (smooth, share)]
    return np.asarray(resized[0], np.float32), np.asarray(resized[1], np.float32)


REACH = 3.0
"""Reach of the blur, in its standard deviations."""


def blur(grey: NDArray[np.float32], sd_px: float) -> NDArray[np.float32]:
    """Return a picture (height, width) as a lens shows it that is out of focus by a Gaussian; beyond its edge it stays.

    Args:
        grey: (height, width) grey levels.
        sd_px: Standard deviation of the Gaussian, px; at 0 the picture itself comes back.
    """
    reach = int(np.ceil(REACH * sd_px))
    if reach < 1:
        return grey
    weights = exponential(-0.5 * np.square(np.arange(-reach, reach + 1) / sd_px))
    return _blur_rows(_blur_rows(grey, weights / weights.sum()), weights / weights.sum())


@compiled
def _blur_rows(grey: NDArray[np.float32], weights: Floats) -> NDArray[np.float32]:
    """Return a picture (height, width) blurred along its rows, transposed."""
    height, width = grey.shape
    reach = weights.shape[0] // 2
    blurred = np.empty((width, height), np.float32)
    sums = np.empty(width)
    for row in range(height):
        sums[:] = 0.0
        for k in range(weights.shape[0]):
            for column in range(width):
                sums[column] += weights[k] * grey[row, min(max(column + k - reach, 0), width - 1)]
        for column in range(width):
            blurred[column, row] = sums[column]
    return blurred


@compiled
def expose(grey: NDArray[np.float32], noise_sd: float, noise: Floats) -> NDArray[np.uint8]:
    """Return the picture (height, width, 3), its three channels alike.

    Args:
        grey: (height, width) grey levels.
        noise_sd: Standard deviation of the noise, grey levels.
        noise: (height width,) of unit variance; empty where there is none.
    """
    height, width = grey.shape
    image = np.empty((height, width, 3), np.uint8)
    for row in range(height):
        for column in range(width):
            level = grey[row, column]
            if noise_sd > 0.0:
                level += noise_sd * noise[row * width + column]
            rounded = np.uint8(min(max(level, 0.0), 255.0) + 0.5)
            for channel in range(3):
                image[row, column, channel] = rounded
    return image
