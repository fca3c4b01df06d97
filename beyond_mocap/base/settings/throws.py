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
            help="default: what most examples of the model use"),
        Setting(name="skeleton", kind=Path, option="--skeleton", metavar="S.bvh", help="whose bones throw; default: "
            "the model's"),
        Setting(name="speed", kind=float, least=0.5, most=80.0, unit="m/s", option="--speed", help="of the ball as it "
            "leaves; default: what suits", title="Ball Speed", tooltip="How fast the ball leaves, m/s; 0: as in "
            "examples that are thrown or kicked as far", precision=1, panel_more=dict(default=0.0, min=0.0, max=60.0)),
        Setting(name="time", kind=float, least=-1e5, most=1e5, unit="seconds", expected="seconds", option="--time",
            help="at which it leaves; default: frame 0 is 0 s"),
        Setting(name="fps", kind=float, least=10.0, most=480.0, expected="{least} to {most} frames per second, in "
            "which a throw can be seen", option="--fps", help="default: the model's, 30 with --library"),
    ),
    "throw.ball": (
        Setting(name="kind", kind=str, choices=KINDS, option="--ball-kind", metavar="KIND", help="baseball, tennis, "
            "handball, volleyball, football, paper", tooltip="What kind of ball it is, in the air",
            option_more=dict(choices=None), panel_more=dict(default="usual")),
        Setting(name="ball", kind=Path, option="--ball", metavar="B.csv", help="the ball's way"),
        Setting(name="report", kind=Path, option="--report", metavar="R.json"),
        Setting(name="seed", default=0, least=0, most=2**31 - 1, option="--seed", help="another motion with the same "
            "aim; default %(default)s", tooltip="Another number, another throw at the same target",
            panel_more=dict(max=None)),
        Setting(name="side", default="right", choices=SIDES, tooltip="With which hand or foot"),
        Setting(name="frame", default=0, least=0, title="On Frame", tooltip="Scene frame on which the ball leaves hand "
            "or foot, up to half a frame sooner or later; 0: the current frame"),
        Setting(name="library", default=True, title="Run-Up by Library", tooltip="Let the synthesizer find the way "
            "into the throw and out of it among the clips of the library (step 1); without one the throw is eased into "
            "the armature's own motion"),
        Setting(name="live", default=True, title="Follow", tooltip="Make what is shown again when the target is "
            "dragged or these settings are edited, until it is kept"),
    ),
    "throw.train": (
        Setting(name="action", default="throw", choices=("throw", "kick"), option="--action"),
        Setting(name="config", kind=Path, option="--config", metavar="C.json", help="sizes and rates; default: as "
            "shipped weights have"),
        Setting(name="subject", default=(), option="--subject", metavar="S", help="train on this one only; repeatable",
            option_more=dict(action="append")),
        Setting(name="skeleton", kind=Path, option="--skeleton", metavar="S.bvh", help="whose bones the model has; "
            "default: the first's"),
        Setting(name="resume", default=False, option="--resume", help="go on from the checkpoint beside W.npz"),
        Setting(name="seed", kind=int, least=0, most=2**31 - 1, option="--seed", help="of first weights, batches and "
            "dropout; default: the config's, else 0"),
        Setting(name="minutes", kind=float, least=0.01, most=1e5, unit="minutes", option="--minutes", metavar="M",
            help="stop after so many minutes with what stands then"),
        Setting(name="epochs", kind=int, least=0, most=1000000, option="--epochs", metavar="N",
            help="times through the examples; default: the config's"),
        Setting(name="half", default=False, option="--half", help="store the weights as 16 bits"),
    ),
    "throw.evaluate": (
        Setting(name="subject", default=(), option="--subject", metavar="S", help="only this one's; repeatable",
            option_more=dict(action="append")),
        Setting(name="report", kind=Path, option="--report", metavar="R.json", option_more=dict(required=True)),
        Setting(name="html", kind=Path, option="--html", metavar="R.html", help="the same as a page for a browser"),
        Setting(name="raw", default=False, option="--raw", help="networks alone: no pose iterations, no inverse "
            "kinematics"),
        Setting(name="as_they_are", default=False, option="--as-they-are", help="do not scale what is asked for by "
            "height"),
        Setting(name="motions", kind=int, least=1, most=1000000, option="--motions", metavar="N",
            help="of each subject at most, evenly chosen"),
    ),
    "throw.examples": (
        Setting(name="action", default="throw", choices=("throw", "kick"), option="--action"),
        Setting(name="subjects", default=4, least=1, most=1000, expected="{least} to {most} people",
            option="--subjects", metavar="N", help="different people; default %(default)s"),
        Setting(name="throws", default=40, least=1, most=10000, expected="{least} to {most} of each", option="--throws",
            metavar="M", help="of each of them; default %(default)s"),
        Setting(name="seed", default=1, least=0, most=1000000, option="--seed", help="of the first of them; default "
            "%(default)s"),
    ),
}
