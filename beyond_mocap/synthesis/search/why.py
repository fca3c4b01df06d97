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
from ..search_library import search_library
from .block_costs import AnnotationCost, distances, typical_distance, windows
from .cheapest_way import Offered
from .edit_list import EditList
from .offer import RATES, SLOT
from .path_costs import Term, Weights, balanced
from .path_search import MEMORY_SLOTS, PathSearch, States
from .slots import Pieces, slot_edges
from .wanted import Wanted, build_order

NEAREST = 3  # other clips that are listed for each piece
_SHIFTED = 2.0  # library frames: a key moment's piece is moved by less than this to be on time


@dataclass(frozen=True)
class Other:
    """Another clip that might have been shown.

    Attributes:
        path: of the clip, below the library.
        mirrored: whether it is its mirror image.
        extra_cost: what its best slot there would have cost more than the chosen one, in all; a negative one was
            cheaper there, and more expensive later.
    """

    path: str
    mirrored: bool
    more: float


@dataclass(frozen=True, kw_only=True)
class Reason:
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
    shown: tuple[float, float]
    rate: float
    costs: dict[str, float]
    seam: dict[str, float]
    others: tuple[Other, ...] = ()

    @property
    def cost(self) -> float:
        """Sum of all terms."""
        return sum(self.costs.values()) + sum(self.seam.values())


def explain_choices(library: Library, plan: ResolvedPlan, edit: EditList) -> list[Reason]:
    """Explain each piece of an edit list by the costs of the search that chose it.

    Args:
        library: the recordings.
        plan: the resolved plan of the search.
        edit: what it chose, at the library's rate.
    """
    library = search_library(library, plan, edit=edit)
    order = build_order(library, plan)
    if plan.method == "path":
        return reasons(library, order, edit, balanced(plan.asked.alpha))
    return block_reasons(library, order, edit, plan.asked.alpha)


def reasons(library: Library, wanted: Wanted, edit: EditList, weights: Weights, others: int = NEAREST) -> list[Reason]:
    """Explain why the path search chose each piece of an edit list.

    Args:
        library: the clips.
        request: the request.
        edit: the edit list.
        weights: the search's.
        others: how many other clips are listed.
    """
    search = PathSearch(library, wanted, weights)
    way = _way_of(search, edit)
    slots = [_slot_costs(search, way, slot) for slot in range(len(way.start))]
    found = []
    for first, end in edit.pieces:
        mine = [slot for slot in range(len(way.start)) if first <= way.edges[slot] < end]
        # the cut into the first slot of a piece is its transition; the others are changes of playback rate within
        # the piece
        unary, ways = zip(*(slots[slot] for slot in mine))
        seam, *within = ways
        costs = _summed([*unary, *within])
        near = (
            tuple(_others(search, way, mine[0], sum(unary[0].values()) + sum(seam.values()), others)) if others else ()
        )
        found.append(_reason(library, edit, first, end=end, costs=costs, seam=_summed([seam]), others=near))
    return found


def block_reasons(library: Library, wanted: Wanted, edit: EditList, alpha: float) -> list[Reason]:
    """Explain the choices of `blocks` and `distance`.

    Terms: labels (alpha times eq. 18) over what is shown, and the change of pose (1 - alpha times eq. 17) at the cut.
    """
    annotation, frames = AnnotationCost(library.frames), library.frames
    size = SLOT // 2
    weight = (1.0 - alpha) / (typical_distance(frames) * np.sqrt(size))
    place = np.clip(np.rint(edit.frame).astype(int), 0, len(frames) - 1)
    found = []
    for first, end in edit.pieces:
        blocks = [
            annotation.of_blocks(place[at : at + 1], wanted.asked[at : min(at + SLOT, end)])[0]
            for at in range(first, end, SLOT)
        ]
        seam = {}
        if first:
            after = windows(frames, edit.clip[first - 1 : first], place[first - 1 : first] + 1, size)
            seam["pose"] = float(
                weight * distances(after, windows(frames, edit.clip[[first]], place[[first]], size))[0, 0]
            )
        found.append(_reason(library, edit, first, end=end, costs={"words": alpha * float(np.sum(blocks))}, seam=seam))
    return found


@dataclass(frozen=True, eq=False, kw_only=True)
class _Way:
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


def _way_of(search: PathSearch, edit: EditList) -> _Way:
    """Read the states of the slots, cut at transitions too, off an edit list."""
    edges = np.union1d(slot_edges(search.library, search.wanted), edit.seams)
    frame, piece_at = edit.frame.copy(), np.full(len(edit), -1)
    for placed in edit.keys:
        _put_back(search, edit, placed, frame, piece_at)
    low = edges[:-1]
    # playback rate of a slot: step of its first two frames, 1 where it has only one
    later = np.minimum(low + 1, edges[1:] - 1)
    one = frame[later] - frame[low]
    alone = later == low
    rate = np.where(alone, 1.0, one)
    return _Way(edges=edges, clip=edit.clip[low], start=frame[low], rate=rate, piece=piece_at[low])


def _put_back(search: PathSearch, edit: EditList, placed, frame: np.ndarray, piece_at: np.ndarray) -> None:
    """Restore where the search had a key moment's piece, before it was shifted by a part of a frame to be on time.

    Written into frame (T,), the library frames, and into piece_at (T,), the number of the search's piece.
    """
    pieces, wanted = search.pieces, search.wanted
    at = int(np.clip(round(wanted.keys[placed.wanted].frame), 0, len(edit) - 1))
    rows = [row for row in np.flatnonzero(pieces.wanted == placed.wanted) if pieces.key(wanted, row) == placed.key]
    fits = [(row, _off(search, edit, pieces, row)) for row in rows]
    fits = [(row, off) for row, off in fits if off is not None]
    if not fits:
        return
    row, off = min(fits, key=lambda fit: abs(fit[1]))
    low, high = next(span for span in edit.pieces if span[0] <= at < span[1])
    frame[low:high] -= off
    bound = slice(search.edges[pieces.first[row]], search.edges[pieces.end[row]])
    piece_at[bound] = row


def _off(search: PathSearch, edit: EditList, pieces: Pieces, row: int) -> float | None:
    """Measure by how many library frames a key moment lies behind a piece of the search; None where that is not
    shown.
    """
    first, last = search.edges[pieces.first[row]], search.edges[pieces.end[row]] - 1
    ideal = pieces.start[row] + pieces.rate[row] * (last - first)
    off = edit.frame[first] - pieces.start[row], edit.frame[last] - ideal
    same = edit.clip[first] == edit.clip[last] == pieces.clip[row]
    return float(np.mean(off)) if same and max(map(abs, off)) < _SHIFTED and abs(off[1] - off[0]) < 0.1 else None


def _slot_costs(search: PathSearch, way: _Way, slot: int) -> tuple[dict[str, float], dict[str, float]]:
    """Compute the costs of a slot, and of the transition into it."""
    return _unary(search, way, slot), _entry(search, way, slot) if slot else {}


def _unary(search: PathSearch, way: _Way, slot: int) -> dict[str, float]:
    """Compute the costs of what a slot shows, by term."""
    low, high = way.edges[slot : slot + 2]
    clip, start, rate, piece = (values[slot : slot + 1] for values in (way.clip, way.start, way.rate, way.piece))
    if piece[0] < 0:
        number = np.abs(RATES - rate[:, None]).argmin(axis=1)
        return _named(search.costs.misfit_terms(low, high, number, search.costs.inside(start)))
    costs = _named(search.costs.key_terms(low, high, clip, start, rate))
    # how well a clip fits the ball is paid once, where its piece begins
    begins = slot == 0 or way.piece[slot - 1] != piece[0]
    return {**costs, "strike": float(search.choice_cost[piece[0]])} if begins else costs


def _entry(search: PathSearch, way: _Way, slot: int) -> dict[str, float]:
    """Compute the costs of the transition from the slot before.

    Nothing within a key moment's piece, a change of playback rate where the clip continues, else a cut.
    """
    if way.piece[slot] >= 0 and way.piece[slot] == way.piece[slot - 1]:
        return {}
    before, ends = _state_before(search, way, slot)
    here = way.clip[slot : slot + 1], way.start[slot : slot + 1], way.rate[slot : slot + 1]
    change = search.weights.rate_change * abs(float(way.rate[slot] - way.rate[slot - 1]))
    to = Offered(*here, np.zeros(1), np.array([-1]))
    # what remains of the search's own cost after the named terms is the replay
    whole = float(search.ways(before, np.zeros(1, int), ends).every(to)[0, 0])
    if whole <= change + 1e-5:
        return {"rate_change": change}
    costs = _named(search.costs.cut_terms(ends, here[1]))
    return {**costs, "replay": max(0.0, whole - change - sum(costs.values())), "rate_change": change}


def _state_before(search: PathSearch, way: _Way, slot: int) -> tuple[States, np.ndarray]:
    """Build the state of the slot before, with no cost so far, and the library frame (1,) at its end."""
    starts = way.start[max(slot - MEMORY_SLOTS, 0) : slot]
    recent = np.full(MEMORY_SLOTS, -1)
    recent[MEMORY_SLOTS - len(starts) :] = search.offer.bucket[search.costs.inside(starts)]
    one, nothing = slice(slot - 1, slot), np.zeros(1, int)
    state = States(way.clip[one], way.start[one], way.rate[one], cost=np.zeros(1), back=nothing, piece=way.piece[one],
                   recent=recent[None])
    return state, state.start + state.rate * (way.edges[slot] - way.edges[slot - 1])


def _others(search: PathSearch, way: _Way, slot: int, paid: float, count: int) -> Iterator[Other]:
    """Generate the cheapest other clips among the search's candidates for a slot, each by its best frame.

    Where a key moment's piece begins, these are the clips that serve it too.
    """
    edge = int(np.searchsorted(search.edges, way.edges[slot]))
    if search.edges[min(edge, len(search.edges) - 1)] != way.edges[slot]:
        return
    to = search.offered(edge)
    cost = to.cost
    if slot:
        before, ends = _state_before(search, way, slot)
        cost = search.ways(before, np.zeros(1, int), ends).every(to)[0]
    # serves[-1] is -1: free candidates compare only with free ones
    serves = np.append(search.pieces.wanted, -1)
    cost = np.where(serves[to.piece] == serves[way.piece[slot]], cost, np.inf)
    names = [(clip.path, clip.mirrored) for clip in search.library.clips]
    known = {names[way.clip[slot]]}
    for number in np.argsort(cost, kind="stable"):
        name = names[to.clip[number]]
        if not np.isfinite(cost[number]) or len(known) > count:
            return
        if name not in known:
            known.add(name)
            yield Other(name[0], name[1], float(cost[number]) - paid)


def _reason(library: Library, edit: EditList, first: int, end: int, costs, seam, others=()) -> Reason:
    """Build the reason of one piece."""
    clip = library.clips[int(edit.clip[first])]
    own = clip.motion.fps / library.fps
    shown = (edit.frame[[first, end - 1]] - library.frames.first[edit.clip[first]]) * own
    rate = (edit.frame[end - 1] - edit.frame[first]) / (end - 1 - first) if end - first > 1 else 1.0
    return Reason(
        first=first, end=end, clip=int(edit.clip[first]), path=clip.path, mirrored=clip.mirrored,
        shown=(float(shown[0]), float(shown[1])), rate=float(rate), costs=costs, seam=seam, others=others,
    )  # fmt: skip


def _named(terms: Iterator[Term]) -> dict[str, float]:
    """Convert terms to costs by name."""
    return {name: float(np.ravel(values)[0]) for name, values in terms}


def _summed(parts: list[dict[str, float]]) -> dict[str, float]:
    """Add costs of the same name, the highest first; those near zero are left out."""
    total: dict[str, float] = {}
    for costs in parts:
        for name, value in costs.items():
            total[name] = total.get(name, 0.0) + value
    return {name: value for name, value in sorted(total.items(), key=lambda item: -abs(item[1])) if abs(value) > 1e-6}
