"""A contact sheet from its button: the file is chosen in the browser, the window stays alive, Escape cancels."""

import time

import bpy
from tab import (
    PICTURES,
    choose_file,
    click_operator,
    copy_sample,
    get_settings,
    report_time,
    wait_until,
    wait_until_settled,
    window,
)

SHEET = PICTURES.resolve() / "contact-sheet.png"


def open_clip():
    """A clip that moves, before the stage's camera, and the panel open."""
    bpy.ops.wm.read_homefile(app_template="")
    yield 1.0
    get_settings().library_folder = str(copy_sample() / "library")
    bpy.ops.beyond_mocap.list_clips()
    bpy.ops.beyond_mocap.import_clip(path="walking_1_2.bvh")
    bpy.context.scene.frame_end = 60
    panel = bpy.types.BEYOND_MOCAP_PT_stage
    if getattr(panel, "bl_options", None):
        bpy.utils.unregister_class(panel)
        panel.bl_options = set()
        bpy.utils.register_class(panel)
    yield from window.open_tab(window.find_area("VIEW_3D"), "Beyond Mocap")


def get_work():
    return bpy.context.window_manager.beyond_mocap_work


def press_contact_sheet(samples, count):
    """Press the button, set samples and number of pictures in the browser, and choose the file."""
    yield from click_operator("contact_sheet")
    yield 1.0
    operator = next(shown.screen.areas[0].spaces.active.active_operator for shown in bpy.context.window_manager.windows
                    if shown.screen.areas[0].type == "FILE_BROWSER")
    operator.engine, operator.samples, operator.height, operator.count = "CYCLES", samples, 90, count
    yield from choose_file(SHEET)


def check_it_is_written_while_the_window_is_alive():
    yield from open_clip()
    yield from press_contact_sheet(1, 4)
    yield from wait_until(lambda: get_work().kind == "pictures", 30.0, "it is at work")
    longest, before = 0.0, time.monotonic()
    while get_work().kind == "pictures":
        yield 0.02
        longest, before = max(longest, time.monotonic() - before), time.monotonic()
    window.save_picture(PICTURES / "pictures-done.png")
    report_time("longest wait, s", longest, 1.0)
    assert SHEET.stat().st_size > 1000


def check_escape_cancels():
    yield from open_clip()
    SHEET.unlink(missing_ok=True)
    yield from press_contact_sheet(4000, 100)  # minutes, on the quickest machine too
    yield from wait_until(lambda: get_work().kind == "pictures", 30.0, "it is at work")
    yield 3.0
    window.save_picture(PICTURES / "pictures-progress.png")
    yield from window.escape_from(window.window)
    yield from wait_until_settled(90.0)
    assert not list(PICTURES.glob("*contact-sheet*"))
