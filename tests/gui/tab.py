"""What all window tests share: the tab's buttons, found and pressed, and what was printed meanwhile.

`output` and `window` are the one eye and the one hand of a run. tests/gui/play.py puts every name of this file into each
file of checks, so that these need not import anything from here.
"""

import importlib
import pathlib
import re
import shutil
import sys
import time

import bpy
from window import Output, Window

EXTENSION = "bl_ext.user_default.beyond_mocap"
TAB = "Beyond Mocap"
PICTURES = pathlib.Path("build/gui")
SAMPLE = PICTURES / "sample"  # a copy of sample_blend, since a library's cache is written beside its clips
SPEED_COUNTS = "--speed" in sys.argv  # `make window-bench`

output = Output()
window = Window()


def within(told, value, most):
    """Say a measured time beside the most it is meant to take. Only `make window-bench` fails where it is above: a test
    must not fail because somebody else uses the machine."""
    output.say(f"     {told}: {value:.3g} (target {most:g}{', ABOVE IT' if value > most else ''})")
    assert value <= most or not SPEED_COUNTS, f"{told}: {value:.3g}, target {most:g}"


def room(name):
    """One of the extension's modules, by its dotted name below the extension."""
    return importlib.import_module(f"{EXTENSION}.{name}")


def settings():
    """The settings of the window's scene; looked up each time, since undo replaces them."""
    return window.window.scene.beyond_mocap


def run(name, how="INVOKE_DEFAULT", **arguments):
    """An operator as its button in the 3D view runs it."""
    area = window.area("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window.window, area=area, region=region):
        group, verb = name.split(".")
        return getattr(getattr(bpy.ops, group), verb)(how, True, **arguments)


def sample():
    """The folder with our own sample, which a check may write to."""
    if not SAMPLE.exists():
        shutil.copytree("sample_blend", SAMPLE, ignore=shutil.ignore_patterns("__pycache__", ".beyond_mocap"))
    return SAMPLE.resolve()


def trouble(text):
    """The lines of printed text that only an error prints."""
    return re.findall(r"^(?:Traceback \(most recent call last\):.*|/.*\.py:\d+|.*rna_uiItem\w*:.*|UILayout\..*)$", text, re.M)


def printed_since(mark):
    """What was printed after the first `mark` characters."""
    return output.text()[mark:]


def assert_no_trouble_since(mark):
    """Fail with what was printed, each line once, where an error is in it."""
    printed = printed_since(mark)
    assert not trouble(printed), "printed:\n" + "\n".join(list(dict.fromkeys(printed.splitlines()))[:40])


def press_all(wanted=None, then=None):
    """Press each button of the tab (or only the wanted operators'), page by page; return the calls that were pressed.

    `then` is what to do after each press; without it, whatever began is ended by Escape.
    """
    area = window.area("VIEW_3D")
    yield from window.open_tab(area, TAB)
    region = window.sidebar(area)
    pressed, more = [], True
    while more and not (wanted and len(pressed) >= len(wanted)):
        found = yield from window.buttons(area, region)
        new = [call for call in found if call not in pressed and (wanted is None or operator_of(call) in wanted)]
        moved = False  # a press may move the others: then they are looked for again
        for call in new:
            if (yield from window.points_at(area, region, found[call])) == call:
                pressed.append(call)
                yield from press_one(call, found[call], then or end_what_began)
            else:
                moved = True
        more = moved or bool(wanted and new) or (yield from window.scroll(region))
    return pressed


def press_button(operator, editor="VIEW_3D"):
    """Find the operator's button in our tab and click it; `operator` may go on with its first arguments."""
    area = window.area(editor)
    yield from window.open_tab(area, TAB)
    region = window.sidebar(area)
    wanted = f"bpy.ops.beyond_mocap.{operator}" + "(" * ("(" not in operator)
    place = yield from window.find(area, region, lambda call: call.startswith(wanted), window.command_under_pointer)
    yield from window.click(*place)
    yield 0.3


def fill_in(path, text, editor="VIEW_3D"):
    """Find the field of a property in our tab by the end of its data path, and type into it."""
    area = window.area(editor)
    yield from window.open_tab(area, TAB)
    region = window.sidebar(area)
    place = yield from window.find(area, region, lambda found: found.endswith(path), window.field_under_pointer)
    yield from window.click(*place)
    yield from window.press("LEFTMOUSE")
    yield 0.3
    yield from window.write(text)
    yield 0.3


def choose_file(path):
    """Choose a file in the file browser that is open, as one who types its folder and name and presses Enter."""
    def browser():
        for other in bpy.context.window_manager.windows:
            for area in other.screen.areas:
                if area.type == "FILE_BROWSER" and area.spaces.active.params is not None:
                    return other, area
        return None, None

    for _ in range(50):
        other, area = browser()
        if other is not None:
            break
        yield 0.1
    assert other is not None, "no file browser has opened"
    parameters = area.spaces.active.params
    parameters.directory, parameters.filename = str(path.parent).encode(), path.name
    yield 1.0
    middle = {"x": area.x + area.width // 2, "y": area.y + area.height // 2}
    other.event_simulate(type="MOUSEMOVE", value="NOTHING", **middle)
    yield 0.2
    other.event_simulate(type="RET", value="PRESS", **middle)
    yield 1.0


def operator_of(call):
    """The operator's name in a call as Blender writes it.

    >>> operator_of("bpy.ops.beyond_mocap.build_library(rebuild=True)")
    'build_library'
    """
    return call.split("(")[0].rpartition(".")[2]


def press_one(call, place, then):
    """Press the button that stood there, and tell what came of it."""
    usable = can_run(call)
    yield from window.click(*place)
    yield 0.3
    reaction = yield from then()
    output.say(f"     pressed {call}: {reaction if usable else 'greyed out'}")


def can_run(call):
    """Whether a button's operator says that it can be used just now."""
    group, name = call.split("(")[0].split(".")[-2:]
    area = window.area("VIEW_3D")
    with bpy.context.temp_override(window=window.window, area=area, region=window.sidebar(area)):
        return getattr(getattr(bpy.ops, group), name).poll()


def end_what_began():
    """Leave the file browser, dialog or running operator that a button brought up; say which it was."""
    manager = bpy.context.window_manager
    reaction = "done"
    for _ in range(20):
        browser = next((w for w in manager.windows if any(a.type == "FILE_BROWSER" for a in w.screen.areas)), None)
        running = [operator.bl_idname for operator in window.window.modal_operators]
        if browser is None and not running:
            return reaction
        reaction = "opened the file browser" if browser else f"ran {running}"
        yield from window.escape_from(browser or window.window)
        yield 0.5
    raise AssertionError(f"{reaction} and did not end by Escape")


def wait_for_work(limit=120):
    """Wait until no operator is running any more; say how long it took."""
    start = time.monotonic()
    while window.window.modal_operators:
        assert time.monotonic() - start < limit, f"still running after {limit} s"
        yield 0.2
    return f"took {time.monotonic() - start:.1f} s"


def moves(body):
    """Whether an armature's bones stand differently at two frames of the scene."""
    scene = bpy.context.scene
    poses = []
    for frame in (scene.frame_start, (scene.frame_start + scene.frame_end) // 2):
        scene.frame_set(frame)
        poses.append([tuple(bone.matrix.translation) for bone in body.pose.bones])
    return poses[0] != poses[1]
