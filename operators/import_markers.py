"""Import Markers: recordings of optical markers as clouds that play."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import EnumProperty, FloatProperty, StringProperty

from ..beyond_mocap.errors import InputError
from ..scene.markers import cloud, sets
from ..scene.settings import as_setting
from .verb import ImportVerb

UP = (
    ("AUTO", "Found", "As the file says, or heads above feet"),
    *((axis, axis, f"{axis} of the file points up") for axis in ("X", "-X", "Y", "-Y", "Z", "-Z")),
)


class BEYOND_MOCAP_OT_import_markers(ImportVerb, bpy.types.Operator):
    """Import recordings of optical markers (.c3d, .trc) as clouds that play. Whose labels are those of a known marker
set know their segments at once"""

    bl_idname = "beyond_mocap.import_markers"
    bl_label = "Import Markers"
    filename_ext = ".c3d"

    filter_glob: StringProperty(default="*.c3d;*.trc", options={"HIDDEN"})
    unit: FloatProperty(
        name="Metres per unit", default=0.0, min=0.0, precision=5,
        description="Size of one unit of the file in metres; 0: as the file says, or by the body's size",
    )
    up: EnumProperty(name="Up", items=UP, description="Which axis of the file points up")
    subject: StringProperty(name="Subject", description="Whose markers to read, where a file holds several subjects'")

    def do(self, context):
        """Read all files, then make the clouds."""
        from ..beyond_mocap.files.marker_files import read_markers

        paths = self.chosen()
        if not paths:
            raise InputError("import", "no file given", "a .c3d or .trc file", "choose one")
        unit = self.unit or context.scene.beyond_mocap_markers.unit or None
        how = unit, self.subject or None, None if self.up == "AUTO" else self.up
        trials = [(path, read_markers(path, *how)) for path in paths]
        for _, trial in trials:
            cloud.check(trial)
        if context.mode != "OBJECT":  # what is edited would stay so beside what is then active
            bpy.ops.object.mode_set(mode="OBJECT")
        made = [self.add(context, path, trial) for path, trial in trials]
        for other in context.selected_objects:
            other.select_set(False)
        for thing in made:
            thing.select_set(True)
        context.view_layer.objects.active = made[0]

    def add(self, context, path: Path, trial) -> bpy.types.Object:
        """One cloud, and what is to be said of it."""
        thing = cloud.create(context, trial)
        thing.beyond_mocap_cloud.file = as_setting(str(path))
        told = list(trial.notes)
        try:
            told += sets.apply(thing, sets.recognised(trial.labels))
        except InputError as error:
            told.append(str(error))
        thing.beyond_mocap_cloud.told = "\n".join(told)
        for line in told:
            self.report({"INFO"}, f"{thing.name}: {line}")
        seen = f"{100.0 * float(trial.seen.mean()):.0f} % seen"
        found = f"{len(trial.labels)} markers, {trial.duration:.2f} s at {trial.fps:g} per second, {seen}"
        self.report({"INFO"}, f"{thing.name}: {found}")
        return thing


class BEYOND_MOCAP_FH_markers(bpy.types.FileHandler):
    """Recordings of optical markers dropped into the 3D view"""

    bl_idname = "BEYOND_MOCAP_FH_markers"
    bl_label = "Optical markers"
    bl_import_operator = "beyond_mocap.import_markers"
    bl_file_extensions = ".c3d;.trc"

    @classmethod
    def poll_drop(cls, context):
        """The 3D view, where the cloud will be."""
        return context.area is not None and context.area.type == "VIEW_3D"
