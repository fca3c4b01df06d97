"""The page over a folder of trials: planted reports come out as figures, however few there are."""

import json

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.markers.trial_results import (
    Throw,
    TrialResult,
    align_impacts,
    compare_speeds,
    find_dominant_sides,
    read_results,
    select_near_mean,
)
from beyond_mocap.markers.trials_page import build_trials_report

pytest.importorskip("matplotlib")


def report(subject, radar=30.0, speed=29.0, angle=0.0, hand="right", throws=True):
    """One trial's report; the ball lands 20 m ahead in the direction of `angle` degrees, the hips start at (1, 2)."""
    way = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    release = {
        "speed_m_s": speed, "radar_speed_m_s": radar, "direction": [*way.tolist(), 0.0], "hand": hand, "how": "ball",
        "hips_m": [1.0, 2.0, 0.9], "impact_m": [*([1.0, 2.0] + 20.0 * way).tolist(), 0.0],
    }  # fmt: skip
    return {
        "subject": subject, "frames": 400, "residual_mm": {"rms": 6.0, "single_rms": 4.0},
        "weighted_se": {"mean": 0.002, "sd": 0.0005}, "frames_per_second": 400.0,
        "release": release if throws else None,
    }  # fmt: skip


def written(folder, reports):
    for name, one in reports.items():
        (folder / f"{name}.report.json").write_text(json.dumps(one), "utf-8")
    return folder


def test_a_folder_of_throws_becomes_a_page(tmp_path):
    rng = np.random.default_rng(2)
    radar = rng.normal(30.0, 3.0, 24)
    reports = {
        f"t{i:02d}": report("ann" if i % 2 else "<bob>", radar[i], radar[i] - 1.2 + rng.normal(0, 0.3),
                            rng.normal(90, 4), "left" if i % 8 == 1 else "right")
        for i in range(24)
    }  # fmt: skip
    page = build_trials_report(written(tmp_path, reports))
    assert page.count("data:image/png") == 5
    assert "24 throws with a measured speed" in page and "Wilcoxon, paired, two-sided" in page
    assert "<bob>" not in page and "&lt;bob&gt;" in page
    assert all(f"t{i:02d}" in page for i in range(24))


def test_one_trial_without_a_throw_is_enough(tmp_path):
    page = build_trials_report(written(tmp_path, {"walk": report("", throws=False)}))
    assert page.count("data:image/png") == 2 and "Where throws land" not in page


def test_one_throw_without_impact_or_radar(tmp_path):
    one = report("ann", radar=None)
    one["release"]["impact_m"] = None
    page = build_trials_report(written(tmp_path, {"a": one}))
    assert "Where throws land" not in page and "29.0" in page


def test_errors_of_trials_are_in_the_table(tmp_path):
    rows = [{"trial": "a", "report": "a.report.json", "error": ""},
            {"trial": "b", "report": "", "error": "<no markers>"}]
    written(tmp_path, {"a": report("ann")})
    (tmp_path / "trials.json").write_text(json.dumps({"trials": rows}), "utf-8")
    assert "&lt;no markers&gt;" in build_trials_report(tmp_path)
    assert [r.error for r in read_results(tmp_path)] == ["", "<no markers>"]


@pytest.mark.parametrize("text", ['{"a":' * 900 + "1" + "}" * 900, "[" * 100000, "[]"])
def test_reports_of_another_form_are_reported_in_one_line(tmp_path, text):
    (tmp_path / "a.report.json").write_text(text, "utf-8")
    with pytest.raises(InputError, match="a.report.json") as caught:
        build_trials_report(tmp_path)
    assert "\n" not in str(caught.value)


def test_a_folder_without_reports_is_said(tmp_path):
    with pytest.raises(InputError, match="no reports of trials"):
        build_trials_report(tmp_path)
    (tmp_path / "a.report.json").write_text("{", "utf-8")
    with pytest.raises(InputError, match="a.report.json"):
        build_trials_report(tmp_path)


def throw_to(subject, angle, metres=20.0, side="right"):
    way = np.array([np.cos(angle), np.sin(angle)])
    hips = np.array([3.0, -1.0])
    thrown = Throw(speed=30.0, radar=None, side=side, hips=hips, impact=hips + metres * way,
                   velocity=30.0 * np.append(way, 0.0), method="ball")
    return TrialResult(name="t", subject=subject, throw=thrown)


def test_impacts_are_aligned_to_each_subjects_throws():
    results = [throw_to("a", 1.0), throw_to("a", 1.1), throw_to("a", 0.9), throw_to("b", -2.0)]
    points = align_impacts(results)
    assert np.allclose(points[[0, 3]], [0.0, 20.0], atol=1e-9)
    assert np.allclose(points[1], [-20.0 * np.sin(0.1), 20.0 * np.cos(0.1)])  # further left
    assert np.allclose(points[2], [20.0 * np.sin(0.1), 20.0 * np.cos(0.1)])


def test_far_throws_are_culled():
    points = np.concatenate([np.random.default_rng(0).normal(0.0, 1.0, (40, 2)), [[30.0, 0.0], [np.nan, 0.0]]])
    assert select_near_mean(points)[:40].all() and not select_near_mean(points)[40:].any()


def test_the_dominant_arm_is_the_one_that_throws_more():
    results = [throw_to("a", 0.0, side=side) for side in ("left", "left", "right")]
    assert find_dominant_sides(results) == {"a": "left"}


def test_planted_differences_are_reported():
    rng = np.random.default_rng(7)
    measured = rng.uniform(10.0, 30.0, 60)
    slow = compare_speeds(measured - 1.152 + rng.normal(0.0, 1.685, 60), measured)
    assert slow.count == 60 and slow.wilcoxon < 0.01 and slow.normal > 0.01
    assert abs(slow.mean + 1.152) < 0.7 and abs(slow.sd - 1.685) < 0.5
    noise = rng.normal(0.0, 1.0, 60)
    fair = compare_speeds(measured + noise - np.median(noise), measured)
    assert fair.wilcoxon > 0.05
    few = compare_speeds([20.0, np.nan, 21.0], [20.0, 20.0, 20.0])
    assert few.count == 2 and np.isnan(few.wilcoxon) and few.within == 1.0
    assert compare_speeds([20.0] * 8, [20.0] * 8).count == 8
    assert compare_speeds([], []).count == 0
