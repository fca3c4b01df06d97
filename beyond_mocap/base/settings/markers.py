"""Settings of reconstruction from optical markers, and of releases."""
# fmt: off

from pathlib import Path

from .setting import Setting

FILTERS = (
    ("butterworth", "Butterworth", "Zero-phase low-pass filter of fourth order"),
    ("kalman", "Kalman", "Smoothing with a motion model, forwards and backwards"), ("none", "None", "No filter"),
)
_BALLS = ("baseball", "tennis", "handball", "volleyball", "football")
BALL_CHOICES = tuple((name, name.capitalize(), f"A {name.removesuffix('ball')}ball") for name in _BALLS)
HANDS = (
    ("AUTO", "Detect", "The hand that throws"), ("left", "Left", "The left hand"), ("right", "Right", "The right hand"),
)

TABLES = {
    "markers": (
        Setting(name="marker_set", kind=str, option="--marker-set", metavar="FILE|NAME", help="marker set of the "
                "recording; default: the one that fits"),
        Setting(name="subject", kind=str, option="--subject", metavar="NAME", help="whose markers to read if a "
                "file contains several bodies"),
        Setting(name="unit", kind=str, option="--unit", metavar="UNIT", help="unit of the files: m, cm, mm, in; "
                "default: as in the files", tooltip="Metres in one unit of a recording; 0 uses its file or body size",
                precision=4, panel_more=dict(default=0.0, min=0.0, max=10.0)),
        Setting(name="up", kind=str, option="--up", metavar="AXIS", help="axis of the files that points up: X, Y, Z or "
                "--up=-Y; default: detected"),
        Setting(name="fps", kind=float, least=1.0, most=20000.0, unit="frames per second", option="--fps",
                metavar="RATE", help="frame rate of the trial, to override its file"),
        Setting(name="filter", default="butterworth", choices=FILTERS, option="--filter", tooltip="Filter that smooths "
                "the motion"),
        Setting(name="cutoff", default=13.4, least=0.1, most=1000.0, unit="hertz", option="--cutoff",
                help="of the filter; default %(default)g", tooltip="Cutoff of the Butterworth filter in hertz; "
                "faster movements are removed", precision=1, panel_more=dict(min=0.5, max=100.0)),
        Setting(name="plant", default=True, option="--no-plant", help="do not hold feet in place", title="Plant Feet",
                tooltip="Hold feet in place while they touch the ground"),
        Setting(name="floor", default=False, option="--floor", help="move the motion up or down so that the floor is "
                "at 0", title="Floor at 0", tooltip="Move the body so that the floor under its feet is at height 0"),
        Setting(name="limits", default=True, option="--no-limits", help="do not limit joint rotations",
                title="Joint Limits", tooltip="Keep joint rotations within those of a human body"),
        Setting(name="weights", default=True, option="--no-weights", help="give all markers the same weight",
                title="Weigh Markers", tooltip="Give markers less weight while their segment is deformed"),
        Setting(name="smoothness", default=0.0, least=0.0, most=0.2, unit="seconds", option="--smoothness",
                help="solve the whole sequence as a smooth one: 0.02 for a walk, 0.004 for a throw; "
                "default %(default)g",
                tooltip="Seconds over which the whole sequence is solved smoothly: 0.003 to 0.005 for throws, 0.02 "
                "for noisy walks; 0 solves each frame separately", precision=3),
        Setting(name="radius", kind=float, least=0.005, most=0.5, unit="metres", option="--ball-radius",
                help="of a ball with a marker", tooltip="Radius of the ball; 0 fits it to a marker on the ball, or "
                "uses that of the ball's kind", precision=4, panel_more=dict(default=0.0, min=0.0)),
        Setting(name="ball", default="baseball", choices=BALL_CHOICES, option="--ball-kind", help="the ball"),
        Setting(name="hold_ball", default=False, option="--hold-ball", help="use the ball's marker for the pose until "
                "the release"),
        Setting(name="release", default="auto", choices=("auto", "yes", "no"), option="--release",
                help="estimate the release of a throw"),
        Setting(name="add", default=False, title="Add to Library", tooltip="Write the motion with its labels to the "
                "library folder"),
        Setting(name="add_to", kind=Path, option="--add-to", metavar="LIBRARY", help="add the motion to a library as "
                "NAME.bvh"),
        Setting(name="words", default=(), option="--words", metavar="LABEL", title="Labels", help="labels of the added "
                "clip; a throw's key: release", tooltip="Labels of the clip that is added", option_more=dict(nargs="+"),
                panel_more=dict(default="throwb")),
        Setting(name="dressed", default=True, title="Add Body Mesh", tooltip="Give the armature a simple body mesh"),
        Setting(name="names", default=True, tooltip="Show the labels of the active marker cloud in the 3D view"),
    ),
    "release": (
        Setting(name="ball_marker", kind=str, option="--ball-marker", metavar="LABEL", help="the marker on the ball; "
                "default: one named as a ball"),
        Setting(name="radius", kind=float, least=0.01, most=0.2, unit="metres", option="--radius",
                help="of the ball; default: that of its kind, or fitted"),
        Setting(name="hand", kind=str, choices=HANDS, option="--hand", help="that throws; default: detected",
                tooltip="The hand that throws", option_more=dict(choices=("left", "right")),
                panel_more=dict(default="AUTO")),
        Setting(name="ball", default="baseball", choices=BALL_CHOICES, option="--ball-kind", identifier="thrown",
                tooltip="Kind of ball that is thrown"),
        Setting(name="ball_csv", kind=Path, option="--ball-csv", metavar="B.csv", help="write the ball's trajectory "
                "over the whole trial"),
        Setting(name="unit", kind=str, option="--unit", metavar="UNIT", help="unit of the markers: metres per unit, or "
                "mm, cm, m, in"),
        Setting(name="subject", kind=str, option="--subject", metavar="NAME", help="whose markers to read if a file "
                "contains several bodies"),
        Setting(name="up", kind=str, option="--up", metavar="AXIS", help="axis of the file that points up: X, Y, Z or "
                "--up=-Y; default: detected"),
    ),
    "markers.cloud": (
        Setting(name="lines", default=True, tooltip="Draw lines between the markers of a segment"),
        Setting(name="size", default=0.007, least=0.0, unit="metres", tooltip="Radius of the spheres at the markers",
                panel_more=dict(soft_max=0.05, unit="LENGTH")),
    ),
    "markers.model": (Setting(name="use_model", default=False, tooltip="Take joints and marker places from the model "
                              "instead of calibrating them again"),),
}
