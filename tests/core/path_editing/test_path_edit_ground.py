"""Riders on hills, stairs and meshes: soles on the ground, the speed kept, and bodies that lean as they should."""

import numpy as np
import pytest

from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.motion.path.terrain import Terrain
from beyond_mocap.path_editing.path_edit import edit_path
from beyond_mocap.path_editing.path_edit_settings import PathEditSettings
from beyond_mocap.path_editing.path_edit_source import prepare_source
from beyond_mocap.path_editing.path_line import fit_line
from beyond_mocap.synthesis.quality.movement import list_foot_joints, measure_contact_speeds
from beyond_mocap.synthetic.gait import build_gait

SLOPE = np.tan(np.radians(12.0))


@pytest.fixture(scope="module")
def source():
    return prepare_source(build_gait(1.4, 5.0, 30.0), PathEditSettings())


def line(*corners):
    return fit_line(np.array(corners, dtype=float), "line", rounding=0.3)


def hill():
    """Two metres level, uphill, level, downhill."""
    x = np.array([0.0, 2.0, 5.0, 6.0, 9.0, 12.0])
    z = np.array([0.0, 0.0, 3.0 * SLOPE, 3.0 * SLOPE, 0.0, 0.0])
    return line(*zip(x, 0.0 * x, z))


def mesh(heights):
    """Terrain along x with `heights` ((x, z), ...), 20 m wide."""
    heights = np.array(heights, dtype=float)
    sides = [np.column_stack([heights[:, 0], np.full(len(heights), y), heights[:, 1]]) for y in (-10, 10)]
    vertices = np.concatenate(sides)
    n = len(heights)
    quads = [(i, i + 1, i + 1 + n, i + n) for i in range(n - 1)]
    return Terrain(vertices, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]))


def off_the_ground(ridden, ground):
    """Metres (N,) that toes are above `ground`, a function of x, in feet that stand with their toes on it."""
    toe = list_foot_joints(ridden.motion.skeleton)[:, 1]
    now, before = (forward_kinematics(motion)[0][:, toe] for motion in (ridden.motion, ridden.rigid))
    down = ridden.standing.all(axis=2) & (before[..., 2] - ridden.origin[:, 2:] - ridden.source.sole < 0.004)
    return (now[..., 2] - ground(now[..., 0]) - ridden.source.sole)[down]


def along(path):
    """The height of a path that runs along x, as a function of x."""
    x, _, z = path.at(np.linspace(*path.domain, 4000)).T
    return lambda at: np.interp(at, x, z)


def jolt(motion):
    """The largest third difference of any joint, m/s^3."""
    return np.linalg.norm(np.diff(forward_kinematics(motion)[0], 3, axis=0), axis=-1).max() * motion.fps**3


def test_soles_stand_on_the_hill_and_do_not_slide(source):
    path = hill()
    ridden = edit_path(source, path, PathEditSettings())
    off = np.abs(off_the_ground(ridden, along(path)))
    assert np.percentile(off, 95) < 0.005 and off.max() < 0.015
    level = edit_path(source, path, PathEditSettings(slopes=False))
    assert np.percentile(np.abs(off_the_ground(level, along(path))), 95) > 0.03
    assert np.isfinite(ridden.motion.rotations).all() and jolt(ridden.motion) < 2.0 * jolt(source.motion)


def test_the_speed_along_the_path_is_kept_on_hills(source):
    ridden = edit_path(source, hill(), PathEditSettings())
    own = np.interp(ridden.frames[1:], np.arange(len(source.motion)), source.residuals.step)
    played = np.diff(ridden.frames)
    assert played.max() > 1.03  # shorter steps, more of them
    assert np.abs(np.diff(ridden.arc)[5:] / own[5:] - 1.0).max() < 0.01


def test_climbs_and_bends_slow_only_those_who_wish_it(source):
    quick = edit_path(source, hill(), PathEditSettings())
    slow = edit_path(source, hill(), PathEditSettings(climbs=True))
    at = (quick.arc > 2.5) & (quick.arc < 4.5)
    slow_at = (slow.arc > 2.5) & (slow.arc < 4.5)
    assert slow_at.sum() > 1.5 * at.sum()
    angle = np.linspace(0.0, 4.0 * np.pi, 400)
    tight = fit_line(np.stack([0.6 * np.sin(angle), 0.6 * (1.0 - np.cos(angle)), 0.0 * angle], axis=1), "circle")
    pace = [np.diff(edit_path(source, tight, PathEditSettings(bends=b)).arc)[40:80].mean() for b in (False, True)]
    assert pace[1] / pace[0] == pytest.approx((2.0 / 0.6) ** (-1.0 / 3.0), rel=0.05)


def test_its_own_path_asks_for_no_lean_and_no_other_steps(source):
    settings = PathEditSettings(plant=False, bends=True, climbs=True)
    ridden = edit_path(source, source.path, settings)
    assert np.abs(ridden.motion.rotations - source.motion.rotations).max() < 1e-9


def test_bodies_lean_into_bends_and_into_slopes():
    run = prepare_source(build_gait(3.5, 4.0, 30.0), PathEditSettings())
    angle = np.linspace(0.0, 4.0 * np.pi, 400)
    left = fit_line(np.stack([4.0 * np.sin(angle), 4.0 * (1.0 - np.cos(angle)), 0.0 * angle], axis=1), "circle")

    def head(path, lean):
        ridden = edit_path(run, path, PathEditSettings(plant=False, lean=lean))
        places = forward_kinematics(ridden.motion)[0]
        side = np.stack([-np.sin(ridden.heading), np.cos(ridden.heading), 0.0 * ridden.heading], axis=1)
        ahead = np.stack([np.cos(ridden.heading), np.sin(ridden.heading), 0.0 * ridden.heading], axis=1)
        up = places[:, run.motion.skeleton.index("Head")] - places[:, 0]
        return np.sum(up * side, axis=1)[40:80].mean(), np.sum(up * ahead, axis=1)[40:80].mean()

    assert head(left, True)[0] > head(left, False)[0] + 0.03
    climb = line((0, 0, 0), (30, 0, 30 * SLOPE))
    assert head(climb, True)[1] > head(climb, False)[1] + 0.02


def test_by_time_steps_grow_with_the_path(source):
    path = line((0, 0, 0), (1.2 * source.arc.length, 0, 0))
    ridden = edit_path(source, path, PathEditSettings(by_arc_length=False))

    def skate(motion):
        feet = forward_kinematics(motion)[0][:, list_foot_joints(motion.skeleton)]
        return np.nanmean(measure_contact_speeds(feet, ridden.standing.all(axis=2), motion.fps))

    assert skate(ridden.rigid) > 0.15 and skate(ridden.motion) < 0.5 * skate(ridden.rigid)
    assert ridden.warnings == ()
    far = edit_path(source, line((0, 0, 0), (3.0 * source.arc.length, 0, 0)), PathEditSettings(by_arc_length=False))
    assert any("times as long" in told for told in far.warnings)


def test_a_mesh_is_stood_on_like_a_path_of_its_height(source):
    ground = mesh([(-5, 0), (2, 0), (20, 18 * SLOPE)])
    ridden = edit_path(source, line((0, 0, 0), (2, 0, 0), (12, 0, 10 * SLOPE)), PathEditSettings(), ground)
    off = np.abs(off_the_ground(ridden, lambda x: np.maximum(x - 2.0, 0.0) * SLOPE))
    assert np.percentile(off, 95) < 0.005 and off.max() < 0.03
    drawn_below = edit_path(source, line((0, 0, 0), (12, 0, 0)), PathEditSettings(), ground)
    assert drawn_below.motion.root_positions[-1, 2] > source.motion.root_positions[0, 2] + 0.5


def test_stairs_make_neither_nan_nor_pops(source):
    steps = [(-5.0, 0.0), (1.5, 0.0)]
    for i in range(12):
        steps += [(1.5 + 0.3 * i, 0.17 * (i + 1)), (1.8 + 0.3 * i, 0.17 * (i + 1))]
    ground = mesh([*steps, (20.0, steps[-1][1])])
    path = line((0, 0, 0), (1.5, 0, 0), (5.1, 0, 12 * 0.17), (10, 0, 12 * 0.17))
    ridden = edit_path(source, path, PathEditSettings(), ground)
    assert np.isfinite(ridden.motion.root_positions).all() and np.isfinite(ridden.motion.rotations).all()
    assert jolt(ridden.motion) < 6.0 * jolt(source.motion)


def test_who_has_no_legs_rides_all_the_same():
    from beyond_mocap.motion.skeleton import Skeleton

    skeleton = Skeleton(("Box", "Lid"), (-1, 0), np.array([[0, 0, 0], [0, 0, 0.3]]))
    root = np.column_stack([np.linspace(0, 2, 40), np.zeros(40), np.full(40, 0.1)])
    rotations = np.zeros((40, 2, 4))
    rotations[..., 0] = 1.0
    box = prepare_source(Motion(skeleton, root, rotations, 30.0), PathEditSettings())
    ridden = edit_path(box, hill(), PathEditSettings())
    assert len(ridden.motion) == 40 and any("legs" in told for told in ridden.warnings)
    over = ridden.motion.root_positions[:, 2] - ridden.origin[:, 2]
    assert np.allclose(over, 0.1 - box.moving.origin[0, 2], atol=1e-6)


@pytest.mark.parametrize("height", (0.0, 1.0))
def test_a_path_on_the_floor_leaves_soles_as_high_as_they_were(height, source):
    """Toe joints are above the soles: a line drawn on the floor is under the shoes, not in them."""
    low = [np.percentile(forward_kinematics(m)[0][:, list_foot_joints(m.skeleton)[:, 1], 2], 2) for m in (
        source.motion, edit_path(source, line((0, 0, height), (9, 0, height)), PathEditSettings()).motion
    )]
    assert low[1] - height == pytest.approx(low[0], abs=0.003)


def test_a_floor_that_drifts_upwards_in_the_recording_lets_nobody_sink_or_stretch(source):
    """A recording whose floor rises by 8 cm under a path that does not: on the ground he walks as high as ever."""
    walk = source.motion
    rise = 0.08 * np.clip(np.linspace(-1.0, 2.0, len(walk)), 0.0, 1.0)
    risen = Motion(walk.skeleton, walk.root_positions + rise[:, None] * [0, 0, 1], walk.rotations, walk.fps)
    drifted = prepare_source(risen, PathEditSettings(), source.standing, source.path)
    level = line((0, 0, 0), (9, 0, 0))
    asked, found = (edit_path(of, level, PathEditSettings(lean=False)) for of in (source, drifted))
    assert np.abs(found.motion.root_positions - asked.motion.root_positions)[:, 2].max() < 0.02
    assert found.miss.max() < 0.005


@pytest.mark.parametrize("speed", [3.0, 6.0])
def test_whoever_runs_up_a_hill_reaches_where_he_should_stand(speed):
    runner = prepare_source(build_gait(speed, 3.0, 120.0), PathEditSettings())
    ridden = edit_path(runner, line((0, 0, 0), (6, 0, 1.6), (18, 0, 0)), PathEditSettings())
    assert ridden.miss.max() < 0.005
