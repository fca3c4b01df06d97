"""Edits of a take: contacts of the feet, and layers of the user's own keys. Drawn in step 4."""

from __future__ import annotations

import bpy

from .tab import create_value_column, draw_paragraph


class BEYOND_MOCAP_UL_contact_edits(bpy.types.UIList):
    """A player's edited contacts: the foot, what is done, and when."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        row = layout.row(align=True)
        row.prop(item, "foot", text="", emboss=False)
        row.prop(item, "kind", text="", emboss=False)
        row.prop(item, "time", text="", emboss=False)


def draw_edits(layout, player) -> None:
    """Draw the buttons of both kinds of edits, and the edits there are."""
    row = layout.row(align=True)
    row.operator("beyond_mocap.fix_foot", icon="MOD_DYNAMICPAINT")
    row.operator("beyond_mocap.keep_as_layer", icon="NLA")
    if player is not None:
        draw_layers(layout, player.body)
        draw_contact_edits(layout, player)


def draw_layers(layout, body) -> None:
    """Draw the layers of own keys, each with its influence."""
    data = body.animation_data if body is not None else None
    strips = [strip for track in (data.nla_tracks if data is not None else ()) for strip in track.strips
              if strip.action is not None and strip.action.get("beyond_mocap_layer")]
    for number, strip in enumerate(strips, 1):
        row = layout.row(align=True)
        row.prop(strip, "mute", text="", icon="HIDE_ON" if strip.mute else "HIDE_OFF", emboss=False)
        row.prop(strip, "influence", text=strip.name, slider=True)
        row.operator("beyond_mocap.remove_layer", text="", icon="X").number = number


def draw_contact_edits(layout, player) -> None:
    """Draw the edited contacts of the feet."""
    count = len(player.contact_edits)
    if not count:
        draw_paragraph(layout, "Fix Foot: drag footprints in the 3D view", "BLANK1")
        return
    row = layout.row()
    row.template_list("BEYOND_MOCAP_UL_contact_edits", "", player, "contact_edits", player,
                      active_propname="active_contact_edit", rows=2)
    row.column(align=True).operator("beyond_mocap.remove_contact_edit", text="", icon="REMOVE")
    edit = player.contact_edits[min(player.active_contact_edit, count - 1)]
    if edit.kind != "delete":
        column = create_value_column(layout)
        for name in ("start", "end", "offset"):
            column.prop(edit, name)
