"""What is out of date is told, each cause by its line, and the button that is offered mends it."""

import importlib
import os

import bpy
import numpy as np
import pytest
from test_players import match, ready, refused, session  # noqa: F401  (fixtures)
from test_result import one  # noqa: F401  (fixture)


@pytest.fixture
def scene(extension):
    return lambda name: importlib.import_module(f"{extension.__name__}.scene.{name}")


@pytest.fixture
def renew(scene):
    freshness = scene("result.freshness")
    return lambda: freshness.update_entry(bpy.context.scene, bpy.context.scene.beyond_mocap.players[0])


@pytest.fixture
def made(one):  # noqa: F811
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    return one


def test_nothing_is_out_of_date_at_first(renew, made, ready):  # noqa: F811
    assert (renew().lines, renew().notes, renew().mend) == ("", "", "")
    made.use, made.shirt = False, (0, 0, 1)
    assert renew().lines == ""


@pytest.mark.parametrize("change, line", [
    (lambda settings, match: setattr(settings, "alpha", 0.5), "settings of step 3"),
    (lambda settings, match: (match / "player1.csv").write_text((match / "player1.csv").read_text().replace(",0.0",
                                                                                                            ",0.1")),
     "track"),
    (lambda settings, match: setattr(settings, "track_window", 2.0), "settings"),
    (lambda settings, match: bpy.data.objects.remove(settings.players[0].body), "body has been deleted"),
])
def test_each_cause_has_its_line_and_update_mends_it(renew, made, ready, match, change, line):  # noqa: F811
    change(ready, match)
    assert line in renew().lines and renew().mend == "update"
    assert bpy.ops.beyond_mocap.update(player=made.name) == {"FINISHED"}
    assert renew().lines == ""


def test_words_of_a_text_stay_the_words(renew, made, ready, scene):  # noqa: F811
    """A player without strips gets none by a synthesis: strips would count more than the text."""
    dots, strips = scene("player.dots"), scene("timeline.strips")
    dots.remove_dot(bpy.context.scene, made)
    text = bpy.data.texts.new("words")
    text.write("6.0 kick right\n")
    made.annotation_text = text
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    assert strips.read_player_timeline(made, bpy.context.scene) is None and renew().lines == ""
    text.write("8.0 12.0 jogging\n")
    assert "labels" in renew().lines


def test_words(renew, made, ready, session, scene):  # noqa: F811
    plans, strips = scene("result.plans"), scene("timeline.strips")
    strips.add_moment(bpy.context, made, 9.0, ("kick",))
    assert "labels" in renew().lines
    bpy.ops.beyond_mocap.update()
    assert renew().lines == "" and session.find_take(made.take).plan.timeline == plans.build_plan(ready,
            made)[0].timeline


def test_the_library_on_disk(renew, made, ready, tmp_path):  # noqa: F811
    folder = bpy.path.abspath(ready.library_folder)
    clip = os.path.join(folder, "standing_1.txt")
    target = os.path.realpath(clip)
    os.unlink(clip)
    with open(clip, "w", encoding="utf-8") as file:
        file.write(open(target, encoding="utf-8").read() + "\n# looked through\n")
    assert "library" in renew().lines and renew().mend == "build_library"
    os.unlink(clip)
    os.symlink(target, clip)
    assert renew().lines == ""


def test_after_the_file_was_opened_again_update_makes_the_same_bits(renew, made, session, tmp_path,  # noqa: F811
                                                                      capfd):
    bpy.ops.beyond_mocap.resynthesize_stretch(player=made.name, start=3.0, end=5.0)
    bpy.ops.beyond_mocap.resynthesize_stretch(player=made.name, start=8.0, end=9.5)
    bpy.ops.beyond_mocap.accept()
    made.body.pose.bones["LeftArm"].keyframe_insert("rotation_quaternion", frame=50.5)
    before = session.find_take(made.take).take
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    session.clear_session()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"))
    player = bpy.context.scene.beyond_mocap.players[0]
    assert renew().lines == renew().mend == ""  # nothing has changed, so nothing is out of date
    assert "opened again: Update computes the take" in renew().notes and "1 manual key:" in renew().notes
    assert player.result.state == "ACCEPTED"
    capfd.readouterr()
    bpy.ops.beyond_mocap.update()
    assert f"Nothing has changed: {player.name}" in capfd.readouterr().out
    after = session.find_take(player.take).take
    np.testing.assert_array_equal(after.motion.rotations, before.motion.rotations)
    np.testing.assert_array_equal(after.motion.root_positions, before.motion.root_positions)
    assert renew().lines == "" and player.result.hand_keys == 1


def test_update_brings_back_all_takes_of_a_file_and_not_only_what_is_out_of_date(ready, session, scene):  # noqa: F811
    bpy.ops.beyond_mocap.synthesize()
    session.clear_session()  # as when the file is opened again
    scene("timeline.strips").add_moment(bpy.context, ready.players[0], 9.0, ("kick",))
    bpy.ops.beyond_mocap.update()
    assert len(ready.players) == 2 and all(session.find_take(player.take) for player in ready.players)


def test_nothing_has_changed_is_said_only_where_the_take_is_the_same(made, ready, capfd):  # noqa: F811
    def press(**arguments):
        capfd.readouterr()
        (bpy.ops.beyond_mocap.update_live if arguments else bpy.ops.beyond_mocap.update)(**arguments)
        return capfd.readouterr().out

    assert "Nothing has changed" in press()
    bpy.data.objects.remove(made.body)
    assert "Generated" in press()  # another body
    bpy.ops.beyond_mocap.discard()
    assert "Generated" in press()  # shown again
    for kind in ("whole", ""):
        ready.alpha += 0.1
        assert "Generated" in press(player=made.name, kind="quick")
        assert "Generated" in press(**({"player": made.name, "kind": kind} if kind else {}))  # the full take
    assert "Nothing has changed" in press()


def test_a_stretch_is_another_solution_and_pressed_again_a_third(made, session):  # noqa: F811
    first = session.find_take(made.take).take
    bpy.ops.beyond_mocap.resynthesize_stretch(player=made.name, start=3.0, end=5.0)
    second = session.find_take(made.take).take
    bpy.ops.beyond_mocap.resynthesize_stretch(player=made.name, start=3.0, end=5.0)
    third = session.find_take(made.take).take
    for one_, other in ((first, second), (second, third), (first, third)):
        off = np.any(one_.motion.rotations != other.motion.rotations, axis=(1, 2))
        assert off[3 * 30 : 5 * 30].mean() > 0.5 and not off[: 1 * 30].any() and not off[8 * 30 :].any()
    refused(bpy.ops.beyond_mocap.resynthesize_stretch, "within", player=made.name, start=3.0, end=50.0)


def test_a_stretch_by_what_is_selected(made, session):  # noqa: F811
    made.body.select_set(False)
    refused(bpy.ops.beyond_mocap.resynthesize_stretch, "no range of time is selected")
    scene = bpy.context.scene
    scene.use_preview_range, scene.frame_preview_start, scene.frame_preview_end = True, 61, 121
    take = made.take
    assert bpy.ops.beyond_mocap.resynthesize_stretch() == {"FINISHED"} and made.take != take
    bpy.ops.beyond_mocap.accept(form="STRIPS")
    scene.use_preview_range = False
    made.body.select_set(True)
    track = made.body.animation_data.nla_tracks["Beyond Mocap"]
    for number, strip in enumerate(track.strips):
        strip.select = number == 2
    before, seconds = session.find_take(made.take).take, [
        (f - 1) / 30 for f in (track.strips[2].frame_start, track.strips[2].frame_end)
    ]
    assert bpy.ops.beyond_mocap.resynthesize_stretch() == {"FINISHED"}
    off = (
        np.any(before.motion.rotations != session.find_take(made.take).take.motion.rotations, axis=(1, 2)).nonzero()[0]
        / 30
    )
    assert len(off) and off.min() > seconds[0] - 2.0 and off.max() < seconds[1] + 2.0
    assert made.result.state == "PREVIEW"


def test_variants_to_choose_from(made, session):  # noqa: F811
    files = {kind: len(getattr(bpy.data, kind)) for kind in ("objects", "actions", "armatures", "meshes", "curves")}
    assert bpy.ops.beyond_mocap.variants(count=3) == {"FINISHED"}
    variants = made.result.variants
    assert len(variants) == 3 and made.take == variants[0].name and made.result.state == "PREVIEW"
    takes = [session.find_take(variant.name).take for variant in variants]
    for a in range(3):
        for b in range(a):
            assert np.any(takes[a].motion.rotations != takes[b].motion.rotations, axis=(1, 2)).mean() > 0.5
    assert "% different" in variants[1].summary and "slide" in variants[0].summary
    assert bpy.ops.beyond_mocap.preview(number=3) == {"FINISHED"}
    assert made.take == made.result.variants[2].name
    bpy.ops.beyond_mocap.accept()
    assert not made.result.variants and made.take
    now = {kind: len(getattr(bpy.data, kind)) for kind in files}
    assert {**now, "actions": 0} == {**files, "actions": 0}
    bodies = [action for action in bpy.data.actions if action.get("beyond_mocap_take")]
    assert sum("take" in action.name for action in bodies) == 1, bodies
    refused(bpy.ops.beyond_mocap.preview, "No variants")


def test_variants_by_seed_where_the_method_draws_lots(made, session, ready):  # noqa: F811
    ready.method = "blocks"
    assert bpy.ops.beyond_mocap.variants(count=2) == {"FINISHED"}
    assert [session.find_take(variant.name).plan.seed for variant in made.result.variants] == [0, 1]


def test_fingerprints(extension):
    freshness = importlib.import_module(f"{extension.__name__}.scene.result.freshness")
    one = freshness.compute_fingerprint({"a": np.arange(3), "b": (1, "x", None)})
    assert one == freshness.compute_fingerprint({"b": (1, "x", None), "a": np.arange(3)})
    assert one != freshness.compute_fingerprint({"a": np.arange(3.0), "b": (1, "x", None)})
    assert freshness.compute_fingerprint(("ab", "c")) != freshness.compute_fingerprint(("a", "bc"))


def test_a_take_of_0_1_is_out_of_date_where_a_default_has_changed_since(extension):
    """Version 0.1 did not solve touches by default and left such settings out of its fingerprints."""
    freshness = importlib.import_module(f"{extension.__name__}.scene.result.freshness")
    plan = importlib.import_module(f"{extension.__name__}.beyond_mocap.synthesis.plan").Plan
    track = importlib.import_module(f"{extension.__name__}.beyond_mocap.motion.track").Track
    walk = track(np.arange(3.0), np.zeros((3, 2)))
    seen = {}
    for solves in (False, True):
        names = []
        digest = type("Digest", (), {"update": lambda self, content, names=names: names.append(content)})()
        freshness._feed_digest(digest, plan(track=walk, solve_touches=solves))
        seen[solves] = b"solve_touches" in names
    assert seen == {False: False, True: True}
