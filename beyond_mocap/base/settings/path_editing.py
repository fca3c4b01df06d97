"""Settings of path editing."""
# fmt: off

from pathlib import Path

from .setting import POSITIVE, WHOLE, Setting

FITS = (
    ("spline", "Smoothing Spline", "A smooth curve that leaves out the sway of the steps, however long the motion is"),
    ("polynomial", "Polynomial", "One polynomial of the chosen degree over the whole motion"),
)
ENDS = (
    ("stop", "Stop", "The motion ends where the path ends"),
    ("repeat", "Start Again", "Where the path ends, the motion goes on from the path's beginning"),
)
FRAMES = (
    ("path", "Path", "Offsets turn with the path, seen from above; the body stays upright"),
    ("tangent", "Tangent", "Offsets turn with the full tangent: on a slope the whole body is tilted"),
    ("absolute", "Absolute", "Offsets keep their direction in the world: in a bend the body goes sideways"),
)
CURVES = (
    ("BEZIER", "Bezier", "Points on the path, with handles"),
    ("NURBS", "NURBS", "Control points beside the path: a B-spline, smoother, with fewer points"),
)

TABLES = {
    "path_editing": (
        Setting(name="fit", default="spline", choices=FITS, title="Original Path", tooltip="How the original path is "
            "found"),
        Setting(name="degree", default=13, least=1, most=200, expected=WHOLE, option="--degree", metavar="N",
            help="of a polynomial fitted to the recording's own path; default: a smoothing spline",
            tooltip="Of the polynomial that is the original path", option_more=dict(default=None),
            panel_more=dict(soft_max=60)),
        Setting(name="by_arc_length", default=True, option="--no-arc-length", help="by time: the path's ends at the "
            "recording's ends", title="Keep Speed", tooltip="As many metres of path in each frame as the original "
            "goes; off: the whole motion is spread over the whole path"),
        Setting(name="cycle", default=False, option="--cycle --loop", help="repeat the best stretch until the path's "
            "end", tooltip="Repeat the motion's best loop of steps until the path ends, its seams blended"),
        Setting(name="end", default="stop", choices=ENDS, option="--end", help="where the path is shorter",
            title="Path Too Short", tooltip="What happens where the path ends before the motion"),
        Setting(name="plant", default=True, option="--no-plant", help="leave the feet as the path carries them",
            title="Plant Feet", tooltip="Feet that stand in the original stand here too"),
        Setting(name="speed", default=1.0, least=0.05, most=20.0, expected="a number from {least} to {most}",
            option="--speed", metavar="FACTOR", help="of playing; default %(default)g", tooltip="How many times as "
            "fast the motion plays, steps and all", option_more=dict(least=0.1, most=10.0),
            panel_more=dict(soft_min=0.25, soft_max=4.0)),
        Setting(name="frame", default="path", choices=FRAMES, option="--frame", help="what the recording is taken "
            "relative to: the path (default); its full tangent or the world, to compare", title="Offsets",
            tooltip="What the body's offsets from the path turn with"),
        Setting(name="lean", default=True, option="--no-lean", help="do not lean into bends", tooltip="Lean into bends "
            "as their radius and the speed ask for"),
        Setting(name="bends", default=False, option="--slow-in-bends", help="slow down in tight bends as people do",
            title="Slow in Bends", tooltip="Tight bends slow the motion as they slow people (two-thirds power law)"),
        Setting(name="climbs", default=False, option="--slow-on-slopes", help="slow down on slopes as people do",
            title="Slow on Slopes", tooltip="Slopes slow the motion as they slow walkers (Tobler's function)"),
        Setting(name="slopes", default=True, option="--no-slopes", help="feet do not follow slopes, as if in a lift",
            title="Follow Slopes", tooltip="Feet follow the slope of the path or ground"),
        Setting(name="closed", default=False, option="--closed", help="the last point joins the first: round and "
            "round"),
        Setting(name="control_points", default=False, option="--control-points", help="the points of CURVE.csv are a "
            "B-spline's controls"),
        Setting(name="control_degree", kind=int, least=1, most=20, expected=WHOLE, option="--control-degree",
            metavar="K", help="of that B-spline; default 3"),
        Setting(name="delay", default=0.0, least=0.0, most=3600.0, unit="seconds", option="--delay",
            help="that it waits before it sets out", tooltip="Seconds that the motion begins later",
            panel_more=dict(max=86399.0, soft_max=10.0)),
        Setting(name="avoid", default=(), option="--avoid", metavar="OTHER.bvh", help="a moving body to keep clear of, "
            "by waiting or going round; may be repeated", option_more=dict(type=Path, action="append")),
        Setting(name="distance", kind=float, least=0.05, most=20.0, unit="metres", option="--distance",
            help="between two bodies' middles, with --avoid; default 0.6"),
        Setting(name="ground", kind=Path, option="--ground", metavar="HILL.obj", help="a mesh for the feet to stand "
            "on: metres, Y up"),
        Setting(name="live", default=True, tooltip="Follow the curve and these settings while they are edited"),
        Setting(name="report", kind=Path, option="--report", metavar="R.json"),
        Setting(name="provenance", kind=Path, option="--provenance", metavar="P.csv"),
        Setting(name="unit", kind=float, option="--unit", help="metres per unit of IN.bvh", **POSITIVE),
    ),
    "path.new_curve": (
        Setting(name="curve_points", default=0, least=0, most=200, title="Points", tooltip="Control points of a new "
            "curve to ride on; 0: as many as it needs to lie within 3 cm"),
        Setting(name="curve_degree", default=3, least=2, most=5, tooltip="Of a NURBS curve: how smooth it is, and how "
            "far each control point reaches"),
        Setting(name="curve_kind", default="BEZIER", choices=CURVES, title="Kind", tooltip="Kind of a new curve to "
            "ride on"),
        Setting(name="nudge_step", default=0.1, least=0.001, most=10.0, unit="metres", tooltip="Metres that control "
            "points go at each nudge", precision=3, panel_more=dict(step=1)),
    ),
}
