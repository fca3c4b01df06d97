"""Operators of the stage: pitch, light, and cameras, also those for paths."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty

from ..beyond_mocap.base.errors import InputError
from ..scene.core import window
from ..scene.path_editing.settings import meant, riders
from ..scene.stage import path_cameras, stage
from .verb import NEEDS_NO_EDITING, Verb


class BEYOND_MOCAP_OT_add_stage(Verb, bpy.types.Operator):
    """Add a pitch with its lines, a sun and a camera that follows the players"""

    bl_idname = "beyond_mocap.add_stage"
    bl_label = "Add Pitch, Light and Camera"
    camera: BoolProperty(name="Camera", default=True, description="Add a camera and use it for rendering")

    def do(self, context):
        """Create the stage."""
        stage.create(context, self.camera)


class BEYOND_MOCAP_OT_path_cameras(Verb, bpy.types.Operator):
    """Add four cameras on all edited paths, or update those that you have not changed"""

    bl_idname = "beyond_mocap.path_cameras"
    bl_label = "Path Cameras"
    needs = (*NEEDS_NO_EDITING,  # Edit Mode has its own undo, which does not include cameras
             "Select an armature and press Edit Path first", lambda context: bool(riders(context.scene)))

    def do(self, context):
        """Collect all paths and place the cameras."""
        first = next(iter(meant(context)), None)
        kept = path_cameras.set_up(context.scene, path_cameras.route(context.scene, first))
        if kept:
            self.report({"INFO"}, f"kept with your changes: {', '.join(kept)}")


WHICH = (("NEXT", "Next", "Next camera; after the last one the free view, then the first"),
         ("ABOVE", "Above", "From above, like a map: X to the right, Y up"),
         ("SIDE", "Side", "From the side, with the path across the picture"),
         ("QUARTER", "Quarter", "From three quarters, slightly above"),
         ("BEHIND", "Behind", "From behind the body, following it"),
         ("FREE", "Free View", "Previous view and the scene's own camera"))
VIEW = ("view_perspective", "view_location", "view_rotation", "view_distance")  # looking through a camera changes these
_free: dict[int, tuple] = {}  # area pointer -> its VIEW before the first of these cameras


class BEYOND_MOCAP_OT_path_camera(Verb, bpy.types.Operator):
    """Look through the next path camera, or return to the free view after the last one"""

    bl_idname = "beyond_mocap.path_camera"
    bl_label = "Path Camera"
    which: EnumProperty(name="Which", items=WHICH, default="NEXT", description="The camera to look through")
    needs = "Press Path Cameras in the panel Path Editing first", lambda context: path_cameras.any_in(context.scene)

    @classmethod
    def description(cls, _context, properties):
        """Return what this button shows, with the key for the next camera."""
        told = next(item[2] for item in WHICH if item[0] == properties.which)
        return f"{told}.\nShift + J or Shift + Numpad 0: the next one"

    def do(self, context):
        """Make it the scene's camera, and look through it in the 3D view."""
        scene, area = context.scene, _view(context)
        kind = self.which if self.which != "NEXT" else _after(scene, area)
        if kind == "FREE":
            if area is not None and scene.camera is not None and scene.camera.get(path_cameras.MARK):
                _look_freely(area)
            path_cameras.give_back(scene)
            return
        camera = path_cameras.found(scene, kind)
        if camera is None:
            raise InputError("path cameras", f"no camera {path_cameras.NAMES[kind]}", "all four cameras",
                             "press Path Cameras in the panel Path Editing")
        if kind == "BEHIND" and riders(scene):
            path_cameras.follow(scene, path_cameras.route(scene, next(iter(meant(context)), None)))
        if area is not None:
            _look_through(area, scene.camera, camera)
        path_cameras.take(scene, camera)


def _view(context) -> bpy.types.Area | None:
    """Return the 3D view in which the key or button was pressed, or the largest; None without a window."""
    if bpy.app.background or context.window is None:
        return None
    if context.area is not None and context.area.type == "VIEW_3D":
        return context.area
    return window.largest_editor(context.window.screen, "VIEW_3D")


def _after(scene: bpy.types.Scene, area: bpy.types.Area | None) -> str:
    """Return the next camera kind; the free view is included where there is a view."""
    row = [kind for kind in path_cameras.KINDS if path_cameras.found(scene, kind)]
    looked = area is None or area.spaces.active.region_3d.view_perspective == "CAMERA"
    seen = scene.camera.get(path_cameras.MARK, "") if looked and scene.camera is not None else ""
    if area is not None:
        row.append("FREE")
    return row[(row.index(seen) + 1) % len(row)] if seen in row else row[0]


def _look_through(area: bpy.types.Area, before: bpy.types.Object | None, camera: bpy.types.Object) -> None:
    """Look through a camera in a 3D view, and store the view from before the first path camera."""
    space = area.spaces.active
    view = space.region_3d
    if view.view_perspective != "CAMERA" or before is None or not before.get(path_cameras.MARK):
        place, turn = view.view_location.copy(), view.view_rotation.copy()
        _free[area.as_pointer()] = view.view_perspective, place, turn, view.view_distance
    if space.use_local_camera:
        space.camera = camera
    view.view_perspective = "CAMERA"


def _look_freely(area: bpy.types.Area) -> None:
    """Restore the earlier view; where it is unknown, keep the camera's place."""
    view = area.spaces.active.region_3d
    if view.view_perspective != "CAMERA":
        return
    for name, value in zip(VIEW, _free.get(area.as_pointer(), ("PERSP",))):
        setattr(view, name, value)
