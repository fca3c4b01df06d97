"""Write quickstart.blend beside this file: a pitch, a camera, and settings for the sample, with paths relative to the
file.

    .venv-4.5/bin/python sample_blend/make_quickstart.py

Run it with Blender 4.5 as a Python module: newer Blenders open what that one writes, not the other way round.
"""

from __future__ import annotations

import os
import pathlib
import shutil
import sys
import tempfile

import demo

OUT = demo.HERE / "quickstart.blend"
HOW_TO = """Beyond Mocap: quickstart

In the 3D view press N and choose the tab "Beyond Mocap", then press from top to bottom:

  1  Build Library    reads the clips in the folder "library"
  3  Synthesize       finds clips for both players' tracks and labels, and shows the result as a preview
  4  Apply            keeps the result (Revert removes it)

Press Space to play.
The labels of both players are on their tracks: spans as strips and key moments as markers in the NLA editor.
Change them there, or move the playhead, press J in the 3D view and choose labels with the number keys;
then press Update in step 3.
"""


def relative_paths(settings) -> None:
    """Make the settings' paths relative, so that they stay valid when the folder is moved."""
    def from_here(path: str) -> str:
        return "//" + pathlib.Path(path).relative_to(demo.HERE).as_posix()

    settings.library_folder = from_here(settings.library_folder)
    for player in settings.players:
        player.tracking_file = from_here(player.tracking_file)
        player.annotation_file = from_here(player.annotation_file)
        player.dot.beyond_mocap_dot.tracking_file = player.tracking_file


def open_the_tab(bpy) -> None:
    """Open the sidebars and the camera view in all windows; file browsers get no personal folder."""
    spaces = [space for screen in bpy.data.screens for area in screen.areas for space in area.spaces]
    for space in spaces:
        if space.type == "VIEW_3D":
            space.show_region_ui = True
            like_a_pitch(space.shading, space.overlay)
            space.region_3d.view_perspective = "CAMERA"
            space.region_3d.view_camera_zoom, space.region_3d.view_camera_offset = 12.0, (0.08, 0.0)
        elif space.type == "FILE_BROWSER" and space.params is not None:
            space.params.directory = b"//"


def like_a_pitch(shading, overlay) -> None:
    """Set colours, shadows and a sky in the solid view, which every computer draws quickly."""
    shading.type, shading.light = "SOLID", "STUDIO"  # the light first: it decides which studio lights exist
    shading.color_type, shading.studio_light = "MATERIAL", "paint.sl"
    shading.show_shadows, shading.shadow_intensity, shading.show_object_outline = True, 0.4, False
    shading.background_type, shading.background_color = "VIEWPORT", (0.35, 0.50, 0.72)
    for name in ("floor", "axis_x", "axis_y", "cursor", "extras", "relationship_lines", "bones"):
        setattr(overlay, f"show_{name}", False)


def main() -> int:
    """Write the file."""
    _, switch_off = demo.load_extension()
    import bpy

    if bpy.app.version >= (5, 0, 0):
        print("run this with Blender 4.5, so that 4.5 can open the file it writes", file=sys.stderr)
        return 2
    demo.prepare(bpy)
    scene = bpy.context.scene
    scene.frame_end, scene.beyond_mocap.active_player = 1201, 0
    scene.camera.data.show_passepartout = False
    relative_paths(scene.beyond_mocap)
    bpy.data.texts.new("Read me").write(HOW_TO)
    open_the_tab(bpy)
    with tempfile.TemporaryDirectory() as folder:  # Blender stores the path in the file: save to a temporary one
        written = pathlib.Path(folder, OUT.name)
        bpy.ops.wm.save_as_mainfile(filepath=str(written), compress=True, relative_remap=False)
        shutil.move(written, OUT)
    switch_off()
    print(f"{OUT}: {os.path.getsize(OUT) / 1024:.0f} KB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
