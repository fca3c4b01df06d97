"""Models of bodies with markers: from a file and to one."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ExportHelper

from ..beyond_mocap.errors import InputError
from ..scene.markers import models
from ..scene.markers.settings import cloud_meant
from .marker_verb import OnMarkers
from .verb import ImportVerb, Verb


class BEYOND_MOCAP_OT_load_marker_model(OnMarkers, ImportVerb, bpy.types.Operator):
    """Take joints and markers of the active cloud's body from a MODEL.json, as the command reconstruct saves it"""

    bl_idname = "beyond_mocap.load_marker_model"
    bl_label = "Load Marker Model"
    filename_ext = ".json"

    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def do(self, context):
        """Read it, keep it with the cloud."""
        from ..beyond_mocap.files.model_json import read_model

        chosen = self.chosen()
        if len(chosen) != 1:
            raise InputError("import", f"{len(chosen)} files" if chosen else "no file given", "one MODEL.json")
        thing = self.cloud(context)
        models.onto(thing, read_model(chosen[0]))
        thing.beyond_mocap_cloud.use_model = True
        self.report({"INFO"}, f"{thing.name}: model from {chosen[0].name}")


class BEYOND_MOCAP_OT_save_marker_model(OnMarkers, Verb, bpy.types.Operator, ExportHelper):
    """Write the model that the active cloud keeps as a MODEL.json, for other recordings and the command line"""

    bl_idname = "beyond_mocap.save_marker_model"
    bl_label = "Save Marker Model"
    bl_options = {"REGISTER"}
    filename_ext = ".json"

    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def do(self, context):
        """Read it off the text, write it."""
        from ..beyond_mocap.files.model_json import write_model

        path = bpy.path.abspath(self.filepath)
        write_model(models.of_cloud(cloud_meant(context)), path)
        self.report({"INFO"}, f"written to {path}")
