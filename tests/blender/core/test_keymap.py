"""The keys of the extension: all of the table is there, each leads to an operator, and none is left when it is off."""

from importlib import import_module

import bpy
import pytest
from conftest import EXTENSION


@pytest.fixture
def keymap():
    return import_module(f"{EXTENSION}.operators.keymap")


def items(prefix="beyond_mocap."):
    """(keymap, operator, key) of each item of the add-ons' configuration."""
    return [(keymap.name, item.idname, item.type) for keymap in bpy.context.window_manager.keyconfigs.addon.keymaps
            for item in keymap.keymap_items if item.idname.startswith(prefix)]


def test_the_table_is_registered_and_taken_away(keymap):
    wanted = sorted((entry.keymap, entry.operator, entry.key) for entry in keymap.ENTRIES)
    assert sorted(items()) == wanted
    keymap.unregister()
    assert items() == []
    keymap.register()
    assert sorted(items()) == wanted


def test_each_key_leads_to_an_operator_that_has_the_properties(keymap):
    for entry in keymap.ENTRIES:
        room, verb = entry.operator.split(".")
        known = getattr(getattr(bpy.ops, room), verb).get_rna_type().properties
        assert set(entry.properties) <= set(known.keys()), entry


def test_a_planted_entry_arrives_with_modifiers_and_properties(keymap, monkeypatch):
    keymap.unregister()
    planted = keymap.Entry("NLA Editor", "NLA_EDITOR", "beyond_mocap.mirror", "F19", ("shift", "alt"), {})
    with monkeypatch.context() as patch:
        patch.setattr(keymap, "ENTRIES", (planted,))
        keymap.register()
        found = [item for k in bpy.context.window_manager.keyconfigs.addon.keymaps for item in k.keymap_items
                 if item.idname == planted.operator]
        assert [(i.type, i.shift, i.alt, i.ctrl) for i in found] == [("F19", True, True, False)]
        keymap.unregister()
    assert items() == []
    keymap.register()


def test_no_two_keys_are_the_same_in_one_keymap(keymap):
    pressed = [(entry.keymap, entry.key, frozenset(entry.modifiers)) for entry in keymap.ENTRIES]
    assert len(set(pressed)) == len(pressed)


def test_the_rows_for_the_preferences_find_our_keymaps(keymap, monkeypatch):
    rows = import_module(f"{EXTENSION}.panels.preferences")
    keymap.unregister()
    with monkeypatch.context() as patch:
        patch.setattr(keymap, "ENTRIES", (keymap.Entry("NLA Editor", "NLA_EDITOR", "beyond_mocap.mirror", "F19"),))
        keymap.register()
        configuration = bpy.context.window_manager.keyconfigs.addon
        assert [found.name for found in rows._find_keymaps(configuration)] == ["NLA Editor"]
        assert rows._find_keymaps(None) == []
        keymap.unregister()
    keymap.register()
