"""Key moments in what is shown: how each came out, and where the body may meet the ball."""

from __future__ import annotations

import numpy as np

from ...annotation import spoken
from ...annotation.ball_contact import striking_part
from ...library.library import Library
from ..search.edit_list import EditList
from ..search.footage import Shown
from ..search.wanted import Wanted, needed
from ..take import KeyResult
from .strike import Touch

OTHERWISE = 0.4
"""Seconds before and after a key moment that nothing in the library shows in which the body comes to the ball and goes
back."""


def key_results(library: Library, fps: float, order: Wanted, edit: EditList, played: Shown) -> tuple[KeyResult, ...]:
    """How every key moment of an order came out in `played`, whose frames are at `fps`."""
    return tuple(_key_result(
        library, fps, order, edit=edit, played=played, number=number,
    ) for number in range(len(order.keys)))


def _key_result(library: Library, fps: float, order: Wanted, edit: EditList, played: Shown, number: int) -> KeyResult:
    """How key moment `number` came out: where its clip's key frame is played, or what stands in for it."""
    key = order.keys[number]
    at = key.frame * fps / library.fps
    near = int(np.clip(round(at), 0, len(played.clip) - 1))
    clip, shown = int(played.clip[near]), float(played.clip_frame[near])
    placed = next((p for p in edit.keys if p.wanted == number and p.key.clip == clip), None)
    words = spoken(placed.key.words if placed else library.clips[clip].words_at(shown))
    if placed is not None:
        inside = np.flatnonzero(played.piece == played.piece[near])
        if len(inside) > 1 and np.all(np.diff(played.clip_frame[inside]) > 0):
            at = float(np.interp(placed.key.frame, played.clip_frame[inside], inside))
        shown = placed.key.frame
    source = library.clips[clip]
    instead = words if key.used_instead and not key.choices else key.used_instead
    return KeyResult(asked=key.asked, frame=at, clip=source.path, clip_frame=shown, mirrored=source.mirrored,
                     words=words, used_instead=instead)


def find_touches(library: Library, fps: float, edit: EditList, keys: tuple[KeyResult, ...]) -> tuple[Touch, ...]:
    """Where the body may meet the ball: every key moment that is played, and every one for which the library has no
    clip at all, so that something else is shown: there the asked part of that comes to the ball if it is near enough
    (a runner's head to a header). In frames at `fps`."""
    found, served = [], set()
    for placed in edit.keys:
        result = keys[placed.wanted]
        entry, leave = np.multiply(needed(library, placed.key), fps / library.fps)
        found.append(Touch(result.frame, result.words, float(entry), float(leave)))
        served.add(placed.wanted)
    alone = OTHERWISE * fps
    for number, result in enumerate(keys):
        lacks = result.used_instead is not None and number not in served and not striking_part(result.words)
        if lacks and all(abs(result.frame - touch.frame) > alone for touch in found):
            found.append(Touch(result.frame, result.asked.words, alone, alone))
    return tuple(found)
