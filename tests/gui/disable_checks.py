"""The extension is disabled while it works, from a window with another workspace, as Preferences may have: nothing is
left."""

import subprocess
import threading

import addon_utils
import bpy
from tab import EXTENSION, PICTURES, copy_sample, get_settings, import_module, run_operator, wait_until, window


def open_scene():
    """The sample, its library apart, and the pointer at rest in the view."""
    bpy.ops.wm.open_mainfile(filepath=str(copy_sample() / "quickstart.blend"))
    yield 1.0
    get_settings().library_folder = str(copy_sample() / "library")
    yield from window.move_pointer(700, 600)
    yield 0.5


def sign_status_bar():
    """What the left part of the status bar shows, as a number."""
    picture = "import -window root png:- | convert png:- -crop 600x20+0+1058 +repage -format '%#' info:"
    return subprocess.run(picture, shell=True, check=True, capture_output=True, text=True).stdout


def list_leftovers(kept):
    """What is still at work for the extension, by name; `kept`: the modules as they were while it was enabled."""
    handlers = [f"handler {name}" for name in dir(bpy.app.handlers)
                if isinstance(found := getattr(bpy.app.handlers, name), list)
                for one in found if getattr(one, "__module__", "").startswith(EXTENSION)]
    running = [f"operator {one.bl_idname}" for shown in bpy.context.window_manager.windows
               for one in shown.modal_operators if one is not None and "BEYOND_MOCAP" in one.bl_idname]
    threads = [f"thread {one.name}" for one in threading.enumerate() if one.name.startswith("beyond-mocap")]
    lists = {"timer": kept["live"]._timers, "event timer": kept["window"]._timers,
             "overlay": kept["window"]._draw_handlers, "process": kept["process"]._running}
    return handlers + running + threads + [name for name, found in lists.items() for _ in found]


def disable_while(start, is_busy):
    """Start something, wait until it is at work, disable the extension from another window, and look what is left."""
    yield from open_scene()
    before = sign_status_bar()
    start()
    yield from wait_until(is_busy, 60.0, "it is at work")
    yield 0.5
    kept = {"live": import_module("scene.core.live"), "window": import_module("scene.core.window"),
            "process": import_module("scene.match.command_process")}
    bpy.ops.wm.window_new("INVOKE_DEFAULT")
    yield 0.5
    other = bpy.context.window_manager.windows[-1]
    with bpy.context.temp_override(window=other):
        other.workspace = bpy.data.workspaces["Modeling"]
    yield 0.5
    with bpy.context.temp_override(window=other):
        addon_utils.disable(EXTENSION)
        bpy.ops.wm.window_close()
    yield from wait_until(lambda: not list_leftovers(kept), 90.0, lambda: list_leftovers(kept))
    window.find_area("VIEW_3D").tag_redraw()
    yield from window.move_pointer(701, 600)
    yield from window.move_pointer(700, 600)
    yield 0.7
    after = sign_status_bar()
    assert addon_utils.enable(EXTENSION) is not None
    yield 1.0
    assert after == before, "the status bar shows something else than before"
    assert not bpy.context.window_manager.beyond_mocap_work.kind


def get_work():
    return bpy.context.window_manager.beyond_mocap_work


def check_disabled_during_synthesis():
    yield from disable_while(lambda: run_operator("beyond_mocap.synthesize"), lambda: get_work().kind == "synthesis")
    run_operator("beyond_mocap.synthesize")  # the queue is free
    yield from wait_until(lambda: get_work().kind == "synthesis", 10.0, "Synthesize works again")
    yield from window.escape_from(window.window)
    yield from wait_until(lambda: not get_work().kind, 60.0, "Synthesize is cancelled")


def check_disabled_during_a_match():
    def start():
        match = window.window.scene.beyond_mocap_match
        bpy.ops.beyond_mocap.read_match(filepath=str(copy_sample() / "match" / "small" / "small_Home.csv"))
        match.end, match.workers = match.start + 6.0, 1
        run_operator("beyond_mocap.make_match")

    yield from disable_while(start, lambda: import_module("scene.match.command_process")._running)


def check_disabled_during_a_stream():
    yield from disable_while(lambda: run_operator("beyond_mocap.stream_start"),
                             lambda: bpy.context.window_manager.beyond_mocap_streaming.on)


def check_disabled_with_overlays():
    def start():
        get_settings().view.show = True

    yield from disable_while(start, lambda: get_settings().view.show)


def check_disabled_during_annotation():
    yield from disable_while(lambda: run_operator("beyond_mocap.annotate"),
                             lambda: import_module("operators.annotate")._running)


def check_disabled_while_pictures_are_rendered():
    def start():
        bpy.ops.beyond_mocap.import_clip(path="walking_1_2.bvh")
        run_operator("beyond_mocap.preview_movie", filepath=str((PICTURES / "disabled.mp4").resolve()), is_chosen=True,
                     engine="CYCLES", samples=500)

    yield from disable_while(start, lambda: import_module("scene.match.command_process")._running)
    assert not list(PICTURES.glob("*disabled*"))
