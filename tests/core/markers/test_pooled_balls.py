"""The ball's place in the hand comes from all throws of a hand, whose markers lie elsewhere on the ball."""

import json
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.cli.main import main
from beyond_mocap.markers.files.model_json import read_model
from beyond_mocap.markers.files.trc import write_trc
from beyond_mocap.markers.pooled_balls import fit_pooled_ball
from beyond_mocap.markers.release.release import estimate_release
from beyond_mocap.markers.release.throwing_hand import refine_hand
from beyond_mocap.motion.hand import build_hand
from beyond_mocap.synthetic.ground_truth.synthetic_ball import BallRequest
from beyond_mocap.synthetic.ground_truth.synthetic_markers import build_trial
from beyond_mocap.synthetic.throws import build_throw

RADIUS = 0.0366
OUTWARD = ((0.3, 0.2, -0.9), (-0.9, 0.3, -0.3), (0.4, 0.9, 0.1))


@pytest.fixture(scope="module")
def known():
    """Throws of one body with one grip, the marker elsewhere on the ball in each."""
    thrown = build_throw((18.0, 0.0, 1.0), 25.0, fps=200.0)
    first, end = (round(200.0 * (thrown.release + seconds)) for seconds in (-0.6, 0.4))
    motion = thrown.motion.frames(first, end)
    release = thrown.release - first / 200.0
    return [build_trial(motion, "driveline", ball=BallRequest(release, outward=outward)) for outward in OUTWARD]


def test_throws_share_a_place_that_is_nearer_to_the_true_one(known):
    hand = refine_hand(build_hand(known[0].motion, "right"), known[0].trial, ("BALL",))
    held = slice(80, int(known[0].ball.request.release * 200.0) - 3)
    truth = np.median(hand.to_hand(known[0].ball.places)[held], axis=0)
    releases = [estimate_release(one.trial, one.motion) for one in known]
    pooled = fit_pooled_ball(releases, hand, RADIUS)
    away = [np.linalg.norm(release.centre - truth) for release in releases]
    assert np.linalg.norm(pooled.centre - truth) < 0.008 and max(away) > 0.03
    apart = [replace(release, held=release.held + [0.05 * number, 0.0, 0.0]) for number, release in enumerate(releases)]
    assert fit_pooled_ball(apart, hand, RADIUS) is None  # three different grips


def test_a_folder_of_throws_shares_it_in_reports_and_models(known, tmp_path):
    folder, out = tmp_path / "throws", tmp_path / "out"
    folder.mkdir()
    write_trc(known[0].static, folder / "static.trc")
    for number, one in enumerate(known[:2]):
        write_trc(one.trial, folder / f"throw{number}.trc")
    assert main(["reconstruct", str(folder), "--out", str(out), "--marker-set", "driveline"]) == 0
    names = [out / f"throw{number}" for number in range(2)]
    reports = [json.loads(name.with_suffix(".report.json").read_text("utf-8"))["release"] for name in names]
    assert reports[0]["ball_centre_in_hand_m"] == reports[1]["ball_centre_in_hand_m"]
    for name, report in zip(names, reports):
        assert "that of 2 throws" in report["warnings"][-1]
        assert abs(report["speed_m_s"] / known[0].ball.speed - 1.0) < 0.02
        model = read_model(name.with_suffix(".model.json"))
        assert model.ball.label == "BALL" and model.skeleton.names[model.ball.joint] == "RightHand"
        assert np.allclose(model.ball.centre, report["ball_centre_in_hand_m"])
