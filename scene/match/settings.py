"""What the panel "Match" shows: files, the minute that is wanted, who is in it, and what is shown of it. Saved with the
file, known to undo."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

from ...beyond_mocap.files.event_providers import EVENT_PROVIDERS
from ...beyond_mocap.files.tracking.providers import PROVIDERS
from ..core.properties import with_settings
from .kits import USUAL, linear, repaint, written

FILE = {"subtype": "FILE_PATH", "options": {"PATH_SUPPORTS_BLEND_RELATIVE"}}
AUTO = "AUTO"
GUESS = (AUTO, "Guess", "By what the file looks like")
GIVEN = [GUESS, *((one.name, one.title, one.files.replace("`", "")) for one in PROVIDERS.values())]
TOLD = [GUESS, *((one.name, one.title, one.files.replace("`", "")) for one in EVENT_PROVIDERS.values())]
COLOUR = {"subtype": "COLOR", "size": 3, "min": 0.0, "max": 1.0}
KINDS = (("home", "Home", "The home team"), ("away", "Away", "The away team"), ("referee", "Referee", "Referees"))
FIRST = 60.0
"""Seconds that are chosen when a match has been read."""


def show_colours(match, _context) -> None:
    """New colours are seen at once on those who are shown."""
    if match.shown:
        repaint(match.id_data, colours_of(match))


class BeyondMocapMatchPlayer(bpy.types.PropertyGroup):
    """One player of a match; `name` is what he is called."""

    feed_id: StringProperty(name="ID", description="As the feed has it")
    use: bpy.props.BoolProperty(name="Use", default=True, description="Make and show this player")
    number: IntProperty(name="Number", default=-1, description="On the shirt; -1 where the feed has none")
    team: EnumProperty(name="Team", items=KINDS, description="Whom he belongs to")
    position: StringProperty(name="Position", description="Where he plays, where the feed tells")


@with_settings("match.section", "match.work", "match")
class BeyondMocapMatch(bpy.types.PropertyGroup):
    """A match: what it is made from, what is wanted of it, and what is shown."""

    attached_to = ("Scene.beyond_mocap_match",)
    tracking_file: StringProperty(name="Tracking", description="A provider's tracking of a whole match", **FILE)
    metadata_file: StringProperty(
        name="Metadata", description="The provider's second file; empty: one beside the first whose name fits", **FILE
    )
    events_file: StringProperty(
        name="Events", description="What happened, from a provider or as CSV; empty: found in the ball's course", **FILE
    )
    events_metadata_file: StringProperty(
        name="Events' Meta", description="Lineups or metadata of the events; empty: a file beside them that fits",
        **FILE,
    )
    events_provider: EnumProperty(name="Events' Provider", items=TOLD, description="Whose form the events have")
    provider: EnumProperty(name="Provider", items=GIVEN, description="Whose form the files have")
    folder: StringProperty(
        name="Folder", subtype="DIR_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        description="Where everybody's motion is kept, some megabytes a match. Empty: one for each stretch and choice, "
        "beside the saved file or the tracking",
    )
    home_colour: FloatVectorProperty(name="Home Shirts", default=linear(USUAL["home"]), update=show_colours,
                                     description="Colour of the home team's shirts", **COLOUR)
    away_colour: FloatVectorProperty(name="Away Shirts", default=linear(USUAL["away"]), update=show_colours,
                                     description="Colour of the away team's shirts", **COLOUR)
    referee_colour: FloatVectorProperty(name="Referees", default=linear(USUAL["referee"]), update=show_colours,
                                        description="Colour of the referees' shirts", **COLOUR)
    players: CollectionProperty(type=BeyondMocapMatchPlayer, description="Who is in the match")
    active: IntProperty(name="Player", min=0, description="The player that is chosen in the list")
    read_of: StringProperty(options={"HIDDEN"}, description="The tracking file that the list was read from")
    length_s: FloatProperty(options={"HIDDEN"}, description="Seconds that the match lasts on its clock")
    report: StringProperty(options={"HIDDEN"}, description="Lines about the data: guessed, put right, who is there")
    told: StringProperty(options={"HIDDEN"}, description="Lines about what was made")
    made: StringProperty(options={"HIDDEN"}, description="The folder made last where none is chosen")
    shown_start: FloatProperty(options={"HIDDEN"}, description="Second of the match's clock at the first shown frame")
    shown_first: IntProperty(options={"HIDDEN"}, description="That frame")
    shown_rate: FloatProperty(options={"HIDDEN"}, description="Frames a second of the keys; 0: the scene's")
    shown: StringProperty(options={"HIDDEN"}, description="The folder that is shown; empty where none is")


def typed(value: float) -> str:
    """A float property as somebody has typed it: the shortest decimals that it keeps."""
    return str(np.float32(value)).removesuffix(".0")


def colours_of(match: BeyondMocapMatch) -> dict[str, str]:
    """Team -> "#RRGGBB" of its shirts."""
    return {team: written(getattr(match, f"{team}_colour")) for team in USUAL}


def active_of(match: BeyondMocapMatch) -> BeyondMocapMatchPlayer | None:
    """The player chosen in the list; None while it is empty."""
    return match.players[match.active] if 0 <= match.active < len(match.players) else None
