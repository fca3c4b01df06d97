"""Settings of the overlays in the 3D view."""
# fmt: off

from .setting import Setting

WHOSE = (
    ("ACTIVE", "Active Player", "Draw the overlays of the active player"),
    ("TICKED", "Selected Players", "Draw the overlays of all selected players"),
)
GHOSTS = (
    ("STEP", "Interval", "A stick figure at a fixed time interval"),
    ("SEAMS", "At Cuts", "A stick figure at every cut between two clips"),
)

TABLES = {
    "view": (
        Setting(name="show", default=True, title="Overlays", tooltip="Draw the overlays that are enabled below"),
        Setting(name="players", default="ACTIVE", choices=WHOSE, title="Show For", tooltip="Players whose takes the "
                "overlays describe"),
        Setting(name="track", default=False, tooltip="The measured track, coloured by the body's distance from it"),
        Setting(name="footprints", default=False, tooltip="A shoe sole for every step, coloured by the slide "
                "of the foot in contact"),
        Setting(name="contacts", default=False, tooltip="A disc under each foot in contact at the current frame"),
        Setting(name="seams", default=False, title="Cuts", tooltip="A bar at every cut between two clips, with the "
                "clips' names and the reason for the choice of the clip"),
        Setting(name="moments", default=False, title="Key Moments", tooltip="Where body and ball meet, the ball's "
                "trajectory there, and the gap between the two"),
        Setting(name="speed", default=False, tooltip="The requested speed as a curtain over the track, and the "
                "body's speed as a line"),
        Setting(name="heading", default=False, title="Planned Heading", tooltip="An arrow every half second where "
                "the body is planned to face, in another colour where a heading key holds"),
        Setting(name="ghosts", default=False, tooltip="Stick figures of the body around the current frame"),
        Setting(name="path_source", default=True, title="Original Path", tooltip="The fitted path of the original "
                "motion"),
        Setting(name="path_new", default=True, title="New Path", tooltip="The path that the motion follows: the curve "
                "without corners"),
        Setting(name="path_trackers", default=True, title="Trackers", tooltip="The body's position and heading on both "
                "paths at the current frame"),
        Setting(name="path_residuals", default=False, title="Residuals", tooltip="Lines from each path to the pelvis: "
                "the part of the motion that the path does not describe"),
        Setting(name="path_ghost", default=False, title="Original Motion", tooltip="The original motion as a stick "
                "figure at the current frame"),
        Setting(name="shots", default=True, title="Ball Trajectories", tooltip="Possible and chosen trajectories of "
                "aimed and passed balls, with strikes and bounces"),
        Setting(name="momentum", default=True, tooltip="Centre of mass, the parabola of each flight, support polygon "
                "and ground force of the armatures that show their momentum"),
        Setting(name="ghosts_at", default="STEP", choices=GHOSTS, title="Ghosts At", tooltip="Where the ghosts are"),
        Setting(name="ghost_step", default=0.5, least=0.05, most=10.0, unit="seconds", title="Seconds",
                tooltip="Time between two ghost figures"),
        Setting(name="reach", default=2.0, least=0.0, most=60.0, unit="seconds", title="Time Range",
                tooltip="Draw ghosts, texts and the centre of mass's path within this time of the current frame; 0 "
                "draws none", precision=1),
        Setting(name="in_front", default=False, tooltip="Draw the overlays in front of all objects"),
    ),
}
