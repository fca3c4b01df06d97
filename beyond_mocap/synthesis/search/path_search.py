"""Path search: weighs speed, turning, facing and labels together with continuity, over the whole track.

Faustino searches for labels first and repairs distance afterwards; §6.1 and §6.2 of the thesis propose position,
distance and orientation inside the main search. Here the candidates of every slot of about eight frames are all frames
of the library at five playback rates; their cost is how far speed, turning, facing and labels are from the request,
plus the change of pose. A beam keeps the best states of every slot. A state that begins a piece of a key moment is
bound to it for that clip's own entry and exit; the slot of the key frame itself is closed to all others, so the beam
has to pass through one of these clips at exactly the requested time, and begins its run-up as early as it must.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError, UserCancelledError
from ...library.keys import Key
from ...library.library import Library
from .beam_states import MEMORY_SLOTS, BeamStates
from .beam_transitions import SAME_FRAME, BeamTransitions, SlotCandidates
from .candidate_index import ACTING, PLAYBACK_RATES, SLOT
from .cost_weights import Weights
from .cut_costs import YOUNG_SLOTS, BoneDistance
from .edit_list import EditList, PlacedKey, SearchStretch, compute_steps, find_transitions, replace_stretch
from .key_fit import StrikeMeasurements, compute_key_misfit, compute_swing_rates, measure_ball, measure_strikes
from .path_costs import PathCosts
from .preferences import UNUSUAL_FOOT_WEIGHT, UsedStretch, compute_weak_foot_cost, find_unusual_foot
from .request import RequestedKey, SearchRequest
from .slots import build_key_pieces, build_slot_edges, find_slot, list_playback_rates
from .swing_rate import retime_swing

_ACTING_SHARE = 4  # of the beam, one part in this many is kept for states that show a requested action
_LEAD_IN = 2  # slots ahead of a piece in which frames that lead into it are candidates


@dataclass(frozen=True)
class SearchWidth:
    """How much a search evaluates.

    Attributes:
        beam_width: states that are kept of every slot.
        candidates: pairs of library frame and playback rate that are weighed against them.
        considered: pairs nearest to the requested speed among which these are the cheapest.
    """

    beam_width: int = 64
    candidates: int = 1500
    considered: int = 30000


NARROW = SearchWidth(beam_width=4, candidates=100, considered=2000)
"""Width of a search that is cut short, or quick from the start."""


class PathSearch:
    """One search; `run` returns the edit list.

    Attributes:
        width: how much it evaluates.
        hurried_from: output frame from which on a narrow beam searched, None if none did.
        edges: (S + 1,) output frames of the slots.
        pieces: ways to serve the key moments.
        costs: the costs of the request.
    """

    def __init__(
        self,
        library: Library,
        request: SearchRequest,
        weights: Weights = Weights(),
        progress: Callable[[float, str], None] | None = None,
        cancelled: Callable[[], bool] | None = None,
        *,
        hurry: Callable[[], bool] | None = None,
        stretch: SearchStretch | None = None,
        used: tuple[UsedStretch, ...] = (),
        bone_distance: BoneDistance | None = None,
        on_grid: bool = False,
        narrow: bool = False,
    ):
        """Prepare slots, pieces and costs.

        Args:
            library: the clips.
            request: the request.
            weights: cost of each misfit.
            progress: called as progress(fraction, text).
            cancelled: returns whether to stop.
            hurry: returns whether to finish early: the rest is searched by a narrow beam; before the first slot
                is filled it ends the search as `cancelled` does.
            stretch: search this stretch only and keep the rest.
            used: source frames to avoid where that is possible.
            bone_distance: another distance of poses.
            on_grid: whether slots lie as in other searches of the same frames (`build_slot_edges`).
            narrow: whether the beam is narrow from the second slot on.
        """
        self.library, self.request, self.weights, self.stretch = library, request, weights, stretch
        self.frames = library.frames
        self.costs = PathCosts(library, request, weights, used, bone_distance)
        self.index = self.costs.index
        self.edges = build_slot_edges(library, request, *((stretch.first, stretch.end) if stretch else (0, None)),
                                      on_grid)
        self.pieces = build_key_pieces(library, request, self.edges)
        self.swing_rates = np.ones(len(self.pieces.number))
        self.choice_cost = weights.strike * self._compute_choice_costs()
        self._closed_slots = {find_slot(self.edges, request.keys[number].frame)
                              for number in np.unique(self.pieces.number)}
        self.width = SearchWidth()
        self.hurried_from: int | None = None
        self._report = progress or (lambda fraction, text: None)
        self._cancelled = cancelled or (lambda: False)
        self._hurry, self._narrow = hurry or (lambda: False), narrow
        self._requested_actions: dict[int, frozenset[str]] = {}

    def run(self) -> EditList:
        """Find the sequence with the lowest cost that the beam reaches.

        Raises:
            InputError: where no clip is as long as a slot.
            UserCancelledError: when `cancelled` returns true.
        """
        if not len(self.index.by_speed):
            raise InputError(
                self.library.folder or "library",
                f"no clip of more than {SLOT} frames at {self.library.fps:g} per second",
                "clips of a second or more", "add longer recordings",
            )
        layers: list[BeamStates] = []
        count = len(self.edges) - 1
        # a stretch in the middle starts from the frame before it, whose one state shows one frame
        before, frames_shown = self._build_arrival() if self.edges[0] > 0 else (None, 0)
        for slot in range(count):
            self._stop_or_hurry(slot)
            self._report(slot / count, "Searching")
            before = self._build_first_states() if before is None else self._build_layer(slot, before, frames_shown)
            frames_shown = self.edges[slot + 1] - self.edges[slot]
            layers.append(before)
        if self.edges[-1] < len(self.request):
            layers[-1] = self._add_exit_cost(layers[-1], frames_shown)
        return self._trace_path(layers)

    def _stop_or_hurry(self, slot: int) -> None:
        """Raise UserCancelledError, or narrow the beam, if that is requested."""
        if self._cancelled() or slot == 0 and self._hurry():
            raise UserCancelledError("synthesis: cancelled")
        if self.hurried_from is None and (self._hurry() or self._narrow and slot > 0):
            self.width, self.hurried_from = NARROW, int(self.edges[slot])

    def _compute_choice_costs(self) -> np.ndarray:
        """Compute (P,) how badly each piece's clip strikes the ball that the track has at its key moment, at its best
        rate of the swing.
        """
        costs = np.zeros(len(self.pieces.number))
        measured: dict[tuple[Key, ...], StrikeMeasurements] = {}
        for number in np.unique(self.pieces.number):
            key, at = self.request.keys[number], self.pieces.number == number
            ball = measure_ball(self.request.track, key.frame, key.is_ball_height_known)
            keeps_rate = np.array([len(list_playback_rates(self.library, key, one)) == 1 for one in key.choices])
            if key.choices not in measured:
                measured[key.choices] = measure_strikes(self.library, key.choices)
            strikes = replace(measured[key.choices], keeps_rate=keeps_rate)
            played = strikes.play(self.pieces.choice[at], self.pieces.rate[at])
            costs[at], self.swing_rates[at] = compute_key_misfit(played, ball), compute_swing_rates(played, ball)
            costs[at] += self._compute_foot_cost(key)[self.pieces.choice[at]]
        return costs

    def _compute_foot_cost(self, key: RequestedKey) -> np.ndarray:
        """Compute the cost (K,) of serving a key moment with the player's weak foot, or the library's unusual one."""
        words, weak_foot = key.requested.words, self.request.weak_foot
        if weak_foot:
            return compute_weak_foot_cost(words, key.choices, weak_foot)
        return compute_weak_foot_cost(words, key.choices, find_unusual_foot(self.library), UNUSUAL_FOOT_WEIGHT)

    def _build_first_states(self) -> BeamStates:
        """Build the states of the first slot."""
        to = self.collect_candidates(0)
        to = to.select(self._choose_states(0, to.start, to.cost, to.piece))
        recent = self._remember(np.full((len(to.clip), MEMORY_SLOTS), -1), to.start)
        return BeamStates(to.clip, to.start, to.rate, cost=to.cost, back=np.zeros(len(to.clip), int), piece=to.piece,
                          recent=recent, age=np.full(len(to.clip), YOUNG_SLOTS))

    def _build_arrival(self) -> tuple[BeamStates, int]:
        """Build the state from which a stretch starts, the frame before it; and that state's length, 1."""
        first, edit = self.stretch.first, self.stretch.edit
        at = np.array([first - 1])
        frames_shown = edit.frame[np.maximum(first - SLOT * np.arange(MEMORY_SLOTS, 0, -1), 0)]
        recent = self.index.bucket[self.index.round_frame(frames_shown)][None, :]
        nothing = np.zeros(1, int)
        return BeamStates(edit.clip[at], edit.frame[at], compute_steps(edit, at), cost=np.zeros(1), back=nothing,
                          piece=nothing - 1, recent=recent, age=self._measure_arrival_age()), 1

    def _measure_arrival_age(self) -> np.ndarray:
        """Measure (1,) how many slots before the stretch the last cut is; one at its own start is searched again."""
        first, cuts = self.stretch.first, self.stretch.edit.transitions
        since = first - max((cut for cut in cuts if cut < first), default=first - YOUNG_SLOTS * SLOT)
        return np.array([min(since // SLOT, YOUNG_SLOTS)])

    def _add_exit_cost(self, states: BeamStates, frames_shown: int) -> BeamStates:
        """Add to the last states the cost of the transition to the frame that stays behind the stretch.

        Args:
            states: of the last slot.
            frames_shown: frames of the last slot.
        """
        edit, at = self.stretch.edit, np.array([self.stretch.end])
        goal = SlotCandidates(edit.clip[at], edit.frame[at], compute_steps(edit, at), np.zeros(1), np.array([-1]))
        transitions = self.build_transitions(states, np.arange(len(states.cost)), states.start + states.rate
                                             * frames_shown)
        return replace(states, cost=transitions.compute_all(goal)[:, 0])

    def _build_layer(self, slot: int, before: BeamStates, frames_shown: int) -> BeamStates:
        """Compute the best states of one slot.

        Args:
            slot: its number.
            before: the states of the slot before.
            frames_shown: frames of the slot before.
        """
        ends = before.start + before.rate * frames_shown
        # a state inside a piece that has not ended can only continue it; piece -1 reads the appended 0 and is masked
        is_bound = (before.piece >= 0) & (np.append(self.pieces.end, 0)[before.piece] > slot)
        options = [self._continue_pieces(slot, before, ends, np.flatnonzero(is_bound))] if is_bound.any() else []
        free = np.flatnonzero(~is_bound)
        if len(free):
            going_on = [] if slot in self._closed_slots else [self._continue_clips(slot, before, ends, free)]
            known = np.concatenate([np.zeros(0), *(cost for _, _, _, cost, _, _ in going_on)])
            options += [self._find_transitions(slot, before, ends, free, known), *going_on]
        every = [np.concatenate(parts) for parts in zip(*options)]
        kept = self._choose_states(slot, start=every[1], cost=every[3], piece=every[5])
        clip, start, rate, cost, back, piece = (values.take(kept) for values in every)
        goes_on = (clip == before.clip[back]) & (np.abs(start - ends[back]) < SAME_FRAME)
        age = np.where(goes_on, np.minimum(before.age[back] + 1, YOUNG_SLOTS), 1)
        return BeamStates(clip, start, rate, cost=cost, back=back, piece=piece,
                          recent=self._remember(before.recent.take(back, axis=0), start), age=age)

    def _choose_states(self, slot: int, start: np.ndarray, cost: np.ndarray, piece: np.ndarray) -> np.ndarray:
        """Choose the cheapest free and the cheapest bound states (K,), a beam of each; their indices.

        Beside them the cheapest ones are kept that show a requested action: while a body kneels down or turns to jog
        backward, one that does nothing costs less for a moment, in more ways than a beam holds.
        """
        width, order = self.width.beam_width, np.argsort(cost, kind="stable")
        free = piece[order] < 0
        kept = (order[free][:width], order[~free][:width])
        if not self._list_requested_actions(slot):
            return np.concatenate(kept)
        acting = order[free & self._shows_requested_action(slot, start[order])][: self._acting_width]
        acting = np.setdiff1d(acting, kept[0]) if len(acting) else acting
        return np.concatenate([*kept, acting])

    def _remember(self, recent: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Forget the oldest of the buckets (B, M) shown lately, and append those of library frames (B,)."""
        return np.column_stack([recent[:, 1:], self.index.bucket[self.index.round_frame(start)]])

    @property
    def _acting_width(self) -> int:
        """How many states of a requested action are kept in any case."""
        return self.width.beam_width // _ACTING_SHARE

    def _shows_requested_action(self, slot: int, start: np.ndarray) -> np.ndarray:
        """Return (K,) bool: whether library frames (K,) show an action that the user asks for in a slot."""
        words = self._list_requested_actions(slot)
        if not words:
            return np.zeros(len(start), bool)
        return self.index.shows_labels(words)[self.index.round_frame(start)]

    def _list_requested_actions(self, slot: int) -> frozenset[str]:
        """List the labels of actions that the user asks for in a slot; cached."""
        if slot not in self._requested_actions:
            self._requested_actions[slot] = ACTING & self.costs.list_asked_labels(*self.edges[slot : slot + 2])
        return self._requested_actions[slot]

    def collect_candidates(self, slot: int, most: float = np.inf) -> SlotCandidates:
        """Collect the candidates that can begin in a slot.

        These are pieces of key moments, and, unless a key frame lies in the slot, library frames at any playback rate:
        the cheapest ones, those that lead into a piece, and what was shown before an edit.

        Args:
            slot: its number.
            most: highest cost of the cheapest ones.
        """
        low, high = self.edges[slot : slot + 2]
        closed, here = slot in self._closed_slots, np.flatnonzero(self.pieces.first == slot)
        candidate_lists = [self._list_piece_candidates(low, high, here)] if closed or len(here) else []
        if not closed:
            candidate_lists += [self._list_frame_candidates(low, high, most), *self._iter_lead_in_candidates(slot)]
            candidate_lists += [self._previous_candidate(low, high)] if self.stretch else []
        return SlotCandidates(*(np.concatenate(parts) for parts in zip(*candidate_lists)))

    def _list_piece_candidates(self, low: int, high: int, here: np.ndarray):
        """Build the candidates of pieces `here` that begin in a slot."""
        clip, start, rate = self.pieces.clip[here], self.pieces.start[here], self.pieces.rate[here]
        cost = self.costs.compute_key_misfit(low, high, clip, start, rate) + self.choice_cost[here]
        return clip, start, rate, cost, here

    def _list_frame_candidates(self, low: int, high: int, most: float):
        """Build the candidates of the cheapest library frames."""
        number, start, cost = self.costs.find_cheapest(low, high, self.width.considered, self.width.candidates,
                                                       most)
        return self.frames.clip[start], start.astype(float), PLAYBACK_RATES[number], cost, np.full(len(cost), -1)

    def _iter_lead_in_candidates(self, slot: int):
        """Generate the candidates from which a piece that begins soon is reached without a cut, if there are any."""
        soon = np.flatnonzero((self.pieces.first > slot) & (self.pieces.first <= slot + _LEAD_IN))
        if not len(soon):
            return
        number = np.abs(PLAYBACK_RATES - self.pieces.rate[soon][:, None]).argmin(axis=1)
        clip, rate = self.pieces.clip[soon], PLAYBACK_RATES[number]
        start = self.pieces.start[soon] - rate * (self.edges[self.pieces.first[soon]] - self.edges[slot])
        cost = self._compute_misfit_inside(slot, clip, start, number)
        yield clip, start, rate, cost, np.full(len(soon), -1)

    def _previous_candidate(self, low: int, high: int):
        """Build the candidate of what the edit list shows in a slot, none if it is cut there."""
        edit = self.stretch.edit
        at = np.array([] if np.any((edit.transitions > low) & (edit.transitions < high)) else [low], int)
        start, rate = edit.frame[at], compute_steps(edit, at)
        number = np.abs(PLAYBACK_RATES - rate[:, None]).argmin(axis=1)
        cost = self.costs.compute_misfit(low, high, number, self.index.round_frame(start))
        return edit.clip[at], start, rate, cost, np.full(len(at), -1)

    def _compute_misfit_inside(self, slot: int, clip: np.ndarray, start: np.ndarray, number: np.ndarray) -> np.ndarray:
        """Compute the misfit (K,) of playing clips from fractional frames on, inf where they do not last."""
        low, high = self.edges[slot : slot + 2]
        first = self.frames.first.take(clip)
        last = first + self.frames.count.take(clip) - 1
        lasts = (start >= first) & (start + PLAYBACK_RATES.take(number) * (high - low) <= last)
        return np.where(lasts, self.costs.compute_misfit(low, high, number, self.index.round_frame(start)), np.inf)

    def _find_transitions(self, slot: int, before: BeamStates, ends: np.ndarray, free: np.ndarray, known: np.ndarray):
        """Find the candidates that may be kept, each by the cheapest transition.

        Args:
            known: (L,) costs of other ways to fill the slot.
        """
        transitions = self.build_transitions(before, free, ends[free])
        # candidates of a requested action have a share of the beam whatever they cost
        is_asked = bool(self._list_requested_actions(slot))
        most = np.inf if is_asked else transitions.bound_own_cost(known, self.width.beam_width)
        to = self.collect_candidates(slot, most)
        which, cost, state = transitions.find_cheapest(to, known, self.width.beam_width)
        if is_asked and len(acting := np.flatnonzero(self._shows_requested_action(slot, to.start) & (to.piece < 0))):
            more, *rest = transitions.find_cheapest(to.select(acting), np.zeros(0), self._acting_width)
            new = ~np.isin(acting[more], which)
            which, cost, state = (np.concatenate(pair) for pair in zip(
                (which, cost, state), (acting[more][new], *(values[new] for values in rest))))
        return to.clip[which], to.start[which], to.rate[which], cost, free[state], to.piece[which]

    def build_transitions(self, before: BeamStates, free: np.ndarray, ends: np.ndarray) -> BeamTransitions:
        """Build the transitions from the states `free` (B,), which end at library frames `ends` (B,)."""
        young = self.costs.cuts.compute_young_cut_cost(before.age[free])
        return BeamTransitions(self.costs, before.clip[free], ends, rate=before.rate[free], cost=before.cost[free],
                               recent=before.recent[free], young=young)

    def _continue_pieces(self, slot: int, before: BeamStates, ends: np.ndarray, bound: np.ndarray):
        """Continue the pieces of key moments."""
        clip, start, rate = before.clip[bound], ends[bound], before.rate[bound]
        cost = before.cost[bound] + self.costs.compute_key_misfit(self.edges[slot], self.edges[slot + 1], clip, start,
                                                                  rate)
        return clip, start, rate, cost, bound, before.piece[bound]

    def _continue_clips(self, slot: int, before: BeamStates, ends: np.ndarray, free: np.ndarray):
        """Continue without a cut, at each playback rate, where the slot still ends inside the clip."""
        back = np.repeat(free, len(PLAYBACK_RATES))
        number = np.arange(len(back)) % len(PLAYBACK_RATES)
        clip, start, rate = before.clip.take(back), ends.take(back), PLAYBACK_RATES.take(number)
        cost = before.cost.take(back) + self._compute_misfit_inside(slot, clip, start, number)
        cost += self.weights.rate_change * np.abs(rate - before.rate.take(back))
        return clip, start, rate, cost, back, np.full(len(back), -1)

    def _trace_path(self, layers: list[BeamStates]) -> EditList:
        """Trace the cheapest last state back to the first, as an edit list."""
        state = int(np.argmin(layers[-1].cost))
        clip, frame = np.empty(len(self.request), int), np.empty(len(self.request))
        shown: dict[int, int] = {}  # number of a key moment -> its piece
        for slot, states in reversed(list(enumerate(layers))):
            low, high = self.edges[slot : slot + 2]
            frame[low:high] = states.start[state] + states.rate[state] * np.arange(high - low)
            clip[low:high] = states.clip[state]
            piece = int(states.piece[state])
            if piece >= 0:
                shown[int(self.pieces.number[piece])] = piece
            state = int(states.back[state])
        for number, piece in shown.items():
            low, high = self.edges[[self.pieces.first[piece], self.pieces.end[piece]]]
            frame[low:high] = retime_swing(frame[low:high], self.request.keys[number].frame - low, self.library.fps,
                                           float(self.swing_rates[piece]))
        keys = tuple(PlacedKey(number, self.pieces.key(self.request, shown[number])) for number in sorted(shown))
        if self.stretch:
            return replace_stretch(self.stretch.edit, int(self.edges[0]), int(self.edges[-1]), clip=clip, frame=frame,
                                   keys=keys)
        return EditList(clip, frame, find_transitions(clip, frame), keys)
