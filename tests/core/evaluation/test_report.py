"""The whole report on takes whose figures are known: an uncut clip, a shifted track, a jolt, a warp, a loop, a key
moment."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from beyond_mocap.annotation import KeyMoment, Span, Timeline, labels_per_frame
from beyond_mocap.base.errors import InputError
from beyond_mocap.evaluation.annotation_similarity import fill_automatic_spans
from beyond_mocap.evaluation.naturalness import measure_course
from beyond_mocap.evaluation.report import evaluate, evaluate_played, flatten_report
from beyond_mocap.files import tables
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.library.clip import SYNTHETIC_FOLDER
from beyond_mocap.library.features import build_frames
from beyond_mocap.library.library import Gait
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.motion import resample, sample_frames
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.provenance import build_provenance, read_provenance, write_provenance
from beyond_mocap.synthesis.quality.playback import playback_from_tables, playback_from_take
from beyond_mocap.synthesis.quality.targets import TARGETS
from beyond_mocap.synthetic.gait import build_gait
from tests.core.report_contract import GROUPS, assert_contract

FPS = 30.0
KEY_FRAME = 300


@pytest.fixture(scope="session")
def uncut(cut):
    return cut(("jog.bvh", 30, 300))


def test_the_report_has_the_contract_s_keys_and_is_json(uncut, track_of, library):
    asked = replace(uncut, timeline=Timeline(keys=(KeyMoment(14.5, ("kick", "right")),)))
    report = evaluate(asked, track_of(uncut), library)
    assert_contract(report)
    assert len(report["keys"]) == 1
    assert json.loads(json.dumps(report, allow_nan=False)) == report


def test_an_uncut_clip_scores_what_its_recording_scores(uncut, track_of, library):
    report = evaluate(uncut, track_of(uncut), library)
    assert report["seams"] == 0 and report["loop_share"] == 0.0
    assert report["warp_rate"] == {"min": 1.0, "max": 1.0}
    # the window is pinned at both ends, where the sway stays in
    assert report["root_error_m"]["mean"] < 0.002 and report["root_error_m"]["max"] < 0.02
    skate = report["skate"]
    assert skate["contact_cm_s"] == pytest.approx(skate["source_contact_cm_s"], rel=0.03)
    assert skate["gmd_ratio"] == pytest.approx(skate["source_gmd_ratio"], abs=0.01)
    assert report["pelvis_error_m"]["mean"] == pytest.approx(report["pelvis_error_m"]["own"], abs=0.002)
    assert report["pelvis_surge_ratio"] == pytest.approx(1.0, abs=0.1)
    assert report["pelvis_drop_m"] < 1e-3
    assert report["bone_change_m"] < 1e-6
    assert report["speed_coverage"] == {"above": 0.0, "below": 0.0}
    assert report["seam_jerk_ratio"]["median"] is None
    assert report["seam_jerk_ratio"]["rest_share_above_real"] < 0.3


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_twin_scores_as_the_recording(cut, track_of, library, mirrored):
    take = cut(("run.bvh", 30, 200, 1.0, mirrored))
    report = evaluate(take, track_of(take), library)
    assert report["pelvis_drop_m"] < 1e-3
    assert report["skate"]["contact_cm_s"] == pytest.approx(report["skate"]["source_contact_cm_s"], rel=0.05)


def test_a_shifted_track_is_the_root_error(uncut, track_of, library):
    report = evaluate(uncut, track_of(uncut, shift=(0.03, 0.04)), library)
    for name in ("mean", "p95", "max"):
        assert report["root_error_m"][name] == pytest.approx(0.05, abs=0.002)
    assert report["pelvis_error_m"]["mean"] > 0.04


def test_a_sliding_body_skates_by_what_it_slides(uncut, track_of, library):
    slide = np.stack([0.1 * np.arange(len(uncut.motion)) / FPS, 0 * np.arange(300), 0 * np.arange(300)], axis=-1)
    moved = replace(uncut, motion=replace(uncut.motion, root_positions=uncut.motion.root_positions + slide))
    report = evaluate(moved, track_of(uncut), library)
    still = evaluate(uncut, track_of(uncut), library)
    assert report["skate"]["contact_cm_s"] == pytest.approx(still["skate"]["contact_cm_s"] + 10.0, abs=2.0)
    assert report["skate"]["stance_mm_median"] > still["skate"]["stance_mm_median"] + 5.0
    assert report["skate"]["source_contact_cm_s"] == still["skate"]["source_contact_cm_s"]


def test_a_lowered_pelvis_and_moved_feet_are_told(uncut, track_of, library):
    lowered = replace(uncut.motion, root_positions=uncut.motion.root_positions - [0.0, 0.0, 0.03])
    report = evaluate(replace(uncut, motion=lowered), track_of(uncut), library)
    assert report["pelvis_drop_m"] == pytest.approx(0.03, abs=1e-3)
    assert report["foot_correction_m"]["p95"] is None  # a blend or an edit moves feet, too: not seen on the motion
    assert report["unknown"]["foot_correction_m.p95"] == "known only while the take is made"
    assert report["ground_mm"]["min"] < -25
    told = replace(uncut, correction=np.full((len(uncut.motion), 2), 0.07))
    assert evaluate(told, track_of(uncut), library)["foot_correction_m"]["p95"] == 0.07


def test_a_jolt_at_a_seam_is_beyond_what_is_real(cut, track_of, library):
    smooth = cut(("jog.bvh", 0, 120), ("jog.bvh", 240, 120))
    rough = cut(("jog.bvh", 0, 120), ("walk.bvh", 13, 120))
    assert evaluate(smooth, track_of(smooth), library)["seams"] == 0
    report = evaluate(rough, track_of(rough), library)
    assert report["seams"] == 1
    assert report["seam_jerk_ratio"]["max"] > 1.5 and report["seam_jerk_ratio"]["share_above_real"] == 1.0


def test_a_planted_warp_is_the_warp_rate(cut, track_of, library):
    take = cut(("jog.bvh", 0, 90, 1.2), ("run.bvh", 100, 90, 0.9))
    rate = evaluate(take, track_of(take), library)["warp_rate"]
    assert (rate["min"], rate["max"]) == (pytest.approx(0.9, abs=1e-6), pytest.approx(1.2, abs=1e-6))


def test_a_stride_played_five_times_is_a_loop(cut, track_of, library):
    take = cut(*[("run.bvh", 60, 20)] * 5)
    assert evaluate(take, track_of(take), library)["loop_share"] == pytest.approx(0.8)


def test_a_track_too_fast_is_covered_nowhere_and_told(uncut, library):
    times = np.arange(10.0, 20.0, 0.04)
    report = evaluate(uncut, Track(times, np.stack([8.0 * (times - 10.0), 0 * times], axis=-1)), library)
    assert report["speed_coverage"]["above"] == 1.0
    assert any("faster than the library" in warning for warning in report["warnings"])


@pytest.mark.parametrize("late", [0.0, 0.05, -0.1])
def test_a_key_played_late_has_that_time_error(cut, track_of, library, late):
    # source frame 300 of a 60 fps clip, begun at 150, is played 2.5 s after the start at 10 s
    key = KeyMoment(12.5 - late, ("kick", "right"))
    take = cut(("jog.bvh", 150, 200), requested=(key,))
    for given in (take, replace(take, keys=())):
        told = evaluate(given, track_of(take, shift=(0.0, 0.2)), library)["keys"][0]
        assert told["time_error_s"] == pytest.approx(late, abs=1e-6)
        assert (told["clip"], told["clip_frame"]) == ("jog.bvh", KEY_FRAME)
        assert told["position_error_m"] == pytest.approx(0.2, abs=0.01)
        assert told["labels"] == ["kick", "right"] and told["used_instead"] is None


def test_a_key_whose_words_are_lacking_says_what_was_used(cut, track_of, library):
    take = replace(cut(("jog.bvh", 150, 200), requested=(KeyMoment(12.5, ("header",)),)), keys=())
    report = evaluate(take, track_of(take), library)
    assert report["keys"][0]["used_instead"] == ["front", "jogging", "kick", "right"]
    assert report["annotation_similarity"]["keys"] == 1.0 and report["annotation_similarity"]["had_keys"] is None


def test_only_key_moments_that_the_library_has_count_against_it(cut, track_of, library):
    lacking, missed = KeyMoment(12.5, ("header",)), KeyMoment(15.0, ("kick", "right"))
    take = replace(cut(("jog.bvh", 150, 200), timeline=Timeline(keys=(lacking, missed))), keys=())
    similarity = evaluate(take, track_of(take), library)["annotation_similarity"]
    assert similarity["keys"] == similarity["had_keys"] == 1.0


def test_a_key_that_no_clip_plays_says_what_is_shown(cut, track_of, library):
    take = cut(("walk.bvh", 0, 200), timeline=Timeline(keys=(KeyMoment(12.0, ("kick",)),)))
    told = evaluate(take, track_of(take), library)["keys"][0]
    assert (told["clip"], told["clip_frame"], told["time_error_s"]) == ("walk.bvh", 120.0, None)
    assert told["used_instead"] == ["front", "walking"]


def test_the_gap_to_the_ball_as_written_out(cut, track_of, still_ball, library):
    take = cut(("jog.bvh", 150, 200), requested=(KeyMoment(12.5, ("kick", "right")),))
    played = playback_from_take(take)
    foot, toe = played.feet[75, 1]
    side = np.cross(toe - foot, [0.0, 0.0, 1.0])
    place = 0.5 * (foot + toe) + side / np.linalg.norm(side) * (0.05 + 0.11 + 0.02)
    ball = np.append(place[:2] + [0.3, 0.4], 0.11)
    told = evaluate(replace(take, ball=still_ball(take, place)), track_of(take, ball=ball), library)["keys"][0]
    assert told["contact_gap_m"] == pytest.approx(0.02, abs=1e-5)
    assert told["ball_shift_m"] == pytest.approx(0.5, abs=1e-5)
    assert evaluate(take, track_of(take), library)["keys"][0]["contact_gap_m"] is None


def test_similarity_counts_asked_words_and_leaves_entry_and_exit_out(cut, track_of, library):
    # 10 .. 13 asked running but played jogging, except for the kick's own row 4.5 .. 5.6 s of the clip (12.0 .. 13.1)
    timeline = Timeline((Span(10.0, 20.0, ("running",)),), (KeyMoment(12.5, ("kick", "right")),))
    take = cut(("jog.bvh", 150, 91), ("run.bvh", 0, 210), requested=timeline.keys, timeline=timeline)
    report = evaluate(take, track_of(take), library)
    similarity = report["annotation_similarity"]
    wrong, right = 60, 210
    assert similarity["all"] == pytest.approx((wrong - right) / (wrong + right), abs=0.02)
    assert similarity["keys"] == -1.0
    # as printed: jogging front for running are three words apart, running front for running one of two
    assert similarity["eq18_all"] == pytest.approx(wrong / (wrong + right), abs=0.02)
    assert similarity["eq18_keys"] == 0.0


def test_automatic_locomotion_is_asked_by_speed(cut, track_of, library):
    take = cut(("run.bvh", 60, 200))
    assert evaluate(take, track_of(take), library)["annotation_similarity"]["all"] == -1.0


@pytest.mark.parametrize("shows, word", [("jog.bvh", "walking"), (SYNTHETIC_FOLDER + "slow_3.0.bvh", "jogging")])
def test_automatic_words_come_from_made_clips_too_where_one_is_shown(shows, word):
    """At 2.4 m/s the recordings' walk is asked, but a jog that was made is nearer."""
    walk, jog = Gait("walking", ("walking", "front"), 1.4), Gait("jogging", ("jogging", "front"), 2.6)
    more = SimpleNamespace(fps=FPS, gaits=(walk, jog), gait_thresholds=np.array([2.0]), clips=())
    library = SimpleNamespace(fps=FPS, gaits=(walk,), gait_thresholds=np.zeros(0), clips=(), with_synthetic_clips=more)
    times = np.arange(0.0, 4.0, 0.04)
    track = Track(times, np.column_stack([2.4 * times, np.zeros_like(times)]))
    view = SimpleNamespace(library=library, track=track, timeline=Timeline(), played=SimpleNamespace(clips=(shows,)),
                           interpolate_planned_heading=lambda times: None)
    asked = labels_per_frame(fill_automatic_spans(view), np.array([1.0, 2.0, 3.0]))
    assert all(word in found for found in asked)


def test_files_score_as_the_take_in_memory(cut, track_of, still_ball, library, tmp_path):
    key = KeyMoment(12.5, ("kick", "right"))
    take = cut(("jog.bvh", 150, 120), ("run.bvh", 40, 120), requested=(key,))
    take = replace(take, ball=still_ball(take, (3.0, 0.0, 0.11)))
    bvh.write_bvh(tmp_path / "m.bvh", take.motion)
    write_provenance(tmp_path / "p.csv", take)
    tables.write_ball(tmp_path / "b.csv", take.ball)
    motion, provenance = bvh.read_bvh(tmp_path / "m.bvh", 0.01).motion, read_provenance(tmp_path / "p.csv")
    played = playback_from_tables(motion, provenance, tables.read_ball(tmp_path / "b.csv"))
    track = track_of(take)
    read = evaluate_played(played, track=track, timeline=take.timeline, library=library)
    made = evaluate(take, track, library)
    for report in (read, made):  # all strides of a steady made run have the p95 jerk itself: the last bits decide
        del report["seam_jerk_ratio"]["rest_share_above_real"]
    for name in (*GROUPS, "keys", "loop_share", "pose_realism", "pelvis_surge_ratio"):
        if name != "seconds":
            _same(read[name], made[name])


def _same(a, b):
    if isinstance(a, dict):
        assert set(a) == set(b)
        for key in a:
            _same(a[key], b[key])
    elif isinstance(a, list) and a and isinstance(a[0], dict):
        for left, right in zip(a, b, strict=True):
            _same(left, right)
    elif isinstance(a, float):
        # shares of a few dozen steps: one more or less on a rounded frame
        assert a == pytest.approx(b, rel=0.02, abs=0.01)
    else:
        assert a == b


def test_heading_is_compared_with_the_plan_of_the_take(uncut, track_of, library):
    """Not with what its track alone would plan: a heading key may have asked for something else."""
    course = measure_course(uncut.motion.skeleton, playback_from_take(uncut).positions, uncut.motion.fps)
    assert len(course.heading) == len(uncut.motion)
    for off in (0.0, 40.0):
        take = replace(uncut, planned_heading=course.heading + np.radians(off) + 2.0 * np.pi)
        figures = evaluate(take, track_of(take), library)["naturalness"]
        assert figures["off_plan_deg_median"] == pytest.approx(off, abs=1e-6)


def test_a_motion_alone_still_has_what_needs_nothing_else(uncut):
    report = evaluate_played(playback_from_tables(uncut.motion))
    assert report["root_error_m"]["mean"] is None and report["keys"] == []
    assert report["skate"]["gmd_ratio"] is not None and report["skate"]["source_gmd_ratio"] is None
    assert report["warp_rate"]["max"] is None and report["loop_share"] is None
    json.dumps(report, allow_nan=False)


def test_a_library_of_one_clip_has_no_other_to_compare_poses_with(uncut, track_of, library):
    clips = tuple(clip for clip in library.clips if clip.path == "jog.bvh")
    alone = replace(library, clips=clips, frames=build_frames(clips))
    report = evaluate(uncut, track_of(uncut), alone)
    assert report["pose_realism"] is None
    assert report["skate"]["source_contact_cm_s"] is not None


def at_rate(take, fps):
    """The same take at another frame rate."""
    motion = resample(take.motion, fps)
    at = np.minimum(np.arange(len(motion)) * FPS / fps, len(take.motion) - 1.0)
    near = np.floor(at + 1e-9).astype(int)
    step = np.append(np.where(np.diff(take.clip) != 0, 2.0, np.diff(take.clip_frame)), 2.0)
    return replace(
        take, motion=motion, clip=take.clip[near], mirrored=take.mirrored[near], contacts=take.contacts[near],
        words=tuple(take.words[i] for i in near), clip_frame=take.clip_frame[near] + (at - near) * step[near],
        seams=np.rint(take.seams * fps / FPS).astype(int),
    )  # fmt: skip


@pytest.mark.parametrize("fps", [25.0, 60.0])
def test_what_the_eye_sees_does_not_depend_on_the_rate(cut, track_of, library, fps):
    take = cut(("jog.bvh", 30, 120), ("run.bvh", 100, 120), ("walk.bvh", 30, 60), ("jog.bvh", 300, 90))
    here, there = (evaluate(one, track_of(take), library)["naturalness"] for one in (take, at_rate(take, fps)))
    assert there["slow_pieces"] == here["slow_pieces"] > 0
    for name in ("dwell_s_median", "cuts_per_min", "snap_turns_per_min", "pelvis_drops_per_min", "frames"):
        assert there[name] == pytest.approx(here[name], rel=0.03, abs=0.05), name
    for name in ("fast_frames", "source_frames", "source_fast_frames"):
        assert there[name] == pytest.approx(here[name], rel=0.03), name
    for name in ("off_travel_deg_p90", "off_plan_deg_p90", "source_off_travel_deg_p90"):
        assert there[name] == pytest.approx(here[name], abs=1.5), name


def synthetic_from(take, frame):
    """The take as if its frames from `frame` on came from a synthetic clip."""
    clip = np.where(np.arange(len(take.clip)) < frame, take.clip, len(take.clips))
    return replace(take, clips=(*take.clips, SYNTHETIC_FOLDER + "fast_5.0.bvh"), clip=clip)


def test_own_figures_rest_on_recorded_frames_and_say_on_how_many(uncut, track_of, library):
    track = track_of(uncut)
    whole, half = (evaluate(take, track, library) for take in (uncut, synthetic_from(uncut, 150)))
    for report, frames in ((whole, 300), (half, 150)):
        assert report["skate"]["source_frames"] == report["pelvis_error_m"]["own_frames"] == frames
        assert report["ground_mm"]["source_frames"] == report["smoothness_m"]["source_frames"] == frames
        assert report["naturalness"]["source_frames"] == pytest.approx(frames, abs=1)
        assert report["naturalness"]["frames"] == 300
    assert half["skate"]["source_contact_cm_s"] is not None


def test_no_own_figure_is_silently_empty(uncut, track_of, library):
    report = evaluate(synthetic_from(uncut, 0), track_of(uncut), library)
    flat = flatten_report(report)
    own = [name for name in flat if name.rpartition(".")[2].startswith("source_") or name.endswith(".own")]
    own = [name for name in own if not name.startswith("touches.")]  # these are of the whole library
    empty = [name for name in own if flat[name] is None]
    assert {"skate.source_contact_cm_s", "pelvis_error_m.own", "pelvis_surge_m_s.own",
            "naturalness.source_snap_turns_per_min", "seam_jerk_ratio.source_share_above_real"} <= set(empty)
    only_synthetic = "no recording is used: all clips are synthetic"
    assert all(report["unknown"][name] == only_synthetic for name in (*empty, "pelvis_surge_ratio"))
    assert all(flat[name] in (None, 0) for name in own)
    assert flat["pelvis_surge_m_s.own_frames"] == 0 and flat["pelvis_surge_m_s.mean"] > 0.0


def test_surge_is_compared_at_speeds_that_are_used(cut, track_of, library):
    take = cut(("walk.bvh", 0, 150), ("run.bvh", 0, 150))
    played = synthetic_from(take, 150)  # the run is synthetic: the walk's surge is no ruler for it
    report = evaluate(played, track_of(take), library)
    surge = report["pelvis_surge_m_s"]
    assert 100 <= surge["compared_frames"] < 200 and surge["own_frames"] == 150
    alone = evaluate(cut(("walk.bvh", 0, 150)), track_of(cut(("walk.bvh", 0, 150))), library)
    assert surge["own"] == pytest.approx(alone["pelvis_surge_m_s"]["own"], rel=0.2)


def test_what_cannot_be_known_says_why(cut, uncut, track_of, library):
    def why(take, **given):
        return evaluate_played(playback_from_take(take), **given)["unknown"]

    assert why(uncut)["root_error_m.mean"] == "no track" and why(uncut)["pose_realism"] == "no library"
    bare = evaluate_played(playback_from_tables(uncut.motion), library=library)["unknown"]
    assert bare["pelvis_surge_ratio"] == bare["loop_share"] == "the played clips are not known"
    known = why(uncut, track=track_of(uncut), library=library)
    assert known["seam_jerk_ratio.max"] == "the take has no cut"
    assert known["naturalness.standing.both_down"] == "the track stands nowhere for 1.5 s"
    assert known["naturalness.tempo.sd_ms"].startswith("nowhere two strides of steady running")
    assert known["pose_realism"] == "fewer than 3 recordings at each speed of the take"
    targets = [name for name, value in flatten_report(
        evaluate(uncut, track_of(uncut), library)).items() if value is None and name in TARGETS]
    assert targets and set(targets) <= set(known)


def test_pose_realism_needs_other_recordings_of_the_speed(tmp_path, cut, track_of, library, uncut):
    report = evaluate(uncut, track_of(uncut), library)
    assert report["pose_realism"] is None and report["pose_realism_frames"] == 0
    assert report["pose_realism_by_speed"]["2-3"] == {"share": None, "frames": 300, "recordings": 1}
    for seed, (name, speed) in enumerate((("a", 2.7), ("b", 2.8), ("c", 2.9), ("sprint", 6.0))):
        bvh.write_bvh(tmp_path / f"{name}.bvh", build_gait(speed, 12.0, 60.0, seed=seed))
        (tmp_path / f"{name}.txt").write_text("0 12 running front\n")
    more = build_library(tmp_path)
    clip = next(clip for clip in more.clips if clip.path == "b.bvh" and not clip.mirrored)
    played = playback_from_tables(resample(clip.motion, FPS))
    report = evaluate_played(played, library=more)
    assert report["pose_realism"] == 0.0 and report["pose_realism_by_speed"]["2-3"]["recordings"] == 3
    assert report["pose_realism_by_speed"]["4.5+"] == {"share": None, "frames": 0, "recordings": 1}
    sprint = next(clip for clip in more.clips if clip.path == "sprint.bvh" and not clip.mirrored)
    alone = evaluate_played(playback_from_tables(resample(sprint.motion, FPS)), library=more)
    assert alone["pose_realism"] is None  # one sprinter: neither 0 nor 1


def test_every_frame_has_its_jerk(cut, track_of, library):
    take = cut(("jog.bvh", 150, 200), requested=(KeyMoment(12.5, ("kick", "right")),))
    track = track_of(take)
    calm = evaluate(take, track, library)
    assert calm["jerk_ratio"]["other_speed_frames"] == 0
    assert calm["jerk_ratio"]["frames"] == len(take.motion) - 3 and calm["naturalness"]["jolts_per_min"] == 0.0
    for frame, counted in ((3, True), (75, False), (95, True), (196, True)):  # the strike is at frame 75
        root = take.motion.root_positions.copy()
        root[frame] += [0.0, 0.0, 0.1]
        report = evaluate(replace(take, motion=replace(take.motion, root_positions=root)), track, library)
        assert report["jerk_ratio"]["max"] > 2.0
        assert (report["naturalness"]["jolts_per_min"] > 0.0) == counted
        assert any("jolts" in line for line in report["warnings"]) == counted


def test_a_substitute_counts_by_the_labels_that_the_library_has(cut, track_of, library):
    asked = KeyMoment(12.5, ("kick", "right", "high"))
    take = cut(("jog.bvh", 150, 200), timeline=Timeline(keys=(asked,)))
    similarity = evaluate(take, track_of(take), library)["annotation_similarity"]
    assert similarity["keys"] == pytest.approx(-1.0 / 3.0, abs=1e-4)
    assert similarity["had_keys"] == -1.0 and similarity["had_key_count"] == 1
    missed = cut(("walk.bvh", 0, 200), timeline=Timeline(keys=(asked, KeyMoment(14.0, ("header",)))))
    similarity = evaluate(missed, track_of(missed), library)["annotation_similarity"]
    assert similarity["had_keys"] == 1.0
    assert (similarity["key_count"], similarity["had_key_count"]) == (2, 1)


def test_events_are_warnings_with_their_second(uncut, track_of, library):
    angle = np.radians(120.0 * np.clip((np.arange(300) - 150) / 6.0, 0.0, 1.0))
    rotations = uncut.motion.rotations.copy()
    rotations[:, 0] = quaternion.multiply(quaternion.from_up_angle(angle), rotations[:, 0])
    report = evaluate(replace(uncut, motion=replace(uncut.motion, rotations=rotations)), track_of(uncut), library)
    (number,) = [k for k, line in enumerate(report["warnings"]) if "75 degrees" in line]
    assert report["warning_seconds"][number][0][0] == pytest.approx(15.1, abs=0.1)
    assert report["naturalness"]["snap_turns_per_min"] == pytest.approx(6.0, rel=0.01)


def test_a_standing_body_stays_still(cut, track_of, library):
    take = cut(("stand.bvh", 0, 200))
    root, rotations = sample_frames(take.motion, np.zeros(200))
    frozen = replace(take, motion=replace(take.motion, root_positions=root, rotations=rotations))
    report = evaluate(frozen, track_of(frozen), library)
    assert report["slow_root_error_m"]["max"] < 1e-6 and report["root_error_m"]["max"] is None
    assert report["skate"]["contact_cm_s"] == 0.0 and report["skate"]["stance_mm_median"] == 0.0
    assert report["skate"]["gmd_ratio"] == 0.0 and report["pelvis_surge_m_s"]["mean"] == 0.0
    assert report["pelvis_surge_m_s"]["track"] == 0.0
    assert report["seam_jerk_ratio"]["rest_max"] == 0.0 and report["smoothness_m"]["max"] == 0.0


def test_wrong_provenance_and_wrong_skeleton_are_told(uncut, library):
    provenance = build_provenance(uncut)
    with pytest.raises(InputError, match="300 rows"):
        playback_from_tables(uncut.motion.frames(0, 10), provenance)
    offsets = uncut.motion.skeleton.offsets * np.linspace(1.0, 1.3, len(uncut.motion.skeleton))[:, None]
    taller = replace(uncut.motion, skeleton=replace(uncut.motion.skeleton, offsets=offsets))
    with pytest.raises(InputError, match="its skeleton differs"):
        evaluate_played(playback_from_tables(taller, provenance), library=library)


def test_a_report_that_is_nested_too_deep_is_told():
    deep = json.loads('{"a":' * 900 + "1" + "}" * 900)
    with pytest.raises(InputError, match="report: nested more than 30 levels deep"):
        flatten_report(deep)
    assert flatten_report({"a": {"b": [{"c": 1}, {"c": 2}]}}) == {"a.b 1.c": 1, "a.b 2.c": 2}
