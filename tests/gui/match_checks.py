"""Match in the window: dropped, read, made beside a window that stays alive, cancelled and gone on with, shown."""

import importlib
import time

import bpy
import numpy as np
from tab import (
    EXTENSION,
    PICTURES,
    assert_no_errors_since,
    click_operator,
    copy_sample,
    import_module,
    open_task,
    output,
    report_time,
    run_operator,
    wait_until,
    wait_until_settled,
    window,
)


def get_match_settings():
    """The settings; looked up each time, since undo replaces them."""
    return window.window.scene.beyond_mocap_match


def list_bodies():
    """The armatures that are shown."""
    return import_module("scene.match.match_objects").find_armatures(window.window.scene)


def open_empty_scene():
    """An empty file whose library is the sample's, and the panel on a tab of its own."""
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 1
    scene = window.window.scene
    scene.render.fps = 30
    scene.beyond_mocap.library_folder = str(copy_sample() / "library")
    bpy.ops.ed.undo_push(message="scene")
    kind = next(panel for panel in bpy.types.Panel.__subclasses__() if panel.__name__ == "BEYOND_MOCAP_PT_match")
    if kind.bl_category != "Match Check":
        bpy.utils.unregister_class(kind)
        kind.bl_category, kind.bl_options = "Match Check", set()
        bpy.utils.register_class(kind)
    yield from open_task("MATCH")
    yield from window.open_tab(window.find_area("VIEW_3D"), "Match Check")
    yield 1


def read_match():
    """The small match read by the operator that a dropped file starts, in the background."""
    names = [{"name": "small.dat"}, {"name": "small_meta.xml"}]
    run_operator("beyond_mocap.read_match", directory=f"{copy_sample() / 'match' / 'small'}/", files=names)
    yield from wait_until(lambda: len(get_match_settings().players) == 9, what="the match is read")
    yield from wait_until_settled()


def check_match():
    """Dropped, cut to six seconds, made by its button, seen from the stand and through a player's eyes; one undo takes
    all away."""
    yield from open_empty_scene()
    began = len(output.text())
    yield from read_match()
    window.save_picture(PICTURES / "match-read.png")
    get_match_settings().end, get_match_settings().workers = 6.0, 1
    bpy.ops.ed.undo_push(message="six seconds")
    objects = len(bpy.data.objects)
    yield from click_operator("make_match")
    work = bpy.context.window_manager.beyond_mocap_work
    took = yield from wait_until(lambda: len(list_bodies()) == 8, 600.0, what=lambda: work.text)
    output.write_line(f"     6 s of 8 players after {took:.1f} s")
    yield from wait_until_settled()
    window.window.scene.frame_set(40)
    yield from click_operator("match_camera", "STAND")
    yield 1
    window.save_picture(PICTURES / "match-stand.png")
    get_match_settings().active = next(number for number, player in enumerate(get_match_settings().players)
                                       if player.feed_id == "home_4")
    yield from click_operator("match_camera", "EYES")
    yield 1
    window.save_picture(PICTURES / "match-eyes.png")
    assert window.window.scene.camera.name == "Player's Eye"
    for _ in range(3):
        bpy.ops.ed.undo()
        yield from wait_until_settled()
    assert not list_bodies() and len(bpy.data.objects) == objects
    assert_no_errors_since(began)


def check_cancel_and_go_on():
    """ESC while it is made changes nothing and ends the process; pressed again it comes to its end."""
    yield from open_empty_scene()
    yield from read_match()
    get_match_settings().end, get_match_settings().workers, get_match_settings().folder = 8.0, 1, str(PICTURES.resolve()
            / "cancelled match")
    bpy.ops.beyond_mocap.tick_match(whom="home")
    child = import_module("scene.match.command_process")
    yield from click_operator("make_match")
    yield from wait_until(lambda: child._running, what="a process works")
    yield 3.0
    yield from window.press_key("ESC")
    yield from wait_until_settled()
    yield from wait_until(lambda: not child._running, 90.0, what="the process ends")
    assert not list_bodies()
    yield from click_operator("make_match")
    yield from wait_until(lambda: len(list_bodies()) == 4, 600.0, what="the home team")
    yield from wait_until_settled()


def check_window_stays_alive():
    """While a match is made the window is drawn and hears keys."""
    yield from open_empty_scene()
    yield from read_match()
    get_match_settings().end, get_match_settings().workers, get_match_settings().folder = 4.0, 1, str(PICTURES.resolve()
            / "alive match")
    bpy.ops.beyond_mocap.tick_match(whom="home")
    yield from click_operator("make_match")
    longest, before = 0.0, time.monotonic()
    while not list_bodies() and time.monotonic() - before < 600.0:
        start = time.monotonic()
        yield 0.05
        if bpy.context.window_manager.beyond_mocap_work.kind == "match":
            longest = max(longest, time.monotonic() - start - 0.05)
    report_time("s that the window stood still at most", longest, 0.5)
    yield from wait_until_settled()


def check_panel_is_quick():
    """Drawing the panel with its list takes no time to speak of."""
    yield from open_empty_scene()
    yield from read_match()
    panel = importlib.import_module(f"{EXTENSION}.panels.match").BEYOND_MOCAP_PT_match
    drawn, took = panel.draw, []

    def timed(self, context):
        start = time.perf_counter()
        drawn(self, context)
        took.append(time.perf_counter() - start)

    panel.draw = timed
    for _ in range(20):
        window.find_sidebar(window.find_area("VIEW_3D")).tag_redraw()
        yield 0.1
    panel.draw = drawn
    report_time("ms to draw Match", 1000.0 * float(np.median(took)), 3.0)
