"""Bodies of players whom skeletal tracking shows: read, named, brought to the library's skeleton, and their places
given to the match's dots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from ..base.errors import format_count, format_seconds
from ..base.settings import find_setting
from ..files.joints.joint_feed import JointFeed
from ..files.joints.joint_readers import read_joints
from ..files.tracking.match_arrays import USUAL_PITCH, check_clock
from ..files.tracking.match_repairs import repair_ball
from ..files.tracking.tracking import read_match
from ..library.library import Library
from ..motion.contacts import detect_heel_toe_contacts
from ..motion.humanoid import estimate_stature
from ..motion.motion import sample_frames_cubic
from ..motion.retargeting.neutral import scale_stance
from ..motion.track.match_data import REFEREE, Match, MatchPlayer, Team
from ..skeletal.joint_examples import read_examples
from ..skeletal.reconstruct_bodies import PLANTED_RATE, Body, KnownElsewhere, fit_planted_body, reconstruct_bodies
from ..synthesis.known_body import KnownBody, build_known_body, find_shown_frames
from .joint_clock import MOST_APART, align_joints, find_pelvis, name_people, sample_path
from .request import MatchRequest

_HEIGHT = find_setting("player", "height")
_AROUND = 2.0  # s of joints that are fitted beyond the span
_FADE = 1.0  # s over which the offset between dot and body fades


@dataclass(frozen=True, eq=False, kw_only=True)
class SeenPlayer:
    """The bodies of one player.

    Attributes:
        bodies: in order of time.
        height: m, the player's.
        rows: figures of each body (`Body.measure`), with its times.
    """

    bodies: tuple[KnownBody, ...] = ()
    height: float = 0.0
    rows: tuple[dict, ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class SeenBodies:
    """What was found of all bodies.

    Attributes:
        players: by id, only those with bodies.
        notes: messages for people.
    """

    players: Mapping[str, SeenPlayer] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def read_tracked(request: MatchRequest) -> tuple[Match, JointFeed | None]:
    """Read the match, and its joints where there are any.

    Args:
        request: the request; its tracking may be skeletal itself.
    Returns:
        The match, with dots from the joints where these are all there is; and the joints on its clock.
    Raises:
        InputError: if a file cannot be read, or the joints are not of the match.
    """
    path = request.find_joint_file()
    if path is not None and request.joints is None:
        return read_joint_match(path, request.find_pitch())
    match = read_match(request.tracking, request.meta, request.provider or None, pitch=request.find_pitch())
    return match, None if path is None else align_joints(read_joints(path), match, path)


def read_joint_match(path: Path | str, pitch: tuple[float, float] | None = None) -> tuple[Match, JointFeed]:
    """Read skeletal tracking as a match.

    Args:
        path: the file.
        pitch: length and width, m; None: 105 x 68.
    Returns:
        The match, whose clock begins at the first sample, and the joints on it.
    Raises:
        InputError: if the file cannot be read, or has times of more than a day.
    """
    feed = _begin_at_zero(read_joints(path, with_ball=True))
    check_clock(path, np.concatenate([person.times for person in feed.people]))
    return build_match(feed, pitch or USUAL_PITCH), feed


def build_match(feed: JointFeed, pitch: tuple[float, float] = USUAL_PITCH) -> Match:
    """Build a match whose dots are the pelvis of each person, and whose ball is the feed's.

    Args:
        feed: the joints; 0 s is their first sample.
        pitch: length and width, m.
    Returns:
        The match.
    """
    end = max(person.times[-1] for person in feed.people)
    count = int(round(end * feed.fps)) + 1
    positions = np.full((len(feed.people), count, 2), np.nan)
    for number, person in enumerate(feed.people):
        at = np.clip(np.rint(person.times * feed.fps).astype(int), 0, count - 1)
        positions[number, at] = find_pelvis(person)[:, :2]
    knows_teams = any(person.team for person in feed.people)
    players = tuple(MatchPlayer(person.id, person.team or (REFEREE if knows_teams else "home"), person.id, -1)
                    for person in feed.people)
    times = np.arange(count) / feed.fps
    notes = () if knows_teams else ("no teams in the joints: all people are taken for one team",)
    ball, repairs = _sample_ball(feed, times, pitch)
    return Match(times=times, players=players, positions=positions, ball=ball, length=pitch[0],
                 width=pitch[1], fps=feed.fps, provider="joints", periods=((0.0, float(times[-1])),),
                 notes=(*feed.notes, *notes), teams=(Team("home"), Team("away")), report=tuple(repairs))


def _sample_ball(feed: JointFeed, times: np.ndarray, pitch: tuple[float, float]) -> tuple[np.ndarray, list[str]]:
    """Sample a feed's ball (T, 3) m, repaired, at times (T,) s, and list what was repaired."""
    if len(feed.ball) < 2:
        return np.full((len(times), 3), np.nan), []
    places, lines = repair_ball(feed.ball[:, 1:], *pitch)
    return sample_path(feed.ball[:, 0], places, times), lines


def _begin_at_zero(feed: JointFeed) -> JointFeed:
    """Let a feed's clock begin at its first sample."""
    begin = min(person.times[0] for person in feed.people)
    notes = (f"the joints begin at {format_seconds(begin)} s of their own clock, which is 0 s here",) * bool(begin)
    people = tuple(replace(person, times=person.times - begin) for person in feed.people)
    return replace(feed, people=people, ball=feed.ball - [begin, 0.0, 0.0, 0.0], notes=(*feed.notes, *notes))


def build_known_bodies(feed: JointFeed | None, match: Match, request: MatchRequest, library: Library,
                       span: tuple[float, float]) -> SeenBodies:
    """Build the bodies of a match's players.

    Args:
        feed: the joints on the match's clock, None for none.
        match: the match.
        request: the request.
        library: whose skeleton the bodies get.
        span: (start, end) s.
    Returns:
        What was found.
    Raises:
        InputError: if the joints are of other people, or wrong.
    """
    if feed is None:
        return SeenBodies()
    who = name_people(feed, match)
    part = _cut_feed(feed, span[0] - _AROUND, span[1] + _AROUND)
    if not part.people:
        return SeenBodies(notes=("no joints in that time: all bodies are synthesized",))
    notes = [f"{person.id}: joints without a dot within {MOST_APART:g} m are left out" for person in part.people
             if person.id not in who]
    wanted = {person for person, player in who.items() if not request.players or player in request.players}
    known = KnownElsewhere(examples=read_examples(library), path_of=partial(_sample_dot, match, who))
    found, lines = reconstruct_bodies(part, ids=wanted, known=known)
    players: dict[str, list[Body]] = {}
    for body in sorted(found, key=lambda one: one.start):
        players.setdefault(who[body.id], []).append(body)
    shown = {player: _convert_bodies(bodies, library, request.fps) for player, bodies in players.items()}
    return SeenBodies(players={player: one for player, one in shown.items() if one.bodies},
                      notes=(*feed.notes, *notes, *lines))


def _sample_dot(match: Match, who: Mapping[str, str], person: str, times: np.ndarray) -> np.ndarray:
    """Sample the dot (T, 2) m of a person at times (T,) s, NaN where it is not known."""
    number = next(number for number, player in enumerate(match.players) if player.id == who[person])
    return sample_path(match.times, match.positions[number], times)


def _cut_feed(feed: JointFeed, start: float, end: float) -> JointFeed:
    """Cut a feed to a time, s; people with fewer than two frames in it are left out."""
    people = (person.cut_span(start, end) for person in feed.people)
    return replace(feed, people=tuple(person for person in people if len(person.times) >= 2))


def _convert_bodies(bodies: list[Body], library: Library, fps: float) -> SeenPlayer:
    """Bring a player's bodies, in order of time, to the library's skeleton in their size, and the output's frames."""
    frames = [len(body.motion) for body in bodies]
    height = np.average([estimate_stature(body.motion.skeleton) for body in bodies], weights=frames)
    height = round(float(np.clip(height, _HEIGHT.least, _HEIGHT.most)), 2)
    stance = scale_stance(library.neutral_stance, height / estimate_stature(library.skeleton))
    out, rows, end = [], [], -np.inf
    for body in bodies:
        moved = replace(body, motion=fit_planted_body(body.joints, body.motion.fps, stance))
        known = _sample_body(moved, fps) if body.start > end else None
        if known is not None:
            out.append(known)
            rows.append({"from_s": known.start, "to_s": known.end, **moved.measure()})
            end = known.end
    return SeenPlayer(bodies=tuple(out), height=height, rows=tuple(rows))


def _sample_body(body: Body, fps: float) -> KnownBody | None:
    """Sample a body at the output's frames; None if it has fewer than four of them."""
    motion = body.motion
    first = int(np.ceil(body.start * fps - 1e-6))
    last = int(np.floor((body.start + (len(motion) - 1) / motion.fps) * fps + 1e-6))
    if last - first < 3:
        return None
    at = (np.arange(first, last + 1) / fps - body.start) * motion.fps
    contacts = (detect_heel_toe_contacts(motion) if motion.fps >= PLANTED_RATE
                else np.zeros((len(motion), 2, 2), bool))
    return build_known_body(first, fps, sample_frames_cubic(motion, at),
                            contacts[np.clip(np.rint(at).astype(int), 0, len(motion) - 1)])


def follow_bodies(match: Match, bodies: SeenBodies) -> Match:
    """Put the dots where known bodies are; what lies between the two beside a body fades within a second.

    Args:
        match: the match.
        bodies: what was found.
    Returns:
        The match.
    """
    if not bodies.players:
        return match
    positions = match.positions.copy()
    for number, player in enumerate(match.players):
        if player.id in bodies.players:
            positions[number] = _follow(match.times, positions[number], bodies.players[player.id].bodies)
    positions.setflags(write=False)
    moved = format_count(len(bodies.players), "player")
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
    return np.where(find_shown_frames(bodies, times)[:, None], own, path + offset)
