"""Settings of Synthesize under a name: kept with Blender's presets, brought back by its own menu."""

import os

import bpy
import pytest


@pytest.fixture
def settings():
    return bpy.context.scene.beyond_mocap


def test_a_preset_is_kept_and_brought_back(settings):
    settings.method, settings.alpha, settings.root_window = "blocks", 0.7, 2.5
    settings.library_folder = "//mine"
    assert bpy.ops.beyond_mocap.add_preset(name="Words First") == {"FINISHED"}
    (path,) = [p for p in bpy.utils.preset_paths("beyond_mocap/synthesis")]
    settings.method, settings.alpha, settings.root_window, settings.library_folder = "path", 0.2, 1.5, "//other"
    bpy.ops.script.execute_preset(filepath=f"{path}/Words_First.py", menu_idname="BEYOND_MOCAP_MT_presets")
    assert (settings.method, settings.root_window) == ("blocks", 2.5) and settings.alpha == pytest.approx(0.7)
    assert settings.library_folder == "//other", "a preset is about synthesis, not about files"


def test_a_preset_is_removed(settings):
    bpy.ops.beyond_mocap.add_preset(name="Gone")
    bpy.types.BEYOND_MOCAP_MT_presets.bl_label = "Gone"  # what the menu shows is what the minus takes away
    assert bpy.ops.beyond_mocap.add_preset(name="Gone", remove_active=True) == {"FINISHED"}
    (path,) = bpy.utils.preset_paths("beyond_mocap/synthesis")
    assert "Gone.py" not in os.listdir(path)
