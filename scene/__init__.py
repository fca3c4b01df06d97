"""Blender's own data: what the core's motions, tracks and clips become in a file. No buttons here.

- `measure`     metres and seconds against the scene's units and frames
- `armature`, `action`   skeletons and motions, both ways
- `linked`    refuses what belongs to another file
- `channels`    curves in bulk; alone knows slots and channelbags
- `body`, `ball`, `curve`, `pitch`, `stage`, `material`   what is seen
- `settings`    what the panels show, per scene; `session` what lives as long as Blender runs
- `preferences` what the user sets once for all files
- `tracks`, `plans`   the settings as tracks and plans of the core; `drawn_track` curves and moving objects as tracks,
                `drawn_labels` their speeds in the view; `pins` Empties where hands, feet and gaze have to be
- `core`        the one watcher, on which everything that looks by itself stands; what is hung over the windows
- `live`        sees that a player's track, pins or strips have been edited, and has him updated
- `bake`        a take becomes all of that
- `result`, `preview`, `set_aside`, `blocks`   a take is shown, kept or put away again; as one action or as NLA strips
- `dots`        an Empty for each player that runs along the track; `clock` its seconds against frames
- `strips`      a player's timeline as NLA strips on his dot; `lanes` reads, `lay_strips` writes those of any object,
                `strip_lines` is what one of them says, `strip_events` puts in order what users do to them
- `subject`     whose timeline is meant; `word_checks` what is wrong with it; `moment_names` drawn in the NLA editor
- `migrate`   what earlier versions have saved
- `view_settings`, `overlays`   what is drawn over the 3D view; `quality`, `error_curves` what a report says, in the
  file
- `background`  long work in a thread; `queue`, `orders` which player is made next, and of what
- `freshness`   what is out of date; `hand_keys` what of a result is the user's; `variants`, `stretch` other solutions
- `rig`, `bone_maps`, `rig_bake`, `rig_copy`   a motion onto somebody's own rig, by a map of its bones; `rigs` what that
  takes
- `key_reduction`   keys that curves do not need are left out
- `ride`        path editing: armatures whose motion rides a curve
- `passes`      the ball and who keeps it going: hit analysis, passing scenes, who carries the ball, the solved ball
- `aimed`       a ball aimed at a target that can be dragged; rigid bodies take it over
- `throws`      throws and kicks at a target, made by a network
- `stream`      a body that arrives over this machine's own network while it moves
- `markers`     a recording of optical markers as a cloud that plays, and the way from it to a body
- `match`       a stretch of a whole match: everybody in kit, pitch, ball, cameras, and the process that makes it
- `export`      motions as files of Blender's exporters; `deliver` a take likewise, for the command line
- `proposals`   words that were proposed for a clip, to be accepted or refused one by one
- `clips`, `watch`   the library's clips as a list; whether its folder has changed

The classes are registered in the order of CLASSES: what others point to comes first.
"""

import bpy

from . import (  # noqa: F401  (watchers are known once their modules are)
    clips, dots, drawn_labels, freshness, lanes, live, migrate, moment_names, pins, proposals, result, rig,
    session, settings, strip_events, strip_lines, video, view_settings, watch, word_checks,
)
from .aimed import live as aimed_live  # noqa: F401
from .aimed import settings as aimed
from .core import live as core_live
from .markers import kept as kept_markers
from .markers import labels as marker_labels  # noqa: F401
from .markers import settings as markers
from .match import child as match_child
from .match import settings as match
from .overlays import draw, store  # noqa: F401
from .passes import hits_shown  # noqa: F401
from .passes import live as passes_live  # noqa: F401
from .passes import settings as passes
from .ride import live as ride_live  # noqa: F401
from .ride import measure as ride_measure  # noqa: F401
from .ride.settings import BeyondMocapRide
from .stream import follow as stream_follow  # noqa: F401
from .stream import play  # noqa: F401
from .stream import receiver  # noqa: F401
from .stream import settings as stream
from .throws import live as throws_live  # noqa: F401
from .throws import settings as throws

CLASSES = (
    *result.CLASSES,
    BeyondMocapRide,
    *passes.CLASSES,
    *stream.CLASSES,
    aimed.BeyondMocapAim,
    throws.BeyondMocapThrow,
    *markers.CLASSES,
    *match.CLASSES,
    video.BeyondMocapVideo,
    view_settings.BeyondMocapView,
    view_settings.BeyondMocapPlayhead,
    strip_lines.BeyondMocapLine,
    lanes.BeyondMocapLanes,
    *proposals.CLASSES,
    dots.BeyondMocapDot,
    word_checks.BeyondMocapProblem,
    word_checks.BeyondMocapProblems,
    rig.BeyondMocapRigBone,
    rig.BeyondMocapRig,
    pins.BeyondMocapPin,
    settings.BeyondMocapPlayer,
    settings.BeyondMocapSettings,
    settings.BeyondMocapWork,
    *clips.CLASSES,
    freshness.BeyondMocapStale,
)
KEPT_WITH = (  # what Blender's own data carries of ours: type, property, class
    ("Action", "beyond_mocap", strip_lines.BeyondMocapLine),
    ("TimelineMarker", "beyond_mocap", strip_lines.BeyondMocapLine),
    ("Object", "beyond_mocap_lanes", lanes.BeyondMocapLanes),
    ("Object", "beyond_mocap_proposals", proposals.BeyondMocapProposals),
    ("Object", "beyond_mocap_dot", dots.BeyondMocapDot),
    ("Object", "beyond_mocap_ride", BeyondMocapRide),
    ("Object", "beyond_mocap_hits", passes.BeyondMocapHits),
    ("Object", "beyond_mocap_ball", passes.BeyondMocapBall),
    ("Object", "beyond_mocap_aim", aimed.BeyondMocapAim),
    ("Object", "beyond_mocap_throw", throws.BeyondMocapThrow),
    ("Object", "beyond_mocap_cloud", markers.BeyondMocapCloud),
    ("Scene", "beyond_mocap", settings.BeyondMocapSettings),
    ("Scene", "beyond_mocap_markers", markers.BeyondMocapMarkers),
    ("Scene", "beyond_mocap_match", match.BeyondMocapMatch),
    ("Scene", "beyond_mocap_passes", passes.BeyondMocapPasses),
    ("Scene", "beyond_mocap_stream", stream.BeyondMocapStream),
    ("WindowManager", "beyond_mocap_streaming", stream.BeyondMocapStreaming),
    ("WindowManager", "beyond_mocap_problems", word_checks.BeyondMocapProblems),
    ("WindowManager", "beyond_mocap_work", settings.BeyondMocapWork),
    ("WindowManager", "beyond_mocap_playhead", view_settings.BeyondMocapPlayhead),
    ("WindowManager", "beyond_mocap_clips", clips.BeyondMocapClips),
)


def register():
    """Register the data classes, in order, and hang them on Blender's own data."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    for owner, name, cls in KEPT_WITH:
        setattr(getattr(bpy.types, owner), name, bpy.props.PointerProperty(type=cls))
    freshness.register()
    core_live.register()


def unregister():
    """Stop what runs and forget what was made; unregister the data classes, the last one first."""
    core_live.unregister()
    freshness.unregister()
    match_child.end_all()
    session.clear()
    kept_markers.clear()
    for owner, name, _ in reversed(KEPT_WITH):
        delattr(getattr(bpy.types, owner), name)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
