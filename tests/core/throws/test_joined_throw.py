"""A throw within a longer motion: exact around its release, joined by the synthesizer or eased in and out."""

import pathlib
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation import KeyMoment, Span, Timeline
from beyond_mocap.base.errors import InputError
from beyond_mocap.library.build import build_library
from beyond_mocap.motion.humanoid import compute_heading, identify_joints
from beyond_mocap.motion.motion import Motion, forward_kinematics, place_motion, sample_frames
from beyond_mocap.motion.track import BALL_RADIUS, Track
from beyond_mocap.synthesis.heading_request import HeadingKey
from beyond_mocap.synthesis.plan import Plan, PlayerTouch, SolvedTrajectory
from beyond_mocap.synthesis.quality.movement import compute_jerk, compute_window_maxima
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.join_throw import (
    FADE_WITHOUT_LIBRARY,
    build_standing_motion,
    join_throw,
    measure_library_jerk,
    measure_transition_jerk,
    trim_waiting,
)
from beyond_mocap.throws.leave_path import find_stopping_position, is_in_reach, leave_path
from beyond_mocap.throws.run_up import EDGE, OWN_LABEL, add_throw_clip, construct_run_up

LIBRARY = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library"
FPS, AT = 30.0, 6.0
TIMES = np.arange(0.0, 12.05, 0.1)


@pytest.fixture(scope="module")
def library(sample_cache):
    return build_library(LIBRARY, cache_dir=sample_cache)


@pytest.fixture(scope="module")
def made():
    return build_throw((18.0, 0.0, 1.0), 25.0, fps=FPS)


def going(speed: float) -> Plan:
    """A plan along X, over the origin when the throw is released."""
    places = np.stack([speed * (TIMES - AT), np.zeros_like(TIMES)], axis=1)
    return Plan(track=Track(TIMES, places, None), fps=FPS)


def on_library(library, speed):
    """A throw on the library's skeleton, where the plan has the player at the release, and the plan."""
    one = build_throw((18.0, 0.0, 1.0), 25.0, skeleton=library.skeleton, fps=FPS)
    return released_over(one, np.zeros(2)), one.release, going(speed)


def released_over(made, spot) -> Motion:
    """A made throw whose hips are over `spot` (2,) m at the release."""
    hips = sample_frames(made.motion, np.array([made.release * made.motion.fps]))[0][0, :2]
    return place_motion(made.motion, 0.0, (*(spot - hips), 0.0))


def same_where_kept(joined, motion) -> bool:
    low, high = joined.unblended
    part = slice(low - joined.first, high - joined.first)
    return np.array_equal(joined.motion.root_positions[low:high], motion.root_positions[part]) and np.allclose(
        np.abs(np.sum(joined.motion.rotations[low:high] * motion.rotations[part], axis=-1)), 1.0, atol=1e-12
    )


@pytest.mark.parametrize("speed", [0.0, 2.5])
def test_the_synthesizer_joins_it_on_the_track(library, speed):
    motion, release, plan = on_library(library, speed)
    way = construct_run_up(library, plan, motion, release, AT)
    joined = join_throw(way.motion, way.start, motion, release, at=AT)
    assert len(joined.motion) == len(plan.sample_track(FPS).times)
    assert abs(joined.release - AT) <= 0.5 / FPS + 1e-9
    assert same_where_kept(joined, motion)
    # the footage of the throw lies where the throw itself does, facing included, so that little is faded
    inside = slice(joined.unblended[0], joined.unblended[1])
    both = [forward_kinematics(one)[0][inside] for one in (way.motion, joined.motion)]
    assert np.linalg.norm(both[0] - both[1], axis=-1).mean() < 0.03
    off = compute_heading(way.motion)[inside] - compute_heading(joined.motion)[inside]
    assert np.abs(np.angle(np.exp(1j * off))).max() < 0.12
    usual = measure_library_jerk(library, FPS)
    assert np.all(measure_transition_jerk(joined) <= usual)
    # two seconds before and behind the player is on his track
    for second in (AT - 5.5, AT + 5.5):
        frame = int((second - way.start) * FPS)
        assert np.linalg.norm(joined.motion.root_positions[frame, :2] - [speed * (second - AT), 0.0]) < 0.3


def test_a_body_that_walks_across_turns_to_the_throw_before_it(library):
    motion, release, plan = on_library(library, 0.0)
    across = np.stack([np.zeros_like(TIMES), 1.2 * (TIMES - AT)], axis=1)
    way = construct_run_up(library, replace(plan, track=Track(TIMES, across, None)), motion, release, AT)
    heading = np.unwrap(compute_heading(way.motion))
    own = np.abs(np.diff(np.unwrap(compute_heading(motion)))).max()
    assert np.ptp(heading) > 1.0 and np.abs(np.diff(heading)).max() < 1.05 * own  # the throw's own turn is the fastest
    joined = join_throw(way.motion, way.start, motion, release, at=AT)
    assert np.all(measure_transition_jerk(joined) <= measure_library_jerk(library, FPS))


def test_the_library_itself_stays_as_it_was(library):
    motion, release, _ = on_library(library, 0.0)
    clips, keys = library.clips, library.keys
    more = add_throw_clip(library, motion, release)
    assert library.clips is clips and library.keys is keys
    assert [key for key in more.keys if OWN_LABEL in key.labels][0].frame == pytest.approx(release * FPS)


def test_what_lies_within_the_throw_gives_way(library):
    motion, release, plan = on_library(library, 0.0)
    words = (KeyMoment(AT + 0.2, ("kick", "low")), KeyMoment(AT + 4.0, ("kick", "low")))
    faces = (HeadingKey(AT - 0.1, 1.0), HeadingKey(AT - 4.0, 0.5))
    plan = replace(plan, timeline=Timeline((Span(AT - 4.0, AT + 4.0, ("standing",)),), words), heading_keys=faces)
    way = construct_run_up(library, plan, motion, release, AT)
    assert [line for line in way.warnings if "left out" in line] == [
        "6.2 s: 'kick low' overlaps the throw and is left out",
        "5.9 s: the given heading overlaps the throw and is left out",
    ]


def test_a_key_moment_within_the_throw_by_its_solved_touch_gives_way_too(library):
    motion, release, plan = on_library(library, 0.0)
    asked = AT + motion.duration - release + 0.1  # behind the throw, its touch within
    ball = np.tile([0.4, 0.0, BALL_RADIUS], (len(TIMES), 1))
    course = SolvedTrajectory(TIMES, ball, np.zeros(len(TIMES), bool),
                              (PlayerTouch(asked - 0.3, True, "foot", "kick"),))
    plan = replace(plan, timeline=Timeline((), (KeyMoment(asked, ("kick", "low")),)), solved=course, solve_touches=True)
    way = construct_run_up(library, plan, motion, release, AT)
    assert any("'kick low' overlaps the throw" in line for line in way.warnings)


def test_other_bones_and_sizes_keep_the_exact_throw(library, made):
    # `adult_skeleton` is not the library's skeleton: the way there is found on the library's bones
    motion = released_over(made, np.zeros(2))
    way = construct_run_up(library, going(0.0), motion, made.release, AT)
    assert way.motion.skeleton.names == motion.skeleton.names
    assert same_where_kept(join_throw(way.motion, way.start, motion, made.release, at=AT), motion)
    tall = replace(going(0.0), height=2.0)
    way = construct_run_up(library, tall, motion, made.release, AT)
    assert way.motion.root_positions[-1, 2] == pytest.approx(motion.root_positions[-1, 2], abs=0.15)


def test_eased_out_of_a_walk_and_on(made):
    walk = build_gait(1.4, 8.0, FPS)
    first = round((3.0 - made.release) * FPS)
    offset = walk.root_positions[first] - made.motion.root_positions[0]
    motion = place_motion(made.motion, 0.0, (*offset[:2], 0.0))
    joined = join_throw(walk, 0.0, motion, made.release, at=3.0, continues=True)
    assert same_where_kept(joined, motion)
    assert np.array_equal(joined.motion.root_positions[: joined.first], walk.root_positions[: joined.first])
    behind = slice(joined.end, None)
    step = np.diff(joined.motion.root_positions[behind, :2], axis=0)
    own = np.diff(walk.root_positions[behind, :2], axis=0)
    assert np.allclose(np.linalg.norm(step, axis=1), np.linalg.norm(own, axis=1), atol=1e-9)  # it walks on, elsewhere
    assert np.all(measure_transition_jerk(joined) < 3000.0)
    assert not any("to the start of the throw" in line for line in joined.warnings)  # throws begin side on
    away = join_throw(place_motion(walk, 0.5 * np.pi), 0.0, motion, made.release, at=3.0, continues=True)
    assert any("to the start of the throw" in line for line in away.warnings)


def test_a_motion_that_stays_where_it_is(made):
    stands = build_standing_motion(made.motion.skeleton, 6.0, FPS)
    joined = join_throw(stands, 10.0, made.motion, made.release, at=13.0)
    assert joined.start == 10.0 and abs((joined.release - joined.start) * joined.motion.fps - 90.0) <= 0.5
    assert np.array_equal(joined.motion.root_positions[joined.end :], stands.root_positions[joined.end :])
    assert not joined.offset.any()


def test_a_short_motion_is_held(made):
    stands = build_standing_motion(made.motion.skeleton, 0.1, FPS)
    joined = join_throw(stands, 3.0, made.motion, made.release, at=3.0)
    assert joined.first == 0 and joined.end == len(joined.motion)
    assert joined.start == pytest.approx(3.0 - made.release, abs=0.5 / FPS)


@pytest.mark.parametrize("fps", [24000.0 / 1001.0, 60.0])
def test_at_any_rate(made, fps):
    stands = build_standing_motion(made.motion.skeleton, 6.0, fps)
    exact = build_throw((18.0, 0.0, 1.0), 25.0, fps=fps)
    joined = join_throw(stands, 0.0, exact.motion, exact.release, at=3.0)
    assert same_where_kept(joined, exact.motion) and abs(joined.release - 3.0) <= 0.5 / fps + 1e-9


def test_what_cannot_be_joined(library, made):
    other = Motion(library.skeleton, np.zeros((90, 3)), np.tile([1.0, 0, 0, 0], (90, len(library.skeleton), 1)), FPS)
    with pytest.raises(InputError, match="different skeleton"):
        join_throw(other, 0.0, made.motion, made.release, at=2.0)
    stands = build_standing_motion(made.motion.skeleton, 6.0, FPS)
    with pytest.raises(InputError, match="before and"):
        join_throw(stands, 0.0, made.motion, 0.1, at=2.0)
    motion, release, plan = on_library(library, 0.0)
    with pytest.raises(InputError, match="within the track"):
        construct_run_up(library, plan, motion, release, 1.0)


def test_out_of_a_walk_and_back_by_the_library(library, made):
    walk = build_gait(1.4, 14.0, FPS)
    motion, release = trim_waiting(released_over(made, walk.root_positions[210, :2]), made.release, EDGE)
    way = leave_path(library, walk, 0.0, motion, release, at=7.0)
    joined = join_throw(way.motion, way.start, motion, release, at=7.0)
    assert same_where_kept(joined, motion) and len(joined.motion) == len(walk)
    for part in (slice(0, 4), slice(-4, None)):
        assert np.array_equal(joined.motion.rotations[part], walk.rotations[part])
        assert np.array_equal(joined.motion.root_positions[part], walk.root_positions[part])
    usual = measure_library_jerk(library, FPS)
    hits = compute_window_maxima(compute_jerk(forward_kinematics(joined.motion)[0], FPS))
    assert max(hits[int(seam) - 2] for seam in way.transitions) <= 1.1 * usual
    assert np.all(measure_transition_jerk(joined) <= usual)


def test_who_has_no_time_to_get_back_goes_on_from_there(library, made):
    run = build_gait(4.2, 6.0, FPS)
    over = released_over(made, run.root_positions[90, :2])
    assert not is_in_reach(run, 0.0, over, made.release, 3.0)
    begin = find_stopping_position(run, 0.0, 3.0 - made.release) - made.motion.root_positions[0, :2]
    motion = place_motion(made.motion, 0.0, (*begin, 0.0))
    way = leave_path(library, run, 0.0, motion, made.release, at=3.0)
    joined = join_throw(way.motion, way.start, motion, made.release, at=3.0)
    assert same_where_kept(joined, motion) and any("no time to return" in line for line in way.warnings)
    speed = np.linalg.norm(np.diff(joined.motion.root_positions[:, :2], axis=0), axis=1) * FPS
    assert speed.max() < 1.25 * 4.2


def test_who_only_stands_does_not_wait_but_the_throw_is_the_same(made):
    motion, release = made.motion, made.release
    root, rotations = motion.root_positions, motion.rotations
    still = Motion(
        motion.skeleton, np.concatenate([root[:1].repeat(60, axis=0), root, root[-1:].repeat(45, axis=0)]),
        np.concatenate([rotations[:1].repeat(60, axis=0), rotations, rotations[-1:].repeat(45, axis=0)]), motion.fps,
    )
    shown, at = trim_waiting(still, release + 60 / FPS, margin_s=0.1)
    first = round((release + 60 / FPS - at) * FPS)
    assert 57 <= first and len(shown) <= len(motion) + 6
    assert np.array_equal(shown.rotations, still.rotations[first : first + len(shown)])
    before, _ = trim_waiting(still, release + 60 / FPS, margin_s=1.0)
    assert len(before) >= len(shown) + 45


def test_who_stands_steps_into_a_throw_without_a_library():
    one = build_throw((18.0, 0.0, 1.0), 25.0, fps=FPS)
    own = build_standing_motion(one.motion.skeleton, 12.0, FPS, one.motion.root_positions[0, :2] - [0.0, 0.15], 0.0)
    slides = []
    for goes_on in (False, True):  # faded; stepped
        fade = FADE_WITHOUT_LIBRARY["throw"]
        joined = join_throw(own, 0.0, one.motion, one.release, at=AT, continues=goes_on, fade=fade)
        assert same_where_kept(joined, one.motion)
        body = identify_joints(own.skeleton)
        toes = forward_kinematics(joined.motion)[0][
            joined.first - 3 : joined.unblended[0] + 3, [body.left.toe_or_foot, body.right.toe_or_foot]
        ]
        speed = np.linalg.norm(np.diff(toes[..., :2], axis=0), axis=-1) * FPS
        low = toes[1:, :, 2] < toes[..., 2].min() + 0.01
        slides.append(float((speed * low).sum() / FPS))
    assert slides[1] < 0.5 * slides[0]
    usual = compute_window_maxima(compute_jerk(forward_kinematics(one.motion)[0], FPS)).max()
    assert measure_transition_jerk(joined).max() < usual
