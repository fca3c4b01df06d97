"""The page: one file with all in it, names escaped, figures beside their targets, pictures that show something."""

import base64
import html.parser
import re
import sys
from dataclasses import replace

import pytest

from beyond_mocap.annotation import KeyMoment, Span, Timeline
from beyond_mocap.base.errors import InputError
from beyond_mocap.cli import main as command
from beyond_mocap.evaluation.html import build_html_report, find_worst_frames
from beyond_mocap.evaluation.report import describe_figures, evaluate, evaluate_played
from beyond_mocap.evaluation.view import View
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion.motion import Motion
from beyond_mocap.synthesis.provenance import write_provenance
from beyond_mocap.synthesis.quality.playback import playback_from_tables, playback_from_take
from beyond_mocap.synthesis.quality.targets import KEY_TARGETS, TARGETS, Target, find_target

pytest.importorskip("matplotlib")

FPS = 30.0
TIMELINE = Timeline((Span(10.0, 16.0, ("jogging",)),), (KeyMoment(14.5, ("kick", "right")),))


@pytest.fixture(scope="module")
def take(cut):
    return replace(cut(("jog.bvh", 30, 220), ("walk.bvh", 100, 60, 1.0, True)), timeline=TIMELINE)


@pytest.fixture(scope="module")
def draw_page(take, track_of, library, still_ball):
    """draw_page() -> the page of the take, its track, ball and labels."""
    take = replace(take, ball=still_ball(take, (12.0, 0.3, 0.11)))
    track = track_of(take, ball=(12.0, 0.3, 0.11))
    report = evaluate(take, track, library)
    return lambda: build_html_report(
        playback_from_take(take), report, track=track, timeline=take.timeline, library=library, title="one & only"
    )


@pytest.fixture(scope="module")
def page(draw_page):
    return draw_page()


class Tags(html.parser.HTMLParser):
    """Every tag of a page and all its text."""

    def __init__(self, page: str):
        super().__init__()
        self.tags, self.text = [], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.text.append(data)


def pictures(page: str) -> list[bytes]:
    return [base64.b64decode(found) for found in re.findall(r"data:image/png;base64,([\w+/=]+)", page)]


def test_one_file_that_loads_and_runs_nothing(page):
    tags = Tags(page).tags
    assert len(page) < 3_000_000
    assert {tag for tag, _ in tags}.isdisjoint({"script", "link", "iframe"})
    sources = [attrs[name] for _, attrs in tags for name in ("src", "href") if name in attrs]
    assert sources and all(source.startswith("data:image/png;base64,") for source in sources)
    assert all(attrs.get("alt") for tag, attrs in tags if tag == "img")


def test_every_section_and_picture_is_there(page):
    text = "".join(Tags(page).text)
    for section in ("Over time", "Clips", "Labels", "Key moments", "Worst seconds", "All figures"):
        assert section in text
    assert "14.50 s: kick right" in text and "jog.bvh" in text and "one & only" in text
    shown = pictures(page)
    assert len(shown) >= 5  # curves, clips, words, a key moment, worst seconds
    assert all(picture.startswith(b"\x89PNG") and len(picture) > 3000 for picture in shown)


def test_figures_stand_beside_their_targets(page, take, track_of, library):
    rows = re.findall(r"<tr><td>([\w.]+)<td class=n>(.*?)<td class=n>(.*?)<td>(.*?)<td class=(\w+)>(\w*)</tr>", page)
    told = {name: rest for name, *rest in rows}
    assert {name for name, (*_, status) in told.items() if status} <= set(TARGETS)
    assert told["root_error_m.mean"][2] == "≤ 0.005"
    assert told["skate.contact_cm_s"][1] and "recordings" in told["skate.contact_cm_s"][2]
    assert told["warp_rate.min"][3:] == ["met", "met"]
    for leaf in KEY_TARGETS:
        assert leaf in page
    judged = re.search(r"(\d+) of (\d+) targets met", page)
    assert 0 < int(judged[1]) <= int(judged[2])


def test_what_the_eye_sees_is_readable(page):
    part = page[page.index("<h2>What the eye sees") : page.index("<h2>All figures")]
    text = "".join(Tags(part).text)
    for name in ("Snap turns, /min", "Unusual body language, %", "Heading off plan, 90 %, °", "Both feet down"):
        assert name in text
    assert "≤ 0.6" in text and "≥ 80" in text and " frames" in text
    assert "not known: the track stands nowhere for 1.5 s" in text
    assert "not known: nowhere two strides of steady running" in text
    assert "naturalness" not in text


def test_a_report_of_version_0_1_has_a_page(take, track_of, library):
    report = evaluate(take, track_of(take), library)
    for name in ("naturalness", "unknown", "notes", "jerk_ratio", "slow_root_error_m", "pose_realism_by_speed"):
        del report[name]
    page = build_html_report(playback_from_take(take), report, track=track_of(take), library=library)
    assert "All figures" in page and "What the eye sees" not in page
    assert describe_figures(report)[0].endswith("targets met")


def test_names_are_escaped(take, track_of, library):
    bad = '<script>alert("&")</script>$x^2'
    played = replace(playback_from_take(take), clips=tuple(f"{bad}{k}.bvh" for k in range(len(take.clips))))
    words = tuple((bad,) for _ in played.words)
    played = replace(played, words=words, keys=())
    timeline = Timeline((), (KeyMoment(14.5, (bad.lower(),)),))
    report = evaluate_played(played, timeline=timeline)
    report["warnings"] = [bad]
    page = build_html_report(played, report, timeline=timeline, title=bad)
    assert "<script" not in page.lower()
    assert page.count("&lt;script&gt;alert(&quot;&amp;&quot;)&lt;/script&gt;") >= 4


def test_a_bare_motion_has_a_page_too(take, tmp_path):
    played = playback_from_tables(take.motion)
    text = "".join(Tags(build_html_report(played, evaluate_played(played))).text)
    assert "unknown without provenance" in text and "All figures" in text


@pytest.mark.parametrize("count", [1, 2, 5])
def test_very_short_motions(take, count):
    played = playback_from_tables(take.motion.frames(0, count))
    assert "All figures" in build_html_report(played, evaluate_played(played))


def test_the_worst_second_is_found(take):
    root = take.motion.root_positions.copy()
    root[150] += [0.0, 0.0, 1.0]
    jolted = replace(take, motion=Motion(take.motion.skeleton, root, take.motion.rotations, FPS))
    worst = find_worst_frames(View(playback_from_take(jolted), None, None, None))
    assert abs(worst[0][0] - 150) <= 2 and "jolt" in worst[0][1]
    frames = [frame for frame, _ in worst]
    assert all(abs(a - b) >= FPS for i, a in enumerate(frames) for b in frames[:i])


def test_the_page_is_the_same_every_time(page, draw_page):
    assert draw_page() == page


@pytest.mark.parametrize(
    "target, flat, value, met",
    [
        (Target(most=0.1), {}, 0.1, True),
        (Target(most=0.1), {}, 0.11, False),
        (Target(least=0.85), {}, 0.8, False),
        (Target(own="own"), {"own": 3.0}, 2.9, True),
        (Target(own="own", beyond=0.5), {"own": 3.0}, 3.4, True),
        (Target(own="own"), {"own": None}, 1.0, None),
    ],
)
def test_targets(target, flat, value, met):
    assert target.is_met(value, flat) is met


def test_half_a_frame_is_the_target_of_a_key_s_time():
    assert find_target("keys 2.time_error_s", 30.0).is_met(0.0166, {})
    assert not find_target("keys 2.time_error_s", 30.0).is_met(-0.0168, {})
    assert find_target("keys 2.contact_gap_m", 30.0).most == 0.005
    assert find_target("frames", 30.0) is None


def test_without_matplotlib_one_line_says_what_to_do(take, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    played = playback_from_take(take)
    with pytest.raises(InputError, match="matplotlib cannot be imported.*extra 'plots'") as told:
        build_html_report(played, {"keys": []})
    assert "\n" not in str(told.value)


def test_evaluate_writes_the_page(take, tmp_path, monkeypatch, capsys):
    motion, provenance, report, page = (tmp_path / name for name in ("m.bvh", "p.csv", "r.json", "r.html"))
    bvh.write_bvh(motion, take.motion)
    write_provenance(provenance, take)
    options = ["evaluate", str(motion), "--provenance", str(provenance), "--report", str(report), "--html"]
    assert command.main([*options, str(page)]) == 0
    assert page.read_text(encoding="utf-8").startswith("<!DOCTYPE html>") and report.exists()
    assert command.main([*options, str(tmp_path / "none" / "r.html")]) == 2
    report.unlink()
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert command.main([*options, str(page)]) == 2
    assert "pip install" in capsys.readouterr().err and not report.exists()
