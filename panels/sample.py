"""What a task shows while it has nothing yet: the button that loads its sample."""

from __future__ import annotations


def draw_load_sample(layout, which: str) -> None:
    """Draw the button that loads the sample of a task ("PLAYER", "MATCH", "PATH", "PASSES", "THROW", "MARKERS")."""
    row = layout.row()
    row.scale_y = 1.3
    row.operator("beyond_mocap.load_sample", icon="IMPORT").which = which
