"""The timeline in the NLA editor, as an animator uses it: Blender's own keys on strips, names of key moments, undo."""

import importlib

import bpy
from tab import EXTENSION, PICTURES, output, sample, window

LIMIT = 300


def room(name):
    """A module of the extension by its dotted name."""
    return importlib.import_module(f"{EXTENSION}.{name}")


def nla():
    """The NLA editor."""
    return window.area("NLA_EDITOR")


def open_nla():
    """The largest editor of the screen becomes an NLA editor, all strips in view."""
    max(window.window.screen.areas, key=lambda area: area.width * area.height).ui_type = "NLA_EDITOR"
    yield 0.5
    with in_nla():
        bpy.ops.nla.view_all()
    yield 0.5


def in_nla():
    """The context of the NLA editor's strips."""
    area = nla()
    region = next(region for region in area.regions if region.type == "WINDOW")
    return bpy.context.temp_override(window=window.window, screen=window.window.screen, area=area, region=region)


def asked():
    """What the first player's strips ask for, as text."""
    scene = bpy.context.scene
    read = room("scene.strips").read(scene.beyond_mocap.players[0], scene)
    return room("beyond_mocap.annotation").format_timeline(read)


def own_keys(key, **held):
    """Press a key with the pointer in the NLA editor; modifiers as event_simulate takes them."""
    area = nla()
    x, y = area.x + area.width // 2, area.y + area.height // 2
    yield from window.move(x, y)
    yield 0.1
    window.window.event_simulate(type=key, value="PRESS", x=x, y=y, **held)
    yield 0.1
    window.window.event_simulate(type=key, value="RELEASE", x=x, y=y, **held)
    yield 0.6


def select(name):
    """Let only this strip of the dot be selected."""
    dot = bpy.context.scene.beyond_mocap.players[0].dot
    for track in dot.animation_data.nla_tracks:
        for strip in track.strips:
            strip.select = strip.name == name


def strip_of(name):
    """The strip of that name."""
    dot = bpy.context.scene.beyond_mocap.players[0].dot
    return next(strip for track in dot.animation_data.nla_tracks for strip in track.strips if strip.name == name)


def begin():
    """An empty file with the sample's first player, his strips in an NLA editor."""
    bpy.ops.wm.read_homefile(app_template="")
    yield 1.0
    bpy.context.preferences.view.show_splash = False
    bpy.ops.beyond_mocap.import_tracking("EXEC_DEFAULT", True, filepath=str(sample() / "match" / "player1.csv"))
    yield 0.5
    yield from open_nla()


def in_order():
    """Nothing is left to be put in order."""
    return not room("scene.strip_events").put_in_order(bpy.context.scene)


def check_splitting_by_key_and_undo():
    yield from begin()
    before = asked()
    assert "2.4 8 jogging dribble" in before, before
    bpy.context.scene.frame_set(97)
    bpy.ops.ed.undo_push(message="frame")
    select("jogging dribble")
    yield from own_keys("Y")
    split = asked()
    assert "2.4 4 jogging dribble\n4 8 jogging dribble" in split, split
    assert in_order() and strip_of("jogging dribble").action.users == 1
    yield from own_keys("Z", ctrl=True)
    assert asked() == before, asked()
    yield from own_keys("Z", ctrl=True, shift=True)
    assert asked() == split, asked()
    assert in_order() and len({strip_of(n).action.name for n in ("jogging dribble", "jogging dribble.001")}) == 2
    yield from own_keys("Z", ctrl=True)
    yield from own_keys("Z", ctrl=True, shift=True)
    yield from own_keys("Z", ctrl=True)
    assert asked() == before, asked()
    assert in_order()


def check_dragging_by_key_and_undo():
    yield from begin()
    before = asked()
    select("jogging dribble")
    yield from own_keys("G")
    x, y = window.pointer
    for step in range(1, 6):
        yield from window.move(x + 12 * step, y)
    yield from window.press("LEFTMOUSE")
    yield 0.6
    moved = asked()
    strip = strip_of("jogging dribble")
    assert moved != before and strip.frame_start % 1 == 0, (moved, strip.frame_start)
    assert strip.frame_end - strip.frame_start == 134 and in_order()
    yield from own_keys("Z", ctrl=True)
    assert asked() == before
    yield from own_keys("Z", ctrl=True, shift=True)
    assert asked() == moved
    window.picture(PICTURES / "timeline-dragged.png")


def check_scaling_duplicating_and_deleting():
    yield from begin()
    before = asked()
    select("jogging dribble")
    with in_nla():
        bpy.ops.transform.transform("EXEC_DEFAULT", True, mode="TIME_SCALE", value=(0.5, 0, 0, 0))
    yield 0.5
    scaled, strip = asked(), strip_of("jogging dribble")
    assert scaled != before and strip.scale == 1.0 and in_order()
    assert strip.action.frame_range[:] == (strip.frame_start, strip.frame_end)
    with in_nla():
        bpy.ops.nla.duplicate_move("EXEC_DEFAULT", True, TRANSFORM_OT_translate={"value": (300.4, 0, 0)})
    yield 0.5
    doubled = asked()
    assert doubled.count("jogging dribble") == 3 and in_order(), doubled
    assert strip_of("jogging dribble.001").frame_start % 1 == 0
    with in_nla():
        bpy.ops.nla.delete("EXEC_DEFAULT", True)
    yield 0.5
    assert asked() == scaled
    for expected in (doubled, scaled, before):
        yield from own_keys("Z", ctrl=True)
        assert asked() == expected, (expected, asked())
    for expected in (scaled, doubled, scaled):
        yield from own_keys("Z", ctrl=True, shift=True)
        assert asked() == expected, (expected, asked())
    assert in_order()


def check_muting_meta_and_swapping():
    yield from begin()
    before = asked()
    select("jogging dribble")
    with in_nla():
        bpy.ops.nla.mute_toggle("EXEC_DEFAULT", True)
    yield 0.4
    assert asked() == before.replace("2.4 8 jogging dribble\n", "")
    with in_nla():
        bpy.ops.nla.mute_toggle("EXEC_DEFAULT", True)
    yield 0.4
    assert asked() == before
    strip_of("celebration running arms outside").select = True
    with in_nla():
        bpy.ops.nla.meta_add("EXEC_DEFAULT", True)
    yield 0.4
    assert asked() == before and in_order()
    with in_nla():
        bpy.ops.nla.meta_remove("EXEC_DEFAULT", True)
    yield 0.4
    assert asked() == before and in_order()


def check_another_frame_rate():
    yield from begin()
    before, scene = asked(), bpy.context.scene
    scene.render.fps = 50
    bpy.ops.ed.undo_push(message="rate")
    yield 0.6
    assert strip_of("jogging dribble").frame_start == 121, strip_of("jogging dribble").frame_start
    assert asked() == before and in_order()
    yield from own_keys("Z", ctrl=True)
    assert bpy.context.scene.render.fps == 24 and strip_of("jogging dribble").frame_start == 59
    assert asked() == before and in_order()
