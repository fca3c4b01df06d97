"""Find which players of a match are synthesized, when they are present, and where they have to be: their tracks,
cleaned, on one clock of frames, and separated where two would overlap.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import InputError, format_seconds
from ..base.time_series import interpolate_columns
from ..motion.track import Track, clean_track
from ..motion.track.match_data import Match, MatchPlayer
from .crowd.spacing import compute_firmness, compute_spacing
from .crowd.variety import choose_lags
from .pieces.units import cut_track
from .request import MatchRequest

MIN_SECONDS = 1.0
"""s: a player who is present for less is not synthesized."""

NEIGHBOUR_RATE = 2.0
"""Samples per second at which neighbours are found."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Role:
    """A player to synthesize.

    Attributes:
        player: who.
        measured: cleaned tracks, one per stretch the player is present, each from one frame of the match's clock (a
            whole number of 1 / fps seconds) to another.
        target_tracks: the same, moved away from other players.
        notes: messages about what was corrected.
        reason: why the player cannot be synthesized, else "".
        number: index in the match; part of the seed, so that players differ.
        lag: s, of the clips the player prefers (`Plan.lag`).
    """

    player: MatchPlayer
    measured: tuple[Track, ...] = ()
    target_tracks: tuple[Track, ...] = ()
    notes: tuple[str, ...] = ()
    reason: str = ""
    number: int = 0
    lag: float = 0.0


def resolve_span(match: Match, request: MatchRequest) -> tuple[float, float]:
    """Resolve the requested (start, end) s within the match; InputError if the match has no such time."""
    first, last = float(match.times[0]), float(match.times[-1])
    start = first if request.start is None else max(request.start, first)
    end = last if request.end is None else min(request.end, last)
    if end - start < MIN_SECONDS:
        low, high = (format_seconds(one if asked is None else asked)
                     for one, asked in ((first, request.start), (last, request.end)))
        expected = f"a second or more within {format_seconds(first)} to {format_seconds(last)} s"
        raise InputError("time range", f"{low} to {high} s", expected, "choose other times")
    return start, end


def build_roles(match: Match, request: MatchRequest, span: tuple[float, float]) -> tuple[Role, ...]:
    """Build the roles of all players present in a span, or of the requested players.

    Args:
        match: the match.
        request: the request.
        span: (start, end) s.
    Returns:
        The roles; one whose tracks cannot be cleaned has a reason.
    Raises:
        InputError: for an unknown player, or if no player is present.
    """
    known = {player.id: player for player in match.players}
    for player_id in request.players:
        if player_id not in known:
            raise InputError("players", f"{player_id!r}", f"some of {', '.join(known)}",
                             "correct the player's id")
    lags = choose_lags(match.positions[:, _select_samples(match, span)])
    found = [_build_role(match, number, player, span, request.fps) for number, player in enumerate(match.players)
             if not request.players or player.id in request.players]  # fmt: skip
    roles = [replace(role, lag=float(lags[role.number])) for role in found if role is not None]
    if not roles:
        found = f"no player is seen for {MIN_SECONDS:g} s on end {_describe_span(span)}"
        found += "".join([f" ({line})" for line in match.report if line.endswith("set to absent")][:1])
        raise InputError(request.tracking, found, "a time of play", "choose other times or a longer file")
    return tuple(roles)


def list_absent_players(request: MatchRequest, roles: Sequence[Role], span: tuple[float, float]) -> list[str]:
    """List a message for each requested player who is absent in `span` s."""
    present = {role.player.id for role in roles}
    absent = [player for player in request.players if player not in present]
    return [f"player {player} is left out: absent {_describe_span(span)}" for player in absent]


def _describe_span(span: tuple[float, float]) -> str:
    return f"from {format_seconds(span[0])} to {format_seconds(span[1])} s"


def _select_samples(match: Match, span: tuple[float, float]) -> np.ndarray:
    """Select samples of the span, about NEIGHBOUR_RATE per second."""
    inside = np.flatnonzero((match.times >= span[0] - 1e-9) & (match.times <= span[1] + 1e-9))
    return inside[:: max(1, round(match.fps / NEIGHBOUR_RATE))]


def _build_role(match: Match, number: int, player: MatchPlayer, span: tuple[float, float], fps: float) -> Role | None:
    """Build the role of a player; None if they are present for less than MIN_SECONDS."""
    tracks, notes = [], []
    try:
        for begin, end in match.list_stretches(player.id):
            begin, end = _limit_to_frames(max(begin, span[0]), min(end, span[1]), fps)
            if end - begin >= MIN_SECONDS:
                step = 1.0 / match.fps  # up to the feed's samples around them
                track, found = clean_track(match.track(player.id, begin - step, end + step))
                begin, end = max(begin, track.times[0]), min(end, track.times[-1])
                tracks.append(cut_track(track, *_limit_to_frames(begin, end, fps)))
                notes += found.lines
    except InputError as error:
        return Role(player=player, reason=str(error), number=number)
    cleaned = tuple(tracks)
    return Role(player=player, measured=cleaned, target_tracks=cleaned, notes=tuple(notes),
                number=number) if cleaned else None


def _limit_to_frames(start: float, end: float, fps: float) -> tuple[float, float]:
    """Limit a span to frames of the match's clock: the first not before `start`, the last not after `end`, s."""
    return float(np.ceil(start * fps - 1e-6) + 0.0) / fps, float(np.floor(end * fps + 1e-6)) / fps


def separate_roles(
    roles: Sequence[Role], times: np.ndarray, touches: Mapping[str, Sequence[float]],
    solve_all: Callable[[Sequence[tuple]], Iterable[np.ndarray]] | None = None,
) -> tuple[tuple[Role, ...], dict[str, float]]:
    """Separate the target tracks of the players (`match.crowd.spacing`).

    Args:
        roles: the players.
        times: (N,) s of the feed's samples.
        touches: s by id, at which a player touches the ball and keeps their path.
        solve_all: as for `match.crowd.spacing.compute_spacing`.
    Returns:
        The roles, and figures: `longest_m`, `mean_m` where a player is moved, `seconds` in which a player is moved,
            summed over all players.
    """
    places = np.stack([_sample_positions(role.measured, times) for role in roles])
    step = float(np.median(np.diff(times)))
    firmness = [compute_firmness(len(times), (np.asarray(touches.get(role.player.id, ())) - times[0]) / step,
                                 1.0 / step) for role in roles]  # fmt: skip
    shifts = compute_spacing(times, places, np.stack(firmness), solve_all=solve_all)
    moved = np.linalg.norm(shifts, axis=2)
    is_moved = moved > 1e-3
    figures = {"longest_m": float(moved.max()), "mean_m": float(moved[is_moved].mean()) if is_moved.any() else 0.0,
               "seconds": float(is_moved.sum() * step)}  # fmt: skip
    return tuple(_shift_role(role, times, shift) for role, shift in zip(roles, shifts)), figures


def _sample_positions(tracks: Sequence[Track], times: np.ndarray) -> np.ndarray:
    """Sample a player's positions (N, 2) m at `times` (N,) s, NaN where absent."""
    out = np.full((len(times), 2), np.nan)
    for track in tracks:
        present = (times >= track.times[0] - 1e-9) & (times <= track.times[-1] + 1e-9)
        for axis in (0, 1):
            out[present, axis] = np.interp(times[present], track.times, track.positions[:, axis])
    return out


def _shift_role(role: Role, times: np.ndarray, shift: np.ndarray) -> Role:
    """Shift a role's target by (N, 2) m from what was measured; unchanged where the shift is zero."""
    if not shift.any():
        return role
    tracks = (replace(track, positions=track.positions + interpolate_columns(track.times, times, shift))
              for track in role.measured)  # fmt: skip
    return replace(role, target_tracks=tuple(tracks))
