"""Who of a match is made, when he is there, and where he is asked to be: everybody's tracks, cleaned, on one clock of
frames, and pushed apart where two would stand in each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import InputError, told_time
from ..base.time_series import interpolate
from ..motion.track import Track, clean
from ..motion.track.match_data import Match, MatchPlayer
from .crowd.spacing import keeping, spaced
from .crowd.variety import lags
from .order import MatchOrder
from .pieces.units import cut_track

SHORTEST = 1.0
"""Seconds; who is there for less is not made."""

NEAR_SAMPLES = 2.0
"""Times a second at which it is looked who is near whom."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Role:
    """A player who is to be made. player: who; measured: his cleaned tracks, one for each stretch in which he is there,
    each from a frame of the match's clock (a whole number of 1 / fps seconds) to another; asked: the same, pushed out
    of others' ways. notes: lines on what was put right. reason: why he cannot be made, else "". number: his place in
    the match, by which he differs from others. lag: s, of the clips that he likes (`Plan.lag`)."""

    player: MatchPlayer
    measured: tuple[Track, ...] = ()
    asked: tuple[Track, ...] = ()
    notes: tuple[str, ...] = ()
    reason: str = ""
    number: int = 0
    lag: float = 0.0


def span_of(match: Match, order: MatchOrder) -> tuple[float, float]:
    """(start, end) s of what is asked for, within the match. InputError where it has nothing of it."""
    first, last = float(match.times[0]), float(match.times[-1])
    start = first if order.start is None else max(order.start, first)
    end = last if order.end is None else min(order.end, last)
    if end - start < SHORTEST:
        low, high = (told_time(value) if value is not None else "" for value in (order.start, order.end))
        expected = f"a second or more within {told_time(first)} to {told_time(last)} s"
        raise InputError("--from, --to", f"{low} to {high} s", expected)
    return start, end


def roles_of(match: Match, order: MatchOrder, span: tuple[float, float]) -> tuple[Role, ...]:
    """Everybody who is there in `span` s, or of the order's players; those whose tracks cannot be cleaned with the
    reason. InputError for an unknown player, and where nobody is there."""
    known = {player.id: player for player in match.players}
    for wanted in order.players:
        if wanted not in known:
            raise InputError("--players", f"{wanted!r}", f"some of {', '.join(known)}")
    liked = lags(match.positions[:, _sampled(match, span)])
    found = [_role(match, number, player, span, order.fps) for number, player in enumerate(match.players)
             if not order.players or player.id in order.players]  # fmt: skip
    roles = [replace(role, lag=float(liked[role.number])) for role in found if role is not None]
    if not roles:
        raise InputError("--from, --to", f"nobody is there {_from_to(span)}", "a time of play")
    return tuple(roles)


def absent_lines(order: MatchOrder, roles: Sequence[Role], span: tuple[float, float]) -> list[str]:
    """A line for each player whom the order names and who is not there in `span` s."""
    there = {role.player.id for role in roles}
    away = [player for player in order.players if player not in there]
    return [f"player {player} is not made: he is not there {_from_to(span)}" for player in away]


def _from_to(span: tuple[float, float]) -> str:
    return f"from {told_time(span[0])} to {told_time(span[1])} s"


def _sampled(match: Match, span: tuple[float, float]) -> np.ndarray:
    """Samples of the span, some NEAR_SAMPLES a second."""
    inside = np.flatnonzero((match.times >= span[0] - 1e-9) & (match.times <= span[1] + 1e-9))
    return inside[:: max(1, round(match.fps / NEAR_SAMPLES))]


def _role(match: Match, number: int, player: MatchPlayer, span: tuple[float, float], fps: float) -> Role | None:
    """The role of a player; None where he is not there for SHORTEST."""
    tracks, notes = [], []
    try:
        for begin, end in match.stretches(player.id):
            begin, end = _on_frames(max(begin, span[0]), min(end, span[1]), fps)
            if end - begin >= SHORTEST:
                step = 1.0 / match.fps  # to the feed's samples around them
                track, found = clean(match.track(player.id, begin - step, end + step))
                begin, end = max(begin, track.times[0]), min(end, track.times[-1])
                tracks.append(cut_track(track, *_on_frames(begin, end, fps)))
                notes += found.lines
    except InputError as error:
        return Role(player=player, reason=str(error), number=number)
    own = tuple(tracks)
    return Role(player=player, measured=own, asked=own, notes=tuple(notes), number=number) if own else None


def _on_frames(start: float, end: float, fps: float) -> tuple[float, float]:
    """The first frame of the match's clock not before `start` and the last not behind `end`, s."""
    return float(np.ceil(start * fps - 1e-6) + 0.0) / fps, float(np.floor(end * fps + 1e-6)) / fps


def pushed_apart(
    roles: Sequence[Role], times: np.ndarray, touches: Mapping[str, Sequence[float]]
) -> tuple[tuple[Role, ...], dict[str, float]]:
    """The roles with tracks that keep out of each other (`match.crowd.spacing`), and what that took: `longest_m`,
    `mean_m` where somebody is moved, `seconds` in which somebody is, all players' summed.

    times (N,) s: of the feed's samples; touches: by id, seconds at which somebody touches the ball, who then keeps his
    way."""
    places = np.stack([_on_times(role.measured, times) for role in roles])
    step = float(np.median(np.diff(times)))
    keep = [keeping(len(times), (np.asarray(touches.get(role.player.id, ())) - times[0]) / step, 1.0 / step)
            for role in roles]  # fmt: skip
    shifts = spaced(times, places, np.stack(keep))
    moved = np.linalg.norm(shifts, axis=2)
    some = moved > 1e-3
    figures = {"longest_m": float(moved.max()), "mean_m": float(moved[some].mean()) if some.any() else 0.0,
               "seconds": float(some.sum() * step)}  # fmt: skip
    return tuple(_shifted(role, times, shift) for role, shift in zip(roles, shifts)), figures


def _on_times(tracks: Sequence[Track], times: np.ndarray) -> np.ndarray:
    """(N, 2) m where a player is at `times` (N,) s, NaN where he is away."""
    out = np.full((len(times), 2), np.nan)
    for track in tracks:
        there = (times >= track.times[0] - 1e-9) & (times <= track.times[-1] + 1e-9)
        for axis in (0, 1):
            out[there, axis] = np.interp(times[there], track.times, track.positions[:, axis])
    return out


def _shifted(role: Role, times: np.ndarray, shift: np.ndarray) -> Role:
    """The role asked to be `shift` (N, 2) m beside what was measured; the very same where it is nothing."""
    if not shift.any():
        return role
    asked = (replace(track, positions=track.positions + interpolate(track.times, times, shift))
             for track in role.measured)  # fmt: skip
    return replace(role, asked=tuple(asked))
