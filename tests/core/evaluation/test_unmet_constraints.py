"""What gave way is told with its seconds, and only that."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation import KeyMoment, Span, Timeline
from beyond_mocap.evaluation.report import evaluate
from beyond_mocap.library.clip import SYNTHETIC_FOLDER
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.quality.playback import playback_from_take
from beyond_mocap.synthesis.quality.shown_speeds import explain_shown_speeds
from beyond_mocap.synthesis.quality.unmet_constraints import format_stretches, report_jolts, report_unmet_constraints


@pytest.fixture()
def told(library):
    """told(take, **more) -> the lines about a take from the made library."""
    return lambda take, **more: report_unmet_constraints(playback_from_take(take), library=library, **more)


@pytest.fixture()
def jog(cut):
    return cut(("jog.bvh", 0, 241))


def test_where_all_holds_nothing_is_told(jog, told, track_of):
    assert told(jog, track=track_of(jog), timeline=Timeline(), ik_miss=np.zeros((241, 2))) == []


@pytest.mark.parametrize("spans, text", [
    ([(12, 18)], "0.4-0.6 s"),
    ([(12, 18), (24, 30)], "0.4-1.0 s"),
    ([(12, 18), (60, 61)], "0.4-0.6, 2.0 s"),
    ([(i * 30, i * 30 + 2 + i) for i in range(8)],
     "2.0-2.1, 3.0-3.1, 4.0-4.2, 5.0-5.2, 6.0-6.2, 7.0-7.3 s and 2 shorter"),
])
def test_stretches_are_joined_and_the_longest_named(spans, text):
    flags = np.zeros(300, bool)
    for low, high in spans:
        flags[low:high] = True
    assert format_stretches(np.arange(300) / 30.0, flags) == text


def test_a_planted_warp_is_told_with_its_seconds(cut, told):
    lines = told(cut(("jog.bvh", 0, 60), ("walk.bvh", 0, 60, 1.25), ("jog.bvh", 240, 60)))
    assert lines[0].startswith("12.0-13.9 s: clips are played at 1.00 to 1.25 times")


def test_a_foot_that_is_dragged_is_told(jog, told):
    places = jog.motion.root_positions.copy()
    places[100:104, 0] += [0.05, 0.1, 0.1, 0.05]
    lines = told(replace(jog, motion=replace(jog.motion, root_positions=places)))
    assert len(lines) == 1 and lines[0].startswith("13.") and "slides" in lines[0]


def test_a_short_leg_is_told(jog, told):
    miss = np.zeros((241, 2))
    miss[30:45, 1] = 0.021
    line = "11.0-11.5 s: a leg is up to 2.1 cm too short to reach the place of its foot"
    assert told(jog, ik_miss=miss) == [line]


def test_off_the_track_is_told(jog, told, track_of):
    (line,) = told(jog, track=track_of(jog, shift=(0.0, 0.3)))
    assert line == "10.0-18.0 s: the body is off the track by up to 0.30 m"


def test_the_run_up_of_a_synthetic_kick_is_no_kick(jog, told):
    made = replace(jog, clips=(f"{SYNTHETIC_FOLDER}kick_low_top_2.4_+30.bvh",), words=(("jogging",),) * len(jog.clip))
    assert [line.split(": ", 1)[1][:10] for line in told(made)] == ["run-up of "]
    kicked = replace(made, words=(*made.words[:200], *[("kick", "low")] * (len(made.words) - 200)))
    assert [line.split(": ", 1)[1][:14] for line in told(kicked)] == ["synthetic kick"]


def test_a_track_faster_than_the_library_is_told_but_not_where_running_is_made(jog, told):
    times = np.arange(10.0, 18.1, 0.04)
    fast = Track(times, np.stack([8.0 * (times - 10.0), 0 * times], axis=-1))
    (line,) = [line for line in told(jog, track=fast) if "faster than the library" in line]
    assert line.startswith("10.0-18.0 s: the track reaches 8.0 m/s")
    made = replace(jog, clips=(f"{SYNTHETIC_FOLDER}steady_8.bvh",))
    lines = told(made, track=fast)
    assert not any("faster than the library" in line for line in lines)
    assert any(line.startswith("10.0-18.0 s (8.0 s in all): ")
               and line.endswith("; synthetic running is shown") for line in lines)


def test_synthetic_locomotion_is_explained_by_the_speeds_at_which_it_is_shown(library):
    """Gaps lie around 2 m/s and above 5.6 m/s."""
    speed, fps, running = np.repeat([2.0, 2.8, 2.1, 2.8, 8.0], [60, 8, 40, 60, 30]), 30.0, "synthetic running is shown"
    there = np.arange(len(speed)) < 168
    (lacking, why), (other, otherwise) = explain_shown_speeds(library, there, speed, fps, running)
    assert lacking[:108].all() and not lacking[108:].any() and np.array_equal(other, there & ~lacking)
    assert why == f"hardly any locomotion at 2.0 to 2.1 m/s: add some; until then {running}"
    assert otherwise == f"no recording fits as well at 2.8 m/s; {running}"
    (_, both), = explain_shown_speeds(library, speed != 2.8, speed, fps, running)
    assert both.startswith("hardly any locomotion at 2.0 to 2.1 and 8.0 m/s: ")
    strange = replace(library)
    vars(strange).update(coverage=library.coverage, strangeness=np.full(len(library.frames), 2.0))
    (_, left_out), = explain_shown_speeds(strange, speed == 2.8, speed, fps, running)
    assert left_out == f"the recordings at 2.8 m/s are left out of locomotion, as the library's lines say; {running}"


def test_key_moments_late_or_out_of_reach_are_told(cut, told, still_ball):
    # source frame 300 of a 60 fps clip, begun at 150, is played 2.5 s after the start at 10 s
    asked = KeyMoment(12.4, ("kick", "right"))
    take = cut(("jog.bvh", 150, 150), requested=(asked,))
    take = replace(take, ball=still_ball(take, (0.0, 9.0, 0.11)))
    late, far = told(take, timeline=take.timeline)
    assert late == "key moments are not at their time: 12.4 s by +0.10 s"
    assert far.startswith("the body does not reach the ball at key moments: 12.4 s by ")
    away = np.linalg.norm(take.motion.root_positions[72, :2] - [0.0, 9.0])
    assert float(far.rpartition("by ")[2].removesuffix(" m")) == pytest.approx(away, abs=1.5)


def test_words_that_are_not_shown_are_told_but_for_key_moments_and_what_nobody_has(cut, told):
    spans = (Span(10.0, 14.0, ("jogging",)), Span(14.0, 18.0, ("walking", "header")))
    key = KeyMoment(12.5, ("kick", "right"))
    take = cut(("jog.bvh", 150, 180), ("walk.bvh", 0, 60), timeline=Timeline(spans, (key,)))
    (line,) = [line for line in told(take, timeline=take.timeline) if "labels" in line]
    assert line == "14.0-16.0 s: requested labels that are not shown: walking"
    assert not any("labels" in line for line in told(take, timeline=take.timeline, user_timeline=Timeline()))


def test_a_body_in_the_ground_is_told(jog, told):
    places = jog.motion.root_positions.copy()
    places[60:91, 2] -= 0.2
    (line,) = [
        line for line in told(replace(jog, motion=replace(jog.motion, root_positions=places))) if "ground" in line
    ]
    assert line.startswith("12.0-13.0 s: ")


def test_jolts_are_told_in_the_report(cut, track_of, library):
    rough = cut(("jog.bvh", 0, 120), ("walk.bvh", 13, 120))
    told = [line for line in evaluate(rough, track_of(rough), library)["warnings"] if "jolt" in line]
    assert len(told) == 1 and told[0].startswith("13.7-14.3 s: ")
    assert report_jolts(np.arange(100.0), np.zeros(100, bool), 1.29) is None


def test_every_line_carries_its_seconds(cut, told, library, track_of):
    take = cut(("jog.bvh", 0, 60), ("walk.bvh", 0, 60, 1.25), ("jog.bvh", 240, 60))
    line = told(take)[0]
    assert [(round(a, 1), round(b, 1)) for a, b in line.spans] == [(12.0, 13.9)]
    report = evaluate(take, track_of(take, shift=(0.5, 0.0)), library)
    assert len(report["warning_seconds"]) == len(report["warnings"]) > 1
    assert all(first <= last for spans in report["warning_seconds"] for first, last in spans)
    assert report["warning_seconds"][[line.split(":")[0] for line in report["warnings"]].index("12.0-13.9 s")] == [
        [12.0, 13.933]
    ]
