"""All keys of the extension: one table, put into Blender's key configuration for add-ons.

There they can be changed by the user, in Blender's preferences under Keymap and in the add-on's own. Nothing else in
the extension adds a key. A new key is a new line of ENTRIES.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import bpy

OURS = "beyond_mocap."
NUDGES = {"LEFT_ARROW": "LEFT", "RIGHT_ARROW": "RIGHT", "UP_ARROW": "FORTH", "DOWN_ARROW": "BACK", "PAGE_UP": "UP",
          "PAGE_DOWN": "DOWN"}


class Entry(NamedTuple):
    """One key. keymap, space: Blender's name of the keymap and its editor type ("EMPTY" where it belongs to no one
    editor). operator: its bl_idname. key: event type. modifiers: of "shift", "ctrl", "alt", "oskey". properties: of
    the operator. repeat: whether the key acts again and again while it is held."""

    keymap: str
    space: str
    operator: str
    key: str
    modifiers: tuple[str, ...] = ()
    properties: Mapping[str, object] = {}
    repeat: bool = False


ENTRIES: tuple[Entry, ...] = (
    Entry("3D View", "VIEW_3D", "beyond_mocap.annotate", "J"),
    Entry("NLA Editor", "NLA_EDITOR", "beyond_mocap.annotate", "J"),
    Entry("Dopesheet", "DOPESHEET_EDITOR", "beyond_mocap.annotate", "J"),
    Entry("Sequencer", "SEQUENCE_EDITOR", "beyond_mocap.annotate", "J"),
    Entry("Clip Editor", "CLIP_EDITOR", "beyond_mocap.annotate", "J"),
    Entry("NLA Editor", "NLA_EDITOR", "beyond_mocap.pick_moment", "LEFTMOUSE"),
    Entry("Dopesheet", "DOPESHEET_EDITOR", "beyond_mocap.pick_moment", "LEFTMOUSE"),
    Entry("3D View", "VIEW_3D", "beyond_mocap.path_camera", "NUMPAD_0", ("shift",)),
    Entry("3D View", "VIEW_3D", "beyond_mocap.path_camera", "J", ("shift",)),
    *(Entry("Object Mode", "EMPTY", "beyond_mocap.stream_target", key, properties={"number": number})
      for number, key in enumerate(("ONE", "TWO", "THREE", "FOUR", "FIVE", "SIX", "SEVEN", "EIGHT", "NINE"), 1)),
    *(Entry("Curve", "EMPTY", "beyond_mocap.nudge_points", key=key, modifiers=("alt",),
            properties={"direction": direction}, repeat=True)
      for key, direction in NUDGES.items()),
)


def register():
    """Put the table into the key configuration; there is none where Blender runs without keys."""
    configuration = bpy.context.window_manager.keyconfigs.addon
    if configuration is None:
        return
    for entry in ENTRIES:
        keymap = configuration.keymaps.new(name=entry.keymap, space_type=entry.space)
        held = {modifier: True for modifier in entry.modifiers}
        item = keymap.keymap_items.new(entry.operator, entry.key, "PRESS", repeat=entry.repeat, **held)
        for name, value in entry.properties.items():
            setattr(item.properties, name, value)


def unregister():
    """Take all of our keys out again, those that a user has changed too."""
    configuration = bpy.context.window_manager.keyconfigs.addon
    if configuration is None:
        return
    for keymap in configuration.keymaps:
        for item in [item for item in keymap.keymap_items if item.idname.startswith(OURS)]:
            keymap.keymap_items.remove(item)
