"""Results written into the scene: the take is kept and shown, and what goes with it is renewed."""

from __future__ import annotations

import json

from ..scene import preview, quality, session, strips, variants
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
    variants.keep(player, [(name, lines, one.report) for (name, lines), one in zip(shown, result.takes)])
    strips.set_automatic(context, player, result.takes[0].take.timeline)
