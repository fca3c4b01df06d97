"""What a task shows at its top while it has nothing yet: buttons that load its sample."""

from __future__ import annotations

from ..scene.markers.settings import list_clouds
from .tab import draw_paragraph, with_progress

SAMPLES = {"PLAYER": ("PLAYER",), "MATCH": ("MATCH",), "PATH": ("PATH",), "BALL": ("PASSES", "THROW"),
           "MARKERS": ("MARKERS",)}
"""The samples of each task."""

EMPTY = {"PLAYER": lambda scene: not scene.beyond_mocap.players,
         "MATCH": lambda scene: not scene.beyond_mocap_match.tracking_file,
         "PATH": lambda scene: not any(thing.type == "ARMATURE" for thing in scene.objects),
         "BALL": lambda scene: not scene.beyond_mocap_passes.players
         and not any(thing.beyond_mocap_throw.made for thing in scene.objects),
         "MARKERS": lambda scene: not list_clouds(scene)}
"""Whether a scene has nothing of a task."""


def draw_samples(layout, context) -> None:
    """Draw a button for each sample of the chosen task while the scene has nothing of it, and its progress there."""
    task = context.scene.beyond_mocap.task
    if task not in EMPTY or not EMPTY[task](context.scene):
        return
    draw_paragraph(layout, "See it move first, or begin with your own data below", "INFO")
    work = context.window_manager.beyond_mocap_work.kind
    with_progress(layout, context, (work,) if work and is_loading(context) else (), lambda row: draw_buttons(row, task))


def draw_buttons(row, task: str) -> None:
    """Draw the buttons that load a task's samples."""
    for name in SAMPLES[task]:
        text = "Load Sample" if len(SAMPLES[task]) == 1 else f"{name.title()} Sample"
        row.operator("beyond_mocap.load_sample", text=text, icon="PLAY").which = name


def is_loading(context) -> bool:
    """Return whether a sample is being loaded."""
    running = context.window.modal_operators if context.window is not None else ()
    return any(one.bl_idname == "BEYOND_MOCAP_OT_load_sample" for one in running)
