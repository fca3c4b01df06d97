"""Bodies of players whom skeletal tracking shows: read, told apart, brought to the library's skeleton, and their places
given to the match's dots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ..base.errors import InputError, format_count
from ..files.joints.joint_feed import JointFeed, PlayerJoints
from ..files.joints.joint_readers import read_joints
from ..files.tracking.tracking import read_match
from ..library.library import Library
from ..library.repair import plant_contacts
from ..motion.contacts import detect_heel_toe_contacts
from ..motion.motion import sample_frames_cubic
from ..motion.retargeting.retarget import Retargeter
from ..motion.skeleton import Skeleton
from ..motion.track.match_data import REFEREE, Match, MatchPlayer, Team
from ..skeletal.reconstruct_bodies import Body, reconstruct_bodies
from ..synthesis.known_body import KnownBody, build_known_body
from .request import MatchRequest

MOST_APART = 2.0
"""Metres, median, between a player's dot and a body that may be theirs."""

_PITCH = (105.0, 68.0)
_AROUND = 2.0  # s of joints that are fitted beyond the span
_FADE = 1.0  # s over which the offset between dot and body fades


@dataclass(frozen=True)
class SeenBodies:
    """What was found of the bodies.

    Attributes:
        notes: messages for people.
        rows: figures of each stretch, by player id.
    """

    notes: tuple[str, ...] = ()
    rows: Mapping[str, list[dict]] = field(default_factory=dict)


def read_tracked(request: MatchRequest) -> tuple[Match, JointFeed | None]:
    """Read the match, and its joints where there are any.

    Args:
        request: the request; its tracking may be skeletal itself.
    Returns:
        The match, with dots from the joints where these are all there is; and the joints.
    Raises:
        InputError: if a file cannot be read.
    """
    path = request.find_joint_file()
    feed = None if path is None else read_joints(path)
    if feed is not None and request.joints is None:
        return build_match(feed), feed
    return read_match(request.tracking, request.meta, request.provider or None), feed


def build_match(feed: JointFeed) -> Match:
    """Build a match whose dots are the pelvis of each person; its clock begins at the first sample."""
    begin, end = (pick(person.times[at] for person in feed.people) for pick, at in ((min, 0), (max, -1)))
    count = int(round((end - begin) * feed.fps)) + 1
    positions = np.full((len(feed.people), count, 2), np.nan)
    for number, person in enumerate(feed.people):
        at = np.clip(np.rint((person.times - begin) * feed.fps).astype(int), 0, count - 1)
        positions[number, at] = _find_pelvis(person)[:, :2]
    knows_teams = any(person.team for person in feed.people)
    players = tuple(MatchPlayer(person.id, person.team or (REFEREE if knows_teams else "home"), person.id, -1)
                    for person in feed.people)
    times = np.arange(count) / feed.fps
    notes = list(feed.notes)
    if not knows_teams:
        notes.append("no teams in the joints: all people taken for one team")
    return Match(times=times, players=players, positions=positions, ball=np.full((count, 3), np.nan), length=_PITCH[0],
                 width=_PITCH[1], fps=feed.fps, provider="joints", periods=((0.0, float(times[-1])),),
                 notes=tuple(notes), teams=(Team("home"), Team("away")))


def _find_pelvis(person: PlayerJoints) -> np.ndarray:
    """Find the middle (T, 3) m between the hips, NaN where they are not seen."""
    hips = [person.landmarks.index(f"{side}_hip") for side in ("left", "right") if f"{side}_hip" in person.landmarks]
    return person.positions[:, hips].mean(axis=1) if hips else np.full((len(person.times), 3), np.nan)


def build_known_bodies(feed: JointFeed | None, match: Match, request: MatchRequest, library: Library,
                       span: tuple[float, float]) -> tuple[dict[str, tuple[KnownBody, ...]], SeenBodies]:
    """Build the bodies of a match's players.

    Args:
        feed: the joints, None for none.
        match: the match; joints of the same file are on its clock less their first second.
        request: the request.
        library: whose skeleton the bodies get.
        span: (start, end) s.
    Returns:
        Known bodies by player id, and what was found.
    Raises:
        InputError: if no body is where a player is.
    """
    if feed is None:
        return {}, SeenBodies()
    begin = min(person.times[0] for person in feed.people) if request.joints is None else 0.0
    part = _cut_feed(feed, begin + span[0] - _AROUND, begin + span[1] + _AROUND)
    if not part.people:
        return {}, SeenBodies(("no joints in that time: all bodies are synthesized",))
    found, notes = reconstruct_bodies(part)
    who, others = _name_people(part, match, begin)
    known: dict[str, list[KnownBody]] = {}
    rows: dict[str, list[dict]] = {}
    for body in found:
        if (player := who.get(body.id)) is None or request.players and player not in request.players:
            continue
        shown = _convert_body(replace(body, start=body.start - begin), library, request.fps)
        if shown is not None:
            known.setdefault(player, []).append(shown)
            rows.setdefault(player, []).append({"from_s": shown.start, "to_s": shown.end, **body.figures})
    notes += [f"{person}: joints without a dot within {MOST_APART:g} m are left out" for person in others]
    return {player: tuple(bodies) for player, bodies in known.items()}, SeenBodies((*feed.notes, *notes), rows)


def _cut_feed(feed: JointFeed, start: float, end: float) -> JointFeed:
    """Cut a feed to a time, s; people with fewer than two frames in it are left out."""
    people = []
    for person in feed.people:
        inside = (person.times >= start) & (person.times <= end)
        if inside.sum() >= 2:
            people.append(replace(person, times=person.times[inside], positions=person.positions[inside]))
    return replace(feed, people=tuple(people))


def _name_people(feed: JointFeed, match: Match, begin: float) -> tuple[dict[str, str], list[str]]:
    """Name the player whom each person of the joints is, by where they are; also list people who are none.

    InputError if nobody is where a player is.
    """
    from scipy.optimize import linear_sum_assignment

    apart = np.array([[_measure_apart(person, begin, match, path) for path in match.positions]
                      for person in feed.people])
    rows, columns = linear_sum_assignment(apart)
    who = {feed.people[row].id: match.players[column].id for row, column in zip(rows, columns)
           if apart[row, column] <= MOST_APART}
    if not who:
        raise InputError("joints", f"the nearest body is {apart.min():.1f} m from any player",
                         f"{MOST_APART:g} m or less", "give joints of this match, on its clock and pitch")
    return who, [person.id for person in feed.people if person.id not in who]


def _measure_apart(person: PlayerJoints, begin: float, match: Match, path: np.ndarray) -> float:
    """Measure the median distance, m, of a person from a player's dots (N, 2) while both are there; 1000 if never."""
    pelvis, times = _find_pelvis(person), person.times - begin
    at = np.clip(np.searchsorted(match.times, times - 0.5 / match.fps), 0, len(match.times) - 1)
    away = np.linalg.norm(path[at] - pelvis[:, :2], axis=1)[np.abs(match.times[at] - times) <= 1.0 / match.fps]
    away = away[np.isfinite(away)]
    return float(np.median(away)) if len(away) else 1000.0


def _convert_body(body: Body, library: Library, fps: float) -> KnownBody | None:
    """Bring a body to the library's skeleton and the output's frames; None if it is too short."""
    motion = body.motion
    rig = Retargeter(motion, library.skeleton, example=library.clips[0].motion, keeps_travel=True)
    on_rig = rig.retarget(motion)
    if motion.fps >= 25.0:
        on_rig = plant_contacts(on_rig, detect_heel_toe_contacts(on_rig))
    first = int(np.ceil(body.start * fps - 1e-6))
    last = int(np.floor((body.start + (len(motion) - 1) / motion.fps) * fps + 1e-6))
    if last - first < 3:
        return None
    at = (np.arange(first, last + 1) / fps - body.start) * motion.fps
    pose = sample_frames_cubic(on_rig, at)
    contacts = (detect_heel_toe_contacts(on_rig) if motion.fps >= 25.0 else np.zeros((len(on_rig), 2, 2), bool))
    return build_known_body(first, fps, pose, contacts[np.clip(np.rint(at).astype(int), 0, len(on_rig) - 1)])


def follow_bodies(match: Match, bodies: Mapping[str, tuple[KnownBody, ...]], skeleton: Skeleton) -> Match:
    """Put the dots where known bodies are; what lies between the two beside a body fades within a second.

    Args:
        match: the match.
        bodies: by player id.
        skeleton: the bodies'.
    Returns:
        The match.
    """
    if not bodies:
        return match
    positions = match.positions.copy()
    for number, player in enumerate(match.players):
        if found := bodies.get(player.id):
            positions[number] = _follow(match.times, positions[number], found)
    positions.setflags(write=False)
    moved = format_count(len(bodies), "player")
    return replace(match, positions=positions, notes=(*match.notes, f"{moved} with bodies from joints"))


def _follow(times: np.ndarray, path: np.ndarray, bodies: tuple[KnownBody, ...]) -> np.ndarray:
    """Move dots (N, 2) m to known bodies."""
    offset, share, own = np.zeros_like(path), np.zeros(len(times)), path.copy()
    for body in bodies:
        at = body.start + np.arange(len(body)) / body.fps
        place = np.stack([np.interp(times, at, body.root[:, axis]) for axis in (0, 1)], axis=1)
        inside = (times >= at[0] - 1e-6) & (times <= at[-1] + 1e-6)
        own[inside] = place[inside]
        for edge, beside in ((at[0], times < at[0]), (at[-1], times > at[-1])):
            near = int(np.argmin(np.abs(times - edge)))
            weight = np.where(beside, np.clip(1.0 - np.abs(times - edge) / _FADE, 0.0, 1.0), 0.0)
            gap = place[near] - path[near]
            stronger = (weight > share) & np.isfinite(gap).all()
            offset[stronger], share[stronger] = weight[stronger, None] * gap, weight[stronger]
    shown = np.any([(times >= body.start - 1e-6) & (times <= body.end + 1e-6) for body in bodies], axis=0)
    return np.where(shown[:, None], own, path + offset)
