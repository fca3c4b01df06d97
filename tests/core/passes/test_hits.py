"""Hit analysis: strikes planted in made motions are found where they were planted, and steps are no strikes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.special import erf

from beyond_mocap.annotation import read_annotation_csv
from beyond_mocap.ball.contact import Tool
from beyond_mocap.base.errors import InputError
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mirror import mirror
from beyond_mocap.motion.motion import Motion, concatenate_motions, place_motion
from beyond_mocap.passes.hits import detect_hits
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.gestures import build_strike
from beyond_mocap.synthetic.moves import build_header

RECORDED = Path(__file__).resolve().parents[3].parent / "shared" / "data" / "mocap"


def swung(times, moment, angle, width):
    """Radians over time: a turn by `angle` that is fastest at `moment`."""
    return angle * 0.5 * (1.0 + erf((times - moment) / (width * np.sqrt(2.0))))


def planted(fps=60.0, moment=1.5, side="right", limb="upper_leg", strength=1.0):
    """Who stands and swings one limb forward and up, fastest at `moment` s, then lets it down."""
    standing = build_gait(0.0, 3.0, fps, seed=3)
    times = np.arange(len(standing)) / fps
    angle = (
        swung(times, moment - 0.45, -0.4, 0.1)
        + swung(times, moment, 1.9, 0.06)
        + swung(times, moment + 0.6, -1.5, 0.14)
    )
    joint = getattr(getattr(identify_joints(standing.skeleton), side), limb)
    rotations = np.array(standing.rotations)
    bend = quaternion.from_axis_angle(np.array([0.0, -1.0, 0.0]), strength * angle)
    rotations[:, joint] = quaternion.multiply(bend, rotations[:, joint])
    return replace(standing, rotations=rotations)


@pytest.mark.parametrize("fps", [23.976, 30.0, 60.0, 120.0])
@pytest.mark.parametrize("part, limb", [("foot", "upper_leg"), ("hand", "upper_arm"), ("tool", "upper_arm")])
@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("moment", [1.1, 1.537])
def test_a_planted_strike_is_found_within_a_frame(fps, part, limb, side, moment):
    motion = planted(fps, moment, side, limb)
    hits = detect_hits(motion, part, side)
    assert len(hits.motions) == 1
    assert abs(hits.motions[0].key - moment * fps) <= 1.0
    other = "left" if side == "right" else "right"
    assert detect_hits(motion, part, other).motions == ()


def test_what_a_hit_motion_holds():
    hits = detect_hits(planted(120.0, 1.4))
    (one,) = hits.motions
    assert one.first < one.fasts[0] == one.key < one.high < one.fasts[1] < one.last
    assert one.ball_stretch == (one.key, one.high) == hits.ball_stretches[0]
    assert hits.height[one.high] == hits.height.max() and one.high in hits.highs and one.key in hits.fasts
    assert hits.speed[one.key] == one.max_speed == hits.speed.max()
    assert 0.3 < one.first / 120.0 < 1.1 and 1.9 < one.last / 120.0 < 2.8
    np.testing.assert_allclose(one.times.sum(), (one.last - one.first) / 120.0)
    np.testing.assert_allclose(one.vectors.sum(axis=0)[1:], 0.0, atol=0.06)  # the foot comes back to the ground
    assert one.vectors[0, 2] + one.vectors[1, 2] > 0.3 > abs(one.direction)


def test_links_are_all_that_lies_between():
    motion = concatenate_motions([planted(60.0), planted(60.0, 1.3)])
    hits = detect_hits(motion)
    covered = np.zeros(len(motion), int)
    for first, last in [*hits.links, *((one.first, one.last) for one in hits.motions)]:
        covered[first : last + 1] += 1
    assert len(hits.motions) == 2 and len(hits.links) == 3 and np.all(covered == 1)


def test_it_does_not_matter_where_the_body_is_and_where_it_faces():
    here, there = detect_hits(planted()).motions[0], detect_hits(place_motion(planted(), 2.0,
                                                                              (4.0, -3.0, 0.0))).motions[0]
    assert (here.key, here.first, here.last, here.high) == (there.key, there.first, there.last, there.high)
    np.testing.assert_allclose(here.vectors, there.vectors, atol=1e-9)
    np.testing.assert_allclose(here.velocity, there.velocity, atol=1e-9)
    assert quaternion.wrap_angle(there.facing - here.facing) == pytest.approx(2.0)


def test_the_mirror_shows_the_other_side():
    right, left = detect_hits(planted(), "foot", "right").motions[0], detect_hits(mirror(planted()), "foot",
                                                                                  "left").motions[0]
    assert right.key == left.key
    np.testing.assert_allclose(left.vectors, right.vectors * [1.0, -1.0, 1.0], atol=1e-6)


@pytest.mark.parametrize("speed", [0.0, 0.8, 1.4, 2.8, 4.0, 6.0, 8.0])
@pytest.mark.parametrize("part", ["foot", "hand", "head", "chest"])
def test_steps_are_no_strikes(speed, part):
    assert detect_hits(build_gait(speed, 4.0, 60.0), part, "left").motions == ()


@pytest.mark.parametrize("kind", ["kick low inside", "kick low top"])
@pytest.mark.parametrize("fps", [30.0, 60.0])
def test_a_made_kick_among_its_steps(kind, fps):
    made = build_strike(kind, fps=fps)
    hits = detect_hits(made.motion)
    assert abs(hits.strongest.key / fps - made.key) <= 0.07  # the foot slows before it meets the ball
    assert hits.strongest.first / fps < made.key < hits.strongest.last / fps


def test_a_header_is_met_with_the_nod_not_with_the_jump():
    made = build_header(fps=60.0)
    assert abs(detect_hits(made.motion, "head").strongest.key / 60.0 - made.key) <= 0.05


def test_the_threshold_is_the_users():
    motion = planted()
    top = detect_hits(motion).height.max()
    assert detect_hits(motion, threshold=top + 0.01).motions == ()
    assert detect_hits(motion, threshold=top - 0.01).motions[0].high == detect_hits(motion).motions[0].high
    assert detect_hits(build_gait(1.4, 4.0, 60.0), threshold=0.05).motions  # steps, when asked for


def test_any_joint_can_strike():
    motion = planted()
    shin = motion.skeleton.names[identify_joints(motion.skeleton).right.lower_leg]
    assert abs(detect_hits(motion, shin).strongest.key - 90) <= 1
    assert abs(detect_hits(motion, joint=shin).strongest.key - 90) <= 1


def test_a_longer_tool_is_faster():
    motion = planted(limb="upper_arm")
    short, long = (
        detect_hits(motion, "tool", tool=Tool(length=length)).strongest.max_speed for length in (0.3, 1.0)
    )
    assert long > short + 1.0


@pytest.mark.parametrize("arguments, said", [
    (dict(part="foot", side="up"), "left or right"),
    (dict(part="tail"), "skeleton lacks"),
    (dict(joint="tail"), "skeleton lacks"),
    (dict(threshold=float("nan")), "metres"),
])
def test_bad_input_is_told(arguments, said):
    with pytest.raises(InputError, match=said):
        detect_hits(planted(), **arguments)


def test_too_short_to_tell():
    with pytest.raises(InputError, match="three or more"):
        detect_hits(planted().frames(0, 2))


def test_a_body_without_a_head_has_no_header():
    motion = planted()
    body = identify_joints(motion.skeleton)
    legs, kept = motion.skeleton.select_joints([body.left.foot, body.right.foot])
    bare = Motion(legs, motion.root_positions, motion.rotations[:, kept], motion.fps)
    with pytest.raises(InputError, match="head"):
        detect_hits(bare, "head")
    assert len(detect_hits(bare, "foot").motions) == 1


@pytest.mark.skipif(not RECORDED.is_dir(), reason="the recordings are not there")
@pytest.mark.parametrize("folder, share", [("cmu10", 1.0), ("lmd/Player2", 0.95)])
def test_recorded_kicks_within_three_frames(folder, share):
    rows = {
        name: row.key for name, rows in read_annotation_csv(RECORDED / "annotations.csv").items() for row in rows
        if name.startswith(folder) and row.words[0] == "kick"
    }
    found = [detect_hits(bvh.read_bvh(RECORDED / name).motion).strongest for name in rows]
    near = [one is not None and abs(one.key - key) <= 3 for one, key in zip(found, rows.values())]
    assert len(near) >= 5 and np.mean(near) >= share
