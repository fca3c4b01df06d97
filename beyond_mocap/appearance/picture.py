"""A small picture of one pose: the light body on a transparent background, drawn with numpy alone.

Faces are filled at twice the size, each pixel by what is nearest there, and averaged down. This needs no graphics card
and gives the same pixels on every machine. Also pictures in a grid, and PNG files.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np

from ..base.vectors import unit_vectors
from ..motion.humanoid import compute_heading_from_positions
from ..motion.motion import Motion, forward_kinematics, place_motion
from .body import build_body
from .mesh import MATERIALS, deform_body

COLOURS = {
    "skin": (0.75, 0.55, 0.43), "shirt": (0.78, 0.16, 0.14), "shorts": (0.92, 0.92, 0.90), "socks": (0.16, 0.24, 0.59),
    "boots": (0.12, 0.12, 0.13), "hair": (0.16, 0.11, 0.09), "trim": (0.92, 0.92, 0.90), "soles": (0.45, 0.50, 0.15),
    "eyes": (0.95, 0.95, 0.93), "pupils": (0.10, 0.07, 0.05), "gloves": (0.55, 0.60, 0.15),
}
_SUN = np.array([0.35, -0.45, 0.82])
_AZIMUTH, _TILT = np.radians(-50.0), np.radians(12.0)  # angle from the body's front to the camera; downward tilt
_MARGIN = 0.06  # share of the picture's side
_SHADOW = (0.0, 0.0, 0.0, 0.30)


def render_pose(motion: Motion, frame: int, size: int = 256) -> np.ndarray:
    """Render the body at one frame, seen from its front right, as large as fits.

    Args:
        motion: the motion.
        frame: the frame.
        size: pixels of the picture's side.
    Returns:
        (size, size, 4) RGBA, 0 to 1, lowest row first, straight alpha.
    Raises:
        InputError: if the skeleton has no legs.
    """
    pose = motion.frames(frame, frame + 1)
    pose = place_motion(pose, -float(compute_heading_from_positions(motion.skeleton, forward_kinematics(pose)[0])[0]))
    positions, rotations = forward_kinematics(pose)
    body = build_body(motion.skeleton, example=motion, light=True)
    skin = deform_body(body, motion.skeleton, positions, rotations)[0]
    across, up, to_camera = _build_camera()
    # The shadow: each vertex projected along the sun's direction to the height of the lowest one.
    shadow = skin - (skin[:, 2:] - skin[:, 2].min()) * (_SUN / _SUN[2])
    both = np.concatenate([skin, shadow])
    pixels = np.stack([both @ across, both @ up], axis=1)
    span = float(np.ptp(pixels, axis=0).max())
    canvas_size = 2 * size
    pixels = (pixels - pixels.min(axis=0) - 0.5 * np.ptp(pixels, axis=0)) * (canvas_size * (1.0 - 2.0 * _MARGIN)
                                                                             / span) + 0.5 * canvas_size
    quads = np.array([face if len(face) == 4 else (*face, face[-1]) for face in body.faces])
    canvas = np.zeros((canvas_size, canvas_size, 4))
    _draw_faces(canvas, skin, pixels, quads=quads, material=np.asarray(body.material), to_camera=to_camera)
    return _downsample(canvas, size)


def arrange_grid(pictures: list[np.ndarray], columns: int) -> np.ndarray:
    """Arrange pictures side by side, row below row, on white.

    Args:
        pictures: N of (H, W, C), of one size and type, the upper row first.
        columns: pictures in a row.
    Returns:
        (rows * H, columns * W, C).
    """
    height, width, channels = pictures[0].shape
    columns = min(columns, len(pictures))
    white = 255 if pictures[0].dtype == np.uint8 else 1
    sheet = np.full((-(-len(pictures) // columns) * height, columns * width, channels), white, pictures[0].dtype)
    for number, picture in enumerate(pictures):
        row, column = divmod(number, columns)
        sheet[row * height : (row + 1) * height, column * width : (column + 1) * width] = picture
    return sheet


def encode_png(pixels: np.ndarray) -> bytes:
    """Encode a picture as a PNG (ISO/IEC 15948): one chunk of rows without filter.

    Args:
        pixels: (H, W, 3) or (H, W, 4) uint8, the upper row first.
    Returns:
        The file's bytes.
    """
    high, wide, channels = pixels.shape
    head = struct.pack(">IIBBBBB", wide, high, 8, 2 if channels == 3 else 6, 0, 0, 0)
    rows = np.concatenate([np.zeros((high, 1), np.uint8), np.ascontiguousarray(pixels).reshape(high, -1)], axis=1)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(rows.tobytes(), 9)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )


def _build_camera() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Build the picture's right, its up, and the direction from the body to the camera: unit vectors (3,)."""
    away = np.array([np.cos(_AZIMUTH) * np.cos(_TILT), np.sin(_AZIMUTH) * np.cos(_TILT), np.sin(_TILT)])
    across = np.array([-np.sin(_AZIMUTH), np.cos(_AZIMUTH), 0.0])
    return across, np.cross(away, across), away


def _draw_faces(canvas, skin, pixels, quads, material, to_camera) -> None:
    """Draw the shadow of the faces towards the sun, then the faces towards the camera.

    pixels: (2 V, 2) of the V vertices, then of their shadows.
    """
    corners = skin[quads]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal = unit_vectors(normal, min_length=1e-12)
    light = normal @ (_SUN / np.linalg.norm(_SUN))
    colour = (
        np.array([COLOURS[part] for part in MATERIALS])[material] * (0.55 + 0.45 * np.maximum(light, -0.5))[:, None]
    )
    lit = quads[light > 0.0] + len(skin)
    nothing = np.full(canvas.shape[:2], -np.inf)
    fill_faces(canvas, nothing.copy(), pixels[lit], np.zeros(lit.shape), np.tile(_SHADOW, (len(lit), 1)))
    opaque = np.pad(colour, ((0, 0), (0, 1)), constant_values=1.0)
    fill_faces(canvas, nothing, pixels[quads], corners @ to_camera, opaque)


def fill_faces(canvas: np.ndarray, drawn: np.ndarray, corners: np.ndarray, nearness: np.ndarray,
               colours: np.ndarray) -> None:
    """Fill convex faces, where they are nearer than what is drawn.

    Args:
        canvas: (H, W, C) colours, changed in place.
        drawn: (H, W) nearness of what is drawn there, -inf for nothing; changed in place.
        corners: (F, 4, 2) pixels, x before y.
        nearness: (F, 4) of the corners: any measure that grows towards the camera and is linear across a flat face in
            the picture (minus the distance of a parallel projection, one over the distance of a perspective).
        colours: (F, C).
    """
    size = np.array(canvas.shape[1::-1])
    low = np.clip(np.floor(corners.min(axis=1)).astype(int), 0, size)
    wide = (np.clip(np.ceil(corners.max(axis=1)).astype(int) + 1, 0, size) - low).max(axis=1)
    found = []
    for edge in np.unique(2 ** np.ceil(np.log2(np.maximum(wide, 1))).astype(int)):
        faces = np.flatnonzero((wide <= edge) & (2 * wide > edge))
        found.append(_list_pixels(faces, low[faces], edge=int(edge), corners=corners[faces], nearness=nearness[faces],
                                  size=size))
    if not found:
        return
    place, near, face = (np.concatenate(part) for part in zip(*found))
    ahead = near > drawn.reshape(-1)[place]
    order = np.flatnonzero(ahead)[np.argsort(near[ahead], kind="stable")]  # of several values at a place the last stays
    drawn.reshape(-1)[place[order]] = near[order]
    canvas.reshape(-1, canvas.shape[2])[place[order]] = colours[face[order]]


def _list_pixels(faces, low, *, edge: int, corners, nearness, size) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """List the pixels of faces within squares of `edge` pixels from `low` on: place in the picture, nearness, face."""
    x, y = (low[:, axis, None] + np.arange(edge) for axis in (0, 1))
    along = np.roll(corners, -1, axis=1) - corners
    area = np.sum(corners[..., 0] * along[..., 1] - corners[..., 1] * along[..., 0], axis=1)
    # Orient all polygons the same way: a pixel is inside if it is on the inner side of every edge.
    along = along * np.where(area < 0.0, -1.0, 1.0)[:, None, None]
    inside = (x < size[0])[:, None, :] & (y < size[1])[:, :, None]
    for i in range(4):
        start, side = corners[:, i], along[:, i]
        right, up = (x + 0.5 - start[:, :1]) * side[:, 1:], (y + 0.5 - start[:, 1:]) * side[:, :1]
        inside &= up[:, :, None] - right[:, None, :] >= -1e-9
    face, row, column = np.nonzero(inside)
    slope, middle = _measure_slopes(corners, nearness), corners.mean(axis=1)
    x, y = x[face, column], y[face, row]
    near = nearness.mean(axis=1)[face] + slope[face, 0] * (x + 0.5 - middle[face, 0]) + slope[face, 1] * (
        y + 0.5 - middle[face, 1])
    return y * size[0] + x, np.clip(near, nearness.min(axis=1)[face], nearness.max(axis=1)[face]), faces[face]


def _measure_slopes(corners: np.ndarray, nearness: np.ndarray) -> np.ndarray:
    """Measure how nearness (F, 4) changes per pixel across faces of corners (F, 4, 2), from their diagonals (F, 2)."""
    diagonal, rise = corners[:, 2:] - corners[:, :2], nearness[:, 2:] - nearness[:, :2]
    area = diagonal[:, 0, 0] * diagonal[:, 1, 1] - diagonal[:, 0, 1] * diagonal[:, 1, 0]
    along = rise[:, 0] * diagonal[:, 1, 1] - rise[:, 1] * diagonal[:, 0, 1]
    aside = rise[:, 1] * diagonal[:, 0, 0] - rise[:, 0] * diagonal[:, 1, 0]
    flat = np.abs(area) < 1e-6  # seen from the edge
    return np.where(flat[:, None], 0.0, np.stack([along, aside], axis=1) / np.where(flat, 1.0, area)[:, None])


def _downsample(canvas: np.ndarray, size: int) -> np.ndarray:
    """Average four pixels to one, colours weighted by their alpha."""
    four = canvas.reshape(size, 2, size, 2, 4)
    alpha = four[..., 3:].mean(axis=(1, 3))
    colour = (four[..., :3] * four[..., 3:]).mean(axis=(1, 3)) / np.maximum(alpha, 1e-9)
    return np.concatenate([colour, alpha], axis=-1)
