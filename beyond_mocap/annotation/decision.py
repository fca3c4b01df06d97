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
from .vocabulary import SIDES, TRANSITION, VOCABULARY, find_nearest_labels, find_relatives, list_vocabulary, sort_labels

PAGE_SIZE = 9
"""Number keys on one page."""

_TREES = {"moment": VOCABULARY["discrete"], "span": VOCABULARY["continuous"]}
_LAST_TWO = {"moment": list_labels(group="pace"), "span": list_labels(group="way")}
_MODIFIERS = tuple(word for word in VOCABULARY["modifier"] if word not in SIDES)
_MORE_MODIFIERS = {kind: tuple(word for word in _MODIFIERS if word not in last) for kind, last in _LAST_TWO.items()}
_SHARED_ROOTS = tuple(word for word in VOCABULARY["discrete"] if word in VOCABULARY["continuous"])
_EXCLUSIVE = (frozenset(SIDES), frozenset(_LAST_TWO["moment"]), frozenset(_LAST_TWO["span"]))


@dataclass(frozen=True)
class TreeChoices:
    """The labels chosen so far, as a path down the tree.

    Attributes:
        kind: "moment" or "span".
        steps: a label for each level of the tree, None where it was skipped.
        modifiers: chosen labels that lead no deeper (a side, a pace, a direction).
    """

    kind: str
    steps: tuple[str | None, ...] = ()
    modifiers: tuple[str, ...] = ()

    @property
    def words(self) -> tuple[str, ...]:
        """All chosen labels, in their usual order."""
        return sort_labels(word for word in (*self.steps, *self.modifiers) if word)


@dataclass(frozen=True)
class LibraryCombinations:
    """The label combinations of a library, mirrored ones included.

    Attributes:
        moments: combinations of its key moments.
        spans: combinations of its frames.
    """

    moments: tuple[frozenset[str], ...]
    spans: tuple[frozenset[str], ...]

    def list_combinations(self, kind: str) -> tuple[frozenset[str], ...]:
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
    is_available: bool
    alternative: tuple[str, ...] = ()
    is_chosen: bool = False


def list_options(walk: TreeChoices, available: LibraryCombinations | None = None) -> tuple[Option, ...]:
    """List the options that can be chosen next.

    Args:
        walk: the labels chosen so far.
        available: the library's combinations; without a library every option is available.
    Returns:
        The options by page and digit.
    """
    return tuple(_build_option(label, place, walk, available) for place,
                 label in enumerate(_place_labels(walk, available)) if label)


def count_pages(walk: TreeChoices, available: LibraryCombinations | None = None) -> int:
    """Count the pages of options, at least 1.

    Args:
        walk: the labels chosen so far.
        available: the library's combinations, or None.
    """
    return max(1, -(-len(_place_labels(walk, available)) // PAGE_SIZE))


def choose_label(walk: TreeChoices, label: str) -> TreeChoices:
    """Choose one more label.

    A label of the tree's next level leads down. Another label becomes a modifier and replaces its opposite (left
    replaces right); a modifier that is chosen again is removed.

    Args:
        walk: the labels chosen so far.
        label: the label.
    Returns:
        The new choices.
    """
    if label in walk.modifiers:
        return replace(walk, modifiers=tuple(other for other in walk.modifiers if other != label))
    if label in _list_next_labels(walk) or not walk.steps:
        return replace(walk, steps=(*walk.steps, label))
    opposites = frozenset().union(*(group for group in _EXCLUSIVE if label in group))
    return replace(walk, modifiers=(*(other for other in walk.modifiers if other not in opposites), label))


def can_skip(walk: TreeChoices) -> bool:
    """Return whether the tree has labels below the next level.

    Args:
        walk: the labels chosen so far.
    """
    return any(below for place in _find_branches(walk) for below in place.values())


def skip_level(walk: TreeChoices) -> TreeChoices:
    """Go one level down the tree without a label of that level.

    Args:
        walk: the labels chosen so far.
    Returns:
        The new choices; the same ones if the tree has nothing below.
    """
    return replace(walk, steps=(*walk.steps, None)) if can_skip(walk) else walk


def is_available(walk: TreeChoices, available: LibraryCombinations | None) -> bool:
    """Return whether the library has a motion with all chosen labels.

    Args:
        walk: the labels chosen so far.
        available: the library's combinations; None means True.
    """
    return available is None or _has_combination(available, walk.kind, walk.words)


def find_alternative(labels: Iterable[str], kind: str, available: LibraryCombinations) -> tuple[str, ...]:
    """Find the library's combination nearest to some labels.

    Args:
        labels: the requested labels.
        kind: "moment" or "span".
        available: the library's combinations.
    Returns:
        The combination; empty if the library has none with any of the labels or their relatives in the tree.
    """
    requested = frozenset(labels)
    related = requested.union(*(find_relatives(word) for word in requested))
    found = find_nearest_labels(requested, [combination for combination in available.list_combinations(kind)
                                            if combination & related], 1)
    return sort_labels(found[0]) if found else ()


def _build_option(word: str, place: int, walk: TreeChoices, available: LibraryCombinations | None) -> Option:
    """Build the option of a label at a position of the layout."""
    page, digit = divmod(place, PAGE_SIZE)
    chosen = word in walk.words
    words = choose_label(walk, word).words if not chosen else walk.words
    is_held = available is None or word == TRANSITION or _has_combination(available, walk.kind, words)
    return Option(word=word, page=page, digit=digit + 1, is_available=is_held,
                  alternative=() if is_held else find_alternative(words, walk.kind, available), is_chosen=chosen)


def _has_combination(available: LibraryCombinations, kind: str, words: tuple[str, ...]) -> bool:
    requested = set(words)
    return any(requested <= combination for combination in available.list_combinations(kind))


def _place_labels(walk: TreeChoices, available: LibraryCombinations | None) -> list[str | None]:
    """Place the labels on pages of nine; None where a digit has no function."""
    if walk.words == (TRANSITION,):
        return []
    library_labels = _list_library_labels(walk, available)
    # First page: the roots, with those that both trees share last.
    if not walk.steps:
        ends = _SHARED_ROOTS if walk.kind == "moment" else (TRANSITION,)
        return [*(word for word in _TREES[walk.kind] if word not in ends), *ends, *library_labels]
    # Later: sides on 1 and 2, tree labels on 3 to 7, the last two on 8 and 9; the rest on further pages.
    last = _LAST_TWO[walk.kind]
    next_labels = [word for word in _list_next_labels(walk) if word not in (*SIDES, *last)]
    room = PAGE_SIZE - len(SIDES) - len(last)
    first = [*SIDES, *next_labels[:room], *[None] * (room - len(next_labels)), *last]
    more = dict.fromkeys((*next_labels[room:], *_MORE_MODIFIERS[walk.kind], *_list_branch_labels(walk),
                          *library_labels))
    return [*first, *(word for word in more if word not in first)]


def _list_branch_labels(walk: TreeChoices) -> list[str]:
    """List all labels of the root's branches, because users also combine across branches ("receive body high")."""
    tree = _TREES[walk.kind]
    roots = tree.values() if walk.steps[0] is None else [tree.get(walk.steps[0], {})]
    used = {word for word in walk.steps if word}
    return [word for branch in roots for word in _collect_labels(branch) if word not in used]


def _collect_labels(branch: Mapping[str, dict]) -> list[str]:
    """Collect all labels of a branch, each once."""
    return list(dict.fromkeys(word for name, below in branch.items() for word in (name, *_collect_labels(below))))


def _list_library_labels(walk: TreeChoices, available: LibraryCombinations | None) -> list[str]:
    """List the library's labels that are not in the tree, from the combinations with the chosen root."""
    if available is None:
        return []
    root = {walk.steps[0]} - {None} if walk.steps else set()
    labels = frozenset().union(*(combination for combination in available.list_combinations(walk.kind) if root
                                 <= combination))
    return sorted(labels - list_vocabulary() - root)


def _list_next_labels(walk: TreeChoices) -> tuple[str, ...]:
    """List the tree's labels below the branches that the choices reach, in the tree's order."""
    return tuple(dict.fromkeys(word for place in _find_branches(walk) for word in place))


def _find_branches(walk: TreeChoices) -> list[Mapping[str, dict]]:
    """Find the branches of the tree that the chosen steps lead to; none after a label outside the tree."""
    branches: list[Mapping[str, dict]] = [_TREES[walk.kind]]
    for step in walk.steps:
        below = (place.items() for place in branches)
        branches = [branch for items in below for word, branch in items if step in (None, word)]
    return branches
