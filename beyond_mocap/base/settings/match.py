"""Settings of whole matches, and of `touches`."""
# fmt: off

from pathlib import Path

from .setting import Setting

TABLES = {
    "match.section": (
        Setting(name="start", kind=float, unit="seconds", option="--from", help="of the match's clock, from then on",
            title="From", tooltip="Second of the match's clock", precision=1, panel_more=dict(default=0.0, min=0.0)),
        Setting(name="end", kind=float, unit="seconds", option="--to", help="up to then", title="To",
            tooltip="Second of the match's clock; 0: to its end", precision=1, panel_more=dict(default=0.0, min=0.0)),
        Setting(name="players", default=(), option="--players", metavar="ID", help="only these, by id; default: "
            "everybody", option_more=dict(nargs="+")),
    ),
    "match.work": (
        Setting(name="workers", kind=int, least=1, most=256, option="--workers", metavar="N", help="processes on this "
            "machine; default: one per core", title="Processes", tooltip="How many work at once, beside Blender; 0: "
            "one for each processor core", panel_more=dict(default=0, min=0)),
        Setting(name="scheduler", default="", option="--scheduler", metavar="ADDRESS", help="of a Dask cluster whose "
            "workers do it", tooltip="Address of a Dask cluster that does the work instead, such as tcp://host:8786"),
    ),
    "match": (
        Setting(name="solve_touches", default=True, option="--no-solve-touches", help="the ball as the feed has it, "
            "and no touches", tooltip="Find out of the ball's course who touches it and when, and have it go as "
            "physics has it"),
        Setting(name="annotations", kind=Path, option="--annotations", metavar="DIR", help="words of players as "
            "DIR/ID.txt, not found ones"),
        Setting(name="bvh", default=False, option="--bvh", help="every player as BVH too"),
        Setting(name="scene", kind=Path, option="--scene", metavar="FILE", help="everybody, ball and pitch in one "
            "file; inside Blender: .blend, .fbx, .glb, .usdc"),
        Setting(name="figures", default=True, option="--no-figures", help="no reports, no provenance, no page"),
        Setting(name="fps", default=30.0, least=1.0, most=480.0, unit="frames per second", option="--fps"),
        Setting(name="seed", default=0, least=0, most=2**31 - 1, option="--seed"),
        Setting(name="nearest", default=True, option="--exact", help="a player whose words the library lacks fails, "
            "instead of going on with the nearest it has"),
        Setting(name="first_frame", default=1, tooltip="Scene frame on which the stretch begins"),
    ),
    "touches": (
        Setting(name="start", kind=float, unit="seconds", option="--from", help="solve from this time on"),
        Setting(name="end", kind=float, unit="seconds", option="--to", help="solve up to this time"),
    ),
}
