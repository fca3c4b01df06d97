"""Settings of throws and kicks by networks: synthesis, training, evaluation, examples."""
# fmt: off

from pathlib import Path

from .setting import SIDES, Setting

KINDS = (
    ("usual", "Usual", "A baseball for throws, a football for kicks"), ("baseball", "Baseball", "73 mm, 145 g"),
    ("tennis", "Tennis Ball", "67 mm, 58 g"), ("handball", "Handball", "Size 3: 188 mm, 450 g"),
    ("volleyball", "Volleyball", "209 mm, 270 g"), ("football", "Football", "Size 5: 220 mm, 430 g"),
)

TABLES = {
    "throw": (
        Setting(name="limb", kind=str, choices=("left_hand", "right_hand", "left_foot", "right_foot"), option="--limb",
                help="limb that throws or kicks; default: the limb of most examples of the model"),
        Setting(name="skeleton", kind=Path, option="--skeleton", metavar="S.bvh", help="skeleton of the result; "
                "default: the model's"),
        Setting(name="speed", kind=float, least=0.5, most=80.0, unit="m/s", option="--speed", help="speed of the ball "
                "at the release; default: automatic", title="Ball Speed", tooltip="Speed of the ball at the release, "
                "m/s; 0 chooses it from the examples", precision=1, panel_more=dict(default=0.0, min=0.0, max=60.0)),
        Setting(name="time", kind=float, least=-1e5, most=1e5, unit="seconds", expected="seconds", option="--time",
                help="time of the release; default: frame 0 is 0 s"),
        Setting(name="fps", kind=float, least=10.0, most=480.0, expected="{least} to {most} frames per second",
                option="--fps", help="frame rate of the result; default: the model's, 30 with --library"),
    ),
    "throw.ball": (
        Setting(name="kind", kind=str, choices=KINDS, option="--ball-kind", metavar="KIND", help="baseball, tennis, "
                "handball, volleyball, football, paper", tooltip="Kind of ball, which determines its flight",
                option_more=dict(choices=None), panel_more=dict(default="usual")),
        Setting(name="ball", kind=Path, option="--ball", metavar="B.csv", help="file for the ball's trajectory"),
        Setting(name="report", kind=Path, option="--report", metavar="R.json", help="write all figures to this file"),
        Setting(name="seed", default=0, least=0, most=2**31 - 1, option="--seed", help="selects another motion with "
                "the same target; default %(default)s", tooltip="Choose another motion with the same target by another "
                "number", panel_more=dict(max=None)),
        Setting(name="side", default="right", choices=SIDES, tooltip="Hand or foot that throws or kicks"),
        Setting(name="frame", default=0, least=0, title="Release Frame", tooltip="Scene frame on which the ball leaves "
                "hand or foot, up to half a frame earlier or later; 0 uses the current frame"),
        Setting(name="library", default=True, title="Run-Up from Library", tooltip="Find the motion before and after "
                "the throw among the clips of the library (step 1); otherwise the throw is blended into the armature's "
                "own motion"),
        Setting(name="live", default=True, title="Update Automatically", tooltip="Update the preview when the "
                "target is moved or these settings change, until it is applied"),
    ),
    "throw.train": (
        Setting(name="action", default="throw", choices=("throw", "kick"), option="--action",
                help="what the networks learn"),
        Setting(name="config", kind=Path, option="--config", metavar="C.json", help="sizes and rates of the training; "
                "see docs/reference/network-weights.md"),
        Setting(name="subject", default=(), option="--subject", metavar="S", help="train on this subject only; "
                "repeatable", option_more=dict(action="append")),
        Setting(name="skeleton", kind=Path, option="--skeleton", metavar="S.bvh", help="skeleton of the model; "
                "default: the first example's"),
        Setting(name="resume", default=False, option="--resume", help="continue from the checkpoint beside W.npz"),
        Setting(name="seed", kind=int, least=0, most=2**31 - 1, option="--seed", help="seed of initial weights, "
                "batches and dropout; default: the config's, else 0"),
        Setting(name="minutes", kind=float, least=0.01, most=1e5, unit="minutes", option="--minutes", metavar="M",
                help="end the epochs after this time, in which compiling does not count, and write the weights"),
        Setting(name="epochs", kind=int, least=0, most=1000000, option="--epochs", metavar="N",
                help="passes through the examples at most; default: the config's, else 30; 0: the linear start alone"),
        Setting(name="half", default=False, option="--half", help="store the weights in 16 bits"),
    ),
    "throw.evaluate": (
        Setting(name="subject", default=(), option="--subject", metavar="S", help="evaluate this subject only; "
                "repeatable", option_more=dict(action="append")),
        Setting(name="report", kind=Path, option="--report", metavar="R.json",
                help="write all figures to this file", option_more=dict(required=True)),
        Setting(name="html", kind=Path, option="--html", metavar="R.html", help="file for the report as an HTML page"),
        Setting(name="raw", default=False, option="--raw", help="networks alone: no pose iterations, no inverse "
                "kinematics"),
        Setting(name="as_they_are", default=False, option="--as-they-are", help="do not scale the targets by height"),
        Setting(name="motions", kind=int, least=1, most=1000000, option="--motions", metavar="N",
                help="maximum number for each subject, evenly selected"),
    ),
    "throw.examples": (
        Setting(name="action", default="throw", choices=("throw", "kick"), option="--action",
                help="what the examples show"),
        Setting(name="subjects", default=4, least=1, most=1000, expected="{least} to {most} subjects",
                option="--subjects", metavar="N", help="number of subjects; default %(default)s"),
        Setting(name="throws", default=40, least=1, most=10000, expected="{least} to {most} for each subject",
                option="--throws", metavar="M", help="throws or kicks of each subject; default %(default)s"),
        Setting(name="seed", default=1, least=0, most=1000000, option="--seed", help="seed of the first subject; "
                "default %(default)s"),
    ),
}
