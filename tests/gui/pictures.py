"""The pictures of docs/, taken in a real window from our own sample. Played by `make pictures`; a check like all
others, so that an error in drawing is told. Look at them before they are kept."""

import pathlib
from functools import cache

import bpy
from mathutils import Euler
from tab import (
    EXTENSION,
    TAB,
    copy_sample,
    get_settings,
    import_module,
    output,
    run_operator,
    wait_for_work,
    wait_until,
    window,
)  # fmt: skip
from window import draw_unfolded

KEPT_PICTURES = pathlib.Path("docs/pictures")
NAMES = {"players": "track", "synthesis": "synthesize", "library_step": "library-step"}  # whose page has another name
NOT_SHOWN = ("throws", "ball", "stream", "task")  # pages show them at work, or within others
LONG = ("library", "quality")  # longer than the window
TABS = 22  # pixels of a sidebar's right edge that are its tabs
FRAME = 190

bpy.context.preferences.system.viewport_aa = "8"  # which checks do without


@cache
def list_panels(kind, parent=""):
    """List the registered panels in this kind of editor, in their order; parent: those within that one.

    Listed once, since `show_only` leaves few of them registered.
    """
    found = [cls for cls in bpy.types.Panel.__subclasses__() if cls.__module__.startswith(EXTENSION)
             and cls.is_registered
             and cls.bl_space_type == kind and getattr(cls, "bl_category", "") == TAB
             and getattr(cls, "bl_parent_id", "") == parent]
    return sorted(found, key=lambda cls: getattr(cls, "bl_order", 0))


def open_moving_match():
    """The quickstart, its library built and both players synthesized, seen from the side."""
    bpy.ops.wm.open_mainfile(filepath=str(copy_sample() / "quickstart.blend"))
    yield 1
    bpy.ops.beyond_mocap.build_library()
    if bpy.ops.beyond_mocap.place_players.poll():
        bpy.ops.beyond_mocap.place_players()
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    bpy.context.scene.frame_set(FRAME)
    look_at(bpy.context.scene.beyond_mocap.players[0].body)
    yield 1


def open_empty_pitch():
    """An empty file with a pitch, in the present window."""
    bpy.ops.wm.read_homefile(use_empty=True, load_ui=False)
    yield 1
    bpy.ops.beyond_mocap.add_stage(camera=False)


def look_at(body):
    """The body from the side, near."""
    hips = body.matrix_world @ body.pose.bones[0].head
    view = window.find_area("VIEW_3D").spaces.active.region_3d
    view.view_perspective, view.view_distance = "PERSP", 7.0
    view.view_location = (hips.x, hips.y, 0.8)
    view.view_rotation = Euler((1.35, 0.0, 0.6)).to_quaternion()


def show_only(panel, kind):
    """Only this panel is in the tab, it and what is within it open; its task is chosen."""
    get_settings().task = getattr(panel[0], "task", "") or get_settings().task
    own = [cls for cls in bpy.types.Panel.__subclasses__() if cls.__module__.startswith(EXTENSION) and cls.is_registered
           and cls.bl_space_type == kind and getattr(cls, "bl_category", "") == TAB]
    for cls in sorted(own, key=lambda cls: not getattr(cls, "bl_parent_id", "")):  # those within others first
        bpy.utils.unregister_class(cls)
    for cls in panel:  # a name that Blender has not seen, since it remembers which ones were closed
        cls.bl_options, cls.bl_idname = set(), f"{cls.__name__}_open"
        if getattr(cls, "bl_parent_id", ""):
            cls.bl_parent_id += "_open"
        bpy.utils.register_class(cls)


def save_tab_picture(name, area):
    """The sidebar without its tabs, down to the last thing in it."""
    region = window.find_sidebar(area)
    region.tag_redraw()
    yield 0.7
    yield from window.move_pointer(region.x - 200, region.y + 100)
    yield 0.5
    window.save_part(KEPT_PICTURES / f"{name}.png", region.x + 3, region.y + 4, region.width - TABS - 3, region.height
                     - 8, "-fuzz", "2%", "-trim", "+repage", "-bordercolor", "#303030", "-border", "4")
    output.write_line(f"     {name}.png")


def check_the_whole_window():
    yield from open_moving_match()
    area = window.find_area("VIEW_3D")
    yield from window.open_tab(area, TAB)
    yield 1
    window.save_part(KEPT_PICTURES / "panel.png", area.x, area.y, area.width, area.height, "-resize", "1000x")


def widen_sidebar(area, by=90):
    """Drag the sidebar's edge, so that fewer labels are cut."""
    region = window.find_sidebar(area)
    x, y = region.x, region.y + region.height // 2
    yield from window.move_pointer(x, y)
    yield 0.3
    window.send_event("LEFTMOUSE", "PRESS")
    yield 0.1
    for step in range(10):
        yield from window.move_pointer(x - by * (step + 1) // 10, y)
    window.send_event("LEFTMOUSE", "RELEASE")
    yield 0.5


def check_each_panel_of_the_3d_view():
    area = window.find_area("VIEW_3D")
    yield from widen_sidebar(area)
    tops = [(cls, list_panels("VIEW_3D", cls.__name__)) for cls in list_panels("VIEW_3D")]
    for top, within in tops:
        if top.__name__.endswith(NOT_SHOWN):
            continue
        show_only([top, *within], "VIEW_3D")
        fold_again = [draw_unfolded(cls) for cls in (top, *within)]
        name = top.__name__.partition("_PT_")[2]
        bpy.context.preferences.view.ui_scale = 0.85 if name in LONG else 1.0
        yield from window.open_tab(area, TAB)
        yield from save_tab_picture(f"panel-{NAMES.get(name, name)}", area)
        for fold in fold_again:
            fold()
    bpy.context.preferences.view.ui_scale = 1.0


def check_overlays():
    """All overlays of the first player, shortly before the kick at 8.5 s."""
    scene, settings = bpy.context.scene, get_settings()
    settings.view.players = "ACTIVE"
    for name in import_module("panels.view").ICONS:
        setattr(settings.view, name, True)
    store = import_module("scene.overlays.store")
    yield from wait_until(lambda: store.find_prepared(settings.players[0].take), what="overlays")
    scene.frame_set(round(1 + 8.2 * scene.render.fps))
    look_at(settings.players[0].body)
    yield from save_view_picture("view")
    for name in import_module("panels.view").ICONS:
        setattr(settings.view, name, False)


def check_momentum():
    """A runner who pushes off, with the momentum of their body."""
    yield from open_empty_pitch()
    bpy.context.scene.render.fps = 30
    bpy.ops.beyond_mocap.import_clips(filepath=str(copy_sample() / "library" / "running_4_2.bvh"))
    runner = create_person(bpy.context.object)
    run_operator("beyond_mocap.show_momentum")
    trace = import_module("scene.overlays.momentum_traces").find_momentum(runner).trace
    takes_off = next(first for first, _ in trace.flights if first > 40.0)
    bpy.context.scene.frame_set(1 + int(takes_off) - 2)
    view = window.find_area("VIEW_3D").spaces.active.region_3d
    hips = runner.matrix_world @ runner.pose.bones[0].head
    view.view_perspective, view.view_distance, view.view_location = "PERSP", 4.5, (hips.x, hips.y, 0.8)
    view.view_rotation = Euler((1.4, 0.0, 0.35)).to_quaternion()
    yield from save_view_picture("momentum")


def check_menu_of_labels():
    """The menu after `=` and `2` (catchb), in which neither recordings nor synthetic actions have everything."""
    yield from open_moving_match()
    area, annotate = window.find_area("VIEW_3D"), import_module("operators.timeline.annotate")
    region = next(region for region in area.regions if region.type == "WINDOW")
    yield from window.move_pointer(area.x + area.width // 3, area.y + area.height // 2)
    for key in ("J", "EQUAL", "TWO"):
        yield from window.press_key(key)
        yield 1
    x0, y0, x1, y1 = (int(value) for value in annotate._menu["box"].box)
    window.save_part(KEPT_PICTURES / "annotate.png", region.x + x0 - 8, region.y + y0 - 8, x1 - x0 + 16, y1 - y0 + 16)
    for _ in range(3):
        yield from window.press_key("ESC")


def check_timeline():
    """The strips of the first player, and the tab beside them."""
    scene, area = bpy.context.scene, window.find_area("VIEW_3D")
    for shown in scene.objects:
        shown.select_set(shown == get_settings().players[0].dot)
    with bpy.context.temp_override(window=window.window, area=area):
        bpy.ops.screen.area_split(direction="HORIZONTAL", factor=0.55)
    other = next(one for one in window.window.screen.areas if one.type == "VIEW_3D" and one != area)
    area.ui_type = "NLA_EDITOR"
    area.spaces.active.dopesheet.show_only_selected = True
    yield from window.open_tab(area, TAB)
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window.window, area=area, region=region):
        bpy.ops.nla.view_all()
        bpy.ops.beyond_mocap.go_to_moment(index=1)
    scene.frame_set(500)  # beside the name of the moment
    yield 1.5
    window.save_part(KEPT_PICTURES / "timeline.png", area.x, area.y, area.width, area.height, "-resize", "1200x")
    area.ui_type = "VIEW_3D"
    with bpy.context.temp_override(window=window.window, area=other):
        bpy.ops.screen.area_close()
    yield 0.5


def check_assets():
    """The kicks of the library as assets."""
    bpy.context.window_manager.beyond_mocap_clips.find = "kick"
    run_operator("beyond_mocap.make_assets", which="SHOWN")
    yield from wait_for_work()
    area = window.find_area("VIEW_3D")
    area.ui_type = "ASSETS"
    yield 2
    area.spaces.active.params.asset_library_reference = "LOCAL"
    yield 2
    window.save_part(KEPT_PICTURES / "library-assets.png", area.x, area.y + area.height - 180, 640, 180)
    area.ui_type = "VIEW_3D"
    yield 0.5


def check_a_throw():
    """A throw of a sample clip's body at an Empty, just after the release, with its panel."""
    yield from open_empty_pitch()
    scene = bpy.context.scene
    scene.render.fps, get_settings().library_folder = 30, str(copy_sample() / "library")
    bpy.ops.beyond_mocap.import_clips(filepath=str(copy_sample() / "library" / "walking_1_2.bvh"))
    thrower = create_person(bpy.context.object)
    target = bpy.data.objects.new("Target", None)
    target.location, target.empty_display_type, target.empty_display_size = (10.0, 1.0, 2.0), "SPHERE", 0.3
    scene.collection.objects.link(target)
    settings = thrower.beyond_mocap_throw
    settings.target, settings.frame = target, 70
    run_operator("beyond_mocap.throw_at_target")
    yield from wait_until(lambda: settings.made, what="a throw")
    yield from wait_for_work()
    scene.frame_set(78)
    hips = thrower.matrix_world @ thrower.pose.bones[0].head
    space = window.find_area("VIEW_3D").spaces.active
    space.overlay.show_extras, view = True, space.region_3d  # the target
    view.view_perspective, view.view_distance = "PERSP", 9.0
    view.view_location, view.view_rotation = ((hips.x + 10.0) / 2, 0.5, 0.0), Euler((1.35, 0.0, 0.2)).to_quaternion()
    panel, = (cls for cls in list_panels("VIEW_3D") if "PT_throws" in cls.__name__)
    area = window.find_area("VIEW_3D")
    show_only([panel], "VIEW_3D")
    yield from window.open_tab(area, TAB)
    yield 1
    window.save_part(KEPT_PICTURES / "throw.png", area.x, area.y + area.height // 3, area.width - TABS, area.height * 2
                     // 3, "-resize", "1000x")


def check_a_passing_scene():
    yield from open_empty_pitch()
    scene = bpy.context.scene
    scene.render.fps = 30
    run_operator("beyond_mocap.passes_sample", "EXEC_DEFAULT", sample="three")
    passes = scene.beyond_mocap_passes
    get_settings().library_folder, passes.repeat = str(copy_sample() / "passes" / "library"), 1
    run_operator("beyond_mocap.passes_make")
    yield from wait_for_work()
    assert passes.made_of, passes.messages
    scene.frame_set(int(passes.strikes.splitlines()[1].partition("\t")[0]) + 8)
    view = window.find_area("VIEW_3D").spaces.active.region_3d
    view.view_perspective, view.view_distance, view.view_location = "PERSP", 7.5, (0.0, 0.0, 0.6)
    view.view_rotation = Euler((1.15, 0.0, 0.6)).to_quaternion()
    yield from save_view_picture("passing-scene")
    panel, = (cls for cls in list_panels("VIEW_3D") if "PT_ball" in cls.__name__)
    area = window.find_area("VIEW_3D")
    show_only([panel], "VIEW_3D")
    draw, look = panel.draw, bpy.context.preferences.view
    panel.draw = lambda self, context: import_module("panels.ball").draw_passing_scene(self.layout, context)
    draw_unfolded(panel)
    look.ui_scale = 0.75  # it is longer than the window
    yield from window.open_tab(area, TAB)
    yield from save_tab_picture("panel-ball", area)
    look.ui_scale = 1.0
    panel.draw = draw


def create_person(armature):
    """Give an armature a low-poly body; return the armature."""
    scene = bpy.context.scene
    motion = import_module("scene.core.action").read_motion(armature, scene)
    person = import_module("scene.stage.body").create_character(armature, "person", (0.75, 0.05, 0.06),
                                                                scene.collection, scene, motion)
    for collection in person.users_collection:
        collection.color_tag = "NONE"
    armature.hide_set(False)
    return armature


def create_walk_on_bend():
    """A walk of the sample with a low-poly body, on a curve with two bends; the curve's middle point is selected."""
    yield from open_empty_pitch()
    scene = bpy.context.scene
    bpy.ops.beyond_mocap.import_clips(filepath=str(copy_sample() / "library" / "walk_jog_walk.bvh"))
    walker = bpy.context.object
    create_person(walker)
    motion = import_module("scene.core.action").read_motion(walker, scene)
    bpy.ops.beyond_mocap.edit_path(kind="NURBS", count=6)
    curve = bpy.context.object
    for point, aside in zip(curve.data.splines[0].points, (0.0, 0.0, 5.0, -5.0, 0.0, 4.0)):
        point.co.y += aside
    bpy.ops.beyond_mocap.update_path()
    bpy.ops.beyond_mocap.path_cameras()
    scene.frame_end = scene.frame_start + len(motion) - 1
    scene.frame_set(scene.frame_start + int(0.36 * len(motion)))
    yield 2.5  # figures


def save_view_picture(name):
    """The 3D view without its sidebar."""
    area = window.find_area("VIEW_3D")
    area.spaces.active.show_region_ui = False
    area.spaces.active.region_3d.view_camera_zoom = 27.0
    yield 1.5
    window.save_part(KEPT_PICTURES / f"{name}.png", area.x, area.y, area.width, area.height, "-resize", "900x")
    output.write_line(f"     {name}.png")


def check_path_editing():
    yield from create_walk_on_bend()
    window.find_area("VIEW_3D").spaces.active.overlay.show_extras = False  # cameras are no part of it
    for kind in ("quarter", "behind"):
        run_operator("beyond_mocap.path_camera", "EXEC_DEFAULT", which=kind.upper())
        yield from save_view_picture(f"path-editing-{kind}")
    run_operator("beyond_mocap.path_camera", "EXEC_DEFAULT", which="FREE")
    curve = bpy.context.object
    seen = window.find_area("VIEW_3D").spaces.active.region_3d
    seen.view_perspective, seen.view_distance = "PERSP", 8.5
    rider = next(thing for thing in bpy.context.scene.objects if thing.type == "ARMATURE")
    hips = rider.matrix_world @ rider.pose.bones[0].head
    seen.view_location, seen.view_rotation = (hips.x + 0.4, 0.5 * hips.y, 0.5), Euler((1.12, 0.0, 0.35)).to_quaternion()
    view = bpy.context.scene.beyond_mocap.view
    view.path_ghost = view.path_residuals = True
    yield from save_view_picture("path-editing-residuals")
    view.path_ghost = view.path_residuals = False
    with bpy.context.temp_override(window=window.window):
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.curve.select_all(action="DESELECT")
    curve.data.splines[0].points[3].select = True
    yield from save_view_picture("path-editing")
    with bpy.context.temp_override(window=window.window):
        bpy.ops.object.mode_set(mode="OBJECT")
    panel, = (cls for cls in list_panels("VIEW_3D") if "PT_path" in cls.__name__)
    area = window.find_area("VIEW_3D")
    show_only([panel], "VIEW_3D")
    yield from window.open_tab(area, TAB)
    yield from save_tab_picture("panel-path", area)
    fold, view = draw_unfolded(panel), bpy.context.preferences.view
    view.ui_scale = 0.75  # it is longer than the window
    yield 1
    yield from save_tab_picture("panel-path-open", area)
    view.ui_scale = 1.0
    fold()


def check_optical_markers():
    yield from open_empty_pitch()
    scene = bpy.context.scene
    bpy.ops.beyond_mocap.import_markers(filepath=str(copy_sample() / "markers" / "throw.c3d"))
    cloud = bpy.context.object
    assert bpy.ops.beyond_mocap.reconstruct_markers() == bpy.ops.beyond_mocap.find_release() == {"FINISHED"}
    scene.frame_set(24)
    view = window.find_area("VIEW_3D").spaces.active.region_3d
    view.view_perspective, view.view_distance = "PERSP", 2.6
    view.view_location, view.view_rotation = (0.85, 0.0, 0.95), Euler((1.45, 0.0, 0.3)).to_quaternion()
    panel, = (cls for cls in list_panels("VIEW_3D") if "PT_markers" in cls.__name__)
    area = window.find_area("VIEW_3D")
    show_only([panel], "VIEW_3D")
    yield from window.open_tab(area, TAB)
    fold, look = draw_unfolded(panel), bpy.context.preferences.view
    look.ui_scale = 0.65  # it is longer than the window
    yield 1
    yield from save_tab_picture("panel-markers", area)
    look.ui_scale = 1.0
    fold()
    kept = cloud.beyond_mocap_cloud
    kept.size = 0.02
    for child in kept.body.children:
        child.hide_set(True)  # so that markers are seen
    kept.body.hide_set(False)
    kept.body.data.display_type, kept.body.show_in_front = "OCTAHEDRAL", False
    cloud.select_set(False)
    yield from save_view_picture("markers")


def check_a_match():
    """From a saved file, so that paths are shown as they are kept."""
    bpy.ops.wm.open_mainfile(filepath=str(copy_sample() / "quickstart.blend"), load_ui=False)
    yield 1
    scene = bpy.context.scene
    bpy.ops.beyond_mocap.read_match(filepath=str(copy_sample() / "match" / "small" / "small.dat"))
    match = scene.beyond_mocap_match
    match.start, match.end, match.active = 6.0, 11.0, 3
    assert bpy.ops.beyond_mocap.make_match() == {"FINISHED"}
    panel, = (cls for cls in list_panels("VIEW_3D") if "PT_match" in cls.__name__)
    area = window.find_area("VIEW_3D")
    show_only([panel], "VIEW_3D")
    yield from window.open_tab(area, TAB)
    fold = draw_unfolded(panel)
    yield 1
    yield from save_tab_picture("panel-match", area)
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
    window.save_part(KEPT_PICTURES / "preferences.png", shown.x + 170, shown.y + 10, shown.width - 180, shown.height
                     * 6 // 10 - 6)
