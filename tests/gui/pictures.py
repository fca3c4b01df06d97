"""The pictures of docs/, taken in a real window from our own sample. Played by `make pictures`; a check like all others, so
that an error in drawing is told. Look at them before they are kept."""

import pathlib

import bpy
from mathutils import Euler
from tab import EXTENSION, TAB, output, sample, window
from window import unfold

LIMIT = 400
KEPT = pathlib.Path("docs/pictures")
NAMES = {"players": "track", "synthesis": "synthesize"}  # panels whose page has another name
TABS = 22  # pixels of a sidebar's right edge that are its tabs
FRAME = 190


def panels(kind, parent=""):
    """Our panels in this kind of editor, in their order; parent: those within that one."""
    found = [cls for cls in bpy.types.Panel.__subclasses__() if cls.__module__.startswith(EXTENSION) and cls.is_registered
             and cls.bl_space_type == kind and getattr(cls, "bl_category", "") == TAB
             and getattr(cls, "bl_parent_id", "") == parent]
    return sorted(found, key=lambda cls: getattr(cls, "bl_order", 0))


def a_match_that_moves():
    """The quickstart, its library built and both players synthesized, seen from the side."""
    bpy.ops.wm.open_mainfile(filepath=str(sample() / "quickstart.blend"))
    yield 1
    bpy.ops.beyond_mocap.build_library()
    if bpy.ops.beyond_mocap.place_players.poll():
        bpy.ops.beyond_mocap.place_players()
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    bpy.context.scene.frame_set(FRAME)
    look_at(bpy.context.scene.beyond_mocap.players[0].body)
    yield 1


def look_at(body):
    """The body from the side, near."""
    hips = body.matrix_world @ body.pose.bones[0].head
    view = window.area("VIEW_3D").spaces.active.region_3d
    view.view_perspective, view.view_distance = "PERSP", 7.0
    view.view_location = (hips.x, hips.y, 0.8)
    view.view_rotation = Euler((1.35, 0.0, 0.6)).to_quaternion()


def solo(shown, kind):
    """Only this panel is in the tab, it and what is within it open."""
    own = [cls for cls in bpy.types.Panel.__subclasses__() if cls.__module__.startswith(EXTENSION) and cls.is_registered
           and cls.bl_space_type == kind and getattr(cls, "bl_category", "") == TAB]
    for cls in sorted(own, key=lambda cls: not getattr(cls, "bl_parent_id", "")):  # those within others first
        bpy.utils.unregister_class(cls)
    for cls in shown:  # a name that Blender has not seen, since it remembers which ones were closed
        cls.bl_options, cls.bl_idname = set(), f"{cls.__name__}_open"
        if getattr(cls, "bl_parent_id", ""):
            cls.bl_parent_id += "_open"
        bpy.utils.register_class(cls)


def picture_of_tab(name, area):
    """The sidebar without its tabs, down to the last thing in it."""
    region = window.sidebar(area)
    region.tag_redraw()
    yield 0.7
    yield from window.move(region.x - 200, region.y + 100)
    yield 0.5
    window.part(KEPT / f"{name}.png", region.x + 3, region.y + 4, region.width - TABS - 3, region.height - 8,
                "-fuzz", "2%", "-trim", "+repage", "-bordercolor", "#303030", "-border", "4")
    output.say(f"     {name}.png")


def check_the_whole_window():
    yield from a_match_that_moves()
    area = window.area("VIEW_3D")
    yield from window.open_tab(area, TAB)
    yield 1
    window.part(KEPT / "panel.png", area.x, area.y, area.width, area.height, "-resize", "1000x")


def check_each_panel_of_the_3d_view():
    area = window.area("VIEW_3D")
    tops = [(cls, panels("VIEW_3D", cls.__name__)) for cls in panels("VIEW_3D")]
    for top, within in tops:
        solo([top, *within], "VIEW_3D")
        fold_again = [unfold(cls) for cls in (top, *within)]
        name = top.__name__.partition("_PT_")[2]
        yield from window.open_tab(area, TAB)
        yield from picture_of_tab(f"panel-{NAMES.get(name, name)}", area)
        for fold in fold_again:
            fold()


def check_the_preferences():
    before = set(bpy.context.window_manager.windows.values())
    bpy.ops.screen.userpref_show()
    yield 1
    shown, = set(bpy.context.window_manager.windows.values()) - before
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "Beyond Mocap"
    bpy.ops.preferences.addon_expand(module=EXTENSION)
    yield 1.5
    window.part(KEPT / "preferences.png", shown.x + 170, shown.y + 4, shown.width - 180, shown.height * 6 // 10)
