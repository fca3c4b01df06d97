"""Preview movies and contact sheets: order, work in a process of its own, and the file, which is complete or absent."""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...beyond_mocap.appearance.picture import arrange_grid, encode_png
from ...beyond_mocap.base.errors import BeyondMocapError, InputError
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.files.atomic import atomic_path, check_disk
from ..core import channels
from ..core.measure import build_scene_clock
from ..match.command_process import run_process
from ..rigs.exporters import describe_failure
from . import render_child

SUBJECT = "the picture process"
_WIDTHS = 16, 16384  # pixels, least and most
STAMPS = ("date", "time", "render_time", "frame", "frame_range", "memory", "hostname", "camera", "lens", "scene",
          "marker", "filename", "sequencer_strip", "labels")


@dataclass(frozen=True, kw_only=True)
class PictureLook:
    """How pictures are rendered.

    Attributes:
        engine: Blender's name.
        height: pixels; the width follows the scene's shape.
        samples: per pixel.
    """

    engine: str
    height: int
    samples: int


@dataclass(frozen=True, kw_only=True)
class PictureOrder:
    """Everything that the process needs.

    Attributes:
        out: the file to write.
        folder: temporary folder with the copy of the file; the work removes it.
        command: that starts the process.
        columns: tiles in a row of a contact sheet; 0 for a movie.
        order: what `render_child` renders.
    """

    out: Path
    folder: Path
    command: tuple[str, ...]
    columns: int
    order: dict


def order_movie(scene: bpy.types.Scene, out: Path, look: PictureLook) -> PictureOrder:
    """Order a movie of the scene's frames, or of its preview range.

    Args:
        scene: the scene.
        out: the file, `.mp4`.
        look: how to render.
    Raises:
        InputError: if the scene has no camera or nothing moves, or the file cannot be written.
    """
    first, last = _find_range(scene)
    settings = [*_list_settings(scene, look), *render_child.MOVIE_OUTPUT, ("render.use_stamp", False),
                ("frame_start", first), ("frame_end", last)]
    return _build_order(scene, out, settings, columns=0)


def order_sheet(scene: bpy.types.Scene, out: Path, look: PictureLook, count: int, columns: int) -> PictureOrder:
    """Order a contact sheet: pictures at even times, each with its time in the corner.

    Args:
        scene: the scene.
        out: the file, `.png`.
        look: how to render.
        count: number of pictures.
        columns: pictures in a row.
    Raises:
        InputError: as for `order_movie`.
    """
    settings = [*_list_settings(scene, look), *render_child.PICTURE_OUTPUT, ("render.use_stamp", True),
                ("render.use_stamp_note", True), ("render.stamp_font_size", max(8, look.height // 14)),
                ("render.stamp_foreground", (1.0, 1.0, 1.0, 1.0)), ("render.stamp_background", (0.0, 0.0, 0.0, 0.5)),
                *((f"render.use_stamp_{name}", False) for name in STAMPS)]
    order = _build_order(scene, out, settings, columns)
    clock = build_scene_clock(scene)
    frames = np.unique(np.rint(np.linspace(*_find_range(scene), count)).astype(int)).tolist()
    order.order["tiles"] = [(frame, f"{clock.to_seconds(frame):.1f} s", str(order.folder / f"tile_{number:03}"))
                            for number, frame in enumerate(frames)]
    return order


def render_pictures(order: PictureOrder, progress: Callable[[float, str], None],
                    cancelled: Callable[[], bool]) -> Path:
    """Render an order in a process of its own, in any thread.

    Args:
        order: the order; its temporary folder is removed.
        progress: receives the share done and a text.
        cancelled: returns whether to stop.
    Returns:
        The file that was written.
    Raises:
        UserCancelledError: if it was cancelled; nothing is written.
        BeyondMocapError: if the process failed or the file cannot be written.
    """
    try:
        with atomic_path(order.out, order.out.suffix) as temporary:
            order.order["movie"] = "" if order.columns else str(temporary)
            (order.folder / "order.json").write_text(json.dumps(order.order), "utf-8")
            run_process(list(order.command), progress, cancelled, subject=SUBJECT)
            if order.columns:
                tiles = [np.load(f"{path}.npy") for _, _, path in order.order["tiles"]]
                temporary.write_bytes(encode_png(arrange_grid(tiles, order.columns)))
            elif not temporary.is_file():
                raise BeyondMocapError(f"{order.out}: no movie was written; this Blender may have no FFmpeg")
            check_disk(temporary)
    finally:
        shutil.rmtree(order.folder, ignore_errors=True)
    return order.out


def check_scene(scene: bpy.types.Scene) -> None:
    """Check that there is something to render and a camera; InputError with a way out otherwise."""
    if not any(_is_moving(thing) for thing in scene.objects if thing.type == "ARMATURE"):
        raise InputError(f"scene {scene.name}", "nothing moves", "a take, a match or a clip", "synthesize first",
                         fixes=(Fix("press", "beyond_mocap.synthesize"),))
    if scene.camera is None:
        raise InputError(f"scene {scene.name}", "no camera", "a camera", "add the stage, or a camera of your own",
                         fixes=(Fix("press", "beyond_mocap.add_stage"),))


def _is_moving(armature: bpy.types.Object) -> bool:
    data = armature.animation_data
    strips = data is not None and any(track.strips for track in data.nla_tracks)
    return strips or channels.find_playing_action(armature)[0] is not None


def _find_range(scene: bpy.types.Scene) -> tuple[int, int]:
    if scene.use_preview_range:
        return scene.frame_preview_start, scene.frame_preview_end
    return scene.frame_start, scene.frame_end


def _list_settings(scene: bpy.types.Scene, look: PictureLook) -> list[tuple]:
    """List the settings of size and engine."""
    render = scene.render
    width = look.height * render.resolution_x * render.pixel_aspect_x / (render.resolution_y * render.pixel_aspect_y)
    if not _WIDTHS[0] <= width <= _WIDTHS[1]:
        raise InputError(f"scene {scene.name}", f"pictures {width:.0f} pixels wide and {look.height} high",
                         f"a width of {_WIDTHS[0]} to {_WIDTHS[1]}", "change the height, or the scene's resolution")
    sizes = [("render.resolution_x", 2 * round(width / 2)), ("render.resolution_y", 2 * round(look.height / 2)),
             ("render.resolution_percentage", 100), ("render.use_border", False), ("render.use_sequencer", False),
             ("render.film_transparent", False), ("render.use_multiview", False), ("frame_step", 1),
             ("render.engine", look.engine)]
    samples = {"CYCLES": [("cycles.samples", look.samples), ("cycles.use_denoising", False), ("cycles.max_bounces", 3)],
               "BLENDER_WORKBENCH": [("display.shading.light", "STUDIO"), ("display.shading.color_type", "MATERIAL"),
                                     ("display.shading.show_shadows", True)]}
    return sizes + samples.get(look.engine, [("eevee.taa_render_samples", look.samples)])


def _build_order(scene: bpy.types.Scene, out: Path, settings: list[tuple], columns: int) -> PictureOrder:
    """Check scene and place, and write the copy of the file that the process renders."""
    check_scene(scene)
    if not os.access(out.parent, os.W_OK) or out.is_dir():
        raise InputError(out, "cannot be written", "a file in a folder that you can write to", "choose another place")
    folder = Path(tempfile.mkdtemp(prefix="beyond-mocap-"))
    copy = folder / "scene.blend"
    _save_copy(copy)
    order = {"file": str(copy), "scene": scene.name, "settings": settings, "movie": "", "tiles": [],
             "scripts": bpy.context.preferences.filepaths.use_scripts_auto_execute}
    return PictureOrder(out=out, folder=folder, columns=columns, order=order,
                        command=(*_find_program(), "--", str(folder / "order.json")))


def _save_copy(path: Path) -> None:
    """Save a copy of the file to its temporary folder, which is removed where that fails (InputError)."""
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=False)
    except RuntimeError as error:
        shutil.rmtree(path.parent, ignore_errors=True)
        raise InputError(path.parent.parent, f"a copy of the file cannot be written ({describe_failure(error)})",
                         "space in the folder for temporary files", "free some space") from None


def _find_program() -> tuple[str, ...]:
    """Find what runs `render_child`: this Blender without a window, or Python where Blender is a module."""
    if bpy.app.binary_path:
        return bpy.app.binary_path, "-b", "--factory-startup", "--python-exit-code", "2", "--python", _CHILD
    return sys.executable, _CHILD


_CHILD = str(Path(render_child.__file__).resolve())
