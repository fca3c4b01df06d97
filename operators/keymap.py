"""All keys of the extension: one table, added to Blender's key configuration for add-ons.

Users can change them in Blender's preferences under Keymap and in the add-on's own. No other file of the extension adds
a key. To add a key, add a line to ENTRIES.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import bpy

OPERATOR_PREFIX = "beyond_mocap."
NUDGES = {"LEFT_ARROW": "LEFT", "RIGHT_ARROW": "RIGHT", "UP_ARROW": "FORTH", "DOWN_ARROW": "BACK", "PAGE_UP": "UP",
          "PAGE_DOWN": "DOWN"}


class Entry(NamedTuple):
    """One key.

    Attributes:
        keymap: Blender's name of the keymap.
        space: its editor type, "EMPTY" if it belongs to no single editor.
        operator: bl_idname of the operator.
        key: event type.
        modifiers: of "shift", "ctrl", "alt", "oskey".
        properties: of the operator.
        repeat: whether the key repeats while it is held.
        value: event value.
    """

    keymap: str
    space: str
    operator: str
    key: str
    modifiers: tuple[str, ...] = ()
    properties: Mapping[str, object] = {}
    repeat: bool = False
    value: str = "PRESS"


ENTRIES: tuple[Entry, ...] = (
    Entry("3D View", "VIEW_3D", "beyond_mocap.annotate", "J"),
    Entry("NLA Editor", "NLA_EDITOR", "beyond_mocap.annotate", "J"),
    Entry("Dopesheet", "DOPESHEET_EDITOR", "beyond_mocap.annotate", "J"),
    Entry("Sequencer", "SEQUENCE_EDITOR", "beyond_mocap.annotate", "J"),
    Entry("Clip Editor", "CLIP_EDITOR", "beyond_mocap.annotate", "J"),
    Entry("NLA Editor", "NLA_EDITOR", "beyond_mocap.pick_moment", "LEFTMOUSE"),
    Entry("Dopesheet", "DOPESHEET_EDITOR", "beyond_mocap.pick_moment", "LEFTMOUSE"),
    Entry("NLA Editor", "NLA_EDITOR", "beyond_mocap.hover_timeline", "MOUSEMOVE", value="ANY"),
    Entry("Dopesheet", "DOPESHEET_EDITOR", "beyond_mocap.hover_timeline", "MOUSEMOVE", value="ANY"),
    Entry("3D View", "VIEW_3D", "beyond_mocap.path_camera", "NUMPAD_0", ("shift",)),
    Entry("3D View", "VIEW_3D", "beyond_mocap.path_camera", "J", ("shift",)),
    *(Entry("Object Mode", "EMPTY", "beyond_mocap.stream_target", key, properties={"number": number})
      for number, key in enumerate(("ONE", "TWO", "THREE", "FOUR", "FIVE", "SIX", "SEVEN", "EIGHT", "NINE"), 1)),
    *(Entry("Curve", "EMPTY", "beyond_mocap.nudge_points", key=key, modifiers=("alt",),
            properties={"direction": direction}, repeat=True)
      for key, direction in NUDGES.items()),
)


def register():
    """Add the table to the key configuration, if Blender has one."""
    configuration = bpy.context.window_manager.keyconfigs.addon
    if configuration is None:
        return
    for entry in ENTRIES:
        keymap = configuration.keymaps.new(name=entry.keymap, space_type=entry.space)
        modifiers = {modifier: True for modifier in entry.modifiers}
        item = keymap.keymap_items.new(entry.operator, entry.key, entry.value, repeat=entry.repeat, **modifiers)
        for name, value in entry.properties.items():
            setattr(item.properties, name, value)


def unregister():
    """Remove all of the extension's keys, also those that a user changed."""
    configuration = bpy.context.window_manager.keyconfigs.addon
    if configuration is None:
        return
    for keymap in configuration.keymaps:
        for item in [item for item in keymap.keymap_items if item.idname.startswith(OPERATOR_PREFIX)]:
            keymap.keymap_items.remove(item)
