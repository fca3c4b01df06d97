"""A body's striking surface in its own frame, and the ball that touches it."""

import numpy as np
import pytest

from beyond_mocap.annotation.striking import measure_ball_gap
from beyond_mocap.ball.contact import (
    Tool,
    compute_ball_centre,
    convert_to_world,
    find_striking_surface,
    sample_strike_surface,
)
from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.humanoid import compute_heading_from_positions
from beyond_mocap.motion.motion import forward_kinematics, place_motion
from beyond_mocap.synthetic.gestures import build_strike


@pytest.fixture(scope="module")
def kick():
    return build_strike("kick low inside", fps=60.0)


def test_the_frame_does_not_ask_where_the_body_is(kick):
    """A kick put elsewhere and turned strikes from the same place of its own frame, as fast."""
    surface, frames = find_striking_surface(kick.motion.skeleton, "foot",
                                            "right"), np.array([60.0, 60.0 * kick.key, 170.3])
    here = sample_strike_surface(kick.motion, frames, surface)
    there = sample_strike_surface(place_motion(kick.motion, 2.1, (5.0, -3.0, 0.0)), frames, surface)
    for name in ("start", "end", "velocity"):
        np.testing.assert_allclose(getattr(here, name), getattr(there, name), atol=1e-9)
    assert np.linalg.norm(here.velocity[1]) > 5.0 and here.velocity[1, 0] > 4.0


def test_in_world_undoes_the_frame(kick):
    surface, frame = find_striking_surface(kick.motion.skeleton, "foot", "right"), np.array([150.0])
    own = sample_strike_surface(kick.motion, frame, surface)
    places, world = forward_kinematics(kick.motion)
    start, _ = surface.compute_line(places[150], world[150])
    heading = compute_heading_from_positions(kick.motion.skeleton, places[150:151])
    np.testing.assert_allclose(convert_to_world(own.start, places[150, 0, :2], heading)[0], start, atol=1e-9)


@pytest.mark.parametrize(
    "part, side", [("foot", "right"), ("head", ""), ("chest", ""), ("hand", "left"), ("tool", "right")]
)
@pytest.mark.parametrize("radius", [0.033, 0.105, 0.11])
def test_the_ball_touches_from_any_side(kick, part, side, radius):
    """Planted: whatever the way from body to ball, the gap is nothing, at every frame."""
    surface = find_striking_surface(kick.motion.skeleton, part, side)
    frames = np.arange(0.0, len(kick.motion) - 1, 7.3)
    struck = sample_strike_surface(kick.motion, frames, surface)
    for normal in np.random.default_rng(0).normal(size=(20, 3)):
        ball = compute_ball_centre(struck, np.tile(normal, (len(frames), 1)), radius)
        free = ball[:, 2] > radius + 1e-9
        gap = measure_ball_gap((struck.start, struck.end), surface.radius, ball, radius)
        np.testing.assert_allclose(gap[free], 0.0, atol=1e-9)
        assert np.all(ball[:, 2] >= radius)


def test_a_joint_by_name_strikes_and_others_are_told(kick):
    skeleton = kick.motion.skeleton
    assert find_striking_surface(skeleton, skeleton.names[2]).start[0] == 2
    for part, side in (("tail", ""), ("foot", ""), ("tool", "")):
        with pytest.raises(InputError, match="part"):
            find_striking_surface(skeleton, part, side)
    with pytest.raises(InputError, match="tool"):
        Tool(length=0.5, reach=0.6)
