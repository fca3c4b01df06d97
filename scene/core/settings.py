"""What the panels show and the operators read: one group of settings per scene, saved with the file.

Paths may be relative to the file. What is too large for a file's properties (a built library, a take) lives in
`session` under the names kept here.
"""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, CollectionProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ...beyond_mocap.base.settings import rows_of
from ..overlays.settings import BeyondMocapView
from ..player.pins import BeyondMocapPin
from ..result.result import BeyondMocapResult, BeyondMocapShared
from ..rigs.rig import BeyondMocapRig
from ..timeline.video import BeyondMocapVideo, renew
from .properties import active_row, with_settings

FILE = {"subtype": "FILE_PATH", "options": {"PATH_SUPPORTS_BLEND_RELATIVE"}}


def is_armature(_settings, candidate: bpy.types.Object) -> bool:
    """Whether an object may be picked as a player's body."""
    return candidate.type == "ARMATURE"


def is_track(_settings, candidate: bpy.types.Object) -> bool:
    """Whether an object may be picked as a player's drawn track."""
    return candidate.type in {"CURVE", "EMPTY", "MESH", "ARMATURE"}


def show_on_dot(player, _context) -> None:
    """A player's new name or colour is his dot's too."""
    if player.dot is not None:
        player.dot.name, player.dot.color = f"{player.name} dot", (*player.shirt, 1.0)
        player.dot.beyond_mocap_dot.player, player.dot.beyond_mocap_dot.shirt = player.name, player.shirt


@with_settings("player")
class BeyondMocapPlayer(bpy.types.PropertyGroup):
    """One player: the dots, the words, and the body that came of them."""

    name: StringProperty(name="Name", update=show_on_dot, description="What this player is called")
    use: BoolProperty(name="Use", default=True, description="Include this player in Synthesize and Accept")
    tracking_file: StringProperty(name="Tracking", description="The file with this player's positions", **FILE)
    metadata_file: StringProperty(name="Metadata", **FILE,
                                  description="The provider's second file, where there is one (pitch, teams)")
    feed_id: StringProperty(name="ID in the feed",
                            description="Which player of the tracking file this is; empty for a file of one player")
    provider: StringProperty(name="Provider", description="Whose form the tracking file has; empty guesses it")
    drawn_track: PointerProperty(
        name="Drawn Track", type=bpy.types.Object, poll=is_track,
        description="A curve with speeds at its points, or an object that moves; it counts more than the tracking file",
    )
    pins: CollectionProperty(type=BeyondMocapPin, description="Where hands, feet and gaze have to be, and when")
    active_pin: IntProperty(name="Pin", min=0, description="The pin that is shown below the list")
    annotation_file: StringProperty(
        name="Words", **FILE,
        description="Text file of lines 'START END words' and 'TIME words'; none means automatic locomotion",
    )
    annotation_text: PointerProperty(name="Text", type=bpy.types.Text,
                                     description="A text of this file with the words; it counts more than the file "
                                     "on disk")
    shirt: bpy.props.FloatVectorProperty(name="Shirt", subtype="COLOR", size=3, min=0.0, max=1.0, update=show_on_dot,
                                         default=(0.75, 0.05, 0.06), description="Colour of the player's shirt")
    dot: PointerProperty(name="Dot", type=bpy.types.Object,
                         description="The Empty that runs along the track and carries the strips of the player's words")
    body: PointerProperty(name="Body", type=bpy.types.Object, poll=is_armature,
                          description="The armature that this player's takes are shown on; made where it is missing")
    rig: PointerProperty(
        name="Rig", type=bpy.types.Object, poll=is_armature,
        description="This player's own rig for Bake to Rig with all players; a copy of the chosen rig where it is "
        "empty",
    )
    take: StringProperty(name="Take", options={"HIDDEN"}, description="Name of the newest take in this session")
    quality: StringProperty(name="Quality", options={"HIDDEN"}, description="Lines 'name: value' about the newest take")
    moments: StringProperty(name="Key moments", options={"HIDDEN"},
                            description="A line for each key moment of the newest take")
    warnings: StringProperty(name="Warnings", options={"HIDDEN"},
                             description="Lines about what to look at in the newest take")
    result: PointerProperty(type=BeyondMocapResult, description="What became of the newest take")


@with_settings("synthesis", "result", "library", "path.new_curve")
@with_settings("clock", update=renew)
class BeyondMocapSettings(bpy.types.PropertyGroup):
    """All steps of one scene."""

    attached_to = ("Scene.beyond_mocap",)
    version: IntProperty(name="Version", options={"HIDDEN"},
                         description="Form of what is kept here, see scene/core/migrate.py; 0: not saved yet")
    rig: PointerProperty(type=BeyondMocapRig, description="Rig, bone map, baking and export")
    library_folder: StringProperty(
        name="Library", subtype="DIR_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        description="Folder of BVH clips with their annotations; may be relative to this file",
    )
    words_model: StringProperty(
        name="Learned Words", **FILE,
        description="What Learn from Words has kept, of this library or another; empty: Propose Words goes by rules",
    )
    library_holds: StringProperty(name="Holds", options={"HIDDEN"}, description="What the library built last holds")
    players: CollectionProperty(type=BeyondMocapPlayer, description="Who is animated, in the order of the list")
    active_player: IntProperty(name="Player", min=0, description="The player that is shown below the list")
    video: PointerProperty(type=BeyondMocapVideo, description="The reference video")
    shared: PointerProperty(type=BeyondMocapShared, description="What all players' previews have in common")
    view: PointerProperty(type=BeyondMocapView, description="What is drawn over the 3D view")

    def list_tuning(self) -> list[str]:
        """Names of the settings that the panel lists under Fine Tuning."""
        return [row.identifier for row in rows_of("synthesis") if row.tuning in ("any", self.method)]


class BeyondMocapWork(bpy.types.PropertyGroup):
    """What runs in the background just now; on the window manager, so that undo leaves it alone."""

    attached_to = ("WindowManager.beyond_mocap_work",)
    kind: StringProperty(description="Name of the running step; empty while nothing runs")
    text: StringProperty(description="What it is doing")
    fraction: FloatProperty(min=0.0, max=1.0, description="How far it is")
    waiting: StringProperty(description="The players that wait for their turn, a line each")
    ending: BoolProperty(description="Whether it has been asked to finish early")
    trouble: StringProperty(description="What that looks by itself has failed; empty where nothing has")


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
    return active_row(settings.players, settings.active_player)
