"""The words that people and clips share, as the decision tree of Faustino's Appendix A.

A motion carries the words from a root of the tree down to a leaf ("kick low inside running"), plus modifiers ("right").
Words of a branch may be left out when asking: any clip below serves. Words that are not in the tree are welcome too, as
long as the library's annotations or the user's own list bring them.

The printed tree lost its indentation on the way into text; it is put back here so that every path reads as a movement.
Doubtful places: "with" below running and getting_up is kept as printed (its second half is lost); "ender" below
celebration is read as the end of a cut-off line and left out; bicycle stands below kick; letgo below turning's dribble.
The continuous list names dribble and turning without branches, and fall, fly and jump read as three roots.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache

from .labels import KINDS, list_labels, read_labels

SIDES = ("left", "right")
"""In the order of arrays by side."""

DIRECTIONS = ("front", "left", "back", "right")
"""Labels of the way a body goes or acts, in quarter turns counterclockwise from where it faces."""


def _tree_of(kind: str) -> dict[str, dict]:
    """A kind's root labels with the tree below each; of a root of two kinds that is in the discrete one."""
    roots = [label for label in read_labels().values() if kind in label.kinds]
    return {root.name: root.below if kind == root.kinds[-1] else {} for root in roots}


VOCABULARY: dict[str, dict] = {kind: _tree_of(kind) for kind in KINDS}
"""Faustino, Appendix A: kind -> root word -> nested words below it, from the table (`labels`)."""

TRANSITION = "transition"
"""Alone in a timeline's line: this stretch is left to continuity."""

CONTINUOUS = frozenset(VOCABULARY["continuous"])
"""Cyclic motions, annotated with a start and an end."""

DISCRETE = frozenset(VOCABULARY["discrete"]) - CONTINUOUS
"""Motions with a key moment. "turning" is in both of Faustino's lists and counts as continuous here."""

_OPPOSITE_SIDE = dict(zip(SIDES, reversed(SIDES)))


def vocabulary_words(extra: Iterable[str] = ()) -> frozenset[str]:
    """Every word of the tree, and `extra` (the library's own words, the user's list)."""
    return frozenset(word for path in _paths(VOCABULARY) for word in path[1:]) | frozenset(extra)


def swap_sides(words: Iterable[str]) -> tuple[str, ...]:
    """The words of the mirrored motion (Faustino §3.1.2): left and right change places, also inside `turn_left`."""
    return tuple("_".join(_OPPOSITE_SIDE.get(part, part) for part in word.split("_")) for word in words)


@lru_cache(maxsize=1024)
def relatives(word: str) -> frozenset[str]:
    """The words that stand above or below `word` somewhere in the tree, itself left out."""
    found: set[str] = set()
    for path in _paths(VOCABULARY):
        if word in path[1:]:
            found.update(path[1:])
    return frozenset(found - {word})


def words_below(words: Iterable[str]) -> tuple[str, ...]:
    """What the tree offers next after `words`, in the tree's order: all children of the deepest places they reach.

    A place is reached when every word on its path is among `words`: after ("kick", "low") come inside, top ...."""
    asked = set(words)
    reached = [path for path in _paths(VOCABULARY) if asked.issuperset(path[1:])]
    deepest = max((len(path) for path in reached), default=0)
    offered = dict.fromkeys(word for path in reached if len(path) == deepest for word in _at(path))
    return tuple(word for word in offered if word not in asked)


def similar_words(word: str, known: Iterable[str], count: int = 3) -> tuple[str, ...]:
    """The `count` words of `known` nearest to `word` in spelling (edit distance), at most half of its letters away."""
    ranked = sorted((edit_distance(word, other), other) for other in set(known))
    return tuple(other for distance, other in ranked[:count] if distance <= max(1, (len(word) + 1) // 2))


def edit_distance(a: str, b: str) -> int:
    """Least number of letters to insert, delete or replace that turns `a` into `b` (Levenshtein)."""
    row = list(range(len(b) + 1))
    for i, letter in enumerate(a, start=1):
        diagonal, row[0] = row[0], i
        for j, other in enumerate(b, start=1):
            diagonal, row[j] = row[j], min(row[j] + 1, row[j - 1] + 1, diagonal + (letter != other))
    return row[-1]


def nearest(words: Iterable[str], choices: Iterable[Iterable[str]], count: int = 3) -> tuple[tuple[str, ...], ...]:
    """The `count` word combinations of `choices` that come closest to `words`, best first; equal sets count once.

    Ordered by the asked words a choice lacks (one that names the action, like "kick", weighs more than all that only
    colour it), then by how many words it has that stand near the missing ones in the tree (so that "header", where
    there is none, leads to "jump"), then by words nobody asked for, then in the tree's order."""
    asked = frozenset(words)
    unique = {frozenset(choice): tuple(choice) for choice in map(tuple, choices)}
    ranked = sorted(unique, key=lambda choice: (*_distance(asked, choice), _in_tree_order(choice)))
    return tuple(unique[choice] for choice in ranked[:count])


def _distance(asked: frozenset[str], choice: frozenset[str]) -> tuple[int, int, int]:
    missing = asked - choice
    actions = asked & DISCRETE or asked & CONTINUOUS
    kin = frozenset().union(*(relatives(word) for word in missing))
    weight = len(missing) + len(asked) * len(missing & actions)
    return weight, -len(kin & (choice - asked)), len(choice - asked)


def spoken(words: Iterable[str]) -> tuple[str, ...]:
    """The words in the order in which one says them: the action, the side, how, the gait, which way."""
    return _spoken(frozenset(words))


@lru_cache(maxsize=1024)
def _spoken(words: frozenset[str]) -> tuple[str, ...]:
    sides = [word for word in SIDES if word in words]
    ways = [word for word in list_labels(group="way") if word in words]
    actions = [word for _, word in _in_tree_order(words & DISCRETE)]
    rest = [word for _, word in _in_tree_order(words - DISCRETE - {*sides, *ways})]
    return (*actions, *sides, *rest, *ways) if actions else (*rest, *ways, *sides)


def _in_tree_order(words: frozenset[str]) -> list[tuple[int, str]]:
    order = _tree_order()
    return sorted((order.get(word, len(order)), word) for word in words)


@lru_cache(maxsize=1)
def _tree_order() -> dict[str, int]:
    return {word: place for place, word in enumerate(dict.fromkeys(path[-1] for path in _paths(VOCABULARY)))}


def _paths(tree: Mapping[str, dict], above: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Every place of the tree as its path (kind, root, ... , word), parents first."""
    for word, below in tree.items():
        yield (*above, word)
        yield from _paths(below, (*above, word))


def _at(path: tuple[str, ...]) -> Mapping[str, dict]:
    """The branch below the place `path`."""
    branch: Mapping[str, dict] = VOCABULARY
    for word in path:
        branch = branch[word]
    return branch
