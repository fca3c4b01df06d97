"""The whole tour by pointer and keys, from an empty file: import, annotate, synthesize, cancel, synthesize, accept,
bake to a rig, undo all the way back to the empty file, and redo all the way."""

import pathlib
import sys

import addon_utils
import bpy
from tab import (
    PICTURES,
    choose_file,
    copy_sample,
    fill_in,
    get_settings,
    is_moving,
    output,
    press_button,
    wait_until,
    wait_until_settled,
    window,
)

sys.path.insert(0, str(pathlib.Path("tests/blender").resolve()))
from undo import collect_state  # noqa: E402


def collect_file_state():
    """All that the file holds, without what undo leaves alone: the frame shown and what is selected."""
    found = collect_state()
    found["frames"] = found["frames"][:3]
    del found["chosen"]
    return found


def move_into_view():
    """The pointer over the middle of the 3D view."""
    area = window.find_area("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    yield from window.move_pointer(region.x + region.width // 2, region.y + region.height // 3)
    yield 0.2


def list_states():
    return [player.result.state for player in get_settings().players]


def import_data():
    """Tracking by the file browser: a dot, and its words as strips."""
    yield from press_button("import_tracking")
    yield from choose_file(copy_sample() / "match" / "player1.csv")
    yield from wait_until(lambda: len(get_settings().players) == 1)
    yield from wait_until_settled()
    player, = get_settings().players
    assert player.dot is not None and player.dot.animation_data.nla_tracks


def build_library():
    """The folder is typed, the library built."""
    yield from fill_in("library_folder", str(copy_sample() / "library"))
    yield from wait_until(
        lambda: get_settings().library_folder == str(copy_sample() / "library"),
        what=lambda: get_settings().library_folder
    )
    yield from press_button("build_library")
    yield from wait_until_settled()
    yield from wait_until(lambda: "clips" in get_settings().library_holds)


def annotate_kick():
    """A kick at the playhead by keys: J, then digits."""
    before = list_strips()
    bpy.context.scene.frame_set(100)
    yield from move_into_view()
    yield from window.press_key("J")
    yield from wait_until(window.window.modal_operators.keys, what="J begins to annotate")
    window.save_picture(PICTURES / "tour-annotate.png")
    for key in ("TWO", "ONE", "RET"):
        yield from window.press_key(key)
    yield from window.press_key("ESC")
    if window.window.modal_operators:
        yield from window.press_key("ESC")
    yield from wait_until_settled()
    assert list_strips() != before


def list_strips():
    """Words on the timeline: strips and key moments."""
    found = collect_file_state()
    return found["strips"], found["markers"]


def cancel_synthesis():
    """Synthesize is begun and cancelled: the file is as before."""
    before = collect_file_state()
    yield from press_button("synthesize")
    yield from move_into_view()
    yield from window.press_key("ESC")
    yield from wait_until_settled()
    assert collect_file_state() == before or list_states() == ["PREVIEW"], "neither cancelled nor done"


def synthesize_preview():
    """The preview is on a body."""
    yield from press_button("synthesize")
    yield from wait_until_settled()
    yield from wait_until(lambda: list_states() == ["PREVIEW"], what=list_states)
    window.save_picture(PICTURES / "tour-preview.png")


def accept_preview():
    """The body keeps it."""
    yield from press_button("accept")
    yield from wait_until(lambda: list_states() == ["ACCEPTED"], what=list_states)
    yield from wait_until_settled()
    assert is_moving(get_settings().players[0].body)


def create_rig():
    """Rigify makes a control rig, in steps of its own; it is the active object."""
    area = window.find_area("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window.window, area=area, region=region):
        bpy.ops.object.armature_basic_human_metarig_add("EXEC_DEFAULT", True)
        bpy.ops.pose.rigify_generate("EXEC_DEFAULT", True)
    yield 1
    assert bpy.context.view_layer.objects.active.name.lower().startswith("rig")


def bake_to_rig():
    """The rig is chosen by its button, and moves as the body does."""
    yield from press_button("use_selected_rig")
    yield from wait_until(lambda: get_settings().rig.target is not None)
    yield from press_button("bake_to_rig")
    yield from wait_until_settled()
    assert is_moving(get_settings().rig.target), "the rig stands still"
    window.save_picture(PICTURES / "tour-rig.png")


STEPS = (import_data, build_library, annotate_kick, cancel_synthesis, synthesize_preview, accept_preview, create_rig,
         bake_to_rig)


def check_the_tour():
    addon_utils.enable("rigify", default_set=True)
    bpy.ops.wm.read_homefile(use_empty=True, load_ui=True)
    yield 1.5
    reached = [collect_file_state()]
    for step in STEPS:
        yield from step()
        yield from wait_until_settled()
        if collect_file_state() != reached[-1]:
            reached.append(collect_file_state())
        output.write_line(f"     {step.__name__}: done")
    window.save_picture(PICTURES / "tour-end.png")
    back = yield from step_through_states("Z", reached[::-1], ctrl=True)
    window.save_picture(PICTURES / "tour-undone.png")
    forth = yield from step_through_states("Z", reached, ctrl=True, shift=True)
    output.write_line(f"     undone in {back} steps, redone in {forth}")


def check_the_tour_in_large_letters():
    """The same steps at a UI scale of 1.5, without the way back."""
    bpy.context.preferences.view.ui_scale = 1.5
    try:
        bpy.ops.wm.read_homefile(use_empty=True, load_ui=True)
        yield 1.5
        for step in STEPS:
            yield from step()
            yield from wait_until_settled()
        window.save_picture(PICTURES / "tour-large.png")
    finally:
        bpy.context.preferences.view.ui_scale = 1.0


def step_through_states(key, expected, **held):
    """Press the key until all these states of the file have come, in their order; return how often."""
    yield from move_into_view()
    assert collect_file_state() == expected[0]
    count, left = 0, list(expected[1:])
    while left:
        assert count < 60, f"{len(left)} of {len(expected)} states have not come back"
        yield from window.press_key(key, **held)
        yield from wait_until_settled()
        count += 1
        if collect_file_state() == left[0]:
            left.pop(0)
    return count
