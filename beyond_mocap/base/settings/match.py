"""Settings of matches, of their pitch, and of `touches`."""
# fmt: off

from pathlib import Path

from .setting import BETWEEN, Setting
from .synthesis import BODY

WINDOW = 300.0
"""s of a window of work, without overlaps."""
OVERLAP = 12.0
"""s that two windows share: two thirds before the edge between them, which the later one needs to converge to the
sequence of the earlier one, and one third after it."""

SPORTS = (
    ("football", "Football", "105 x 68 m"), ("futsal", "Futsal", "40 x 20 m"), ("handball", "Handball", "40 x 20 m"),
    ("basketball", "Basketball", "28 x 15 m"), ("ice_hockey", "Ice Hockey", "60 x 30 m"),
    ("field_hockey", "Field Hockey", "91.4 x 55 m"), ("rugby", "Rugby", "100 x 70 m between the goal lines"),
    ("american_football", "American Football", "91.44 x 48.77 m between the goal lines"),
)

TABLES = {
    "match.section": (
        Setting(name="start", kind=float, unit="seconds", option="--from", help="start, on the match's clock",
                title="From", tooltip="Start of the stretch, in seconds of the match's clock", precision=1,
                panel_more=dict(default=0.0, min=0.0)),
        Setting(name="end", kind=float, unit="seconds", option="--to", help="end, on the match's clock", title="To",
                tooltip="End of the stretch, in seconds of the match's clock; 0: end of the match", precision=1,
                panel_more=dict(default=0.0, min=0.0)),
        Setting(name="players", default=(), option="--players", metavar="ID", help="only these, by id; default: all "
                "players", option_more=dict(nargs="+")),
    ),
    "match.work": (
        Setting(name="workers", kind=int, least=1, most=256, option="--workers", metavar="N", help="processes on this "
                "machine; default: one per core", title="Processes", tooltip="Processes that work besides Blender; 0: "
                "one for each processor core", panel_more=dict(default=0, min=0)),
        Setting(name="scheduler", default="", option="--scheduler", metavar="ADDRESS", help="of a Dask cluster that "
                "does the work", tooltip="Address of a Dask cluster that does the work instead, such as tcp://host:8786"),
    ),
    "match": (
        Setting(name="solve_touches", default=True, option="--no-solve-touches", help="use the ball as in the feed, "
                "without touches", tooltip="Find from the ball's trajectory who touches it and when, and correct its "
                "trajectory by physics"),
        Setting(name="annotations", kind=Path, option="--annotations", metavar="DIR", help="labels of players in "
                "DIR/ID.txt, instead of automatic ones"),
        Setting(name="bvh", default=False, option="--bvh", help="also write every player as BVH"),
        Setting(name="scene", kind=Path, option="--scene", metavar="FILE", help="write players, ball and pitch to one "
                "file; inside Blender: .blend, .fbx, .glb, .usdc"),
        Setting(name="figures", default=True, option="--no-figures", help="write no reports, provenance and page"),
        Setting(name="fps", default=30.0, least=1.0, most=480.0, unit="frames per second", option="--fps",
                help="frames per second of the motion; default 30"),
        Setting(name="seed", default=0, least=0, most=2**31 - 1, option="--seed", help="seed of the players' habits"),
        Setting(name="nearest", default=True, option="--exact", help="a player fails if the library lacks labels, "
                "instead of using the nearest ones"),
        Setting(name="watch", default=1.0, least=0.0, most=1.0, expected=BETWEEN, option="--watch", metavar="SHARE",
                help="how much heads and shoulders turn to the ball, 0 for not at all; default %(default)g"),
        *BODY,
        Setting(name="first_frame", default=1, tooltip="Scene frame on which the stretch starts"),
    ),
    "pitch": (
        Setting(name="sport", default="football", choices=SPORTS, option="--sport", help="whose pitch it is; touches "
                "of the ball are found in football only", tooltip="Whose pitch, lines, goals and ball are shown"),
    ),
    "touches": (
        Setting(name="start", kind=float, unit="seconds", option="--from", help="solve from this time"),
        Setting(name="end", kind=float, unit="seconds", option="--to", help="solve up to this time"),
    ),
}
