"""Words of a library's clip as NLA strips on the armature that shows it: opened, proposed, read back.

The strips are a player's own (`lanes`, `lay_strips`); their clock stands at 0 seconds on the frame on which the
armature plays the recording's first.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from ...beyond_mocap.annotation import ClipAnnotation, Timeline, clip_annotations
from ...beyond_mocap.base.errors import InputError
from ..core import action
from ..core.measure import Clock, frames_per_second
from ..core.settings import absolute
from ..library.recordings import FOLDER, PATH
from . import lanes, lay_strips

if TYPE_CHECKING:
    from ...beyond_mocap.motion.motion import Motion

RATE, COUNT = "beyond_mocap_fps", "beyond_mocap_frames"  # custom properties: the recording's own


def shown(thing: bpy.types.Object | None) -> str:
    """The clip (below its library's folder) that an object shows; "" where it shows none."""
    return thing.get(PATH, "") if thing is not None and thing.type == "ARMATURE" else ""


def clip_file(rig: bpy.types.Object) -> tuple[Path, Path]:
    """The file of the clip that an armature shows, and its library's folder."""
    folder = Path(absolute(rig[FOLDER]))
    return folder / rig[PATH], folder


def lay(rig: bpy.types.Object, scene: bpy.types.Scene, motion: "Motion", timeline: Timeline) -> None:
    """Let the armature's strips say `timeline`: seconds from the recording's first frame."""
    lay_strips.check_editable(rig)
    rig[RATE], rig[COUNT] = motion.fps, len(motion)
    lay_strips.write(rig, timeline, _clock(rig, scene), (0.0, motion.duration))


def said(rig: bpy.types.Object) -> tuple[ClipAnnotation, ...]:
    """What the armature's strips say, as rows in frames of the recording; InputError where it has no strips, or where
    they say nothing."""
    if RATE not in rig:
        raise InputError(rig.name, "no strips with words", "a clip opened with Annotate Clip")
    return said_at(rig, rig[RATE], rig[COUNT])


def said_at(rig: bpy.types.Object, fps: float, count: int) -> tuple[ClipAnnotation, ...]:
    """What an armature's strips say, as rows in frames of a motion of `count` frames at `fps`; InputError as `said`."""
    from ...beyond_mocap.library.keep_words import within

    timeline = lanes.read(rig, f"strips of {rig.name}")
    rows = within(clip_annotations(timeline, fps), count) if timeline is not None else ()
    if not rows:
        raise InputError(rig.name, "strips that say nothing", "at least one strip or marker", "press Propose Words")
    return rows


def remove(rig: bpy.types.Object) -> None:
    """Take the armature, its body and its actions out of the file, where nobody else uses them. What the user hung on
    it stays where it is, and an action that was made an asset stays too."""
    things = [rig, *(child for child in rig.children if _moved_by(child, rig))]
    for child in rig.children:
        if child not in things:
            place = child.matrix_world.copy()
            child.parent, child.matrix_world = None, place
    data = [thing.data for thing in things if thing.data is not None and thing.data.users == 1]
    strips = [strip.action for _, strip in lanes.strips(rig)] if lanes.has(rig) else []
    playing = rig.animation_data.action if rig.animation_data is not None else None
    actions = {item.name: item for item in [*strips, playing] if item is not None}
    bpy.data.batch_remove(things)
    bpy.data.batch_remove(data)
    unused = [item for item in actions.values() if item.users - item.use_fake_user <= 0]
    bpy.data.batch_remove([item for item in unused if item.asset_data is None])


def _moved_by(thing: bpy.types.Object, rig: bpy.types.Object) -> bool:
    """Whether an object is a mesh that the armature bends, as its body is."""
    return thing.type == "MESH" and any(one.type == "ARMATURE" and one.object == rig for one in thing.modifiers)


def _clock(rig: bpy.types.Object, scene: bpy.types.Scene) -> Clock:
    first = action.first_frame(rig)
    return Clock(float(scene.frame_start if first is None else first), 0.0, frames_per_second(scene))
