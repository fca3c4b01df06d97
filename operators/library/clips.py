"""Motion clips in the scene: import them, mirror them, make assets of them."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ...beyond_mocap.base.errors import InputError, UserCancelledError, format_count
from ...beyond_mocap.files.clip_file import CLIP_ENDINGS, FOREIGN, read_clip
from ...beyond_mocap.library.folder import conversions
from ...beyond_mocap.library.folder import recordings as folder_recordings
from ...beyond_mocap.motion import humanoid, quaternion
from ...beyond_mocap.motion import mirror as mirroring
from ...beyond_mocap.motion import motion as motions
from ...scene.core import action, channels, frame_range, window
from ...scene.library import assets, clips, foreign, recordings
from ...scene.rigs import armature, exporters
from ..operator_base import BackgroundOperator, BaseOperator, ImportOperator

if TYPE_CHECKING:
    from ...beyond_mocap.files.bvh.bvh import BvhClip


class BEYOND_MOCAP_OT_import_clips(ImportOperator, bpy.types.Operator):
    """Import motion clips (BVH, SMPL, FBX, glTF, USD) as armatures, from files or from all files below a folder: only
the motion, from the hips up and in metres"""

    bl_idname = "beyond_mocap.import_clips"
    bl_label = "Import Motion Clips"
    presents = True
    filename_ext = ".bvh"
    filter_glob: StringProperty(default=";".join(f"*{ending}" for ending in (*CLIP_ENDINGS, *FOREIGN)),
                                options={"HIDDEN"})
    unit: FloatProperty(name="Metres per Unit", default=0.0, min=0.0, precision=5,
                        description="Size of one unit of the file in metres; 0 guesses it from the height of the hips")
    reuse: BoolProperty(
        name="Onto Active Armature", default=False,
        description="Add the clips' actions to the active armature, if its bones are the same",
    )

    def list_paths(self) -> list[Path]:
        """List the chosen files, and all below a chosen folder."""
        chosen = self.list_chosen_files() or ([Path(self.directory)] if self.directory else [])
        if not chosen:
            raise InputError("import", "no file given",
                             "a recording (BVH, SMPL as .npz, FBX, glTF or USD), or a folder", "choose one")
        return [file for path in chosen for file in (_list_clips_below(path) if path.is_dir() else [path])]

    def do(self, context):
        """Read all files, then create armatures."""
        clips = [clip for path in self.list_paths() for clip in self.read_file(path)]
        active = context.object
        armature_to_reuse = active if self.reuse and active and active.type == "ARMATURE" else None
        if armature_to_reuse is not None:
            self.check_bones(armature_to_reuse, clips, context.scene)
        bodies = []
        for name, clip in clips:
            body = armature_to_reuse or armature.create_armature(context, clip.motion.skeleton, name,
                                                                 context.collection)
            action.write_motion(body, clip.motion, context.scene, name=name)
            bodies.append(body)
            for note in clip.notes:
                self.report({"INFO"}, f"{name}: {note}")
        ends = [channels.find_playing_action(body)[0].frame_range[1] for body in bodies]
        frame_range.fit_range(context.scene, max(ends), bodies)
        window.select_only(context, bodies[-1], *bodies)
        self.report({"INFO"}, f"Clips imported at the scene's frame rate: {len(bodies)}")

    def read_file(self, path: Path) -> "list[tuple[str, BvhClip]]":
        """Read the clips of one file with their names."""
        if not conversions.is_foreign(path):
            return [(path.stem, read_clip(path, self.unit or None))]
        takes = foreign.read_takes(path)
        alone = len(takes) == 1
        return [(path.stem if alone else f"{path.stem} {one.name}", foreign.to_bvh_clip(one.motion)) for one in takes]

    @staticmethod
    def check_bones(body, clips, scene):
        """Check that all clips have the armature's bones (InputError)."""
        skeleton = armature.build_skeleton(body, scene)
        for name, clip in clips:
            if not clip.motion.skeleton.has_same_bones(skeleton, 5e-3):
                found = f"different bones than {body.name}"
                raise InputError(name, found, "the same skeleton", "import it as a new armature")


def _list_clips_below(folder: Path) -> list[Path]:
    found = folder_recordings.find_recordings(folder)
    if not found:
        raise InputError(folder, "no motion clip in the folder", "BVH, FBX, glTF or USD files", "choose another folder")
    return found


class BEYOND_MOCAP_FH_clips(bpy.types.FileHandler):
    """BVH files dropped into a view"""

    bl_idname = "BEYOND_MOCAP_FH_clips"
    bl_label = "Motion Clip"
    bl_import_operator = "beyond_mocap.import_clips"
    bl_file_extensions = ";".join(CLIP_ENDINGS)

    @classmethod
    def poll_drop(cls, context):
        return context.area is not None and context.area.type in {"VIEW_3D", "NLA_EDITOR", "DOPESHEET_EDITOR"}


class BEYOND_MOCAP_FH_foreign_clips(bpy.types.FileHandler):
    """FBX, glTF and USD files dropped into a view; Blender offers its own importers beside this one"""

    bl_idname = "BEYOND_MOCAP_FH_foreign_clips"
    bl_label = "Motion Clip (Beyond Mocap)"
    bl_import_operator = "beyond_mocap.import_clips"
    bl_file_extensions = ";".join(FOREIGN)

    @classmethod
    def poll_drop(cls, context):
        return BEYOND_MOCAP_FH_clips.poll_drop(context)


class BEYOND_MOCAP_OT_mirror(BaseOperator, bpy.types.Operator):
    """Exchange left and right in the active armature's motion: it starts at the same place and facing, but turns and
kicks to the other side; the previous motion stays as an action"""

    bl_idname = "beyond_mocap.mirror"
    bl_label = "Mirror Motion"
    needs = ("Select an armature first", lambda context: context.object is not None and context.object.type
             == "ARMATURE", "The active armature plays no action",
             lambda context: channels.find_playing_action(context.object)[0] is not None)

    def do(self, context):
        body = context.object
        motion = action.read_motion(body, context.scene)
        start, name = action.find_first_frame(body), channels.find_playing_action(body)[0].name
        action.write_motion(body, mirror_in_place(motion), context.scene, start, f"{name} mirrored")


def mirror_in_place(motion: "motions.Motion") -> "motions.Motion":
    """Mirror a motion and place it where the original started, with the same heading."""
    mirrored = mirroring.mirror(motion)
    angle = humanoid.compute_heading(motion)[0] - humanoid.compute_heading(mirrored)[0]
    start = quaternion.rotate(quaternion.from_up_angle(angle), mirrored.root_positions[0])
    offset = np.append((motion.root_positions[0] - start)[:2], 0.0)
    return motions.place_motion(mirrored, angle, offset)


CLIP_CHOICES = (("CHOSEN", "Chosen Clip", "The clip chosen in the library's list"),
                ("SHOWN", "Listed Clips", "All clips that the library's list currently shows"),
                ("SELECTED", "Selected Armatures", "The actions that the selected armatures play"))


class AssetOrder(NamedTuple):
    """The input of making assets.

    Attributes:
        folder: the library's.
        files: (path below the folder, file to read, unit, description) of clips to read.
        drafts: motions that are already in the scene.
    """

    folder: Path
    files: tuple  # (path below the folder, file to read, unit, line about it)
    drafts: tuple


class BEYOND_MOCAP_OT_make_assets(BackgroundOperator, bpy.types.Operator):
    """Make assets of clips: each an action with a picture of its key pose, its labels as tags, in a catalog of its
kind, in this file or as a .blend for a folder of asset libraries"""

    bl_idname = "beyond_mocap.make_assets"
    bl_label = "Clips as Assets"
    kind = "assets"
    which: EnumProperty(name="Clips", items=CLIP_CHOICES, default="CHOSEN", description="Which clips become assets")
    apart: BoolProperty(name="As a File", description="Write the assets to a .blend file and leave this file unchanged",
                        options={"SKIP_SAVE"})
    overwrite: BoolProperty(name="Overwrite", description="Replace an existing file", options={"SKIP_SAVE"})
    filepath: StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"}, description="The .blend to write")
    filter_glob: StringProperty(default="*.blend", options={"HIDDEN"})
    check_existing: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context, event):
        """Open the file browser where a file is to be written."""
        if not self.apart or self.filepath:
            return super().invoke(context, event)
        self.filepath = "clips.blend"
        self.overwrite = True  # the file browser warns of an existing file
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def order(self, context):
        """Collect the clips as plain values."""
        self.check_target()
        settings = context.scene.beyond_mocap
        if self.which == "SELECTED":
            drafts = {one.action: one for one in (_build_draft(rig, context) for rig in _list_playing(context))}
            return AssetOrder(Path(), (), tuple(drafts.values()))
        rows = context.window_manager.beyond_mocap_clips.shown
        chosen = clips.find_active_clip(context.window_manager)
        chosen_rows = list(rows) if self.which == "SHOWN" else [chosen] if chosen else []
        if not chosen_rows:
            raise InputError("assets", "no clip in the list", "clips of the library",
                             "press Build Library or List Clips")
        folder = recordings.find_library_folder(settings)
        files = tuple((row.path, *recordings.find_clip_file(settings, row.path), row.figures) for row in chosen_rows)
        return AssetOrder(folder, files, ())

    def find_target(self) -> Path:
        """Return the .blend to write."""
        return exporters.replace_ending(Path(bpy.path.abspath(self.filepath)), ".blend")

    def check_target(self):
        """Check that the file may be written (InputError)."""
        if not self.apart:
            return
        if not self.filepath:
            raise InputError("assets", "no file given", "a .blend to write", "choose where")
        target = self.find_target()
        if target.exists() and not self.overwrite:
            raise InputError(target, "already exists", "a new file", "choose another name or switch Overwrite on")
        if bpy.data.filepath and target.resolve() == Path(bpy.data.filepath).resolve():
            raise InputError(target, "is the open file", "another file", "switch As a File off instead")

    @staticmethod
    def run_job(order, progress, cancelled, _hurry):
        """Read the motions and render the pictures."""
        from ...beyond_mocap.library.folder.label_files import read_labels

        drafts, pictures, total = [], [], len(order.files) + len(order.drafts)
        for number, (path, file, unit, figures) in enumerate(order.files):
            if cancelled():
                raise UserCancelledError("assets: cancelled")
            progress(number / total, f"Drawing {Path(path).stem}")
            motion = read_clip(file, unit).motion
            rows = read_labels(order.folder / path, order.folder, motion.fps)
            drafts.append(assets.build_draft(Path(path).stem, motion, rows, figures))
            pictures.append(assets.render_picture(drafts[-1]))
        for one in order.drafts:
            drafts.append(one)
            pictures.append(assets.render_picture(one))
        return drafts, pictures

    def apply(self, scene, result):
        """Create the actions; write them to their own file, or leave them here."""
        drafts, pictures = result
        catalogs = {assets.choose_catalog(one.labels) for one in drafts}
        if self.apart:
            target = self.find_target()
            write_asset_file(target, assets.create_assets(bpy.context, drafts, pictures, copy_actions=True), drafts)
            assets.define_catalogs(target.parent, catalogs)
            self.report({"INFO"}, f"{format_count(len(drafts), 'asset')} written to {target}")
            return
        if bpy.data.filepath:
            assets.define_catalogs(Path(bpy.data.filepath).parent, catalogs)
        else:
            self.report({"INFO"}, "To name the catalogs, save this file and make the assets again")
        self.report({"INFO"}, f"Assets in this file: {len(assets.create_assets(bpy.context, drafts, pictures))}")


def write_asset_file(target: Path, actions, drafts) -> None:
    """Write the actions to a .blend, under the names of the drafts, and remove them from this file."""
    originals = {}
    for item, one in zip(actions, drafts):
        if one.action:
            originals[one.action] = own = bpy.data.actions[one.action]
            own.name = f"{one.action} (original)"
            item.name = one.action
    try:
        assets.write_library(target, actions)
    finally:
        bpy.data.batch_remove(actions)
        for name, own in originals.items():
            own.name = name


def _list_playing(context) -> list[bpy.types.Object]:
    """List the selected armatures that play an action of this file; InputError where there are none."""
    rigs = [thing for thing in context.selected_objects if thing.type == "ARMATURE"
            and channels.find_playing_action(thing)[0]]
    if not rigs:
        raise InputError("assets", "no selected armature plays an action", "armatures with motions", "select some")
    for rig in rigs:
        if channels.find_playing_action(rig)[0].library is not None:
            raise InputError(rig.name, "its action belongs to another file", "actions of this file")
        if rig.beyond_mocap_ride.on:
            raise InputError(rig.name, "its path edit is not applied", "an applied motion",
                             "press Apply in Path Editing first")
    return rigs


def _build_draft(rig, context) -> "assets.AssetDraft":
    """Build a draft of what an armature plays, with the labels of its strips where it has any."""
    motion, item = action.read_motion(rig, context.scene), channels.find_playing_action(rig)[0]
    try:
        rows = recordings.read_labels_at(rig, motion.fps, len(motion))
    except InputError:
        rows = ()
    return assets.build_draft(item.name, motion, rows, f"{motion.duration:.1f} s", item.name)
