"""Render the copy of a file in a process of its own, so that Blender's window stays free.

    blender -b --factory-startup --python render_child.py -- ORDER.json
    python render_child.py -- ORDER.json          with Blender as a Python module

Progress goes to stderr as JSON lines. This file imports nothing of the extension, which that process does not have.
"""

from __future__ import annotations

import json
import os
import signal
import sys

import bpy

ERROR_PREFIX = "beyond-mocap: "
MOVIE_OUTPUT = (("render.image_settings.media_type", "VIDEO"), ("render.image_settings.file_format", "FFMPEG"),
                ("render.ffmpeg.format", "MPEG4"), ("render.ffmpeg.codec", "H264"),
                ("render.ffmpeg.constant_rate_factor", "HIGH"), ("render.use_file_extension", False))
PICTURE_OUTPUT = (("render.image_settings.media_type", "IMAGE"), ("render.image_settings.file_format", "PNG"),
                  ("render.use_file_extension", True))
"""Settings of a scene, in an order that each version of Blender takes; those before 5.0 have no media type."""


def apply_settings(scene: bpy.types.Scene, settings) -> None:
    """Apply settings to a scene; those that this version of Blender does not have are left out.

    Args:
        scene: the scene.
        settings: pairs of a data path below the scene and a value.
    """
    for path, value in settings:
        owner, _, name = path.rpartition(".")
        target = scene.path_resolve(owner) if owner else scene
        if hasattr(target, name):
            setattr(target, name, value)


def render_order(order: dict) -> None:
    """Render what an order names.

    Args:
        order: the copy of the file, its scene, settings, and either a movie or the tiles: (frame, text, file) each.
    """
    bpy.ops.wm.open_mainfile(filepath=order["file"], load_ui=False, use_scripts=order["scripts"])
    scene = bpy.data.scenes[order["scene"]]
    apply_settings(scene, order["settings"])
    _mute_file_outputs()
    if order["movie"]:
        _render_movie(scene, order["movie"])
    for number, tile in enumerate(order["tiles"]):
        _render_tile(scene, *tile)
        _write_progress((number + 1) / len(order["tiles"]), f"Picture {number + 1} of {len(order['tiles'])}")


def _mute_file_outputs() -> None:
    """Mute the compositor's nodes that write files: a preview must not replace what the user has rendered."""
    trees = [*bpy.data.node_groups, *(getattr(scene, "node_tree", None) for scene in bpy.data.scenes)]
    for node in [node for tree in trees if tree is not None for node in tree.nodes]:
        if node.bl_idname == "CompositorNodeOutputFile":
            node.mute = True


def _render_movie(scene: bpy.types.Scene, path: str) -> None:
    """Render the scene's frames to a movie."""
    first, last = scene.frame_start, scene.frame_end

    def report_frame(shown, *_):
        done = shown.frame_current - first + 1
        _write_progress(done / (last - first + 1), f"Frame {done} of {last - first + 1}")

    bpy.app.handlers.render_post.append(report_frame)
    scene.render.filepath = path
    bpy.ops.render.render(animation=True, scene=scene.name)


def _render_tile(scene: bpy.types.Scene, frame: int, text: str, path: str) -> None:
    """Render one frame with a text in its corner, and write its pixels (H, W, 4), the upper row first."""
    import numpy as np

    scene.frame_set(frame)
    scene.render.stamp_note_text, scene.render.filepath = text, path
    bpy.ops.render.render(write_still=True, scene=scene.name)
    image = bpy.data.images.load(f"{path}.png")
    pixels = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(image.size[1], image.size[0], image.channels)[::-1, :, :3]
    np.save(f"{path}.npy", np.rint(255.0 * np.clip(pixels, 0.0, 1.0)).astype(np.uint8))
    bpy.data.images.remove(image)


def _write_progress(fraction: float, text: str) -> None:
    print(json.dumps({"progress": fraction, "text": text}), file=sys.stderr, flush=True)


def _run() -> int:
    """Render the order on the command line; return the exit status, 2 with a line where that fails."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # ends at once, also within a frame
    with open(sys.argv[sys.argv.index("--") + 1], encoding="utf-8") as file:
        order = json.load(file)
    try:
        render_order(order)
    except Exception as error:
        print(f"{ERROR_PREFIX}{' '.join(str(error).split()).removeprefix('Error: ')}", file=sys.stderr, flush=True)
        return 2
    return 0


if __name__ == "__main__":
    os._exit(_run())  # Blender 4.5 as a module may wait forever for its own threads when it is cleaned up
