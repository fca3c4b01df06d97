"""Import Motion Clips: BVH, FBX, glTF or USD files, one, many or a folder of them, each as an armature with an
action."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty

from ..beyond_mocap.errors import InputError
from ..beyond_mocap.files import bvh
from ..beyond_mocap.library.converted import FOREIGN, is_foreign
from ..beyond_mocap.library.scan import find_recordings
from ..scene import action, armature, foreign
from .verb import ImportVerb


class BEYOND_MOCAP_OT_import_clips(ImportVerb, bpy.types.Operator):
    """Import motion clips (BVH, FBX, glTF, USD) as armatures; choose files, or a folder without a file for all below
it. Of a file with a body only the motion is taken, hips up and in metres"""

    bl_idname = "beyond_mocap.import_clips"
    bl_label = "Import Motion Clips"
    filename_ext = ".bvh"

    filter_glob: StringProperty(default=";".join(f"*{ending}" for ending in (".bvh", *FOREIGN)), options={"HIDDEN"})
    unit: FloatProperty(
        name="Metres per unit", default=0.0, min=0.0, precision=5,
        description="Size of one unit of the file in metres; 0 guesses it from the height of the hips",
    )
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
        for other in context.selected_objects:
            other.select_set(False)
        for body in made:
            body.select_set(True)
        context.view_layer.objects.active = made[-1]
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
        """Where animators keep motions."""
        return context.area is not None and context.area.type in {"VIEW_3D", "NLA_EDITOR", "DOPESHEET_EDITOR"}


class BEYOND_MOCAP_FH_foreign_clips(bpy.types.FileHandler):
    """FBX, glTF and USD files dropped into a view; Blender offers its own importers beside this one"""

    bl_idname = "BEYOND_MOCAP_FH_foreign_clips"
    bl_label = "Motion clip (Beyond Mocap)"
    bl_import_operator = "beyond_mocap.import_clips"
    bl_file_extensions = ";".join(FOREIGN)

    @classmethod
    def poll_drop(cls, context):
        """Where animators keep motions."""
        return BEYOND_MOCAP_FH_clips.poll_drop(context)
