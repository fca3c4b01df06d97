"""What is drawn over the NLA editor, read off the screen: strips in the colours of their actions at every zoom, scale
and theme, key moments, what is under the pointer, and how long it takes."""

import os
import time

import bpy
import numpy as np
from tab import PICTURES, copy_sample, import_module, output, report_time, wait_until, wait_until_settled, window

WORDS = "0 2.4 standing\n8 17 jogging\n17 19.2 walking\n24.2 26.4 running\n"
LIMIT_MS, STRIPS = 5.0, 100


def find_nla():
    """The NLA editor."""
    return window.find_area("NLA_EDITOR")


def find_region():
    """Its main region."""
    return next(region for region in find_nla().regions if region.type == "WINDOW")


def override_nla():
    """The context of the NLA editor's strips."""
    return bpy.context.temp_override(window=window.window, screen=window.window.screen, area=find_nla(),
                                     region=find_region())


def open_sample():
    """The sample's two players with automatic strips, the largest editor an NLA editor with all strips in view."""
    bpy.ops.wm.open_mainfile(filepath=str(copy_sample() / "quickstart.blend"))
    yield 0.5
    max(window.window.screen.areas, key=lambda area: area.width * area.height).ui_type = "NLA_EDITOR"
    players = bpy.context.scene.beyond_mocap.players
    import_module("scene.timeline.strips").show_automatic_spans(
        bpy.context, players[0], import_module("beyond_mocap.annotation").parse_timeline(WORDS))
    yield from show_all()


def show_all():
    """Show all strips, and wait until they are drawn."""
    yield 0.5
    with override_nla():
        bpy.ops.nla.view_all()
    yield from wait_until_settled()
    yield 0.7


def build_layout():
    """What is drawn."""
    with override_nla():
        return import_module("scene.timeline.strip_layout").build_layout(bpy.context, find_region())


def read_screen():
    """The whole screen: (H, W, 3) of 0 to 255, row 0 at the bottom."""
    path = PICTURES.resolve() / "timeline-screen.png"
    window.save_picture(path)
    image = bpy.data.images.load(str(path))
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    width, height = image.size
    bpy.data.images.remove(image)
    return np.rint(255 * pixels.reshape(height, width, 4)[..., :3]).astype(int)


def list_faulty_strips():
    """The spans whose body has not the colour of its action: names, with what is there instead."""
    screen, region, faulty = read_screen(), find_region(), []
    ends = [(one, min(one.box[2], region.width - 30)) for one in build_layout().strips if one.kind != "moments"]
    spans = [(one, right) for one, right in ends if right - max(one.box[0], 0.0) > 16]
    for strip, right in spans:
        x, y = int(region.x + right - 3), int(region.y + strip.box[1] + 4)  # right of the text, within the outline
        seen, wanted = screen[y, x], np.array(strip.colour) * 255
        share = 0.4 if strip.kind == "automatic" else 1.0
        back = np.array(bpy.context.preferences.themes[0].nla_editor.space.back[:3]) * 255
        if np.abs(seen - (share * wanted + (1 - share) * back)).max() > 6:
            faulty.append((strip.name, tuple(seen)))
    return len(spans), faulty


def set_theme(name):
    """Use one of Blender's own themes."""
    folders = bpy.utils.preset_paths("interface_theme")
    path = next(path for folder in folders if os.path.exists(path := os.path.join(folder, f"Blender_{name}.xml")))
    bpy.ops.script.execute_preset(filepath=path, menu_idname="USERPREF_MT_interface_theme_presets")


def check_strips_have_the_colours_of_their_actions():
    """At four scales of the interface, in both themes, with low rows too."""
    yield from open_sample()
    for theme, scale, curves in (("Dark", 1.0, True), ("Dark", 1.5, True), ("Light", 1.0, True), ("Light", 0.8, False),
                                 ("Dark", 2.0, True)):
        set_theme(theme)
        bpy.context.preferences.view.ui_scale = scale
        find_nla().spaces.active.show_strip_curves = curves
        yield from show_all()
        count, faulty = list_faulty_strips()
        window.save_picture(PICTURES / f"timeline-{theme}-{scale}.png")
        assert count >= 7 and not faulty, (theme, scale, count, faulty)
    set_theme("Dark")
    bpy.context.preferences.view.ui_scale = 1.0
    find_nla().spaces.active.show_strip_curves = True


def check_labels_at_every_zoom():
    yield from open_sample()
    for name, factor, times in (("in", 0.25, 4), ("out", -0.6, 3)):
        for _ in range(times):
            with override_nla():
                getattr(bpy.ops.view2d, f"zoom_{name}")(zoomfacx=factor)
            yield 0.4
            count, faulty = list_faulty_strips()
            assert not faulty, (name, faulty)
        window.save_picture(PICTURES / f"timeline-zoom-{name}.png")
        yield from show_all()


def check_folded_channels_are_left_alone():
    yield from open_sample()
    assert build_layout().strips
    with override_nla():
        bpy.ops.anim.channels_collapse(all=True)
    yield 0.7
    assert not build_layout().strips, "strips are drawn where Blender has none"
    window.save_picture(PICTURES / "timeline-folded.png")
    with override_nla():
        bpy.ops.anim.channels_expand(all=True)
    yield 0.7
    count, faulty = list_faulty_strips()
    assert count >= 7 and not faulty


def check_rows_stay_right_while_the_preview_range_is_on():
    yield from open_sample()
    scene = bpy.context.scene
    scene.use_preview_range, scene.frame_preview_start, scene.frame_preview_end = True, 100, 700
    yield 0.7
    assert len(build_layout().strips) >= 9
    count, faulty = list_faulty_strips()
    assert not faulty, faulty
    scene.use_preview_range = False


def check_the_dots_own_keys_are_covered():
    """Where Blender draws 1200 diamonds in orange, one grey bar is left."""
    yield from open_sample()
    lanes, region = build_layout().lanes, find_region()
    assert {name for name, _ in lanes} == {"Ball dot", "player1 dot", "player2 dot"}, lanes
    screen = read_screen()
    for _, (_, bottom, _, top) in lanes:
        row = screen[int(region.y + 0.5 * (bottom + top)), region.x + region.width // 2:region.x + region.width - 30]
        assert np.ptp(row, axis=1).max() < 10, "a colour is left"
        assert len(np.unique(row, axis=0)) < 6, "diamonds are left"


def check_the_pointer_tells_what_is_under_it():
    yield from open_sample()
    overlay, region = import_module("scene.timeline.strip_overlay"), find_region()
    texts = import_module("scene.timeline.timeline_texts")
    moment = next(name for name in build_layout().names if name.y is not None)
    strip = next(one for one in build_layout().strips if one.kind == "span")
    for thing, place, told in ((moment, (moment.x, moment.y), f"{moment.name}    Kick"),
                               (strip, (strip.box[0] + 9, strip.box[1] + 9), f"{strip.name}    Dribble")):
        for step in range(2):
            yield from window.move_pointer(region.x + place[0] + step, region.y + place[1])
            yield 0.2
        yield from wait_until(lambda: overlay._hover.get("thing") is not None, 10.0, "the pointer is not noticed")
        seen = overlay._hover["thing"]
        assert (type(seen), seen.name) == (type(thing), thing.name)
        assert texts.describe_thing(bpy.context, seen)[0] == told, texts.describe_thing(bpy.context, seen)
        yield 0.5
        window.save_picture(PICTURES / f"timeline-hover-{type(thing).__name__}.png")
    yield from window.move_pointer(region.x + 20, region.y + 60)
    yield 0.3
    assert overlay._hover.get("thing") is None


def check_a_dragged_strip_tells_seconds():
    yield from open_sample()
    settings = bpy.context.scene.beyond_mocap
    settings.library_folder = str(copy_sample() / "library")
    assert bpy.ops.beyond_mocap.build_library() == {"FINISHED"}
    for track in settings.players[0].dot.animation_data.nla_tracks:
        for strip in track.strips:
            strip.select = strip.name == "celebration running arms outside"
    region, texts = find_region(), import_module("scene.timeline.timeline_texts")
    x, y = region.x + region.width // 2, region.y + region.height // 2
    yield from window.move_pointer(x, y)
    window.send_event("G", "PRESS")
    yield 0.1
    window.send_event("G", "RELEASE")
    for step in range(6):
        yield from window.move_pointer(x + 8 * step, y)
        yield 0.1
    yield 0.5
    with override_nla():
        lines, _ = texts.describe_drag(bpy.context, build_layout())
    window.save_picture(PICTURES / "timeline-dragged-seconds.png")
    yield from window.press_key("ESC")
    yield from wait_until_settled()
    assert lines and "(+" in lines[0] and lines[1] == "2 clips have celebration running arms outside", lines


def check_timelines_show_a_range_that_has_grown():
    yield from open_sample()
    area = max(window.window.screen.areas, key=lambda area: area.width * area.height)
    area.ui_type = "TIMELINE"
    yield 0.5
    region, scene = next(region for region in area.regions if region.type == "WINDOW"), bpy.context.scene
    end = scene.frame_end + 1000
    assert region.view2d.region_to_view(region.width, 0)[0] < end
    import_module("scene.core.frame_range").extend_range(scene, end)
    yield 0.7
    low, high = (region.view2d.region_to_view(x, 0)[0] for x in (0, region.width))
    assert scene.frame_end == end and low < scene.frame_start and end < high < end + 300, (low, high)


def check_a_hundred_strips_are_drawn_quickly():
    """Time of the main thread, whatever else runs; a software renderer's own threads are not ours."""
    yield from open_sample()
    parse, strips = import_module("beyond_mocap.annotation").parse_timeline, import_module("scene.timeline.strips")
    words = "".join(f"{0.78 * n:.2f} {0.78 * n + 0.7:.2f} {('jogging', 'running left')[n % 2]}\n"
                    for n in range(STRIPS // 2))
    for player in bpy.context.scene.beyond_mocap.players:
        strips.write_player_timeline(bpy.context, player, parse(words))
    yield from show_all()
    overlay, spent = import_module("scene.timeline.strip_overlay"), []
    plain = overlay._draw

    def timed():
        begun = time.thread_time()
        plain()
        spent.append(1000 * (time.thread_time() - begun))

    overlay._draw = timed
    for _ in range(25):
        find_nla().tag_redraw()
        yield 0.05
    overlay._draw = plain
    assert len(build_layout().strips) >= STRIPS
    window.save_picture(PICTURES / "timeline-hundred.png")
    output.write_line(f"     {len(build_layout().strips)} strips")
    report_time("labels of the timeline, ms", sorted(spent)[len(spent) // 2], LIMIT_MS)
