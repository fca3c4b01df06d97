"""Properties of the panel "Match": files, time, players, and what is displayed. Saved with the file and covered by
undo.
"""

import bpy
import numpy as np
from bpy.props import (
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...beyond_mocap.files.provider_texts import EVENTS, TRACKING
from ..characters.settings import is_original
from ..core.properties import with_settings
from . import kits

FILE = {"subtype": "FILE_PATH", "options": {"PATH_SUPPORTS_BLEND_RELATIVE"}}
AUTO = "AUTO"
DETECT_ITEM = (AUTO, "Automatic", "Detect the provider from the file")
PROVIDER_ITEMS, EVENT_PROVIDER_ITEMS = (
    [DETECT_ITEM, *((one["name"], one["title"], one["files"].replace("`", "")) for one in texts.values())]
    for texts in (TRACKING, EVENTS))
COLOUR = {"subtype": "COLOR", "size": 3, "min": 0.0, "max": 1.0}
CHARACTER_GROUPS = ("home", "away", "referee", "keeper")
TEAM_ITEMS = (("home", "Home", "The home team"), ("away", "Away", "The away team"), ("referee", "Referee", "Referees"))
FIRST_SECONDS = 60.0
"""s that are selected after a match has been read."""


def update_colours(match, _context) -> None:
    """Update the displayed kits when a colour changes."""
    if match.shown:
        kits.update_materials(match.id_data, collect_colours(match))


def update_bodies(match, context) -> None:
    """Show the displayed match again with other bodies."""
    from . import show

    if match.shown and not show.show_again(context):
        match.character_note = "Press Show Match to change the bodies of a match from before the file was opened"


CHARACTER = {"type": bpy.types.Object, "poll": is_original, "update": update_bodies}


class BeyondMocapMatchPlayer(bpy.types.PropertyGroup):
    """One player of a match; `name` is their name."""

    feed_id: StringProperty(name="ID", description="Identifier in the feed")
    use: bpy.props.BoolProperty(name="Use", default=True, description="Include this player")
    number: IntProperty(name="Number", default=-1, description="Shirt number; -1 if the feed has none")
    team: EnumProperty(name="Team", items=TEAM_ITEMS, description="Team of the player")
    position: StringProperty(name="Position", description="Playing position, if the feed provides it")


@with_settings("match.section", "match.work", "match")
class BeyondMocapMatch(bpy.types.PropertyGroup):
    """Settings of a match: its files, what is requested of it, and what is displayed."""

    attached_to = ("Scene.beyond_mocap_match",)
    tracking_file: StringProperty(
        name="Tracking", description="A provider's tracking file of a match, or skeletal tracking", **FILE
    )
    metadata_file: StringProperty(
        name="Metadata", description="The provider's second file; empty: a matching file beside the first", **FILE
    )
    joints_file: StringProperty(
        name="Joints", description="Skeletal tracking of the same match: bodies where it shows them", **FILE
    )
    events_file: StringProperty(
        name="Events", description="Events from a provider or as CSV; empty: found from the ball's trajectory", **FILE
    )
    events_metadata_file: StringProperty(
        name="Events Metadata", description="Lineups or metadata of the events; empty: a matching file beside them",
        **FILE,
    )
    events_provider: EnumProperty(name="Events Provider", items=EVENT_PROVIDER_ITEMS,
                                  description="Format of the events")
    provider: EnumProperty(name="Provider", items=PROVIDER_ITEMS, description="Format of the files")
    folder: StringProperty(
        name="Folder", subtype="DIR_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        description="Where results are stored, some megabytes per match; empty: a folder per selection "
        "beside the saved file or the tracking file",
    )
    home_colour: FloatVectorProperty(name="Home Shirts", default=kits.to_linear(kits.DEFAULT_COLOURS["home"]),
                                     update=update_colours, description="Colour of the home team's shirts", **COLOUR)
    away_colour: FloatVectorProperty(name="Away Shirts", default=kits.to_linear(kits.DEFAULT_COLOURS["away"]),
                                     update=update_colours, description="Colour of the away team's shirts", **COLOUR)
    referee_colour: FloatVectorProperty(name="Referees", default=kits.to_linear(kits.DEFAULT_COLOURS["referee"]),
                                        update=update_colours, description="Colour of the referees' shirts", **COLOUR)
    home_character: PointerProperty(name="Home Body", **CHARACTER,
                                    description="Armature of this file as the home team's body; empty: built-in")
    away_character: PointerProperty(name="Away Body", **CHARACTER,
                                    description="Armature of this file as the away team's body; empty: built-in")
    referee_character: PointerProperty(name="Referees' Body", **CHARACTER,
                                       description="Armature of this file as the referees' body; empty: built-in")
    keeper_character: PointerProperty(name="Keepers' Body", **CHARACTER,
                                      description="Armature of this file as the keepers' body; empty: their team's")
    character_note: StringProperty(options={"HIDDEN"}, description="Messages about the teams' bodies")
    players: CollectionProperty(type=BeyondMocapMatchPlayer, description="Players of the match")
    active: IntProperty(name="Player", min=0, description="Active player in the list")
    read_of: StringProperty(options={"HIDDEN"}, description="Tracking file the list was read from")
    length_s: FloatProperty(options={"HIDDEN"}, description="End of the match on its clock, in seconds")
    report: StringProperty(options={"HIDDEN"}, description="Messages about the data: detected and corrected values")
    messages: StringProperty(options={"HIDDEN"}, description="Status and warnings")
    quality: StringProperty(options={"HIDDEN"}, description="How many targets the displayed players meet")
    made: StringProperty(options={"HIDDEN"}, description="Folder of the last result if none is chosen")
    shown_start: FloatProperty(options={"HIDDEN"}, description="Match second of the first displayed frame")
    shown_first: IntProperty(options={"HIDDEN"}, description="First displayed frame")
    shown_rate: FloatProperty(options={"HIDDEN"}, description="Frame rate of the keys; 0: the scene's")
    shown: StringProperty(options={"HIDDEN"}, description="Displayed folder; empty if there is none")
    shown_section: StringProperty(options={"HIDDEN"}, description="Name of what is displayed in this session")

    def list_characters(self) -> dict[str, bpy.types.Object | None]:
        """List the teams' own characters by group."""
        return {group: getattr(self, f"{group}_character") for group in CHARACTER_GROUPS}


def format_float(value: float) -> str:
    """Format a float property as it was typed: with the fewest decimals that keep its value."""
    return str(np.float32(value)).removesuffix(".0")


def collect_colours(match: BeyondMocapMatch) -> dict[str, str]:
    """Collect "#RRGGBB" of shirts by team."""
    return {team: kits.to_hex(getattr(match, f"{team}_colour")) for team in kits.DEFAULT_COLOURS}


def find_active_player(match: BeyondMocapMatch) -> BeyondMocapMatchPlayer | None:
    """Find the active player in the list; None if it is empty."""
    return match.players[match.active] if 0 <= match.active < len(match.players) else None
