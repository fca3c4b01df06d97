"""Explanation of a search: what each piece of an edit list cost, by term, and which other clips were near.

    for reason in explain_choices(library, resolve_plan(take.plan, library), take.edit): print(reason.costs)

The costs are the search's own functions, evaluated again for what it chose: where every transition lies on one of its
slots' edges (always, unless the edit list was edited) the terms of all pieces add up to what it paid. For Faustino's
block searches the two parts of eq. 13 are given, over the blocks of eight frames as they are shown.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...library.library import Library
from ..plan import ResolvedPlan
from ..search_library import extend_library
from .beam_states import MEMORY_SLOTS, BeamStates
from .beam_transitions import SAME_FRAME, SlotCandidates
from .block_costs import AnnotationCost, collect_windows, compute_distances, measure_typical_distance, rescale_alpha
from .candidate_index import PLAYBACK_RATES, SLOT
from .cost_weights import Term, Weights, balance_weights
from .cut_costs import YOUNG_SLOTS
from .edit_list import EditList
from .path_search import PathSearch
from .request import SearchRequest, build_request
from .slots import KeyPieces, build_slot_edges

NEAREST = 3  # other clips that are listed for each piece
_SHIFTED = 2.0  # library frames: a key moment's piece is moved by less than this to be on time


@dataclass(frozen=True)
class OtherClip:
    """Another clip that might have been shown.

    Attributes:
        path: of the clip, below the library.
        mirrored: whether it is its mirror image.
        extra_cost: what its best slot there would have cost more than the chosen one, in all; a negative one was
            cheaper there, and more expensive later.
    """

    path: str
    mirrored: bool
    extra_cost: float


@dataclass(frozen=True, kw_only=True)
class ChoiceReason:
    """Why one uncut piece was chosen. Costs are in the search's unit, about 1 per metre per second of missed speed over
    a slot.

    Attributes:
        first: first frame at the library's rate.
        end: frame after the last one.
        clip: index in the library.
        path: of the clip, below the library.
        mirrored: whether it is its mirror image.
        clip_range: first and last frame in the clip's own rate.
        rate: playback rate.
        costs: term -> cost over the piece.
        cut_costs: term -> cost of the cut that begins it.
        others: the nearest other clips for its first slot, the cheapest first.
    """

    first: int
    end: int
    clip: int
    path: str
    mirrored: bool
    clip_range: tuple[float, float]
    rate: float
    costs: dict[str, float]
    cut_costs: dict[str, float]
    others: tuple[OtherClip, ...] = ()

    @property
    def cost(self) -> float:
        """Sum of all terms."""
        return sum(self.costs.values()) + sum(self.cut_costs.values())


def explain_choices(library: Library, plan: ResolvedPlan, edit: EditList) -> list[ChoiceReason]:
    """Explain each piece of an edit list by the costs of the search that chose it.

    Args:
        library: the recordings.
        plan: the resolved plan of the search.
        edit: what it chose, at the library's rate.
    """
    library = extend_library(library, plan, edit=edit)
    request = build_request(library, plan)
    if plan.method == "path":
        return explain_path_choices(library, request, edit, balance_weights(plan.requested.alpha))
    if plan.method == "baseline":
        return explain_gait_loops(library, request, edit)
    return explain_block_choices(library, request, edit, rescale_alpha(plan.requested.alpha))


def explain_path_choices(library: Library, request: SearchRequest, edit: EditList, weights: Weights,
                         others: int = NEAREST) -> list[ChoiceReason]:
    """Explain why the path search chose each piece of an edit list.

    Args:
        library: the clips.
        request: the request.
        edit: the edit list.
        weights: the search's.
        others: how many other clips are listed.
    """
    search = PathSearch(library, request, weights)
    slots_chosen = _read_slot_choices(search, edit)
    slots = [_compute_slot_costs(search, slots_chosen, slot) for slot in range(len(slots_chosen.start))]
    found = []
    for first, end in edit.pieces:
        piece_slots = [slot for slot in range(len(slots_chosen.start)) if first <= slots_chosen.edges[slot] < end]
        # the cut into the first slot of a piece is its transition; the others are changes of playback rate within
        # the piece
        unary, transitions = zip(*(slots[slot] for slot in piece_slots))
        cut, *within = transitions
        costs = _sum_costs([*unary, *within])
        near = (
            tuple(_iter_other_clips(search, slots_chosen, piece_slots[0], sum(unary[0].values()) + sum(cut.values()),
                                    others)) if others else ()
        )
        found.append(_build_reason(library, edit, first, end=end, costs=costs, cut_costs=_sum_costs([cut]),
                                   others=near))
    return found


def explain_block_choices(library: Library, request: SearchRequest, edit: EditList, alpha: float) -> list[ChoiceReason]:
    """Explain the choices of `blocks` and `distance`.

    Terms: labels (alpha times eq. 18) over what is shown, and the change of pose (1 - alpha times eq. 17) at the cut.
    """
    annotation, frames = AnnotationCost(library.frames), library.frames
    size = SLOT // 2
    weight = (1.0 - alpha) / (measure_typical_distance(frames) * np.sqrt(size))
    place = np.clip(np.rint(edit.frame).astype(int), 0, len(frames) - 1)
    found = []
    for first, end in edit.pieces:
        blocks = [
            annotation.compute_block_costs(place[at : at + 1], request.requested_labels[at : min(at + SLOT, end)])[0]
            for at in range(first, end, SLOT)
        ]
        cut_costs = {}
        if first:
            after = collect_windows(frames, edit.clip[first - 1 : first], place[first - 1 : first] + 1, size)
            cut_costs["pose"] = float(
                weight * compute_distances(after, collect_windows(frames, edit.clip[[first]], place[[first]], size))[0,
                                                                                                                     0]
            )
        found.append(_build_reason(library, edit, first, end=end, costs={"words": alpha * float(np.sum(blocks))},
                                   cut_costs=cut_costs))
    return found


def explain_gait_loops(library: Library, request: SearchRequest, edit: EditList) -> list[ChoiceReason]:
    """Explain the choices of `baseline`: the speed, m/s, by which each piece differs from the track."""
    speed = library.frames.speed[np.clip(np.rint(edit.frame).astype(int), 0, len(library.frames) - 1)]
    missed = [abs(float(np.mean(speed[low:high]) - np.mean(request.track.speed[low:high])))
              for low, high in edit.pieces]
    return [_build_reason(library, edit, low, end=high, costs={"speed": off}, cut_costs={})
            for (low, high), off in zip(edit.pieces, missed)]


@dataclass(frozen=True, eq=False, kw_only=True)
class _SlotChoices:
    """The search's choices, slot by slot.

    Attributes:
        edges: (S + 1,) output frames.
        clip, start, rate, piece: (S,), as in `path_search.BeamStates`.
    """

    edges: np.ndarray
    clip: np.ndarray
    start: np.ndarray
    rate: np.ndarray
    piece: np.ndarray


def _read_slot_choices(search: PathSearch, edit: EditList) -> _SlotChoices:
    """Read the states of the slots, cut at transitions too, off an edit list."""
    edges = np.union1d(build_slot_edges(search.library, search.request), edit.transitions)
    frame, piece_at = edit.frame.copy(), np.full(len(edit), -1)
    for placed in edit.keys:
        _restore_piece(search, edit, placed, frame, piece_at)
    low = edges[:-1]
    # playback rate of a slot: step of its first two frames, 1 where it has only one
    later = np.minimum(low + 1, edges[1:] - 1)
    one = frame[later] - frame[low]
    alone = later == low
    rate = np.where(alone, 1.0, one)
    return _SlotChoices(edges=edges, clip=edit.clip[low], start=frame[low], rate=rate, piece=piece_at[low])


def _restore_piece(search: PathSearch, edit: EditList, placed, frame: np.ndarray, piece_at: np.ndarray) -> None:
    """Restore where the search had a key moment's piece, before it was shifted by a part of a frame to be on time, and
    its swing was played at another rate.

    Written into frame (T,), the library frames, and into piece_at (T,), the number of the search's piece.
    """
    pieces, request = search.pieces, search.request
    at = int(np.clip(round(request.keys[placed.number].frame), 0, len(edit) - 1))
    rows = [row for row in np.flatnonzero(pieces.number == placed.number) if pieces.key(request, row) == placed.key]
    fits = [(row, _measure_shift(search, edit, pieces, row)) for row in rows]
    fits = [(row, off) for row, off in fits if off is not None]
    if not fits:
        return
    row, off = min(fits, key=lambda fit: abs(fit[1]))
    low, high = next(span for span in edit.pieces if span[0] <= at < span[1])
    frame[low:high] -= off
    bound = slice(search.edges[pieces.first[row]], search.edges[pieces.end[row]])
    frame[bound] = pieces.start[row] + pieces.rate[row] * np.arange(bound.stop - bound.start)
    piece_at[bound] = row


def _measure_shift(search: PathSearch, edit: EditList, pieces: KeyPieces, row: int) -> float | None:
    """Measure by how many library frames a key moment lies behind a piece of the search; None where that is not
    shown.
    """
    first, last = search.edges[pieces.first[row]], search.edges[pieces.end[row]] - 1
    ideal = pieces.start[row] + pieces.rate[row] * (last - first)
    off = edit.frame[first] - pieces.start[row], edit.frame[last] - ideal
    same = edit.clip[first] == edit.clip[last] == pieces.clip[row]
    return float(np.mean(off)) if same and max(map(abs, off)) < _SHIFTED and abs(off[1] - off[0]) < 0.1 else None


def _compute_slot_costs(search: PathSearch, choices: _SlotChoices,
                        slot: int) -> tuple[dict[str, float], dict[str, float]]:
    """Compute the costs of a slot, and of the transition into it."""
    return _compute_unary_costs(search, choices, slot), _compute_entry_costs(search, choices, slot) if slot else {}


def _compute_unary_costs(search: PathSearch, choices: _SlotChoices, slot: int) -> dict[str, float]:
    """Compute the costs of what a slot shows, by term."""
    low, high = choices.edges[slot : slot + 2]
    clip, start, rate, piece = (values[slot : slot + 1] for values in (choices.clip, choices.start, choices.rate,
                                                                       choices.piece))
    if piece[0] < 0:
        number = np.abs(PLAYBACK_RATES - rate[:, None]).argmin(axis=1)
        return _terms_to_costs(search.costs.iter_misfit_terms(low, high, number, search.index.round_frame(start)))
    costs = _terms_to_costs(search.costs.iter_key_terms(low, high, clip, start, rate))
    # how well a clip fits the ball is paid once, where its piece begins
    begins = slot == 0 or choices.piece[slot - 1] != piece[0]
    return {**costs, "strike": float(search.choice_cost[piece[0]])} if begins else costs


def _compute_entry_costs(search: PathSearch, choices: _SlotChoices, slot: int) -> dict[str, float]:
    """Compute the costs of the transition from the slot before.

    Nothing within a key moment's piece, a change of playback rate where the clip continues, else a cut.
    """
    if choices.piece[slot] >= 0 and choices.piece[slot] == choices.piece[slot - 1]:
        return {}
    before, ends = _find_state_before(search, choices, slot)
    here = choices.clip[slot : slot + 1], choices.start[slot : slot + 1], choices.rate[slot : slot + 1]
    change = search.weights.rate_change * abs(float(choices.rate[slot] - choices.rate[slot - 1]))
    to = SlotCandidates(*here, np.zeros(1), np.array([-1]))
    # what remains of the search's own cost after the named terms is the replay
    whole = float(search.build_transitions(before, np.zeros(1, int), ends).compute_all(to)[0, 0])
    if whole <= change + 1e-5:
        return {"rate_change": change}
    costs = {**_terms_to_costs(search.costs.cuts.iter_cut_terms(ends, here[1])),
             "soon": float(search.costs.cuts.compute_young_cut_cost(before.age)[0])}
    return {**costs, "replay": max(0.0, whole - change - sum(costs.values())), "rate_change": change}


def _find_state_before(search: PathSearch, choices: _SlotChoices, slot: int) -> tuple[BeamStates, np.ndarray]:
    """Build the state of the slot before, with no cost so far, and the library frame (1,) at its end."""
    starts = choices.start[max(slot - MEMORY_SLOTS, 0) : slot]
    recent = np.full(MEMORY_SLOTS, -1)
    recent[MEMORY_SLOTS - len(starts) :] = search.index.bucket[search.index.round_frame(starts)]
    one, nothing = slice(slot - 1, slot), np.zeros(1, int)
    state = BeamStates(choices.clip[one], choices.start[one], choices.rate[one], cost=np.zeros(1), back=nothing,
                       piece=choices.piece[one], recent=recent[None], age=np.array([_measure_age(choices, slot - 1)]))
    return state, state.start + state.rate * (choices.edges[slot] - choices.edges[slot - 1])


def _measure_age(choices: _SlotChoices, slot: int) -> int:
    """Measure how many slots before the end of a slot the last cut is, up to YOUNG_SLOTS."""
    for number in range(slot, 0, -1):
        end = choices.start[number - 1] + choices.rate[number - 1] * (choices.edges[number] - choices.edges[number - 1])
        if choices.clip[number] != choices.clip[number - 1] or abs(choices.start[number] - end) >= SAME_FRAME:
            return min(slot - number + 1, YOUNG_SLOTS)
    return YOUNG_SLOTS


def _iter_other_clips(search: PathSearch, choices: _SlotChoices, slot: int, paid: float,
                      count: int) -> Iterator[OtherClip]:
    """Generate the cheapest other clips among the search's candidates for a slot, each by its best frame.

    Where a key moment's piece begins, these are the clips that serve it too.
    """
    edge = int(np.searchsorted(search.edges, choices.edges[slot]))
    if search.edges[min(edge, len(search.edges) - 1)] != choices.edges[slot]:
        return
    to = search.collect_candidates(edge)
    cost = to.cost
    if slot:
        before, ends = _find_state_before(search, choices, slot)
        cost = search.build_transitions(before, np.zeros(1, int), ends).compute_all(to)[0]
    # serves[-1] is -1: free candidates compare only with free ones
    serves = np.append(search.pieces.number, -1)
    cost = np.where(serves[to.piece] == serves[choices.piece[slot]], cost, np.inf)
    names = [(clip.path, clip.mirrored) for clip in search.library.clips]
    known = {names[choices.clip[slot]]}
    for number in np.argsort(cost, kind="stable"):
        name = names[to.clip[number]]
        if not np.isfinite(cost[number]) or len(known) > count:
            return
        if name not in known:
            known.add(name)
            yield OtherClip(name[0], name[1], float(cost[number]) - paid)


def _build_reason(library: Library, edit: EditList, first: int, end: int, costs, cut_costs, others=()) -> ChoiceReason:
    """Build the reason of one piece."""
    clip = library.clips[int(edit.clip[first])]
    own = clip.motion.fps / library.fps
    clip_range = (edit.frame[[first, end - 1]] - library.frames.first[edit.clip[first]]) * own
    rate = (edit.frame[end - 1] - edit.frame[first]) / (end - 1 - first) if end - first > 1 else 1.0
    return ChoiceReason(
        first=first, end=end, clip=int(edit.clip[first]), path=clip.path, mirrored=clip.mirrored,
        clip_range=(float(clip_range[0]), float(clip_range[1])), rate=float(rate), costs=costs, cut_costs=cut_costs,
        others=others,
    )  # fmt: skip


def _terms_to_costs(terms: Iterator[Term]) -> dict[str, float]:
    """Convert terms to costs by name."""
    return {name: float(np.ravel(values)[0]) for name, values in terms}


def _sum_costs(parts: list[dict[str, float]]) -> dict[str, float]:
    """Add costs of the same name, the highest first; those near zero are left out."""
    total: dict[str, float] = {}
    for costs in parts:
        for name, value in costs.items():
            total[name] = total.get(name, 0.0) + value
    return {name: value for name, value in sorted(total.items(), key=lambda item: -abs(item[1])) if abs(value) > 1e-6}
