"""What the panel says of a rally that is played."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

if TYPE_CHECKING:
    from ...beyond_mocap.passes.live_passes import LivePass, Rally
    from .rally_keys import RallyKeys


def write_status(rally: Rally, piece: LivePass | None = None, delays: tuple[float, float] | None = None) -> None:
    """Write the state of a rally for the panel.

    Args:
        rally: the rally.
        piece: the pass that has just begun; None: none.
        delays: s from the strike to the beginning of its answer in the scene's time, and to its writing by the clock;
            None: not known.
    """
    status_texts = bpy.context.window_manager.beyond_mocap_streaming
    status_texts.playing = True
    lines = [f"{rally.holder} has the ball, passes so far: {rally.passes}"]
    if piece is not None:
        lines.append(f"{piece.giver} played {piece.clip} to {piece.receiver}")
        if delays is not None:
            lines.append("The answer began {:.2f} s after the strike, by the clock {:.2f} s".format(*delays))
        lines += piece.warnings[:2]
    status_texts.played = "\n".join(lines)


def add_note(keys: RallyKeys) -> None:
    """Add to the panel which edits of the user have been replaced."""
    if keys.note:
        bpy.context.window_manager.beyond_mocap_streaming.played += f"\n{keys.note}"
    keys.note = ""
