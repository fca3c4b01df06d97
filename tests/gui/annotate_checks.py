"""Annotating by keys and the reference video in a real window: words by simulated presses, pictures read off the
screen."""

import importlib
import math

import bpy
import numpy as np
from tab import EXTENSION, PICTURES, copy_sample, output, wait_until, window

DIGITS = ("ZERO", "ONE", "TWO", "THREE", "FOUR", "FIVE", "SIX", "SEVEN", "EIGHT", "NINE")
# what is pressed at which second: a reception, the dribble from there to a kick, the kick, a header, a celebration
PRESSED = [
    (3.0, "1 3 9 RET"), (4.52, "2 2 3 5 RET"), (4.52, "O = 2 RET"), (6.2, "4 RET"), (7.0, "I"), (9.0, "O 8 4 3 RET"),
]
EXPECTED = (
    [(3.0, 4.52, {"dribble"}), (7.0, 9.0, {"celebration", "arms", "inside"})],
    [(3.0, {"receive", "foot", "running"}), (4.52, {"kick", "right", "low", "top"}), (6.2, {"header"})],
)


def import_scene_module(name):
    """A module of the extension's scene room."""
    return importlib.import_module(f"{EXTENSION}.scene.{name}")


def list_annotations():
    """The active player's words and times, rounded to thousandths."""
    scene = bpy.context.scene
    timeline = import_scene_module("timeline.strips").read_player_timeline(
        scene.beyond_mocap.players[scene.beyond_mocap.active_player], scene)
    spans = [(round(s.start, 3), round(s.end, 3), set(s.words)) for s in timeline.spans if s.words]
    return spans, [(round(k.time, 3), set(k.words)) for k in timeline.keys]


def type_keys(text):
    """Press keys by name, digits by their figure."""
    names = {"=": "EQUAL", **{str(number): name for number, name in enumerate(DIGITS)}}
    for key in text.split():
        yield from window.press_key(names.get(key, key))


def set_time(second):
    """Put the playhead on a second of the clock."""
    scene = bpy.context.scene
    scene.frame_current = import_scene_module("core.measure").build_scene_clock(scene).to_whole_frame(second)
    yield 0.1


def open_annotating(words="", editor="CLIP_EDITOR"):
    """A new file with one player and the words of his file, 25 frames a second; annotating, the pointer in an editor of
    this type in the 3D view's place (an empty clip editor is drawn much faster)."""
    bpy.ops.wm.read_homefile(use_empty=False)
    yield 1.0
    scene = bpy.context.scene
    scene.render.fps, scene.frame_end = 25, 300
    track = PICTURES.resolve() / "annotated.csv"
    time = np.arange(0.0, 12.01, 0.1)
    rows = np.column_stack([time, 3 * time, np.ones(len(time))])
    np.savetxt(track, rows, fmt="%.3f", delimiter=",", header="time_s,x_m,y_m", comments="")
    track.with_suffix(".txt").write_text(words)
    bpy.ops.beyond_mocap.import_tracking(filepath=str(track))
    area = window.find_area("VIEW_3D")
    area.type = editor
    yield 0.5
    yield from window.move_pointer(area.x + area.width // 2, area.y + area.height // 2)
    yield from window.press_key("J")
    yield from wait_until(is_annotating, 60.0, "J begins to annotate")


def is_annotating():
    """Whether somebody annotates."""
    return any(operator.bl_idname == "BEYOND_MOCAP_OT_annotate" for operator in window.window.modal_operators)


def end_annotating():
    """Leave by Escape, as often as it takes."""
    for _ in range(4):
        if is_annotating():
            yield from window.press_key("ESC")
            yield 0.2
    assert not is_annotating(), "Escape does not end it"


def check_a_whole_player_is_annotated_by_keys():
    yield from open_annotating()
    for second, keys in PRESSED:
        yield from set_time(second)
        yield from type_keys(keys)
    yield from wait_until(lambda: list_annotations() == EXPECTED, 60.0, list_annotations)
    presses = sum(len(keys.split()) for _, keys in PRESSED)
    output.write_line(f"     {presses} presses for {len(EXPECTED[0]) + len(EXPECTED[1])} annotations")
    yield from end_annotating()


def check_undo_takes_one_annotation_at_a_time():
    yield from open_annotating("5 kick\n")
    yield from set_time(2.0)
    yield from type_keys("4 RET")
    yield from set_time(3.0)
    yield from type_keys("2 1 RET")
    yield from wait_until(lambda: len(list_annotations()[1]) == 3, 60.0, list_annotations)
    bpy.ops.ed.undo()
    yield from wait_until(lambda: list_annotations()[1] == [(2.0, {"header"}), (5.0, {"kick"})], 60.0, list_annotations)
    assert is_annotating(), "undo ended it"
    bpy.ops.ed.redo()
    yield from wait_until(lambda: len(list_annotations()[1]) == 3, 60.0, list_annotations)
    yield from end_annotating()


def check_the_time_is_that_of_the_first_key_while_it_plays():
    yield from open_annotating()
    scene = bpy.context.scene
    yield from set_time(1.0)
    begun = scene.frame_current
    yield from window.press_key("SPACE")
    yield from wait_until(lambda: scene.frame_current > begun + 2, 60.0, "it plays")
    before = scene.frame_current
    yield from type_keys("2")
    first = scene.frame_current
    yield from wait_until(lambda: scene.frame_current > first + 2, 60.0, "it plays on")
    yield from type_keys("2 RET")
    last = scene.frame_current
    yield from window.press_key("SPACE")
    yield from wait_until(lambda: list_annotations()[1], 60.0)
    frame = import_scene_module("core.measure").build_scene_clock(scene).to_whole_frame(list_annotations()[1][0][0])
    assert before <= frame <= first, f"at frame {frame}, not in {before} to {first}; played on to {last}"
    yield from end_annotating()


def check_the_menu_is_drawn_clicked_and_greyed():
    yield from open_annotating(editor="VIEW_3D")
    settings = bpy.context.scene.beyond_mocap
    settings.library_folder = str(copy_sample() / "library")
    assert bpy.ops.beyond_mocap.build_library() == {"FINISHED"}
    settings.made = False  # synthetic actions have each of these labels, so none would be greyed
    yield 1.0
    yield from set_time(4.0)
    yield from type_keys("2")
    annotate = importlib.import_module(f"{EXTENSION}.operators.timeline.annotate")
    yield from wait_until(lambda: "box" in annotate._menu, 60.0, "the menu")
    yield 0.5
    window.save_picture(PICTURES / "annotate.png")
    box = annotate._menu["box"]
    faint = [row.text for row in box.content.rows if row.faint]
    assert faint and all(row.note for row in box.content.rows if row.faint), box.content.rows
    row = next(number for number, row in enumerate(box.content.rows) if row.text == "right")
    region = next(r for r in window.find_area("VIEW_3D").regions if r.type == "WINDOW")
    x0, y0, x1, y1 = box.rows[row]
    yield from window.click_at(region.x + (x0 + x1) / 2, region.y + (y0 + y1) / 2)
    yield from type_keys("RET")
    yield from wait_until(lambda: list_annotations()[1] == [(4.0, {"kick", "right"})], 60.0, list_annotations)
    yield from end_annotating()
    settings.made = True


def check_the_menu_stays_within_every_editor():
    yield from open_annotating(editor="VIEW_3D")
    annotate = importlib.import_module(f"{EXTENSION}.operators.timeline.annotate")
    for area in [a for a in window.window.screen.areas if a.type in annotate.SPACES]:
        region = next(r for r in area.regions if r.type == "WINDOW")
        for x, y in ((0.03, 0.06), (0.97, 0.06), (0.97, 0.94), (0.5, 0.5)):
            yield from window.move_pointer(region.x + x * region.width, region.y + y * region.height)
            yield from type_keys("2")
            yield 0.2
            if "box" in annotate._menu and is_annotating():
                drawn = next(r for a in window.window.screen.areas
                             for r in a.regions if r.as_pointer() == annotate._menu["region"])
                left, bottom, right, top = annotate._menu["box"].box
                assert 0 <= left and right <= drawn.width and 0 <= bottom and top <= drawn.height, (area.type, x, y)
            yield from window.press_key("ESC")
    area = window.find_area("VIEW_3D")
    yield from window.move_pointer(area.x + area.width // 2, area.y + area.height // 2)
    yield from end_annotating()


def write_numbered_pictures(count):
    """A sequence of pictures, each its number in bits from left to right; the first one's path."""
    folder = PICTURES.resolve() / "numbered"
    folder.mkdir(exist_ok=True)
    for number in range(1, count + 1):
        pixels = np.zeros((100, 600, 4), np.float32)
        pixels[..., 3] = 1.0
        for bit in range(6):
            pixels[:, 100 * bit : 100 * bit + 100, :3] = 0.9 if number >> bit & 1 else 0.1
        image = bpy.data.images.new("picture", 600, 100)
        image.pixels.foreach_set(pixels.ravel())
        image.filepath_raw, image.file_format = str(folder / f"shot_{number:04d}.png"), "PNG"
        image.save()
        bpy.data.images.remove(image)
    return str(folder / "shot_0001.png")


def read_number(area):
    """The number that the clip editor's picture spells."""
    path = PICTURES.resolve() / "video.png"
    window.save_picture(path)
    image = bpy.data.images.load(str(path))
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    red = pixels.reshape(image.size[1], image.size[0], 4)[..., 0]
    bpy.data.images.remove(image)
    region = next(r for r in area.regions if r.type == "WINDOW")
    scale = area.spaces.active.zoom_percentage / 100
    x, y = region.x + region.width // 2, region.y + region.height // 2
    return sum(1 << bit for bit in range(6) if red[y, x + int((bit - 2.5) * 100 * scale)] > 0.5)


def check_the_video_shows_the_right_picture():
    """Played, stepped, moved against the track and at another rate of the scene."""
    bpy.ops.wm.read_homefile(use_empty=False)
    yield 1.0
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base, scene.frame_end = 24, 1.001, 30
    with bpy.context.temp_override(window=window.window, area=window.find_area("VIEW_3D")):
        bpy.ops.beyond_mocap.load_video(filepath=write_numbered_pictures(63), rate=50.0)
    yield 1.0
    area, settings = window.find_area("CLIP_EDITOR"), scene.beyond_mocap
    area.spaces.active.zoom_percentage = 100

    def compare(when):
        """Wait a little: a software renderer draws late."""
        for _ in range(80):
            yield 0.3
            fps = scene.render.fps / scene.render.fps_base
            seconds = (scene.frame_current - settings.start_frame) / fps - settings.video.begins
            wanted, shown = 1 + math.floor(seconds * 50 + 1e-3), read_number(area)
            if shown == wanted:
                return
        raise AssertionError(f"{when}: picture {shown} on frame {scene.frame_current}, wanted {wanted}")

    for frame in (2, 13, 25):
        scene.frame_current = frame
        yield from compare("put there")
    settings.video.begins = 0.2
    yield from compare("begins later")
    scene.render.fps, scene.render.fps_base = 30, 1.0
    yield from compare("another rate")
    scene.frame_current = 9
    for play in ("animation_play", "animation_cancel"):
        with bpy.context.temp_override(window=window.window, area=area):
            getattr(bpy.ops.screen, play)(**({"restore_frame": False} if play == "animation_cancel" else {}))
        yield 1.5
    yield from compare("played")
