"""The settings that panels show and operators read: one group for each scene, saved with the file.

Paths may be relative to the file. What is too large for a file's properties (a built library, a take) is stored in
`session` under the names kept here.
"""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.base.settings import list_settings
from ..characters import player_character
from ..characters.settings import is_original
from ..overlays.settings import BeyondMocapView
from ..player.contact_edits import BeyondMocapContactEdit
from ..player.heading_keys import BeyondMocapHeadingKey
from ..player.pins import BeyondMocapPin
from ..result.result import BeyondMocapResult, BeyondMocapShared
from ..rigs.rig import BeyondMocapRig
from ..timeline.video import BeyondMocapVideo, tag_update
from .properties import find_active_row, with_settings
from .sample import find_moved_path

TASKS = (  # what the tab in the sidebar is for just now; items of an EnumProperty
    ("PLAYER", "Player", "Animate players along their tracks: library, track, labels, take, rig", "ARMATURE_DATA", 0),
    ("MATCH", "Match", "Animate a whole match from a provider's files", "COMMUNITY", 1),
    ("PATH", "Path", "Lead an existing motion along a new path", "CURVE_PATH", 2),
    ("BALL", "Ball", "Passing scenes, throws and kicks, a tracked, carried or aimed ball", "SPHERE", 3),
    ("MARKERS", "Markers & Stream", "Optical markers, and motion received live", "POINTCLOUD_DATA", 4),
    ("LIBRARY", "Library", "The clips: list, labels, import, assets", "ASSET_MANAGER", 5),
)
FILE = {"subtype": "FILE_PATH", "options": {"PATH_SUPPORTS_BLEND_RELATIVE"}}


def is_armature(_settings, candidate: bpy.types.Object) -> bool:
    """Return whether an object may be picked as a player's body."""
    return candidate.type == "ARMATURE"


def is_track(_settings, candidate: bpy.types.Object) -> bool:
    """Return whether an object may be picked as a player's drawn track."""
    return candidate.type in {"CURVE", "EMPTY", "MESH", "ARMATURE"}


def update_character(player, context) -> None:
    """Let the chosen character play the player's motion."""
    player_character.update_character(player, context)


def update_dot(player, _context) -> None:
    """Apply a player's new name or colour to their dot and their character."""
    player_character.update_kit(player)
    if player.dot is not None:
        player.dot.name, player.dot.color = f"{player.name} dot", (*player.shirt, 1.0)
        player.dot.beyond_mocap_dot.player, player.dot.beyond_mocap_dot.shirt = player.name, player.shirt


@with_settings("player")
class BeyondMocapPlayer(bpy.types.PropertyGroup):
    """One player: tracking data, labels, and the generated body."""

    name: StringProperty(name="Name", update=update_dot, description="Name of the player")
    use: BoolProperty(name="Use", default=True, description="Include this player in Synthesize and Apply")
    tracking_file: StringProperty(name="Tracking", description="The file with this player's positions", **FILE)
    metadata_file: StringProperty(name="Metadata", **FILE,
                                  description="The provider's second file, where there is one (pitch, teams)")
    feed_id: StringProperty(name="Feed ID",
                            description="ID of this player in the tracking file; empty for a file of one player")
    provider: StringProperty(name="Provider", description="Format of the tracking file; empty detects it")
    drawn_track: PointerProperty(
        name="Drawn Track", type=bpy.types.Object, poll=is_track,
        description="A curve with speeds at its points, or a moving object; it replaces the tracking file",
    )
    pins: CollectionProperty(type=BeyondMocapPin, description="Targets for hands, feet, gaze and ball, with times")
    active_pin: IntProperty(name="Pin", min=0, description="The pin shown below the list")
    heading_keys: CollectionProperty(type=BeyondMocapHeadingKey,
                                     description="Directions and objects that the body faces, with their times")
    contact_edits: CollectionProperty(type=BeyondMocapContactEdit,
                                      description="Contacts of the feet that are moved, longer, shorter, left out or "
                                      "added")
    active_contact_edit: IntProperty(name="Contact", min=0, description="The edited contact chosen in the list")
    active_heading_key: IntProperty(name="Heading Key", min=0, description="The heading key chosen in the list")
    annotation_file: StringProperty(
        name="Labels", **FILE,
        description="Text file of lines 'START END labels' and 'TIME labels'; none means automatic locomotion",
    )
    annotation_text: PointerProperty(name="Text", type=bpy.types.Text,
                                     description="A text of this file with the labels; it replaces the file "
                                     "on disk")
    shirt: bpy.props.FloatVectorProperty(name="Shirt", subtype="COLOR", size=3, min=0.0, max=1.0, update=update_dot,
                                         default=(0.75, 0.05, 0.06), description="Colour of the player's shirt")
    dot: PointerProperty(name="Dot", type=bpy.types.Object,
                         description="The empty that moves along the track and has the strips of the player's labels")
    body: PointerProperty(name="Body", type=bpy.types.Object, poll=is_armature,
                          description="The armature that plays this player's takes; created where it is missing")
    rig: PointerProperty(
        name="Rig", type=bpy.types.Object, poll=is_armature,
        description="This player's own rig for Bake to Rig with all players; empty uses a copy of the chosen "
        "rig",
    )
    character: PointerProperty(
        name="Character", type=bpy.types.Object, poll=is_original, update=update_character,
        description="Armature of this file that is this player's body, with its meshes; empty: the built-in body",
    )
    character_body: PointerProperty(type=bpy.types.Object, options={"HIDDEN"},
                                    description="Copy of the character that plays the player's motion")
    character_note: StringProperty(options={"HIDDEN"}, description="Messages about the character")
    take: StringProperty(name="Take", options={"HIDDEN"}, description="Name of the newest take in this session")
    quality: StringProperty(name="Quality", options={"HIDDEN"}, description="Lines 'name: value' about the newest take")
    moments: StringProperty(name="Key Moments", options={"HIDDEN"},
                            description="One line for each key moment of the newest take")
    warnings: StringProperty(name="Warnings", options={"HIDDEN"},
                             description="Warnings about the newest take, line by line")
    result: PointerProperty(type=BeyondMocapResult, description="State of the newest take")


@with_settings("synthesis", "result", "library", "path.new_curve")
@with_settings("clock", update=tag_update)
class BeyondMocapSettings(bpy.types.PropertyGroup):
    """The settings of one scene, for all steps."""

    attached_to = ("Scene.beyond_mocap",)
    version: IntProperty(name="Version", options={"HIDDEN"},
                         description="Version of these settings, see scene/core/migrate.py; 0: not saved yet")
    task: EnumProperty(name="Task", items=TASKS, description="What the tab shows the panels of")
    rig: PointerProperty(type=BeyondMocapRig, description="Rig, bone map, baking and export")
    library_folder: StringProperty(
        name="Library", subtype="DIR_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        description="Folder of recordings (BVH, SMPL, FBX, glTF, USD) with their labels; may be relative to this file",
    )
    words_model: StringProperty(
        name="Learned Labels", **FILE,
        description="Model learned from the labels of this or another library; empty: proposals follow rules",
    )
    library_holds: StringProperty(name="Contents", options={"HIDDEN"},
                                  description="Contents of the library that was built last")
    library_gaps: StringProperty(
        name="Left Out and Missing", options={"HIDDEN"},
        description="What the library that was built last leaves out of locomotion, and which motion it lacks",
    )
    players: CollectionProperty(type=BeyondMocapPlayer, description="The players to animate, in the order of the list")
    active_player: IntProperty(name="Player", min=0, description="The player shown below the list")
    video: PointerProperty(type=BeyondMocapVideo, description="The reference video")
    shared: PointerProperty(type=BeyondMocapShared, description="What the previews of all players share")
    view: PointerProperty(type=BeyondMocapView, description="Overlays in the 3D view")

    def list_tuning(self) -> list[str]:
        """List the names of the settings under Fine Tuning."""
        return [row.identifier for row in list_settings("synthesis")
                if row.tuning and row.is_used_by(self.method)]


class BeyondMocapWork(bpy.types.PropertyGroup):
    """What runs in the background; on the window manager, so that undo does not affect it."""

    attached_to = ("WindowManager.beyond_mocap_work",)
    kind: StringProperty(description="Name of the running step; empty while nothing runs")
    text: StringProperty(description="Present step of the work")
    fraction: FloatProperty(min=0.0, max=1.0, description="Share of the work that is done")
    waiting: StringProperty(description="The players that wait for their turn, one line each")
    ending: BoolProperty(description="Whether it was asked to finish early")
    trouble: StringProperty(description="Background update that failed; empty where none did")


def to_absolute_path(path: str) -> str:
    """Return a path from a setting as an absolute one; empty stays empty, and the sample is found where it is now."""
    return find_moved_path(bpy.path.abspath(path)) if path else ""


def require_library_folder(settings: "BeyondMocapSettings") -> str:
    """Return the absolute path of the library's folder; InputError where none is chosen."""
    if not settings.library_folder:
        raise InputError("library", "no folder chosen", "a folder of recordings", "choose one in step 1",
                         fixes=(Fix("choose_library"),))
    return to_absolute_path(settings.library_folder)


def to_setting_path(path: str) -> str:
    """Return a chosen path as it is stored: relative to a saved file where the user's preferences say so."""
    if bpy.data.is_saved and bpy.context.preferences.filepaths.use_relative_paths:
        try:
            return bpy.path.relpath(path)
        except ValueError:  # another drive on Windows
            return path
    return path


def find_active_player(settings: BeyondMocapSettings) -> BeyondMocapPlayer | None:
    """Return the player chosen in the list; None while the list is empty."""
    return find_active_row(settings.players, settings.active_player)


def describe_missed_moments(players) -> str:
    """Describe how many key moments the newest takes of players miss, such as "1 of 3 moments missed"; "" for none."""
    states = [line.rpartition("\t")[2] for player in players for line in player.moments.splitlines()]
    missed = states.count("missed")
    return f"{missed} of {len(states)} moment{'s' if len(states) > 1 else ''} missed" if missed else ""
