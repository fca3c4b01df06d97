"""Settings of reconstruction from optical markers, and of releases."""
# fmt: off

from pathlib import Path

from .setting import Setting

FILTERS = (
    ("butterworth", "Butterworth", "Zero-phase low-pass filter of fourth order"),
    ("kalman", "Kalman", "Smoothing by how a body moves, forwards and backwards"), ("none", "None", "As it was solved"),
)
_THROWN = ("baseball", "tennis", "handball", "volleyball", "football")
THROWN = tuple((name, name.capitalize(), f"A {name}") for name in _THROWN)
HANDS = (
    ("AUTO", "Found", "The hand that throws"), ("left", "Left", "The left hand"), ("right", "Right", "The right hand"),
)

TABLES = {
    "markers": (
        Setting(name="marker_set", kind=str, option="--marker-set", metavar="FILE|NAME", help="whose markers these "
            "are; default: what fits"),
        Setting(name="subject", kind=str, option="--subject", metavar="NAME", help="whose markers, where a file holds "
            "several bodies"),
        Setting(name="unit", kind=str, option="--unit", metavar="UNIT", help="of the files: m, cm, mm, in; default: as "
            "they say", tooltip="Metres in one unit of a recording; 0: as its file says, or by the body's size",
            precision=4, panel_more=dict(default=0.0, min=0.0, max=10.0)),
        Setting(name="up", kind=str, option="--up", metavar="AXIS", help="of the files that points up: X, Y, Z or "
            "--up=-Y; default: found"),
        Setting(name="fps", kind=float, least=1.0, most=20000.0, unit="frames per second", option="--fps",
            metavar="RATE", help="of the trial, where its file says something else"),
        Setting(name="filter", default="butterworth", choices=FILTERS, option="--filter", tooltip="How the motion is "
            "smoothed"),
        Setting(name="cutoff", default=13.4, least=0.1, most=1000.0, unit="hertz", option="--cutoff",
            help="of the filter; default %(default)g", tooltip="Hertz up to which the Butterworth filter lets "
            "movements through", precision=1, panel_more=dict(min=0.5, max=100.0)),
        Setting(name="plant", default=True, option="--no-plant", help="do not hold standing feet", title="Plant Feet",
            tooltip="Hold feet where they stand"),
        Setting(name="floor", default=False, option="--floor", help="move the motion up or down so that the feet stand "
            "at 0", title="Floor at 0", tooltip="Move the body so that its lowest foot stands at height 0"),
        Setting(name="limits", default=True, option="--no-limits", help="joints may turn as far as they like",
            title="Joint Limits", tooltip="Joints turn no further than a body's"),
        Setting(name="weights", default=True, option="--no-weights", help="all markers count alike",
            title="Weigh Markers", tooltip="Trust markers less while their segment is deformed"),
        Setting(name="smoothness", default=0.0, least=0.0, most=0.2, unit="seconds", option="--smoothness",
            help="it all moves smoothly: 0.02 for a walk, 0.004 for a throw; default %(default)g",
            tooltip="Seconds over which the whole sequence is solved as one that moves smoothly: 0.003 to 0.005 for "
            "throws, 0.02 for noisy walks; 0: each frame for itself", precision=3),
        Setting(name="radius", kind=float, least=0.005, most=0.5, unit="metres", option="--ball-radius",
            help="of a ball that carries a marker", tooltip="Metres; 0: fitted where a marker lies on the ball, else "
            "that of the ball's kind", precision=4, panel_more=dict(default=0.0, min=0.0)),
        Setting(name="ball", default="baseball", choices=THROWN, option="--ball-kind"),
        Setting(name="hold_ball", default=False, option="--hold-ball", help="its marker takes part in the pose until "
            "the release"),
        Setting(name="release", default="auto", choices=("auto", "yes", "no"), option="--release",
            help="look for a throw's release"),
        Setting(name="add", default=False, title="Add to Library", tooltip="Write the motion with its words into the "
            "library's folder"),
        Setting(name="add_to", kind=Path, option="--add-to", metavar="LIBRARY", help="adds the motion to a library as "
            "NAME.bvh"),
        Setting(name="words", default=(), option="--words", metavar="WORD", help="its annotation; a throw's key: "
            "release", tooltip="The words of the clip that is added", option_more=dict(nargs="+"),
            panel_more=dict(default="throwb")),
        Setting(name="dressed", default=True, title="Make Body", tooltip="Give the armature a simple body"),
        Setting(name="names", default=True, tooltip="Write the labels of the active cloud at its markers"),
    ),
    "release": (
        Setting(name="ball_marker", kind=str, option="--ball-marker", metavar="LABEL", help="the marker on the ball; "
            "default: one named as a ball"),
        Setting(name="radius", kind=float, least=0.01, most=0.2, unit="metres", option="--radius",
            help="of the ball; default: its kind's, or as fitted"),
        Setting(name="hand", kind=str, choices=HANDS, option="--hand", help="that throws; default: found",
            tooltip="The hand that throws", option_more=dict(choices=("left", "right")),
            panel_more=dict(default="AUTO")),
        Setting(name="ball", default="baseball", choices=THROWN, option="--ball-kind", identifier="thrown",
            tooltip="What is thrown"),
        Setting(name="ball_csv", kind=Path, option="--ball-csv", metavar="B.csv", help="the ball's way over the whole "
            "trial"),
        Setting(name="unit", kind=str, option="--unit", metavar="UNIT", help="of the markers: metres per unit, or mm, "
            "cm, m, in"),
        Setting(name="subject", kind=str, option="--subject", metavar="NAME", help="whose markers, where there are "
            "several bodies in the file"),
        Setting(name="up", kind=str, option="--up", metavar="AXIS", help="of the file that points up: X, Y, Z or "
            "--up=-Y; default: found"),
    ),
    "markers.cloud": (
        Setting(name="lines", default=True, tooltip="Draw lines between the markers of a segment"),
        Setting(name="size", default=0.007, least=0.0, unit="metres", tooltip="Radius of the spheres at the markers",
            panel_more=dict(soft_max=0.05, unit="LENGTH")),
    ),
    "markers.model": (Setting(name="use_model", default=False, tooltip="Take joints and markers from the model instead "
        "of finding them anew"),),
}
