"""The library: build it, list its clips, import and remove them, relink a moved folder."""

import os
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty

from ...beyond_mocap.base.errors import InputError, format_count
from ...beyond_mocap.base.fixes import Fix
from ...scene.core import preferences, session, window
from ...scene.core.settings import require_library_folder, to_absolute_path, to_setting_path
from ...scene.library import clips, foreign, recordings
from ..operator_base import BackgroundOperator, BaseOperator

if TYPE_CHECKING:
    from ...beyond_mocap.library.library import Library




class FolderOperator(BackgroundOperator):
    """Base of operators about the library's folder."""

    needs = "Choose the library's folder first", lambda context: bool(context.scene.beyond_mocap.library_folder)


class ClipOperator(BaseOperator):
    """Base of operators about one clip of the list: the named one, else the active one."""

    path: StringProperty(name="Clip", options={"SKIP_SAVE"},
                         description="Clip file below the library folder; empty uses the one chosen in the list")
    dressed: BoolProperty(name="Body", default=True, description="Add a low-poly body to the bones")
    needs = ("No clips listed; press Build Library or List Clips first",
             lambda context: clips.find_active_clip(context.window_manager) is not None)

    def find_clip(self, context) -> str:
        """Return the clip, below the library's folder."""
        chosen = clips.find_active_clip(context.window_manager)
        path = self.path or (chosen.path if chosen else "")
        if not path:
            raise InputError(self.bl_label, "no clip chosen", "a clip in the library's list")
        return path


class BuildOrder(NamedTuple):
    """The input of a build."""

    setting: str
    folder: str
    unit: float | None
    rebuild: bool
    preferences: dict  # arguments of the core's build


class BuildResult(NamedTuple):
    """The result of a build.

    Attributes:
        setting: the library folder as the setting spells it.
        library: None where it could not be built.
        error: the error in that case.
        listing: its clips.
        files: the folder's files when it was read.
        contents, gaps: texts for the panel.
    """

    setting: str
    library: "Library | None"
    error: InputError | None
    listing: tuple
    files: dict
    contents: str = ""
    gaps: str = ""


class BEYOND_MOCAP_OT_build_library(FolderOperator, bpy.types.Operator):
    """Read all clips of the library folder with their labels and foot contacts, and index them for the search; FBX,
glTF and USD clips are converted first, and the result is cached"""

    bl_idname = "beyond_mocap.build_library"
    bl_label = "Build Library"
    kind = "library"
    queue = None  # foreign.Queue while a window waits for conversions
    job = None
    notes = ()
    rebuild: BoolProperty(name="From Scratch", description="Ignore the cache of earlier builds",
                          options={"SKIP_SAVE"})

    def order(self, context):
        settings = context.scene.beyond_mocap
        folder = require_library_folder(settings)
        unit = settings.library_unit or None
        queue = self.queue or self.create_queue(context)
        while queue.remaining:  # called from a script; in a window `modal` has converted them one by one
            queue.convert_next()
        self.notes = queue.notes
        return BuildOrder(settings.library_folder, folder, unit, self.rebuild,
                          preferences.build_library_options(folder))

    def create_queue(self, context):
        """Create the queue of clips that need a conversion."""
        folder = to_absolute_path(context.scene.beyond_mocap.library_folder)
        return foreign.ConversionQueue(folder, preferences.find_cache_folder(folder))

    def start(self, context):
        """Start with the conversions, if there are any, else with the build in a thread."""
        self.queue = self.create_queue(context)
        self.scene = context.scene.session_uid
        if not self.queue.remaining:
            super().start(context)

    def modal(self, context, event):
        """Convert one clip at each timer event, since only the main thread may import; then as any background operator.
        """
        if self.job is not None:
            return super().modal(context, event)
        if event.type == "ESC" and event.value == "PRESS":
            self.stop_polling(context)
            self.report({"WARNING"}, f"{self.bl_label}: cancelled; finished conversions are kept")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        outcome = self.attempt(lambda: self.convert_next(context))
        if outcome == {"CANCELLED"}:
            self.stop_polling(context)
            return outcome
        self.show(context)
        return {"RUNNING_MODAL"}

    def convert_next(self, context):
        """Convert the next clip, or start the build where there is none."""
        if self.queue.remaining:
            self.queue.convert_next()
        else:
            super().start(context)

    def show(self, context):
        """Show the conversions' progress while they run."""
        if self.job is not None:
            return super().show(context)
        running, queue = context.window_manager.beyond_mocap_work, self.queue
        done = queue.total - len(queue.remaining)
        text = f"Converting {queue.remaining[0].name}" if queue.remaining else "Converted"
        text += f" {done} of {queue.total}"
        running.kind, running.fraction, running.text = self.kind, done / max(queue.total, 1), text
        window.show_status(f"{text}   ESC: cancel")
        window.redraw_editors()

    def cancel(self, context):
        """Stop when Blender ends the operator."""
        if self.job is not None:
            self.job.cancel()
        self.stop_polling(context)

    @staticmethod
    def run_job(order, progress, cancelled, _hurry):
        """Build the library and list its clips; a library that cannot be built is listed too, so that it can be
        labelled.
        """
        from ...beyond_mocap.library.build import build_library
        from ...beyond_mocap.library.listing import list_clips, scan_clips

        files = clips.list_files(order.folder) or {}
        options = {"rebuild": order.rebuild, "unit": order.unit, **order.preferences}
        try:
            library = build_library(order.folder, **options, progress=progress, cancelled=cancelled)
        except InputError as error:
            return BuildResult(order.setting, None, error, scan_clips(order.folder, options["cache_dir"]), files)
        return BuildResult(order.setting, library, None, list_clips(library), files,
                           contents=describe_library(library), gaps=describe_gaps(library))

    def apply(self, scene, result):
        """Store the library and report its content."""
        clips.store_clips(bpy.context.window_manager, result.setting, result.listing, result.files)
        for note in self.notes:
            self.report({"WARNING"}, note)
        if result.error is not None:
            raise result.error
        session.store_library(result.library, scene.beyond_mocap.library_unit or None)
        scene.beyond_mocap.library_holds, scene.beyond_mocap.library_gaps = result.contents, result.gaps
        for note in result.library.proposal_notes:
            self.report({"WARNING"}, note)
        for note in result.library.notes:
            self.report({"INFO"}, note)
        self.report({"INFO"}, scene.beyond_mocap.library_holds.splitlines()[0])


def describe_library(library: "Library") -> str:
    """Describe a library for the panel: clips and minutes, then each gait with its speed, then key moments with their
    number.
    """
    from ...beyond_mocap.annotation.labels import find_label

    originals = [clip for clip in library.clips if not clip.mirrored]
    keys = Counter(row.words[0] for clip in originals for row in clip.annotations if row.key is not None and row.words)
    lines = [f"{format_count(len(originals), 'clip')}, {library.minutes:.1f} minutes, {len(library.skeleton)} joints"]
    lines += [f"{find_label(gait.label).title}: {gait.speed:.1f} m/s" for gait in library.gaits]
    for word, count in keys.most_common():
        lines.append(f"{find_label(word).title}: {format_count(count, 'moment')}")
    return "\n".join(lines)


def describe_gaps(library: "Library") -> str:
    """Describe for the panel, one line each, what is proposed, without labels, missing and left out of locomotion; the
    first line counts and sums up these warnings; "" where there is nothing to say.
    """
    from ...beyond_mocap.library.left_out import describe_left_out

    missing, left_out = list(library.coverage.lines.values()), describe_left_out(library)
    labels = [*library.proposal_notes, *library.unlabelled_notes]
    parts = ["Proposed labels"] if library.proposal_notes else []
    parts += ["Clips without labels"] if library.unlabelled_notes else []
    parts += [f"{format_count(len(missing), 'motion')} missing"] if missing else []
    parts += [left_out[0].partition(":")[0]] if left_out else []
    count = len(labels) + len(missing) + bool(left_out)
    first = f"{format_count(count, 'warning')}: {', '.join(parts)}"
    return "\n".join([first, *labels, *missing, *left_out]) if parts else ""


class ListOrder(NamedTuple):
    """The folder to list, and its library if it was built in this session."""

    setting: str
    folder: str
    cache_dir: str | None
    library: "Library | None"


class BEYOND_MOCAP_OT_list_clips(FolderOperator, bpy.types.Operator):
    """List the clips of the folder with their labels, without reading their motion; Build Library adds speeds and
quality"""

    bl_idname = "beyond_mocap.list_clips"
    bl_label = "List Clips"
    bl_options = {"REGISTER"}
    kind = "list"

    def order(self, context):
        settings = context.scene.beyond_mocap
        folder = to_absolute_path(settings.library_folder)
        clips.check_folder(context.scene)
        built = session.find_library(folder, settings.library_unit or None)
        return ListOrder(settings.library_folder, folder, preferences.find_cache_folder(folder), built)

    @staticmethod
    def run_job(order, progress, _cancelled, _hurry):
        """List from the built library where there is one, else from the folder."""
        from ...beyond_mocap.library.listing import list_clips, scan_clips

        progress(0.0, "Listing clips")
        files = clips.list_files(order.folder)
        if files is None:
            raise InputError(order.folder, "no such folder", "the library's folder", "press Relink Library",
                             fixes=(Fix("relink_library"),))
        found = list_clips(order.library) if order.library is not None else scan_clips(order.folder, order.cache_dir)
        return order.setting, found, files

    def apply(self, _scene, result):
        setting, found, files = result
        clips.store_clips(bpy.context.window_manager, setting, found, files)
        self.report({"INFO"}, f"Clips listed: {len(found)}")


class BEYOND_MOCAP_OT_relink_library(BaseOperator, bpy.types.Operator):
    """Choose the new place of a library folder that was moved; a folder beside this file is found automatically"""

    bl_idname = "beyond_mocap.relink_library"
    bl_label = "Relink Library"
    directory: StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})
    filter_folder: bpy.props.BoolProperty(default=True, options={"HIDDEN"})
    resumes: IntProperty(options={"SKIP_SAVE", "HIDDEN"}, description="Number of the notice that it fixes")

    def invoke(self, context, _event):
        """Search beside the file first; open the file browser where nothing is found."""
        if clips.relink_library(context.scene):
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def do(self, context):
        settings = context.scene.beyond_mocap
        chosen = bpy.path.abspath(self.directory) if self.directory else ""
        if chosen and not clips.holds_recordings(chosen):
            raise InputError(chosen, "no recordings in the folder", "the library's folder", "choose another one")
        if chosen:
            settings.library_folder = to_setting_path(chosen)
        elif not os.path.isdir(to_absolute_path(settings.library_folder)) and not clips.relink_library(context.scene):
            raise InputError(to_absolute_path(settings.library_folder) or "library",
                             "no such folder, and no similar one beside this file", "the library's folder",
                             "choose it in Relink Library")
        clips.check_folder(context.scene)
        self.report({"INFO"}, f"Library: {to_absolute_path(settings.library_folder)}")


class BEYOND_MOCAP_OT_import_clip(ClipOperator, bpy.types.Operator):
    """Import this clip of the library as it was recorded: an armature with a body and the clip's action"""

    bl_idname = "beyond_mocap.import_clip"
    bl_label = "Import Clip"
    presents = True

    def do(self, context):
        """Read the file, then create the armature."""
        path = self.find_clip(context)
        clip, notes = recordings.read_recording(context.scene.beyond_mocap, path)
        body = recordings.show_recording(context, clip, path, self.dressed)
        for note in notes:
            self.report({"INFO"}, f"{body.name}: {note}")
        self.report({"INFO"}, f"{body.name}: {clip.duration:.1f} s, {len(clip)} frames at {clip.fps:g} per second")


class BEYOND_MOCAP_OT_remove_clip(BaseOperator, bpy.types.Operator):
    """Remove the active clip from this file, with armature, body, strips, actions and unsaved labels; the library keeps
the clip"""

    bl_idname = "beyond_mocap.remove_clip"
    bl_label = "Remove Clip"
    needs = ("Select the armature of a clip from the library's list",
             lambda context: bool(recordings.find_shown_clip(context.object)))

    def do(self, context):
        rig = context.object
        if rig.library is not None or rig.override_library is not None:
            raise InputError(rig.name, "belongs to another file", "an object of this file")
        if rig.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        recordings.remove_clip(rig)
