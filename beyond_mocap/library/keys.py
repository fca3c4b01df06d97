"""Key moments: which clips carry the requested labels at their key frame, and which are nearest where none does.

"The library has a key moment when one clip's key frame, or its mirror's, carries all of its words"
(../shared/contract.md); labels of a branch of the vocabulary may be left out, so carrying means being a superset.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ..annotation import CONTINUOUS, DISCRETE, VOCABULARY, nearest, spoken
from ..annotation.ball_contact import shows_foot_on_ball
from ..annotation.labels import list_labels
from ..annotation.vocabulary import SIDES

# labels of App. A below several actions that name what the body does: a dive is a dive, whether to catch or to punch
_SAME_MOVE = frozenset(list_labels(in_flight=True))
_SIDES = frozenset(SIDES)


@dataclass(frozen=True)
class Key:
    """A key moment of a clip.

    Attributes:
        clip: clip index.
        frame: in the clip's own rate.
        start, end: first and last frame of its annotated row (the entry and exit that it needs).
        labels: labels that the frame carries.
    """

    clip: int
    frame: float
    start: float
    end: float
    words: frozenset[str]


def keys_of(clips) -> tuple[Key, ...]:
    """Collect the key moments of all clips, in their order.

    A key's labels are its row's and those of every other row that covers its frame, except for their sides: a kick with
    the
    right foot while the body turns left is no left kick.
    """
    found = []
    for index, clip in enumerate(clips):
        for row in clip.annotations:
            if row.key is not None:
                found.append(Key(index, float(row.key), float(row.start), float(row.end), _key_words(clip, row)))
    return tuple(found)


def _key_words(clip, row) -> frozenset[str]:
    """Collect the labels of a clip at the key frame of a row."""
    others = (other.words for other in clip.annotations if other is not row and other.start <= row.key <= other.end)
    return frozenset(row.words) | (frozenset(word for words in others for word in words) - _SIDES)


def serving(keys: Iterable[Key], words) -> tuple[Key, ...]:
    """Select the keys that carry all requested labels, and of these the ones with the fewest other actions.

    A dive is also a jump, but a requested jump should be no dive where there is another.

    Args:
        keys: of the library.
        words: requested labels.
    Returns:
        The keys; empty where none serves.
    """
    wanted = frozenset(words)
    found = [key for key in keys if wanted <= key.words]
    others = [len((key.words & (DISCRETE | _SAME_MOVE)) - wanted) for key in found]
    return tuple(key for key, count in zip(found, others) if count == min(others))


def nearest_serving(keys: tuple[Key, ...], words) -> tuple[Key, ...]:
    """Select the keys whose labels are nearest to the requested ones: most shared labels, then fewest extra ones.

    None where the action itself is not shared (a kick is no answer to a slide, and a right kick none to a right
    header),
    except that any foot on the ball can replace a foot on the ball, and a dive a dive.

    Args:
        keys: of the library.
        words: requested labels.
    Returns:
        The keys; empty where none is near.
    """
    wanted = frozenset(words)
    actions = _actions(wanted) | (wanted & _SAME_MOVE)
    near = [key for key in keys if actions & key.words or _same_contact(wanted, key.words)]
    scores = [(len(wanted & key.words) + _same_contact(wanted, key.words), -len(key.words - wanted)) for key in near]
    return tuple(key for key, score in zip(near, scores) if score == max(scores))


def _actions(words: frozenset[str]) -> frozenset[str]:
    """Select the labels of what is done, not which side or pace: roots of App. A, else all but modifiers."""
    return words & DISCRETE or words - CONTINUOUS - VOCABULARY["modifier"].keys() or words


def _same_contact(a: frozenset[str], b: frozenset[str]) -> float:
    """Score half a label if both show a foot on the ball."""
    return 0.5 if shows_foot_on_ball(a) and shows_foot_on_ball(b) else 0.0


def standing_in(choices: tuple[Key, ...], made: tuple[Key, ...], words) -> tuple[Key, ...]:
    """Select the synthetic key moments that may substitute for recorded ones.

    They show the same act of the same side, with all of the requested labels that a recorded one carries.

    Args:
        choices: recorded keys that answer to `words`.
        synthetic: synthetic keys.
        words: requested labels.
    Returns:
        The substitutes.
    """
    wanted = frozenset(words)
    met = {(_act(one), wanted & one.words) for one in choices}
    return tuple(key for key in made if any(act == _act(key) and asked <= key.words for act, asked in met))


def _act(key: Key) -> frozenset[str]:
    return key.words & (DISCRETE | _SIDES)


def nearest_words(keys: tuple[Key, ...], words, count: int = 3) -> tuple[str, ...]:
    """List the label combinations of the library's key moments nearest to `words`, as text, best first."""
    choices = sorted({spoken(key.words) for key in keys})
    return tuple(" ".join(choice) for choice in nearest(tuple(words), choices, count))
