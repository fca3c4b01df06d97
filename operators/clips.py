"""Motion clips in the scene: import them, mirror them, make assets of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ..beyond_mocap.base.errors import Cancelled, InputError
from ..beyond_mocap.files.bvh import bvh
from ..beyond_mocap.library.scan import FOREIGN, find_recordings, is_foreign
from ..beyond_mocap.motion import humanoid
from ..beyond_mocap.motion.mirror import mirror
from ..beyond_mocap.motion.motion import Motion, place
from ..beyond_mocap.motion.quaternion import about_up, rotate
from ..scene.core import action, channels, window
from ..scene.library import assets, clips, foreign, recordings
from ..scene.rigs import armature, export
from .verb import BackgroundVerb, ImportVerb, Verb


class BEYOND_MOCAP_OT_import_clips(ImportVerb, bpy.types.Operator):
    """Import motion clips (BVH, FBX, glTF, USD) as armatures; choose files, or a folder without a file for all below
it. Of a file with a body only the motion is taken, hips up and in metres"""

    bl_idname = "beyond_mocap.import_clips"
    bl_label = "Import Motion Clips"
    filename_ext = ".bvh"
    filter_glob: StringProperty(default=";".join(f"*{ending}" for ending in (".bvh", *FOREIGN)), options={"HIDDEN"})
    unit: FloatProperty(name="Metres per unit", default=0.0, min=0.0, precision=5,
                        description="Size of one unit of the file in metres; 0 guesses it from the height of the hips")
    reuse: BoolProperty(
        name="Onto Selected Armature", default=False,
        description="Add the clips' actions to the active armature, if its bones are the same, and make no new one",
    )

    def paths(self) -> list[Path]:
        """The chosen files, and all below a chosen folder."""
        chosen = self.chosen() or ([Path(self.directory)] if self.directory else [])
        if not chosen:
            raise InputError("import", "no file given", "a .bvh file or a folder", "choose one")
        return [file for path in chosen for file in (_all_below(path) if path.is_dir() else [path])]

    def do(self, context):
        """Read all files, then make armatures."""
        clips = [clip for path in self.paths() for clip in self.read(path)]
        own = context.object if self.reuse and context.object and context.object.type == "ARMATURE" else None
        if own is not None:
            self.check_bones(own, clips, context.scene)
        made = []
        for name, clip in clips:
            body = own or armature.create(context, clip.motion.skeleton, name, context.collection)
            action.write(body, clip.motion, context.scene, name=name)
            made.append(body)
            for note in clip.notes:
                self.report({"INFO"}, f"{name}: {note}")
        window.select_only(context, made[-1], *made)
        self.report({"INFO"}, f"clips imported at the scene's frame rate: {len(made)}")

    def read(self, path: Path) -> list[tuple[str, bvh.BvhClip]]:
        """The clips of one file with their names."""
        if not is_foreign(path):
            return [(path.stem, bvh.read(path, self.unit or None))]
        takes = foreign.read(path)
        alone = len(takes) == 1
        return [(path.stem if alone else f"{path.stem} {one.name}", foreign.as_clip(one.motion)) for one in takes]

    @staticmethod
    def check_bones(body, clips, scene):
        """InputError where a clip has other bones than the armature."""
        skeleton = armature.skeleton_of(body, scene)
        for name, clip in clips:
            if not clip.motion.skeleton.same_bones(skeleton, 5e-3):
                found = f"other bones than {body.name}"
                raise InputError(name, found, "the same skeleton", "import it as a new armature")


def _all_below(folder: Path) -> list[Path]:
    found = find_recordings(folder)
    if not found:
        raise InputError(folder, "no motion clip below it", "BVH, FBX, glTF or USD files", "choose another folder")
    return found


class BEYOND_MOCAP_FH_clips(bpy.types.FileHandler):
    """BVH files dropped into a view"""

    bl_idname = "BEYOND_MOCAP_FH_clips"
    bl_label = "Motion clip"
    bl_import_operator = "beyond_mocap.import_clips"
    bl_file_extensions = ".bvh"

    @classmethod
    def poll_drop(cls, context):
        return context.area is not None and context.area.type in {"VIEW_3D", "NLA_EDITOR", "DOPESHEET_EDITOR"}


class BEYOND_MOCAP_FH_foreign_clips(bpy.types.FileHandler):
    """FBX, glTF and USD files dropped into a view; Blender offers its own importers beside this one"""

    bl_idname = "BEYOND_MOCAP_FH_foreign_clips"
    bl_label = "Motion clip (Beyond Mocap)"
    bl_import_operator = "beyond_mocap.import_clips"
    bl_file_extensions = ";".join(FOREIGN)

    @classmethod
    def poll_drop(cls, context):
        return BEYOND_MOCAP_FH_clips.poll_drop(context)


class BEYOND_MOCAP_OT_mirror(Verb, bpy.types.Operator):
    """Exchange left and right in the active armature's motion: it begins at the same place and looks the same way, but
turns and kicks to the other side. The motion before is kept as an action"""

    bl_idname = "beyond_mocap.mirror"
    bl_label = "Mirror Motion"
    needs = ("Select an armature first",
             lambda context: context.object is not None and context.object.type == "ARMATURE",
             "The active armature plays no action", lambda context: channels.playing(context.object)[0] is not None)

    def do(self, context):
        body = context.object
        motion = action.read(body, context.scene)
        start, name = action.first_frame(body), channels.playing(body)[0].name
        action.write(body, mirrored_in_place(motion), context.scene, start, f"{name} mirrored")


def mirrored_in_place(motion: Motion) -> Motion:
    """The mirrored motion, put where the motion began and facing as it did."""
    twin = mirror(motion)
    turn = humanoid.heading(motion)[0] - humanoid.heading(twin)[0]
    begun = rotate(about_up(turn), twin.root_positions[0])
    offset = np.append((motion.root_positions[0] - begun)[:2], 0.0)
    return place(twin, turn, offset)


WHICH = (("CHOSEN", "Chosen Clip", "The clip chosen in the library's list"),
         ("SHOWN", "Clips Shown", "All clips that the library's list shows now"),
         ("SELECTED", "Selected Armatures", "The actions that the selected armatures play"))


@dataclass(frozen=True, eq=False)
class Order:
    """What is to become assets: files of clips that are to be read, and drafts that are already."""

    folder: Path
    files: tuple  # (path below the folder, file to read, unit, line about it)
    drafts: tuple


class BEYOND_MOCAP_OT_make_assets(BackgroundVerb, bpy.types.Operator):
    """Make assets of clips: each an action with a picture of its key pose, its words as tags, in a catalog of its kind.
In this file, or as a .blend that you keep in a folder of asset libraries"""

    bl_idname = "beyond_mocap.make_assets"
    bl_label = "Clips as Assets"
    kind = "assets"
    which: EnumProperty(name="Clips", items=WHICH, default="CHOSEN", description="Which clips become assets")
    apart: BoolProperty(name="As a File", description="Write a .blend of their own and leave this file as it is",
                        options={"SKIP_SAVE"})
    overwrite: BoolProperty(name="Overwrite", description="Replace a file that is there", options={"SKIP_SAVE"})
    filepath: StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"}, description="The .blend to write")
    filter_glob: StringProperty(default="*.blend", options={"HIDDEN"})
    check_existing: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context, event):
        """Ask where to, where a file of its own is wanted."""
        if not self.apart or self.filepath:
            return super().invoke(context, event)
        self.filepath = "clips.blend"
        self.overwrite = True  # the file browser warns of a file that is there
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def order(self, context):
        """Which clips, as plain values."""
        self.check_target()
        settings = context.scene.beyond_mocap
        if self.which == "SELECTED":
            drafts = {one.action: one for one in (_draft_of(rig, context) for rig in _playing(context))}
            return Order(Path(), (), tuple(drafts.values()))
        rows = context.window_manager.beyond_mocap_clips.shown
        chosen = clips.active(context.window_manager)
        wanted = list(rows) if self.which == "SHOWN" else [chosen] if chosen else []
        if not wanted:
            raise InputError("assets", "no clip in the list", "clips of the library",
                             "press Build Library or List Clips")
        folder = recordings.folder_of(settings)
        files = tuple((row.path, *recordings.file_of(settings, row.path), row.figures) for row in wanted)
        return Order(folder, files, ())

    def target(self) -> Path:
        """The .blend to write."""
        return export.with_ending(Path(bpy.path.abspath(self.filepath)), ".blend")

    def check_target(self):
        """InputError where the file may not be written."""
        if not self.apart:
            return
        if not self.filepath:
            raise InputError("assets", "no file given", "a .blend to write", "choose where")
        target = self.target()
        if target.exists() and not self.overwrite:
            raise InputError(target, "is there already", "a new file", "choose another name, or say Overwrite")
        if bpy.data.filepath and target.resolve() == Path(bpy.data.filepath).resolve():
            raise InputError(target, "is the file that is open", "another file", "leave As a File away instead")

    @staticmethod
    def work(order, progress, cancelled, _hurry):
        """Read the motions and draw the pictures."""
        from ..beyond_mocap.files.bvh import bvh
        from ..beyond_mocap.library.keep_words import read_words

        drafts, pictures, total = [], [], len(order.files) + len(order.drafts)
        for number, (path, file, unit, told) in enumerate(order.files):
            if cancelled():
                raise Cancelled("assets: cancelled")
            progress(number / total, f"Drawing {Path(path).stem}")
            motion = bvh.read(file, unit).motion
            rows = read_words(order.folder / path, order.folder, motion.fps)
            drafts.append(assets.draft(Path(path).stem, motion, rows, told))
            pictures.append(assets.picture(drafts[-1]))
        for one in order.drafts:
            drafts.append(one)
            pictures.append(assets.picture(one))
        return drafts, pictures

    def apply(self, scene, result):
        """Make the actions; write them into their own file, or leave them here."""
        drafts, pictures = result
        catalogs = {assets.catalog_of(one.words) for one in drafts}
        if self.apart:
            target = self.target()
            write_apart(target, assets.make(bpy.context, drafts, pictures, apart=True), drafts)
            assets.define_catalogs(target.parent, catalogs)
            self.report({"INFO"}, f"{len(drafts)} assets written to {target}")
            return
        if bpy.data.filepath:
            assets.define_catalogs(Path(bpy.data.filepath).parent, catalogs)
        else:
            self.report({"INFO"}, "their catalogs get their names when this file is saved and this is done again")
        self.report({"INFO"}, f"assets in this file: {len(assets.make(bpy.context, drafts, pictures))}")


def write_apart(target: Path, made, drafts) -> None:
    """The actions into a .blend, under the names of the drafts; they are taken out of this file again."""
    taken = {}
    for item, one in zip(made, drafts):
        if one.action:
            taken[one.action] = own = bpy.data.actions[one.action]
            own.name = f"{one.action} (original)"
            item.name = one.action
    try:
        assets.write_library(target, made)
    finally:
        bpy.data.batch_remove(made)
        for name, own in taken.items():
            own.name = name


def _playing(context) -> list[bpy.types.Object]:
    """The selected armatures that play an action of this file."""
    rigs = [thing for thing in context.selected_objects if thing.type == "ARMATURE" and channels.playing(thing)[0]]
    if not rigs:
        raise InputError("assets", "no selected armature plays an action", "armatures with motions", "select them")
    for rig in rigs:
        if channels.playing(rig)[0].library is not None:
            raise InputError(rig.name, "its action belongs to another file", "actions of this file")
        if rig.beyond_mocap_ride.on:
            raise InputError(rig.name, "its motion still rides a path", "a motion of its own",
                             "press Keep in Path Editing first")
    return rigs


def _draft_of(rig, context) -> assets.Draft:
    """What an armature plays, with the words of its strips where it has any."""
    motion, item = action.read(rig, context.scene), channels.playing(rig)[0]
    try:
        rows = recordings.read_words_at(rig, motion.fps, len(motion))
    except InputError:
        rows = ()
    return assets.draft(item.name, motion, rows, f"{motion.duration:.1f} s", item.name)
