"""The vocabulary as a decision tree on ten keys: the next labels, their number keys, and what the library has for them.

Digits do not move, so that users can learn them (Faustino §6.2 and Appendix A). First come the roots of the tree in its
order. After the root, 1 is left and 2 is right wherever they occur in the tree; 8 and 9 are the paces of a key moment
(standing, running) or the directions of a span (front, back); 3 to 7 are the tree's next labels. Further pages have the
remaining labels, the other modifiers, the rest of the root's branches and the library's own labels. A level may be
skipped ("kick top").

    choices = TreeChoices("moment")
    for label in ("kick", "right", "low", "top"):
        choices = choose_label(choices, label)      # digits 2, 2, 3, 5
    choices.words                                   # ("kick", "right", "low", "top")
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from .labels import list_labels
from .vocabulary import SIDES, TRANSITION, VOCABULARY, nearest, relatives, spoken, vocabulary_words

PAGE = 9
"""Number keys on one page."""

_TREES = {"moment": VOCABULARY["discrete"], "span": VOCABULARY["continuous"]}
_LAST_TWO = {"moment": list_labels(group="pace"), "span": list_labels(group="way")}
_MODIFIERS = tuple(word for word in VOCABULARY["modifier"] if word not in SIDES)
_BEHIND = {kind: tuple(word for word in _MODIFIERS if word not in last) for kind, last in _LAST_TWO.items()}
_IN_BOTH = tuple(word for word in VOCABULARY["discrete"] if word in VOCABULARY["continuous"])
_EXCLUSIVE = (frozenset(SIDES), frozenset(_LAST_TWO["moment"]), frozenset(_LAST_TWO["span"]))


@dataclass(frozen=True)
class Walk:
    """The labels chosen so far, as a path down the tree.

    Attributes:
        kind: "moment" or "span".
        steps: a label for each level of the tree, None where it was skipped.
        modifiers: chosen labels that lead no deeper (a side, a pace, a direction).
    """

    kind: str
    steps: tuple[str | None, ...] = ()
    beside: tuple[str, ...] = ()

    @property
    def words(self) -> tuple[str, ...]:
        """All chosen labels, in their usual order."""
        return spoken(word for word in (*self.steps, *self.beside) if word)


@dataclass(frozen=True)
class Held:
    """The label combinations of a library, mirrored ones included.

    Attributes:
        moments: combinations of its key moments.
        spans: combinations of its frames.
    """

    moments: tuple[frozenset[str], ...]
    spans: tuple[frozenset[str], ...]

    def of(self, kind: str) -> tuple[frozenset[str], ...]:
        """Return the combinations for key moments or spans.

        Args:
            kind: "moment" or "span".
        """
        return self.moments if kind == "moment" else self.spans


@dataclass(frozen=True, kw_only=True)
class Option:
    """A label on a number key.

    Attributes:
        word: the label.
        page: from 0.
        digit: 1 to 9.
        is_available: whether the library has it together with the labels chosen before.
        alternative: the nearest combination that the library has if it is not available; empty if none is near.
        is_chosen: whether it is among the chosen labels.
    """

    word: str
    page: int
    digit: int
    served: bool
    instead: tuple[str, ...] = ()
    chosen: bool = False


def options(walk: Walk, held: Held | None = None) -> tuple[Option, ...]:
    """List the options that can be chosen next.

    Args:
        walk: the labels chosen so far.
        available: the library's combinations; without a library every option is available.
    Returns:
        The options by page and digit.
    """
    return tuple(_option(word, place, walk, held) for place, word in enumerate(_layout(walk, held)) if word)


def pages(walk: Walk, held: Held | None = None) -> int:
    """Count the pages of options, at least 1.

    Args:
        walk: the labels chosen so far.
        available: the library's combinations, or None.
    """
    return max(1, -(-len(_layout(walk, held)) // PAGE))


def choose(walk: Walk, word: str) -> Walk:
    """Choose one more label.

    A label of the tree's next level leads down. Another label becomes a modifier and replaces its opposite (left
    replaces
    right); a modifier that is chosen again is removed.

    Args:
        walk: the labels chosen so far.
        label: the label.
    Returns:
        The new choices.
    """
    if word in walk.beside:
        return replace(walk, beside=tuple(other for other in walk.beside if other != word))
    if word in _next_words(walk) or not walk.steps:
        return replace(walk, steps=(*walk.steps, word))
    opposites = frozenset().union(*(group for group in _EXCLUSIVE if word in group))
    return replace(walk, beside=(*(other for other in walk.beside if other not in opposites), word))


def can_skip(walk: Walk) -> bool:
    """Return whether the tree has labels below the next level.

    Args:
        walk: the labels chosen so far.
    """
    return any(below for place in _places(walk) for below in place.values())


def skip(walk: Walk) -> Walk:
    """Go one level down the tree without a label of that level.

    Args:
        walk: the labels chosen so far.
    Returns:
        The new choices; the same ones if the tree has nothing below.
    """
    return replace(walk, steps=(*walk.steps, None)) if can_skip(walk) else walk


def served(walk: Walk, held: Held | None) -> bool:
    """Return whether the library has a motion with all chosen labels.

    Args:
        walk: the labels chosen so far.
        available: the library's combinations; None means True.
    """
    return held is None or _has(held, walk.kind, walk.words)


def instead_of(words: Iterable[str], kind: str, held: Held) -> tuple[str, ...]:
    """Find the library's combination nearest to some labels.

    Args:
        labels: the requested labels.
        kind: "moment" or "span".
        available: the library's combinations.
    Returns:
        The combination; empty if the library has none with any of the labels or their relatives in the tree.
    """
    asked = frozenset(words)
    near = asked.union(*(relatives(word) for word in asked))
    found = nearest(asked, [combination for combination in held.of(kind) if combination & near], 1)
    return spoken(found[0]) if found else ()


def _option(word: str, place: int, walk: Walk, held: Held | None) -> Option:
    """Build the option of a label at a position of the layout."""
    page, digit = divmod(place, PAGE)
    chosen = word in walk.words
    words = choose(walk, word).words if not chosen else walk.words
    has = held is None or word == TRANSITION or _has(held, walk.kind, words)
    return Option(word=word, page=page, digit=digit + 1, served=has,
                  instead=() if has else instead_of(words, walk.kind, held), chosen=chosen)


def _has(held: Held, kind: str, words: tuple[str, ...]) -> bool:
    asked = set(words)
    return any(asked <= combination for combination in held.of(kind))


def _layout(walk: Walk, held: Held | None) -> list[str | None]:
    """Place the labels on pages of nine; None where a digit has no function."""
    if walk.words == (TRANSITION,):
        return []
    own = _own_words(walk, held)
    # First page: the roots, with those that both trees share last.
    if not walk.steps:
        ends = _IN_BOTH if walk.kind == "moment" else (TRANSITION,)
        return [*(word for word in _TREES[walk.kind] if word not in ends), *ends, *own]
    # Later: sides on 1 and 2, tree labels on 3 to 7, the last two on 8 and 9; the rest on further pages.
    last = _LAST_TWO[walk.kind]
    below = [word for word in _next_words(walk) if word not in (*SIDES, *last)]
    room = PAGE - len(SIDES) - len(last)
    first = [*SIDES, *below[:room], *[None] * (room - len(below)), *last]
    behind = dict.fromkeys((*below[room:], *_BEHIND[walk.kind], *_elsewhere(walk), *own))
    return [*first, *(word for word in behind if word not in first)]


def _elsewhere(walk: Walk) -> list[str]:
    """List all labels of the root's branches, because users also combine across branches ("receive body high")."""
    tree = _TREES[walk.kind]
    roots = tree.values() if walk.steps[0] is None else [tree.get(walk.steps[0], {})]
    gone = {word for word in walk.steps if word}
    return [word for branch in roots for word in _words_of(branch) if word not in gone]


def _words_of(branch: Mapping[str, dict]) -> list[str]:
    """Collect all labels of a branch, each once."""
    return list(dict.fromkeys(word for name, below in branch.items() for word in (name, *_words_of(below))))


def _own_words(walk: Walk, held: Held | None) -> list[str]:
    """List the library's labels that are not in the tree, from the combinations with the chosen root."""
    if held is None:
        return []
    root = {walk.steps[0]} - {None} if walk.steps else set()
    words = frozenset().union(*(combination for combination in held.of(walk.kind) if root <= combination))
    return sorted(words - vocabulary_words() - root)


def _next_words(walk: Walk) -> tuple[str, ...]:
    """List the tree's labels below the branches that the choices reach, in the tree's order."""
    return tuple(dict.fromkeys(word for place in _places(walk) for word in place))


def _places(walk: Walk) -> list[Mapping[str, dict]]:
    """Find the branches of the tree that the chosen steps lead to; none after a label outside the tree."""
    places: list[Mapping[str, dict]] = [_TREES[walk.kind]]
    for step in walk.steps:
        below = (place.items() for place in places)
        places = [branch for items in below for word, branch in items if step in (None, word)]
    return places
