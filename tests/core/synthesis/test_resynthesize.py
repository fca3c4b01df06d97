"""Edits: what is touched is made anew and is as asked, all else comes back bit for bit, and no join shows."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation import Span
from beyond_mocap.base.errors import UserCancelledError
from beyond_mocap.motion.humanoid import compute_heading, identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track import Track, sample_track, smooth_zero_phase_hann
from beyond_mocap.synthesis.heading_costs import ASKED_SECONDS
from beyond_mocap.synthesis.heading_request import HeadingKey
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resynthesize import BLEND_SECONDS, resynthesize
from beyond_mocap.synthesis.search.affected_frames import RUN_UP
from beyond_mocap.synthesis.synthesize import synthesize


def changed(before, after) -> np.ndarray:
    """(T,) bool: frames of which any bit is another."""
    a, b = before.motion, after.motion
    off = np.any(a.root_positions != b.root_positions, axis=1) | np.any(a.rotations != b.rotations, axis=(1, 2))
    clips = np.array(before.clips)[before.clip] != np.array(after.clips)[after.clip]
    off |= clips | (before.clip_frame != after.clip_frame) | np.any(before.contacts != after.contacts, axis=1)
    return off | (before.mirrored != after.mirrored) | np.array([x != y for x, y in zip(before.words, after.words)])


def moved(track, at, shift, width=1.0):
    """The track with a bump of `shift` (2,) m around second `at`, `width` s to each side."""
    share = np.clip(1.0 - np.abs(track.times - at) / width, 0.0, 1.0)
    bump = (share * share * (3.0 - 2.0 * share))[:, None] * np.asarray(shift)
    return Track(track.times, track.positions + bump, track.ball)


def jerk_and_slide(take, frames):
    """Largest third difference in m/s^3 of any joint, and the fastest standing toe in m/s, among some frames."""
    places, _ = forward_kinematics(take.motion)
    fps = take.motion.fps
    jerk = np.linalg.norm(np.diff(places, 3, axis=0), axis=2).max(axis=1) * fps**3
    body, slide = identify_joints(take.motion.skeleton), [0.0]
    for side, limb in enumerate((body.left, body.right)):
        speed = np.linalg.norm(np.diff(places[:, limb.toe_or_foot, :2], axis=0), axis=1) * fps
        still = take.contacts[1:, side] & take.contacts[:-1, side]
        slide += [speed[i] for i in frames if i < len(speed) and still[i]]
    return jerk[frames[frames < len(jerk)]].max(), max(slide)


def test_nothing_touched_nothing_changed(library, take):
    again = resynthesize(library, take.plan, take)
    assert not changed(take, again).any() and np.array_equal(again.seams, take.seams)
    assert again.keys == take.keys and again.warnings == take.warnings


def test_a_key_moment_asked_twice_stays(library, track, timeline_of):
    before = synthesize(library, Plan(track=track, timeline=timeline_of((5.0, "kick right"), (5.0, "kick right"))))
    again = resynthesize(library, before.plan, before)
    assert not changed(before, again).any() and again.keys == before.keys and again.warnings == before.warnings


@pytest.mark.parametrize("turn", [90.0, -160.0])
def test_a_heading_key_turns_the_body_and_changes_nothing_far_from_it(library, track_of, turn):
    """It is added, and taken away again, on a player who strolls; the rest comes back bit for bit."""
    before = synthesize(library, Plan(track=track_of(0.6, seconds=20.0)))
    key = HeadingKey(9.0, heading=np.radians(turn), hold=2.0)
    after = resynthesize(library, replace(before.plan, heading_keys=(key,)), before)
    held = compute_heading(after.motion)[int(9.3 * 30) : int(10.7 * 30)]
    assert np.degrees(np.abs(np.angle(np.exp(1j * (held - key.heading))))).max() < 25.0
    reach = ASKED_SECONDS + 0.5 + RUN_UP + BLEND_SECONDS + 0.5 * before.plan.seam_window
    off = np.flatnonzero(changed(before, after)) / 30.0
    assert len(off) and key.time - reach < off[0] and off[-1] < key.time + key.hold + reach
    assert np.array_equal(after.planned_heading[: int(5.0 * 30)], before.planned_heading[: int(5.0 * 30)])
    again = resynthesize(library, before.plan, after)
    assert key.time - reach < np.flatnonzero(changed(before, again)).min(initial=999) / 30.0
    assert np.allclose(np.exp(1j * again.planned_heading), np.exp(1j * before.planned_heading), atol=1e-9)


@pytest.mark.parametrize("time", [4.8, 5.2, 6.0])
def test_a_key_moment_is_moved(library, take, time):
    kick, other = take.plan.timeline.keys
    timeline = replace(take.plan.timeline, keys=(replace(kick, time=time), other))
    after = resynthesize(library, replace(take.plan, timeline=timeline), take)
    assert abs(after.keys[0].frame / 30.0 - time) <= 0.5 / 30.0
    near = int(round(after.keys[0].frame))
    assert after.clips[after.clip[near]] == after.keys[0].clip == "kick.bvh"
    assert after.keys[1] == take.keys[1]
    off = np.flatnonzero(changed(take, after))
    assert 0 < off[0] < 5.0 * 30 < off[-1] < 12.0 * 30
    assert len(off) < 8.0 * 30


def test_words_of_a_span_are_changed(library, take, timeline_of):
    timeline = timeline_of((5.0, "kick right"), (12.0, 14.0, "standing"), (17.0, "kick"))
    after = resynthesize(library, replace(take.plan, timeline=timeline), take)
    off = np.flatnonzero(changed(take, after))
    margin = (RUN_UP + BLEND_SECONDS + 1.5) * 30
    assert 12.0 * 30 - margin < off[0] and off[-1] < 14.0 * 30 + margin
    assert after.timeline.spans != take.timeline.spans
    shown = [after.words[i] for i in range(int(12.4 * 30), int(13.6 * 30))]
    assert all("left" not in words for words in shown)


def test_key_moments_come_and_go(library, take, timeline_of):
    timeline = timeline_of((12.0, 14.0, "walking left"), (17.0, "kick"))
    without = resynthesize(library, replace(take.plan, timeline=timeline), take)
    assert len(without.keys) == 1 and without.keys[0] == take.keys[1]
    assert "kick" not in without.words[150]
    again = resynthesize(library, take.plan, without)
    assert [key.requested for key in again.keys] == [key.requested for key in take.keys]
    assert again.keys[0].frame == pytest.approx(150.0, abs=0.5) and "kick" in again.words[150]
    assert not changed(take, again)[int(9 * 30) :].any()


def test_a_dragged_track_is_followed(library, take):
    plan = replace(take.plan, track=moved(take.plan.track, 10.0, (0.8, -0.6)))
    after = resynthesize(library, plan, take)
    pelvis = smooth_zero_phase_hann(after.motion.root_positions[:, :2], 30.0, 1.5)
    error = np.linalg.norm(pelvis - smooth_zero_phase_hann(sample_track(plan.track, 30.0).raw, 30.0, 1.5), axis=1)
    assert error.max() < 0.03
    assert np.linalg.norm((after.motion.root_positions - take.motion.root_positions)[300, :2]) > 0.7
    off = np.flatnonzero(changed(take, after))
    assert 6.0 * 30 < off[0] and off[-1] < 14.5 * 30


def test_where_only_the_ball_lies_elsewhere_the_same_clips_are_shown(library, take):
    ball = take.plan.track.ball.copy()
    ball[np.abs(take.plan.track.times - 5.0) < 0.5, 1] += 0.1
    track = Track(take.plan.track.times, take.plan.track.positions, ball)
    after = resynthesize(library, replace(take.plan, track=track), take)
    assert np.array_equal(after.edit.frame, take.edit.frame) and np.array_equal(after.clip_frame, take.clip_frame)
    # its noise is solved over all samples
    off = np.linalg.norm(after.ball.positions - take.ball.positions, axis=1) > 0.05
    assert off[150] and not off[: 3 * 30].any() and not off[7 * 30 :].any()


def test_two_edits_at_once_leave_what_lies_between(library, take, timeline_of):
    timeline = timeline_of((4.8, "kick right"), (12.0, 14.0, "walking left"), (17.2, "kick"))
    off = changed(take, resynthesize(library, replace(take.plan, timeline=timeline), take))
    assert off[150] and off[510] and not off[300:360].any()


def test_nothing_shows_where_old_and_new_meet(library, take):
    """In the hand-over of several edits there is no more jerk, and no foot that slides faster, than there was."""
    timeline = take.plan.timeline
    later = replace(timeline, keys=(replace(timeline.keys[0], time=5.3), timeline.keys[1]))
    plans = [replace(take.plan, timeline=later)]
    plans += [replace(take.plan, track=moved(take.plan.track, at, (0.5, 0.4))) for at in (8.0, 11.0)]
    for plan in plans:
        after = resynthesize(library, plan, take)
        off = np.flatnonzero(changed(take, after))
        for frames in (np.arange(off[0] - 3, off[0] + 15), np.arange(off[-1] - 15, off[-1] + 3)):
            (jerk, slide), (jerk_before, slide_before) = jerk_and_slide(after, frames), jerk_and_slide(take, frames)
            assert jerk < 1.3 * jerk_before + 200.0 and slide < slide_before + 0.03


def test_feet_that_stand_are_on_the_ground(library, take):
    """Also beside a seam at the end of a stretch, which joins another recording now."""
    body = identify_joints(library.skeleton)
    toes = [body.left.toe_or_foot, body.right.toe_or_foot]

    def highest(made):
        return forward_kinematics(made.motion)[0][:, toes, 2][made.contacts].max()

    for seam in take.seams[(take.seams > 200) & (take.seams < 450)][:4]:
        plan = replace(take.plan, track=moved(take.plan.track, seam / 30.0 - 3.0, (0.6, 0.3)))
        assert highest(resynthesize(library, plan, take)) < highest(take) + 0.02


def test_steps_stay_where_the_motion_stays(library, track_of):
    """A player who creeps for ten seconds between two walks; his track is drawn aside where he creeps."""
    track = track_of(lambda t: 0.25 + 0.9 * (t < 5.0) + 0.9 * (t > 15.0), seconds=20.0)
    before = synthesize(library, Plan(track=track))
    after = resynthesize(library, replace(before.plan, track=moved(track, 12.0, (0.1, -0.15))), before)
    stays = ~changed(before, after)
    assert stays[:150].all() and before.stepped[stays].any() and after.stepped[~stays].any()
    assert np.array_equal(after.stepped[stays], before.stepped[stays])
    assert np.array_equal(after.contacts[stays], before.contacts[stays])
    assert not (after.contacts & after.stepped).any()


def test_the_same_edit_gives_the_same_bits(library, take):
    plan = replace(take.plan, track=moved(take.plan.track, 10.0, (0.3, 0.3)))
    assert not changed(resynthesize(library, plan, take), resynthesize(library, plan, take)).any()


@pytest.mark.parametrize("fps", [24.0, 60.0])
def test_at_other_rates(library, track, asked, fps):
    before = synthesize(library, Plan(track=track, timeline=asked, fps=fps))
    timeline = replace(asked, keys=(replace(asked.keys[0], time=5.2), asked.keys[1]))
    after = resynthesize(library, replace(before.plan, timeline=timeline), before)
    assert abs(after.keys[0].frame / fps - 5.2) <= 0.5 / fps
    off = np.flatnonzero(changed(before, after))
    assert 0 < off[0] and off[-1] < 12.0 * fps


@pytest.mark.parametrize("change", [{"method": "blocks"}, {"fps": 25.0}, {"mirror": False}])
def test_other_choices_are_a_whole_synthesis(library, take, change):
    plan = replace(take.plan, **change)
    assert not changed(synthesize(library, plan), resynthesize(library, plan, take)).any()


def test_another_length_is_a_whole_synthesis(library, take):
    old = take.plan.track
    track = Track(old.times[:400], old.positions[:400], old.ball[:400])
    plan = replace(take.plan, track=track, timeline=type(take.timeline)())
    assert not changed(synthesize(library, plan), resynthesize(library, plan, take)).any()


def test_a_take_that_the_library_did_not_show_is_made_anew(library, take):
    """As when the library has been built anew from other clips: what the take's edit list means is no longer known."""
    other = replace(take, clip_frame=take.clip_frame + 1.0)
    assert not changed(take, resynthesize(library, take.plan, other)).any()


def test_a_cancelled_edit_is_no_take(library, take):
    plan = replace(take.plan, track=moved(take.plan.track, 10.0, (0.8, 0.0)))
    with pytest.raises(UserCancelledError):
        resynthesize(library, plan, take, cancelled=lambda: True)


def test_a_word_that_must_not_be_is_made_anew_where_it_must_not(library, take):
    walk = Span(8.0, 10.0, avoid=("jogging",))
    timeline = replace(take.plan.timeline, spans=(*take.plan.timeline.spans, walk))
    after = resynthesize(library, replace(take.plan, timeline=timeline), take)
    assert "jogging" in take.words[270]
    assert not any("jogging" in words for words in after.words[240:300])
    assert not changed(take, after)[: 240 - 60].any()
