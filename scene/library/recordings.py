"""Single recordings of the library in the scene: as recorded, on an armature of their own, with their labels as NLA
strips.

The strips are of the same kind as a player's (`lanes`, `lay_strips`); their clock is at 0 seconds on the frame on which
the armature plays the recording's first.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from ...beyond_mocap.annotation import ClipAnnotation, Timeline, build_clip_annotations
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.fixes import Fix
from ..core import action, preferences, window
from ..core.measure import Clock, frames_per_second
from ..core.settings import to_absolute_path
from ..rigs import armature
from ..stage import body
from ..timeline import label_tracks as lanes
from ..timeline import strip_writing as lay_strips

if TYPE_CHECKING:
    from ...beyond_mocap.motion.motion import Motion

PATH, FOLDER = "beyond_mocap_clip", "beyond_mocap_library"  # custom properties of an armature that shows a clip
SHIRT = (0.75, 0.05, 0.06)
RATE, COUNT = "beyond_mocap_fps", "beyond_mocap_frames"  # custom properties: the recording's own


def find_library_folder(settings) -> Path:
    """Return the library's folder."""
    return Path(to_absolute_path(settings.library_folder))


def find_clip_file(settings, path: str, folder: str = "") -> tuple[Path, float | None]:
    """Find the BVH file to read for a clip.

    Args:
        settings: of the scene.
        path: below the library's folder.
        folder: as a setting spells it; empty for the scene's own.
    Returns:
        The file, and metres per unit (None: guessed).
    Raises:
        InputError: if the file is missing or not converted yet.
    """
    from ...beyond_mocap.library import cache
    from ...beyond_mocap.library.folder.conversions import Conversions, is_foreign

    library_folder = Path(to_absolute_path(folder)) if folder else find_library_folder(settings)
    file = library_folder / path
    conversions = Conversions(library_folder,
                              cache.find_cache_folder(library_folder,
                                                      preferences.find_cache_folder(str(library_folder)))[0])
    if not file.is_file():
        raise InputError(file, "no such file", "a clip of the library", "press Build Library to update the list",
                         fixes=(Fix("press", "beyond_mocap.build_library"),))
    if not conversions.is_current(file):
        raise InputError(file, "not converted yet", "a converted clip", "press Build Library",
                         fixes=(Fix("press", "beyond_mocap.build_library"),))
    return conversions.find_readable_file(file), None if is_foreign(file) else settings.library_unit or None


def read_recording(settings, path: str, folder: str = "") -> tuple["Motion", tuple[str, ...]]:
    """Read the motion of a clip and its reader's notes; arguments and errors as `find_clip_file`."""
    from ...beyond_mocap.files.clip_file import read_clip

    clip = read_clip(*find_clip_file(settings, path, folder))
    return clip.motion, clip.notes


def show_recording(context: bpy.types.Context, motion: "Motion", path: str, dressed: bool) -> bpy.types.Object:
    """Create an armature that plays a clip from the scene's first frame, selected and active; returns it."""
    scene, name = context.scene, Path(path).stem
    rig = armature.create_armature(context, motion.skeleton, name, context.collection)
    rig[PATH], rig[FOLDER] = path, scene.beyond_mocap.library_folder
    action.write_motion(rig, motion, scene, name=name)
    if dressed:
        body.create_character(rig, name, SHIRT, collection=context.collection, scene=scene, example=motion)
    window.select_only(context, rig)
    return rig


def find_shown_clip(thing: bpy.types.Object | None) -> str:
    """Return the clip (below its library's folder) that an object shows; "" where it shows none."""
    return thing.get(PATH, "") if thing is not None and thing.type == "ARMATURE" else ""


def find_source_file(rig: bpy.types.Object) -> tuple[Path, Path]:
    """Return the file of the clip that an armature shows, and its library's folder."""
    folder = Path(to_absolute_path(rig[FOLDER]))
    return folder / rig[PATH], folder


def write_labels(rig: bpy.types.Object, scene: bpy.types.Scene, motion: "Motion", timeline: Timeline) -> None:
    """Write `timeline`, in seconds from the recording's first frame, to the armature's strips."""
    lay_strips.check_editable(rig)
    rig[RATE], rig[COUNT] = motion.fps, len(motion)
    lay_strips.write_timeline(rig, timeline, _build_clock(rig, scene), (0.0, motion.duration))


def read_labels(rig: bpy.types.Object) -> tuple[ClipAnnotation, ...]:
    """Read the armature's strips as rows in frames of the recording; InputError where there are no strips or no labels.
    """
    if RATE not in rig:
        raise InputError(rig.name, "no strips with labels", "a clip opened with Annotate Clip")
    return read_labels_at(rig, rig[RATE], rig[COUNT])


def read_labels_at(rig: bpy.types.Object, fps: float, count: int) -> tuple[ClipAnnotation, ...]:
    """Read an armature's strips in frames of a motion of `count` frames at `fps`; InputError as `read_labels`."""
    from ...beyond_mocap.library.folder.label_files import limit_rows

    timeline = lanes.read_timeline(rig, f"strips of {rig.name}")
    rows = limit_rows(build_clip_annotations(timeline, fps), count) if timeline is not None else ()
    if not rows:
        raise InputError(rig.name, "no labels in the strips", "at least one strip or marker", "press Propose Labels",
                         fixes=(Fix("press", "beyond_mocap.propose_words"),))
    return rows


def remove_clip(rig: bpy.types.Object) -> None:
    """Remove the armature, its body and its actions from the file where nothing else uses them.

    Objects that the user parented to it stay in place, and an action that was made an asset stays too.
    """
    things = [rig, *(child for child in rig.children if _is_deformed_by(child, rig))]
    for child in rig.children:
        if child not in things:
            place = child.matrix_world.copy()
            child.parent, child.matrix_world = None, place
    data = [thing.data for thing in things if thing.data is not None and thing.data.users == 1]
    strips = [strip.action for _, strip in lanes.iter_strips(rig)] if lanes.has_label_tracks(rig) else []
    playing = rig.animation_data.action if rig.animation_data is not None else None
    actions = {item.name: item for item in [*strips, playing] if item is not None}
    bpy.data.batch_remove(things)
    bpy.data.batch_remove(data)
    unused = [item for item in actions.values() if item.users - item.use_fake_user <= 0]
    bpy.data.batch_remove([item for item in unused if item.asset_data is None])


def _is_deformed_by(thing: bpy.types.Object, rig: bpy.types.Object) -> bool:
    """Whether an object is a mesh that the armature deforms, as its body is."""
    return thing.type == "MESH" and any(one.type == "ARMATURE" and one.object == rig for one in thing.modifiers)


def _build_clock(rig: bpy.types.Object, scene: bpy.types.Scene) -> Clock:
    first = action.find_first_frame(rig)
    return Clock(float(scene.frame_start if first is None else first), 0.0, frames_per_second(scene))
