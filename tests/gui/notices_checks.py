"""What fails is told in the tab with its fixes, or in a pop-up where the tab is not in front; a fix mends it, and what
failed runs again."""

import bpy
from tab import (
    PICTURES,
    TAB,
    click_operator,
    copy_sample,
    get_settings,
    run_operator,
    wait_until,
    wait_until_settled,
    window,
)

FOLDER = PICTURES.resolve() / "notices"


def list_notices():
    return list(bpy.context.window_manager.beyond_mocap_notices.rows)


def open_track(labels, tab="View"):
    """A track, and labels beside it under another name; the sample's library."""
    bpy.ops.wm.read_homefile(app_template="")
    yield 1.0
    FOLDER.mkdir(exist_ok=True)
    rows = "".join(f"{tenth / 10:.1f},{0.2 * tenth:.2f},0.1\n" for tenth in range(41))
    (FOLDER / "heldout1_track.csv").write_text(f"time_s,x_m,y_m\n{rows}")
    (FOLDER / "heldout1_labels.txt").write_text(labels)
    get_settings().library_folder = str(copy_sample() / "library")
    yield from window.open_tab(window.find_area("VIEW_3D"), tab)
    yield from window.move_pointer(700, 600)
    run_operator("beyond_mocap.import_tracking", directory=f"{FOLDER}/", files=[{"name": "heldout1_track.csv"}])
    yield 0.7


def press_first_fix():
    """Click where the pointer is: a pop-up opens with its first button there."""
    yield from window.press_key("LEFTMOUSE")
    yield 0.3


def use_labels():
    """Take the labels that are offered, and close the pop-up with the offer."""
    yield from window.press_key("ESC")
    run_operator("beyond_mocap.apply_fix")
    assert not list_notices()
    yield 0.3


def check_labels_named_otherwise_are_offered():
    yield from open_track("0.5 1.5 walking\n")
    window.save_picture(PICTURES / "notice-labels.png")
    yield from press_first_fix()
    yield from wait_until(lambda: get_settings().players[0].annotation_file, 10.0, "the labels are used")
    assert not list_notices()


def check_use_nearest_labels_from_the_popup():
    yield from open_track("2.4 scissors left back\n")
    yield from use_labels()
    run_operator("beyond_mocap.synthesize")
    yield from wait_until(list_notices, 300.0, "it fails")
    yield from wait_until_settled()
    yield 0.5
    window.save_picture(PICTURES / "notice-nearest.png")
    yield from press_first_fix()
    yield from wait_until(lambda: get_settings().players[0].take, 300.0, "the take is made")
    assert get_settings().nearest and not list_notices()


def check_the_tab_in_front_is_its_one_place_until_it_is_dismissed():
    yield from open_track("2.4 scissors left back\n", TAB)
    yield from use_labels()
    run_operator("beyond_mocap.synthesize")
    yield from wait_until(list_notices, 300.0, "it fails")
    yield from wait_until_settled()
    yield 1.0
    window.save_picture(PICTURES / "notice-panel.png")  # without a pop-up, which would take the click
    yield from click_operator("apply_fix", "index=1")
    yield from wait_until(lambda: get_settings().task == "LIBRARY", 10.0, "the clips are shown")
    yield from wait_until_settled()
    yield 1.0
    window.save_picture(PICTURES / "notice-clips.png")
    get_settings().task = "PLAYER"
    yield 0.5
    yield from click_operator("dismiss_notice")
    assert not list_notices()


def check_a_missing_library_is_told():
    yield from open_track("0.5 1.5 walking\n")
    yield from use_labels()
    get_settings().library_folder = str(FOLDER / "nowhere")
    run_operator("beyond_mocap.synthesize")
    yield from wait_until(list_notices, 60.0, "it fails")
    yield from wait_until_settled()
    yield 0.5
    window.save_picture(PICTURES / "notice-library.png")
    assert [fix.name for fix in list_notices()[0].fixes] == ["Relink Library"]
    yield from window.press_key("ESC")
