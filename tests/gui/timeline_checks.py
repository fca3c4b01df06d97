"""The timeline in the NLA editor, as an animator uses it: Blender's own keys on strips, names of key moments, undo."""

import bpy
from tab import PICTURES, TAB, operator_of, press, room, sample, settled, until, window


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
    read = room("scene.timeline.strips").read(scene.beyond_mocap.players[0], scene)
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
    yield 0.2
    if key != "G":  # that one goes on until it is confirmed
        yield from settled()


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
    yield 0.5
    bpy.context.preferences.view.show_splash = False
    bpy.ops.beyond_mocap.import_tracking("EXEC_DEFAULT", True, filepath=str(sample() / "match" / "player1.csv"))
    yield 0.5
    yield from open_nla()


def in_order():
    """Nothing is left to be put in order."""
    return not room("scene.timeline.strip_events").put_in_order(bpy.context.scene)


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
    assert in_order() and len({strip_of(n).action.name for n in ("jogging dribble", "jogging dribble ")}) == 2
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
    yield from settled()
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
    yield from settled()
    scaled, strip = asked(), strip_of("jogging dribble")
    assert scaled != before and strip.scale == 1.0 and in_order()
    assert strip.action.frame_range[:] == (strip.frame_start, strip.frame_end)
    with in_nla():
        bpy.ops.nla.duplicate_move("EXEC_DEFAULT", True, TRANSFORM_OT_translate={"value": (300.4, 0, 0)})
    yield from settled()
    doubled = asked()
    assert doubled.count("jogging dribble") == 3 and in_order(), doubled
    assert strip_of("jogging dribble ").frame_start % 1 == 0
    with in_nla():
        bpy.ops.nla.delete("EXEC_DEFAULT", True)
    yield from settled()
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
    yield from settled()
    assert asked() == before.replace("2.4 8 jogging dribble\n", "")
    with in_nla():
        bpy.ops.nla.mute_toggle("EXEC_DEFAULT", True)
    yield from settled()
    assert asked() == before
    strip_of("celebration running arms outside").select = True
    with in_nla():
        bpy.ops.nla.meta_add("EXEC_DEFAULT", True)
    yield from settled()
    assert asked() == before and in_order()
    with in_nla():
        bpy.ops.nla.meta_remove("EXEC_DEFAULT", True)
    yield from settled()
    assert asked() == before and in_order()


def check_another_frame_rate():
    yield from begin()
    before, scene = asked(), bpy.context.scene
    scene.render.fps = 50
    bpy.ops.ed.undo_push(message="rate")
    yield from settled()
    assert strip_of("jogging dribble").frame_start == 121, strip_of("jogging dribble").frame_start
    assert asked() == before and in_order()
    yield from own_keys("Z", ctrl=True)
    assert bpy.context.scene.render.fps == 24 and strip_of("jogging dribble").frame_start == 59
    assert asked() == before and in_order()


def name_at(text):
    """The drawn name with this text, and its middle in pixels of the window."""
    area = nla()
    region = next(region for region in area.regions if region.type == "WINDOW")
    with in_nla():
        found = next(one for one in room("scene.timeline.moment_names").names(bpy.context, region) if one.text == text)
    left, bottom, right, top = found.box
    return found, (int(region.x + (left + right) / 2), int(region.y + (bottom + top) / 2))


def picked():
    """The words of the picked key moment."""
    moments = room("scene.timeline.lanes").moments(bpy.context.scene.beyond_mocap.players[0].dot)
    moment = next((moment for moment in moments if moment.selected), None)
    return " ".join(moment.words) if moment else ""


def check_names_are_drawn_and_picked_by_a_click():
    yield from begin()
    before = asked()
    found, place = name_at("receive right foot low inside")
    assert not found.picked
    yield from window.click(*place)
    yield from settled()
    assert picked() == "receive right foot low inside", picked()
    assert asked() == before and not window.window.modal_operators.keys()
    window.picture(PICTURES / "timeline-names.png")
    yield from own_keys("Z", ctrl=True)
    assert picked() == "", picked()
    strip = strip_of("jogging dribble")
    strip.select = False
    yield from window.click(*place_of(strip))
    yield 0.3
    assert strip_of("jogging dribble").select, "a click beside the names is no longer Blender's"


def place_of(strip):
    """The middle of a strip on the first lane of words, in pixels of the window; found by trying rows."""
    region = next(region for region in nla().regions if region.type == "WINDOW")
    x = region.view2d.view_to_region((strip.frame_start + strip.frame_end) / 2, 0, clip=False)[0]
    return int(region.x + x), int(region.y + region.height - strips_top())


def strips_top():
    """Pixels from the region's top to the lane of words: frame numbers, then five rows before it."""
    return 176 * bpy.context.preferences.system.ui_scale


def check_a_name_is_dragged_and_put_back_by_escape():
    yield from begin()
    before = asked()
    found, (x, y) = name_at("kick right running low inside")
    for ending in ("ESC", "RELEASE"):
        yield from window.move(x, y)
        window.event("LEFTMOUSE", "PRESS")
        yield 0.1
        for step in range(1, 7):
            yield from window.move(x + 10 * step, y)
        yield 0.2
        during = asked()
        assert during != before, "nothing has moved"
        if ending == "ESC":
            yield from window.press("ESC")
            window.event("LEFTMOUSE", "RELEASE")
            yield from settled()
            assert asked() == before, asked()
        else:
            window.picture(PICTURES / "timeline-drag.png")
            window.event("LEFTMOUSE", "RELEASE")
            yield from settled()
            assert asked() == during
    moved = asked()
    yield from own_keys("Z", ctrl=True)
    assert asked() == before, asked()
    yield from own_keys("Z", ctrl=True, shift=True)
    assert asked() == moved, asked()


def check_the_tab_in_the_nla_editor():
    yield from begin()
    with in_nla():
        bpy.ops.screen.area_split(direction="HORIZONTAL", factor=0.45)
    yield 0.5
    with in_nla():
        bpy.ops.nla.view_all()
    area = nla()
    yield from window.open_tab(area, TAB)
    room("scene.timeline.strips").set_automatic(bpy.context, bpy.context.scene.beyond_mocap.players[0], room(
        "beyond_mocap.annotation").parse_timeline("0 2.4 standing\n8 17 jogging\n17 19.2 walking\n24.2 26.4 running\n"))
    select("jogging dribble")
    with in_nla():
        bpy.ops.beyond_mocap.edit_words("EXEC_DEFAULT", True, words="joging dribble")
        bpy.ops.beyond_mocap.go_to_moment("EXEC_DEFAULT", True, strip="Moments", index=1)
    yield from settled()
    window.picture(PICTURES / "timeline-tab.png")
    region = window.sidebar(area)
    found, _ = yield from window.scan(area, region, window.command_under_pointer)
    operators = {operator_of(call) for call in found}
    wanted = {"go_to_moment", "add_moment", "move_moment", "delete_moment", "edit_words", "mirror_side", "add_span",
              "split_span"}
    assert wanted <= operators, wanted - operators
    yield from press("go_to_moment", "index=2", editor="NLA_EDITOR")
    yield from until(lambda: picked() == "kick right running low top", what=picked)
    assert bpy.context.scene.frame_current == round(1 + 24.8 * 24), bpy.context.scene.frame_current


def check_many_names_do_not_overlap():
    yield from begin()
    parse, strips = room("beyond_mocap.annotation").parse_timeline, room("scene.timeline.strips")
    words = "".join(
        f"{1 + n / 3:.3f} kick right running low inside {'front' if n % 2 else 'back'}\n" for n in range(80)
    )
    strips.write(bpy.context, bpy.context.scene.beyond_mocap.players[0], parse(words))
    bpy.context.preferences.view.ui_scale = 1.3
    yield from settled()
    with in_nla():
        bpy.ops.nla.view_all()
    yield 0.5
    region = next(region for region in nla().regions if region.type == "WINDOW")
    with in_nla():
        boxes = [one.box for one in room("scene.timeline.moment_names").names(bpy.context, region)]
    window.picture(PICTURES / "timeline-many.png")
    bpy.context.preferences.view.ui_scale = 1.0
    yield 0.5
    assert len(boxes) > 5
    for number, a in enumerate(boxes):
        assert 0 <= a[0] and a[2] <= region.width and a[3] < region.height
        for b in boxes[:number]:
            assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1], (a, b)


def check_names_in_the_dope_sheet():
    yield from begin()
    nla().ui_type = "DOPESHEET"
    yield from settled()
    area = window.area("DOPESHEET_EDITOR")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window.window, screen=window.window.screen, area=area, region=region):
        bpy.ops.action.view_all()
        found = room("scene.timeline.moment_names").names(bpy.context, region)
    yield 0.5
    window.picture(PICTURES / "timeline-dope-sheet.png")
    assert found, "no name is drawn"
    bpy.context.scene.beyond_mocap.show_moment_names = False
    with bpy.context.temp_override(window=window.window, screen=window.window.screen, area=area, region=region):
        assert not room("scene.timeline.moment_names").shown(bpy.context)


def check_an_automatic_strip_that_is_dragged_is_asked_for():
    yield from begin()
    parse, player = room("beyond_mocap.annotation").parse_timeline, bpy.context.scene.beyond_mocap.players[0]
    room("scene.timeline.strips").set_automatic(bpy.context, player, parse("0 2.4 standing\n8 17 jogging\n"))
    bpy.ops.ed.undo_push(message="synthesis")
    before = asked()
    select("jogging")
    with in_nla():
        bpy.ops.transform.transform("EXEC_DEFAULT", True, mode="TRANSLATION", value=(24, 0, 0, 0))
    yield from settled()
    touched = asked()
    assert "9 18 jogging\n" in touched and in_order(), touched
    assert not strip_of("jogging").mute
    bpy.context.scene.frame_set(3)
    bpy.ops.ed.undo_push(message="another step")
    for expected in (touched, before):
        yield from own_keys("Z", ctrl=True)
        assert asked() == expected, asked()
    assert strip_of("jogging").mute
    for _ in range(2):
        yield from own_keys("Z", ctrl=True, shift=True)
        assert asked() == touched and in_order(), asked()


def check_a_new_name_is_new_words():
    yield from begin()
    before = asked()
    strip_of("jogging dribble").name = "Jogging  left"
    bpy.ops.ed.undo_push(message="rename")
    yield from settled()
    renamed = asked()
    assert "2.4 8 jogging left\n" in renamed and "jogging left" in strip_of("jogging left").action.name
    yield from own_keys("Z", ctrl=True)
    assert asked() == before
    yield from own_keys("Z", ctrl=True, shift=True)
    assert asked() == renamed


def check_saved_in_the_middle_and_opened_again():
    yield from begin()
    select("jogging dribble")
    with in_nla():
        bpy.ops.transform.transform("EXEC_DEFAULT", True, mode="TIME_SCALE", value=(0.7, 0, 0, 0))
    path = str((PICTURES / "timeline.blend").resolve())
    bpy.ops.wm.save_as_mainfile(filepath=path)  # before the strips came in order
    moved = asked()
    bpy.ops.wm.open_mainfile(filepath=path)
    yield from until(lambda: strip_of("jogging dribble").scale == 1.0)
    yield from settled()
    assert asked() == moved and in_order(), asked()
