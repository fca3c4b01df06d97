"""Clips as Assets: actions for the Asset Browser, in this file or as a library of their own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ..beyond_mocap.errors import Cancelled, InputError
from ..scene import action, assets, channels, clip_annotation, clips, export, recordings
from .verb import BackgroundVerb

WHICH = (
    ("CHOSEN", "Chosen Clip", "The clip chosen in the library's list"),
    ("SHOWN", "Clips Shown", "All clips that the library's list shows now"),
    ("SELECTED", "Selected Armatures", "The actions that the selected armatures play"),
)


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
    apart: BoolProperty(
        name="As a File", description="Write a .blend of their own and leave this file as it is", options={"SKIP_SAVE"}
    )
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
            raise InputError(
                "assets", "no clip in the list", "clips of the library", "press Build Library or List Clips"
            )
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
        from ..beyond_mocap.files import bvh
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
            raise InputError(
                rig.name, "its motion still rides a path", "a motion of its own", "press Keep in Path Editing first"
            )
    return rigs


def _draft_of(rig, context) -> assets.Draft:
    """What an armature plays, with the words of its strips where it has any."""
    motion, item = action.read(rig, context.scene), channels.playing(rig)[0]
    try:
        rows = clip_annotation.said_at(rig, motion.fps, len(motion))
    except InputError:
        rows = ()
    return assets.draft(item.name, motion, rows, f"{motion.duration:.1f} s", item.name)
