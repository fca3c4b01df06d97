"""What failed stays as a notice with its fixes; each fix mends it, and what failed runs again."""

import shutil
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest
import worlds
from conftest import EXTENSION
from fake_layout import FakeLayout, create_context

SMALL = Path(__file__).resolve().parents[3] / "sample_blend" / "match" / "small"


@pytest.fixture(scope="module")
def places(tmp_path_factory):
    return worlds.make_places(tmp_path_factory.mktemp("notices"))


def list_notices():
    return list(bpy.context.window_manager.beyond_mocap_notices.rows)


def list_kinds(row):
    return [fix.kind for fix in row.fixes]


def apply_fix(kind):
    """Press the button of the newest notice with this kind of fix."""
    row = list_notices()[-1]
    return bpy.ops.beyond_mocap.apply_fix(notice=row.number, index=list_kinds(row).index(kind))


def import_player(places, labels):
    """One player, with these labels."""
    bpy.context.scene.beyond_mocap.library_folder = str(places.clips)
    (places.match / "player2.txt").write_text(labels)
    bpy.ops.beyond_mocap.import_tracking(directory=str(places.match), files=[{"name": "player2.csv"}])
    (places.match / "player2.txt").unlink()
    return bpy.context.scene.beyond_mocap.players[0]


@pytest.fixture
def lacking(places):
    """A player with a key moment that the library lacks, and the line of the failure."""
    player = import_player(places, "2.0 scissors left back\n")
    with pytest.raises(RuntimeError) as told:
        bpy.ops.beyond_mocap.synthesize()
    return player, str(told.value).strip()


def test_a_script_gets_one_line_and_the_notice_has_the_same_in_two_parts(lacking):
    _, line = lacking
    row = list_notices()[-1]
    assert "\n" not in line and "--" not in line
    assert row.found in line and row.step in line and row.found + "; " + row.step == line.removeprefix("Error: ")
    assert (row.name, row.room, row.player) == ("Synthesize", "synthesis", "player2")


def test_one_fault_is_shown_once_whatever_fails_by_it(places):
    bpy.context.scene.beyond_mocap.library_folder = str(places.clips / "gone")
    for operator in (bpy.ops.beyond_mocap.list_clips, bpy.ops.beyond_mocap.build_library):
        with pytest.raises(RuntimeError, match="gone"):
            operator()
    assert [row.operator for row in list_notices()] == ["beyond_mocap.build_library"]
    bpy.context.scene.beyond_mocap.library_folder = str(places.clips)
    assert bpy.ops.beyond_mocap.build_library() == {"FINISHED"} and list_notices() == []


def test_one_fault_of_several_players_is_one_notice():
    import importlib

    notices, errors = (importlib.import_module(f"{EXTENSION}.{name}") for name in ("scene.core.notices",
                                                                                   "beyond_mocap.base.errors"))
    for player, found in (("player1", "no such folder"), ("player2", "no such folder"), ("player2", "is a file")):
        subject = notices.Subject(topic=f"take {player} {found}", room="synthesis", title="Synthesize", player=player)
        notices.post_notice(bpy.context.scene, subject, errors.InputError("/nowhere", found))
    assert [row.found for row in list_notices()] == ["/nowhere: no such folder", "/nowhere: is a file"]


def test_a_panel_that_shows_a_notice_leaves_nothing_to_the_popup(lacking, monkeypatch):
    import importlib

    panels = importlib.import_module(f"{EXTENSION}.panels.notices")
    create_context(monkeypatch)  # a sidebar with a width
    bpy.context.window_manager.beyond_mocap_notices.shown = list_notices()[-1].number
    assert panels.BEYOND_MOCAP_PT_notices.poll(bpy.context)
    panels.draw_notices(FakeLayout(), bpy.context, ("library",))
    assert panels.BEYOND_MOCAP_PT_notices.poll(bpy.context)
    panels.draw_notices(FakeLayout(), bpy.context, ("synthesis",))
    assert not panels.BEYOND_MOCAP_PT_notices.poll(bpy.context)


def test_a_notice_that_is_scrolled_out_of_view_is_left_to_the_popup(lacking, monkeypatch):
    import importlib

    panels, context = importlib.import_module(f"{EXTENSION}.panels.notices"), create_context(monkeypatch)
    notice, context.region.height = list_notices()[-1], 900
    notice.room, bpy.context.scene.beyond_mocap.task = "match", "MATCH"  # at the top of the tab
    bpy.context.window_manager.beyond_mocap_notices.shown = notice.number
    for top, is_left in ((-300.0, True), (0.0, False)):
        context.region.view2d = SimpleNamespace(region_to_view=lambda x, y, top=top: (x, top + y - 900))
        panels.draw_task_notices(FakeLayout(), context)
        assert panels.BEYOND_MOCAP_PT_notices.poll(bpy.context) is is_left


def test_use_nearest_labels_synthesizes_again(lacking):
    player, _ = lacking
    assert apply_fix("use_nearest") == {"FINISHED"}
    assert bpy.context.scene.beyond_mocap.nearest and player.take and list_notices() == []


def test_show_the_label_goes_to_its_time(lacking):
    player, _ = lacking
    bpy.context.scene.frame_set(1)
    assert apply_fix("show_label") == {"FINISHED"}
    clock = bpy.context.scene.render.fps
    assert bpy.context.scene.frame_current == pytest.approx(1 + 2.0 * clock, abs=1)
    assert bpy.context.view_layer.objects.active == player.dot
    assert len(list_notices()) == 1  # the label is still wrong


def test_show_clips_lists_those_with_the_nearest_labels(lacking):
    assert apply_fix("show_clips") == {"FINISHED"}
    listing = bpy.context.window_manager.beyond_mocap_clips
    assert listing.find in list_notices()[-1].found and 0 < len(listing.shown) < listing.total


def test_a_label_that_does_not_exist_is_shown_too(places):
    import_player(places, "1.0 2.0 wallking\n")
    with pytest.raises(RuntimeError, match="wallking"):
        bpy.ops.beyond_mocap.synthesize()
    assert list_kinds(list_notices()[-1]) == ["show_label"]
    apply_fix("show_label")
    assert bpy.context.scene.frame_current == 1 + bpy.context.scene.render.fps


def test_success_and_dismissal_remove_a_notice(lacking):
    player, _ = lacking
    bpy.ops.beyond_mocap.dismiss_notice()
    assert list_notices() == [] and not bpy.ops.beyond_mocap.dismiss_notice.poll()
    with pytest.raises(RuntimeError):
        bpy.ops.beyond_mocap.synthesize()
    with pytest.raises(RuntimeError):
        bpy.ops.beyond_mocap.try_again()
    assert len(list_notices()) == 1
    bpy.context.scene.beyond_mocap.nearest = True
    bpy.ops.beyond_mocap.synthesize()
    assert list_notices() == [] and player.take


def test_a_removed_player_s_notices_go_with_them(lacking):
    assert [row.player for row in list_notices()] == ["player2"]
    assert bpy.ops.beyond_mocap.remove_player() == {"FINISHED"} and list_notices() == []


def test_a_moved_library_is_chosen_and_what_failed_runs_again(places, tmp_path):
    import_player(places, "")
    shutil.copytree(places.clips, tmp_path / "elsewhere")
    bpy.context.scene.beyond_mocap.library_folder = str(tmp_path / "gone")
    with pytest.raises(RuntimeError, match="no such folder"):
        bpy.ops.beyond_mocap.list_clips()
    row = list_notices()[-1]
    assert list_kinds(row) == ["relink_library"]
    bpy.ops.beyond_mocap.relink_library(directory=str(tmp_path / "elsewhere"), resumes=row.number)
    assert list_notices() == [] and bpy.context.window_manager.beyond_mocap_clips.total == len(worlds.CLIPS)


def test_a_lost_labels_file_is_chosen(places, tmp_path):
    player = import_player(places, "")
    words = tmp_path / "words.txt"
    words.write_text("0.5 1.5 walking\n")
    bpy.data.objects.remove(player.dot)
    player.annotation_file = str(tmp_path / "gone.txt")
    with pytest.raises(RuntimeError, match="no such file"):
        bpy.ops.beyond_mocap.synthesize()
    row = list_notices()[-1]
    assert list_kinds(row) == ["choose_labels"]
    bpy.ops.beyond_mocap.import_words(directory=str(tmp_path), files=[{"name": "words.txt"}], resumes=row.number)
    assert list_notices() == [] and player.take and Path(player.annotation_file) == words


def test_labels_named_otherwise_are_offered_and_not_guessed(places, tmp_path):
    shutil.copy(places.match / "player1.csv", tmp_path / "heldout1_track.csv")
    (tmp_path / "heldout1_labels.txt").write_text("0.5 1.5 walking\n2.4 kick right\n")
    bpy.ops.beyond_mocap.import_tracking(directory=str(tmp_path), files=[{"name": "heldout1_track.csv"}])
    player, row = bpy.context.scene.beyond_mocap.players[0], list_notices()[-1]
    assert player.annotation_file == "" and not row.is_error
    assert [fix.name for fix in row.fixes] == ["Use heldout1_labels.txt", "Choose Labels File"]
    apply_fix("use_labels")
    assert Path(player.annotation_file).name == "heldout1_labels.txt" and list_notices() == []
    assert player.dot.animation_data.nla_tracks["Words"].strips


def test_use_all_players_of_a_match(places):
    bpy.context.scene.beyond_mocap.library_folder = str(places.clips)
    match = bpy.context.scene.beyond_mocap_match
    bpy.ops.beyond_mocap.read_match(directory=f"{SMALL}/", files=[{"name": "small_Home.csv"}])
    bpy.ops.beyond_mocap.tick_match(whom="NONE")
    with pytest.raises(RuntimeError, match="no players selected"):
        bpy.ops.beyond_mocap.make_match()
    match.start, match.end = 3.0, 2.0  # it ends at once when it runs again
    assert apply_fix("use_all_players") == {"FINISHED"}
    assert all(player.use for player in match.players) and len(list_notices()) == 1


def test_a_wrong_unit_is_replaced_by_that_of_the_file(places):
    files = {"directory": str(places.match), "files": [{"name": "walk.trc"}]}
    with pytest.raises(RuntimeError, match="unit"):
        bpy.ops.beyond_mocap.import_markers(unit=10.0, **files)
    assert list_kinds(list_notices()[-1]) == ["use_unit"]
    assert apply_fix("use_unit") == {"FINISHED"}
    assert list_notices() == [] and any(thing.beyond_mocap_cloud.file for thing in bpy.data.objects)


def test_every_kind_of_fix_has_a_button_a_tooltip_and_an_action():
    import importlib

    kinds = importlib.import_module(f"{EXTENSION}.beyond_mocap.base.fixes").KINDS
    actions = importlib.import_module(f"{EXTENSION}.operators.fixes")
    buttons = importlib.import_module(f"{EXTENSION}.scene.core.notices").BUTTONS
    assert set(buttons) == set(actions.APPLY) == kinds == {*actions.TOOLTIPS, "press"}


def test_a_notice_belongs_to_its_scene_and_ends_with_the_file(lacking):
    bpy.ops.scene.new(type="NEW")
    assert not bpy.ops.beyond_mocap.try_again.poll()
    bpy.ops.wm.read_homefile(use_empty=True)
    assert list_notices() == []
