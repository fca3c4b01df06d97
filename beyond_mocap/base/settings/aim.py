"""Settings of a ball aimed at a target."""
# fmt: off

from .setting import BALLS, PARTS, SIDES, Setting

WAYS = (
    ("AIR", "Air", "The ball flies, with the given number of bounces"),
    ("GROUND", "Ground", "The ball slides and rolls along the ground"),
)
TIMES = (
    ("FREE", "Slowest", "The time of the slowest launch; along the ground, arrival at walking pace"),
    ("SECONDS", "Seconds", "This long after the strike"), ("FRAME", "On Frame", "On this scene frame"),
)

TABLES = {
    "aim": (
        Setting(name="live", default=True, title="Update Automatically", tooltip="Update the shot while the target is "
                "dragged"),
        Setting(name="part", default="foot", choices=PARTS, tooltip="Body part that strikes the ball"),
        Setting(name="side", default="right", choices=SIDES, tooltip="Left or right body part"),
        Setting(name="bone", default="", tooltip="Bone that strikes instead of the part"),
        Setting(name="first", default=1, title="From", tooltip="First frame on which the ball can be struck"),
        Setting(name="last", default=1, title="To", tooltip="Last frame on which the ball can be struck; the frame "
                "with the fastest part in the launch direction is used"),
        Setting(name="way", default="AIR", choices=WAYS, title="Trajectory", tooltip="How the ball reaches the target"),
        Setting(name="bounces", default=0, least=0, most=5, tooltip="Number of bounces before it "
                "arrives"),
        Setting(name="timing", default="FREE", choices=TIMES, title="Arrives", tooltip="When the ball arrives"),
        Setting(name="seconds", default=1.0, least=0.05, most=20.0, unit="seconds", title="Flight",
                tooltip="Seconds from the strike to the target"),
        Setting(name="arrival", default=50, title="Frame", tooltip="Scene frame on which the ball arrives"),
        Setting(name="ball", default="football", choices=BALLS, tooltip="Kind of ball"),
        Setting(name="back", default=0.0, least=-30.0, most=30.0, unit="turns per second", title="Back Spin",
                tooltip="Turns per second that lift the ball; negative: top spin, which pulls it down", precision=1),
        Setting(name="left", default=0.0, least=-30.0, most=30.0, unit="turns per second", title="Side Spin",
                tooltip="Turns per second that curve the ball to the left; negative: to the right", precision=1),
        Setting(name="human", default=True, title="Human Speeds Only", tooltip="Refuse launches faster than a person "
                "can strike a ball with this part"),
        Setting(name="follow", default=3.0, least=0.0, most=60.0, unit="seconds", title="Continue",
                tooltip="Seconds that the ball bounces and rolls after the target; 0: it stays there",
                precision=1),
    ),
    "aim.handover": (Setting(name="handover", default=60, title="On Frame", tooltip="Frame from which Blender's rigid "
                             "bodies move the ball"),),
}
