"""Settings of what is drawn over the 3D view."""
# fmt: off

from .setting import Setting

WHOSE = (
    ("ACTIVE", "Active Player", "Draw what is switched on of the active player"),
    ("TICKED", "Ticked Players", "Draw what is switched on of all ticked players"),
)
GHOSTS = (
    ("STEP", "Every", "A figure every so many seconds"),
    ("SEAMS", "At Cuts", "A figure at every cut between two clips"),
)

TABLES = {
    "view": (
        Setting(name="show", default=True, title="Overlays", tooltip="Draw the overlays that are switched on below"),
        Setting(name="players", default="ACTIVE", choices=WHOSE, title="Of", tooltip="Whose takes the overlays are "
            "about"),
        Setting(name="track", default=False, tooltip="The measured track, coloured by how far the body is off it"),
        Setting(name="footprints", default=False, tooltip="A shoe sole for every step, coloured by how far the "
            "standing foot slides"),
        Setting(name="contacts", default=False, tooltip="A disc under each foot that stands at the current frame"),
        Setting(name="seams", default=False, title="Cuts", tooltip="A bar at every cut between two clips, with the "
            "clips' names, and why this clip is played"),
        Setting(name="moments", default=False, title="Key Moments", tooltip="Where body and ball meet, the ball's way "
            "there, and the gap between the two"),
        Setting(name="speed", default=False, tooltip="The asked speed as a curtain over the track, and the body's own "
            "as a line"),
        Setting(name="ghosts", default=False, tooltip="Stick figures of the body before and behind the current frame"),
        Setting(name="path_source", default=True, title="Original Path", tooltip="The path that the original motion "
            "goes, as it was fitted"),
        Setting(name="path_new", default=True, title="New Path", tooltip="The path that is ridden, as the curve is "
            "understood: without corners"),
        Setting(name="path_trackers", default=True, title="Trackers", tooltip="At the current frame, where the body is "
            "on either path and where it heads"),
        Setting(name="path_residuals", default=False, title="Residuals", tooltip="Lines from either path to the "
            "pelvis: what of the motion is not the path's"),
        Setting(name="path_ghost", default=False, title="Original Motion", tooltip="The original as a stick figure at "
            "the current frame"),
        Setting(name="shots", default=True, title="Ball Ways", tooltip="The ways that aimed and passed balls could "
            "take and take, strikes and bounces"),
        Setting(name="ghosts_at", default="STEP", choices=GHOSTS, title="Ghosts", tooltip="Where the figures stand"),
        Setting(name="ghost_step", default=0.5, least=0.05, most=10.0, unit="seconds", title="Seconds",
            tooltip="Time from one figure to the next"),
        Setting(name="reach", default=2.0, least=0.0, most=60.0, unit="seconds", title="Around the Playhead",
            tooltip="Ghosts and texts within this time of the current frame are drawn; 0 draws none", precision=1),
        Setting(name="in_front", default=False, tooltip="Draw over everything, not only over what is behind"),
    ),
}
