"""What the trace of a motion says about it, on motions whose physics is known."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.momentum_trace import FORCE_SECONDS, measure_ground_force, trace_momentum
from beyond_mocap.motion.motion import Motion
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.motion.supports import GRAVITY
from beyond_mocap.synthetic.gait import build_gait

FPS = 60.0
FLIGHT = 0.5  # s


def build_hop(fall=GRAVITY, speed=0.0, fps=FPS):
    """A standing body that leaves the ground for half a second at 1 s, and moves with a constant speed along X."""
    standing = build_gait(0.0, 3.0, fps=fps)
    time = np.arange(len(standing)) / fps
    since = time - 1.0
    height = np.where((since > 0.0) & (since < FLIGHT), 0.5 * fall * since * (FLIGHT - since), 0.0)
    root = standing.root_positions[:1] + np.stack([speed * time, 0.0 * time, height], axis=1)
    return Motion(standing.skeleton, root, np.repeat(standing.rotations[:1], len(standing), axis=0), fps)


@pytest.fixture(scope="module")
def hop():
    return trace_momentum(build_hop(speed=1.0))


def test_a_hop_is_one_flight_on_its_parabola(hop):
    assert len(hop.flights) == 1
    first, last = hop.flights[0] / FPS
    assert 1.0 <= first < 1.06 and 1.44 < last <= 1.5  # a foot stands up to 3 cm above the ground
    assert hop.deviations[0] < 1e-3
    frames = np.arange(65, 86)
    np.testing.assert_allclose(hop.sample_parabola(0, frames), hop.centre[frames], atol=1e-3)


def test_nothing_pushes_in_the_air_and_the_weight_is_held_before(hop):
    free = [frame for frame in range(len(hop)) if hop.is_force_of_flight(frame)]
    assert len(free) >= 15 and np.abs(hop.force[free]).max() < 1e-6
    np.testing.assert_allclose(hop.force[:57], np.tile([0.0, 0.0, GRAVITY], (57, 1)), atol=1e-6)
    assert hop.find_flight(75) == 0 and hop.find_flight(50) is None


def test_a_body_that_falls_too_fast_leaves_its_parabola_and_is_pushed_in_the_air():
    trace = trace_momentum(build_hop(fall=1.4 * GRAVITY))
    free = [frame for frame in range(len(trace)) if trace.is_force_of_flight(frame)]
    np.testing.assert_allclose(trace.force[free, 2], -0.4 * GRAVITY, atol=1e-3)
    assert trace.deviations[0] > 0.03


@pytest.mark.parametrize("fps", [25.0, 30.0, 100.0, 120.0])
def test_the_force_over_its_window_does_not_depend_on_the_frame_rate(fps):
    """A pulse of 0.2 s: the mean over the window, weighted by a triangle, is the same integral at every rate."""
    time = np.arange(0.0, 2.0, 1.0 / fps)
    centre = np.stack([0.05 * np.sin(2.0 * np.pi * time), 0.0 * time, 1.0 + 0.0 * time], axis=1)
    force = measure_ground_force(centre, fps)
    reach = max(round(FORCE_SECONDS * fps), 1) / fps
    seen = -0.05 * (2.0 * np.pi) ** 2 * np.sinc(reach) ** 2  # what a triangle leaves of a sine of 1 Hz
    inner = slice(5, -5)
    np.testing.assert_allclose(force[inner, 0], seen * np.sin(2.0 * np.pi * time)[inner], atol=1e-6)
    assert np.allclose(force[:, 2], GRAVITY)


def test_the_whole_force_carries_the_weight_over_time():
    """Momentum that the force gives is the change of velocity, so over whole strides the mean force is the weight."""
    gait = trace_momentum(build_gait(3.5, 6.0, fps=60.0))
    assert gait.force[60:-60, 2].mean() == pytest.approx(GRAVITY, rel=0.03)


def test_the_support_polygon_of_a_stand_holds_both_boots(hop):
    assert len(hop.build_support_polygon(75)) == 0  # in the air
    polygon = hop.build_support_polygon(10)
    along, aside = np.ptp(polygon, axis=0)
    assert 0.2 < along < 0.35 and 0.2 < aside < 0.5  # a boot's length; two boots beside each other
    after = np.roll(polygon, -1, axis=0) - polygon
    turns = after[:, 0] * np.roll(after, -1, axis=0)[:, 1] - after[:, 1] * np.roll(after, -1, axis=0)[:, 0]
    assert (turns > 0.0).all()  # convex, counterclockwise
    away = hop.find_force_origin(10) - [*hop.centre[10, :2], hop.ground]
    assert np.abs(away).max() < 1e-6  # a standing body's force passes through its centre of mass


def test_a_walk_always_stands_and_rolls_from_heel_to_toe():
    trace = trace_momentum(build_gait(1.3, 4.0, fps=60.0))
    assert len(trace.flights) == 0 and trace.is_down[30:-30].any(axis=(1, 2)).all()
    heel, tip = trace.is_down[:, 0, :2].any(axis=1), trace.is_down[:, 0, 4:].any(axis=1)
    state = np.where(heel, np.where(tip, "flat", "heel"), np.where(tip, "tip", "air"))
    order = "".join(f"{one} " for one, before in zip(state[1:], state[:-1]) if one != before)
    assert order.count("heel flat tip air") >= 3 and "heel air" not in order


def test_the_force_of_a_foot_on_the_ground_begins_in_its_polygon():
    trace = trace_momentum(build_gait(4.0, 4.0, fps=60.0))
    polygons = [(frame, trace.build_support_polygon(frame)) for frame in range(0, len(trace), 7)]
    assert sum(len(polygon) > 2 for _, polygon in polygons) > 3
    for frame, polygon in polygons:
        if len(polygon) > 2:
            edges, to = np.roll(polygon, -1, axis=0) - polygon, trace.find_force_origin(frame)[:2] - polygon
            assert (edges[:, 0] * to[:, 1] - edges[:, 1] * to[:, 0] > -1e-9).all()


def test_a_skeleton_without_toes_stands_too():
    gait = build_gait(1.3, 3.0, fps=60.0)
    keep = [joint for joint, name in enumerate(gait.skeleton.names) if "Toe" not in name]
    parents = tuple(keep.index(gait.skeleton.parents[joint]) if joint else -1 for joint in keep)
    skeleton = Skeleton(tuple(gait.skeleton.names[joint] for joint in keep), parents, gait.skeleton.offsets[keep])
    trace = trace_momentum(Motion(skeleton, gait.root_positions, gait.rotations[:, keep], gait.fps))
    assert trace.is_down[30:-30].any(axis=(1, 2)).all() and len(trace.flights) == 0


@pytest.mark.parametrize("count", [1, 2, 3])
def test_short_motions_carry_their_weight(count):
    whole = build_hop()
    trace = trace_momentum(Motion(whole.skeleton, whole.root_positions[:count], whole.rotations[:count], FPS))
    assert len(trace) == count and np.allclose(trace.force, [0.0, 0.0, GRAVITY]) and len(trace.flights) == 0


def test_the_same_motion_gives_the_same_bits():
    gait = build_gait(5.0, 2.0, fps=60.0)
    first, again = trace_momentum(gait), trace_momentum(gait)
    for name in ("centre", "force", "flights", "corners", "is_down"):
        assert getattr(first, name).tobytes() == getattr(again, name).tobytes()


def test_a_skeleton_without_legs_is_refused():
    skeleton = Skeleton(("a", "b"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.5]]))
    still = Motion(skeleton, np.zeros((5, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (5, 2, 1)), 30.0)
    with pytest.raises(InputError, match="hips|legs"):
        trace_momentum(still)
