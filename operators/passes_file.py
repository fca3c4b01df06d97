"""Scenes of passes from files and samples, and to files."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..beyond_mocap.ball.sample_scenes import SAMPLES as SCENES
from ..beyond_mocap.errors import InputError
from ..beyond_mocap.files import scene_json
from ..beyond_mocap.files.whole import atomic_write
from ..scene.passes import examples, order
from ..scene.passes.settings import SAMPLES
from .verb import ImportVerb, Verb


class BEYOND_MOCAP_OT_passes_sample(Verb, bpy.types.Operator):
    """Fill the lists with a scene to begin with. What they hold now is replaced; players of the same name keep
their bodies"""

    bl_idname = "beyond_mocap.passes_sample"
    bl_label = "Sample Scene"

    sample: EnumProperty(name="Sample", items=SAMPLES, description="Which one")

    def do(self, context):
        """Read it, fill the lists."""
        order.fill(context, scene_json.parse_scene(SCENES[self.sample], self.sample))
        self.report({"INFO"}, "drag the players' Empties, edit the passes, then press Make Scene")


class BEYOND_MOCAP_OT_passes_from_json(ImportVerb, bpy.types.Operator):
    """Fill the lists with a scene from a SCENE.json, as the command passes takes it"""

    bl_idname = "beyond_mocap.passes_from_json"
    bl_label = "Scene from File"
    filename_ext = ".json"

    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def do(self, context):
        """Read it, fill the lists."""
        chosen = self.chosen()
        if len(chosen) != 1:
            raise InputError("import", f"{len(chosen)} files" if chosen else "no file given", "one SCENE.json")
        order.fill(context, scene_json.read_scene(chosen[0]))


class BEYOND_MOCAP_OT_passes_to_json(Verb, bpy.types.Operator, ExportHelper):
    """Write the scene as a SCENE.json, for the command passes or another file"""

    bl_idname = "beyond_mocap.passes_to_json"
    bl_label = "Scene to File"
    bl_options = {"REGISTER"}
    filename_ext = ".json"

    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def do(self, context):
        """Work it out, then write."""
        text = scene_json.scene_text(order.scene_of(context.scene))
        atomic_write(bpy.path.abspath(self.filepath), text)
        missing = examples.left_out(context.scene.beyond_mocap_passes)
        self.report(
            {"WARNING" if missing else "INFO"}, ", ".join(filter(None, (f"written to {self.filepath}", missing)))
        )
