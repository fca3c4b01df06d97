"""What all window tests share: the tab's buttons, found and pressed, and what was printed meanwhile.

`output` and `window` are the one eye and the one hand of a run. tests/gui/play.py puts every name of this file into
each file of checks, so that these need not import anything from here.
"""

import importlib
import inspect
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


def report_time(label, value, most):
    """Say a measured time beside the most it is meant to take. Only `make window-bench` fails where it is above: a test
    must not fail because somebody else uses the machine."""
    output.write_line(f"     {label}: {value:.3g} (target {most:g}{', ABOVE IT' if value > most else ''})")
    assert value <= most or not SPEED_COUNTS, f"{label}: {value:.3g}, target {most:g}"


def import_module(name):
    """One of the extension's modules, by its dotted name below the extension."""
    return importlib.import_module(f"{EXTENSION}.{name}")


def get_settings():
    """The settings of the window's scene; looked up each time, since undo replaces them."""
    return window.window.scene.beyond_mocap


def run_operator(name, how="INVOKE_DEFAULT", **arguments):
    """An operator as its button in the 3D view runs it."""
    area = window.find_area("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window.window, area=area, region=region):
        group, verb = name.split(".")
        return getattr(getattr(bpy.ops, group), verb)(how, True, **arguments)


def copy_sample():
    """The folder with our own sample, which a check may write to."""
    if not SAMPLE.exists():
        shutil.copytree("sample_blend", SAMPLE, ignore=shutil.ignore_patterns("__pycache__", ".beyond_mocap"))
    return SAMPLE.resolve()


def find_errors(text):
    """The lines of printed text that only an error prints."""
    return re.findall(
        r"^(?:Traceback \(most recent call last\):.*|/.*\.py:\d+|.*rna_uiItem\w*:.*|UILayout\..*)$", text, re.M
    )


def read_printed_since(mark):
    """What was printed after the first `mark` characters."""
    return output.text()[mark:]


def assert_no_errors_since(mark):
    """Fail with what was printed, each line once, where an error is in it."""
    printed = read_printed_since(mark)
    assert not find_errors(printed), "printed:\n" + "\n".join(list(dict.fromkeys(printed.splitlines()))[:40])


def wait_until(is_true, limit=300.0, what=""):
    """Wait until something is true, and return the seconds that it took. `what` is told where it never is: a text, or a
    function that says what there is instead. The limit is for what hangs; the slowest machine gets there long
    before."""
    start = time.monotonic()
    while not is_true():
        description = (what() if callable(what) else what) if time.monotonic() - start > limit else ""
        assert time.monotonic() - start < limit, f"not so after {limit:g} s: {description!r}; at work: {list_running()}"
        yield 0.05
    return time.monotonic() - start


def list_running():
    """What is still at work, or begins by itself in a moment, and so may still change the file; empty where nothing
is."""
    manager = bpy.context.window_manager
    busy = [operator.bl_idname for operator in window.window.modal_operators]
    busy += [work for work in (manager.beyond_mocap_work.kind, manager.beyond_mocap_work.waiting) if work]
    live = [f"scene.{name}.live" for name in ("path_editing", "ball", "passes")]
    busy += [name for name in live if import_module(name).WATCHER.dirty]
    busy += ["scene.result.freshness"] if get_settings().live and import_module(
        "scene.result.freshness").LIVE.dirty else []
    has_throw = any(one.type == "ARMATURE" and one.beyond_mocap_throw.made for one in window.window.scene.objects)
    busy += ["scene.throws.preview"] if has_throw and import_module("scene.throws.preview").WATCHER.dirty else []
    waits = import_module("scene.timeline.strip_events")._run_scheduled in import_module("scene.core.live")._timers
    return busy + ["scene.timeline.strip_events"] * waits


def wait_until_settled(limit=300.0):
    """Wait until nothing is at work any more, nor about to begin: what was done just now has had all its
    consequences."""
    quiet = 0

    def is_settled():
        nonlocal quiet
        quiet = 0 if list_running() else quiet + 1
        return quiet > 3  # between the end of one thing and the beginning of the next there may be a look

    yield 0.05
    yield from wait_until(is_settled, limit)


def list_tasks():
    """The tasks between which the switch at the top of the tab chooses."""
    return [row[0] for row in import_module("scene.core.settings").TASKS]


def find_tasks(text):
    """The tasks that have a panel whose code names this operator or property; empty where every task has one, and
    where none has."""
    found = []
    for panel in bpy.types.Panel.__subclasses__():
        if not panel.__module__.startswith(EXTENSION) or not panel.is_registered or not hasattr(panel, "task"):
            continue
        if re.search(rf"\b{re.escape(text)}\b", inspect.getsource(sys.modules[panel.__module__])):
            found.append(panel.task)
    return [] if "" in found else found


def open_task(task):
    """Choose a task at the top of the tab; without an undo step, so that what is undone is what a check did."""
    if get_settings().task != task:
        get_settings().task = task
        for area in window.window.screen.areas:
            area.tag_redraw()
        yield 0.3


def open_task_of(text):
    """Choose a task that has this operator or property, where the one that is chosen has not."""
    found = find_tasks(text)
    if found and get_settings().task not in found:
        yield from open_task(found[0])


def press_all_buttons(operators=None):
    """Press each button of the tab (or only the wanted operators'), task by task and page by page; return the calls
    that were pressed. Whatever began is ended by Escape."""
    yield from window.open_tab(window.find_area("VIEW_3D"), TAB)
    wanted = {task for operator in operators or () for task in find_tasks(operator)}
    pressed = []
    for task in list_tasks():
        if operators is None or task in (wanted or {get_settings().task}):
            yield from open_task(task)
            pressed += yield from press_buttons_of_task(operators, pressed)
    return pressed


def press_buttons_of_task(operators, known):
    """Press each button of the task in front that is not among the `known` calls; return the calls."""
    area = window.find_area("VIEW_3D")
    region = window.find_sidebar(area)
    yield from window.scroll_to_top(area, region)
    pressed, usable, more = [], {}, True

    def is_new(call):
        usable[call] = can_run(call)
        is_known = strip_notice(call) in map(strip_notice, (*known, *pressed))
        return not is_known and (operators is None or parse_operator(call) in operators)

    while more:
        _, call = yield from window.scan_region(area, region, window.command_under_pointer, is_new)
        if call:
            pressed.append(call)
            reaction = yield from close_opened()
            yield from window.escape_from(window.window)  # a dialog, of which nothing can be read
            output.write_line(f"     pressed {call}: {reaction if usable[call] else 'greyed out'}")
        more = call or (yield from window.scroll_region(area, region))
    return pressed


def strip_notice(call):
    """A call without the number of the notice that it is about: each new failure has another."""
    return re.sub(r"\bnotice=\d+", "notice", call)


def click_operator(operator, *words, editor="VIEW_3D", limit=120.0):
    """Click the operator's button in the tab that is in front, once it is there and may be pressed. `operator` may go
    on with its first arguments; `words` are others of its call."""
    area = window.find_area(editor)
    begins = f"bpy.ops.beyond_mocap.{operator}" + "(" * ("(" not in operator)

    def is_meant(call):
        return call.startswith(begins) and all(word in call for word in words)

    yield from wait_until(lambda: can_run(begins, editor), limit, f"{operator} may be pressed")
    yield from window.click_first(area, window.find_sidebar(area), is_meant, window.command_under_pointer, limit)


def press_button(operator, editor="VIEW_3D"):
    """Find the operator's button in our tab, in whichever task it is, and click it; `operator` may go on with its first
    arguments."""
    yield from window.open_tab(window.find_area(editor), TAB)
    if editor == "VIEW_3D":
        yield from open_task_of(operator.partition("(")[0])
    yield from click_operator(operator, editor=editor)


def fill_in(path, text, editor="VIEW_3D"):
    """Find the field of a property in our tab by the end of its data path, and type into it."""
    area = window.find_area(editor)
    yield from window.open_tab(area, TAB)
    if editor == "VIEW_3D":
        yield from open_task_of(path.rpartition(".")[2])
    yield from window.click_first(
        area, window.find_sidebar(area), lambda found: found.endswith(path), window.field_under_pointer
    )
    yield 0.3
    yield from window.press_key("LEFTMOUSE")
    yield 0.3
    yield from window.type_text(text)
    yield 0.3


def find_file_browser():
    """The file browser that is open: its window and its area; None and None where there is none."""
    for other in bpy.context.window_manager.windows:
        for area in other.screen.areas:
            if area.type == "FILE_BROWSER" and area.spaces.active.params is not None:
                return other, area
    return None, None


def choose_file(path):
    """Choose a file in the file browser that is open, as one who types its folder and name and presses Enter."""
    yield from wait_until(lambda: find_file_browser()[0] is not None, 60.0, "no file browser has opened")
    parameters = find_file_browser()[1].spaces.active.params
    parameters.directory, parameters.filename = str(path.parent).encode(), path.name
    yield 1.0
    start = time.monotonic()
    while find_file_browser()[0] is not None:  # while it still reads the folder it hears nothing
        assert time.monotonic() - start < 60.0, "the file browser does not close"
        other, area = find_file_browser()
        middle = {"x": area.x + area.width // 2, "y": area.y + area.height // 2}
        other.event_simulate(type="MOUSEMOVE", value="NOTHING", **middle)
        yield 0.2
        other.event_simulate(type="RET", value="PRESS", **middle)
        yield 1.0


def parse_operator(call):
    """The operator's name in a call as Blender writes it.

    >>> parse_operator("bpy.ops.beyond_mocap.build_library(rebuild=True)")
    'build_library'
    """
    return call.split("(")[0].rpartition(".")[2]


def can_run(call, editor="VIEW_3D"):
    """Whether a button's operator says that it can be used just now."""
    group, name = call.split("(")[0].split(".")[-2:]
    area = window.find_area(editor)
    with bpy.context.temp_override(window=window.window, area=area, region=window.find_sidebar(area)):
        return getattr(getattr(bpy.ops, group), name).poll()


def close_opened(limit=300.0):
    """Leave the file browser, dialog or running operator that a button brought up; say which it was."""
    manager, start = bpy.context.window_manager, time.monotonic()
    reaction = "done"
    while time.monotonic() - start < limit:
        other = next((w for w in manager.windows if any(a.type == "FILE_BROWSER" for a in w.screen.areas)), None)
        running = [operator.bl_idname for operator in window.window.modal_operators]
        if other is None and not running:
            return reaction
        reaction = "opened the file browser" if other else f"ran {running}"
        yield from window.escape_from(other or window.window)
        yield 0.3
    raise AssertionError(f"{reaction} and did not end by Escape")


def wait_for_work():
    """Wait until no operator is running any more, nor anything that it started; say how long it took."""
    start = time.monotonic()
    yield from wait_until_settled()
    return f"took {time.monotonic() - start:.1f} s"


def is_moving(body):
    """Whether an armature's bones stand differently at two frames of the scene."""
    scene = bpy.context.scene
    poses = []
    for frame in (scene.frame_start, (scene.frame_start + scene.frame_end) // 2):
        scene.frame_set(frame)
        poses.append([tuple(bone.matrix.translation) for bone in body.pose.bones])
    return poses[0] != poses[1]
