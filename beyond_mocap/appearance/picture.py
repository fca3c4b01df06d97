"""A small picture of one pose: the light body on a transparent background, drawn with numpy alone.

Faces are filled from far to near at twice the size and averaged down. This needs no graphics card and gives the same
pixels on every machine. Also pictures in a grid, and PNG files.
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
    """Draw the shadow of the faces towards the sun, then the faces towards the camera, the farthest first.

    flat: (2 V, 2) pixels of the V vertices, then of their shadows.
    """
    corners = skin[quads]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal = unit_vectors(normal, min_length=1e-12)
    light = normal @ (_SUN / np.linalg.norm(_SUN))
    colour = (
        np.array([COLOURS[part] for part in MATERIALS])[material] * (0.55 + 0.45 * np.maximum(light, -0.5))[:, None]
    )
    lit = quads[light > 0.0] + len(skin)
    _fill_polygons(canvas, pixels[lit], np.tile(_SHADOW, (len(lit), 1)))
    visible = np.flatnonzero(normal @ to_camera > 0.0)
    visible = visible[np.argsort((corners[visible] @ to_camera).mean(axis=1))]
    _fill_polygons(canvas, pixels[quads[visible]], np.pad(colour[visible], ((0, 0), (0, 1)), constant_values=1.0))


def _fill_polygons(canvas: np.ndarray, corners: np.ndarray, colours: np.ndarray) -> None:
    """Fill convex polygons (F, 4, 2) pixels one after the other with colours (F, 4), which replace the pixels below."""
    low = np.clip(np.floor(corners.min(axis=1)).astype(int), 0, len(canvas))
    high = np.clip(np.ceil(corners.max(axis=1)).astype(int) + 1, 0, len(canvas))
    edges_along = np.roll(corners, -1, axis=1) - corners
    area = np.sum(corners[..., 0] * edges_along[..., 1] - corners[..., 1] * edges_along[..., 0], axis=1)
    # Orient all polygons the same way: a pixel is inside if it is on the inner side of every edge.
    edges_along = edges_along * np.where(area < 0.0, -1.0, 1.0)[:, None, None]
    ahead = edges_along[..., 0] * corners[..., 1] - edges_along[..., 1] * corners[..., 0]
    pixel = np.arange(len(canvas)) + 0.5
    for (x, y), (right, top), edges, offset, colour in zip(low.tolist(), high.tolist(), edges_along, ahead, colours):
        side = edges[:, :1, None] * pixel[None, y:top, None] - edges[:, 1:, None] * pixel[None, None, x:right]
        canvas[y:top, x:right][(side >= offset[:, None, None] - 1e-9).all(axis=0)] = colour


def _downsample(canvas: np.ndarray, size: int) -> np.ndarray:
    """Average four pixels to one, colours weighted by their alpha."""
    four = canvas.reshape(size, 2, size, 2, 4)
    alpha = four[..., 3:].mean(axis=(1, 3))
    colour = (four[..., :3] * four[..., 3:]).mean(axis=(1, 3)) / np.maximum(alpha, 1e-9)
    return np.concatenate([colour, alpha], axis=-1)
