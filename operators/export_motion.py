"""Export Motion: what rigs or bodies show, as FBX, glTF, USD or BVH, from one button."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ..scene import export, rig, session
from ..scene.settings import active_player
from .verb import ExportVerb


class BEYOND_MOCAP_OT_export_motion(ExportVerb, bpy.types.Operator):
    """Write what the rig shows, with its meshes, to a file: baked to one action first. The scene stays as it is"""

    bl_idname = "beyond_mocap.export_motion"
    bl_label = "Export Motion"

    filter_glob: StringProperty(default="*.fbx;*.glb;*.usdc;*.bvh", options={"HIDDEN"})
    format: EnumProperty(name="Format", items=rig.FORMATS, default="FBX", description="Form of the file")
    engine: EnumProperty(name="For", items=rig.ENGINES, default="BLENDER", description="Axes and units of")
    who: EnumProperty(name="Who", items=rig.WHO, default="ACTIVE", description="Whose motion")
    root: EnumProperty(name="Root Motion", items=rig.ROOTS, default="KEEP", description="What the root bone carries")
    own_rate: BoolProperty(name="Own Rate", default=False, description="At the rate that was synthesized")
    deform_only: BoolProperty(name="Deform Bones Only", default=True, description="Leave controls out")
    meshes: BoolProperty(name="Meshes", default=True, description="Export the meshes that the armature moves, too")

    @classmethod
    def poll(cls, context):
        """Something to export."""
        cls.poll_message_set("Synthesize and accept first, or select an armature that moves")
        settings = context.scene.beyond_mocap
        return bool(settings.players) or settings.rig.target is not None or any(
            one.type == "ARMATURE" for one in context.selected_objects)

    def invoke(self, context, event):
        """The panel's choices, then the file browser."""
        settings = context.scene.beyond_mocap.rig
        for name in ("format", "engine", "who", "root", "own_rate", "deform_only", "meshes"):
            setattr(self, name, getattr(settings, name))
        return super().invoke(context, event)

    def do(self, context):
        """Write it."""
        path = self.out()
        rigs = self.rigs(context)
        wanted = export.Wanted(
            path, self.format, self.engine, self.rate(context), self.root, self.deform_only, self.meshes
        )
        for line in export.write(context, rigs, wanted):
            self.report({"INFO"}, line)
        self.report({"INFO"}, f"Written: {path}")

    def rigs(self, context) -> list[bpy.types.Object]:
        """Whose motion is asked for."""
        settings = context.scene.beyond_mocap
        if self.who == "SELECTED":
            return [one for one in context.selected_objects if one.type == "ARMATURE"]
        if self.who == "PLAYERS":
            chosen = [player.rig or player.body for player in settings.players if player.use]
            return [one for one in chosen if one is not None]
        player = active_player(settings)
        if settings.rig.target is not None and (settings.rig.source or player is None or player.rig is None):
            return [settings.rig.target]
        if player is not None and (player.rig or player.body) is not None:
            return [player.rig or player.body]
        active = context.object
        return [active] if active is not None and active.type == "ARMATURE" else []

    def rate(self, context) -> float | None:
        """The rate that the active player's take was made at; the scene's where that is not known."""
        if not self.own_rate:
            return None
        player = active_player(context.scene.beyond_mocap)
        made = session.made(player.take) if player is not None and player.take else None
        return made.take.motion.fps if made is not None else None
