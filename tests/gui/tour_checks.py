"""The whole tour by pointer and keys, from an empty file: import, annotate, synthesize, cancel, synthesize, accept,
bake to a rig, undo all the way back to the empty file, and redo all the way."""

import pathlib
import sys

import addon_utils
import bpy
from tab import PICTURES, choose_file, fill_in, moves, output, press_button, sample, settings, settled, until, window

sys.path.insert(0, str(pathlib.Path("tests/blender").resolve()))
from undo import state  # noqa: E402


def the_file():
    """All that the file holds, without what undo leaves alone: the frame shown and what is selected."""
    found = state()
    found["frames"] = found["frames"][:3]
    del found["chosen"]
    return found


def into_the_view():
    """The pointer over the middle of the 3D view."""
    area = window.area("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    yield from window.move(region.x + region.width // 2, region.y + region.height // 3)
    yield 0.2


def states():
    return [player.result.state for player in settings().players]


def importing():
    """Tracking by the file browser: a dot, and its words as strips."""
    yield from press_button("import_tracking")
    yield from choose_file(sample() / "match" / "player1.csv")
    yield from until(lambda: len(settings().players) == 1)
    yield from settled()
    player, = settings().players
    assert player.dot is not None and player.dot.animation_data.nla_tracks


def building():
    """The folder is typed, the library built."""
    yield from fill_in("library_folder", str(sample() / "library"))
    yield from until(
        lambda: settings().library_folder == str(sample() / "library"), what=lambda: settings().library_folder
    )
    yield from press_button("build_library")
    yield from settled()
    yield from until(lambda: "clips" in settings().library_holds)


def annotating():
    """A kick at the playhead by keys: J, then digits."""
    before = strips()
    bpy.context.scene.frame_set(100)
    yield from into_the_view()
    yield from window.press("J")
    yield from until(window.window.modal_operators.keys, what="J begins to annotate")
    window.picture(PICTURES / "tour-annotate.png")
    for key in ("TWO", "ONE", "RET"):
        yield from window.press(key)
    yield from window.press("ESC")
    if window.window.modal_operators:
        yield from window.press("ESC")
    yield from settled()
    assert strips() != before


def strips():
    """Words on the timeline: strips and key moments."""
    found = the_file()
    return found["strips"], found["markers"]


def cancelling():
    """Synthesize is begun and cancelled: the file is as before."""
    before = the_file()
    yield from press_button("synthesize")
    yield from into_the_view()
    yield from window.press("ESC")
    yield from settled()
    assert the_file() == before or states() == ["PREVIEW"], "neither cancelled nor done"


def synthesizing():
    """The preview is on a body."""
    yield from press_button("synthesize")
    yield from settled()
    yield from until(lambda: states() == ["PREVIEW"], what=states)
    window.picture(PICTURES / "tour-preview.png")


def accepting():
    """The body keeps it."""
    yield from press_button("accept")
    yield from until(lambda: states() == ["ACCEPTED"], what=states)
    yield from settled()
    assert moves(settings().players[0].body)


def a_rig():
    """Rigify makes a control rig, in steps of its own; it is the active object."""
    area = window.area("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window.window, area=area, region=region):
        bpy.ops.object.armature_basic_human_metarig_add("EXEC_DEFAULT", True)
        bpy.ops.pose.rigify_generate("EXEC_DEFAULT", True)
    yield 1
    assert bpy.context.view_layer.objects.active.name.lower().startswith("rig")


def baking():
    """The rig is chosen by its button, and moves as the body does."""
    yield from press_button("use_selected_rig")
    yield from until(lambda: settings().rig.target is not None)
    yield from press_button("bake_to_rig")
    yield from settled()
    assert moves(settings().rig.target), "the rig stands still"
    window.picture(PICTURES / "tour-rig.png")


STEPS = (importing, building, annotating, cancelling, synthesizing, accepting, a_rig, baking)


def check_the_tour():
    addon_utils.enable("rigify", default_set=True)
    bpy.ops.wm.read_homefile(use_empty=True, load_ui=True)
    yield 1.5
    reached = [the_file()]
    for step in STEPS:
        yield from step()
        yield from settled()
        if the_file() != reached[-1]:
            reached.append(the_file())
        output.say(f"     {step.__name__}: done")
    window.picture(PICTURES / "tour-end.png")
    back = yield from walk("Z", reached[::-1], ctrl=True)
    window.picture(PICTURES / "tour-undone.png")
    forth = yield from walk("Z", reached, ctrl=True, shift=True)
    output.say(f"     undone in {back} steps, redone in {forth}")


def walk(key, wanted, **held):
    """Press the key until all these states of the file have come, in their order; return how often."""
    yield from into_the_view()
    assert the_file() == wanted[0]
    count, left = 0, list(wanted[1:])
    while left:
        assert count < 60, f"{len(left)} of {len(wanted)} states have not come back"
        yield from window.press(key, **held)
        yield from settled()
        count += 1
        if the_file() == left[0]:
            left.pop(0)
    return count
