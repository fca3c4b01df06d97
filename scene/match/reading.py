"""A provider's files as the panel's list: who plays, in which colours, for how long, and what was wrong with the
data."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...beyond_mocap.base.errors import InputError
from ..core.settings import absolute, as_setting
from ..player import tracks
from .kits import USUAL, linear
from .people import TEAMS
from .settings import AUTO, FIRST, BeyondMocapMatch

if TYPE_CHECKING:
    from ...beyond_mocap.motion.track.match_data import Match


@dataclass(frozen=True)
class Read:
    """What is to be read: absolute paths, "" where there is none; provider "" where it is to be guessed."""

    tracking: str
    metadata: str
    provider: str


def order_of(match: BeyondMocapMatch, chosen: str = "") -> Read:
    """What the settings ask for; chosen: a tracking file that takes the place of theirs. InputError where there is
    none."""
    tracking = chosen or absolute(match.tracking_file)
    if not tracking:
        raise InputError("match", "no tracking file", "a provider's tracking of a match", "choose one, or drop it here")
    if tracks.is_plain(tracking):
        raise InputError(tracking, "one player's track", "a provider's tracking of a match",
                         "import it in step 2, Track & Words")
    metadata = "" if chosen else absolute(match.metadata_file)
    return Read(tracking, metadata, "" if match.provider == AUTO else match.provider)


def work(order: Read, progress) -> tuple[Read, "Match"]:
    """Reads it, in any thread."""
    progress(0.05, "reading the match")
    return order, tracks.match_of(order.tracking, order.metadata, order.provider)


def fill(match: BeyondMocapMatch, order: Read, read: "Match") -> None:
    """The list, the colours and the lines about the data. Who was left out before in the same file stays left out; of
    another file the first minute is chosen, and what was chosen beside the file before is forgotten."""
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
