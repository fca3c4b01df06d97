"""The recipe `release` on planted throws, with and without a marker on the ball, and what it says of bad input."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.main import main
from beyond_mocap.files.bvh import bvh
from beyond_mocap.markers.files.trc import write_trc
from beyond_mocap.markers.release.release import ReleaseSettings, estimate_release
from beyond_mocap.motion.motion import concatenate_motions, resample
from beyond_mocap.synthetic.ground_truth.synthetic_ball import BallRequest
from beyond_mocap.synthetic.ground_truth.synthetic_markers import build_trial
from beyond_mocap.synthetic.throws import build_throw

MARKERS = Path(__file__).resolve().parents[5] / "shared" / "data" / "markers"


@pytest.fixture(scope="module")
def known():
    made = build_throw((18.0, 0.0, 1.0), 25.0, fps=200.0)
    return build_trial(made.motion, "driveline", ball=BallRequest(made.release))


@pytest.mark.parametrize("arm, fps, speed, drag", [("right", 240.0, 28.0, 0.0), ("left", 120.0, 20.0, 0.0061)])
def test_planted_throws_come_back(arm, fps, speed, drag):
    made = build_throw((18.0, 0.0, 1.0), speed, arm=arm, fps=fps)
    known = build_trial(made.motion, "driveline", ball=BallRequest(made.release, side=arm.capitalize(), drag=drag))
    found = estimate_release(known.trial, known.motion)
    assert (found.side, found.method) == (arm, "ball")
    assert abs(found.time - made.release) < 1.0 / fps
    assert abs(found.speed / known.ball.speed - 1.0) < 0.02
    assert np.degrees(np.arccos(found.direction @ known.ball.velocity / known.ball.speed)) < 1.0
    flying = slice(found.frame + 2, found.frame + int(0.25 * fps))
    assert np.nanmax(np.linalg.norm(found.path.positions - known.ball.places, axis=-1)[flying]) < 0.05


def test_without_a_marker_the_hand_tells(known):
    found = estimate_release(known.trial, known.motion, ReleaseSettings(ball_marker=""))
    assert (found.side, found.method) == ("right", "hand")
    assert abs(found.time - known.ball.request.release) < 3.0 * max(found.time_margin, 0.01)
    assert abs(found.speed / known.ball.speed - 1.0) < 0.1
    assert found.speed_margin > 0.5 and np.isnan(found.residual)
    assert found.report()["residual_m"] is None


def test_the_ball_of_the_path_does_not_jump(known):
    found = estimate_release(known.trial, known.motion)
    steps = np.linalg.norm(np.diff(found.path.positions, axis=0), axis=-1) * 200.0
    near = steps[found.frame - 6 : found.frame + 6]
    assert near.max() < 1.5 * found.speed and near.min() > 0.3 * found.speed


def test_a_motion_at_another_rate_serves(known):
    found = estimate_release(known.trial, resample(known.motion, 100.0))
    assert abs(found.time - known.ball.request.release) < 0.01


def test_a_moved_motion_serves(known):
    """Feet that were set on the floor move the motion against the markers; the ball is where the motion is."""
    lifted = replace(known.motion, root_positions=known.motion.root_positions + [0.0, 0.0, 0.03])
    found, straight = estimate_release(known.trial, lifted), estimate_release(known.trial, known.motion)
    assert abs(found.time - straight.time) < 0.005
    assert np.linalg.norm(found.position - straight.position - [0.0, 0.0, 0.03]) < 0.06
    held = slice(0, found.frame - 30)
    assert abs(found.impact[2] - straight.impact[2] - 0.03) < 1e-6
    rise = np.median(found.path.positions[held] - straight.path.positions[held], axis=0)
    assert np.allclose(rise, [0.0, 0.0, 0.03], atol=0.01)


def test_a_ball_that_is_larger_than_said_is_reported():
    made = build_throw((12.0, 0.0, 1.0), 18.0, fps=200.0)
    known = build_trial(made.motion, "driveline", ball=BallRequest(made.release, radius=0.094, spin_rate=6.0))
    told = estimate_release(known.trial, known.motion)
    assert any("is smaller" in note for note in told.notes)
    right = estimate_release(known.trial, known.motion, ReleaseSettings(ball="handball"))
    assert not any("is smaller" in note for note in right.notes)
    assert abs(right.speed / known.ball.speed - 1.0) < 0.02
    assert abs(right.time - made.release) < 1.0 / 200.0


@pytest.mark.parametrize("settings, said", [
    (ReleaseSettings(ball_marker="PUCK"), "no marker 'PUCK'"),
    (ReleaseSettings(ball="melon"), "ball 'melon'"),
])
def test_bad_settings_are_said(known, settings, said):
    with pytest.raises(InputError, match=said):
        estimate_release(known.trial, known.motion, settings)


def seen_as(known, change):
    positions = known.trial.positions.copy()
    change(positions, known.trial.index_of("BALL"), int(known.ball.request.release * 200.0))
    return known.trial.with_positions(positions)


def hide_held(places, ball, release):
    places[: release + 3, ball] = np.nan


def hide_all(places, ball, release):
    places[:, ball] = np.nan


def bounce_off(places, ball, release):
    steps = np.arange(len(places) - release - 40)[:, None]
    places[release + 40 :, ball] = places[release + 39, ball] - steps * [0.05, 0.0, 0.0]


def scatter(seed):
    def change(places, ball, release):
        rng = np.random.default_rng(seed)
        places[rng.integers(0, len(places), 60), ball] += rng.normal(0.0, 0.3, (60, 3))

    return change


@pytest.mark.parametrize("change, how, frames, share", [
    (hide_held, "ball", 1.0, 0.02), (bounce_off, "ball", 1.0, 0.02), (hide_all, "hand", 4.0, 0.1),
    *((scatter(seed), "ball", 3.0, 0.03) for seed in range(6)),
])
def test_a_ball_that_is_badly_seen(known, change, how, frames, share):
    found = estimate_release(seen_as(known, change), known.motion)
    assert (found.method, found.side) == (how, "right")
    assert abs(found.time - known.ball.request.release) < frames / 200.0
    assert abs(found.speed / known.ball.speed - 1.0) < share
    assert abs(found.radius - 0.0366) < 0.002


@pytest.mark.parametrize("settings, said", [
    (ReleaseSettings(ball_marker="LASI"), "LASI is .* from the"),
    (ReleaseSettings(hand="left"), "BALL is .* from the left hand"),
])
def test_a_marker_that_is_on_no_ball_in_the_hand(known, settings, said):
    with pytest.raises(InputError, match=said):
        estimate_release(known.trial, known.motion, settings)


def test_a_marker_that_only_is_called_a_ball_is_left_aside(known):
    swapped = known.trial.rename_labels({"BALL": "X1", "LANK": "BALL"})
    found = estimate_release(swapped, known.motion)
    assert found.method == "hand" and found.side == "right" and "from the" in found.notes[0]


def test_markers_beside_the_motion_are_said(known):
    with pytest.raises(InputError, match="away from the motion"):
        estimate_release(known.trial.with_positions(known.trial.positions + [5.0, 0.0, 0.0]), known.motion)


def test_no_throw_is_said(known):
    still = known.motion.frames(0, 1)
    standing = concatenate_motions([still] * len(known.trial))
    with pytest.raises(InputError, match="a throw"):
        estimate_release(known.trial.with_positions(np.repeat(known.trial.positions[:1], len(known.trial), axis=0)),
                         standing)
    with pytest.raises(InputError, match="at least 12"):
        estimate_release(known.trial.select_frames(0, 5), known.motion.frames(0, 5))


def test_another_trials_motion_is_said(known):
    with pytest.raises(InputError, match="the motion of this trial"):
        estimate_release(known.trial, known.motion.frames(0, 40))


def test_the_verb_writes_what_the_recipe_finds(known, tmp_path, capsys):
    trial, motion, report = tmp_path / "throw_25mps.trc", tmp_path / "m.bvh", tmp_path / "r.json"
    write_trc(known.trial, trial)
    bvh.write_bvh(motion, known.motion)
    ball = tmp_path / "b.csv"
    assert main(["release", str(trial), "--motion", str(motion), "--report", str(report), "--ball-csv", str(ball)]) == 0
    told = json.loads(report.read_text("utf-8"))
    assert told["radar_speed_m_s"] == 25.0
    assert told["speed_m_s"] == pytest.approx(known.ball.speed, rel=0.02)
    assert abs(told["release_time_s"] - known.ball.request.release) < 0.005
    assert {"release_frame", "direction", "uncertainty_s"} <= set(told)
    assert len(ball.read_text("utf-8").splitlines()) == len(known.trial) + 1
    assert "right hand" in capsys.readouterr().out


def test_the_verb_says_what_is_missing(tmp_path, capsys):
    assert main(["release", str(tmp_path / "no.trc"), "--motion", "m.bvh", "--report", str(tmp_path / "r.json")]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_the_verb_names_the_file_whose_motion_it_is_not(known, tmp_path, capsys):
    write_trc(known.trial, tmp_path / "t.trc")
    bvh.write_bvh(tmp_path / "m.bvh", known.motion.frames(0, 40))
    given = ["release", str(tmp_path / "t.trc"), "--motion", str(tmp_path / "m.bvh"), "--report"]
    assert main([*given, str(tmp_path / "r.json"), "--ball-csv", str(tmp_path / "b.csv")]) == 2
    told = capsys.readouterr().err.strip()
    assert f"{tmp_path / 't.trc'}: " in told and "\n" not in told and "the motion of this trial" in told
    assert len(list(tmp_path.iterdir())) == 2
