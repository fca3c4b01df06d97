"""Operators of optical markers: import, label, clean, reconstruct a body, find a ball's release."""

from contextlib import nullcontext
from pathlib import Path

import bpy
from bpy.props import EnumProperty, FloatProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..beyond_mocap.base.errors import InputError
from ..beyond_mocap.files import atomic
from ..scene.core import channels, window
from ..scene.core.settings import to_setting_path
from ..scene.markers import cloud, sets, solve
from ..scene.markers.settings import find_target_cloud, is_cloud, list_clouds
from .operator_base import BackgroundOperator, BaseOperator, ImportOperator, ViewDropHandler


class MarkersVerb:
    """Mixin for verbs that act on the target cloud of markers."""

    needs = "Select a marker cloud; Import Markers creates one", lambda context: find_target_cloud(context) is not None

    @staticmethod
    def find_cloud(context):
        """Return the target cloud; raise InputError where it belongs to another file."""
        thing = find_target_cloud(context)
        channels.check_local(thing, thing.data)
        return thing

    @staticmethod
    def use_scene(scene):
        """Return the context of the scene in which the work started, even if the window shows another one now."""
        if bpy.context.scene == scene:
            return nullcontext()
        return bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0])


UP = (("AUTO", "Detect", "As the file says, or heads above feet"),
      *((axis, axis, f"{axis} of the file points up") for axis in ("X", "-X", "Y", "-Y", "Z", "-Z")))


class BEYOND_MOCAP_OT_import_markers(ImportOperator, bpy.types.Operator):
    """Import optical marker recordings (.c3d, .trc) as marker clouds, and apply a known marker set"""

    bl_idname = "beyond_mocap.import_markers"
    bl_label = "Import Markers"
    presents = True
    filename_ext = ".c3d"
    filter_glob: StringProperty(default="*.c3d;*.trc", options={"HIDDEN"})
    unit: FloatProperty(
        name="Metres per Unit", default=0.0, min=0.0, precision=5,
        description="Size of one unit of the file in metres; 0 uses the file or the body's size",
    )
    up: EnumProperty(name="Up", items=UP, description="Axis of the file that points up")
    subject: StringProperty(name="Subject", description="Whose markers to read if a file contains several subjects")

    def do(self, context):
        """Read all files, then create the clouds."""
        from ..beyond_mocap.markers.files.marker_files import read_markers

        paths = self.list_chosen_files()
        if not paths:
            raise InputError("import", "no file", "a .c3d or .trc file", "choose a file")
        unit = self.unit or context.scene.beyond_mocap_markers.unit or None
        read_options = unit, self.subject or None, None if self.up == "AUTO" else self.up
        trials = [(path, read_markers(path, *read_options)) for path in paths]
        for _, trial in trials:
            cloud.check_visible(trial)
        if context.mode != "OBJECT":  # another object would stay in Edit Mode
            bpy.ops.object.mode_set(mode="OBJECT")
        clouds_added = [self.add_cloud(context, path, trial) for path, trial in trials]
        window.select_only(context, *clouds_added)
        context.scene.beyond_mocap.task = "MARKERS"

    def add_cloud(self, context, path: Path, trial) -> bpy.types.Object:
        """Create one cloud, and report messages on it."""
        thing = cloud.create_cloud(context, trial)
        thing.beyond_mocap_cloud.file = to_setting_path(str(path))
        messages = list(trial.notes)
        try:
            messages += sets.apply_marker_set(thing, sets.choose_shipped_set(trial.labels))
        except InputError as error:
            messages.append(str(error))
        thing.beyond_mocap_cloud.messages = "\n".join(messages)
        for line in messages:
            self.report({"INFO"}, f"{thing.name}: {line}")
        seen = f"{100.0 * float(trial.visibility.mean()):.0f} % visible"
        found = f"{len(trial.labels)} markers, {trial.duration:.2f} s at {trial.fps:g} per second, {seen}"
        self.report({"INFO"}, f"{thing.name}: {found}")
        return thing


class BEYOND_MOCAP_FH_markers(ViewDropHandler, bpy.types.FileHandler):
    """Recordings of optical markers dropped into the 3D view"""

    bl_idname = "BEYOND_MOCAP_FH_markers"
    bl_label = "Optical Markers"
    bl_import_operator = "beyond_mocap.import_markers"
    bl_file_extensions = ".c3d;.trc"


_segments: list[tuple[str, str, str]] = []


def list_segments(_operator, _context):
    """List the segments to choose from; stored, since Blender does not keep the texts."""
    if not _segments:
        from ..beyond_mocap.markers.model.template import JOINTS

        _segments.append(("NONE", "None", "No segment"))
        _segments.extend((name, name, f"Body segment {name}") for name in JOINTS)
    return _segments


class BEYOND_MOCAP_OT_assign_markers(MarkersVerb, BaseOperator, bpy.types.Operator):
    """Assign the markers selected in Edit Mode, or the active one of the list, to a body segment"""

    bl_idname = "beyond_mocap.assign_markers"
    bl_label = "Assign Markers"
    segment: EnumProperty(name="Segment", items=list_segments, description="Body segment that the markers lie on")

    def do(self, context):
        """Write the segment to the labels."""
        thing = self.find_cloud(context)
        names = sets.list_selected_labels(thing)
        if not names:
            raise InputError(thing.name, "no markers selected", "at least one", "select vertices in Edit Mode")
        segment = "" if self.segment == "NONE" else self.segment
        sets.assign_segment(thing, names, segment)
        self.report({"INFO"}, f"{', '.join(names)}: {segment or 'no segment'}")


_sets: list[tuple[str, str, str]] = []


def list_shipped_sets(_operator, _context):
    """List the shipped marker sets; stored, since Blender does not keep the texts."""
    if not _sets:
        from ..beyond_mocap.markers.files.marker_set_text import read_shipped_sets

        _sets.append(("AUTO", "Detect", "Marker set that fits the labels"))
        _sets.extend((one.name, one.name.replace("_", " ").title(), one.about) for one in read_shipped_sets())
    return _sets


class BEYOND_MOCAP_OT_use_marker_set(MarkersVerb, BaseOperator, bpy.types.Operator):
    """Apply a shipped marker set to the labels of the marker cloud"""

    bl_idname = "beyond_mocap.use_marker_set"
    bl_label = "Use Marker Set"
    which: EnumProperty(name="Marker Set", items=list_shipped_sets, description="Marker set to apply")

    def do(self, context):
        """Apply the chosen set, and report what does not fit."""
        from ..beyond_mocap.markers.files.marker_set_text import read_shipped_sets

        thing = self.find_cloud(context)
        labels = tuple(row.name for row in thing.beyond_mocap_cloud.labels)
        matches = (one for one in read_shipped_sets() if one.name == self.which)
        found = sets.choose_shipped_set(labels) if self.which == "AUTO" else next(matches)
        for line in sets.apply_marker_set(thing, found):
            self.report({"WARNING"}, line)
        self.report({"INFO"}, f"{thing.name}: {found.name}")


class BEYOND_MOCAP_OT_load_marker_set(MarkersVerb, ImportOperator, bpy.types.Operator):
    """Apply a marker set from a text file to the labels of the active marker cloud"""

    bl_idname = "beyond_mocap.load_marker_set"
    bl_label = "Load Marker Set"
    filename_ext = ".txt"
    filter_glob: StringProperty(default="*.txt", options={"HIDDEN"})

    def do(self, context):
        """Read the set and apply it, and report what does not fit."""
        from ..beyond_mocap.markers.files.marker_set_text import read_marker_set

        path = self.find_chosen_file("one marker set")
        thing = self.find_cloud(context)
        for line in sets.apply_marker_set(thing, read_marker_set(path)):
            self.report({"WARNING"}, line)


class BEYOND_MOCAP_OT_save_marker_set(MarkersVerb, BaseOperator, bpy.types.Operator, ExportHelper):
    """Save labels, segments and landmarks of the active marker cloud as a marker set file"""

    bl_idname = "beyond_mocap.save_marker_set"
    bl_label = "Save Marker Set"
    bl_options = {"REGISTER"}
    filename_ext = ".txt"
    filter_glob: StringProperty(default="*.txt", options={"HIDDEN"})

    def do(self, context):
        """Build the marker set and write it."""
        from ..beyond_mocap.markers.files.marker_set_text import format_marker_set

        path = Path(bpy.path.abspath(self.filepath))
        name = "_".join(path.stem.split()) or sets.OWN
        atomic.atomic_write(path, format_marker_set(sets.build_marker_set(find_target_cloud(context), name)))
        self.report({"INFO"}, f"written to {path}")


class BEYOND_MOCAP_OT_set_static(MarkersVerb, BaseOperator, bpy.types.Operator):
    """Use the active cloud as the static trial of the other selected clouds, or of all others if none is selected"""

    bl_idname = "beyond_mocap.set_static"
    bl_label = "Set Static Trial"
    needs = ("Make the cloud of the static trial active; at least one other cloud is needed",
             lambda context: is_cloud(context.view_layer.objects.active) and len(list_clouds(context.scene)) > 1)

    def do(self, context):
        """Set the static trial of the other clouds."""
        static = context.view_layer.objects.active
        others = [thing for thing in list_clouds(context.scene) if thing != static]
        chosen = [thing for thing in others if thing.select_get()] or others
        channels.check_local(*chosen)
        if static.beyond_mocap_cloud.static in chosen:
            raise InputError(static.name, "its own static trial is among them", "a trial without one", "clear it first")
        for thing in chosen:
            thing.beyond_mocap_cloud.static = static
        self.report({"INFO"}, f"{static.name}: static trial of {', '.join(thing.name for thing in chosen)}")


class BEYOND_MOCAP_OT_load_marker_model(MarkersVerb, ImportOperator, bpy.types.Operator):
    """Load joints and marker places of the active cloud's body from a model file"""

    bl_idname = "beyond_mocap.load_marker_model"
    bl_label = "Load Marker Model"
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def do(self, context):
        """Read the model, and store it with the cloud."""
        from ..beyond_mocap.markers.files.model_json import read_model

        path = self.find_chosen_file("one MODEL.json")
        thing = self.find_cloud(context)
        solve.store_model(thing, read_model(path))
        thing.beyond_mocap_cloud.use_model = True
        self.report({"INFO"}, f"{thing.name}: model from {path.name}")


class BEYOND_MOCAP_OT_save_marker_model(MarkersVerb, BaseOperator, bpy.types.Operator, ExportHelper):
    """Save the model of the active marker cloud as a file, for other recordings"""

    bl_idname = "beyond_mocap.save_marker_model"
    bl_label = "Save Marker Model"
    bl_options = {"REGISTER"}
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def do(self, context):
        """Read the model from the text and write it."""
        from ..beyond_mocap.markers.files.model_json import write_model

        path = bpy.path.abspath(self.filepath)
        write_model(solve.read_model(find_target_cloud(context)), path)
        self.report({"INFO"}, f"written to {path}")


class BEYOND_MOCAP_OT_clean_markers(MarkersVerb, BackgroundOperator, bpy.types.Operator):
    """Fill gaps, exchange swapped labels back, remove jumps and label unlabeled markers of the active cloud"""

    bl_idname = "beyond_mocap.clean_markers"
    bl_label = "Clean Up Markers"
    kind = "clean markers"

    def order(self, context):
        """Return the trial, and which markers belong together."""
        thing = self.find_cloud(context)
        trial = cloud.read_trial(thing, context.scene)
        assigned = any(row.segment for row in thing.beyond_mocap_cloud.labels)
        return thing.name, trial, sets.build_marker_set(thing).select_clusters(trial.labels) if assigned else None

    @staticmethod
    def run_job(order, progress, cancelled, _hurry):
        """Clean the trial."""
        from ..beyond_mocap.markers.cleaning.clean import clean_trial

        name, trial, clusters = order
        return name, clean_trial(trial, clusters, progress=progress, cancelled=cancelled)

    def apply(self, scene, result):
        """Write the new trajectories to the cloud, and report what was done."""
        name, cleaned = result
        thing = scene.objects.get(name)
        if not is_cloud(thing):
            self.report({"WARNING"}, f"{name} no longer exists: no data written")
            return
        cloud.write_trial(thing, cleaned.trial, scene)
        thing.beyond_mocap_cloud.cleaned = "\n".join(cleaned.report.lines) or "nothing to correct"
        for line in thing.beyond_mocap_cloud.cleaned.splitlines():
            self.report({"INFO"}, f"{name}: {line}")


class BEYOND_MOCAP_OT_reconstruct_markers(MarkersVerb, BackgroundOperator, bpy.types.Operator):
    """Reconstruct the skeleton that moves with the active cloud's markers, as an armature with an action"""

    bl_idname = "beyond_mocap.reconstruct_markers"
    bl_label = "Reconstruct"
    presents = True
    kind = "reconstruct markers"

    def order(self, context):
        """Return the trial, its static or model, and the settings."""
        return solve.build_request(context.scene, self.find_cloud(context))

    @staticmethod
    def run_job(order, progress, cancelled, _hurry):
        """Reconstruct the trial."""
        from ..beyond_mocap.markers.reconstruct import reconstruct

        reconstruction = reconstruct(order.trial, order.static, order.model, settings=order.settings, progress=progress,
                                     cancelled=cancelled)
        return order, reconstruction

    def apply(self, scene, result):
        """Create armature, action and figures, and write the clip."""
        order, reconstruction = result
        thing = scene.objects.get(order.cloud)
        if not is_cloud(thing):
            self.report({"WARNING"}, f"{order.cloud} no longer exists: no data written")
            return
        notes = solve.add_to_library(order, reconstruction)
        with self.use_scene(scene):
            body = solve.show_reconstruction(bpy.context, thing, reconstruction)
        for line in (*reconstruction.warnings, *notes):
            self.report({"INFO"}, f"{thing.name}: {line}")
        self.report({"INFO"}, f"{body.name}: {'; '.join(solve.list_figures(reconstruction))}")


class BEYOND_MOCAP_OT_find_release(MarkersVerb, BackgroundOperator, bpy.types.Operator):
    """Estimate when and how fast the ball left the hand of the reconstructed body, and show its trajectory"""

    bl_idname = "beyond_mocap.find_release"
    bl_label = "Find Release"
    kind = "find release"

    def order(self, context):
        """Return the reconstruction, and what is known of the ball."""
        return solve.build_release_request(context.scene, self.find_cloud(context))

    @staticmethod
    def run_job(order, progress, _cancelled, _hurry):
        """Estimate the release."""
        from ..beyond_mocap.markers.release.release import estimate_release

        name, trial, motion, settings = order
        progress(0.1, "release")
        return name, estimate_release(trial, motion, settings)

    def apply(self, scene, result):
        """Show the release, and report its figures."""
        name, found = result
        thing = scene.objects.get(name)
        if not is_cloud(thing):
            self.report({"WARNING"}, f"{name} no longer exists: no data written")
            return
        with self.use_scene(scene):
            solve.show_release(bpy.context, thing, found)
        for line in solve.list_release_figures(found):
            self.report({"INFO"}, f"{name}: {line}")
