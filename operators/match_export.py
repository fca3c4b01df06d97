"""Export Match: everybody who is shown, ball and pitch, as one FBX, glTF or USD file."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ..scene import export, rig
from ..scene.match import ours
from .verb import ExportVerb

FORMATS = [one for one in rig.FORMATS if one[0] != "BVH"]


class BEYOND_MOCAP_OT_match_export(ExportVerb, bpy.types.Operator):
    """Write the match that is shown to one file: a skeleton and meshes for everybody, the ball, and the pitch. The
scene stays as it is"""

    bl_idname = "beyond_mocap.match_export"
    bl_label = "Export Match"

    filter_glob: StringProperty(default="*.fbx;*.glb;*.usdc", options={"HIDDEN"})
    format: EnumProperty(name="Format", items=FORMATS, default="GLB", description="Form of the file")
    engine: EnumProperty(name="For", items=rig.ENGINES, default="BLENDER", description="Axes and units of")
    root: EnumProperty(name="Root Motion", items=rig.ROOTS, default="KEEP", description="What the root bone carries")
    pitch: BoolProperty(name="Pitch", default=True, description="Grass, lines and goals, too")

    @classmethod
    def poll(cls, context):
        """A match is shown."""
        cls.poll_message_set("Show a match first")
        return bool(ours.bodies(context.scene))

    def do(self, context):
        """Write it."""
        path = self.out()
        scene = context.scene
        everybody = ours.bodies(scene)
        bodies = [body for body in everybody if body.name in context.view_layer.objects]
        if len(bodies) < len(everybody):
            self.report({"WARNING"}, f"{len(everybody) - len(bodies)} are left out: their collection is excluded")
        wanted = export.Wanted(path, self.format, self.engine, None, self.root)
        things = ours.meshes(scene, "ball") + (ours.meshes(scene, "pitch") if self.pitch else [])
        for line in export.write(context, bodies, wanted, things):
            self.report({"INFO"}, line)
        self.report({"INFO"}, f"Written: {path}")
