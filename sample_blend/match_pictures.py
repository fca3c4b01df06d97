"""Render the pictures of docs/how-to/make-a-match.md: the small match, from the stand and through a player's eyes.

    .venv/bin/python sample_blend/match_pictures.py [FOLDER]

Run it with Blender as a Python module; it takes about two minutes.
"""

from __future__ import annotations

import pathlib
import sys
import tempfile

import demo

OUT = demo.HERE.parent / "docs" / "pictures"
SPAN = (6.0, 12.0)  # seconds: a run with the ball, a cross, a header
STAND, EYES = 9.7, 9.35  # seconds of the two pictures
PLAYER = "home_10"  # the player of the second picture


def synthesize_match(bpy, folder: str) -> None:
    """Synthesize the match in an empty file."""
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = 30
    scene.beyond_mocap.library_folder = str(demo.HERE / "library")
    bpy.ops.beyond_mocap.read_match(filepath=str(demo.HERE / "match" / "small" / "small.dat"))
    match = scene.beyond_mocap_match
    match.start, match.end, match.folder = *SPAN, folder
    bpy.ops.beyond_mocap.make_match()


def render_second(bpy, second: float, path: pathlib.Path) -> None:
    """Render a second of the match's clock through the scene's camera."""
    scene, match = bpy.context.scene, bpy.context.scene.beyond_mocap_match
    scene.frame_set(round(match.shown_first + (second - match.shown_start) * 30.0))
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 64, False
    scene.render.resolution_x, scene.render.resolution_y = 960, 540
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def main() -> int:
    """Render both pictures."""
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else OUT
    _, unregister = demo.load_extension()
    import bpy

    with tempfile.TemporaryDirectory() as match_folder:
        synthesize_match(bpy, match_folder)
    bpy.ops.beyond_mocap.match_camera(which="STAND")
    render_second(bpy, STAND, folder / "match-stand.png")
    bpy.ops.beyond_mocap.match_camera(which="EYES", player=PLAYER)
    render_second(bpy, EYES, folder / "match-eyes.png")
    unregister()
    return 0


if __name__ == "__main__":
    sys.exit(main())
