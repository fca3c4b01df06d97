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
- `overlays`   what is drawn over the 3D view; `quality`, `error_curves` what a report says, in the file
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
"""

from .core import registration, session
from .core.live import start_watching, stop_watching
from .markers import kept
from .match import child


def register():
    """Register the data classes, attach them to Blender's own data, and begin to watch."""
    registration.register_package(__name__)
    start_watching()


def unregister():
    """End what runs, undo what was registered, and forget what was kept in memory."""
    stop_watching()
    child.end_all()
    registration.unregister_package(__name__)
    session.clear()
    kept.clear()
