"""Operators of the stage: pitch, light, and cameras, also those for paths."""

import bpy
from bpy.props import BoolProperty, EnumProperty

from ..beyond_mocap.base.errors import InputError
from ..scene.core import window
from ..scene.core.settings import find_active_player
from ..scene.path_editing.settings import list_edited_bodies, list_target_bodies
from ..scene.stage import cameras, eyes, lighting, path_cameras, stage
from ..scene.stage import cast as casting
from ..scene.stage.settings import VIEWS
from .operator_base import NEEDS_NO_EDITING, BaseOperator


class BEYOND_MOCAP_OT_add_stage(BaseOperator, bpy.types.Operator):
    """Add a pitch with goals, stands, light, sky and a camera that follows the players, or renew the ones there are"""

    bl_idname = "beyond_mocap.add_stage"
    bl_label = "Add Pitch, Light and Camera"
    camera: BoolProperty(name="Camera", default=True, description="Add a camera and use it for rendering")

    def do(self, context):
        """Create the stage, and let its cameras follow the bodies that the scene has."""
        scene = context.scene
        stage.create_stage(scene)
        cameras.update_cameras(scene)
        if self.camera and (scene.camera is None or not cameras.is_own(scene, scene.camera)):
            scene.camera = cameras.get_camera(scene, "FOLLOW")
        if not lighting.has_own_sky(scene):
            self.report({"INFO"}, f"the world {scene.world.name!r} is yours and stays as it is")


class BEYOND_MOCAP_OT_stage_view(BaseOperator, bpy.types.Operator):
    """Look through one of the stage's cameras, and render with it"""

    bl_idname = "beyond_mocap.stage_view"
    bl_label = "Stage View"
    view: EnumProperty(name="View", items=VIEWS, default="BROADCAST", description="The camera to look through")

    @classmethod
    def description(cls, _context, properties):
        """Return what this button shows."""
        return next(item[2] for item in VIEWS if item[0] == properties.view)

    def do(self, context):
        """Create the camera where it is missing, make it the scene's, and look through it in the 3D view."""
        scene = context.scene
        if self.view == "EYES":
            body = find_viewer(context)
            camera = eyes.create_eyes_camera(scene, body, casting.find_ball(scene))
        else:
            camera = cameras.get_camera(scene, self.view)
        scene.camera = camera
        window.look_through_camera(context)


def find_viewer(context) -> bpy.types.Object:
    """Find the moving body that is selected, else the active player's, else the first; InputError without any."""
    cast, active = casting.read_cast(context.scene), context.view_layer.objects.active
    if cast is None:
        raise InputError("Player's Eye", "no body moves in this scene", "a body with a motion", "synthesize one first")
    active = active.parent if active is not None and active.type == "MESH" else active
    player = find_active_player(context.scene.beyond_mocap)
    wanted = (active if active is not None and active.select_get() else None, player.body if player else None)
    return next((body for body in wanted if body in cast.bodies), cast.bodies[0])


class BEYOND_MOCAP_OT_path_cameras(BaseOperator, bpy.types.Operator):
    """Add four cameras on all edited paths, or update those that you have not changed"""

    bl_idname = "beyond_mocap.path_cameras"
    bl_label = "Path Cameras"
    needs = (*NEEDS_NO_EDITING,  # Edit Mode has its own undo, which does not include cameras
             "Select an armature and press Edit Path first", lambda context: bool(list_edited_bodies(context.scene)))

    def do(self, context):
        """Collect all paths and place the cameras."""
        first = next(iter(list_target_bodies(context)), None)
        changed = path_cameras.place_cameras(context.scene, path_cameras.collect_targets(context.scene, first))
        if changed:
            self.report({"INFO"}, f"kept with your changes: {', '.join(changed)}")


CAMERA_CHOICES = (("NEXT", "Next", "Next camera; after the last one the free view, then the first"),
                  ("ABOVE", "Above", "From above, like a map: X to the right, Y up"),
                  ("SIDE", "Side", "From the side, with the path across the picture"),
                  ("QUARTER", "Quarter", "From three quarters, slightly above"),
                  ("BEHIND", "Behind", "From behind the body, following it"),
                  ("FREE", "Free View", "Previous view and the scene's own camera"))
VIEW_PROPERTIES = ("view_perspective", "view_location", "view_rotation",
                   "view_distance")  # looking through a camera changes these
_earlier_views: dict[int, tuple] = {}  # area pointer -> its VIEW before the first of these cameras


class BEYOND_MOCAP_OT_path_camera(BaseOperator, bpy.types.Operator):
    """Look through the next path camera, or return to the free view after the last one"""

    bl_idname = "beyond_mocap.path_camera"
    bl_label = "Path Camera"
    which: EnumProperty(name="Which", items=CAMERA_CHOICES, default="NEXT", description="The camera to look through")
    needs = "Press Path Cameras in the panel Path Editing first", lambda context: path_cameras.has_cameras(
        context.scene)

    @classmethod
    def description(cls, _context, properties):
        """Return what this button shows, with the key for the next camera."""
        text = next(item[2] for item in CAMERA_CHOICES if item[0] == properties.which)
        return f"{text}.\nShift + J or Shift + Numpad 0: the next one"

    def do(self, context):
        """Make it the scene's camera, and look through it in the 3D view."""
        scene, area = context.scene, window.find_view(context)
        kind = self.which if self.which != "NEXT" else _find_next_kind(scene, area)
        if kind == "FREE":
            if area is not None and scene.camera is not None and scene.camera.get(path_cameras.MARK):
                _restore_view(area)
            path_cameras.restore_camera(scene)
            return
        camera = path_cameras.find_camera(scene, kind)
        if camera is None:
            raise InputError("path cameras", f"no camera {path_cameras.NAMES[kind]}", "all four cameras",
                             "press Path Cameras in the panel Path Editing")
        if kind == "BEHIND" and list_edited_bodies(scene):
            path_cameras.animate_focus(scene,
                                       path_cameras.collect_targets(scene,
                                                                    next(iter(list_target_bodies(context)), None)))
        if area is not None:
            _look_through(area, scene.camera, camera)
        path_cameras.activate_camera(scene, camera)


def _find_next_kind(scene: bpy.types.Scene, area: bpy.types.Area | None) -> str:
    """Return the next camera kind; the free view is included where there is a view."""
    row = [kind for kind in path_cameras.KINDS if path_cameras.find_camera(scene, kind)]
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
        _earlier_views[area.as_pointer()] = view.view_perspective, place, turn, view.view_distance
    if space.use_local_camera:
        space.camera = camera
    view.view_perspective = "CAMERA"


def _restore_view(area: bpy.types.Area) -> None:
    """Restore the earlier view; where it is unknown, keep the camera's place."""
    view = area.spaces.active.region_3d
    if view.view_perspective != "CAMERA":
        return
    for name, value in zip(VIEW_PROPERTIES, _earlier_views.get(area.as_pointer(), ("PERSP",))):
        setattr(view, name, value)
