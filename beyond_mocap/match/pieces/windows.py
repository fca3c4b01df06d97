"""The result of the search for one window: which clip is used when, no motion yet. It is found, saved in a file
(`stored_piece`), and joined into one edit list.

Windows are joined where two neighbours use the same frame of the same clip, so that the joint is invisible; otherwise
at the transition with the lowest cost in the overlap.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError
from ...library.automatic_locomotion import apply_chosen_gaits
from ...library.features import FPS
from ...library.library import Library
from ...library.missing_actions import add_actions
from ...synthesis.one_thread import limit_to_one_thread
from ...synthesis.plan import Plan, ResolvedPlan
from ...synthesis.resolve_plan import resolve_plan
from ...synthesis.search.candidate_index import CandidateIndex
from ...synthesis.search.cost_weights import balance_weights
from ...synthesis.search.cut_costs import CutCosts
from ...synthesis.search.distance import align_keys
from ...synthesis.search.path_search import PathSearch
from ...synthesis.search.request import build_request, find_allowed_clips
from ...synthesis.search.slots import MIN_KEY_MARGIN
from ...synthesis.search_library import find_plan_actions
from ..player_edit import WINDOW_SECONDS, PlayerEdit, Stretch, to_stored_plan
from .named_edit import (
    CONTINUITY_TOLERANCE,
    NamedEdit,
    NamedKey,
    cut_named_edit,
    join_named_edits,
    list_clips,
    renumber_clips,
    to_library_edit,
    to_named_edit,
)
from .units import Unit, cut_plan

_MIN_SEAM_DISTANCE = 4
"""Frames between a joint and other transitions, so that it can be blended."""

_TRANSITION_COST, _KEY_COST = 10.0, 1000.0
"""Cost of a joint that close to another transition, and of one within the clip of a key moment."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Piece:
    """The result for a window.

    Attributes:
        player: as in the unit (`units.Unit`).
        stretch: as in the unit.
        number: as in the unit.
        first: as in the unit.
        own: as in the unit.
        edit: at the library's rate, from the unit's first frame.
        seconds: s of processor time.
        warnings: requested labels that the library lacks.
        hurried_from: frame of `edit` from which the search was shortened, or None.
    """

    player: str
    stretch: int
    number: int
    first: int
    own: tuple[int, int]
    edit: NamedEdit
    seconds: float = 0.0
    warnings: tuple[str, ...] = ()
    hurried_from: int | None = None


def search_window(library: Library, unit: Unit, cancelled: Callable[[], bool] | None = None,
                  hurry: Callable[[], bool] | None = None) -> Piece:  # fmt: skip
    """Search the edit list of one window of a player. The same library, unit and numpy give the same bits.

    Args:
        library: the clips. If the plan allows synthetic clips, all windows get them, so that neighbours choose from the
            same ones.
        unit: the window.
        cancelled: called now and then; True cancels the work.
        hurry: called now and then; True shortens the search.
    Returns:
        The result.
    Raises:
        InputError: as for `synthesize`.
        UserCancelledError: if `cancelled` returns True.
    """
    started = time.process_time()
    with limit_to_one_thread():
        plan = resolve_plan(unit.plan, library, are_touches_resolved=True)
        library = build_search_library(library, plan)
        order = build_request(library, plan)
        search = PathSearch(library, order, balance_weights(unit.plan.alpha), cancelled=cancelled, hurry=hurry,
                            on_grid=True)
        edit = align_keys(library, search.run(), order)
    return Piece(player=unit.player, stretch=unit.stretch, number=unit.number, first=unit.first, own=unit.own,
                 edit=to_named_edit(library, edit, plan.timeline.keys), seconds=time.process_time() - started,
                 warnings=order.warnings, hurried_from=search.hurried_from)  # fmt: skip


def build_search_library(library: Library, plan: ResolvedPlan, used: Iterable[str] = ()) -> Library:
    """Build the library in which a window of a plan is searched.

    Args:
        library: the recordings.
        plan: of the window.
        used: paths of clips that other windows show; synthetic actions among them are added.
    """
    gaits = dict(plan.requested.gaits)
    if not plan.requested.made:
        return apply_chosen_gaits(library, gaits)
    actions = find_plan_actions(library, plan)
    return apply_chosen_gaits(add_actions(library.with_synthetic_clips, [*actions, *used]), gaits)


@dataclass(frozen=True)
class Joint:
    """Where two windows are joined.

    Attributes:
        frame: of the stretch, at the library's rate.
        agreed: both windows use the same frame there.
    """

    frame: int
    agreed: bool


def join_pieces(
    library: Library, plans: Sequence[Plan], pieces: Sequence[Piece], window: float = WINDOW_SECONDS
) -> tuple[PlayerEdit, tuple[Joint, ...]]:
    """Join all windows of a player.

    Args:
        library: in which they were searched.
        plans: one per stretch, as given to `build_units`.
        pieces: of all windows, in any order.
        window: s of the windows in which the motion will be constructed.
    Returns:
        The player's edit list, and the joints.
    Raises:
        InputError: if a piece is missing.
    """
    stretches, joints = [], []
    for number, plan in enumerate(plans):
        plan = to_stored_plan(plan)
        stretch_pieces = sorted((piece for piece in pieces if piece.stretch == number), key=lambda piece: piece.number)
        numbers = [piece.number for piece in stretch_pieces]
        if not stretch_pieces or numbers != list(range(len(stretch_pieces))):
            found = f"windows {', '.join(map(str, numbers)) or 'none'} of {plan.track.name}"
            raise InputError("match", found, "all windows of a stretch", "search the others too")
        edit, stretch_joints = _join_stretch(library, plan, stretch_pieces)
        begin = float(plan.track.times[0])
        warnings = tuple(dict.fromkeys(line for piece in stretch_pieces for line in piece.warnings))
        short = tuple((begin + (piece.first + piece.hurried_from) / FPS, begin + piece.own[1] / FPS)
                      for piece in stretch_pieces if piece.hurried_from is not None)  # fmt: skip
        stretches.append(Stretch(plan, edit, warnings, short))
        joints += stretch_joints
    return PlayerEdit(plans[0].track.name, window, tuple(stretches)), tuple(joints)


def _join_stretch(library: Library, plan: Plan, pieces: list[Piece]) -> tuple[NamedEdit, list[Joint]]:
    """Join the windows of a stretch; return its edit list and the joints."""
    clips = list_clips([piece.edit for piece in pieces])
    pieces = [replace(piece, edit=renumber_clips(piece.edit, clips)) for piece in pieces]
    joints = [_find_joint(library, plan, *pair) for pair in zip(pieces, pieces[1:])]
    edges = [0, *(joint.frame for joint in joints), pieces[-1].first + len(pieces[-1].edit)]
    parts, keys = [], []
    for piece, low, high in zip(pieces, edges, edges[1:]):
        parts.append(cut_named_edit(piece.edit, low - piece.first, high - piece.first))
        keys += [key for key in piece.edit.keys if low <= _find_key_frame(plan, key) < high]
    return join_named_edits(parts, keys), joints


def _find_key_frame(plan: Plan, key: NamedKey) -> float:
    """Find the frame of the stretch at which a key moment is played."""
    moment = next(moment for moment in plan.timeline.keys if moment.time == key.time)
    return (moment.resolved_time - float(plan.track.times[0])) * FPS


def _find_joint(library: Library, plan: Plan, before: Piece, after: Piece) -> Joint:
    """Find the joint of two windows: closest to the edge between them where both agree, else where it costs least."""
    low, high, edge = after.first, before.first + len(before.edit), after.own[0]
    (clip, frame), (other, other_frame) = (
        tuple(values[low - piece.first : high - piece.first] for values in piece.edit.frames())
        for piece in (before, after)
    )
    same = (clip == other) & (np.abs(frame - other_frame) < CONTINUITY_TOLERANCE)
    # Both the frame and the one before must agree, so that the joint continues the clip.
    at = np.flatnonzero(same[1:] & same[:-1]) + 1
    if len(at):
        return Joint(low + int(at[np.argmin(np.abs(low + at - edge))]), True)
    return Joint(low + 1 + int(np.argmin(_compute_joint_costs(library, plan, before, after=after, low=low, high=high))),
                 False)


def _compute_joint_costs(library: Library, plan: Plan, before: Piece, after: Piece, low: int, high: int) -> np.ndarray:
    """Compute the costs (high - low - 1,) of joints at frames low + 1 .. high."""
    shown, begin = [path for piece in (before, after) for path, _ in piece.edit.clips], float(plan.track.times[0])
    here = resolve_plan(cut_plan(plan, begin + low / FPS, begin + (high - 1) / FPS), library, are_touches_resolved=True)
    library = build_search_library(library, here, shown)
    index = CandidateIndex.for_library(library, find_allowed_clips(library, plan))
    left_edit, entered_edit = (to_library_edit(library, cut_named_edit(p.edit, low - p.first, high - p.first))
                               for p in (before, after))
    step = np.gradient(left_edit.frame)
    step[np.append(left_edit.transitions, left_edit.transitions - 1)] = 1.0
    # The cut goes from the frame after each left one to the frame the other window has there.
    cuts = CutCosts(index, balance_weights(plan.alpha))
    terms = cuts.iter_cut_terms(left_edit.frame[:-1] + step[:-1], entered_edit.frame[1:])
    cost = np.diagonal(sum(values for _, values in terms)).copy()
    at = np.arange(1, high - low)
    for seam in (*left_edit.transitions, *entered_edit.transitions):
        cost += _TRANSITION_COST * ((np.abs(at - seam) < _MIN_SEAM_DISTANCE) & (at != seam))
    for key in (*before.edit.keys, *after.edit.keys):
        name = before.edit.clips[key.clip]
        rate = FPS / next(clip for clip in library.clips if (clip.path, clip.mirrored) == name).motion.fps
        entry, leave = (max(MIN_KEY_MARGIN, seconds * rate) for seconds in (key.frame - key.start, key.end - key.frame))
        middle = _find_key_frame(plan, key) - low
        cost += _KEY_COST * ((at > middle - entry) & (at < middle + leave))
    return cost
