"""Actions that no recording shows are built where they are asked for, and only there."""

from __future__ import annotations

import gc
import shutil
import weakref
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.annotation import KeyMoment, Span, Timeline
from beyond_mocap.base.errors import InputError, NotInLibraryError
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library import features, missing_actions, synthetic_clips
from beyond_mocap.library.build import build_library
from beyond_mocap.library.folder.recordings import CACHE_FOLDER
from beyond_mocap.library.missing_actions import (
    ActionMoment,
    add_actions,
    describe_action,
    find_action,
    find_action_clip,
    find_action_paths,
    find_missing_actions,
    is_action_clip,
    list_action_labels,
    select_own_kicks,
)
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resynthesize import resynthesize
from beyond_mocap.synthesis.search.candidate_index import CandidateIndex
from beyond_mocap.synthesis.synthesize import synthesize

HEADER = ("header", "standing", "jump")


def plan_walk(library, *words: str, **settings) -> Plan:
    times = np.arange(0.0, 5.0, 0.1)
    track = Track(times, np.stack([1.2 * times, 0.0 * times], axis=1))
    timeline = Timeline(keys=(KeyMoment(2.5, words),))
    return Plan(track=track, library=library.folder, timeline=timeline, **settings)


def moment(*words: str, **situation) -> ActionMoment:
    return ActionMoment(labels=frozenset(words), **situation)


def test_a_clip_is_read_by_other_processes_as_it_was_built(library, tmp_path, monkeypatch):
    kept = replace(library, cache_location=(tmp_path, "key"))
    paths = find_missing_actions(library, [moment(*HEADER), moment("slide", "tackle", speed=4.0)])
    built = add_actions(kept, paths)
    monkeypatch.setattr(missing_actions, "_build_clip", None)
    read = add_actions(replace(kept), paths)
    assert len(paths) == 2
    for one, other in zip(built.clips[-4:], read.clips[-4:], strict=True):
        assert (one.path, one.mirrored, one.annotations) == (other.path, other.mirrored, other.annotations)
        for values in (lambda clip: clip.motion.root_positions, lambda clip: clip.motion.rotations,
                       lambda clip: clip.heel_toe_contacts):
            assert np.array_equal(values(one), values(other)) and values(one).dtype == values(other).dtype
    with pytest.raises(TypeError):  # a cache of other recordings is not read
        add_actions(replace(kept, cache_location=(tmp_path, "other")), paths)


def test_a_clip_of_an_action_is_found_where_a_request_names_it(library, monkeypatch):
    monkeypatch.setattr(missing_actions, "_find_clips", lambda library, path: (path, None))
    situations = [{"speed": speed, "height": height, "exit_speed": exit_speed, "seconds": seconds}
                  for speed, height, exit_speed, seconds in ((0.0, None, None, 0.0), (2.3, 0.15, 9.0, 3.3),
                                                             (5.1, 0.32, None, 99.0), (9.9, 2.5, 40.0, 0.0))]
    paths = {path for is_span in (False, True) for labels in list_action_labels(is_span) for situation in situations
             for path in find_action_paths(ActionMoment(labels=labels, is_span=is_span, **situation))}
    assert len(paths) > 200 and all(find_action_clip(library, path) == path for path in paths)
    for path in (HEADER[0], *sorted(paths)[:3]):
        assert find_action_clip(library, path.replace(".bvh", "_v77.7.bvh")) is None


def test_a_library_is_extended_as_if_it_were_indexed_as_a_whole(library):
    extended = add_actions(library, find_missing_actions(library, [moment(*HEADER)]))
    whole = replace(extended)  # knows nothing of what it extends
    vars(whole).update({name: vars(extended)[name] for name in ("normal_postures", "strangeness")})
    every = np.ones(len(whole.clips), bool)
    one, other = CandidateIndex(extended, every), CandidateIndex(whole, every)
    assert extended.base_library is library and whole.base_library is None
    for name in ("valid", "by_speed", "strange", "lean", "lifted", "wild_before", "is_made_travel"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    for pairs in ("number", "frame", "speed", "turn", "offset", "long_stance", "lifted", "lean"):
        assert np.array_equal(getattr(one.pairs_by_speed(), pairs), getattr(other.pairs_by_speed(), pairs)), pairs
    assert np.array_equal(extended.manners.of_clip, whole.manners.of_clip)
    assert np.array_equal(extended.manners.distance, whole.manners.distance)


def test_a_library_that_was_extended_is_let_go_of(library):
    """With what is computed of it: a session builds libraries again and again."""
    base = replace(library)
    extended = add_actions(base, find_missing_actions(base, [moment(*HEADER)]))
    CandidateIndex.for_library(extended, np.ones(len(extended.clips), bool))
    found = weakref.ref(base)
    del base
    gc.collect()
    assert found() is None and extended.base_library is None
    assert np.array_equal(extended.manners.of_clip[: len(library.clips)], library.manners.of_clip)


def test_columns_are_kept_of_clips_that_other_libraries_ask_for_alone(library):
    clips = library.clips[:2]
    for clip in clips:
        features._built_columns.pop(clip, None)
    features.build_frames(clips, library.frames)
    assert not any(clip in features._built_columns for clip in clips)
    extended = add_actions(library, find_missing_actions(library, [moment(*HEADER)]))
    assert all(clip in features._built_columns for clip in extended.clips if is_action_clip(clip))


def test_only_what_no_recording_carries_is_missing(library):
    assert find_missing_actions(library, [moment("kick", "low")]) == ()
    assert find_missing_actions(library, [moment("walking"), moment("with", "moonwalk"), moment("front")]) == ()
    path, = find_missing_actions(library, [moment(*HEADER), moment(*HEADER, speed=3.0)])
    assert describe_action(path) == "jumping header" and describe_action("kick.bvh") is None


@pytest.mark.parametrize("height", [None, 0.11, 1.7])
def test_a_label_alone_finds_the_usual_action_and_nothing_special(height):
    names = [find_action(moment(label, speed=speed, height=height)).name
             for label in ("kick", "tackle", "intercept", "throwb", "jump", "slide") for speed in (0.0, 4.0)]
    kick = "high instep kick" if height == 1.7 else "inside kick"
    assert names == [f"{kick} from a stand", f"{kick} on the run", "block tackle", "slide tackle",
                     "interception", "sliding interception", "throw-in", "throw-in", "jump", "jump in a run",
                     "slide tackle", "slide tackle"]


def test_without_a_ball_nobody_dives_for_a_header_and_a_foot_receives():
    assert find_action(moment("header", speed=4.0)).name == "running header"
    assert find_action(moment("receive")).name == "reception with the inside of the foot"
    assert find_action(moment("receive", "body", "high")).name == "reception with the chest"
    assert find_action(moment("header", "left", "jump")).name == "jumping header"
    assert find_action(moment("standing")) is find_action(moment("header", "sitting")) is None


def test_of_several_actions_the_one_that_suits_speed_and_ball_is_taken():
    names = [find_action(moment("header", speed=speed, height=height)).name
             for speed, height in ((0.0, None), (0.5, 1.7), (0.5, 2.3), (4.0, 2.1), (5.0, 0.8))]
    assert names == ["standing header", "standing header", "jumping header", "running header", "diving header"]
    assert find_action(moment("header", "standing", speed=4.0)).name == "standing header"


def test_an_action_with_an_avoided_label_is_not_taken():
    names = [find_action(moment("tackle", speed=4.0, avoid=frozenset(avoid))).name for avoid in ((), ("slide",))]
    assert names == ["slide tackle", "block tackle on the way"]
    for avoid in (("inside",), ("standing",)):
        assert "inside" not in find_action(moment("kick", avoid=frozenset(avoid), speed=0.0)).distinct_labels & {*avoid}
    assert find_action(moment("tackle", "slide", avoid=frozenset({"slide"}))) is None
    # one reception serves a stand and a run alike: what it shows is up to the player's speed
    assert find_action(moment("receive", avoid=frozenset({"running"}))) is find_action(moment("receive"))


def test_an_action_stands_in_where_all_recordings_show_an_avoided_label(library):
    recorded = [key.labels for key in library.keys if "kick" in key.labels]
    avoid = frozenset({"inside", "top"}) & frozenset().union(*recorded)
    assert avoid and all(labels & avoid for labels in recorded)
    plan = plan_walk(library)
    plan = replace(plan, timeline=Timeline(keys=(KeyMoment(2.5, ("kick",), avoid=tuple(sorted(avoid))),)))
    take = synthesize(library, plan)
    assert not avoid & set(take.keys[0].words) and take.keys[0].used_instead is None
    assert "kick" in describe_action(take.keys[0].clip) or "volley" in describe_action(take.keys[0].clip)
    assert not any("avoided label" in line for line in take.warnings)


def test_a_ball_that_runs_ahead_is_taken_into_the_run():
    low = ("receive", "foot", "low")
    names = [find_action(moment(*words, speed=speed, lead=lead)).name
             for words, speed, lead in ((low, 4.0, 0.5), (low, 4.0, 2.0), (low, 0.5, 2.0),
                                         (("receive", "thigh"), 4.0, 2.0))]
    inside = "reception with the inside of the foot"
    assert names == [inside, "first touch into the run", inside, "reception with the thigh"]


def test_a_high_ball_is_taken_with_the_head_and_one_that_is_let_run_without_a_turn():
    assert find_action(moment("receive", "head", height=1.7)).name == "reception with the head"
    assert find_action(moment("receive", "head", height=2.3)).name == "reception with the head in a jump"
    assert {find_action(moment("letgo", speed=speed)).name for speed in (0.0, 4.0)} == {"letting the ball run"}
    assert find_action(moment("turning", "letgo", speed=1.5)).name == "turn that lets the ball run"


def test_a_keeper_meets_the_ball_where_it_is():
    names = [find_action(moment("catchb", *words, height=height)).name
             for words, height in (((), 0.2), ((), 1.2), ((), 2.3), (("dive",), 0.3), (("dive",), 1.5))]
    assert names == ["catch low", "catch chest", "catch high", "dive short low catch", "dive short high catch"]
    assert find_action(moment("stomp", "dive", "long_duration", "left")).name == "dive long high push"
    assert find_action(moment("catchb", "slide", speed=4.0)).name == "catch slide"


def test_who_holds_the_ball_sits_only_where_both_labels_ask_for_it():
    names = [find_action(moment(*words, is_span=True)).name for words in (("hold",), ("sitting",), ("hold", "sitting"))]
    assert names == ["holding the ball", "sitting", "sitting with the ball"]


def test_a_gesture_is_shown_where_it_is_requested_and_nowhere_else(library):
    times = np.arange(0.0, 12.0, 0.1)
    track = Track(times, np.stack([0.0 * times, 0.0 * times], axis=1))
    timeline = Timeline(spans=(Span(4.0, 7.0, ("drinking",)),))
    take = synthesize(library, Plan(track=track, library=library.folder, timeline=timeline))
    body, (places, _) = identify_joints(take.motion.skeleton), forward_kinematics(take.motion)
    lifted = np.max(places[:, [body.left.hand, body.right.hand], 2], axis=1) > places[:, body.chest, 2]
    seconds = np.flatnonzero(lifted) / take.motion.fps
    assert len(seconds) > 30 and 3.5 < seconds.min() and seconds.max() < 7.5


@pytest.mark.parametrize("seconds", [1.5, 6.0])
def test_a_gesture_lasts_as_long_as_it_is_requested(library, seconds):
    path, = find_missing_actions(library, [moment("pointing", is_span=True, seconds=seconds)])
    clip = next(clip for clip in add_actions(library, [path]).clips if is_action_clip(clip))
    row, body = clip.annotations[0], identify_joints(clip.motion.skeleton)
    places = forward_kinematics(clip.motion)[0]
    raised = places[:, body.right.hand, 2] > places[:, body.chest, 2]
    assert (row.end - row.start) / clip.motion.fps == pytest.approx(seconds, abs=0.05)
    assert np.sum(raised) / clip.motion.fps == pytest.approx(seconds - 0.2, abs=0.4)


def test_actions_are_built_once_for_a_library_and_have_twins(library):
    paths = find_missing_actions(library, [moment(*HEADER, "left")])
    more = add_actions(library, paths)
    assert more is add_actions(library, paths) and add_actions(more, paths) is more
    assert add_actions(library, ()) is library
    right, left = [clip for clip in more.clips if is_action_clip(clip)]
    assert "right" in right.labels_at(right.annotations[0].key) and left.mirrored
    assert "left" in left.labels_at(left.annotations[0].key)
    assert len(more.frames) > len(library.frames) and not any(map(is_action_clip, library.clips))


def test_what_is_known_of_the_other_clips_is_kept(library):
    more = add_actions(library, find_missing_actions(library, [moment(*HEADER, "left")]))
    fresh = replace(more)  # knows nothing yet
    for name in ("strangeness", "stance_seconds", "feet_in_contact"):
        assert name in vars(more) and name not in vars(fresh)
        np.testing.assert_array_equal(getattr(more, name), getattr(fresh, name))
    assert more.normal_postures is library.normal_postures and more.gaits == fresh.gaits
    assert more.cut_receptions == fresh.cut_receptions


def test_a_take_shows_a_missing_action_on_time_and_says_so(library):
    plan = plan_walk(library, *HEADER)
    take = synthesize(library, plan)
    key, = take.keys
    assert key.used_instead is None and describe_action(key.clip) == "jumping header" and set(HEADER) <= set(key.words)
    line, = [line for line in take.warnings if "synthetic jumping header: no recorded one" in line]
    assert not any("synthetic running" in line for line in take.warnings)
    again = resynthesize(library, plan, take)
    np.testing.assert_array_equal(again.motion.rotations, take.motion.rotations)
    other = resynthesize(library, plan_walk(library, "throwb"), take)
    assert [describe_action(key.clip) for key in other.keys] == ["throw-in"]


def test_without_synthetic_clips_the_label_is_missing_as_before(library):
    with pytest.raises(NotInLibraryError, match="no clip for 'header"):
        synthesize(library, plan_walk(library, *HEADER, made=False))
    take = synthesize(library, plan_walk(library, *HEADER, made=False, nearest=True))
    assert take.keys[0].used_instead is not None


def test_a_label_that_lasts_is_refused_as_a_key_moment(library):
    with pytest.raises(NotInLibraryError, match="'drinking' lasts: give it a start and an end"):
        synthesize(library, plan_walk(library, "drinking"))


def test_an_action_of_another_version_is_reported(library):
    path, = find_missing_actions(library, [moment(*HEADER)])
    with pytest.raises(InputError, match="an unknown synthetic action"):
        add_actions(library, [path.replace("jumping", "levitating")])


def test_a_librarys_own_kicker_comes_before_published_swings(library, monkeypatch):
    """As in libraries whose kicks do not say at which pace they are done."""
    clips = tuple(replace(clip, annotations=tuple(
        row if row.key is None else replace(row, words=tuple(word for word in row.words if word != "running"))
        for row in clip.annotations)) for clip in library.clips)
    bare = replace(library, clips=clips, cache_location=None)
    monkeypatch.setattr(synthetic_clips, "MAX_SPEED", 2.4)  # no synthetic runs, which would take half of the time
    more, asked = bare.with_synthetic_clips, ("kick", "low", "inside", "running")
    own = {more.clips[key.clip].path for key in select_own_kicks(more, moment(*asked, speed=6.5))}
    assert own and set(find_missing_actions(bare, [moment(*asked, speed=6.5)])) == own
    for slow_or_other in (moment(*asked, speed=1.0), moment("kick", "outside", speed=6.5)):
        paths = find_missing_actions(bare, [slow_or_other])
        assert paths and all("action_" in path for path in paths)


def test_a_clip_that_is_built_again_has_the_same_bits(library, monkeypatch):
    monkeypatch.setattr(missing_actions, "_KEPT_CLIPS", 1)
    monkeypatch.setattr(missing_actions, "_KEPT", 1)
    first, other = (find_missing_actions(library, [moment(word, speed=3.0)]) for word in ("throwb", "tackle"))
    shown = [add_actions(library, paths) for paths in (first, other, first)]
    clips = [one.clips[-2].motion for one in shown]
    assert shown[0] is not shown[2] and clips[0] is not clips[2]
    np.testing.assert_array_equal(clips[0].rotations, clips[2].rotations)
    assert len(missing_actions._clips[library]) == len(missing_actions._extended[library]) == 1


def test_a_file_of_another_version_beside_the_cache_is_replaced(library, tmp_path):
    """In a copy: other processes use the cache."""
    place = shutil.copytree(library.cache_location[0], tmp_path / "cache")
    library = build_library(library.folder, cache_dir=place)
    path, = find_missing_actions(library, [moment("tackle", "block")])
    file = library.cache_location[0] / Path(path).relative_to(CACHE_FOLDER)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("another version")
    file.with_suffix(".npz").unlink(missing_ok=True)  # its key is another one
    missing_actions._clips.pop(library, None)
    missing_actions._extended.pop(library, None)
    clip = next(clip for clip in add_actions(library, [path]).clips if is_action_clip(clip))
    assert len(bvh.read_bvh(file).motion) == len(clip.motion)


@pytest.mark.parametrize("words", ["tying", "sitting", "ground", "celebration jump", "hold middle", "dejected"])
def test_a_span_whose_action_begins_with_an_effort_is_shown(library, words):
    times = np.arange(0.0, 8.0, 0.1)
    speed = 1.1 if words == "dejected" else 0.0
    track = Track(times, np.stack([speed * times, 0.0 * times], axis=1))
    plan = Plan(track=track, library=library.folder, timeline=Timeline(spans=(Span(3.0, 6.0, tuple(words.split())),)))
    take = synthesize(library, plan)
    shown = [set(words.split()) <= set(take.words[int(time * take.motion.fps)]) for time in np.arange(3.0, 6.0, 0.1)]
    assert np.mean(shown) > (0.3 if "jump" in words else 0.6)


def test_a_jump_is_played_at_its_own_pace_and_falls_freely(library):
    take = synthesize(library, replace(plan_walk(library, *HEADER), nearest=True))
    (key,) = take.keys
    frame = int(round(key.frame))
    steps = np.diff(take.clip_frame[frame - 6 : frame + 7])
    own_fps = next(clip.motion.fps for clip in add_actions(library.with_synthetic_clips, [key.clip]).clips
                   if clip.path == key.clip)
    assert steps == pytest.approx(own_fps / take.motion.fps, abs=0.02)


def test_lying_legs_are_not_planted(library):
    clips = add_actions(library.with_synthetic_clips, find_missing_actions(library, [moment("fall")])).clips
    fall = next(clip for clip in clips if is_action_clip(clip))
    body = identify_joints(fall.motion.skeleton)
    hips = forward_kinematics(fall.motion)[0][:, body.hips, 2]
    assert not fall.heel_toe_contacts[hips < 0.25].any() and fall.heel_toe_contacts[hips > 0.8].any()
