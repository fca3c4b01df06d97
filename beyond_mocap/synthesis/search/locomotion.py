"""Add or remove cycles of locomotion until the travelled distance fits (Faustino 2024, §3.2.4).

The sequence of 8-frame blocks is split into locomotion and other sections. Each locomotion section keeps its first and
last block; the blocks between are replaced by as many locomotion blocks as it takes to travel the requested distance.

Decisions where the paper is vague or misprinted:
- Step 7 takes the absolute value of the difference, so that distance could never be removed; here its sign is kept.
- Eq. 22 and 23 drop alpha; here D and C are weighed as in eq. 14.
- The steps that build S' run the same recursion for every end block; here it runs once for all, and the candidates are
  read off every layer. Of the sequences within DISTANCE_TOLERANCE of the requested distance the one with the lowest
  cost per block wins (the paper's arg min of the distance alone takes bad transitions to win a millimetre); if none is,
  the nearest one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...annotation import LOCOMOTION_WORDS
from ...base.vectors import distance_along
from ...library.library import Library
from ...motion.track import SampledTrack
from .block_costs import distances, windows
from .blocks import FINEST, BlockSearch, Candidates
from .wanted import Wanted

CLOSE = 0.1  # m from the requested distance within which a sequence fits
MOST_BLOCKS = 500  # candidates of a section


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
    locomotion: bool
    blocks: Candidates


def split(wanted: Wanted, blocks: Candidates) -> list[Section]:
    """Split a sequence into runs of slots whose frames request locomotion only, and the runs between them."""
    kinds = []
    for slot in range(len(blocks)):
        words = wanted.asked[slot * FINEST : (slot + 1) * FINEST]
        kinds.append(bool(words) and all(w is not None and w & LOCOMOTION_WORDS for w in words))
    edges = [0] + [s for s in range(1, len(kinds)) if kinds[s] != kinds[s - 1]] + [len(kinds)]
    return [Section(low, high, kinds[low], blocks.at(slice(low, high))) for low, high in zip(edges, edges[1:])]


def match_distance(search: BlockSearch, blocks: Candidates, delta: float) -> list[Section]:
    """Fit the travelled distance of locomotion sections to the track.

    Args:
        search: the block search.
        blocks: its result, one per slot.
        delta: m that the distance may be off, where cycles allow.
    """
    wanted, sections, travelled = search.wanted, [], 0.0
    asked = travelled_distance(wanted.track)
    for section in split(wanted, blocks):
        own = float(block_distances(search.library, section.blocks).sum())
        goal = float(asked[min(section.end * FINEST, len(asked) - 1)])
        # goal: distance of the track up to the section's end; own + travelled: what the clips have travelled by then
        missing = goal - (own + travelled)
        if section.locomotion and len(section.blocks) > 2 and abs(missing) > delta:
            section = _refilled(search, section, own + missing)
            own = float(block_distances(search.library, section.blocks).sum())
        sections.append(section)
        travelled += own
    return sections


def travelled_distance(track: SampledTrack) -> np.ndarray:
    """Compute the distance (T,) m along the smoothed track since its first frame."""
    return distance_along(track.positions)


def block_distances(library: Library, blocks: Candidates) -> np.ndarray:
    """Compute the distance (K,) m that each 8-frame block travels along its clip's path."""
    frames = library.frames
    running = distance_along(frames.path)
    last = frames.first[blocks.clip] + frames.count[blocks.clip] - 1
    low = np.clip(blocks.start, frames.first[blocks.clip], last)
    return running[np.clip(blocks.start + FINEST, low, last)] - running[low]


def _refilled(search: BlockSearch, section: Section, goal: float) -> Section:
    """Replace the inner blocks of a section so that it travels `goal` metres."""
    blocks = _locomotion_blocks(search, section)
    entry, leave = section.blocks.at([0]), section.blocks.at([-1])
    ends = float(block_distances(search.library, section.blocks.at([0, -1])).sum())
    if not len(blocks) or goal <= ends:
        return section
    inner = _cheapest_chain(search, section, blocks, goal - ends)
    chain = [entry, *([blocks.at(inner)] if len(inner) else []), leave]
    merged = Candidates(np.concatenate([c.clip for c in chain]), np.concatenate([c.start for c in chain]))
    return Section(section.first, section.end, True, merged)


def _locomotion_blocks(search: BlockSearch, section: Section) -> Candidates:
    """Select locomotion blocks that carry a label requested in the section.

    Starts lie on a grid of four frames, so that every block's own continuation is there too.
    """
    frames = search.frames
    asked = {w for slot in range(section.first, section.end) for w in search.asked_words(slot, FINEST) if w}
    wanted_words = frozenset().union(*asked) & LOCOMOTION_WORDS if asked else frozenset()
    columns = [i for i, word in enumerate(frames.vocabulary) if word in wanted_words]
    # clips with key moments are no locomotion
    keyed = np.zeros(len(frames), bool)
    for key in search.library.keys:
        keyed[frames.first[key.clip] : frames.first[key.clip] + frames.count[key.clip]] = True
    start = search.library.clusters[FINEST].start
    inside = (start - frames.first[frames.clip[start]]) % 4 == 0
    fits = inside & search.wanted.allowed[frames.clip[start]] & ~keyed[start]
    fits &= frames.words[start][:, columns].any(axis=1) & frames.words[start + FINEST - 1][:, columns].any(axis=1)
    if avoid := search.wanted.avoided_in(section.first * FINEST, section.end * FINEST):
        shown = np.append(0, np.cumsum(search.annotation.showing(avoid)))
        free = fits & (shown[start + FINEST] == shown[start])
        fits = free if free.any() else fits
    start = start[fits]
    if len(start) > MOST_BLOCKS:
        start = _evenly(start, frames.clip[start])
    return Candidates(frames.clip[start], start)


def _evenly(start: np.ndarray, clip: np.ndarray) -> np.ndarray:
    """Select at most about MAX_BLOCKS blocks, whole clips at a time, clips spread evenly."""
    clips = np.unique(clip)
    share = max(1, int(np.ceil(len(start) / MOST_BLOCKS)))
    return start[np.isin(clip, clips[::share])]


def _cheapest_chain(search: BlockSearch, section: Section, blocks: Candidates, goal: float) -> np.ndarray:
    """Find the blocks that travel `goal` metres between the section's entry and exit block, by dynamic programming.

    Source: Faustino 2024, eq. 22, 23.
    """
    alpha, size = search.alpha, FINEST // 2
    weight = (1.0 - alpha) / (search.scale * np.sqrt(size))
    step = block_distances(search.library, blocks)
    after = windows(search.frames, blocks.clip, blocks.start + FINEST, size)
    before = windows(search.frames, blocks.clip, blocks.start, size)
    first, last = section.blocks.at([0]), section.blocks.at([-1])
    from_entry = distances(windows(search.frames, first.clip, first.start + FINEST, size), before)[0]
    to_exit = weight * distances(after, windows(search.frames, last.clip, last.start, size))[:, 0]
    between = weight * distances(after, before)
    words = _words_by_distance(search, section, blocks)
    # layer n: lowest cost of a chain of n + 1 blocks that ends with each block, and the distance it travels
    total = weight * from_entry + alpha * words(np.zeros(len(blocks)), np.arange(len(blocks)))
    travelled, back, layers = step.copy(), [], []
    for layer in range(4 * (section.end - section.first) + 8):
        # distance error, and cost per block with the exit, if the chain ends here
        layers.append((np.abs(goal - travelled), (total + to_exit) / (layer + 2)))
        if np.all(travelled >= goal):
            break
        # through[i, j]: the best chain to block i, then block j
        through = total[:, None] + between
        source = np.argmin(through, axis=0)
        total = through[source, np.arange(len(source))] + alpha * words(travelled[source], np.arange(len(source)))
        travelled = travelled[source] + step
        back.append(source)
    return _read_chain(layers, back)


def _words_by_distance(search: BlockSearch, section: Section, blocks: Candidates):
    """Build a function for D of a block after `travelled` metres of the section.

    It compares with the labels requested where the track has travelled as far (the paper's AA_d over travelled
    distance).
    """
    asked = travelled_distance(search.wanted.track)
    low, high = section.first * FINEST, min(section.end * FINEST, len(asked))
    kinds = sorted({w for w in search.wanted.asked[low:high] if w is not None}, key=sorted)
    # table[kind, block]: D for each distinct set of requested labels
    table = np.stack([search.annotation.of_blocks(blocks.start, [kind] * FINEST) for kind in kinds])
    number = np.array([kinds.index(w) if w is not None else 0 for w in search.wanted.asked[low:high]])
    along = asked[low:high] - asked[low]

    def words(travelled: np.ndarray, block: np.ndarray) -> np.ndarray:
        place = np.minimum(np.searchsorted(along, travelled), len(along) - 1)
        return table[number[place], block]

    return words


def _read_chain(layers, back) -> np.ndarray:
    """Read the best chain over all layers: cheapest per block within DISTANCE_TOLERANCE metres, else nearest.

    Returns:
        Block indices in order.
    """
    error = np.stack([e for e, _ in layers])
    cost = np.stack([c for _, c in layers])
    close = error <= CLOSE
    score = np.where(close, cost, np.inf) if np.any(close) else error
    layer, block = np.unravel_index(int(np.argmin(score)), score.shape)
    chain = [int(block)]
    for source in back[:layer][::-1]:
        chain.append(int(source[chain[-1]]))
    return np.array(chain[::-1], int)
