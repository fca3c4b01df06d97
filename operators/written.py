"""Results written into the scene: the take is kept and shown, and what goes with it is renewed."""

from __future__ import annotations

import json

from ..beyond_mocap.annotation import Timeline
from ..scene import dots, freshness, preview, quality, session, strips, variants
from .build_library import summary


def written(context, player, order, result) -> None:
    """Keep the takes of a result in the session, show the first of them, and renew what goes with it."""
    session.keep_library(result.library, order.unit)
    context.scene.beyond_mocap.library_holds = summary(result.library)
    shown = []
    for one in result.takes:
        lines = {
            "quality": quality.quality(one.report),
            "moments": quality.moments(one.report),
            "warnings": quality.warnings(one.report, order.warnings, result.library.notes),
            "recipe": json.dumps(one.recipe),
            "made_of": json.dumps(result.made_of),
        }
        shown.append((session.keep_take(one.plan, one.take, one.report), lines))
    preview.show(context, player, *shown[0])
    if player.drawn_track is not None:
        dots.renew(context, player)
    variants.keep(player, [(name, lines, one.report) for (name, lines), one in zip(shown, result.takes)])
    freshness.dirty()
    show_automatic(context, player)


def show_automatic(context, player) -> None:
    """Let the player's automatic strips be those of its take; a player without strips, whose words are in a text or a
    file, is left without, since strips count more."""
    made = session.made(player.take)
    if strips.read(player, context.scene) is not None and (made is not None or not player.take):
        strips.set_automatic(context, player, made.take.timeline if made is not None else Timeline())
