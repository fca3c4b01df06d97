"""Draw a take without Blender: its character, shadow and ball, frame by frame, in one picture.

    python sample_blend/look.py TAKE.bvh --out sheet.png --ball ball.csv --provenance p.csv --from 8.5 --to 10 --every
    0.1

The lines on the grass are half a metre apart and do not move, so a sliding foot is visible; what is more than 1 cm
below the grass is drawn in magenta. `--camera follow` stays beside the player, `fixed` does not move and shows the
whole path, `strobe` puts all moments into one picture. Needs numpy and Pillow.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from beyond_mocap.appearance.body import build_body  # noqa: E402
from beyond_mocap.appearance.mesh import MATERIALS, deform_body  # noqa: E402
from beyond_mocap.appearance.picture import COLOURS as PART_COLOURS  # noqa: E402
from beyond_mocap.appearance.picture import fill_faces  # noqa: E402
from beyond_mocap.base.errors import InputError  # noqa: E402
from beyond_mocap.base.vectors import unit_vectors  # noqa: E402
from beyond_mocap.files.atomic import atomic_path  # noqa: E402
from beyond_mocap.files.bvh import bvh  # noqa: E402
from beyond_mocap.files.tables import read_ball  # noqa: E402
from beyond_mocap.motion.motion import Motion, compute_pose, sample_frames  # noqa: E402
from beyond_mocap.synthesis.provenance import read_provenance  # noqa: E402

COLOURS = 255.0 * np.array([PART_COLOURS[part] for part in MATERIALS])
GRASS, LINE, SHADOW, SKY, BALL = (96, 140, 84), (134, 178, 118), (60, 92, 52), (200, 216, 232), (250, 250, 245)
BELOW = (255, 0, 255)
SUN = np.array([0.35, -0.45, 0.82])
BALL_RADIUS = 0.11


@dataclass(frozen=True)
class View:
    """A camera.

    Attributes:
        eye: (3,) m, where it is.
        at: (3,) m, where it looks.
        size: pixels of the square picture.
        wide: m across at that distance.
    """

    eye: np.ndarray
    at: np.ndarray
    size: int
    wide: float

    def __call__(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Project points.

        Args:
            points: (..., 3) m.
        Returns:
            Pixels (..., 2) and depth (...,) m.
        """
        ahead = self.at - self.eye
        far = np.linalg.norm(ahead)
        ahead = ahead / far
        right = np.cross(ahead, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        seen = (points - self.eye) @ np.stack([right, -np.cross(right, ahead), ahead], axis=1)
        depth = np.maximum(seen[..., 2], 0.05)
        return self.size * (0.5 + seen[..., :2] / depth[..., None] * far / self.wide), seen[..., 2]


def draw_picture(view: View, skins, body, balls):
    """Draw one picture (Pillow) of characters `skins` (N, V, 3) m and `balls` (N, 3) m, NaN rows for none."""
    from PIL import Image, ImageDraw

    image = Image.new("RGB", (view.size, view.size), GRASS)
    _draw_grid(ImageDraw.Draw(image), view)
    balls = np.asarray(balls, dtype=float).reshape(-1, 3)
    balls = balls[np.isfinite(balls).all(axis=1)]
    quads = np.array([face if len(face) == 4 else (*face, face[-1]) for face in body.faces])
    canvas = np.array(image)
    for skin in skins:
        flat = view(_cast_shadow(skin))[0][quads]
        fill_faces(canvas, np.full(canvas.shape[:2], -np.inf), flat, np.zeros(quads.shape),
                   np.tile(SHADOW, (len(quads), 1)))
    _draw_discs(canvas, np.full(canvas.shape[:2], -np.inf), view, _cast_shadow(balls), colour=SHADOW, flat=0.4)
    drawn = np.full(canvas.shape[:2], -np.inf)
    for skin in skins:
        flat, depth = view(skin)
        fill_faces(canvas, drawn, flat[quads], 1.0 / np.maximum(depth, 0.05)[quads], _light(skin[quads], body.material))
    _draw_discs(canvas, drawn, view, balls, colour=BALL, flat=1.0)
    return Image.fromarray(canvas)


def _light(corners, material) -> np.ndarray:
    """Return the colours (F, 3) of faces with corners (F, 4, 3) m in the sun."""
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    light = 0.5 + 0.5 * np.clip(unit_vectors(normal, min_length=1e-12) @ SUN, -0.4, 1.0)
    colour = (COLOURS[material] * light[:, None]).astype(int)
    colour[corners[..., 2].mean(axis=1) < -0.01] = BELOW
    return colour


def _cast_shadow(points: np.ndarray) -> np.ndarray:
    """Return where the sun casts the shadow of points (..., 3) on the ground."""
    return points - np.maximum(points[..., 2:], 0.0) * SUN / SUN[2] * [1.0, 1.0, 1.0]


def _draw_discs(canvas, drawn, view: View, centres, *, colour, flat: float) -> None:
    """Draw balls or their shadows, where they are nearer than what is drawn: an edge, and within it the colour."""
    around = np.radians(np.arange(0.0, 360.0, 15.0))
    for (x, y), depth in zip(*view(np.reshape(centres, (-1, 3)))):
        if depth <= 0.1:
            continue
        radius = view.size * BALL_RADIUS / depth * np.linalg.norm(view.at - view.eye) / view.wide
        edge = (90, 90, 90) if flat == 1.0 else colour
        for size, tone, nearer in ((radius, edge, 1.0), (max(radius - 1.5, 0.5 * radius), colour, 1.0 + 1e-6)):
            rim = np.stack([x + size * np.cos(around), y + flat * size * np.sin(around)], axis=1)
            fans = np.stack([np.broadcast_to([x, y], rim.shape), rim, np.roll(rim, -1, axis=0)], axis=1)
            fill_faces(canvas, drawn, fans[:, [0, 1, 2, 2]], np.full((len(fans), 4), nearer / depth),
                       np.tile(tone, (len(fans), 1)))


def _draw_grid(draw, view: View, step: float = 0.5) -> None:
    """Draw the sky, and lines on the grass around the camera's target; every second metre is brighter."""
    reach = min(3.0 * view.wide, 60.0)
    middle = np.round(view.at[:2] / step) * step
    for axis in (0, 1):
        for offset in np.arange(-reach, reach + step, step):
            ends = np.zeros((2, 3))
            ends[:, axis] = middle[axis] + offset
            ends[:, 1 - axis] = middle[1 - axis] + np.array([-reach, reach])
            points = ends[0] + np.linspace(0.0, 1.0, 60)[:, None] * (ends[1] - ends[0])
            flat, depth = view(points)
            bright = abs(ends[0, axis] / 2.0 - round(ends[0, axis] / 2.0)) < 1e-6
            row = [tuple(p) for p, far in zip(flat, depth) if far > 0.3]
            if len(row) > 1:
                draw.line(row, fill=(230, 240, 225) if bright else LINE, width=1)
    horizon = view(view.eye + 1e4 * (view.at - view.eye) * [1, 1, 0])[0][1]
    if horizon > 0:
        draw.rectangle([0, 0, view.size, horizon], fill=SKY)


def write_sheet(motion: Motion, frames, out, *, camera="follow", side=-90.0, ball=None, labels=None, columns=6,
                tile=220, wide=2.2):
    """Write the contact sheet of some frames.

    Args:
        motion: the motion.
        frames: (N,) frames.
        out: the PNG file.
        camera: "follow", "fixed" or "strobe".
        side: degrees from +x of the camera.
        ball: (N, 3) m, or None.
        labels: N texts, or None.
        columns: pictures in a row.
        tile: pixels of a picture.
        wide: m across a picture of the following camera.
    """
    from PIL import Image, ImageDraw

    frames = np.asarray(frames, dtype=float)
    body = build_body(motion.skeleton, example=motion, light=True)
    root, local = sample_frames(motion, frames)
    skins = deform_body(body, motion.skeleton, *compute_pose(motion.skeleton, root, local))
    balls = np.full((len(frames), 3), np.nan) if ball is None else np.asarray(ball, dtype=float)
    span = root[:, :2].max(axis=0) - root[:, :2].min(axis=0)
    whole = 0.5 * (root[:, :2].max(axis=0) + root[:, :2].min(axis=0))
    across = wide if camera == "follow" else max(float(span.max()) + 1.6, wide)
    if camera == "strobe":
        big = _build_view(whole, side, across, 5 * tile)
        draw_picture(big, skins, body, balls).save(out)
        return
    rows = -(-len(frames) // columns)
    page = Image.new("RGB", (min(columns, len(frames)) * tile, rows * tile))
    for i in range(len(frames)):
        view = _build_view(root[i, :2] if camera == "follow" else whole, side, across, 2 * tile)
        tile_picture = draw_picture(view, skins[i : i + 1], body, balls[i : i + 1]).resize((tile, tile),
                Image.Resampling.LANCZOS)
        if labels is not None:
            ImageDraw.Draw(tile_picture).text((4, 2), labels[i], fill=(0, 0, 0))
        page.paste(tile_picture, (i % columns * tile, i // columns * tile))
    page.save(out)


def _build_view(ground, side: float, wide: float, size: int) -> View:
    """Build the camera of a place on the ground."""
    at = np.array([*ground, 0.85 if wide < 4 else 0.5])
    direction = np.array([np.cos(np.radians(side)), np.sin(np.radians(side)), 0.0])
    return View(at + (2.5 * wide) * direction + [0.0, 0.0, 0.55 * wide], at, size, wide)


def main(arguments: list[str] | None = None) -> int:
    """Parse the command line and draw."""
    parser = argparse.ArgumentParser(description="A contact sheet of a take, without Blender.")
    parser.add_argument("take", help="BVH that synthesize wrote")
    parser.add_argument("--out", type=Path, required=True, help="PNG to write")
    parser.add_argument("--ball", help="its ball CSV")
    parser.add_argument("--provenance",
                        help="its provenance CSV: marks planted feet (L, R) and transitions (|) in the captions")
    parser.add_argument("--camera", choices=("follow", "fixed", "strobe"), default="follow")
    parser.add_argument("--side", type=float, default=-90.0, help="degrees from +x of the camera")
    parser.add_argument("--from", dest="start", type=float, default=0.0, help="seconds from the take's first frame")
    parser.add_argument("--to", dest="end", type=float, help="seconds from the take's first frame")
    parser.add_argument("--every", type=float, default=0.2, help="seconds between pictures; 0: every frame")
    parser.add_argument("--columns", type=int, default=6)
    parser.add_argument("--tile", type=int, default=220, help="pixels")
    parser.add_argument("--wide", type=float, default=2.2, help="metres across a tile of the following camera")
    options = parser.parse_args(arguments)
    try:
        write_requested_sheet(options)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def write_requested_sheet(options) -> None:
    """Read the files and write the sheet."""
    try:
        from PIL import Image
    except ImportError:
        raise InputError("look.py", "Pillow is not installed", "Pillow for the picture", "pip install pillow") from None
    ending = options.out.suffix.lower()
    if Image.registered_extensions().get(ending) not in Image.SAVE:
        raise InputError(options.out, f"file type {ending}" if ending else "no file type", "a picture, .png or .jpg",
                         "choose another file type")
    motion = bvh.read_bvh(options.take, unit=0.01).motion
    last = len(motion) - 1 if options.end is None else min(options.end * motion.fps, len(motion) - 1)
    step = max(options.every * motion.fps, 1.0)
    frames = np.unique(
        np.rint(np.arange(options.start * motion.fps, last + 0.5, step)).astype(int).clip(0, len(motion) - 1)
    )
    if not len(frames):
        raise InputError("--from", f"{options.start:g} s", f"before the take's end, {motion.duration:g} s")
    ball = read_ball(options.ball).positions if options.ball else None
    if ball is not None:
        ball = ball[np.minimum(frames, len(ball) - 1)]
    labels = [f"{frame / motion.fps:.2f}" for frame in frames]
    if options.provenance:
        provenance = read_provenance(options.provenance)
        marks = [("L" if l else ".") + ("R" if r else ".") for l, r in provenance.contacts[frames]]
        new = [f > 0 and (provenance.clip[f] != provenance.clip[f - 1]
                          or provenance.mirrored[f] != provenance.mirrored[f - 1]) for f in frames]
        labels = [f"{a} {m}{'|' if s else ''}" for a, m, s in zip(labels, marks, new)]
    with atomic_path(options.out, options.out.suffix) as part:
        write_sheet(motion, frames, part, camera=options.camera, side=options.side, ball=ball, labels=labels,
                    columns=options.columns, tile=options.tile, wide=options.wide)


if __name__ == "__main__":
    sys.exit(main())
