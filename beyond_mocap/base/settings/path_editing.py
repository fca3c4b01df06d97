"""Settings table of path editing."""
# fmt: off

from pathlib import Path

from .setting import POSITIVE, WHOLE, Setting

FITS = (
    ("spline", "Smoothing Spline", "A smooth curve without the sway of the steps, for motions of any duration"),
    ("polynomial", "Polynomial", "One polynomial of the given degree over the whole motion"),
)
ENDS = (
    ("stop", "Stop", "The motion ends where the path ends"),
    ("repeat", "Restart", "Where the path ends, the motion continues from the start of the path"),
)
FRAMES = (
    ("path", "Path", "Offsets turn with the path, seen from above; the body stays upright"),
    ("tangent", "Tangent", "Offsets turn with the full tangent: on a slope the whole body is tilted"),
    ("absolute", "Absolute", "Offsets keep their direction in the world: in a bend the body moves sideways"),
)
CURVES = (
    ("BEZIER", "Bezier", "Points on the path, with handles"),
    ("NURBS", "NURBS", "Control points beside the path: a B-spline, smoother, with fewer points"),
)

TABLES = {
    "path_editing": (
        Setting(name="fit", default="spline", choices=FITS, title="Original Path", tooltip="How the original path is "
                "fitted to the motion"),
        Setting(name="degree", default=13, least=1, most=200, expected=WHOLE, option="--degree", metavar="N",
                help="degree of a polynomial fitted to the motion's own path; default: a smoothing spline",
                tooltip="Degree of the polynomial that is the original path", option_more=dict(default=None),
                panel_more=dict(soft_max=60)),
        Setting(name="by_arc_length", default=True, option="--no-arc-length", help="by time: the whole motion "
                "takes the whole path", title="Keep Speed", tooltip="Move along the path as fast as the original "
                "motion; off: spread the whole motion over the whole path"),
        Setting(name="cycle", default=False, option="--cycle --loop", help="repeat the best loop of steps until "
                "the path ends", tooltip="Repeat the best loop of steps until the path ends, with blended transitions"),
        Setting(name="end", default="stop", choices=ENDS, option="--end", help="what happens where the path is "
                "shorter than the motion", title="Path Too Short",
                tooltip="What happens where the path ends before the motion"),
        Setting(name="plant", default=True, option="--no-plant", help="do not plant the feet",
                title="Plant Feet", tooltip="Hold feet in place while they are in contact in the original motion"),
        Setting(name="speed", default=1.0, least=0.05, most=20.0, expected="a number from {least} to {most}",
                option="--speed", metavar="FACTOR", help="playback rate; default %(default)g", tooltip="Playback rate "
                "of the motion: speed and tempo of the steps", option_more=dict(least=0.1, most=10.0),
                panel_more=dict(soft_min=0.25, soft_max=4.0)),
        Setting(name="frame", default="path", choices=FRAMES, option="--frame", help="what the body's offsets from the "
                "path turn with: the path (default); its full tangent or nothing, for comparison", title="Offsets",
                tooltip="What the body's offsets from the path turn with"),
        Setting(name="lean", default=True, option="--no-lean", help="do not lean into bends", tooltip="Lean into bends "
                "according to their radius and the speed"),
        Setting(name="bends", default=False, option="--slow-in-bends", help="slow down in tight bends as people do",
                title="Slow in Bends", tooltip="Slow down in tight bends as people do (two-thirds power law)"),
        Setting(name="climbs", default=False, option="--slow-on-slopes", help="slow down on slopes as people do",
                title="Slow on Slopes", tooltip="Slow down on slopes as walkers do (Tobler's function)"),
        Setting(name="slopes", default=True, option="--no-slopes", help="the feet stay level on slopes",
                title="Follow Slopes", tooltip="Let the feet follow the slope of the path or ground"),
        Setting(name="closed", default=False, option="--closed", help="join the last point to the first, so that the "
                "path has no end"),
        Setting(name="control_points", default=False, option="--control-points", help="the points of CURVE.csv are "
                "control points of a B-spline"),
        Setting(name="control_degree", kind=int, least=1, most=20, expected=WHOLE, option="--control-degree",
                metavar="K", help="degree of that B-spline; default 3"),
        Setting(name="delay", default=0.0, least=0.0, most=3600.0, unit="seconds", option="--delay",
                help="wait before the motion starts", tooltip="Seconds by which the motion starts later",
                panel_more=dict(max=86399.0, soft_max=10.0)),
        Setting(name="avoid", default=(), option="--avoid", metavar="OTHER.bvh", help="a moving body to avoid, "
                "by a wait or a detour; can be repeated", option_more=dict(type=Path, action="append")),
        Setting(name="distance", kind=float, least=0.05, most=20.0, unit="metres", option="--distance",
                help="least distance of two bodies' middles, with --avoid; default 0.6"),
        Setting(name="ground", kind=Path, option="--ground", metavar="HILL.obj", help="a mesh as ground for the "
                "feet: metres, Y up"),
        Setting(name="live", default=True, title="Update Automatically", tooltip="Update the motion while the curve "
                "and these settings are edited"),
        Setting(name="report", kind=Path, option="--report", metavar="R.json", help="write all figures to this file"),
        Setting(name="provenance", kind=Path, option="--provenance", metavar="P.csv",
                help="which frame each frame is from"),
        Setting(name="unit", kind=float, option="--unit", help="metres per unit of IN.bvh", **POSITIVE),
    ),
    "path.new_curve": (
        Setting(name="curve_points", default=0, least=0, most=200, title="Points", tooltip="Number of control points "
                "of a new curve; 0: as many as it needs to stay within 3 cm"),
        Setting(name="curve_degree", default=3, least=1, most=20, tooltip="Degree of a NURBS curve: how smooth it is, "
                "and how far each control point reaches; above 5 the overlay shows the path, since Blender draws 5"),
        Setting(name="curve_kind", default="BEZIER", choices=CURVES, title="Kind", tooltip="Kind of a new "
                "curve"),
        Setting(name="nudge_step", default=0.1, least=0.001, most=10.0, unit="metres", tooltip="Metres by which a "
                "nudge moves control points", precision=3, panel_more=dict(step=1)),
    ),
}
