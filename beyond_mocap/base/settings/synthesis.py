"""Settings of one player's synthesis, of the clock, and of what a result becomes."""
# fmt: off

from collections.abc import Iterable

from ..errors import InputError
from .setting import BETWEEN, Setting

METHODS = (
    ("path", "On the path", "The player's body is laid on the track, with the sway of the clips kept"),
    ("distance", "Distance", "Travelled distance matched by adding or leaving out steps, then by warping time"),
    ("blocks", "Blocks", "Smoothest sequence of clips for the words; the track is not followed"),
)
FEET = (
    ("any", "Any", "Both feet alike"), ("left", "Left", "Key moments that name no side take clips of the left foot"),
    ("right", "Right", "Key moments that name no side take clips of the right foot"),
)
FORMS = (
    ("ACTION", "Action", "One action on the body"),
    ("STRIPS", "Strips", "NLA strips on the body, one for each piece of a clip, named by clip and words"),
)


def gait_choices(texts: Iterable[str]) -> tuple[tuple[str, str], ...]:
    """(gait word, clip) of each text "WORD=CLIP", blanks around either left out; InputError for any other text and for
    a word that comes twice."""
    pairs = []
    for text in texts:
        word, _, clip = (part.strip() for part in text.partition("="))
        if not word or not clip:
            raise InputError("--gait", f"{text!r}", "WORD=CLIP, such as walking=folder/walk.bvh")
        if word.lower() in dict(pairs):
            raise InputError("--gait", f"{word!r} twice", "one clip for each gait")
        pairs.append((word.lower(), clip.replace("\\", "/")))
    return tuple(pairs)


TABLES = {
    "synthesis": (
        Setting(name="method", default="path", choices=METHODS, option="--method", tooltip="How position is dealt with",
            in_preset=True),
        Setting(name="catch_up", default=True, option="--no-catch-up", help="'distance' without regaining lost "
            "distance", tooltip="Let the body catch up with the track smoothly after each warp", in_preset=True),
        Setting(name="fps", default=30.0, unit="frames per second", option="--fps", identifier="rate",
            title="Frame Rate", tooltip="Frames per second that are synthesized; the scene keeps its own rate",
            in_preset=True, option_more=dict(least=1.0, most=480.0), panel_more=dict(min=10.0, max=240.0)),
        Setting(name="seed", default=0, option="--seed", help="of the clustering that blocks and distance search in",
            tooltip="Of the clustering that Blocks and Distance search in; On the path does not draw lots",
            in_preset=True, option_more=dict(least=0, most=2**31 - 1), panel_more=dict(min=0)),
        Setting(name="solve_touches", default=False, option="--solve-touches", help="key moments move to the touches "
            "that the ball's samples tell; the ball goes as physics has it and is dribbled step by step",
            tooltip="Key moments move to the touches that the ball's samples tell, within 0.4 s; the ball goes as "
            "physics has it, and is dribbled step by step", in_preset=True),
        Setting(name="alpha", default=0.2, least=0.0, most=1.0, expected=BETWEEN, option="--alpha", metavar="SHARE",
            help="words against continuity; default %(default)g", title="Word Weight", tooltip="Words asked for "
            "against smooth transitions: 0 looks only for these, 1 only for the words", in_preset=True, tuning="any"),
        Setting(name="delta", default=0.5, least=0.0, most=100.0, unit="metres", expected=BETWEEN, option="--delta",
            help="travelled distance that may stay wrong ('distance'); default %(default)g", title="Distance Slack",
            tooltip="Of Distance: travelled distance of a stretch that may stay wrong before steps are added or left "
            "out", in_preset=True, tuning="distance", panel_more=dict(unit="LENGTH", subtype="DISTANCE")),
        Setting(name="omega", default=0.0, least=0.0, most=100.0, expected=BETWEEN, option="--omega", metavar="NUMBER",
            help="between two gaits' speeds the faster gait begins at 1/omega of the way up; 0: as the recordings are "
            "labelled ('path'), else 4; default %(default)g", title="Gait Threshold", tooltip="Between the speeds of "
            "two gaits the faster one begins at one part in so many of the way up. 0: where the recordings' own labels "
            "change (Path), else a quarter of the way", precision=1, in_preset=True, tuning="any"),
        Setting(name="seam_window", default=0.8, least=0.0, most=4.0, unit="seconds", expected=BETWEEN,
            option="--seam-window", help="over which the jump at a cut is spread; default %(default)g",
            title="Cut Window", tooltip="Time over which the jump at a cut between two clips is spread",
            in_preset=True, tuning="any"),
        Setting(name="track_window", default=1.2, least=0.2, most=5.0, unit="seconds", expected=BETWEEN,
            option="--track-window", help="of the window that takes the jitter out of the track; default %(default)g",
            tooltip="Window that takes the jitter out of the track", in_preset=True, tuning="any"),
        Setting(name="root_window", default=1.5, least=0.2, most=5.0, unit="seconds", expected=BETWEEN,
            option="--root-window", help="of the window behind which the body is on the track ('path'); default "
            "%(default)g", title="Sway Window", tooltip="Of On the path: the body is on the track when both are seen "
            "through this window; shorter keeps less sway", in_preset=True, tuning="path"),
        Setting(name="variety", default=0.0, least=0.0, most=10.0, unit="m/s", help="of missed speed that it is worth "
            "not to be in step with neighbours in a match"),
        Setting(name="lag", default=0.0, least=0.0, most=60.0, unit="seconds", help="that a player of a match lags "
            "behind the clock, so that neighbours differ"),
        Setting(name="gaits", default=(), option="--gait", metavar="WORD=CLIP", help="the clip that stands for a gait, "
            "such as walking=folder/walk.bvh; once for each gait", title="Gait Clips", tuning="any",
            tooltip="Which clip stands for which gait, where you choose: walking=folder/walk.bvh; "
            "jogging=folder/jog.bvh", convert=gait_choices, option_more=dict(action="append")),
        Setting(name="mirror", default=True, option="--no-mirror", help="do not use mirrored clips",
            title="Mirrored Clips", tooltip="Use each clip also with left and right exchanged", in_preset=True),
        Setting(name="made", default=True, option="--no-made", help="no made or blended clips where recordings lack a "
            "speed", title="Made Clips", tooltip="Of On the path: make or blend clips where recordings lack a speed, "
            "and kicks on the run", in_preset=True, tuning="path"),
        Setting(name="nearest", default=False, option="--nearest", help="go on with the nearest words that the library "
            "has", title="Nearest Words", tooltip="Where the library lacks a key moment's words, go on with the "
            "nearest that it has, and say so", in_preset=True),
    ),
    "player": (
        Setting(name="height", default=0.0, least=0.5, most=3.0, unit="metres", option="--height",
            help="of the player; else the library's", tooltip="Metres that the player is tall; 0: as tall as the "
            "library's skeleton", panel_more=dict(min=0.0)),
        Setting(name="strong_foot", default="any", choices=FEET, option="--strong-foot", tooltip="For key moments "
            "without a side", blank="any", option_more=dict(choices=("left", "right", "any"))),
        Setting(name="style", default=(), option="--style", metavar="NAME", help="a word, or a folder or clip (with * "
            "and ?), whose clips are taken rather than others; may be repeated", tooltip="Words, folders or clips "
            "(with * and ?) whose clips are taken rather than others; several with ;",
            option_more=dict(action="append")),
        Setting(name="style_weight", default=0.5, least=0.0, most=10.0, expected=BETWEEN, option="--style-weight",
            metavar="NUMBER", help="m/s of missed speed that a clip of the style is worth; default %(default)g",
            tooltip="Metres per second of missed speed that a clip of the style is worth"),
        Setting(name="drawn_start", default=0.0, unit="seconds", title="Begins At", tooltip="Second on the clock at "
            "which a drawn curve begins; a moving object has its own frames"),
    ),
    "clock": (
        Setting(name="start_frame", default=1, tooltip="Scene frame on which the clock below stands at its start"),
        Setting(name="start_time", default=0.0, unit="seconds", title="Clock at Start",
            tooltip="Seconds on the tracking file's clock at the start frame"),
    ),
    "result": (
        Setting(name="section_start", default=0.0, least=0.0, unit="seconds", title="From", tooltip="Second of a whole "
            "match at which to begin", precision=1),
        Setting(name="section_end", default=0.0, least=0.0, unit="seconds", title="To", tooltip="Second of a whole "
            "match at which to end; 0 goes to its end", precision=1),
        Setting(name="live", default=False, tooltip="Update a player by itself when his drawn track, his pins or his "
            "strips have been edited: first quickly, then as well as Synthesize does"),
        Setting(name="show_moment_names", default=True, title="Names of Key Moments", tooltip="Write the names of key "
            "moments into NLA editors and dope sheets"),
        Setting(name="make_bodies", default=True, title="Bodies", tooltip="Make a low-poly body for each player"),
        Setting(name="make_ball", default=True, title="Ball", tooltip="Make the ball, where the tracking has one"),
        Setting(name="make_paths", default=True, title="Paths", tooltip="Draw each player's track on the ground"),
        Setting(name="keep_hand_keys", default=True, title="Keep Hand-Made Keys", tooltip="What you have keyed, moved "
            "or deleted on a result stays when it is made anew"),
        Setting(name="accept_as", default="ACTION", choices=FORMS, tooltip="What an accepted take becomes"),
    ),
}
