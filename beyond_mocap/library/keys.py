"""Key moments: which clips carry the requested labels at their key frame, and which are nearest where none does.

A library has a key moment when one clip's key frame, or its mirror image's, carries all of its labels. Labels of a
branch of the vocabulary may be left out, so carrying means being a superset.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..annotation import CONTINUOUS, DISCRETE, VOCABULARY, find_nearest_labels, sort_labels
from ..annotation.ball_contact import shows_foot_on_ball, takes_and_sends
from ..annotation.labels import list_labels
from ..annotation.vocabulary import SIDES

# labels of App. A below several actions that name what the body does: a dive is a dive, whether to catch or to punch
_SAME_MOVE = frozenset(list_labels(in_flight=True))
_SIDES = frozenset(SIDES)
_KICK = "kick"
KICK_STEP = 1.3
"""Factor on the fastest recorded kick's speed from which on kicks are synthetic."""


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
    labels: frozenset[str]


def measure_kick_speed(frames, clips: Sequence, keys: Sequence) -> float:
    """Measure the fastest approach of a kick.

    Args:
        frames: of the library.
        clips: of the library.
        keys: its key moments.
    Returns:
        m/s; infinite without any kick.
    """
    found = [
        frames.speed[frames.find_nearest(key.clip, key.frame, clips[key.clip].motion.fps)]
        for key in keys if _KICK in key.labels and not clips[key.clip].is_synthetic
    ]
    return float(max(found)) if found else np.inf


def collect_keys(clips) -> tuple[Key, ...]:
    """Collect the key moments of all clips, in their order.

    A key's labels are its row's and those of every other row that covers its frame, except for their sides: a kick with
    the right foot while the body turns left is no left kick.
    """
    found = []
    for index, clip in enumerate(clips):
        for row in clip.annotations:
            if row.key is not None:
                found.append(Key(index, float(row.key), float(row.start), float(row.end),
                                 _collect_key_labels(clip, row)))
    return tuple(found)


def _collect_key_labels(clip, row) -> frozenset[str]:
    """Collect the labels of a clip at the key frame of a row."""
    others = (other.words for other in clip.annotations if other is not row and other.start <= row.key <= other.end)
    return frozenset(row.words) | (frozenset(word for words in others for word in words) - _SIDES)


def select_keys(keys: Iterable[Key], words) -> tuple[Key, ...]:
    """Select the keys that carry all requested labels, and of these the ones with the fewest other actions.

    A dive is also a jump, but a requested jump should be no dive where there is another.

    Args:
        keys: of the library.
        words: requested labels.
    Returns:
        The keys; empty where none serves.
    """
    requested = frozenset(words)
    found = [key for key in keys if requested <= key.labels]
    others = [len((key.labels & (DISCRETE | _SAME_MOVE)) - requested) for key in found]
    return tuple(key for key, count in zip(found, others) if count == min(others))


def select_nearest_keys(keys: tuple[Key, ...], words) -> tuple[Key, ...]:
    """Select the keys whose labels are nearest to the requested ones: most shared labels, then fewest extra ones.

    None where the action itself is not shared (a kick is no answer to a slide, and a right kick none to a right
    header), except that any foot on the ball can replace a foot on the ball, and a dive a dive. What takes the ball is
    never replaced by what sends it, nor the other way round.

    Args:
        keys: of the library.
        words: requested labels.
    Returns:
        The keys; empty where none is near.
    """
    requested = frozenset(words)
    actions = _select_actions(requested) | (requested & _SAME_MOVE)
    near = [key for key in keys if (actions & key.labels or _score_same_contact(requested, key.labels))
            and not takes_and_sends(requested, key.labels)]
    scores = [(len(requested & key.labels) + _score_same_contact(requested, key.labels), -len(key.labels - requested))
              for key in near]
    return tuple(key for key, score in zip(near, scores) if score == max(scores))


def _select_actions(words: frozenset[str]) -> frozenset[str]:
    """Select the labels of what is done, not which side or pace: roots of App. A, else all but modifiers."""
    return words & DISCRETE or words - CONTINUOUS - VOCABULARY["modifier"].keys() or words


def _score_same_contact(a: frozenset[str], b: frozenset[str]) -> float:
    """Score half a label if both show a foot on the ball."""
    return 0.5 if shows_foot_on_ball(a) and shows_foot_on_ball(b) else 0.0


def select_substitutes(choices: tuple[Key, ...], synthetic: tuple[Key, ...], words) -> tuple[Key, ...]:
    """Select the synthetic key moments that may substitute for recorded ones.

    They show the same act of the same side, with all of the requested labels that a recorded one carries.

    Args:
        choices: recorded keys that answer to `words`.
        synthetic: synthetic keys.
        words: requested labels.
    Returns:
        The substitutes.
    """
    requested = frozenset(words)
    substituted = {(_select_act(one), requested & one.labels) for one in choices}
    return tuple(key for key in synthetic if any(act == _select_act(key) and labels <= key.labels for act,
                                                 labels in substituted))


def _select_act(key: Key) -> frozenset[str]:
    return key.labels & (DISCRETE | _SIDES)


def list_nearest_labels(keys: tuple[Key, ...], words, count: int = 3) -> tuple[str, ...]:
    """List the label combinations of the library's key moments nearest to `words`, as text, best first."""
    choices = sorted({sort_labels(key.labels) for key in keys})
    return tuple(" ".join(choice) for choice in find_nearest_labels(tuple(words), choices, count))
