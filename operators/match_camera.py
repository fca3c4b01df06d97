"""Match Camera: from the stand, or through any player's eyes."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, StringProperty

from ..beyond_mocap.errors import InputError
from ..scene import areas
from ..scene.match import cameras, ours, show
from ..scene.match.settings import active_of
from .verb import Verb

WHICH = (
    ("STAND", "Broadcast", "From the stand, following the ball"),
    ("EYES", "Eyes", "Through the eyes of the player chosen in the list, or of the selected one"),
)


class BEYOND_MOCAP_OT_match_camera(Verb, bpy.types.Operator):
    """Look through one of the match's cameras"""

    bl_idname = "beyond_mocap.match_camera"
    bl_label = "Match Camera"

    which: EnumProperty(name="Which", items=WHICH, default="STAND", description="The camera to look through")
    player: StringProperty(name="Player", options={"SKIP_SAVE"}, description="ID of the player; empty: the chosen one")

    @classmethod
    def poll(cls, context):
        """A match is shown."""
        cls.poll_message_set("Press Make Match or Show Match first")
        return bool(ours.bodies(context.scene))

    @classmethod
    def description(cls, _context, properties):
        """What this button shows."""
        return next(item[2] for item in WHICH if item[0] == properties.which)

    def do(self, context):
        """Make it the scene's camera, and look through it in the 3D view."""
        scene = context.scene
        if self.which == "EYES":
            camera = cameras.eyes(scene, self.who(context), show.ball_shown(scene))
        else:
            camera = cameras.stand_of(scene)
        if camera is None:
            raise InputError("match", "no camera in the stand", "the one that was laid", "press Show Match again")
        scene.camera = camera
        area = None if bpy.app.background else areas.largest(context.window.screen, "VIEW_3D")
        if area is not None:
            _look_through(context, area)

    def who(self, context) -> bpy.types.Object:
        """The armature that is meant: named, selected, or chosen in the list."""
        shown = {thing.get(ours.PLAYER): thing for thing in ours.bodies(context.scene)}
        active = context.active_object
        if not self.player and active is not None:
            active = active.parent if active.type == "MESH" else active
            if active in shown.values() and active.select_get():
                return active
        chosen = active_of(context.scene.beyond_mocap_match)
        wanted = self.player or (chosen.feed_id if chosen is not None else next(iter(shown)))
        if wanted not in shown:
            raise InputError("match", f"{wanted} is not shown", f"one of {', '.join(map(str, shown))}",
                             "tick the player and press Show Match")
        return shown[wanted]


def _look_through(context, area: bpy.types.Area) -> None:
    """The scene's camera in the 3D view, its whole frame."""
    area.spaces.active.region_3d.view_perspective = "CAMERA"
    region = next(region for region in area.regions if region.type == "WINDOW")
    with context.temp_override(area=area, region=region):
        bpy.ops.view3d.view_center_camera()
