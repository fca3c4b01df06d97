"""Where the body that touches the ball is seen, its nearest part and side are those of the touch."""

import numpy as np
import pytest

from beyond_mocap.annotation.event_labels import read_event_labels
from beyond_mocap.ball.tracked.solve import SolvedBall, SolvedTouch
from beyond_mocap.files.bvh.bvh import read_bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.match.known_bodies import SeenBodies, SeenPlayer
from beyond_mocap.match.labels import build_touch_moment
from beyond_mocap.match.seen_touches import name_seen_touches
from beyond_mocap.motion.humanoid import estimate_stature, identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthesis.known_body import build_known_body
from tests.core.joint_feeds import SAMPLE

FIRST, FRAME = 60, 20
TIMES = np.arange(0.0, 9.0, 0.1)


@pytest.fixture(scope="module")
def seen(sample_cache):
    """A walk that is seen from frame FIRST on, and its library."""
    motion = read_bvh(SAMPLE / "walking_1_2.bvh").motion
    body = build_known_body(FIRST, motion.fps, (motion.root_positions, motion.rotations),
                            np.zeros((len(motion), 2, 2), bool))
    player = SeenPlayer(bodies=(body,), height=estimate_stature(motion.skeleton))
    return motion, SeenBodies(players={"A": player}), build_library(SAMPLE, cache_dir=sample_cache)


def name_touch(seen, place, part, second=None, player="A"):
    """The labels of a pass for which the ball's flight suggests a part."""
    motion, bodies, library = seen
    touch = SolvedTouch(time=(FIRST + FRAME) / motion.fps if second is None else second, uncertainty=0.02,
                        player=player, part=part, kind="kick", position=place, before=np.zeros(3),
                        after=np.full(3, 5.0), confidence=0.9)
    flags = np.zeros(len(TIMES), bool)
    ball = SolvedBall(times=TIMES, touches=(touch,), ball=None, filled=flags, outlier=flags, measured=~flags,
                      residuals=np.zeros(len(TIMES)), ends=(), confidence=0.9)
    named, sides = name_seen_touches(ball, bodies, library)
    moment = build_touch_moment(named.touches[0], TIMES, np.zeros((len(TIMES), 2)), True, read_event_labels(),
                                side=sides.get(0, ""))
    return named.touches[0].part, sides, moment.labels


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_foot_at_the_ball_kicks(seen, side):
    places, body = forward_kinematics(seen[0])[0], identify_joints(seen[0].skeleton)
    part, sides, labels = name_touch(seen, places[FRAME, getattr(body, side).toe] + [0.05, 0.0, 0.05], "chest")
    assert part == "foot" and sides == {0: side} and labels[:2] == ("kick", side)


def test_the_head_at_the_ball_heads(seen):
    places, body = forward_kinematics(seen[0])[0], identify_joints(seen[0].skeleton)
    part, sides, labels = name_touch(seen, places[FRAME, body.head] + [0.12, 0.0, 0.2], "chest")
    assert part == "head" and not sides and "header" in labels


def test_what_is_not_seen_or_not_near_stays(seen):
    place = forward_kinematics(seen[0])[0][FRAME, identify_joints(seen[0].skeleton).left.toe]
    for values in ({"second": 1.0}, {"player": "B"}, {"place": place + [3.0, 0.0, 0.0]}):
        part, sides, _ = name_touch(seen, **{"place": place, "part": "head", **values})
        assert part == "head" and not sides
