"""Settings of an aimed ball."""
# fmt: off

from .setting import BALLS, PARTS, SIDES, Setting

WAYS = (
    ("AIR", "Air", "It flies, and bounces as often as asked"),
    ("GROUND", "Ground", "It slides and rolls along the ground"),
)
TIMES = (
    ("FREE", "Slowest", "As long as the slowest launch takes; along the ground, so that it arrives at a walking pace"),
    ("SECONDS", "Seconds", "This long after the strike"), ("FRAME", "On Frame", "On this scene frame"),
)

TABLES = {
    "aim": (
        Setting(name="live", default=True, tooltip="Aim again while the target is dragged"),
        Setting(name="part", default="foot", choices=PARTS, tooltip="What the ball is struck with"),
        Setting(name="side", default="right", choices=SIDES, tooltip="Left or right, of what there are two"),
        Setting(name="bone", default="", tooltip="A bone by name, in place of the part"),
        Setting(name="first", default=1, title="From", tooltip="First frame on which the ball may be struck"),
        Setting(name="last", default=1, title="To", tooltip="Last frame on which the ball may be struck; of all, the "
            "one with the part fastest that way is taken"),
        Setting(name="way", default="AIR", choices=WAYS, tooltip="How the ball gets there"),
        Setting(name="bounces", default=0, least=0, most=5, tooltip="How often it touches the ground before it "
            "arrives"),
        Setting(name="timing", default="FREE", choices=TIMES, title="Arrives", tooltip="When it arrives"),
        Setting(name="seconds", default=1.0, least=0.05, most=20.0, unit="seconds", title="Flight",
            tooltip="Seconds from the strike to the target"),
        Setting(name="arrival", default=50, title="Frame", tooltip="Scene frame on which the ball arrives"),
        Setting(name="ball", default="football", choices=BALLS, tooltip="What kind of ball it is"),
        Setting(name="back", default=0.0, least=-30.0, most=30.0, unit="turns per second", title="Back Spin",
            tooltip="Turns a second that lift the ball; negative: top spin, which pulls it down", precision=1),
        Setting(name="left", default=0.0, least=-30.0, most=30.0, unit="turns per second", title="Side Spin",
            tooltip="Turns a second that bend its way to the left; negative: to the right", precision=1),
        Setting(name="human", default=True, title="As a Human Can", tooltip="Refuse launches faster than anybody "
            "strikes a ball with this part"),
        Setting(name="follow", default=3.0, least=0.0, most=60.0, unit="seconds", title="Goes On",
            tooltip="Seconds that the ball is followed behind the target, bouncing and rolling; 0: it stays there",
            precision=1),
    ),
    "aim.handover": (Setting(name="handover", default=60, title="On Frame", tooltip="Frame on which Blender's rigid "
        "bodies take the ball over"),),
}
