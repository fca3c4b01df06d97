"""The timeline in the NLA editor, as an animator uses it: Blender's own keys on strips, names of key moments, undo."""

import bpy
from tab import (
    PICTURES,
    TAB,
    click_operator,
    copy_sample,
    import_module,
    parse_operator,
    wait_until,
    wait_until_settled,
    window,
)


def find_nla():
    """The NLA editor."""
    return window.find_area("NLA_EDITOR")


def open_nla():
    """The largest editor of the screen becomes an NLA editor, all strips in view."""
    max(window.window.screen.areas, key=lambda area: area.width * area.height).ui_type = "NLA_EDITOR"
    yield 0.5
    with override_nla():
        bpy.ops.nla.view_all()
    yield 0.5


def override_nla():
    """The context of the NLA editor's strips."""
    area = find_nla()
    region = next(region for region in area.regions if region.type == "WINDOW")
    return bpy.context.temp_override(window=window.window, screen=window.window.screen, area=area, region=region)


def format_strips():
    """What the first player's strips ask for, as text."""
    scene = bpy.context.scene
    read = import_module("scene.timeline.strips").read_player_timeline(scene.beyond_mocap.players[0], scene)
    return import_module("beyond_mocap.annotation").format_timeline(read)


def press_in_nla(key, **held):
    """Press a key with the pointer in the NLA editor; modifiers as event_simulate takes them."""
    area = find_nla()
    x, y = area.x + area.width // 2, area.y + area.height // 2
    yield from window.move_pointer(x, y)
    yield 0.1
    window.window.event_simulate(type=key, value="PRESS", x=x, y=y, **held)
    yield 0.1
    window.window.event_simulate(type=key, value="RELEASE", x=x, y=y, **held)
    yield 0.2
    if key != "G":  # that one goes on until it is confirmed
        yield from wait_until_settled()


def select_strip(name):
    """Let only this strip of the dot be selected."""
    dot = bpy.context.scene.beyond_mocap.players[0].dot
    for track in dot.animation_data.nla_tracks:
        for strip in track.strips:
            strip.select = strip.name == name


def find_strip(name):
    """The strip of that name."""
    dot = bpy.context.scene.beyond_mocap.players[0].dot
    return next(strip for track in dot.animation_data.nla_tracks for strip in track.strips if strip.name == name)


def open_sample():
    """An empty file with the sample's first player, his strips in an NLA editor."""
    bpy.ops.wm.read_homefile(app_template="")
    yield 0.5
    bpy.context.preferences.view.show_splash = False
    bpy.ops.beyond_mocap.import_tracking("EXEC_DEFAULT", True, filepath=str(copy_sample() / "match" / "player1.csv"))
    yield 0.5
    yield from open_nla()


def is_in_order():
    """Nothing is left to be put in order."""
    return not import_module("scene.timeline.strip_events").normalize_strips(bpy.context.scene)


def check_splitting_by_key_and_undo():
    yield from open_sample()
    before = format_strips()
    assert "2.4 8 jogging dribble" in before, before
    bpy.context.scene.frame_set(97)
    bpy.ops.ed.undo_push(message="frame")
    select_strip("jogging dribble")
    yield from press_in_nla("Y")
    split = format_strips()
    assert "2.4 4 jogging dribble\n4 8 jogging dribble" in split, split
    assert is_in_order() and find_strip("jogging dribble").action.users == 1
    yield from press_in_nla("Z", ctrl=True)
    assert format_strips() == before, format_strips()
    yield from press_in_nla("Z", ctrl=True, shift=True)
    assert format_strips() == split, format_strips()
    assert is_in_order() and len({find_strip(n).action.name for n in ("jogging dribble", "jogging dribble ")}) == 2
    yield from press_in_nla("Z", ctrl=True)
    yield from press_in_nla("Z", ctrl=True, shift=True)
    yield from press_in_nla("Z", ctrl=True)
    assert format_strips() == before, format_strips()
    assert is_in_order()


def check_dragging_by_key_and_undo():
    yield from open_sample()
    before = format_strips()
    select_strip("jogging dribble")
    yield from press_in_nla("G")
    x, y = window.pointer
    for step in range(1, 6):
        yield from window.move_pointer(x + 12 * step, y)
    yield from window.press_key("LEFTMOUSE")
    yield from wait_until_settled()
    moved = format_strips()
    strip = find_strip("jogging dribble")
    assert moved != before and strip.frame_start % 1 == 0, (moved, strip.frame_start)
    assert strip.frame_end - strip.frame_start == 134 and is_in_order()
    yield from press_in_nla("Z", ctrl=True)
    assert format_strips() == before
    yield from press_in_nla("Z", ctrl=True, shift=True)
    assert format_strips() == moved
    window.save_picture(PICTURES / "timeline-dragged.png")


def check_scaling_duplicating_and_deleting():
    yield from open_sample()
    before = format_strips()
    select_strip("jogging dribble")
    with override_nla():
        bpy.ops.transform.transform("EXEC_DEFAULT", True, mode="TIME_SCALE", value=(0.5, 0, 0, 0))
    yield from wait_until_settled()
    scaled, strip = format_strips(), find_strip("jogging dribble")
    assert scaled != before and strip.scale == 1.0 and is_in_order()
    assert strip.action.frame_range[:] == (strip.frame_start, strip.frame_end)
    with override_nla():
        bpy.ops.nla.duplicate_move("EXEC_DEFAULT", True, TRANSFORM_OT_translate={"value": (300.4, 0, 0)})
    yield from wait_until_settled()
    doubled = format_strips()
    assert doubled.count("jogging dribble") == 3 and is_in_order(), doubled
    assert find_strip("jogging dribble ").frame_start % 1 == 0
    with override_nla():
        bpy.ops.nla.delete("EXEC_DEFAULT", True)
    yield from wait_until_settled()
    assert format_strips() == scaled
    for expected in (doubled, scaled, before):
        yield from press_in_nla("Z", ctrl=True)
        assert format_strips() == expected, (expected, format_strips())
    for expected in (scaled, doubled, scaled):
        yield from press_in_nla("Z", ctrl=True, shift=True)
        assert format_strips() == expected, (expected, format_strips())
    assert is_in_order()


def check_muting_meta_and_swapping():
    yield from open_sample()
    before = format_strips()
    select_strip("jogging dribble")
    with override_nla():
        bpy.ops.nla.mute_toggle("EXEC_DEFAULT", True)
    yield from wait_until_settled()
    assert format_strips() == before.replace("2.4 8 jogging dribble\n", "")
    with override_nla():
        bpy.ops.nla.mute_toggle("EXEC_DEFAULT", True)
    yield from wait_until_settled()
    assert format_strips() == before
    find_strip("celebration running arms outside").select = True
    with override_nla():
        bpy.ops.nla.meta_add("EXEC_DEFAULT", True)
    yield from wait_until_settled()
    assert format_strips() == before and is_in_order()
    with override_nla():
        bpy.ops.nla.meta_remove("EXEC_DEFAULT", True)
    yield from wait_until_settled()
    assert format_strips() == before and is_in_order()


def check_another_frame_rate():
    yield from open_sample()
    before, scene = format_strips(), bpy.context.scene
    scene.render.fps = 50
    bpy.ops.ed.undo_push(message="rate")
    yield from wait_until_settled()
    assert find_strip("jogging dribble").frame_start == 121, find_strip("jogging dribble").frame_start
    assert format_strips() == before and is_in_order()
    yield from press_in_nla("Z", ctrl=True)
    assert bpy.context.scene.render.fps == 24 and find_strip("jogging dribble").frame_start == 59
    assert format_strips() == before and is_in_order()


def list_names(region):
    """The key moments that are drawn, in the context of their editor."""
    return import_module("scene.timeline.strip_layout").build_layout(bpy.context, region).names


def find_name(text):
    """The drawn key moment with this name, and its middle in pixels of the window."""
    area = find_nla()
    region = next(region for region in area.regions if region.type == "WINDOW")
    with override_nla():
        found = next(one for one in list_names(region) if one.name == text)
    left, bottom, right, top = found.box
    return found, (int(region.x + (left + right) / 2), int(region.y + (bottom + top) / 2))


def list_picked():
    """The words of the picked key moment."""
    moments = import_module("scene.timeline.label_tracks").list_moments(bpy.context.scene.beyond_mocap.players[0].dot)
    moment = next((moment for moment in moments if moment.is_selected), None)
    return " ".join(moment.labels) if moment else ""


def check_names_are_drawn_and_picked_by_a_click():
    yield from open_sample()
    before = format_strips()
    found, place = find_name("receive right foot low inside")
    assert not found.is_selected
    yield from window.click_at(*place)
    yield from wait_until_settled()
    assert list_picked() == "receive right foot low inside", list_picked()
    assert format_strips() == before and not window.window.modal_operators.keys()
    window.save_picture(PICTURES / "timeline-names.png")
    yield from press_in_nla("Z", ctrl=True)
    assert list_picked() == "", list_picked()
    strip = find_strip("jogging dribble")
    strip.select = False
    yield from window.click_at(*find_strip_position(strip))
    yield 0.3
    assert find_strip("jogging dribble").select, "a click beside the names is no longer Blender's"


def find_strip_position(strip):
    """The middle of a strip on the first lane of words, in pixels of the window; found by trying rows."""
    region = next(region for region in find_nla().regions if region.type == "WINDOW")
    x = region.view2d.view_to_region((strip.frame_start + strip.frame_end) / 2, 0, clip=False)[0]
    return int(region.x + x), int(region.y + region.height - measure_strips_top())


def measure_strips_top():
    """Pixels from the region's top to the lane of words: frame numbers, then five rows before it."""
    return 176 * bpy.context.preferences.system.ui_scale


def check_a_name_is_dragged_and_put_back_by_escape():
    yield from open_sample()
    before = format_strips()
    found, (x, y) = find_name("kick right running low inside")
    for ending in ("ESC", "RELEASE"):
        yield from window.move_pointer(x, y)
        window.send_event("LEFTMOUSE", "PRESS")
        yield 0.1
        for step in range(1, 7):
            yield from window.move_pointer(x + 10 * step, y)
        yield 0.2
        during = format_strips()
        assert during != before, "nothing has moved"
        if ending == "ESC":
            yield from window.press_key("ESC")
            window.send_event("LEFTMOUSE", "RELEASE")
            yield from wait_until_settled()
            assert format_strips() == before, format_strips()
        else:
            window.save_picture(PICTURES / "timeline-drag.png")
            window.send_event("LEFTMOUSE", "RELEASE")
            yield from wait_until_settled()
            assert format_strips() == during
    moved = format_strips()
    yield from press_in_nla("Z", ctrl=True)
    assert format_strips() == before, format_strips()
    yield from press_in_nla("Z", ctrl=True, shift=True)
    assert format_strips() == moved, format_strips()


def check_the_tab_in_the_nla_editor():
    yield from open_sample()
    with override_nla():
        bpy.ops.screen.area_split(direction="HORIZONTAL", factor=0.45)
    yield 0.5
    with override_nla():
        bpy.ops.nla.view_all()
    area = find_nla()
    yield from window.open_tab(area, TAB)
    import_module("scene.timeline.strips").show_automatic_spans(bpy.context, bpy.context.scene.beyond_mocap.players[0],
                                                                import_module("beyond_mocap.annotation").parse_timeline(
        "0 2.4 standing\n8 17 jogging\n17 19.2 walking\n24.2 26.4 running\n"))
    select_strip("jogging dribble")
    with override_nla():
        bpy.ops.beyond_mocap.edit_words("EXEC_DEFAULT", True, words="joging dribble")
        bpy.ops.beyond_mocap.go_to_moment("EXEC_DEFAULT", True, strip="Moments", index=1)
    yield from wait_until_settled()
    window.save_picture(PICTURES / "timeline-tab.png")
    region = window.find_sidebar(area)
    found, _ = yield from window.scan_region(area, region, window.command_under_pointer)
    operators = {parse_operator(call) for call in found}
    wanted = {"go_to_moment", "add_moment", "move_moment", "delete_moment", "edit_words", "mirror_side", "add_span",
              "split_span"}
    assert wanted <= operators, wanted - operators
    yield from click_operator("go_to_moment", "index=2", editor="NLA_EDITOR")
    yield from wait_until(lambda: list_picked() == "kick right running low top", what=list_picked)
    assert bpy.context.scene.frame_current == round(1 + 24.8 * 24), bpy.context.scene.frame_current


def check_many_names_do_not_overlap():
    yield from open_sample()
    parse, strips = import_module("beyond_mocap.annotation").parse_timeline, import_module("scene.timeline.strips")
    words = "".join(
        f"{1 + n / 3:.3f} kick right running low inside {'front' if n % 2 else 'back'}\n" for n in range(80)
    )
    strips.write_player_timeline(bpy.context, bpy.context.scene.beyond_mocap.players[0], parse(words))
    bpy.context.preferences.view.ui_scale = 1.3
    yield from wait_until_settled()
    with override_nla():
        bpy.ops.nla.view_all()
    yield 0.5
    region = next(region for region in find_nla().regions if region.type == "WINDOW")
    with override_nla():
        boxes = [one.box for one in list_names(region) if one.text]
        diamonds = [one for one in list_names(region) if one.y is not None]
    window.save_picture(PICTURES / "timeline-many.png")
    bpy.context.preferences.view.ui_scale = 1.0
    yield 0.5
    assert len(boxes) > 5 and len(diamonds) >= 80, "the row of key moments is not found under so many ticks"
    for number, a in enumerate(boxes):
        assert 0 <= a[0] and a[2] <= region.width and a[3] < region.height
        for b in boxes[:number]:
            assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1], (a, b)


def check_names_in_the_dope_sheet():
    yield from open_sample()
    find_nla().ui_type = "DOPESHEET"
    yield from wait_until_settled()
    area = window.find_area("DOPESHEET_EDITOR")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window.window, screen=window.window.screen, area=area, region=region):
        bpy.ops.action.view_all()
        found = list_names(region)
    yield 0.5
    window.save_picture(PICTURES / "timeline-dope-sheet.png")
    assert found, "no name is drawn"
    bpy.context.scene.beyond_mocap.show_moment_names = False
    with bpy.context.temp_override(window=window.window, screen=window.window.screen, area=area, region=region):
        assert not import_module("scene.timeline.moment_names").is_visible(bpy.context)


def check_a_dragged_automatic_strip_is_requested():
    yield from open_sample()
    parse, player = import_module("beyond_mocap.annotation").parse_timeline, bpy.context.scene.beyond_mocap.players[0]
    import_module("scene.timeline.strips").show_automatic_spans(bpy.context, player,
                                                                parse("0 2.4 standing\n8 17 jogging\n"))
    bpy.ops.ed.undo_push(message="synthesis")
    before = format_strips()
    select_strip("jogging")
    with override_nla():
        bpy.ops.transform.transform("EXEC_DEFAULT", True, mode="TRANSLATION", value=(24, 0, 0, 0))
    yield from wait_until_settled()
    touched = format_strips()
    assert "9 18 jogging\n" in touched and is_in_order(), touched
    assert not find_strip("jogging").mute
    bpy.context.scene.frame_set(3)
    bpy.ops.ed.undo_push(message="another step")
    for expected in (touched, before):
        yield from press_in_nla("Z", ctrl=True)
        assert format_strips() == expected, format_strips()
    assert find_strip("jogging").mute
    for _ in range(2):
        yield from press_in_nla("Z", ctrl=True, shift=True)
        assert format_strips() == touched and is_in_order(), format_strips()


def check_a_new_name_is_new_words():
    yield from open_sample()
    before = format_strips()
    find_strip("jogging dribble").name = "Jogging  left"
    bpy.ops.ed.undo_push(message="rename")
    yield from wait_until_settled()
    renamed = format_strips()
    assert "2.4 8 jogging left\n" in renamed and "jogging left" in find_strip("jogging left").action.name
    yield from press_in_nla("Z", ctrl=True)
    assert format_strips() == before
    yield from press_in_nla("Z", ctrl=True, shift=True)
    assert format_strips() == renamed


def check_saved_in_the_middle_and_opened_again():
    yield from open_sample()
    select_strip("jogging dribble")
    with override_nla():
        bpy.ops.transform.transform("EXEC_DEFAULT", True, mode="TIME_SCALE", value=(0.7, 0, 0, 0))
    path = str((PICTURES / "timeline.blend").resolve())
    bpy.ops.wm.save_as_mainfile(filepath=path)  # before the strips came in order
    moved = format_strips()
    bpy.ops.wm.open_mainfile(filepath=path)
    yield from wait_until(lambda: find_strip("jogging dribble").scale == 1.0)
    yield from wait_until_settled()
    assert format_strips() == moved and is_in_order(), format_strips()
