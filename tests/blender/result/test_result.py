"""Preview, Accept, Discard: what was there comes back to the last bit, and strips play what the action plays."""

import importlib
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from test_players import match, ready, refused, session  # noqa: F401  (fixtures)
from undo import assert_one_step, collect_state, press_operator


def look(player):
    """Everything about a body that a preview may touch, as plain values."""
    body = player.body
    if body is None:
        return None
    data = body.animation_data
    bones = [(b.name, b.rotation_mode, *b.location, *b.rotation_quaternion, *b.rotation_euler, *b.scale)
             for b in body.pose.bones]
    if data is None:
        return body.name, bones, None
    slot = data.action_slot.identifier if data.action_slot else ""
    strips = [(t.name, s.name, s.frame_start, s.frame_end, s.action.name) for t in data.nla_tracks for s in t.strips]
    action = data.action.name if data.action else ""
    return body.name, bones, (action, slot, data.use_nla, data.action_influence, data.action_blend_type, strips)


def poses(body, frames):
    """Bone matrices (frames, bones, 4, 4) as Blender plays them."""
    found = []
    for frame in frames:
        bpy.context.scene.frame_set(int(frame), subframe=float(frame % 1))
        found.append([np.array(bone.matrix) for bone in body.pose.bones])
    return np.array(found)


@pytest.fixture
def one(ready, session):  # noqa: F811
    """One player, the other not ticked."""
    bpy.context.scene.render.fps = 30
    ready.players[1].use = False
    return ready.players[0]


def kinds():
    return {kind: collect_state()[kind] for kind in ("objects", "armatures", "actions", "meshes", "curves",
                                                     "materials")}


def test_a_preview_of_a_new_player_leaves_nothing_when_discarded(one):
    before, end = kinds(), bpy.context.scene.frame_end
    bpy.context.scene.frame_end = end = 40
    bpy.ops.beyond_mocap.synthesize()
    assert one.result.state == "PREVIEW" and one.body is not None and bpy.context.scene.frame_end > 40
    assert bpy.ops.beyond_mocap.discard() == {"FINISHED"}
    assert one.result.state == "NONE" and one.body is None and one.take == "" and one.quality == ""
    assert kinds() == before and bpy.context.scene.frame_end == end
    refused(bpy.ops.beyond_mocap.discard, "No preview is shown")


def test_discard_brings_back_what_the_armature_played(one):
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    body, scene = one.body, bpy.context.scene
    data = body.animation_data
    mine = bpy.data.actions.new("mine")
    data.action = mine
    data.action_slot = mine.slots.new("OBJECT", "another name")
    body.pose.bones[3].rotation_mode = "XYZ"
    body.pose.bones[3].rotation_euler = (0.1, 0.2, 0.3)
    body.pose.bones[3].keyframe_insert("rotation_euler", frame=3)
    track = data.nla_tracks.new()
    track.strips.new("layer", 1, mine)
    data.action_influence, data.action_blend_type = 0.5, "COMBINE"
    scene.frame_set(10)
    moved = poses(body, [5, 50.5])
    before, files, ball = look(one), kinds(), bpy.data.objects["Ball"].animation_data.action
    bpy.ops.beyond_mocap.synthesize()
    assert look(one) != before
    bpy.ops.beyond_mocap.synthesize()  # a preview over a preview
    assert bpy.ops.beyond_mocap.discard() == {"FINISHED"}
    assert kinds() == files and one.result.state == "ACCEPTED"
    assert bpy.data.objects["Ball"].animation_data.action == ball
    np.testing.assert_array_equal(poses(body, [5, 50.5]), moved)
    assert look(one) == before


def test_strips_play_what_the_action_plays(one, session):  # noqa: F811
    bpy.ops.beyond_mocap.synthesize()
    assert_one_step(bpy.ops.beyond_mocap.accept, form="ACTION")
    one = bpy.context.scene.beyond_mocap.players[0]
    body, take = one.body, session.find_take(one.take).take
    frames = np.arange(1, 360, 3.37)
    whole = poses(body, frames)
    actions = len(bpy.data.actions)
    assert press_operator(bpy.ops.beyond_mocap.accept, form="STRIPS") == {"FINISHED"}
    strips = body.animation_data.nla_tracks["Beyond Mocap"].strips
    assert body.animation_data.action is None and 3 < len(strips) <= len(take.seams) + 1
    assert len(bpy.data.actions) == actions - 1 + len(strips)
    assert any("kick" in strip.name for strip in strips)
    np.testing.assert_allclose(poses(body, frames), whole, atol=1e-5)
    assert bpy.ops.beyond_mocap.accept(form="ACTION") == {"FINISHED"}
    assert not body.animation_data.nla_tracks and len(bpy.data.actions) == actions
    np.testing.assert_allclose(poses(body, frames), whole, atol=1e-6)


def test_a_strip_that_was_split_becomes_part_of_the_action_once(one, extension):
    hand_keys = importlib.import_module(f"{extension.__name__}.scene.result.manual_keys")
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept(form="STRIPS")
    frames = np.arange(1, 360, 7.7)
    whole, track = poses(one.body, frames), one.body.animation_data.nla_tracks["Beyond Mocap"]
    first = max(track.strips, key=lambda strip: strip.frame_end - strip.frame_start)
    middle, end, slot = round((first.frame_start + first.frame_end) / 2), first.frame_end, first.action_slot
    first.frame_end = first.action_frame_end = middle  # what Split (Y) does
    first.action.use_frame_range, first.action.frame_start, first.action.frame_end = True, middle, end
    second = track.strips.new("second half", middle, first.action)
    first.action.use_frame_range = False
    second.action_slot, second.action_frame_start, second.action_frame_end = slot, middle, end
    second.frame_start, second.frame_end = middle, end
    assert bpy.ops.beyond_mocap.accept(form="ACTION") == {"FINISHED"}
    np.testing.assert_allclose(poses(one.body, frames), whole, atol=1e-6)
    assert len(hand_keys.find_in_body(one.body)[0]) == 0


def test_a_player_is_removed_under_his_preview(one):
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    body = one.body
    mine = bpy.data.actions.new("Mine")
    body.animation_data.action = mine
    bpy.ops.beyond_mocap.synthesize()
    settings = bpy.context.scene.beyond_mocap
    settings.active_player = settings.players.find(one.name)
    assert bpy.ops.beyond_mocap.remove_player() == {"FINISHED"}
    shared = settings.shared
    assert mine.use_fake_user and not (shared.ball.kept or shared.camera.kept or shared.end_set)
    assert body.animation_data.action.get("beyond_mocap_take") and body.name in bpy.context.scene.objects


def test_a_preview_over_strips_and_back(one):
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept(form="STRIPS")
    played = poses(one.body, [33.3, 200])
    before, files = look(one), kinds()
    bpy.ops.beyond_mocap.synthesize()
    assert_one_step(bpy.ops.beyond_mocap.discard)
    one = bpy.context.scene.beyond_mocap.players[0]
    assert kinds() == files
    np.testing.assert_array_equal(poses(one.body, [33.3, 200]), played)
    assert look(one) == before
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept(form="STRIPS")
    assert {k: len(v) for k, v in kinds().items()} == {k: len(v) for k, v in files.items()}


def test_the_user_s_own_layers_stay(one):
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept(form="STRIPS")
    layer = one.body.animation_data.nla_tracks.new()
    layer.name = "mine"
    layer.strips.new("nod", 1, bpy.data.actions.new("nod"))
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept(form="STRIPS")
    assert [track.name for track in one.body.animation_data.nla_tracks] == ["Beyond Mocap", "mine"]
    assert one.body.animation_data.use_nla


def test_a_body_of_the_user_s_own_with_other_bones_comes_back(one):
    data = bpy.data.armatures.new("Own")
    own = bpy.data.objects.new("Own", data)
    bpy.context.scene.collection.objects.link(own)
    one.body = own
    files = kinds()
    bpy.ops.beyond_mocap.synthesize()
    assert one.body != own
    bpy.ops.beyond_mocap.discard()
    assert one.body == own and kinds() == files


def test_two_players_share_the_ball(ready, session):  # noqa: F811
    bpy.ops.beyond_mocap.synthesize()
    first, second = ready.players
    bpy.ops.beyond_mocap.discard(player=first.name)
    assert second.result.state == "PREVIEW" and first.result.state == "NONE"
    bpy.ops.beyond_mocap.accept(player=second.name)
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    assert "Ball" in bpy.data.objects
    with pytest.raises(RuntimeError, match="nobody"):
        bpy.ops.beyond_mocap.accept(player="nobody")


def test_the_ball_stays_with_what_is_accepted_and_goes_with_what_is_discarded(ready, session):  # noqa: F811
    first, second = ready.players  # only the first has a ball
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept(player=second.name)
    assert "Ball" in bpy.data.objects and first.result.state == "PREVIEW"
    bpy.ops.beyond_mocap.discard(player=first.name)
    assert "Ball" not in bpy.data.objects
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept(player=first.name)
    path = path_of_the_ball()
    bpy.ops.beyond_mocap.discard(player=second.name)
    np.testing.assert_array_equal(path_of_the_ball(), path)
    assert not ready.shared.ball.kept and sum(action.name.startswith("Ball path") for action in bpy.data.actions) == 1


def path_of_the_ball():
    found = []
    for frame in (30, 150, 200):
        bpy.context.scene.frame_set(frame)
        found.append(np.array(bpy.data.objects["Ball"].matrix_world.translation))
    return np.array(found)


def test_a_linked_body_is_refused(one, tmp_path):
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    bpy.data.libraries.write(str(tmp_path / "body.blend"), {one.body})
    with bpy.data.libraries.load(str(tmp_path / "body.blend"), link=True) as (source, target):
        target.objects = source.objects[:]
    linked = next(thing for thing in target.objects if thing.type == "ARMATURE")
    one.body = linked
    refused(bpy.ops.beyond_mocap.synthesize, "linked from .*Make Local")


def test_the_report_is_kept_with_the_take(extension, one, session):  # noqa: F811
    bpy.ops.beyond_mocap.synthesize()
    assert session.find_take(one.take).report["root_error_m"]["mean"] < 0.2


def test_the_body_deleted_under_a_preview(one):
    bpy.ops.beyond_mocap.synthesize()
    bpy.data.objects.remove(one.body)
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    assert one.body is not None and one.result.state == "PREVIEW"
    bpy.data.objects.remove(one.body)
    assert bpy.ops.beyond_mocap.discard() == {"FINISHED"}
    assert one.result.state == "NONE" and one.body is None


def test_an_overridden_body_serves_and_comes_back(one, tmp_path):
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    bpy.data.libraries.write(str(tmp_path / "body.blend"), {one.body})
    with bpy.data.libraries.load(str(tmp_path / "body.blend"), link=True) as (source, target):
        target.objects = [name for name in source.objects if name == one.body.name]
    own = target.objects[0].override_create()
    bpy.context.scene.collection.objects.link(own)
    one.body, one.take = own, ""
    one.result.state = "NONE"
    before = own.animation_data and own.animation_data.action
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    assert one.body == own and own.animation_data.action.get("beyond_mocap_take")
    assert bpy.ops.beyond_mocap.discard() == {"FINISHED"}
    assert one.body == own and (own.animation_data and own.animation_data.action) == before


@pytest.mark.parametrize("verb, arguments", [
    ("resynthesize_stretch", {"player": "player1", "start": 3.0, "end": 4.5}),
    ("variants", {"count": 2}),
    ("synthesize", {}),
    ("update", {"player": "player1"}),
])
def test_each_is_one_step_back(one, verb, arguments):
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    assert_one_step(getattr(bpy.ops.beyond_mocap, verb), **arguments)


def test_another_variant_is_one_step_back(one):
    bpy.ops.beyond_mocap.variants(count=2)
    assert_one_step(bpy.ops.beyond_mocap.preview, number=2)
    assert_one_step(bpy.ops.beyond_mocap.accept, form="STRIPS")


@pytest.mark.parametrize("fps, base", [(24, 1.001), (60, 1.0)])
def test_strips_at_any_rate(one, fps, base):
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = fps, base
    bpy.ops.beyond_mocap.synthesize()
    frames = np.linspace(1, 11 * fps / base, 40)
    whole = poses(one.body, frames)
    bpy.ops.beyond_mocap.accept(form="STRIPS")
    np.testing.assert_allclose(poses(one.body, frames), whole, atol=1e-5)


def test_a_strip_is_named_by_its_action_and_not_by_the_run_up(extension):
    blocks = importlib.import_module(f"{extension.__name__}.scene.result.blocks")
    words = (("sprinting", "front"),) * 2 + (("kick", "right"),) + (("sprinting", "front"),) * 3
    take = SimpleNamespace(clips=("made-gait/kick_top_7.2.bvh",), clip=[0] * 6, mirrored=[False] * 6, words=words)
    assert blocks.build_strip_name(take, 0, 6) == "kick_top_7.2 kick right"
    assert blocks.build_strip_name(take, 3, 6) == "kick_top_7.2 sprinting front"
