"""The report of a player over several stretches: nothing is counted twice, and every second has its own figures."""

import numpy as np
import pytest

from beyond_mocap.evaluation.report import evaluate
from beyond_mocap.match.pieces.tasks import (
    build_player_report,
    join_seconds,
    measure_per_second,
    measure_stretch,
    measure_time_lost,
    merge_reports,
)
from beyond_mocap.motion.track.ball_path import BallPath
from beyond_mocap.synthesis.quality.playback import playback_from_take


def test_time_lost_counts_every_second_once():
    assert measure_time_lost([[[1.0, 3.0], [2.0, 4.0]], [[3.5, 3.75]], [], [[10.0, 10.5]]]) == pytest.approx(3.5)
    assert measure_time_lost([]) == 0.0


def test_reports_of_stretches_are_joined_by_what_their_figures_mean():
    one = {"version": 1, "frames": 30, "root_error_m": {"mean": 1.0, "max": 2.0}, "keys": [1], "loop_share": None,
           "warp_rate": {"min": 0.9, "max": 1.1}}  # fmt: skip
    two = {"version": 1, "frames": 90, "root_error_m": {"mean": 2.0, "max": 9.0}, "keys": [2, 3], "loop_share": 0.5,
           "warp_rate": {"min": 0.8, "max": 1.0}}  # fmt: skip
    joined = merge_reports([one, two], [30, 90])
    assert joined == {"version": 1, "frames": 120, "root_error_m": {"mean": 1.75, "max": 9.0}, "keys": [1, 2, 3],
                      "loop_share": 0.5, "warp_rate": {"min": 0.8, "max": 1.1}}  # fmt: skip
    assert type(joined["frames"]) is int
    assert merge_reports([one], [30]) == one


def test_figures_of_stretches_weigh_by_what_they_rest_on():
    group = {"frames": 30, "snap_turns_per_min": 2.0, "fast_frames": 0, "off_travel_deg_p90": None, "slow_frames": 30,
             "unusual_posture_share": 0.1, "source_frames": 10, "source_snap_turns_per_min": 6.0,
             "standing": {"seconds": 1.0, "both_down": 0.5}, "tempo": {"sd_ms": None, "strides": 0}}  # fmt: skip
    other = {"frames": 90, "snap_turns_per_min": 0.0, "fast_frames": 80, "off_travel_deg_p90": 40.0, "slow_frames": 10,
             "unusual_posture_share": 0.5, "source_frames": 20, "source_snap_turns_per_min": 0.0,
             "standing": {"seconds": 9.0, "both_down": 1.0}, "tempo": {"sd_ms": 12.0, "strides": 7}}  # fmt: skip
    reports = [{"naturalness": group, "unknown": {"naturalness.off_travel_deg_p90": "never fast", "loop_share": "?"},
                "loop_share": None, "notes": ["1 s"]},
               {"naturalness": other, "unknown": {"loop_share": "?"}, "loop_share": None, "notes": []}]  # fmt: skip
    joined = merge_reports(reports, [30, 90])
    assert joined["unknown"] == {"loop_share": "?"} and joined["notes"] == ["1 s"]
    found = joined["naturalness"]
    assert (found["frames"], found["slow_frames"], found["source_frames"]) == (120, 40, 30)
    assert found["snap_turns_per_min"] == 0.5 and found["source_snap_turns_per_min"] == 2.0
    assert found["unusual_posture_share"] == pytest.approx(0.2) and found["off_travel_deg_p90"] == 40.0
    assert found["standing"] == {"seconds": 10.0, "both_down": pytest.approx(0.95)}
    assert found["tempo"] == {"sd_ms": 12.0, "strides": 7}


def test_touches_of_stretches_weigh_by_their_number():
    """Two receptions of 3 m/s and one of 6; the library's kicks are the same in both stretches and counted once."""
    own = {"source_kicks": 25, "source_ankle_speed_m_s_median": 9.0}
    groups = [
        {"reception": {"receptions": 2, "speed_m_s_median": 3.0, "speed_m_s_max": 4.0, "strike_count": 0},
         "kick": {"kicks": 0, "ankle_speed_m_s_median": None, **own}, "second_strike_count": 1,
         "ball_inside": {"ball_frames": 30, "inside_frames": 3, "inside_share": 0.1, "depth_mm_max": 20.0},
         "substituted": [{"time_s": 1.0}]},
        {"reception": {"receptions": 1, "speed_m_s_median": 6.0, "speed_m_s_max": 7.0, "strike_count": 1},
         "kick": {"kicks": 4, "ankle_speed_m_s_median": 8.0, **own}, "second_strike_count": 2,
         "ball_inside": {"ball_frames": 90, "inside_frames": 0, "inside_share": 0.0, "depth_mm_max": 0.0},
         "substituted": []},
    ]
    found = merge_reports([{"touches": group} for group in groups], [30, 90])["touches"]
    assert found["reception"] == {"receptions": 3, "speed_m_s_median": 4.0, "speed_m_s_max": 7.0, "strike_count": 1}
    assert found["kick"] == {"kicks": 4, "ankle_speed_m_s_median": 8.0, **own}
    assert found["ball_inside"] == {"ball_frames": 120, "inside_frames": 3, "inside_share": pytest.approx(0.025),
                                    "depth_mm_max": 20.0}
    assert found["second_strike_count"] == 3 and found["substituted"] == [{"time_s": 1.0}]
    assert type(found["kick"]["source_kicks"]) is int


def test_every_second_has_its_own_figures(take, library):
    played, track = playback_from_take(take), take.plan.track
    count = len(take.motion)
    times = take.start_time + np.arange(count) / take.motion.fps
    ball = np.column_stack([played.pelvis + [3.0, 4.0], np.full(count, 0.11)])
    ball[30:60] += [30.0, 0.0, 0.0]
    overlap = np.zeros(count)
    overlap[45] = 0.25
    figures = measure_stretch(library, take, track, overlap, BallPath(times, ball, np.ones(count, bool)))
    report = build_player_report([figures])
    alone = evaluate(take, track, library)
    assert {name: report[name] for name in alone} == alone
    rows = report["per_second"]
    assert rows["start_s"] == 0 and len(rows["overlap_m"]) == int(times[-1] + 1e-6) + 1
    assert rows["overlap_m"][:3] == [0.0, 0.25, 0.0]
    assert rows["ball_m"][0] == pytest.approx(5.0) and rows["ball_m"][1] > 20.0
    known = [value for value in rows["root_error_m"] if value is not None]
    assert np.mean(known[: len(known) - 1]) == pytest.approx(alone["root_error_m"]["mean"], rel=0.3)


def test_seconds_between_stretches_are_empty(take):
    from dataclasses import replace

    later = replace(take, start_time=take.start_time + 40.0)
    count = len(take.motion)
    ball = BallPath(np.arange(2.0), np.full((2, 3), np.nan), np.zeros(2, bool))
    rows = join_seconds([
        measure_per_second(playback_from_take(one), take.plan.track, np.zeros(count), ball) for one in (take, later)
    ])  # fmt: skip
    there = [value is not None for value in rows["overlap_m"]]
    assert there[0] and there[40] and not there[30]
    assert rows["ball_m"] == [None] * len(there)
