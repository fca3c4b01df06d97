"""What is drawn over the NLA editor, as far as it is arithmetic: groups and colours of labels, cut names, rows found in
a picture, names without overlaps, and what the library offers."""

import importlib
import itertools
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import worlds

BACK, BLACK, ORANGE = (48, 48, 48), (13, 13, 13), (255, 140, 0)


@pytest.fixture
def room(extension):
    """The scene's modules by name."""
    return lambda name: importlib.import_module(f"{extension.__name__}.scene.{name}")


@pytest.mark.parametrize(("labels", "title"), [
    ("running left", "Walk & Run"), ("standing turning", "Walk & Run"), ("jogging dribble", "Dribble"),
    ("kick right running low inside", "Kick"), ("receive foot low inside", "Receive"), ("receive head", "Receive"),
    ("header jump", "Header"), ("throwb high", "Throw & Catch"), ("hold ground", "Throw & Catch"),
    ("catchb dive", "Goalkeeping"), ("punt", "Goalkeeping"), ("ready standing", "Goalkeeping"),
    ("celebration running arms outside", "Gesture"), ("clapping", "Gesture"), ("tackle slide", "Duel, Fall, Other"),
    ("fall", "Duel, Fall, Other"), ("getting_up", "Duel, Fall, Other"), ("no such label", "Duel, Fall, Other"),
    ("(automatic)", "Automatic"),
])  # fmt: skip
def test_each_label_has_the_group_of_its_action(room, labels, title):
    groups = room("timeline.label_groups")
    assert groups.find_group(groups.split_labels(labels)).title == title


def test_labels_to_be_avoided_do_not_colour(room):
    groups = room("timeline.label_groups")
    assert groups.find_group(groups.split_labels("running -kick -dribble")) is groups.RUN


def test_groups_are_told_apart_also_without_red_or_green(room):
    """Machado, Oliveira and Fernandes 2009, severity 1: the nearest two colours stay apart for the colour-blind."""
    groups = [group for group in room("timeline.label_groups").GROUPS if group.title != "Automatic"]
    blind = {"none": np.eye(3),
             "protan": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
             "deutan": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]]}
    for kind, matrix in blind.items():
        seen = [np.clip(np.array(matrix) @ np.array(group.colour) ** 2.2, 0, 1) ** (1 / 2.2) for group in groups]
        nearest = min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2))
        assert nearest > 0.15, (kind, nearest)


def test_who_goes_slower_is_darker(room):
    find_colour = room("timeline.label_groups").find_colour
    sums = [sum(find_colour(name)) for name in ("standing", "walking back", "jogging", "running left", "sprinting")]
    assert sums == sorted(sums) and len(set(sums)) == 5
    assert find_colour("kick standing low") == find_colour("kick running low")


def test_letters_are_readable_on_every_colour(room):
    groups = room("timeline.label_groups")
    for colour in (*(group.colour for group in groups.GROUPS), groups.find_colour("standing"),
                   groups.find_colour("walking"), groups.find_colour("jogging")):
        light = [x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in colour]
        paper = float(np.dot([0.2126, 0.7152, 0.0722], light))
        ink = groups.choose_ink(colour)[0]
        contrast = (max(paper, ink) + 0.05) / (min(paper, ink) + 0.05)
        assert contrast >= 4.5, (colour, contrast)


@pytest.mark.parametrize(("labels", "letter", "contact"), [
    ("kick right running low inside", "R", "Right Foot, Low"), ("kick low", "F", "Foot, Low"),
    ("receive left thigh", "L", "Left Thigh"), ("header jump", "H", "Head"), ("receive body", "C", "Chest"),
    ("catchb high", "A", "Both Hands, High"), ("turning", "", "")])
def test_letter_and_part_of_a_key_moment(room, labels, letter, contact):
    groups = room("timeline.label_groups")
    words = groups.split_labels(labels)
    assert (groups.find_part_letter(words), groups.describe_contact(words)) == (letter, contact)


def test_names_are_cut_to_the_width(room):
    elide = room("timeline.label_groups").elide
    text = "kick right running low"
    for width in range(0, 30):
        cut = elide(text, width, len)
        assert len(cut) <= width
        assert cut in ("", text) or (cut.endswith("…") and text.startswith(cut[:-1]) and len(cut) >= 4)
    assert elide(text, len(text), len) == text
    assert elide(text, 3, len) == "" and elide(text, 10, len) == "kick righ…"


def paint(tracks, rows, width=200):
    """Lines (R, 2, W, 3) of an editor with these tracks: row -> strips of (left, right, colour)."""
    lines = np.full((rows, 2, width, 3), BACK, np.uint8)
    for row, strips in tracks.items():
        for left, right, colour in strips:
            lines[row, :, left:right] = colour
    return lines


def build_pattern(nla_rows, *strips):
    return nla_rows.TrackPattern(tuple((float(a), float(b)) for a, b, _ in strips), tuple(c for _, _, c in strips))


def test_rows_are_found_where_blender_drew_them(room):
    nla_rows = room("timeline.nla_rows")
    first = [(10, 190, BLACK)], [(20, 60, BLACK), (80, 120, ORANGE)], []
    second = [(30, 190, BLACK)], [(100, 150, BLACK)], []
    blocks = [[build_pattern(nla_rows, *strips) for strips in block] for block in (first, second)]

    def find(at_first, at_second, known=None):
        tracks = {at + n: strips for at, block in ((at_first, first), (at_second, second)) if at is not None
                  for n, strips in enumerate(block)}
        seen = np.ones(20, bool) if known is None else known
        return nla_rows.find_rows(blocks, paint(tracks, 20), seen, (0.0, 200.0))

    assert find(2, 7) == [2, 7]
    assert find(4, 12) == [4, 12]
    assert find(None, 3) == [None, 3]  # the first object is folded
    assert find(3, None) == [3, None]
    out_of_view = np.ones(20, bool)
    out_of_view[:3] = False
    assert find(2, 7, out_of_view) == [2, 7]  # scrolled: its first track is above the editor
    assert find(2, 7, np.zeros(20, bool)) == [None, None]


def test_nothing_is_found_where_the_strips_differ(room):
    nla_rows = room("timeline.nla_rows")
    blocks = [[build_pattern(nla_rows, (20, 60, BLACK), (80, 120, BLACK))]]
    for strips in ([(20, 60, BLACK)], [(20, 120, BLACK)], [(20, 60, ORANGE), (80, 120, BLACK)], []):
        assert nla_rows.find_rows(blocks, paint({2: strips}, 6), np.ones(6, bool), (0.0, 200.0)) == [None], strips


def test_rows_of_own_keys_are_found_by_their_tint(room):
    nla_rows = room("timeline.nla_rows")
    tint = (0.53, 0.35, 0.1, 0.3)
    lines = paint({1: [(0, 200, BACK)], 3: [(20, 120, ORANGE)]}, 6)
    for row, dark in ((2, 1.0), (4, 0.8)):  # beyond the scene's frames the background is darker
        lines[row] = [int(255 * (0.7 * dark * 0.19 + 0.3 * part)) for part in tint[:3]]
        lines[row, :, 50:150] = [int(255 * (0.3 * 0.19 + 0.7 * part)) for part in tint[:3]]
    assert nla_rows.find_bands(lines, np.ones(6, bool), tint) == [2, 4]
    assert nla_rows.find_bands(lines, np.arange(6) < 4, tint) == [2]
    assert nla_rows.find_bands(lines, np.ones(6, bool), (0.5, 0.5, 0.5, 0.3)) == []


@pytest.mark.parametrize(("scale", "pixel_size", "has_curves", "step"), [
    (1.0416666269302368, 1.0, True, 27.3), (1.0416666269302368, 1.0, False, 18.9),
    (1.5555555820465088, 1.0, True, 39.0), (2.0833332538604736, 2.0, True, 54.6),
    (0.8333333134651184, 1.0, False, 15.3)])
def test_the_grid_is_that_of_the_editor(room, scale, pixel_size, has_curves, step):
    """Steps as measured in Blender 5.2's window."""
    grid = room("timeline.nla_rows").build_grid(scale, pixel_size, has_curves)
    assert grid.step == pytest.approx(step)
    low, high = grid.compute_span(3)
    assert high - low == pytest.approx(grid.height) and high == pytest.approx(grid.top - 3 * grid.step)


def test_names_of_players_never_lie_over_one_another(room):
    names = room("overlays.player_names")
    labels = [names.NameLabel(f"player{n}", 100.0 + 3 * n, 50.0, depth=10.0 - n, colour=(1, 0, 0), is_active=n == 2)
              for n in range(6)]
    placed = names.place_names(labels, lambda text: 8.0 * len(text), 16.0, 1.0)
    assert placed[0][0].text == "player2" and placed[0][1][1] == 50.0, "the active player stays over the head"
    assert len(placed) == 6
    for (_, a), (_, b) in itertools.combinations(placed, 2):
        assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


def test_dots_have_no_names_of_blender_at_the_feet(tmp_path, room):
    seconds = np.arange(0.0, 2.01, 0.1)
    (tmp_path / "player1.csv").write_text("time_s,x_m,y_m,ball_x_m,ball_y_m\n" + "".join(
        f"{t:.1f},{3 * t:.3f},1,{3 * t:.3f},2\n" for t in seconds))
    bpy.ops.beyond_mocap.import_tracking(filepath=str(tmp_path / "player1.csv"))
    dots = [thing for thing in bpy.context.scene.objects if thing.name.endswith(" dot")]
    assert dots and not any(dot.show_name for dot in dots)
    for dot in dots:
        dot.show_name = True  # as files of version 0.1 have it
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "old.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "old.blend"))
    dots = [thing for thing in bpy.context.scene.objects if thing.name.endswith(" dot")]
    assert dots and not any(dot.show_name for dot in dots)


def test_the_library_is_counted(tmp_path, room, core):
    from test_every_operator import SMALL

    settings = bpy.context.scene.beyond_mocap
    settings.library_folder = str(SMALL.parents[1] / "library")
    offers = room("timeline.library_offer")
    scene = bpy.context.scene
    assert offers.find_offer(scene, ("kick",), False) is None, "no library is built yet"
    bpy.ops.beyond_mocap.build_library()
    settings.mirror = True
    library = room("timeline.label_checks").find_built_library(scene)
    kicks = {key.clip for key in library.keys if {"kick", "low"} <= set(key.labels)}
    assert kicks and offers.find_offer(scene, ("kick", "low"), False).clips == len(kicks)
    settings.mirror = False
    assert 0 < offers.find_offer(scene, ("kick", "low"), False).clips < len(kicks)
    none = offers.find_offer(scene, ("kick", "bicycle"), False)
    assert none.clips == 0 and "kick" in none.nearest
    assert "nearest: kick" in offers.describe_offer(scene, ("kick", "bicycle"), False)
    assert offers.describe_offer(scene, ("jogging", "dribble"), True) == "1 clip has jogging dribble"
    assert offers.describe_offer(scene, ("scissors", "jogging"), True).startswith("0 clips; nearest: jogging")


def test_names_of_other_players_stand_at_the_foot_only_where_no_rows_are_in_view(tmp_path, room):
    """The active player's rows are in view, and those of the other, who is selected too, are not."""
    worlds.import_tracking(worlds.make_places(tmp_path))
    first, second = bpy.context.scene.beyond_mocap.players
    room("timeline.strips").add_moment(bpy.context, second, 1.0, ("kick",))
    worlds.select_objects(second.dot, first.dot)
    bpy.context.scene.beyond_mocap.active_player = 0
    region = SimpleNamespace(width=900, height=240, view2d=SimpleNamespace(region_to_view=lambda x, y: (0.15 * x, y)))
    context = SimpleNamespace(scene=bpy.context.scene, view_layer=bpy.context.view_layer, active_object=first.dot,
                              selected_objects=[first.dot, second.dot], window_manager=bpy.context.window_manager,
                              preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)))  # 0 without a window
    rows = {(first.dot.name, track.name): 100.0 for track in first.dot.animation_data.nla_tracks}

    def list_feet(middles):
        names = room("timeline.moment_names").list_names(context, region, middles)
        return sorted(one.text for one in names if one.is_at_foot)

    assert list_feet({}) == ["player1: kick right running low inside", "player2: kick"]
    assert list_feet(rows) == []
