"""Add or remove cycles of locomotion until the travelled distance fits (Faustino 2016, §3.2.4).

The sequence of 8-frame blocks is split into locomotion and other sections. Each locomotion section keeps its first and
last block; the blocks between are replaced by as many locomotion blocks as it takes to travel the requested distance.

Decisions where the paper is vague or misprinted:
- Step 7 takes the absolute value of the difference, so that distance could never be removed; here its sign is kept.
- Eq. 22 and 23 drop alpha; here D and C are weighed as in eq. 14.
- The steps that build S' run the same recursion for every end block; here it runs once for all, and the candidates are
  read off every layer. Of the sequences within DISTANCE_TOLERANCE of the requested distance the one with the lowest
  cost per block wins (the paper's arg min of the distance alone takes bad transitions to win a millimetre); if none is,
  the nearest one. Among those within it, sequences that are played at ACCEPTED_RATES go before all
  others: a slow walk of many blocks, played half as fast again, would often be cheaper by a little.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...annotation import LOCOMOTION_LABELS
from ...base.vectors import distances_along
from ...library.library import Library
from ...motion.motion import ACCEPTED_RATES
from ...motion.track import SampledTrack
from .block_choice import STRETCH, choose_stretches, count_demands
from .block_costs import collect_windows, compute_distances
from .blocks import FINEST_LENGTH, BlockCandidates, BlockSearch
from .request import SearchRequest

DISTANCE_TOLERANCE = 0.1  # m from the requested distance within which a sequence fits


@dataclass(frozen=True, eq=False)
class Section:
    """A run of slots with the blocks that fill it.

    Attributes:
        first: first slot of the output.
        end: slot after the last one.
        is_locomotion: whether its frames request locomotion only.
        blocks: as many as slots or, in locomotion, more or fewer.
    """

    first: int
    end: int
    is_locomotion: bool
    blocks: BlockCandidates


def split_sections(request: SearchRequest, blocks: BlockCandidates) -> list[Section]:
    """Split a sequence into runs of slots whose frames request locomotion only, and the runs between them."""
    kinds = []
    for slot in range(len(blocks)):
        words = request.requested_labels[slot * FINEST_LENGTH : (slot + 1) * FINEST_LENGTH]
        kinds.append(bool(words) and all(w is not None and w & LOCOMOTION_LABELS for w in words))
    edges = [0] + [s for s in range(1, len(kinds)) if kinds[s] != kinds[s - 1]] + [len(kinds)]
    return [Section(low, high, kinds[low], blocks.select(slice(low, high))) for low, high in zip(edges, edges[1:])]


def match_distance(search: BlockSearch, blocks: BlockCandidates, delta: float) -> list[Section]:
    """Fit the travelled distance of locomotion sections to the track.

    Args:
        search: the block search.
        blocks: its result, one per slot.
        delta: m that the distance may be off, where cycles allow.
    """
    request, sections, travelled = search.request, [], 0.0
    track_distance = compute_travelled_distance(request.track)
    for section in split_sections(request, blocks):
        clip_distance = float(compute_block_distances(search.library, section.blocks).sum())
        goal = float(track_distance[min(section.end * FINEST_LENGTH, len(track_distance) - 1)])
        # goal: distance of the track up to the section's end; own + travelled: what the clips have travelled by then
        missing = goal - (clip_distance + travelled)
        if section.is_locomotion and len(section.blocks) > 2 and abs(missing) > delta:
            section = _refill_section(search, section, clip_distance + missing)
            clip_distance = float(compute_block_distances(search.library, section.blocks).sum())
        sections.append(section)
        travelled += clip_distance
    return sections


def compute_travelled_distance(track: SampledTrack) -> np.ndarray:
    """Compute the distance (T,) m along the smoothed track since its first frame."""
    return distances_along(track.positions)


def compute_block_distances(library: Library, blocks: BlockCandidates) -> np.ndarray:
    """Compute the distance (K,) m that each 8-frame block travels along its clip's path."""
    frames = library.frames
    running = distances_along(frames.path)
    last = frames.first[blocks.clip] + frames.count[blocks.clip] - 1
    low = np.clip(blocks.start, frames.first[blocks.clip], last)
    return running[np.clip(blocks.start + FINEST_LENGTH, low, last)] - running[low]


def _refill_section(search: BlockSearch, section: Section, goal: float) -> Section:
    """Replace the inner blocks of a section so that it travels `goal` metres."""
    blocks = _select_locomotion_blocks(search, section)
    entry, leave = section.blocks.select([0]), section.blocks.select([-1])
    ends = float(compute_block_distances(search.library, section.blocks.select([0, -1])).sum())
    if not len(blocks) or goal <= ends:
        return section
    inner = _find_cheapest_chain(search, section, blocks, goal - ends)
    chain = [entry, *([blocks.select(inner)] if len(inner) else []), leave]
    merged = BlockCandidates(np.concatenate([c.clip for c in chain]), np.concatenate([c.start for c in chain]))
    return Section(section.first, section.end, True, merged)


def _select_locomotion_blocks(search: BlockSearch, section: Section) -> BlockCandidates:
    """Select locomotion blocks that carry a label requested in the section.

    Starts lie on a grid of four frames, so that every block's own continuation is there too.
    """
    frames = search.frames
    requested = {w for slot in range(section.first, section.end) for w in search.list_requested_labels(slot,
            FINEST_LENGTH) if w}
    wanted_words = frozenset().union(*requested) & LOCOMOTION_LABELS if requested else frozenset()
    columns = [i for i, word in enumerate(frames.vocabulary) if word in wanted_words]
    # clips with key moments are no locomotion
    keyed = np.zeros(len(frames), bool)
    for key in search.library.keys:
        keyed[frames.first[key.clip] : frames.first[key.clip] + frames.count[key.clip]] = True
    start = search.library.clusters[FINEST_LENGTH].start
    inside = (start - frames.first[frames.clip[start]]) % 4 == 0
    fits = inside & search.request.allowed[frames.clip[start]] & ~keyed[start]
    fits &= frames.words[start][:, columns].any(axis=1) & frames.words[start + FINEST_LENGTH - 1][:,
            columns].any(axis=1)
    if avoid := search.request.list_avoided(section.first * FINEST_LENGTH, section.end * FINEST_LENGTH):
        running_count = np.append(0, np.cumsum(search.annotation.find_frames_with(avoid)))
        free = fits & (running_count[start + FINEST_LENGTH] == running_count[start])
        fits = free if free.any() else fits
    start = start[fits]
    found = BlockCandidates(frames.clip[start], start)
    return found if len(found) <= search.request.plan.max_blocks else _thin_blocks(search, section, found)


def _thin_blocks(search: BlockSearch, section: Section, blocks: BlockCandidates) -> BlockCandidates:
    """Select as many blocks as the plan allows, by labels, speed and variety, and note that it was necessary."""
    request, frames = search.request, search.frames
    low, high = section.first * FINEST_LENGTH, min(section.end * FINEST_LENGTH, len(request))
    demands = count_demands(list(request.requested_labels[low:high]), request.track.speed[low:high])
    label_cost = {labels: search.annotation.compute_block_costs(blocks.start, [labels] * FINEST_LENGTH)
                  for labels, _ in demands}
    speed = compute_block_distances(search.library, blocks) * search.library.fps / FINEST_LENGTH
    stretch = (blocks.start - frames.first[blocks.clip]) // STRETCH + frames.first[blocks.clip]
    chosen = blocks.select(choose_stretches(demands, label_cost, speed, clip=blocks.clip, stretch=stretch,
                                            limit=request.plan.max_blocks))
    search.note_thinning(low, high, len(blocks), len(np.unique(blocks.clip)), len(np.unique(chosen.clip)))
    return chosen


def _find_cheapest_chain(search: BlockSearch, section: Section, blocks: BlockCandidates, goal: float) -> np.ndarray:
    """Find the blocks that travel `goal` metres between the section's entry and exit block, by dynamic programming.

    Source: Faustino 2016, eq. 22, 23.
    """
    alpha, size = search.alpha, FINEST_LENGTH // 2
    weight = (1.0 - alpha) / (search.scale * np.sqrt(size))
    step = compute_block_distances(search.library, blocks)
    after = collect_windows(search.frames, blocks.clip, blocks.start + FINEST_LENGTH, size)
    before = collect_windows(search.frames, blocks.clip, blocks.start, size)
    first, last = section.blocks.select([0]), section.blocks.select([-1])
    from_entry = compute_distances(collect_windows(search.frames, first.clip, first.start + FINEST_LENGTH, size),
                                   before)[0]
    to_exit = weight * compute_distances(after, collect_windows(search.frames, last.clip, last.start, size))[:, 0]
    between = weight * compute_distances(after, before)
    label_cost = _build_label_cost(search, section, blocks)
    # layer n: lowest cost of a chain of n + 1 blocks that ends with each block, and the distance it travels
    total = weight * from_entry + alpha * label_cost(np.zeros(len(blocks)))
    travelled, back, layers = step.copy(), [], []
    for layer in range(4 * (section.end - section.first) + 8):
        # distance error, and cost per block with the exit, if the chain ends here
        layers.append((np.abs(goal - travelled), (total + to_exit) / (layer + 2)))
        if np.all(travelled >= goal):
            break
        # through[i, j]: the best chain to block i, then block j
        through = total[:, None] + between
        source = np.argmin(through, axis=0)
        total = through[source, np.arange(len(source))] + alpha * label_cost(travelled[source])
        travelled = travelled[source] + step
        back.append(source)
    return _read_chain(layers, back, section.end - section.first)


def _build_label_cost(search: BlockSearch, section: Section, blocks: BlockCandidates):
    """Build a function for D of each block after `travelled` (B,) metres of the section.

    Each frame of a block is compared with the labels requested where the track has travelled as far as the body then
    has (the paper's AA_d over travelled distance).

    Source: Faustino 2016, §3.2.4.
    """
    track_distance = compute_travelled_distance(search.request.track)
    low, high = section.first * FINEST_LENGTH, min(section.end * FINEST_LENGTH, len(track_distance))
    requested = search.request.requested_labels[low:high]
    kinds = sorted(set(requested), key=sorted)
    number = np.array([kinds.index(labels) for labels in requested])
    along = track_distance[low:high] - track_distance[low]
    running, steps = distances_along(search.frames.path), np.arange(FINEST_LENGTH)
    frame = blocks.start[:, None] + steps
    inside = running[frame] - running[blocks.start][:, None]
    # counts[kind]: labels in common and in either, of each block's frames
    counts = np.array([search.annotation.count_labels(frame, kind) for kind in kinds])

    def compute_label_cost(travelled: np.ndarray) -> np.ndarray:
        place = np.minimum(np.searchsorted(along, travelled[:, None] + inside), len(along) - 1)
        common, either = counts[number[place], :, np.arange(len(blocks))[:, None], steps].sum(axis=1).T
        return (either - 2.0 * common) / np.maximum(either, 1.0)

    return compute_label_cost


def _read_chain(layers, back, slots: int) -> np.ndarray:
    """Read the best chain over all layers: within DISTANCE_TOLERANCE metres, at a fitting speed, cheapest per block.

    Where none is within it, the nearest one.

    Args:
        layers: per layer the distance errors (B,) m, and the costs (B,) per block, of the chains that end there.
        back: per layer but the first, the block before each (B,).
        slots: of the section, which the chain fills with the entry and the exit block.
    Returns:
        Block indices in order.
    """
    error = np.stack([e for e, _ in layers])
    cost = np.stack([c for _, c in layers])
    close = error <= DISTANCE_TOLERANCE
    rate = (np.arange(len(layers))[:, None] + 3) / slots
    at_speed = close & (rate >= ACCEPTED_RATES[0]) & (rate <= ACCEPTED_RATES[1])
    fits = at_speed if at_speed.any() else close
    score = np.where(fits, cost, np.inf) if fits.any() else error
    layer, block = np.unravel_index(int(np.argmin(score)), score.shape)
    chain = [int(block)]
    for source in back[:layer][::-1]:
        chain.append(int(source[chain[-1]]))
    return np.array(chain[::-1], int)
