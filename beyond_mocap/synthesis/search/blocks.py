"""Block search, coarse to fine: blocks of 32, 16 and 8 frames by dynamic programming (Faustino 2016, §3.2).

The first pass chooses a cluster for every slot of 32 frames, the second a block from each chosen cluster; the slots are
then halved twice, and each half is searched again among the cluster that the parent's half belongs to. Cost per slot is
alpha times the annotation cost D (eq. 18, 19), and between slots 1 - alpha times the continuity cost C (eq. 17), in
units of `block_costs.measure_typical_distance`.

Decisions where the paper is silent or misprinted:
- A slot with a key moment has as candidates only blocks that show a serving clip's key frame at exactly that frame.
  Eq. 20 as printed multiplies D by zero there, which discards the reward of the right block; with the right place
  enforced by the choice of start no multiplier is needed, at any block length. At the coarse levels, where a clip may
  be too short to reach the slot's edges, its end is held for the cost.
- Slots beside a key moment also have the same clip's neighbouring frames as candidates, for the length of its annotated
  row, so that entry and exit can be played whole.
- A parent's own half is always among the candidates, so that refining never makes a sequence worse.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import TimedMessage, UserCancelledError
from ...library.clusters import BLOCK_LENGTHS
from ...library.keys import Key
from ...library.library import Library
from .block_choice import rank_varied
from .block_costs import AnnotationCost, collect_windows, compute_distances, measure_typical_distance
from .preferences import AVOIDED_COST, compute_weak_foot_cost
from .request import SearchRequest, compute_needed_frames, library_frame

FINEST_LENGTH = BLOCK_LENGTHS[-1]  # frames
SEARCH_MORE = "a higher Most Blocks compares more and takes longer"


# The sequence through slots with the lowest cost, by dynamic programming (Faustino eq. 14, 15), on costs alone.


def find_cheapest_path(
    unary: Sequence[np.ndarray], transition: Callable[[int], np.ndarray]
) -> tuple[np.ndarray, float]:
    """Choose one candidate per slot so that the sum of unary and transition costs is lowest.

        find_cheapest_path([np.array([0, 1.0]), np.array([5.0, 0])], lambda s: np.zeros((2, 2)))   # -> [0, 1], 0.0

    Args:
        unary: S arrays (K_s,), cost of each candidate of a slot; np.inf forbids.
        transition: returns for slot s the costs (K_s, K_{s+1}) of each candidate of slot s + 1 after each of slot s.
    Returns:
        The choices (S,) and the total cost; ties go to the first.
    Source: Faustino 2016, eq. 14, 15.
    """
    total = np.asarray(unary[0], dtype=float)
    back: list[np.ndarray] = []
    for slot in range(1, len(unary)):
        # through[i, j]: lowest cost of ending at candidate i, plus going on to candidate j
        through = total[:, None] + transition(slot - 1)
        before = np.argmin(through, axis=0)
        back.append(before)
        total = through[before, np.arange(through.shape[1])] + unary[slot]
    choice = np.empty(len(unary), dtype=int)
    choice[-1] = int(np.argmin(total))
    # trace back: back[slot - 1][j] is the best predecessor of candidate j of `slot`
    for slot in range(len(unary) - 1, 0, -1):
        choice[slot - 1] = back[slot - 1][choice[slot]]
    return choice, float(total[choice[-1]])


@dataclass(frozen=True, eq=False)
class BlockCandidates:
    """Candidate blocks of a slot.

    Attributes:
        clip: (K,) clip index.
        start: (K,) library frame; it may lie outside the clip beside a key moment.
    """

    clip: np.ndarray
    start: np.ndarray

    def __len__(self) -> int:
        return len(self.clip)

    def select(self, choice) -> "BlockCandidates":
        """Select candidates by index."""
        return BlockCandidates(self.clip[choice], self.start[choice])


class BlockSearch:
    """Search for one block of 8 frames per slot.

    Attributes:
        library: the clips.
        request: the request.
        alpha: weight of labels against continuity, eq. 13.
        scale: length that makes continuity costs comparable.
        key_in_slot: slot -> (number of the key moment, library key) that its block shows, after `run`.
        thinned_slots: frames of a block -> number of candidates of each slot that had more than were compared.
    """

    def __init__(
        self,
        library: Library,
        request: SearchRequest,
        alpha: float,
        progress: Callable[[float, str], None] | None = None,
        cancelled: Callable[[], bool] | None = None,
    ):
        """Prepare the costs.

        Args:
            library: the clips.
            request: the request.
            alpha: weight of labels against continuity.
            progress: called as progress(fraction, text).
            cancelled: returns whether to stop.
        """
        self.library, self.request, self.alpha = library, request, alpha
        self.frames = library.frames
        self.annotation = AnnotationCost(library.frames)
        self.scale = measure_typical_distance(library.frames)
        self._report = progress or (lambda fraction, text: None)
        self._cancelled = cancelled or (lambda: False)
        self.key_in_slot: dict[int, tuple[int, Key]] = {}
        self.thinned_slots: dict[int, list[int]] = {length: [] for length in BLOCK_LENGTHS}
        self._notes: list[TimedMessage] = []

    def run(self) -> BlockCandidates:
        """Run the search.

        Returns:
            The finest blocks, one per slot of 8 frames.
        Raises:
            UserCancelledError: when `cancelled` returns true.
        """
        coarse = self._choose_clusters()
        blocks = self._choose_blocks(BLOCK_LENGTHS[0], coarse)
        for number, length in enumerate(BLOCK_LENGTHS[1:]):
            self._report_step(0.4 + 0.3 * number, f"Blocks of {length} frames")
            blocks = self._choose_blocks(length, self._split_blocks(blocks, length))
        return blocks

    @property
    def notes(self) -> list[str]:
        """What was left out of the search, one line each."""
        return [*self._describe_thinned_slots(), *self._notes]

    def _describe_thinned_slots(self) -> list[str]:
        """Describe the slots whose candidates were thinned."""
        found = [f"{len(counts)} of {self.count_slots(length)} with {length} frames (up to {max(counts):,} candidates)"
                 for length, counts in self.thinned_slots.items() if counts]
        limit = self.request.plan.max_blocks
        text = f"slots for which not all blocks were compared: {', '.join(found)}; the {limit} nearest in labels were"
        return [f"{text}; {SEARCH_MORE}"] if found else []

    def note_thinning(self, first: int, end: int, count: int, clips: int, clips_left: int) -> None:
        """Note that not all locomotion blocks of a section were compared.

        Args:
            first, end: the section's frames.
            count: blocks that could be shown.
            clips: number of their clips.
            clips_left: clips of those that were compared.
        """
        low, high = (float(self.request.track.times[0]) + frame / self.library.fps for frame in (first, end))
        text = (f"{low:.1f} to {high:.1f} s: {count:,} blocks of {clips} clips fit; compared "
                f"were {self.request.plan.max_blocks} of {clips_left} clips, the nearest in labels and speed")
        self._notes.append(TimedMessage(f"{text}; {SEARCH_MORE}", (low, high)))

    def count_slots(self, length: int) -> int:
        """Return the number of slots of `length` frames; all levels cover a whole number of the longest."""
        # -(-n // m): division rounded up
        return -(-len(self.request) // BLOCK_LENGTHS[0]) * (BLOCK_LENGTHS[0] // length)

    def list_requested_labels(self, slot: int, length: int):
        """Return the requested labels of a slot's frames, None beyond the end."""
        words = self.request.requested_labels[slot * length : (slot + 1) * length]
        return [*words, *[None] * (length - len(words))]

    def find_keys(self, slot: int, length: int) -> list[tuple[int, int]]:
        """List (number, offset in the slot) of the first key moment in a slot that a clip can serve."""
        low = slot * length
        found = [
            (number, int(round(key.frame)) - low)
            for number, key in enumerate(self.request.keys)
            if key.choices and low <= int(round(key.frame)) < low + length
        ]
        return found[:1]

    def _key_blocks(self, slot: int, length: int) -> tuple[BlockCandidates, list[tuple[int, Key]]]:
        """Build the blocks that show a key moment of this slot at its frame, and which key each shows."""
        which, clip, start = [], [], []
        for number, offset in self.find_keys(slot, length):
            for choice in self.request.keys[number].choices:
                which.append((number, choice))
                clip.append(choice.clip)
                start.append(int(round(library_frame(self.library, choice))) - offset)
        return BlockCandidates(np.array(clip, int), np.array(start, int)), which

    def _blocks_beside_keys(self, slot: int, length: int) -> BlockCandidates:
        """Build the blocks that continue a serving clip into this slot, where its entry or exit needs it."""
        clip, start = [], []
        middle = (slot + 0.5) * length
        for key in self.request.keys:
            for choice in key.choices:
                entry, leave = compute_needed_frames(self.library, choice)
                if -entry - length / 2 < middle - key.frame < leave + length / 2:
                    clip.append(choice.clip)
                    start.append(int(round(library_frame(self.library, choice))) + slot * length
                                 - int(round(key.frame)))
        return self._select_inside(BlockCandidates(np.array(clip, int), np.array(start, int)), length)

    def _select_inside(self, blocks: BlockCandidates, length: int) -> BlockCandidates:
        """Select those that lie wholly within their clip."""
        first = self.frames.first[blocks.clip]
        fits = (blocks.start >= first) & (blocks.start + length <= first + self.frames.count[blocks.clip])
        return blocks.select(fits)

    def _choose_clusters(self) -> list[BlockCandidates]:
        """Choose one cluster per slot of 32 frames by the same costs, and return its members as candidates.

        Source: Faustino 2016: "DP is actually performed twice".
        """
        length = BLOCK_LENGTHS[0]
        clusters = self.library.clusters[length]
        count = len(clusters.medoid)
        usable = self.request.allowed[self.frames.clip[clusters.start]] if count else np.zeros(0, bool)
        if not np.any(usable):
            return [self._clip_starts() for _ in range(self.count_slots(length))]
        size = length // 2
        medoid = clusters.start[clusters.medoid]
        clip = self.frames.clip[medoid]
        # the end of each cluster's medoid block against the start of every other one
        ends = collect_windows(self.frames, clip, medoid + length - size + size // 2, size)
        starts = collect_windows(self.frames, clip, medoid + size // 2, size)
        between = (1.0 - self.alpha) * compute_distances(ends, starts) / (self.scale * np.sqrt(size))
        unary = []
        for slot in range(self.count_slots(length)):
            self._report_step(0.3 * slot / self.count_slots(length), "Clusters")
            unary.append(self._compute_cluster_costs(clusters, usable, slot))
        choice, _ = find_cheapest_path(unary, lambda slot: between)
        return [self._cluster_members(clusters, usable, label) for label in choice]

    def _compute_cluster_costs(self, clusters, usable: np.ndarray, slot: int) -> np.ndarray:
        """Compute alpha D of each cluster, a mean over its blocks (eq. 19); a key moment forbids others."""
        count = len(clusters.medoid)
        cost = self.annotation.compute_block_costs(clusters.start, self.list_requested_labels(slot, clusters.length))
        blocks, which = self._key_blocks(slot, clusters.length)
        cost = cost + self._compute_style_cost(clusters.start)
        # leave out blocks with avoided labels, unless none would remain or a key moment decides
        fine = usable & ~self._shows_avoided(clusters.start, slot, clusters.length)
        usable = fine if fine.any() and not len(blocks) else usable
        members = np.bincount(clusters.label[usable], minlength=count)
        total = np.bincount(clusters.label[usable], cost[usable], minlength=count)
        out = np.where(members > 0, self.alpha * total / np.maximum(members, 1), np.inf)
        weak = np.concatenate([np.zeros(0), *(self._compute_foot_cost(*served) for served in which)])
        # clusters of the blocks that serve the key moment with the preferred foot
        labels = {clusters.label_at(start) for start in blocks.start[weak == weak.min(initial=np.inf)]} - {-1}
        if labels:
            out[[label for label in range(count) if label not in labels]] = np.inf
        return out

    def _cluster_members(self, clusters, usable: np.ndarray, label: int) -> BlockCandidates:
        """Select the usable blocks of a cluster."""
        start = clusters.start[usable & (clusters.label == label)]
        return BlockCandidates(self.frames.clip[start], start)

    def _clip_starts(self) -> BlockCandidates:
        """Build candidates where all clips are shorter than the longest block: the start of every usable one."""
        clip = np.flatnonzero(self.request.allowed)
        return BlockCandidates(clip, self.frames.first[clip])

    def _split_blocks(self, blocks: BlockCandidates, length: int) -> list[BlockCandidates]:
        """Collect for each half of each block the blocks of the cluster that it belongs to, and the half itself."""
        clusters = self.library.clusters[length]
        usable = self.request.allowed[self.frames.clip[clusters.start]]
        out = []
        for clip, start in zip(blocks.clip, blocks.start):
            for half in (start, start + length):
                members = self._cluster_members(clusters, usable, clusters.label_at(half))
                out.append(BlockCandidates(np.append(members.clip, clip), np.append(members.start, half)))
        return out

    def _choose_blocks(self, length: int, candidate_lists: list[BlockCandidates]) -> BlockCandidates:
        """Choose one block per slot by dynamic programming.

        Args:
            length: frames of a block.
            candidate_lists: candidates of each slot.
        """
        slots, unary, keys = [], [], []
        for slot, candidates in enumerate(candidate_lists):
            self._report_step(None, "")
            blocks, which = self._key_blocks(slot, length)
            if not len(blocks):
                blocks, which = self._thin_candidates(slot, length, candidates), []
            slots.append(blocks)
            keys.append(which)
            cost = self.alpha * self.annotation.compute_block_costs(blocks.start,
                                                                    self.list_requested_labels(slot, length))
            cost += self.alpha * self._compute_style_cost(blocks.start)
            if which:
                cost += np.concatenate([self._compute_foot_cost(*served) for served in which])
            unary.append(cost + AVOIDED_COST * self._shows_avoided(blocks.start, slot, length))
        ends, starts = zip(*(self._end_windows(blocks, length) for blocks in slots))
        weight = (1.0 - self.alpha) / (self.scale * np.sqrt(length // 2))
        choice, _ = find_cheapest_path(unary, lambda slot: weight * compute_distances(ends[slot], starts[slot + 1]))
        self.key_in_slot = {slot: keys[slot][c] for slot, c in enumerate(choice) if keys[slot]}
        picked = [blocks.select([c]) for blocks, c in zip(slots, choice)]
        return BlockCandidates(np.concatenate([p.clip for p in picked]), np.concatenate([p.start for p in picked]))

    def _thin_candidates(self, slot: int, length: int, candidates: BlockCandidates) -> BlockCandidates:
        """Select at most `Plan.max_blocks` blocks, those with the best labels first and from many clips, plus the ones
        beside key moments.
        """
        limit = self.request.plan.max_blocks
        if len(candidates) > limit:
            cost = self.annotation.compute_block_costs(candidates.start, self.list_requested_labels(slot, length))
            cost += AVOIDED_COST * self._shows_avoided(candidates.start, slot,
                                                       length) + self._compute_style_cost(candidates.start)
            self.thinned_slots[length].append(len(candidates))
            candidates = candidates.select(np.sort(rank_varied(cost, candidates.clip)[:limit]))
        beside = self._blocks_beside_keys(slot, length)
        return BlockCandidates(np.append(candidates.clip, beside.clip), np.append(candidates.start, beside.start))

    def _compute_style_cost(self, start: np.ndarray) -> np.ndarray:
        """Compute the cost (M,) of blocks from frames `start` (M,) on that are not of the requested style."""
        off = self.request.style_cost
        return np.zeros(len(start)) if off is None else off[np.clip(start, 0, len(off) - 1)].astype(float)

    def _compute_foot_cost(self, number: int, key: Key) -> np.ndarray:
        """Compute the cost (1,) of serving a key moment by `key` with the weak foot."""
        return compute_weak_foot_cost(self.request.keys[number].requested.words, (key,), self.request.weak_foot)

    def _shows_avoided(self, start: np.ndarray, slot: int, length: int) -> np.ndarray:
        """Return (M,) bool: whether blocks from frames `start` (M,) on show a label that the slot avoids."""
        avoid = self.request.list_avoided(slot * length, (slot + 1) * length)
        if not avoid:
            return np.zeros(len(start), bool)
        # running count: the block shows one if the count grows between its ends
        running_count = np.append(0, np.cumsum(self.annotation.find_frames_with(avoid)))
        low, high = np.clip(start, 0, len(self.frames)), np.clip(start + length, 0, len(self.frames))
        return running_count[high] > running_count[low]

    def _end_windows(self, blocks: BlockCandidates, length: int) -> tuple[np.ndarray, np.ndarray]:
        """Collect the windows around the frame after each block's last one and around its first (eq. 17)."""
        size = length // 2
        after = collect_windows(self.frames, blocks.clip, blocks.start + length, size)
        return after, collect_windows(self.frames, blocks.clip, blocks.start, size)

    def _report_step(self, fraction: float | None, text: str) -> None:
        """Report progress, and raise UserCancelledError if requested."""
        if self._cancelled():
            raise UserCancelledError("synthesis: cancelled")
        if fraction is not None:
            self._report(fraction, text)
