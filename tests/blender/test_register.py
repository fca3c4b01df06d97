"""Switching the extension on and off leaves nothing behind and hides no error."""

import sys

import bpy
import pytest

TAB = "Beyond Mocap"


def our_classes():
    """Names of all registered classes whose code lies in the extension."""
    return sorted(
        cls.__name__
        for base in (bpy.types.Panel, bpy.types.Operator, bpy.types.PropertyGroup, bpy.types.UIList,
                     bpy.types.Menu, bpy.types.FileHandler, bpy.types.AddonPreferences)
        for cls in base.__subclasses__()
        if cls.__module__.startswith("bl_ext.user_default.beyond_mocap") and cls.is_registered
    )


def test_the_tab_is_there(extension):
    panels = [cls for cls in bpy.types.Panel.__subclasses__() if getattr(cls, "bl_category", "") == TAB]
    assert any(cls.bl_space_type == "VIEW_3D" and cls.bl_region_type == "UI" for cls in panels)


def test_off_and_on_again(extension):
    before = our_classes()
    extension.unregister()
    assert our_classes() == []
    extension.register()
    assert our_classes() == before


def test_a_registration_error_is_passed_on_and_undone(extension, monkeypatch):
    before = our_classes()
    extension.unregister()
    last = sys.modules[f"{extension.__name__}.{extension.ROOMS[-1]}"]

    def broken():
        raise RuntimeError("planted")

    with monkeypatch.context() as patch:
        patch.setattr(last, "register", broken)
        with pytest.raises(RuntimeError, match="planted"):
            extension.register()
    assert our_classes() == []
    extension.register()
    assert our_classes() == before


def test_the_core_has_one_name():
    with pytest.raises(ImportError):
        import beyond_mocap  # noqa: F401
