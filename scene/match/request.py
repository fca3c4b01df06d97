"""The settings of a match as requests: what is read, the command line that synthesizes it, and what is displayed."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from ...beyond_mocap.appearance.sports import FOOTBALL, find_assumed_pitch
from ...beyond_mocap.base.digest import hex_digest
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.files.tracking.feed import is_track_csv
from ..core import preferences, sample
from ..core.settings import require_library_folder, to_absolute_path, to_setting_path
from ..player import tracks
from .kits import DEFAULT_COLOURS, to_linear
from .load import TEAMS, DisplayRequest
from .settings import AUTO, FIRST_SECONDS, BeyondMocapMatch, collect_colours, format_float

if TYPE_CHECKING:
    from ...beyond_mocap.motion.track.match_data import Match


def build_command(scene: bpy.types.Scene) -> list[str]:
    """Build the arguments of the command `match`; InputError if something is missing."""
    settings, match = scene.beyond_mocap, scene.beyond_mocap_match
    out = ["match", *_build_arguments(scene), "--out", choose_output_folder(scene)]
    if match.scheduler:
        out += ["--scheduler", match.scheduler]
    elif match.workers:
        out += ["--workers", str(match.workers)]
    cache = preferences.find_cache_folder(require_library_folder(settings))
    return out + (["--cache", cache] if cache else [])


def build_display_request(scene: bpy.types.Scene, folder: str) -> DisplayRequest:
    """Build the request to display a match's folder."""
    settings, match = scene.beyond_mocap, scene.beyond_mocap_match
    library = require_library_folder(settings)
    selected = tuple(player.feed_id for player in match.players if player.use)
    selected = selected if len(selected) < len(match.players) else ()
    start, end = float(format_float(match.start)), float(format_float(match.end))
    unit, build = settings.library_unit or None, preferences.build_library_options(library)
    return DisplayRequest(folder, start, end, players=selected, colours=collect_colours(match), library=library,
                          unit=unit, build=build)


def choose_output_folder(scene: bpy.types.Scene) -> str:
    """Choose the folder of the match: the one in the settings, or one beside the saved file, else beside the tracking
    file.

    Its name has the time and, as a few digits, everything else that is requested.
    """
    match = scene.beyond_mocap_match
    if match.folder:
        return to_absolute_path(match.folder)
    tracking = Path(to_absolute_path(match.tracking_file))
    parent = Path(bpy.data.filepath).parent if bpy.data.is_saved else tracking.parent
    if sample.is_in_sample(parent):
        parent = sample.find_cache_base()
    elif not os.access(parent, os.W_OK):
        parent = Path(bpy.app.tempdir)
    digest = hex_digest("\0".join(_build_arguments(scene)), digits=6)
    return str(parent / f"{tracking.stem} {format_float(match.start)}-{format_float(match.end)} s {digest}")


def choose_display_folder(scene: bpy.types.Scene) -> str:
    """Choose the folder to display: the one in the settings, else the last result; InputError if there is none."""
    match = scene.beyond_mocap_match
    found = match.folder or match.made
    if not found:
        raise InputError("match", "no folder", "the folder of a match", "press Make Match, or choose one",
                         fixes=(Fix("press", "beyond_mocap.make_match"),))
    return to_absolute_path(found)


@dataclass(frozen=True)
class ReadRequest:
    """What to read.

    Attributes:
        tracking: absolute path.
        metadata: absolute path, "" if there is none.
        provider: "" to detect it.
        pitch: length and width, m, for a feed without them; None: those of a football pitch.
    """

    tracking: str
    metadata: str
    provider: str
    pitch: tuple[float, float] | None = None


def build_read_request(match: BeyondMocapMatch, chosen: str = "") -> ReadRequest:
    """Build the request to read a match; InputError if there is no tracking file.

    Args:
        match: the settings.
        chosen: a tracking file used instead of theirs.
    Returns:
        The request.
    """
    tracking = chosen or to_absolute_path(match.tracking_file)
    if not tracking:
        raise InputError("match", "no tracking file", "a provider's tracking of a match", "choose one, or drop it here")
    if is_track_csv(Path(tracking)):
        raise InputError(tracking, "one player's track", "a provider's tracking of a match",
                         "import it in step 2")
    metadata = "" if chosen else to_absolute_path(match.metadata_file)
    return ReadRequest(tracking, metadata, "" if match.provider == AUTO else match.provider,
                       find_assumed_pitch(match.id_data.beyond_mocap_stage.sport))


def read_match(request: ReadRequest, progress) -> tuple[ReadRequest, "Match"]:
    """Read the match, in any thread; return the request and the data."""
    progress(0.05, "reading the match")
    return request, tracks.read_match(request.tracking, request.metadata, request.provider, request.pitch)


def update_match(match: BeyondMocapMatch, request: ReadRequest, data: "Match") -> None:
    """Update the list, the colours and the messages about the data.

    Players deselected in the same file stay deselected. For another file, its first minute is selected, and files
    chosen for the previous one are cleared.

    Args:
        match: the settings.
        request: what was read.
        data: the match.
    """
    same = to_absolute_path(match.read_of) == request.tracking
    excluded = {player.feed_id for player in match.players if not player.use} if same else set()
    if not same:
        match.tracking_file = to_setting_path(request.tracking)
        match.metadata_file = to_setting_path(request.metadata) if request.metadata else ""
        if match.read_of:
            match.joints_file = match.events_file = match.events_metadata_file = match.folder = match.made = ""
        match.start = math.floor(float(data.times[0]))
        match.end = min(match.start + FIRST_SECONDS, math.floor(10.0 * float(data.times[-1])) / 10.0)
        match.active = 0
    match.read_of, match.length_s = to_setting_path(request.tracking), float(data.times[-1])
    match.players.clear()
    for player in sorted(data.players, key=lambda one: (TEAMS.index(one.team), one.number)):
        row = match.players.add()
        row.name, row.feed_id, row.number, row.team = player.name, player.id, player.number, player.team
        row.position, row.use = player.position, player.id not in excluded
    for team in data.teams if not same else ():
        setattr(match, f"{team.ground}_colour", to_linear(team.colour or DEFAULT_COLOURS[team.ground]))
    match.report = "\n".join(dict.fromkeys((*data.notes, *data.report)))


def _build_arguments(scene: bpy.types.Scene) -> list[str]:
    """Build the arguments that determine the result."""
    settings, match = scene.beyond_mocap, scene.beyond_mocap_match
    if not match.tracking_file:
        raise InputError("match", "no tracking file", "a provider's tracking of a match", "choose one, or drop it here")
    out = ["--tracking", to_absolute_path(match.tracking_file), "--library", require_library_folder(settings)]
    for option, path in (("--meta", match.metadata_file), ("--joints", match.joints_file),
                         ("--events", match.events_file)):
        out += [option, to_absolute_path(path)] if path else []
    out += ["--provider", match.provider] if match.provider != AUTO else []
    if match.events_file:
        out += ["--events-meta", to_absolute_path(match.events_metadata_file)] if match.events_metadata_file else []
        out += ["--events-provider", match.events_provider] if match.events_provider != AUTO else []
    if 0.0 < match.end <= match.start:
        found = f"To ({format_float(match.end)} s) is not after From ({format_float(match.start)} s)"
        raise InputError("match", found, "a later time",
                         "set To, or set it to 0 for the end of the match")
    out += ["--from", format_float(match.start)] + (["--to", format_float(match.end)] if match.end else [])
    out += _build_player_arguments(match)
    sport = scene.beyond_mocap_stage.sport
    out += ["--sport", sport] if sport != FOOTBALL else []
    out += [] if match.solve_touches else ["--no-solve-touches"]
    out += ["--fps", format_float(settings.rate), "--seed", str(settings.seed), "--watch", format_float(settings.watch)]
    out += ["--strength", format_float(match.strength), "--masses", match.masses,
            "--fatigue", format_float(match.fatigue)]
    return out + (["--unit", format_float(settings.library_unit)] if settings.library_unit else [])


def _build_player_arguments(match: BeyondMocapMatch) -> list[str]:
    selected = [player.feed_id for player in match.players if player.use]
    if match.players and not selected:
        raise InputError("match", "no players selected", "at least one", "select players in the list",
                         fixes=(Fix("use_all_players"),))
    if len(selected) == len(match.players):
        return []
    if to_absolute_path(match.read_of) != to_absolute_path(match.tracking_file):
        raise InputError("match", f"the list belongs to {Path(match.read_of).name}", "that of the tracking file",
                         "press Read Match, then select players", fixes=(Fix("press", "beyond_mocap.read_match"),))
    return ["--players", *selected]
