"""What the panels show and the operators read: one group of settings per scene, saved with the file.

Paths may be relative to the file. What is too large for a file's properties (a built library, a take) lives in
`session` under the names kept here.
"""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty, CollectionProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, PointerProperty,
    StringProperty,
)

from .pins import BeyondMocapPin
from .result import BeyondMocapResult, BeyondMocapShared
from .video import BeyondMocapVideo, renew
from .view_settings import BeyondMocapView
from .rig import BeyondMocapRig

METHODS = (
    ("path", "On the path", "The player's body is laid on the track, with the sway of the clips kept"),
    ("distance", "Distance", "Travelled distance matched by adding or leaving out steps, then by warping time"),
    ("blocks", "Blocks", "Smoothest sequence of clips for the words; the track is not followed"),
)


FORMS = (
    ("ACTION", "Action", "One action on the body"),
    ("STRIPS", "Strips", "NLA strips on the body, one for each piece of a clip, named by clip and words"),
)


def is_armature(_settings, candidate: bpy.types.Object) -> bool:
    """Whether an object may be picked as a player's body."""
    return candidate.type == "ARMATURE"


CURVES = (
    ("BEZIER", "Bezier", "Points on the path, with handles"),
    ("NURBS", "NURBS", "Control points beside the path: a B-spline, smoother, with fewer points"),
)
FEET = (
    ("any", "Any", "Both feet alike"),
    ("left", "Left", "Key moments that name no side take clips of the left foot"),
    ("right", "Right", "Key moments that name no side take clips of the right foot"),
)


def is_track(_settings, candidate: bpy.types.Object) -> bool:
    """Whether an object may be picked as a player's drawn track."""
    return candidate.type in {"CURVE", "EMPTY", "MESH", "ARMATURE"}


def show_on_dot(player, _context) -> None:
    """A player's new name or colour is his dot's too."""
    if player.dot is not None:
        player.dot.name, player.dot.color = f"{player.name} dot", (*player.shirt, 1.0)
        player.dot.beyond_mocap_dot.player, player.dot.beyond_mocap_dot.shirt = player.name, player.shirt


class BeyondMocapPlayer(bpy.types.PropertyGroup):
    """One player: the dots, the words, and the body that came of them."""

    name: StringProperty(name="Name", update=show_on_dot, description="What this player is called")
    use: BoolProperty(name="Use", default=True, description="Include this player in Synthesize and Accept")
    tracking_file: StringProperty(
        name="Tracking", subtype="FILE_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        description="The file with this player's positions",
    )
    metadata_file: StringProperty(
        name="Metadata", subtype="FILE_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        description="The provider's second file, where there is one (pitch, teams)",
    )
    feed_id: StringProperty(
        name="ID in the feed", description="Which player of the tracking file this is; empty for a file of one player"
    )
    provider: StringProperty(name="Provider", description="Whose form the tracking file has; empty guesses it")
    drawn_track: PointerProperty(
        name="Drawn Track", type=bpy.types.Object, poll=is_track,
        description="A curve with speeds at its points, or an object that moves; it counts more than the tracking file",
    )
    drawn_start: FloatProperty(
        name="Begins At", default=0.0, unit="TIME_ABSOLUTE", precision=2,
        description="Second on the clock at which a drawn curve begins; a moving object has its own frames",
    )
    height: FloatProperty(
        name="Height", default=0.0, min=0.0, max=3.0, precision=2,
        description="Metres that the player is tall; 0: as tall as the library's skeleton",
    )
    strong_foot: EnumProperty(
        name="Strong Foot", items=FEET, default="any", description="For key moments without a side"
    )
    style: StringProperty(
        name="Style",
        description="Words, folders or clips (with * and ?) whose clips are taken rather than others; several with ;",
    )
    style_weight: FloatProperty(
        name="Style Weight", default=0.5, min=0.0, max=10.0, precision=2,
        description="Metres per second of missed speed that a clip of the style is worth",
    )
    pins: CollectionProperty(type=BeyondMocapPin, description="Where hands, feet and gaze have to be, and when")
    active_pin: IntProperty(name="Pin", min=0, description="The pin that is shown below the list")
    annotation_file: StringProperty(
        name="Words", subtype="FILE_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        description="Text file of lines 'START END words' and 'TIME words'; none means automatic locomotion",
    )
    annotation_text: PointerProperty(
        name="Text", type=bpy.types.Text,
        description="A text of this file with the words; it counts more than the file on disk",
    )
    shirt: FloatVectorProperty(
        name="Shirt", subtype="COLOR", size=3, min=0.0, max=1.0, default=(0.75, 0.05, 0.06),
        description="Colour of the player's shirt", update=show_on_dot,
    )
    dot: PointerProperty(
        name="Dot", type=bpy.types.Object,
        description="The Empty that runs along the track and carries the strips of the player's words",
    )
    body: PointerProperty(
        name="Body", type=bpy.types.Object, poll=is_armature,
        description="The armature that this player's takes are shown on; made where it is missing",
    )
    rig: PointerProperty(
        name="Rig", type=bpy.types.Object, poll=is_armature,
        description="This player's own rig for Bake to Rig with all players; a copy of the chosen rig where it is "
        "empty",
    )
    take: StringProperty(name="Take", options={"HIDDEN"}, description="Name of the newest take in this session")
    quality: StringProperty(name="Quality", options={"HIDDEN"}, description="Lines 'name: value' about the newest take")
    moments: StringProperty(
        name="Key moments", options={"HIDDEN"}, description="A line for each key moment of the newest take"
    )
    warnings: StringProperty(
        name="Warnings", options={"HIDDEN"}, description="Lines about what to look at in the newest take"
    )
    result: PointerProperty(type=BeyondMocapResult, description="What became of the newest take")


class BeyondMocapSettings(bpy.types.PropertyGroup):
    """All steps of one scene."""

    attached_to = ("Scene.beyond_mocap",)

    version: IntProperty(
        name="Version", options={"HIDDEN"},
        description="Form of what is kept here, see scene/migrate.py; 0: not saved yet",
    )
    rig: PointerProperty(type=BeyondMocapRig, description="Rig, bone map, baking and export")
    library_folder: StringProperty(
        name="Library", subtype="DIR_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        description="Folder of BVH clips with their annotations; may be relative to this file",
    )
    library_unit: FloatProperty(
        name="Metres per unit", default=0.0, min=0.0, precision=5,
        description="Size of one unit of the clips in metres; 0 guesses it from the height of the hips",
    )
    words_model: StringProperty(
        name="Learned Words", subtype="FILE_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        description="What Learn from Words has kept, of this library or another; empty: Propose Words goes by rules",
    )
    library_watch: BoolProperty(
        name="Watch Folder", default=False,
        description="Look every few seconds whether clips or words in the folder are new or changed, and say so; "
        "nothing is built by itself",
    )
    library_holds: StringProperty(name="Holds", options={"HIDDEN"}, description="What the library built last holds")
    live: BoolProperty(
        name="Live",
        description="Update a player by itself when his drawn track, his pins or his strips have been edited: first "
        "quickly, then as well as Synthesize does",
    )
    players: CollectionProperty(type=BeyondMocapPlayer, description="Who is animated, in the order of the list")
    active_player: IntProperty(name="Player", min=0, description="The player that is shown below the list")
    section_start: FloatProperty(
        name="From", default=0.0, min=0.0, unit="TIME_ABSOLUTE", precision=1,
        description="Second of a whole match at which to begin",
    )
    section_end: FloatProperty(
        name="To", default=0.0, min=0.0, unit="TIME_ABSOLUTE", precision=1,
        description="Second of a whole match at which to end; 0 goes to its end",
    )
    method: EnumProperty(name="Method", items=METHODS, default="path", description="How position is dealt with")
    catch_up: BoolProperty(
        name="Catch Up", default=True, description="Let the body catch up with the track smoothly after each warp"
    )
    alpha: FloatProperty(
        name="Word Weight", default=0.2, min=0.0, max=1.0,
        description="Words asked for against smooth transitions: 0 looks only for these, 1 only for the words",
    )
    delta: FloatProperty(
        name="Distance Slack", default=0.5, min=0.0, max=100.0, unit="LENGTH", subtype="DISTANCE",
        description="Of Distance: travelled distance of a stretch that may stay wrong before steps are added or left "
        "out",
    )
    omega: FloatProperty(
        name="Gait Threshold", default=0.0, min=0.0, max=100.0, precision=1,
        description="Between the speeds of two gaits the faster one begins at one part in so many of the way up. "
        "0: where the recordings' own labels change (Path), else a quarter of the way",
    )
    seam_window: FloatProperty(
        name="Cut Window", default=0.8, min=0.0, max=4.0, precision=2, unit="TIME_ABSOLUTE",
        description="Time over which the jump at a cut between two clips is spread",
    )
    track_window: FloatProperty(
        name="Track Window", default=1.2, min=0.2, max=5.0, precision=2, unit="TIME_ABSOLUTE",
        description="Window that takes the jitter out of the track",
    )
    root_window: FloatProperty(
        name="Sway Window", default=1.5, min=0.2, max=5.0, precision=2, unit="TIME_ABSOLUTE",
        description="Of On the path: the body is on the track when both are seen through this window; shorter keeps "
        "less sway",
    )
    gaits: StringProperty(
        name="Gait Clips",
        description="Which clip stands for which gait, where you choose: walking=folder/walk.bvh; "
        "jogging=folder/jog.bvh",
    )
    made: BoolProperty(
        name="Made Clips", default=True,
        description="Of On the path: make or blend clips where recordings lack a speed, and kicks on the run",
    )
    solve_touches: BoolProperty(
        name="Solve Touches", default=False,
        description="Key moments move to the touches that the ball's samples tell, within 0.4 s; the ball goes as "
        "physics has it, and is dribbled step by step",
    )
    mirror: BoolProperty(
        name="Mirrored Clips", default=True, description="Use each clip also with left and right exchanged"
    )
    nearest: BoolProperty(
        name="Nearest Words", default=False,
        description="Where the library lacks a key moment's words, go on with the nearest that it has, and say so",
    )
    seed: IntProperty(
        name="Seed", default=0, min=0,
        description="Of the clustering that Blocks and Distance search in; On the path does not draw lots",
    )
    rate: FloatProperty(
        name="Frame Rate", default=30.0, min=10.0, max=240.0,
        description="Frames per second that are synthesized; the scene keeps its own rate",
    )
    start_frame: IntProperty(
        name="Start Frame", default=1, update=renew,
        description="Scene frame on which the clock below stands at its start",
    )
    start_time: FloatProperty(
        name="Clock at Start", default=0.0, unit="TIME_ABSOLUTE", precision=2, update=renew,
        description="Seconds on the tracking file's clock at the start frame",
    )
    show_moment_names: BoolProperty(
        name="Names of Key Moments", default=True,
        description="Write the names of key moments into NLA editors and dope sheets",
    )
    make_bodies: BoolProperty(name="Bodies", default=True, description="Make a low-poly body for each player")
    make_ball: BoolProperty(name="Ball", default=True, description="Make the ball, where the tracking has one")
    make_paths: BoolProperty(name="Paths", default=True, description="Draw each player's track on the ground")
    keep_hand_keys: BoolProperty(
        name="Keep Hand-Made Keys", default=True,
        description="What you have keyed, moved or deleted on a result stays when it is made anew",
    )
    accept_as: EnumProperty(
        name="Accept As", items=FORMS, default="ACTION", description="What an accepted take becomes"
    )
    video: PointerProperty(type=BeyondMocapVideo, description="The reference video")
    shared: PointerProperty(type=BeyondMocapShared, description="What all players' previews have in common")
    view: PointerProperty(type=BeyondMocapView, description="What is drawn over the 3D view")
    curve_points: IntProperty(
        name="Points", default=0, min=0, max=200,
        description="Control points of a new curve to ride on; 0: as many as it needs to lie within 3 cm",
    )
    curve_degree: IntProperty(
        name="Curve Degree", default=3, min=2, max=5,
        description="Of a NURBS curve: how smooth it is, and how far each control point reaches",
    )
    curve_kind: EnumProperty(name="Kind", items=CURVES, default="BEZIER", description="Kind of a new curve to ride on")
    nudge_step: FloatProperty(
        name="Nudge Step", default=0.1, min=0.001, max=10.0, precision=3, step=1,
        description="Metres that control points go at each nudge",
    )


class BeyondMocapWork(bpy.types.PropertyGroup):
    """What runs in the background just now; on the window manager, so that undo leaves it alone."""

    attached_to = ("WindowManager.beyond_mocap_work",)

    kind: StringProperty(description="Name of the running step; empty while nothing runs")
    text: StringProperty(description="What it is doing")
    fraction: FloatProperty(min=0.0, max=1.0, description="How far it is")
    waiting: StringProperty(description="The players that wait for their turn, a line each")
    ending: BoolProperty(description="Whether it has been asked to finish early")


def absolute(path: str) -> str:
    """A path as typed into a setting, made absolute; empty stays empty."""
    return bpy.path.abspath(path) if path else ""


def as_setting(path: str) -> str:
    """A chosen path as it is kept: relative to the file where it is saved and the user's preferences say so."""
    if bpy.data.is_saved and bpy.context.preferences.filepaths.use_relative_paths:
        try:
            return bpy.path.relpath(path)
        except ValueError:  # another drive on Windows
            return path
    return path


def active_player(settings: BeyondMocapSettings) -> BeyondMocapPlayer | None:
    """The player chosen in the list; None while the list is empty."""
    if 0 <= settings.active_player < len(settings.players):
        return settings.players[settings.active_player]
    return None
