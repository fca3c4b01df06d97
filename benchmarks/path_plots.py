"""Pictures of rides: ways and footprints from above, stick figures from the side, bodies; small PNGs."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np

from beyond_mocap.evaluation import feet
from beyond_mocap.motion.body import deformed, low_poly_body
from beyond_mocap.motion.motion import Motion, at_frames, forward_kinematics, pose_kinematics

from benchmarks.places import ROOT

OLD, RIGID, NEW, PATH = "#b8322a", "#e08a00", "#20783c", "#222222"
"""The recording, as the paper's red; ridden rigidly; ridden and planted; the path."""

MOST_BYTES = 120_000
DPI = 100


def canvas(rows: int, columns: int, wide: float = 10.0, tall: float = 3.4, **more):
    """A figure of rows x columns axes, `wide` inches across and `tall` inches a row; axes (rows, columns)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(wide, tall * rows), dpi=DPI, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **more)


def saved(figure, file: Path) -> None:
    """Writes a figure as a PNG of few colours."""
    from PIL import Image

    data = io.BytesIO()
    figure.savefig(data, format="png")
    data.seek(0)
    image = Image.open(data).convert("RGB").quantize(96, dither=Image.Dither.NONE)
    image.save(file, optimize=True)
    print(f"  {file.name}: {image.width} x {image.height}, {file.stat().st_size / 1e3:.0f} kB")
    assert file.stat().st_size <= MOST_BYTES, f"{file}: {file.stat().st_size} bytes"


def shared(ax) -> bool:
    """Whether both axes are another's too: then their limits cannot change for one alone."""
    return len(ax.get_shared_x_axes().get_siblings(ax)) > 1 and len(ax.get_shared_y_axes().get_siblings(ax)) > 1


def from_above(ax, title: str, below: str = "") -> None:
    """Axes that look down: metres, the same to both sides."""
    ax.set_aspect("equal", adjustable="box" if shared(ax) else "datalim")
    ax.set_title(title, fontsize=9)
    ax.set_xlabel(below, fontsize=8)
    ax.tick_params(labelsize=7)
    ax.grid(True, linewidth=0.3)


def from_the_side(ax, top: float = 1.9) -> None:
    """Axes that look at bodies from the side; top: metres at least."""
    low, high = ax.get_ylim()
    ax.set_ylim(min(low, -0.1), max(high, top))
    ax.set_aspect("equal", adjustable="box" if shared(ax) else "datalim")
    ax.tick_params(labelsize=7)
    ax.grid(True, linewidth=0.3)


def way(ax, motion: Motion, colour: str, label: str, every: float = 0.5) -> None:
    """The pelvis from above, with a dot every `every` seconds."""
    root = motion.root_positions
    ax.plot(root[:, 0], root[:, 1], color=colour, linewidth=1.1, label=label)
    dots = root[:: max(round(every * motion.fps), 1)]
    ax.plot(dots[:, 0], dots[:, 1], ".", color=colour, markersize=5)


def curve(ax, path, label: str, colour: str = PATH, upto: float = 1.0) -> None:
    """A path from above."""
    low, high = path.domain
    line = path.at(np.linspace(low, low + upto * (high - low), 800))
    ax.plot(line[:, 0], line[:, 1], color=colour, linewidth=0.9, linestyle=(0, (4, 2)), label=label)


def footprints(ax, motion: Motion, standing: np.ndarray, colour: str, label: str, wide: float = 0.9) -> None:
    """Heel to toe of every standing foot, frame over frame: a foot that slides smears."""
    places = forward_kinematics(motion)[0][:, feet.foot_joints(motion.skeleton)]
    flat = standing.all(axis=2)
    step = max(round(motion.fps / 30.0), 1)
    for side in (0, 1):
        for frame in np.flatnonzero(flat[:, side])[::step]:
            heel, toe = places[frame, side, :, :2]
            ax.plot(*zip(heel, toe), color=colour, linewidth=wide, alpha=0.5)
    ax.plot([], [], color=colour, linewidth=1.5, label=label)


def sticks(ax, motion: Motion, frames: np.ndarray, colour: str, along=(1.0, 0.0), spread: float = 0.0) -> None:
    """Stick figures of some frames from the side: metres along `along` and up, each `spread` metres further on."""
    places, parents = forward_kinematics(motion)[0], motion.skeleton.parents
    for number, frame in enumerate(frames):
        flat = np.stack([places[frame, :, :2] @ np.asarray(along) + spread * number, places[frame, :, 2]], axis=1)
        for joint, parent in enumerate(parents):
            if parent > 0 or (parent == 0 and not np.allclose(flat[joint], flat[parent])):
                ax.plot(*flat[[joint, parent]].T, color=colour, linewidth=1.1, solid_capstyle="round")


def bodies(
    motion: Motion, frames: np.ndarray, side: float, size: int = 640, tilt: float = 0.55, wide: float | None = None
):
    """A picture (size, size, 3) of bodies at some frames; side: degrees from +x at which the camera stands."""
    sys.path.insert(0, str(ROOT / "sample_blend"))
    import look

    root, local = at_frames(motion, np.asarray(frames, dtype=float))
    body = low_poly_body(motion.skeleton, example=motion)
    skins = deformed(body, motion.skeleton, *pose_kinematics(motion.skeleton, root, local))
    middle = 0.5 * (root[:, :2].max(axis=0) + root[:, :2].min(axis=0))
    across = wide or max(1.2 * float(np.ptp(root[:, :2], axis=0).max()) + 1.4, 2.4)
    at = np.array([*middle, 0.7])
    away = np.array([np.cos(np.radians(side)), np.sin(np.radians(side)), tilt])
    view = look.View(at + 2.5 * across * away, at, 2 * size, across)
    return np.asarray(look.picture(view, skins, body, np.zeros((0, 3))).resize((size, size)))


def photo(ax, pixels: np.ndarray, title: str, below: str = "") -> None:
    """A picture in axes of its own."""
    ax.imshow(pixels)
    ax.set_xticks([])
    ax.set_yticks([])
    ax.set_title(title, fontsize=9)
    ax.set_xlabel(below, fontsize=8)


def legend(ax, **more) -> None:
    """A small legend."""
    ax.legend(fontsize=7, framealpha=0.85, handlelength=1.4, **more)
