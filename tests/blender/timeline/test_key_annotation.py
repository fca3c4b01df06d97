"""Annotating by keys in a scene: presses become strips and markers, at the right seconds, each an undo step."""

from importlib import import_module
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from conftest import EXTENSION


@pytest.fixture
def room():
    return lambda name: import_module(f"{EXTENSION}.scene.{name}")


@pytest.fixture
def scene():
    """Two players of twelve seconds each, one with words on disk, at 25 frames a second from frame 1."""
    scene = bpy.context.scene
    scene.render.fps = 25
    return scene


@pytest.fixture
def players(scene, tmp_path):
    for number in (1, 2):
        time = np.arange(0.0, 12.01, 0.1)
        rows = np.column_stack([time, 3 * time, np.full(len(time), number)])
        path = tmp_path / f"player{number}.csv"
        np.savetxt(path, rows, fmt="%.3f", delimiter=",", header="time_s,x_m,y_m", comments="")
    (tmp_path / "player1.txt").write_text("1 3 dribble\n5 kick right\n8 kick\n")
    bpy.ops.beyond_mocap.import_tracking(
        directory=str(tmp_path), files=[{"name": "player1.csv"}, {"name": "player2.csv"}]
    )
    scene.beyond_mocap.active_player = 0
    return scene.beyond_mocap.players


def keys(text, second=None):
    """Press keys with the playhead at a second."""
    if second is not None:
        bpy.context.scene.frame_float = 1 + 25 * second
    return bpy.ops.beyond_mocap.annotate(keys=text)


def said(room, player):
    timeline = room("timeline.strips").read_player_timeline(player, bpy.context.scene)
    return ([(s.start, s.end, " ".join(s.words)) for s in timeline.spans],
            [(k.time, " ".join(k.words)) for k in timeline.keys])


def test_four_presses_and_enter_are_a_key_moment_at_the_playhead(room, players):
    assert keys("2 2 3 5 ENTER", 9.72) == {"FINISHED"}
    assert said(room, players[0])[1][-1] == (9.72, "kick right low top")


def test_an_unknown_key_is_told_with_the_known_ones(players):
    with pytest.raises(RuntimeError, match="the key RIGHT; expected keys of 0 to 9, BACK, EARLIER, ENTER"):
        keys("2 RIGHT", 9.72)


def test_a_moment_may_lie_between_two_frames(room, players):
    keys("2 ENTER", 9.73)
    assert said(room, players[0])[1][-1] == (pytest.approx(9.73, abs=1e-4), "kick")
    assert bpy.context.scene.frame_current_final == pytest.approx(1 + 25 * 9.73, abs=1e-3)


def test_the_first_word_for_a_player_keeps_those_of_his_file(room, players):
    players[0].dot = None
    keys("4 ENTER", 10.0)
    spans, moments = said(room, players[0])
    assert spans == [(1.0, 3.0, "dribble")] and [w for _, w in moments] == ["kick right", "kick", "header"]


def test_a_moment_on_the_frame_of_another_takes_its_place(room, players):
    keys("2 1 ENTER", 5.0)
    assert said(room, players[0])[1] == [(5.0, "kick left"), (8.0, "kick")]


def test_in_and_out_make_a_span(room, players, scene):
    annotating = room("timeline.key_annotation")
    core = import_module(f"{EXTENSION}.beyond_mocap.annotation.key_commands")
    state, told = core.AnnotationState(), []
    for second, key in ((10.0, "IN"), (11.2, "OUT"), (11.2, "4"), (11.2, "ENTER")):
        scene.frame_float = 1 + 25 * second
        state, commands = core.handle_key(state, key, annotating.compute_now(bpy.context))
        told += [annotating.run_command(bpy.context, command).line for command in commands]
    assert said(room, players[0])[0] == [(1.0, 3.0, "dribble"), (10.0, 11.2, "running")]
    assert told == ["running from 10.00 to 11.20 s"]


def test_out_alone_goes_back_to_the_end_of_the_last_thing(room, players):
    keys("OUT 2 ENTER", 9.0)
    assert said(room, players[0])[0][-1] == (8.0, 9.0, "walking")


def test_mirror_remove_and_nudge_take_what_is_at_the_playhead(room, players):
    keys("MIRROR", 5.0)
    keys("LATER LATER", 5.0)
    assert said(room, players[0])[1][0] == (pytest.approx(5.08), "kick left")
    assert bpy.context.scene.frame_current == 1 + 25 * 5 + 2
    keys("REMOVE")
    assert [word for _, word in said(room, players[0])[1]] == ["kick"]
    keys("REMOVE", 2.0)
    assert said(room, players[0])[0] == []


def test_a_spans_side_is_mirrored_too(room, players):
    keys("IN", 10.0)
    bpy.ops.beyond_mocap.add_span(words="dribble left", start=9.0, end=10.0)
    keys("MIRROR", 9.5)
    assert (9.0, 10.0, "dribble right") in said(room, players[0])[0]


def test_where_no_moment_is_the_playhead_alone_goes_by_frames(room, players, scene):
    before = said(room, players[0])
    keys("EARLIER EARLIER LATER EARLIER", 6.0)
    assert scene.frame_current == 1 + 150 - 2 and said(room, players[0]) == before
    keys("LATER", 2.0)
    assert scene.frame_current == 52 and said(room, players[0]) == before


@pytest.mark.parametrize("press", ["MIRROR", "REMOVE"])
def test_nothing_at_the_playhead_is_told_and_changes_nothing(room, players, press):
    before = said(room, players[0])
    with pytest.raises(RuntimeError, match="playhead"):
        keys(press, 6.5)
    assert said(room, players[0]) == before


def test_what_has_no_side_cannot_be_mirrored(room, players):
    with pytest.raises(RuntimeError, match="no side"):
        keys("MIRROR", 8.0)


def test_arrows_go_from_moment_to_moment_and_pick_it(room, players, scene):
    keys("NEXT", 0.0)
    assert scene.frame_current == 126
    assert [moment.time for moment in room("timeline.label_tracks").list_moments(players[0].dot)
            if moment.is_selected] == [5.0]
    keys("NEXT")
    assert scene.frame_current == 201
    keys("NEXT")
    assert scene.frame_current == 201
    keys("PREVIOUS")
    assert scene.frame_current == 126


def test_up_and_down_choose_the_player(room, players, scene):
    keys("NEXT_PLAYER 4 ENTER", 4.0)
    assert scene.beyond_mocap.active_player == 1
    assert said(room, players[1])[1] == [(4.0, "header")] and len(said(room, players[0])[1]) == 2
    keys("NEXT_PLAYER NEXT_PLAYER")
    assert scene.beyond_mocap.active_player == 1
    keys("PREVIOUS_PLAYER PREVIOUS_PLAYER")
    assert scene.beyond_mocap.active_player == 0


def test_an_overlap_is_told(room, players):
    annotating = room("timeline.key_annotation")
    core = import_module(f"{EXTENSION}.beyond_mocap.annotation.key_commands")
    told = annotating.run_command(bpy.context, core.AddSpan(2.0, 4.0, ("walking",)))
    assert told.changed_labels and "overlaps dribble" in told.line


def test_each_call_is_one_step(room, players):
    bpy.ops.ed.undo_push(message="before")
    before = said(room, players[0])
    bpy.context.scene.frame_set(226)
    bpy.ops.beyond_mocap.annotate("EXEC_DEFAULT", True, keys="2 2 ENTER")
    after = said(room, bpy.context.scene.beyond_mocap.players[0])
    assert after != before
    bpy.ops.ed.undo()
    assert said(room, bpy.context.scene.beyond_mocap.players[0]) == before
    bpy.ops.ed.redo()
    assert said(room, bpy.context.scene.beyond_mocap.players[0]) == after


@pytest.mark.parametrize("bad", ["", "2 SPACE ENTER", "kick"])
def test_keys_that_do_not_exist_are_told(room, players, bad):
    before = said(room, players[0])
    with pytest.raises(RuntimeError, match="key"):
        keys(bad, 4.0)
    assert said(room, players[0]) == before


def test_without_a_player_the_button_says_what_is_missing(scene):
    assert not bpy.ops.beyond_mocap.annotate.poll()
    with pytest.raises(RuntimeError, match="Import tracking"):
        keys("2 ENTER")


def test_it_works_at_23_976_frames_a_second_and_a_clock_of_its_own(room, players, scene):
    scene.render.fps, scene.render.fps_base = 24, 1.001
    scene.beyond_mocap.start_frame, scene.beyond_mocap.start_time = 101, 2.0
    scene.frame_float = 101 + (7.3 - 2.0) * 24 / 1.001
    keys("4 ENTER")
    assert (pytest.approx(7.3, abs=1e-4), "header") in said(room, players[0])[1]


def test_a_linked_dot_is_told(room, players, tmp_path):
    bpy.data.libraries.write(str(tmp_path / "dot.blend"), {players[0].dot})
    name = players[0].dot.name
    bpy.data.objects.remove(players[0].dot)
    with bpy.data.libraries.load(str(tmp_path / "dot.blend"), link=True) as (_, linked):
        linked.objects = [name]
    bpy.context.scene.collection.objects.link(linked.objects[0])
    players[0].dot = linked.objects[0]
    with pytest.raises(RuntimeError, match="linked"):
        keys("2 ENTER", 6.0)


class Library(SimpleNamespace):
    """Stands in for a built library."""

    __hash__ = object.__hash__


def test_what_the_library_holds_is_known_with_and_without_mirrored_clips(room, scene, tmp_path):
    words = np.array([[1, 0], [1, 0], [0, 1], [1, 1]], bool)
    library = Library(
        folder=str(tmp_path), clips=[SimpleNamespace(mirrored=False, is_synthetic=False),
                                     SimpleNamespace(mirrored=True, is_synthetic=False),
                                     SimpleNamespace(mirrored=False, is_synthetic=True)],
        keys=[SimpleNamespace(clip=0, labels=frozenset({"kick", "right"})),
              SimpleNamespace(clip=1, labels=frozenset({"kick", "left"})),
              SimpleNamespace(clip=2, labels=frozenset({"header"}))],
        frames=SimpleNamespace(words=words, vocabulary=("walking", "dribble"), clip=np.array([0, 0, 1, 2])),
    )
    annotating, settings = room("timeline.key_annotation"), scene.beyond_mocap
    assert annotating.find_combinations(scene) is None
    settings.library_folder = str(tmp_path)
    room("core.session").store_library(library, None)
    settings.made = False
    found = annotating.find_combinations(scene)
    assert set(found.moments) == {frozenset({"kick", "right"}), frozenset({"kick", "left"})}
    assert set(found.spans) == {frozenset({"walking"}), frozenset({"dribble"}), frozenset({"walking", "dribble"})}
    assert annotating.find_combinations(scene) is found
    settings.mirror = False
    assert annotating.find_combinations(scene).moments == (frozenset({"kick", "right"}),)
    settings.made = True
    found = annotating.find_combinations(scene).moments
    assert frozenset({"kick", "right"}) in found and any({"header", "jump", "left"} <= labels for labels in found)


def test_a_clip_with_lanes_of_its_own_is_annotated_while_it_is_the_active_object(room, players):
    clip = bpy.data.objects.new("clip", bpy.data.armatures.new("clip"))
    bpy.context.scene.collection.objects.link(clip)
    clock, core = room("core.measure").Clock(1.0, 0.0, 25.0), import_module(f"{EXTENSION}.beyond_mocap.annotation")
    room("timeline.strip_writing").write_timeline(clip, core.Timeline(), clock)
    bpy.context.view_layer.objects.active = clip
    before = said(room, players[0])
    keys("2 2 ENTER", 2.0)
    assert [(k.time, k.words) for k in room("timeline.label_tracks").read_timeline(clip, "clip").keys] == [(2.0,
            ("kick", "right"))]
    assert said(room, players[0]) == before


def rects_overlap(a, b):
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


@pytest.mark.parametrize("at", [None, (5, 5), (795, 5), (400, 300), (795, 595), (5, 595)])
@pytest.mark.parametrize("free", [(0, 0, 800, 600), (60, 0, 640, 570), (0, 0, 1500, 180)])
@pytest.mark.parametrize("pressed", ["", "2", "2 2 3", "NEXT_PAGE", "IN OUT"])
def test_the_menu_lies_within_the_editor_and_no_row_on_another(room, at, free, pressed):
    popup, core = room("core.popup"), import_module(f"{EXTENSION}.beyond_mocap.annotation.key_commands")
    state = core.AnnotationState(import_module(f"{EXTENSION}.beyond_mocap.annotation.decision").LibraryCombinations(
        (frozenset({"jump"}),), ()))
    for number, key in enumerate(pressed.split()):
        state, _ = core.handle_key(state, key, core.Playhead(9.7 + number))
    box = popup.place_menu(popup.build_content(state, "player 1", "kick at 3 s"), at, free, 14.0, lambda text: 7.0
                           * len(text))
    assert free[0] <= box.box[0] and box.box[2] <= free[2] and free[1] <= box.box[1] and box.box[3] <= free[3]
    for number, rect in enumerate(box.rows):
        assert box.box[0] <= rect[0] and rect[2] <= box.box[2] and box.box[1] <= rect[1] and rect[3] <= box.box[3]
        assert not any(rects_overlap(rect, other) for other in box.rows[number + 1 :])
        middle = ((rect[0] + rect[2]) / 2, (rect[1] + rect[3]) / 2)
        assert box.word_at(*middle) == box.content.rows[number].word
    assert box.word_at(box.box[2] + 5, box.box[1]) is None


def test_the_part_of_an_editor_that_nothing_lies_over(room):
    def region(kind, x, y, width, height):
        return SimpleNamespace(type=kind, x=x, y=y, width=width, height=height)

    main = region("WINDOW", 100, 50, 800, 600)
    others = [region("TOOLS", 100, 200, 60, 300), region("UI", 680, 50, 220, 560), region("HEADER", 100, 624, 800, 26),
              region("FOOTER", 100, 50, 800, 1), region("CHANNELS", 0, 50, 100, 600)]
    area = SimpleNamespace(regions=[main, *others])
    assert room("core.window").find_free_region(area, main) == (64, 4, 576, 570)
    assert room("core.window").find_free_region(SimpleNamespace(regions=[main]), main) == (4, 4, 796, 596)
    assert room("core.window").find_free_region(SimpleNamespace(regions=[main, region("HUD", 110, 60, 300, 120)]),
                                                main) == (4, 134, 796, 596)
    assert room("core.window").find_free_region(SimpleNamespace(regions=[main, region("HUD", 110, 60, 300, 400)]),
                                                main) == (314, 4, 796, 596)


def test_the_list_in_the_corner_can_be_folded(room):
    popup, core = room("core.popup"), import_module(f"{EXTENSION}.beyond_mocap.annotation.key_commands")
    folded = popup.build_content(core.AnnotationState(), "me", folded=True)
    assert folded.rows == () and popup.build_content(core.AnnotationState(), "me").rows
    assert popup.build_content(core.handle_key(core.AnnotationState(), "2", core.Playhead(1.0))[0], "me",
                               folded=True).rows
    box = popup.place_menu(folded, None, (0, 0, 800, 600), 14.0, lambda text: 7.0 * len(text))
    assert box.box[3] - box.box[1] < 100


def test_a_word_that_the_library_lacks_is_faint_with_the_nearest(room):
    popup, core = room("core.popup"), import_module(f"{EXTENSION}.beyond_mocap.annotation.key_commands")
    held = import_module(f"{EXTENSION}.beyond_mocap.annotation.decision").LibraryCombinations((frozenset({"jump",
            "high"}),), ())
    rows = {row.text: row for row in popup.build_content(core.AnnotationState(held), "me").rows}
    assert not rows["jump"].faint and rows["header"].faint and rows["header"].note.endswith("jump high")
    state, _ = core.handle_key(core.AnnotationState(held), "4", core.Playhead(1.0))
    assert "not in the library" in popup.build_content(state, "me").foot[0]
