"""Settings of passing scenes, of balls that are carried, and of hit analysis."""
# fmt: off

from .setting import BALLS, EITHER, HOLDS, PARTS, SIDES, Setting

KINDS = (
    ("toss", "Toss", "Slow, to somebody near"), ("pass", "Pass", "At a medium speed"),
    ("attack", "Attack", "Hard and fast"),
)
OWN_PARTS = (("own", "Own", "The part that the player is set to", "BLANK1", 9), *PARTS)
OWN_SIDES = (("own", "Own", "As the player is set"), *EITHER)
ERRORS = (
    ("none", "Arrives", "The receiver meets the ball"),
    ("missed", "Missed", "The receiver strikes and misses the ball; the rally ends"),
    ("dropped", "Dropped", "The receiver touches the ball, and it falls; the rally ends"),
)
SERVES = (
    ("USUAL", "By Who Would Pass", "The player who would pass to the first one"),
    ("PLAYER", "By a Player", "A player by name"), ("GROUND", "From the Ground", "The ball lies at the first foot"),
    ("PLACE", "From a Place", "The ball comes flying from a place"),
)

TABLES = {
    "passes.player": (
        Setting(name="part", default="foot", choices=PARTS, tooltip="What the player meets the ball with"),
        Setting(name="side", default="either", choices=EITHER, tooltip="Of what there are two"),
        Setting(name="bone", default="", title="Joint", tooltip="A joint of the library's skeleton by name, in place "
            "of the part"),
        Setting(name="tool_length", default=0.66, least=0.05, most=2.0, unit="metres", tooltip="Metres that the tool "
            "goes on beyond the wrist, along the forearm"),
        Setting(name="tool_radius", default=0.015, least=0.001, most=0.5, unit="metres", tooltip="Half as thick as it "
            "is, metres", precision=3),
        Setting(name="tool_reach", default=0.26, least=0.0, most=2.0, unit="metres", tooltip="Metres of its far end "
            "that strike the ball"),
        Setting(name="height", default=0.0, least=0.5, most=3.0, unit="metres", tooltip="Metres that the player is "
            "tall; 0: as tall as the library's skeleton", panel_more=dict(min=0.0)),
    ),
    "passes.pass": (
        Setting(name="kind", default="pass", choices=KINDS, tooltip="How hard it is sent"),
        Setting(name="bounces", default=1, least=0, most=5, tooltip="How often the ball touches the ground on its way"),
        Setting(name="part", default="own", choices=OWN_PARTS, tooltip="What the sender meets the ball with"),
        Setting(name="side", default="own", choices=OWN_SIDES, tooltip="Of what the sender has two"),
        Setting(name="seconds", default=0.0, least=0.2, most=10.0, unit="seconds", title="Flight",
            tooltip="Seconds that the ball is under way; 0: as the strike gives it",
            panel_more=dict(min=0.0, max=20.0)),
        Setting(name="clip", default="", title="Like Clip", tooltip="Path below the library of a recording; the strike "
            "most like its own is played. Empty: by kind"),
        Setting(name="first", default=0.0, least=0.0, unit="seconds", title="From Second", tooltip="Of the stretch of "
            "that recording"),
        Setting(name="last", default=0.0, least=0.0, unit="seconds", title="To Second", tooltip="Of the stretch of "
            "that recording; 0: to its end"),
        Setting(name="actor_cut", default=False, title="Stretch", tooltip="Look at some frames of its motion only, not "
            "at all of it"),
        Setting(name="actor_first", default=1, title="From Frame", tooltip="Scene frame"),
        Setting(name="actor_last", default=60, title="To Frame", tooltip="Scene frame, the last one"),
        Setting(name="error", default="none", choices=ERRORS, title="Then", tooltip="How it ends"),
    ),
    "passes.weights": (
        Setting(name="position", default=1.0, least=0.0, most=1000.0, title="Places", tooltip="Of where bones are, "
            "where two poses are compared", panel_more=dict(max=100.0)),
        Setting(name="velocity", default=1.0, least=0.0, most=1000.0, title="Velocities", tooltip="Of how bones move, "
            "where two poses are compared", panel_more=dict(max=100.0)),
        Setting(name="speed", default=1.0, least=0.0, most=1000.0, title="Top Speed", tooltip="Of the part's highest "
            "speed, where two strikes are compared", panel_more=dict(max=100.0)),
        Setting(name="vectors", default=1.0, least=0.0, most=1000.0, title="Movement", tooltip="Of the part's way, "
            "where two strikes are compared", panel_more=dict(max=100.0)),
        Setting(name="times", default=1.0, least=0.0, most=1000.0, tooltip="Of how long each piece of that way takes, "
            "where two strikes are compared", panel_more=dict(max=100.0)),
        Setting(name="bones", default="", tooltip="Weights of single bones where two poses are compared, such as: left "
            "foot 2, head 0.5; all others count 1"),
    ),
    "passes": (
        Setting(name="ball", default="paper", choices=BALLS, tooltip="What kind of ball it is"),
        Setting(name="own", default=False, title="Own Numbers", tooltip="Use the numbers below in place of the chosen "
            "ball's"),
        Setting(name="radius", default=0.11, least=0.01, most=0.5, unit="metres", tooltip="Metres", precision=3),
        Setting(name="restitution", default=0.7, least=0.0, most=0.95, title="Elasticity",
            tooltip="Share of its downward speed with which a bounce sends it up", panel_more=dict(max=0.98)),
        Setting(name="linear_drag", default=0.2, least=0.0, most=2.0, title="Air, Linear", tooltip="Share of its speed "
            "that the air takes in a second, as in the paper", precision=3, panel_more=dict(max=5.0)),
        Setting(name="drag", default=0.0, least=0.0, most=0.5, title="Air, Square", tooltip="Deceleration over the "
            "square of the speed, per metre, as air really does", precision=4, panel_more=dict(max=1.0)),
        Setting(name="gravity", default=9.8, least=0.5, most=30.0, unit="m/s²", tooltip="Metres per second squared",
            panel_more=dict(min=0.1)),
        Setting(name="net", default=False, tooltip="Every pass across the net goes over it"),
        Setting(name="net_from", default=(0.0, -5.0), unit="metres", tooltip="One end, metres"),
        Setting(name="net_to", default=(0.0, 5.0), unit="metres", tooltip="The other end, metres"),
        Setting(name="net_height", default=1.5, least=0.1, most=10.0, unit="metres", tooltip="Metres",
            panel_more=dict(max=5.0)),
        Setting(name="repeat", default=1, least=1, most=1000, title="Rounds", tooltip="How many times the passes are "
            "played in a row", panel_more=dict(max=100)),
        Setting(name="serve_from", default="USUAL", choices=SERVES, title="Serve", tooltip="Where the ball comes from "
            "first"),
        Setting(name="serve", default="", title="Serve By", tooltip="Who serves"),
        Setting(name="serve_at", default=(5.0, 0.0, 1.0), unit="metres", tooltip="Where the ball comes from, metres"),
        Setting(name="missed", default=0.0, least=0.0, most=1.0, tooltip="How likely each ball is missed"),
        Setting(name="dropped", default=0.0, least=0.0, most=1.0, tooltip="How likely each ball is dropped"),
        Setting(name="lead_in", default=1.0, least=0.0, most=60.0, unit="seconds", tooltip="Seconds before the first "
            "strike, at least"),
        Setting(name="lead_out", default=1.5, least=0.0, most=60.0, unit="seconds", tooltip="Seconds after the last "
            "strike"),
        Setting(name="rate", default=0.0, least=0.0, most=240.0, unit="frames per second", title="Frame Rate",
            tooltip="Frames per second that are worked out, on which strikes fall; 0: the scene's own"),
        Setting(name="transition", default=0.4, least=0.1, most=2.0, unit="seconds", tooltip="Seconds over which one "
            "motion goes over into the next"),
        Setting(name="turns", default=False, title="Eight Directions", tooltip="Strikes are turned in steps of 45 "
            "degrees, as in the paper; off: as the pass needs"),
        Setting(name="watch", default=True, title="Watch the Ball", tooltip="Heads follow the ball"),
        Setting(name="seed", default=0, least=0, tooltip="Another one is another solution"),
        Setting(name="start_frame", default=1, tooltip="Scene frame on which the scene begins"),
        Setting(name="live", default=True, tooltip="Solve again when a player's place or a pass has been edited"),
    ),
    "ball.hold": (
        Setting(name="hold_part", default="hand", choices=PARTS, title="Part", tooltip="What carries the ball"),
        Setting(name="hold_side", default="right", choices=SIDES, title="Side", tooltip="Left or right, of what there "
            "are two"),
        Setting(name="hold_how", default="TOUCH", choices=HOLDS, title="Hold", tooltip="Where the ball is while it is "
            "carried"),
        Setting(name="hold_first", default=1, title="From", tooltip="Frame from which on the ball is carried"),
        Setting(name="hold_last", default=30, title="To", tooltip="Frame on which the ball is let go"),
    ),
    "ball.held": (
        Setting(name="how", default="KEEP", choices=HOLDS, title="Hold", tooltip="Where the ball is while it is "
            "carried"),
        Setting(name="settle", default=4, least=0, tooltip="Frames within which the ball comes to where it is carried"),
        Setting(name="skin", default=0.03, least=0.0, unit="metres", tooltip="Metres from the bone to what touches the "
            "ball"),
    ),
    "hits": (
        Setting(name="part", default="foot", choices=PARTS, tooltip="The part whose strikes are looked for"),
        Setting(name="side", default="right", choices=SIDES, tooltip="Left or right, of what there are two"),
        Setting(name="bone", default="", tooltip="A bone by name, in place of the part"),
        Setting(name="threshold", default=0.0, least=0.0, most=5.0, unit="metres", tooltip="Metres of height above "
            "which a strike may be; 0: found by itself"),
    ),
}
