"""The vocabulary as a decision tree for ten fingers: which words come next, on which number key, and what the library
has of them (Faustino §6.2 and Appendix A).

Digits never move, so that fingers learn them. First come the roots of the tree in its order. After the root 1 is left
and 2 is right wherever one is in the tree, 8 and 9 are the paces of a key moment (standing, running) or the ways of a
stretch (front, back), and 3 to 7 are the tree's next words; what has no room follows on further pages, with the other
modifiers, the rest of the root's branches and the library's own words behind. A level may be skipped ("kick top").

    walk = Walk("moment")
    for word in ("kick", "right", "low", "top"):
        walk = choose(walk, word)       # digits 2, 2, 3, 5
    walk.words                          # ("kick", "right", "low", "top")
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from .labels import list_labels
from .vocabulary import SIDES, TRANSITION, VOCABULARY, nearest, relatives, spoken, vocabulary_words

PAGE = 9
"""Number keys of one page."""

_TREES = {"moment": VOCABULARY["discrete"], "span": VOCABULARY["continuous"]}
_LAST_TWO = {"moment": list_labels(group="pace"), "span": list_labels(group="way")}
_MODIFIERS = tuple(word for word in VOCABULARY["modifier"] if word not in SIDES)
_BEHIND = {kind: tuple(word for word in _MODIFIERS if word not in last) for kind, last in _LAST_TWO.items()}
_IN_BOTH = tuple(word for word in VOCABULARY["discrete"] if word in VOCABULARY["continuous"])
_EXCLUSIVE = (frozenset(SIDES), frozenset(_LAST_TWO["moment"]), frozenset(_LAST_TWO["span"]))


@dataclass(frozen=True)
class Walk:
    """A way down the tree. kind: "moment" or "span". steps: a word for each level gone down, None where it was skipped.
    beside: words chosen that lead no deeper (a side, a pace, a way)."""

    kind: str
    steps: tuple[str | None, ...] = ()
    beside: tuple[str, ...] = ()

    @property
    def words(self) -> tuple[str, ...]:
        """All chosen words, in the order in which one says them."""
        return spoken(word for word in (*self.steps, *self.beside) if word)


@dataclass(frozen=True)
class Held:
    """What a library holds: the word combinations of its key moments and of its frames, with mirrored ones."""

    moments: tuple[frozenset[str], ...]
    spans: tuple[frozenset[str], ...]

    def of(self, kind: str) -> tuple[frozenset[str], ...]:
        """The combinations for key moments or stretches."""
        return self.moments if kind == "moment" else self.spans


@dataclass(frozen=True, kw_only=True)
class Option:
    """A word on a number key. page from 0, digit 1 to 9. served: whether the library has it together with the words
    chosen before. instead: the nearest combination that it has, where it has not; empty where nothing comes near.
    chosen: whether it is among the chosen words already."""

    word: str
    page: int
    digit: int
    served: bool
    instead: tuple[str, ...] = ()
    chosen: bool = False


def options(walk: Walk, held: Held | None = None) -> tuple[Option, ...]:
    """What can be chosen next, by page and digit. held: None without a library; then nothing is missing."""
    return tuple(_option(word, place, walk, held) for place, word in enumerate(_layout(walk, held)) if word)


def pages(walk: Walk, held: Held | None = None) -> int:
    """On how many pages the options stand, at least 1."""
    return max(1, -(-len(_layout(walk, held)) // PAGE))


def choose(walk: Walk, word: str) -> Walk:
    """The walk with one more word. A word of the tree's next level goes down; another stands beside, in place of its
    opposite (left for right); one that stands there already is taken away."""
    if word in walk.beside:
        return replace(walk, beside=tuple(other for other in walk.beside if other != word))
    if word in _next_words(walk) or not walk.steps:
        return replace(walk, steps=(*walk.steps, word))
    opposites = frozenset().union(*(group for group in _EXCLUSIVE if word in group))
    return replace(walk, beside=(*(other for other in walk.beside if other not in opposites), word))


def can_skip(walk: Walk) -> bool:
    """Whether words stand below the level that comes next."""
    return any(below for place in _places(walk) for below in place.values())


def skip(walk: Walk) -> Walk:
    """The walk one level further down without a word of that level; itself where nothing stands below."""
    return replace(walk, steps=(*walk.steps, None)) if can_skip(walk) else walk


def served(walk: Walk, held: Held | None) -> bool:
    """Whether the library has something with all words of the walk; True where no library is built."""
    return held is None or _has(held, walk.kind, walk.words)


def instead_of(words: Iterable[str], kind: str, held: Held) -> tuple[str, ...]:
    """The library's combination nearest to `words`, empty where it has none with any of them or their kin."""
    asked = frozenset(words)
    near = asked.union(*(relatives(word) for word in asked))
    found = nearest(asked, [combination for combination in held.of(kind) if combination & near], 1)
    return spoken(found[0]) if found else ()


def _option(word: str, place: int, walk: Walk, held: Held | None) -> Option:
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
    """Words by place: nine to a page, None where a digit means nothing."""
    if walk.words == (TRANSITION,):
        return []
    own = _own_words(walk, held)
    if not walk.steps:
        ends = _IN_BOTH if walk.kind == "moment" else (TRANSITION,)
        return [*(word for word in _TREES[walk.kind] if word not in ends), *ends, *own]
    last = _LAST_TWO[walk.kind]
    below = [word for word in _next_words(walk) if word not in (*SIDES, *last)]
    room = PAGE - len(SIDES) - len(last)
    first = [*SIDES, *below[:room], *[None] * (room - len(below)), *last]
    behind = dict.fromkeys((*below[room:], *_BEHIND[walk.kind], *_elsewhere(walk), *own))
    return [*first, *(word for word in behind if word not in first)]


def _elsewhere(walk: Walk) -> list[str]:
    """All words of the root's branches: what one says across them ("receive body high") can be said too."""
    tree = _TREES[walk.kind]
    roots = tree.values() if walk.steps[0] is None else [tree.get(walk.steps[0], {})]
    gone = {word for word in walk.steps if word}
    return [word for branch in roots for word in _words_of(branch) if word not in gone]


def _words_of(branch: Mapping[str, dict]) -> list[str]:
    return list(dict.fromkeys(word for name, below in branch.items() for word in (name, *_words_of(below))))


def _own_words(walk: Walk, held: Held | None) -> list[str]:
    """The library's words that are not in the tree, of what it has with the walk's root."""
    if held is None:
        return []
    root = {walk.steps[0]} - {None} if walk.steps else set()
    words = frozenset().union(*(combination for combination in held.of(walk.kind) if root <= combination))
    return sorted(words - vocabulary_words() - root)


def _next_words(walk: Walk) -> tuple[str, ...]:
    """The tree's words below the places that the walk has reached, in its order."""
    return tuple(dict.fromkeys(word for place in _places(walk) for word in place))


def _places(walk: Walk) -> list[Mapping[str, dict]]:
    """The branches of the tree that the walk's steps lead to; none behind a word that is not in the tree."""
    places: list[Mapping[str, dict]] = [_TREES[walk.kind]]
    for step in walk.steps:
        below = (place.items() for place in places)
        places = [branch for items in below for word, branch in items if step in (None, word)]
    return places
