"""Settings of one player's synthesis, of the clock, and of results in Blender."""
# fmt: off

from collections.abc import Iterable
from dataclasses import replace

from ..errors import InputError
from .setting import BETWEEN, Setting

MAX_SPEED = 12.0
"""m/s; no player runs faster, so a sample that would need it is wrong."""
METHODS = (
    ("path", "Path Following", "Place the body on the track and keep the sway of the clips"),
    ("distance", "Distance", "Match the travelled distance by adding or removing steps, then by warping time"),
    ("blocks", "Blocks", "Find the smoothest sequence of clips for the labels, without following the track"),
    ("fs", "Sliding Blocks", "Put the clips of Blocks on the track: the distance is not matched, and feet slide"),
    ("baseline", "Gait Loops", "Loop the recording of each gait that is nearest in speed on the track; no actions"),
)
FEET = (
    ("any", "Any", "No preferred foot"), ("left", "Left", "Key moments without a side prefer clips of the left foot"),
    ("right", "Right", "Key moments without a side prefer clips of the right foot"),
)
MASSES = (
    ("men", "Men", "Mean shares of men (de Leva 1996)"), ("women", "Women", "Mean shares of women (de Leva 1996)"),
)
FORMS = (
    ("ACTION", "Action", "One action on the body"),
    ("STRIPS", "Strips", "NLA strips on the body, one for each piece of a clip, named by clip and labels"),
)


def parse_gait_clips(texts: Iterable[str]) -> tuple[tuple[str, str], ...]:
    """Parse texts of the form "LABEL=CLIP" to (gait label, clip) pairs; blanks around either are removed.

    Raises:
        InputError: for any other text, and for a label that comes twice.
    """
    pairs = []
    for text in texts:
        label, _, clip = (part.strip() for part in text.partition("="))
        if not label or not clip:
            raise InputError("gait clips", f"{text!r}", "LABEL=CLIP, such as walking=folder/walk.bvh")
        if label.lower() in dict(pairs):
            raise InputError("gait clips", f"{label!r} twice", "one clip for each gait")
        pairs.append((label.lower(), clip.replace("\\", "/")))
    return tuple(pairs)


BODY = (
    Setting(name="strength", default=4.5, least=2.0, most=8.0, unit="body weights", option="--strength",
            metavar="WEIGHTS", help="greatest vertical force of the legs in body weights; default %(default)g",
            tooltip="Greatest vertical force of the legs in body weights: weak legs fly lower, and land softer",
            methods="path"),
    Setting(name="masses", default="men", choices=MASSES, option="--masses", help="whose segment masses the body has; "
            "default %(default)s", title="Segment Masses", tooltip="Whose segment masses decide where the body's "
            "centre of mass is", methods="path"),
    Setting(name="fatigue", default=0.0, least=0.0, most=1.0, expected=BETWEEN, option="--fatigue", metavar="SHARE",
            help="how deeply the body breathes after sprints, 0 for not at all; default %(default)g",
            tooltip="How deeply chest and shoulders breathe, and how far the trunk slumps, after sprints; 0 keeps them "
            "as in the clips", methods="path"),
)
"""Of the bodies of a match, whose players all follow their tracks."""
_FATIGUE = replace(BODY[-1], help="how deeply the body breathes after sprints ('path'), 0 for not at all; default "
                   "%(default)g", tooltip="For Path Following: how deeply chest and shoulders breathe, and how far the "
                   "trunk slumps, after sprints; 0 keeps them as in the clips")

TABLES = {
    "synthesis": (
        Setting(name="method", default="path", choices=METHODS, option="--method", tooltip="How the body follows the "
                "track", in_preset=True),
        Setting(name="catch_up", default=True, option="--no-catch-up", help="'distance' without regaining lost "
                "distance", tooltip="Let the body catch up with the track smoothly after each time warp",
                in_preset=True, methods="distance"),
        Setting(name="fps", default=30.0, unit="frames per second", option="--fps", identifier="rate",
                title="Frame Rate", tooltip="Frames per second of the result; the scene keeps its own rate",
                in_preset=True, option_more=dict(least=1.0, most=480.0), panel_more=dict(min=10.0, max=240.0)),
        Setting(name="seed", default=0, option="--seed", help="seed of the player's habits of watching the ball, and "
                "of the clustering for blocks and distance",
                tooltip="Random seed of how the player watches the ball, and of the clustering for Blocks and Distance",
                in_preset=True, option_more=dict(least=0, most=2**31 - 1), panel_more=dict(min=0)),
        Setting(name="solve_touches", default=True, option="--no-solve-touches", help="use the ball as in the track; "
                "otherwise key moments move to the touches found in its samples, and it follows physics, is dribbled "
                "step by step and keeps out of the body",
                tooltip="Move key moments to the touches found in the ball's samples, within 0.4 s, and let the ball "
                "follow physics and the dribbling feet, and keep out of the body", in_preset=True),
        Setting(name="recorded_ball", default=False, option="--recorded-ball", help="where the track has no ball, "
                "that of the recordings rides along", tooltip="Where the track has no ball, let the ball of the "
                "recordings ride along on the body, in kicks and dribbles too", in_preset=True),
        Setting(name="alpha", default=0.2, least=0.0, most=1.0, expected=BETWEEN, option="--alpha", metavar="SHARE",
                help="weight of labels against continuity; default %(default)g", title="Label Weight", tooltip="Weight "
                "of labels against smooth transitions: 0 for smooth transitions only, 1 for labels only",
                in_preset=True, tuning=True, methods="path distance blocks fs"),
        Setting(name="delta", default=0.5, least=0.0, most=100.0, unit="metres", expected=BETWEEN, option="--delta",
                help="error of the travelled distance that is accepted ('distance'); below 0.1 nothing fits closer, "
                "since steps are chosen to 0.1 m; default %(default)g",
                title="Distance Tolerance", tooltip="For Distance: error of a stretch's travelled distance up to which "
                "no steps are added or removed; they are chosen to 0.1 m, so less fits no closer",
                in_preset=True, methods="distance", tuning=True, panel_more=dict(unit="LENGTH", subtype="DISTANCE")),
        Setting(name="catch_up_window", default=2.0, least=0.1, most=60.0, unit="seconds", expected=BETWEEN,
                option="--catch-up-window", help="time within which locomotion regains lost distance ('distance'); "
                "default %(default)g", tooltip="For Distance: time within which locomotion regains the distance that "
                "an action has lost", in_preset=True, methods="distance", tuning=True),
        Setting(name="max_blocks", default=500, least=50, most=20000, expected=BETWEEN, option="--max-blocks",
                metavar="NUMBER", help="blocks that are compared for a section ('distance') or slot; time grows with "
                "the square; default %(default)d", title="Most Blocks", tooltip="For Distance and Blocks: blocks that "
                "are compared for a section or slot; the time grows with the square of their number", in_preset=True,
                methods="distance blocks fs", tuning=True),
        Setting(name="omega", default=0.0, least=0.0, most=100.0, expected=BETWEEN, option="--omega", metavar="NUMBER",
                help="the faster of two gaits begins at 1/omega of the range between their speeds; 0: as the "
                "recordings are labelled ('path'), else 4; default %(default)g", title="Gait Threshold",
                tooltip="The faster of two gaits begins at 1 / this value of the range between their speeds; 0 takes "
                "it from the recordings' labels (Path Following) or a quarter of the range", precision=1,
                in_preset=True, tuning=True),
        Setting(name="seam_window", default=0.8, least=0.0, most=4.0, unit="seconds", expected=BETWEEN,
                option="--seam-window", help="window over which a transition is blended; default %(default)g",
                title="Transition", tooltip="Time over which the transition between two clips is blended",
                in_preset=True, tuning=True),
        Setting(name="track_window", default=1.2, least=0.2, most=5.0, unit="seconds", expected=BETWEEN,
                option="--track-window", help="window that removes the track's jitter; default %(default)g",
                tooltip="Window that removes the jitter of the track", in_preset=True, tuning=True),
        Setting(name="root_window", default=1.5, least=0.2, most=5.0, unit="seconds", expected=BETWEEN,
                option="--root-window", help="window through which the body is on the track ('path'); default "
                "%(default)g", title="Sway Window", tooltip="For Path Following: smoothing window in which body and "
                "track agree; a shorter one keeps less sway", in_preset=True, methods="path", tuning=True),
        Setting(name="watch", default=1.0, least=0.0, most=1.0, expected=BETWEEN, option="--watch", metavar="SHARE",
                help="how much head and shoulders turn to the ball ('path'), 0 for not at all; default %(default)g",
                title="Watch the Ball", tooltip="For Path Following: how much head and shoulders turn to the ball; 0 "
                "keeps them as in the clips", in_preset=True, methods="path", tuning=True),
        Setting(name="variety", default=0.0, least=0.0, most=10.0, unit="m/s", help="missed speed that is accepted so "
                "that neighbours in a match are not in step"),
        Setting(name="lag", default=0.0, least=0.0, most=60.0, unit="seconds", help="lag of a player of a match behind "
                "the clock, so that neighbours differ"),
        Setting(name="manner", default=-1, least=-1, most=100000, help="number of the recording whose manner of "
                "walking a player of a match keeps; -1 for none"),
        Setting(name="exertion", default=0.0, least=0.0, most=1000.0, unit="metres", help="exertion of a player of a "
                "match at the start of a part of it: what they have gained on 5.5 m/s and not recovered from"),
        Setting(name="gaits", default=(), option="--gait", metavar="LABEL=CLIP", help="the clip that represents a "
                "gait, such as walking=folder/walk.bvh; once for each gait", title="Gait Clips", tuning=True,
                tooltip="Clips that represent the gaits, such as walking=folder/walk.bvh; jogging=folder/jog.bvh",
                convert=parse_gait_clips, option_more=dict(action="append")),
        Setting(name="mirror", default=True, option="--no-mirror", help="do not use mirrored clips",
                title="Mirrored Clips", tooltip="Use each clip also with left and right exchanged", in_preset=True),
        Setting(name="made", default=True, option="--no-made", help="no synthetic or blended clips where recordings "
                "lack a speed, a step or an action", title="Synthetic Clips",
                tooltip="For Path Following: add synthetic or blended clips where recordings lack a speed, a step, "
                "a turn or an action",
                in_preset=True, methods="path", tuning=True),
        Setting(name="nearest", default=False, option="--nearest", help="continue with the nearest labels that the "
                "library has", title="Nearest Labels", tooltip="Where the library lacks a key moment's labels, use the "
                "nearest ones and add a warning", in_preset=True),
    ),
    "player": (
        Setting(name="height", default=0.0, least=0.5, most=3.0, unit="metres", option="--height",
                help="height of the player; default: the library's", tooltip="Height of the player; 0 for the height "
                "of the library's skeleton", panel_more=dict(min=0.0)),
        Setting(name="strong_foot", default="any", choices=FEET, option="--strong-foot", tooltip="Preferred foot for "
                "key moments without a side", blank="any", option_more=dict(choices=("left", "right", "any")),
                methods="path distance blocks fs"),
        Setting(name="style", default=(), option="--style", metavar="NAME", help="a label, or a folder or clip (with * "
                "and ?), whose clips are preferred; may be repeated", tooltip="Labels, folders or clips (with * and ?) "
                "whose clips are preferred; separate several with ;",
                option_more=dict(action="append")),
        Setting(name="style_weight", default=0.5, least=0.0, most=10.0, expected=BETWEEN, option="--style-weight",
                metavar="NUMBER", help="missed speed in m/s that is accepted for a clip of the style; default "
                "%(default)g",
                tooltip="Missed speed in m/s that is accepted for a clip of the style"),
        *BODY[:-1], _FATIGUE,
        Setting(name="drawn_start", default=0.0, unit="seconds", title="Begins At", tooltip="Second on the clock at "
                "which a drawn curve begins; a moving object has its own frames"),
    ),
    "clock": (
        Setting(name="start_frame", default=1, tooltip="Scene frame of the clock time below"),
        Setting(name="start_time", default=0.0, unit="seconds", title="Clock at Start",
                tooltip="Seconds on the tracking file's clock at the start frame"),
    ),
    "result": (
        Setting(name="section_start", default=0.0, least=0.0, unit="seconds", title="From", tooltip="Second of a whole "
                "match at which to begin", precision=1),
        Setting(name="section_end", default=0.0, least=0.0, unit="seconds", title="To", tooltip="Second of a whole "
                "match at which to end; 0 for its end", precision=1),
        Setting(name="live", default=False, title="Update Automatically", tooltip="Update a player after edits of the "
                "drawn track, pins or strips: first quickly, then with the quality of Synthesize"),
        Setting(name="show_moment_names", default=True, title="Labels in Colour", tooltip="Show labels in the colours "
                "of their actions, key moments, legend and keys over NLA editors and dope sheets"),
        Setting(name="make_bodies", default=True, title="Characters", tooltip="Create a low-poly character for each "
                "player"),
        Setting(name="make_ball", default=True, title="Ball", tooltip="Create the ball, where the tracking has one"),
        Setting(name="make_paths", default=True, title="Paths", tooltip="Draw each player's track on the ground"),
        Setting(name="keep_hand_keys", default=True, title="Keep Manual Keys", tooltip="Keep what you have keyed, "
                "moved or deleted on a result when it is updated"),
        Setting(name="accept_as", default="ACTION", choices=FORMS, title="Apply As", tooltip="What an applied take "
                "becomes"),
    ),
}
