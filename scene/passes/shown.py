"""The objects that show a passing scene: those that were made for it go, those of the user's play their own motion
again."""

from __future__ import annotations

import bpy

from ..core import channels
from ..core.set_aside import bring_back, drop
from . import held_tool
from .settings import KEPT, BeyondMocapPasser


def check(*rows: BeyondMocapPasser) -> None:
    """InputError where the body that shows a player's motion cannot be given back."""
    for row in rows:
        if row.shown is not None:
            channels.check_local(row.shown)
            channels.check_free(row.shown)


def let_go(row: BeyondMocapPasser) -> None:
    """A player's body shows the scene no more. Call `check` before."""
    body, row.shown = row.shown, None
    if body is not None:
        held_tool.remove(body)
        if body.get(KEPT):
            remove(body)
        elif row.before.kept:
            bring_back(row.before, body, KEPT)
    drop(row.before, KEPT)


def remove(thing: bpy.types.Object) -> None:
    """Take an object of ours out of the file, with what hangs on it that is ours, its data and its action."""
    for child in [child for child in thing.children if child.get(KEPT)]:
        remove(child)
    if thing.children or thing.library is not None:  # the user has tied things to it
        return
    channels.discard(thing, KEPT)
    data = thing.data
    bpy.data.objects.remove(thing)
    if data is not None and not data.users:
        bpy.data.batch_remove([data])
