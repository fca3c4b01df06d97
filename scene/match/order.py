"""The settings of a match as requests: what is read, the command line that synthesizes it, and what is displayed."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from ...beyond_mocap.base.digest import hex_digest
from ...beyond_mocap.base.errors import InputError
from ..core import preferences
from ..core.settings import absolute, as_setting
from ..player import tracks
from .kits import USUAL, linear
from .load import TEAMS, Wanted
from .settings import AUTO, FIRST, BeyondMocapMatch, colours_of, typed

if TYPE_CHECKING:
    from ...beyond_mocap.motion.track.match_data import Match


def command(scene: bpy.types.Scene) -> list[str]:
    """Build the arguments of the command `match`; InputError if something is missing."""
    settings, match = scene.beyond_mocap, scene.beyond_mocap_match
    out = ["match", *_asked(scene), "--out", folder_to_make(scene)]
    if match.scheduler:
        out += ["--scheduler", match.scheduler]
    elif match.workers:
        out += ["--workers", str(match.workers)]
    cache = preferences.cache_folder(_library(settings))
    return out + (["--cache", cache] if cache else [])


def wanted(scene: bpy.types.Scene, folder: str) -> Wanted:
    """Build the request to display a match's folder."""
    settings, match = scene.beyond_mocap, scene.beyond_mocap_match
    library = _library(settings)
    ticked = tuple(player.feed_id for player in match.players if player.use)
    ticked = ticked if len(ticked) < len(match.players) else ()
    start, end = float(typed(match.start)), float(typed(match.end))
    unit, build = settings.library_unit or None, preferences.for_build(library)
    return Wanted(folder, start, end, players=ticked, colours=colours_of(match), library=library, unit=unit,
                  build=build)


def folder_to_make(scene: bpy.types.Scene) -> str:
    """Choose the folder of the match: the one in the settings, or one beside the saved file, else beside the tracking
    file.

    Its name has the time and, as a few digits, everything else that is requested.
    """
    match = scene.beyond_mocap_match
    if match.folder:
        return absolute(match.folder)
    tracking = Path(absolute(match.tracking_file))
    home = Path(bpy.data.filepath).parent if bpy.data.is_saved else tracking.parent
    if not os.access(home, os.W_OK):
        home = Path(bpy.app.tempdir)
    asked = hex_digest("\0".join(_asked(scene)), digits=6)
    return str(home / f"{tracking.stem} {typed(match.start)}-{typed(match.end)} s {asked}")


def folder_to_show(scene: bpy.types.Scene) -> str:
    """Choose the folder to display: the one in the settings, else the last result; InputError if there is none."""
    match = scene.beyond_mocap_match
    found = match.folder or match.made
    if not found:
        raise InputError("match", "no folder", "the folder of a match", "press Make Match, or choose one")
    return absolute(found)


@dataclass(frozen=True)
class Read:
    """What to read.

    Attributes:
        tracking: absolute path.
        metadata: absolute path, "" if there is none.
        provider: "" to detect it.
    """

    tracking: str
    metadata: str
    provider: str


def reading_order(match: BeyondMocapMatch, chosen: str = "") -> Read:
    """Build the request to read a match; InputError if there is no tracking file.

    Args:
        match: the settings.
        chosen: a tracking file used instead of theirs.
    Returns:
        The request.
    """
    tracking = chosen or absolute(match.tracking_file)
    if not tracking:
        raise InputError("match", "no tracking file", "a provider's tracking of a match", "choose one, or drop it here")
    if tracks.is_plain(tracking):
        raise InputError(tracking, "one player's track", "a provider's tracking of a match",
                         "import it in step 2")
    metadata = "" if chosen else absolute(match.metadata_file)
    return Read(tracking, metadata, "" if match.provider == AUTO else match.provider)


def read_match(order: Read, progress) -> tuple[Read, "Match"]:
    """Read the match, in any thread; return the request and the data."""
    progress(0.05, "reading the match")
    return order, tracks.match_of(order.tracking, order.metadata, order.provider)


def fill_match(match: BeyondMocapMatch, order: Read, read: "Match") -> None:
    """Update the list, the colours and the messages about the data.

    Players deselected in the same file stay deselected. For another file, its first minute is selected, and files
    chosen for the previous one are cleared.

    Args:
        match: the settings.
        request: what was read.
        data: the match.
    """
    same = absolute(match.read_of) == order.tracking
    left_out = {player.feed_id for player in match.players if not player.use} if same else set()
    if not same:
        match.tracking_file = as_setting(order.tracking)
        match.metadata_file = as_setting(order.metadata) if order.metadata else ""
        if match.read_of:
            match.events_file = match.events_metadata_file = match.folder = match.made = ""
        match.start = math.floor(float(read.times[0]))
        match.end = min(match.start + FIRST, math.floor(10.0 * float(read.times[-1])) / 10.0)
        match.active = 0
    match.read_of, match.length_s = as_setting(order.tracking), float(read.times[-1])
    match.players.clear()
    for player in sorted(read.players, key=lambda one: (TEAMS.index(one.team), one.number)):
        row = match.players.add()
        row.name, row.feed_id, row.number, row.team = player.name, player.id, player.number, player.team
        row.position, row.use = player.position, player.id not in left_out
    for team in read.teams if not same else ():
        setattr(match, f"{team.ground}_colour", linear(team.colour or USUAL[team.ground]))
    match.report = "\n".join(dict.fromkeys((*read.notes, *read.report)))


def _asked(scene: bpy.types.Scene) -> list[str]:
    """Build the arguments that determine the result."""
    settings, match = scene.beyond_mocap, scene.beyond_mocap_match
    if not match.tracking_file:
        raise InputError("match", "no tracking file", "a provider's tracking of a match", "choose one, or drop it here")
    out = ["--tracking", absolute(match.tracking_file), "--library", _library(settings)]
    for option, path in (("--meta", match.metadata_file), ("--events", match.events_file)):
        out += [option, absolute(path)] if path else []
    out += ["--provider", match.provider] if match.provider != AUTO else []
    if match.events_file:
        out += ["--events-meta", absolute(match.events_metadata_file)] if match.events_metadata_file else []
        out += ["--events-provider", match.events_provider] if match.events_provider != AUTO else []
    if 0.0 < match.end <= match.start:
        found = f"To ({typed(match.end)} s) is not after From ({typed(match.start)} s)"
        raise InputError("match", found, "a later time",
                         "set To, or set it to 0 for the end of the match")
    out += ["--from", typed(match.start)] + (["--to", typed(match.end)] if match.end else [])
    out += _players(match)
    out += [] if match.solve_touches else ["--no-solve-touches"]
    out += ["--fps", typed(settings.rate), "--seed", str(settings.seed)]
    return out + (["--unit", typed(settings.library_unit)] if settings.library_unit else [])


def _players(match: BeyondMocapMatch) -> list[str]:
    ticked = [player.feed_id for player in match.players if player.use]
    if match.players and not ticked:
        raise InputError("match", "no players selected", "at least one", "select players in the list")
    if len(ticked) == len(match.players):
        return []
    if absolute(match.read_of) != absolute(match.tracking_file):
        raise InputError("match", f"the list belongs to {Path(match.read_of).name}", "that of the tracking file",
                         "press Read Match, then select players")
    return ["--players", *ticked]


def _library(settings) -> str:
    if not settings.library_folder:
        raise InputError("library", "no folder chosen", "a folder of clips", "choose one in step 1")
    return absolute(settings.library_folder)
