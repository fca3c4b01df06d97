"""The sample inside the extension, by pointer and keys from a fresh Blender: the first moving character, and the sample
of every task; seconds and presses counted."""

import pathlib
import time

import bpy
from tab import (
    EXTENSION,
    PICTURES,
    TAB,
    click_operator,
    import_module,
    is_moving,
    output,
    read_printed_since,
    report_time,
    wait_until,
    wait_until_settled,
    window,
)

FIRST_SECONDS, FIRST_PRESSES = 20.0, 4  # until a character moves, in a Blender that was just started
SECONDS = {"MATCH": 60.0, "PATH": 10.0, "PASSES": 30.0, "THROW": 30.0, "MARKERS": 20.0}
TASKS = {"PLAYER": "PLAYER", "MATCH": "MATCH", "PATH": "PATH", "PASSES": "BALL", "THROW": "BALL", "MARKERS": "MARKERS"}
NEEDED = {"PLAYER": {"Ball", "player1"}, "MATCH": {"Match ball"}, "PATH": {"jogging_2_9"}, "PASSES": {"Passing Ball"},
          "THROW": {"Thrown Ball"}, "MARKERS": {"walk"}}


def open_fresh_file():
    """The file that Blender starts with: a cube, a lamp, a camera, and an NLA editor nowhere."""
    bpy.ops.wm.read_homefile(load_ui=True)
    yield 1.0
    assert not [area for area in window.window.screen.areas if area.type == "NLA_EDITOR"]


def press_load_sample(which):
    """N, the tab, Load Sample; return the seconds until it is done and the presses."""
    area = window.find_area("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    yield from window.move_pointer(region.x + region.width // 2, region.y + region.height // 2)
    presses = 0
    if not area.spaces.active.show_region_ui:
        yield from window.press_key("N")
        presses += 1
    yield 0.3
    window.find_sidebar(area).active_panel_category = TAB
    presses += 1  # the tab
    yield from wait_until(lambda: window.find_sidebar(area).active_panel_category == TAB, 20.0)
    yield 0.5
    if TASKS[which] != window.window.scene.beyond_mocap.task:
        window.window.scene.beyond_mocap.task = TASKS[which]
        presses += 1  # the switch at the top of the tab
        yield 0.5
    yield from click_operator("load_sample", *([f"which='{which}'"] if which == "THROW" else []), limit=60.0)
    presses, start, busy = presses + 1, time.monotonic(), time.process_time()
    yield 0.2
    yield from wait_until(lambda: not window.window.modal_operators
                          and window.window.screen.is_animation_playing, what=lambda: list_reports()[-3:])
    output.write_line(f"     {which.lower()}: {time.process_time() - busy:.1f} s of the processors in Blender")
    return time.monotonic() - start, presses


def list_reports():
    """What Blender's Info editor holds."""
    return [report.message for report in getattr(bpy.context.window_manager, "reports", ())]


def list_bodies():
    """The armatures of the scene that move."""
    return [thing for thing in window.window.scene.objects if thing.type == "ARMATURE" and is_moving(thing)]


def measure_view(things):
    """The largest height in pixels of these objects in the 3D view, and how many of them are in it."""
    from bpy_extras.view3d_utils import location_3d_to_region_2d
    from mathutils import Vector

    area = window.find_area("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    heights, count = [], 0
    for thing in things:
        corners = [location_3d_to_region_2d(region, area.spaces.active.region_3d, bone.matrix.translation.copy())
                   for bone in thing.pose.bones]
        assert isinstance(thing.location, Vector)
        seen = [c for c in corners if c is not None and 0 <= c.x <= region.width and 0 <= c.y <= region.height]
        count += len(seen) == len(corners)
        heights += [max(c.y for c in seen) - min(c.y for c in seen)] if seen else []
    return max(heights, default=0.0), count


def load_and_look(which, limit, presses_allowed=FIRST_PRESSES):
    """Load the sample of a task in a fresh file: something moves, in the view, and nothing of the file is lost."""
    yield from open_fresh_file()
    mark, before = len(output.text()), {thing.name for thing in bpy.data.objects}
    own = window.window.scene
    seconds, presses = yield from press_load_sample(which)
    report_time(f"{which.lower()}: seconds until it moves", seconds, limit)
    assert presses <= presses_allowed, presses
    yield 1.0
    window.save_picture(PICTURES / f"sample-{which.lower()}.png")
    with bpy.context.temp_override(window=window.window):
        bpy.ops.screen.animation_cancel(restore_frame=False)
    assert {thing.name for thing in own.objects} == before, "the scene that was there has changed"
    names = {thing.name for thing in window.window.scene.objects}
    assert NEEDED[which] <= names, f"{NEEDED[which] - names} not among {names}"
    bodies = list_bodies()
    assert bodies, "no armature moves"
    scene = window.window.scene
    scene.frame_set((scene.frame_start + scene.frame_end) // 2)
    yield 0.5
    window.save_picture(PICTURES / f"sample-{which.lower()}-middle.png")
    height, count = measure_view(bodies)
    output.write_line(f"     {which.lower()}: {presses} presses, {len(bodies)} moving, {count} wholly in the view, the "
                      f"largest {height:.0f} pixels high")
    assert count, "none of them is in the view"
    assert "UserWarning" not in read_printed_since(mark), read_printed_since(mark)


def check_first_minute():
    """The first press of a new user: a player near, in the light, with the ball, and the NLA editor below."""
    yield from load_and_look("PLAYER", FIRST_SECONDS)
    assert [area for area in window.window.screen.areas if area.type == "NLA_EDITOR"], "no NLA editor"
    yield from undo_sample()


def undo_sample():
    """Undo removes it all, redo brings it back."""
    for key, wanted in (({"ctrl": True}, False), ({"ctrl": True, "shift": True}, True)):
        area = window.find_area("VIEW_3D")
        yield from window.move_pointer(area.x + area.width // 2, area.y + area.height // 2)
        for _ in range(4):
            if bool(list_players()) == wanted:
                break
            yield from window.press_key("Z", **key)
            yield from wait_until_settled()
        assert bool(list_players()) == wanted, list_players()


def list_players():
    """The players of all scenes."""
    return [player.name for scene in bpy.data.scenes for player in scene.beyond_mocap.players]


def check_match():
    yield from load_and_look("MATCH", SECONDS["MATCH"])


def check_path():
    yield from load_and_look("PATH", SECONDS["PATH"])


def check_passes():
    yield from load_and_look("PASSES", SECONDS["PASSES"])


def check_throw():
    yield from load_and_look("THROW", SECONDS["THROW"])


def check_markers():
    yield from load_and_look("MARKERS", SECONDS["MARKERS"])


def check_extension_folder_is_only_read():
    """All of this has written nothing into the extension's folder."""
    folder = import_module("scene.core.sample").FOLDER
    assert EXTENSION.split(".")[-1] in folder.parts
    written = [path for path in folder.rglob("*") if path.name == ".beyond_mocap" or "s " in path.name]
    assert not written, written
    assert pathlib.Path(folder, "library").is_dir()
    yield 0
