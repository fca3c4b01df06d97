"""The labels that users and clips share, as the decision tree of Faustino's Appendix A.

A motion has the labels from a root of the tree down to a leaf ("kick low inside running"), plus modifiers ("right").
A request may leave out labels of a branch: any clip below it serves. Labels outside the tree are allowed if the
library's annotations or the user's own list have them.

The printed tree lost its indentation in the text extraction; it is restored here so that every path is a plausible
movement. Doubtful places: "with" below running and getting_up is kept as printed (its second half is lost); "ender"
below celebration is read as the end of a cut-off line and left out; bicycle is placed below kick, letgo below turning's
dribble. The continuous list names dribble and turning without branches, and fall, fly and jump read as three roots.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache, lru_cache

from .labels import KINDS, list_labels, read_labels

SIDES = ("left", "right")
"""Sides in the order of arrays by side."""

DIRECTIONS = ("front", "left", "back", "right")
"""Labels of the direction of a body's motion or action, in quarter turns counterclockwise from its heading."""


def _build_tree(kind: str) -> dict[str, dict]:
    """Build a kind's root labels with the tree below each; a root of two kinds has its tree in the discrete one."""
    roots = [label for label in read_labels().values() if kind in label.kinds]
    return {root.name: root.below if kind == root.kinds[-1] else {} for root in roots}


VOCABULARY: dict[str, dict] = {kind: _build_tree(kind) for kind in KINDS}
"""Faustino, Appendix A: kind -> root label -> nested labels below it, from the table (`labels`)."""

TRANSITION = "transition"
"""Alone in a timeline's line: continuity alone decides this span."""

CONTINUOUS = frozenset(VOCABULARY["continuous"])
"""Cyclic motions, annotated with a start and an end."""

DISCRETE = frozenset(VOCABULARY["discrete"]) - CONTINUOUS
"""Motions with a key moment. "turning" is in both of Faustino's lists and counts as continuous here."""

_OPPOSITE_SIDE = dict(zip(SIDES, reversed(SIDES)))


def list_vocabulary(extra: Iterable[str] = ()) -> frozenset[str]:
    """Collect every label of the tree.

    Args:
        extra: further labels (the library's own, the user's list).
    Returns:
        All labels.
    """
    return frozenset(word for path in _iter_paths(VOCABULARY) for word in path[1:]) | frozenset(extra)


def swap_sides(labels: Iterable[str]) -> tuple[str, ...]:
    """Exchange left and right, also inside labels such as `turn_left`.

    Args:
        labels: the labels of a motion.
    Returns:
        The labels of the mirrored motion.
    Source: Faustino 2016, section 3.1.2.
    """
    return tuple("_".join(_OPPOSITE_SIDE.get(part, part) for part in label.split("_")) for label in labels)


@lru_cache(maxsize=1024)
def find_relatives(label: str) -> frozenset[str]:
    """Find the labels above or below a label anywhere in the tree.

    Args:
        label: the label.
    Returns:
        Its relatives, without itself.
    """
    related: set[str] = set()
    for path in _iter_paths(VOCABULARY):
        if label in path[1:]:
            related.update(path[1:])
    return frozenset(related - {label})


def list_labels_below(labels: Iterable[str]) -> tuple[str, ...]:
    """List the labels that the tree offers next: all children of the deepest positions that the labels reach.

    The labels reach a position if they include every label on its path: after ("kick", "low") come inside, top ....

    Args:
        labels: the labels so far.
    Returns:
        The next labels, in the tree's order.
    """
    requested = set(labels)
    reached = [path for path in _iter_paths(VOCABULARY) if requested.issuperset(path[1:])]
    deepest = max((len(path) for path in reached), default=0)
    next_labels = dict.fromkeys(word for path in reached if len(path) == deepest for word in _find_branch(path))
    return tuple(word for word in next_labels if word not in requested)


def find_similar_labels(label: str, known: Iterable[str], count: int = 3) -> tuple[str, ...]:
    """Find the labels with the most similar spelling (edit distance), at most half of the letters different.

    Args:
        label: the label as written.
        known: the labels to choose from.
        count: number of labels at most.
    Returns:
        The labels, nearest first.
    """
    ranked = sorted((compute_edit_distance(label, other), other) for other in set(known))
    return tuple(other for distance, other in ranked[:count] if distance <= max(1, (len(label) + 1) // 2))


def find_meant_label(label: str, known: Iterable[str]) -> str | None:
    """Find the label that a misspelled one probably means: one letter differs, or two neighbours are exchanged.

    Args:
        label: the label as written; one of fewer than four letters is too short to tell.
        known: the labels to choose from.
    Returns:
        The label; None if `label` is known, or none is so similar.
    """
    known = set(known)
    if label in known or len(label) < 4:
        return None
    exchanged = {label[:i] + label[i + 1] + label[i] + label[i + 2:] for i in range(len(label) - 1)}
    near = (other for other in sorted(known) if other in exchanged or compute_edit_distance(label, other) == 1)
    return next(near, None)


def find_labels_of_part(label: str, known: Iterable[str], count: int = 3) -> tuple[str, ...]:
    """Find the labels that bring the same part of the body to the ball: "chest" leads to "body", "trap" to "receive".

    Args:
        label: a label of the table.
        known: the labels to choose from.
        count: number of labels at most.
    Returns:
        The labels, those that do the same with the ball first, then roots, then the table's order.
    """
    rows = read_labels()
    wanted, offered = rows[label], set(known)
    same = [row for name, row in rows.items() if name in offered and row.parts and row.parts == wanted.parts]
    same.sort(key=lambda row: (row.ball != wanted.ball, not row.is_root))
    return tuple(row.name for row in same[:count])


def compute_edit_distance(a: str, b: str) -> int:
    """Count the letters to insert, delete or replace at least to turn `a` into `b` (Levenshtein distance).

    Args:
        a, b: any texts.
    Returns:
        The distance.
    """
    # One row of the table of distances: row[j] is the distance of a[:i] to b[:j]; `diagonal` is the entry for a[:i - 1]
    # and b[:j - 1].
    row = list(range(len(b) + 1))
    for i, letter in enumerate(a, start=1):
        diagonal, row[0] = row[0], i
        for j, other in enumerate(b, start=1):
            diagonal, row[j] = row[j], min(row[j] + 1, row[j - 1] + 1, diagonal + (letter != other))
    return row[-1]


def find_nearest_labels(labels: Iterable[str], choices: Iterable[Iterable[str]],
                        count: int = 3) -> tuple[tuple[str, ...], ...]:
    """Find the label combinations nearest to the requested labels; equal sets count once.

    They are ordered by the requested labels that a combination lacks (a label that names the action, like "kick",
    weighs more than all modifiers together), then by how many labels it has that are related to the missing ones in the
    tree (so that "header", if there is none, leads to "jump"), then by labels that were not requested, then by the
    tree's order.

    Args:
        labels: the requested labels.
        choices: the combinations to choose from.
        count: number of combinations at most.
    Returns:
        The combinations, best first.
    """
    requested = frozenset(labels)
    unique = {frozenset(choice): tuple(choice) for choice in map(tuple, choices)}
    ranked = sorted(unique, key=lambda choice: (*_compute_distance(requested, choice), _rank_in_tree(choice)))
    return tuple(unique[choice] for choice in ranked[:count])


def _compute_distance(requested: frozenset[str], choice: frozenset[str]) -> tuple[int, int, int]:
    """Compute the sort key of a combination: weighted missing labels, related labels (negative), extra labels."""
    missing = requested - choice
    actions = requested & DISCRETE or requested & CONTINUOUS
    related = frozenset().union(*(find_relatives(word) for word in missing))
    weight = len(missing) + len(requested) * len(missing & actions)
    return weight, -len(related & (choice - requested)), len(choice - requested)


def sort_labels(labels: Iterable[str]) -> tuple[str, ...]:
    """Sort labels into their usual order: action, side, manner, gait, direction.

    Args:
        labels: the labels of a motion.
    Returns:
        The sorted labels.
    """
    return _sort_labels(frozenset(labels))


@lru_cache(maxsize=1024)
def _sort_labels(labels: frozenset[str]) -> tuple[str, ...]:
    sides = [word for word in SIDES if word in labels]
    directions = [word for word in list_labels(group="way") if word in labels]
    actions = [word for word in VOCABULARY["discrete"] if word in labels]
    rest = [word for _, word in _rank_in_tree(labels - DISCRETE - {*sides, *directions})]
    return (*actions, *sides, *rest, *directions) if actions else (*rest, *directions, *sides)


def _rank_in_tree(labels: frozenset[str]) -> list[tuple[int, str]]:
    """Rank labels by where the tree names them first."""
    order = _build_tree_order()
    return sorted((order.get(word, len(order)), word) for word in labels)


@cache
def _build_tree_order() -> dict[str, int]:
    return {word: place for place, word in enumerate(dict.fromkeys(path[-1] for path in _iter_paths(VOCABULARY)))}


def _iter_paths(tree: Mapping[str, dict], above: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Iterate over every position of the tree as its path (kind, root, ..., label), parents first."""
    for word, below in tree.items():
        yield (*above, word)
        yield from _iter_paths(below, (*above, word))


def _find_branch(path: tuple[str, ...]) -> Mapping[str, dict]:
    """Find the branch below the position `path`."""
    branch: Mapping[str, dict] = VOCABULARY
    for word in path:
        branch = branch[word]
    return branch
