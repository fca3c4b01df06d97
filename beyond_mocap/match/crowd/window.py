"""A window of time with all players in it: collisions are resolved, and players meet the ball where it is. The result
of a window is saved in a file (never pickled).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...annotation.ball_contact import build_surfaces
from ...base.errors import InputError
from ...files.json_values import check_list, check_numbers
from ...files.piece_file import check_array, load_piece_file, write_piece_file
from ...library.features import FPS
from ...motion.motion import Motion
from ...motion.track.ball_path import BallPath
from ...synthesis.one_thread import limit_to_one_thread
from ...synthesis.take import Take
from ..match_ball import apply_led_ball, find_led_ball, lead_ball_between_players, restore_ball_contact, sample_ball
from ..pieces.named_edit import cut_named_edit
from ..pieces.units import cut_plan
from ..player_edit import PlayerEdit, Stretch
from .capsules import compute_capsule_lines
from .collision_avoidance import measure_overlap_depths, resolve_collisions
from .correction import CURVES, Correction, apply_correction, compute_knot_step, join_corrections
from .spacing import compute_firmness

MAX_SECONDS = 60.0
"""s, the longest window: all players' motions in it are in memory at once."""

MARGIN_SECONDS = 4.0
"""s on either side of a window in which collisions are resolved too."""

BLEND_SECONDS = 2.0
"""s around an edge between two windows in which the corrections of one blend into the other's."""

_SETTLE_SECONDS = 8.0  # s more of an edit list, after which its motion does not depend on where it starts

_ARRAYS = ("frames", "depth", "led_frames", "led")


@dataclass(frozen=True, eq=False, kw_only=True)
class PlayerCorrection:
    """The result of a window for one player.

    Attributes:
        correction: of their motion.
        frames: (K,) frames of the match's clock at which they overlap another player after correction.
        depth: (K,) m of that overlap.
        before: m, the deepest overlap without correction.
        led_frames: (L,) frames at which they lead the ball.
        led: (L, 3) m by which the ball is moved there (`match_ball.find_led_ball`).
    """

    correction: Correction
    frames: np.ndarray
    depth: np.ndarray
    before: float
    led_frames: np.ndarray
    led: np.ndarray


def cut_edit(edit: PlayerEdit, start: float, end: float) -> PlayerEdit:
    """Cut a player's edit list around a window, so that it constructs the same motion from `start` to `end`.

    Args:
        edit: the player's edit list.
        start: s of the window.
        end: s of the window.
    Returns:
        The cut edit list, without stretches where the player is absent.
    """
    cuts = (_cut_stretch(stretch, start - _SETTLE_SECONDS, end + _SETTLE_SECONDS) for stretch in edit.stretches)
    return replace(edit, stretches=tuple(cut for cut in cuts if cut is not None))


def _cut_stretch(stretch: Stretch, start: float, end: float) -> Stretch | None:
    start_time = float(stretch.plan.track.times[0])
    first = max(0, int(np.floor((start - start_time) * FPS + 1e-6)))
    last = min(len(stretch.edit), int(np.ceil((end - start_time) * FPS - 1e-6)) + 1)
    if last - first < FPS:
        return None
    plan = cut_plan(stretch.plan, start_time + first / FPS, start_time + (last - 1) / FPS)
    return replace(stretch, plan=plan, edit=cut_named_edit(stretch.edit, first, last))


def resolve_window(takes: Sequence[Sequence[Take]], start: float, end: float) -> tuple[PlayerCorrection, ...]:
    """Resolve the collisions of a window. The same input gives the same bits.

    Args:
        takes: of each player, as constructed, in the window and MARGIN_SECONDS on either side.
        start: s of the window.
        end: s of the window.
    Returns:
        One result per player.
    """
    with limit_to_one_thread():
        flat = [take for player_takes in takes for take in player_takes]
        fps = flat[0].motion.fps if flat else 1.0
        firsts = [round(take.start_time * fps) for take in flat]
        motions_before, contacts = [take.motion for take in flat], [take.contacts for take in flat]
        lines = list(map(compute_capsule_lines, motions_before))
        corrections = resolve_collisions(motions_before, contacts, firsts, fps,
                                         firmness=[_compute_firmness(take) for take in flat], lines=lines)
        motions = [apply_correction(motion, *player_takes) for motion,
                   player_takes in zip(motions_before, zip(corrections, firsts))]
        balls = [None if take.ball is None else sample_ball(take.plan, take.ball.times) for take in flat]
        led = lead_ball_between_players(flat, motions, firsts, list(map(find_led_ball, flat, balls)), balls)
        motions = [_restore_ball_contact(*player_takes, led) for player_takes in zip(flat, motions, firsts, balls)]
        before = measure_overlap_depths(motions_before, firsts, lines)
        lines = [old if motion is known else compute_capsule_lines(motion)
                 for motion, known, old in zip(motions, motions_before, lines)]
        after = measure_overlap_depths(motions, firsts, lines)
    inside = round(start * fps), round(end * fps)
    rows = iter(zip(corrections, firsts, before, after, led))
    return tuple(_build_part([next(rows) for _ in player_takes], inside, fps) for player_takes in takes)


def join_windows(parts: Sequence[tuple[PlayerCorrection, tuple[float, float]]], fps: float) -> PlayerCorrection:
    """Join one player's windows.

    Args:
        parts: results, each with its window's start and end in s.
        fps: frames per second.
    Returns:
        One result.
    """
    if not parts:
        return _build_part([], (0, 0), fps)
    cores = [(one.correction, round(start * fps), round(end * fps)) for one, (start, end) in parts]
    arrays = {name: np.concatenate([getattr(one, name) for one, _ in parts]) for name in _ARRAYS}
    return PlayerCorrection(correction=join_corrections(cores, round(BLEND_SECONDS * fps)),
                            before=max(one.before for one, _ in parts), **arrays)


def save_parts(path: Path, parts: Sequence[PlayerCorrection]) -> None:
    """Save a window's results.

    Args:
        path: the file.
        parts: in the order of the players.
    Raises:
        InputError: if the file cannot be written.
    """
    arrays = {}
    for number, part in enumerate(parts):
        arrays |= {f"{number}.{name}": getattr(part, name) for name in _ARRAYS}
        arrays |= {f"{number}.knots": part.correction.knots, f"{number}.values": part.correction.values}
    header = [[part.correction.fps, part.correction.step, part.before] for part in parts]
    write_piece_file(path, header, arrays)


def load_parts(path: Path, start: float, end: float, fps: float) -> tuple[PlayerCorrection, ...] | None:
    """Load the results that `save_parts` wrote.

    Args:
        path: the file.
        start: s of the window.
        end: s of the window.
        fps: frames per second.
    Returns:
        One result per player; None if there is no complete file of that form, or it is of another window.
    """

    def parse(header, arrays: dict[str, np.ndarray]) -> tuple[PlayerCorrection, ...]:
        rows = [check_numbers(row, "header", 3, "[fps, step, m]") for row in check_list(header, "header")]
        return tuple(_parse_part(row, {name: f"{number}.{name}" for name in (*_ARRAYS, "knots", "values")},
                                 arrays, inside=(round(start * fps), round(end * fps)), fps=fps)
                     for number, row in enumerate(rows))

    return load_piece_file(path, parse)


def _parse_part(row: tuple, names: dict[str, str], arrays: dict[str, np.ndarray], *, inside: tuple[int, int],
                fps: float) -> PlayerCorrection:
    """Parse one player's result; InputError if it is in another form, or of another window.

    row: (fps, step, before); names: of the player's arrays; inside: frames of the window.
    """
    if row[:2] != (fps, compute_knot_step(fps)) or row[2] < 0.0:
        raise InputError("header", f"{row}", f"{fps:g} frames per second, and a depth")
    frames, led_frames, knots = (check_array(arrays, names[name], np.int64, (None,))
                                 for name in ("frames", "led_frames", "knots"))
    depth = check_array(arrays, names["depth"], np.float64, frames.shape)
    led = check_array(arrays, names["led"], np.float64, (len(led_frames), 3))
    values = check_array(arrays, names["values"], np.int16, (len(knots), CURVES))
    margin = round(2.0 * MARGIN_SECONDS * fps)
    for at, beyond in ((frames, 0), (led_frames, 0), (knots, margin)):
        if np.any(at < inside[0] - beyond) or np.any(at >= inside[1] + beyond):
            raise InputError("frames", "frames of another window", f"{inside[0]} to {inside[1]}")
    if np.any(depth < 0.0):
        raise InputError("depth", "a depth below 0", "m")
    return PlayerCorrection(correction=Correction(knots, values, fps, int(row[1])), before=row[2], frames=frames,
                            depth=depth, led_frames=led_frames, led=led)


def _compute_firmness(take: Take) -> np.ndarray:
    """Compute (T,) how firmly a player keeps their path: more where they touch the ball."""
    touch_frames = [key.frame for key in take.keys if build_surfaces(take.motion.skeleton, key.contact_labels)]
    return compute_firmness(len(take.motion), np.array(touch_frames), take.motion.fps)


def _restore_ball_contact(take: Take, motion: Motion, first: int, ball: BallPath | None,
                          led: Sequence[tuple[np.ndarray, np.ndarray]]) -> Motion:
    """Restore the ball contacts of a player's corrected motion, with their `ball`, which all players have `led`."""
    if ball is None:
        return motion
    ball = apply_led_ball(ball, first, led)
    return restore_ball_contact(replace(take, motion=motion), ball.positions).motion


def _build_part(rows, inside: tuple[int, int], fps: float) -> PlayerCorrection:
    """Build one player's result from their takes with what was measured of each.

    rows: (correction, first frame, depths before (T,) m, depths after (T,) m, (led frames, led offsets)) per take.
    """
    frames, depth, before = [np.zeros(0, int)], [np.zeros(0)], 0.0
    led_frames, led = [np.zeros(0, int)], [np.zeros((0, 3))]
    for _, first, deep, deep_after, (at, off) in rows:
        own = np.flatnonzero(deep_after > 0.0) + first
        mine = (own >= inside[0]) & (own < inside[1])
        frames.append(own[mine])
        depth.append(deep_after[own[mine] - first])
        mine = (at >= inside[0]) & (at < inside[1])
        led_frames.append(at[mine])
        led.append(off[mine])
        core = slice(max(inside[0] - first, 0), max(inside[1] - first, 0))
        before = max(before, float(deep[core].max(initial=0.0)))
    arrays = {name: np.concatenate(values) for name, values in zip(_ARRAYS, (frames, depth, led_frames, led))}
    correction = _concatenate_corrections([correction for correction, *_ in rows], fps)
    return PlayerCorrection(correction=correction, before=before, **arrays)


def _concatenate_corrections(corrections: Sequence[Correction], fps: float) -> Correction:
    """Concatenate corrections of one player at different times."""
    if not corrections:
        return Correction.build_empty(fps)
    knots = np.concatenate([one.knots for one in corrections])
    values = np.concatenate([one.values for one in corrections]).reshape(-1, CURVES)
    return Correction(knots, values, corrections[0].fps, corrections[0].step)
