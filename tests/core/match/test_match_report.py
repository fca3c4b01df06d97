"""The page over a match: a planted folder comes out as figures, its worst seconds first, whatever is missing."""

import base64
import json
import re
import struct
import zlib
from html.parser import HTMLParser

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.match.report.page import build_match_page
from beyond_mocap.match.report.pictures import compute_colours, render_heat_strip
from beyond_mocap.match.report.results import LIMITS, find_worst_seconds, read_match_results

SECONDS, FIRST = 60, 100.0


def report(**changed):
    """A player's report: all is well in each of 60 seconds from 100 s on."""
    quiet = {"start_s": FIRST, "root_error_m": [0.002] * SECONDS, "skate_cm_s": [2.0] * SECONDS,
             "overlap_m": [0.0] * SECONDS, "ball_m": [20.0] * SECONDS}
    return {"fps": 30.0, "root_error_m": {"mean": 0.0021, "p95": 0.004, "max": 0.008},
            "skate": {"contact_cm_s": 1.9, "source_contact_cm_s": 2.0, "stances_over_21mm": 0.01},
            "loop_share": 0.011, "time_lost_s": 1.5, "warnings": [], "per_second": {**quiet, **changed}}


def column(quiet, **bad):
    """60 values, `bad` at their seconds ("s7" is row 7)."""
    values = [quiet] * SECONDS
    for name, value in bad.items():
        values[int(name[1:])] = value
    return values


def written(folder, reports, **changed):
    """A folder with these reports by player id; None: he failed."""
    players = [
        {"id": name, "file": f"file-{name}", "name": f"Player <{name}>", "number": 7 + order,
         "team": "home" if order % 2 == 0 else "away",
         **({"status": "done"} if one else {"status": "failed", "reason": "no <bones> & no luck"})}
        for order, (name, one) in enumerate(reports.items())
    ]
    match = {
        "version": 1, "status": "done", "fps": 30.0, "from_s": FIRST, "to_s": FIRST + SECONDS, "players": players,
        "teams": [{"ground": "home", "name": "A & B", "colour": "#d02020"},
                  {"ground": "away", "name": "Öst", "colour": "red"}],
        "seconds": {"search": 12.34}, "data": ["ball <measured> in 80 %"], **changed,
    }
    (folder / "match.json").write_text(json.dumps(match), "utf-8")
    for name, one in reports.items():
        if one:
            (folder / f"file-{name}.report.json").write_text(json.dumps(one), "utf-8")
    return folder


class Tags(HTMLParser):
    """All tags, ids and inner links of a page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.ids, self.links, self.outside = [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        for name, value in attrs:
            if name == "id":
                self.ids.append(value)
            elif name == "href":
                (self.links if value.startswith("#") else self.outside).append(value)
            elif name == "src" and not value.startswith("data:"):
                self.outside.append(value)


def test_planted_bad_seconds_come_first_and_in_order(tmp_path):
    reports = {
        "a": report(root_error_m=column(0.002, s10=0.30)),
        "b": report(skate_cm_s=column(2.0, s40=70.0)),
        "c": report(root_error_m=column(0.002, s20=0.045, s21=0.040, s22=0.016)),
    }
    found = find_worst_seconds(read_match_results(written(tmp_path, reports)).players)
    assert [(one.player.id, one.time, one.figure) for one in found] == [
        ("a", 110.0, "root_error_m"), ("b", 140.0, "skate_cm_s"), ("c", 120.0, "root_error_m"),
    ]
    assert [round(one.times, 6) for one in found] == [20.0, 10.0, 3.0]


def test_two_bodies_in_each_other_are_one_second_of_both(tmp_path):
    deep = {"overlap_m": column(0.0, s30=0.08)}
    folder = written(tmp_path, {"a": report(**deep), "b": report(), "c": report(**deep)})
    found = find_worst_seconds(read_match_results(folder).players)
    assert [(one.player.id, one.other.id, one.value) for one in found] == [("a", "c", 0.08)]


def test_at_most_ten_and_none_within_the_limits(tmp_path):
    busy = report(root_error_m=column(0.002, **{f"s{row}": 0.03 + 0.001 * row for row in range(0, 60, 4)}))
    assert len(find_worst_seconds(read_match_results(written(tmp_path, {"a": busy})).players)) == 10
    edge = report(root_error_m=[LIMITS["root_error_m"]] * SECONDS)
    assert find_worst_seconds(read_match_results(written(tmp_path, {"a": edge})).players) == ()


def test_the_page_tells_who_when_and_which_frame(tmp_path):
    folder = written(tmp_path, {"a": report(root_error_m=column(0.002, s10=0.30)), "b": report()})
    text = build_match_page(folder)
    assert "110 s (1:50)" in text and "frame 300" in text
    assert "30.0 cm off the track" in text and "ball 20.0 m away" in text
    assert "bpy.ops.beyond_mocap.match_second(seconds=110, player=&#x27;a&#x27;)" in text
    assert "2 of 2 players finished" in text and "Partial" not in text
    assert "0.21" in text and "12.3 s" in text and "ball &lt;measured&gt; in 80 %" in text


@pytest.mark.parametrize("start, frame", [(FIRST, 210), (FIRST + 0.01, 209), (FIRST + 7.9, 0)])
def test_frames_count_from_the_first_on_the_clocks_grid(tmp_path, start, frame):
    """Second 107 begins with frame 3210 of the clock; 100.01 s lie between its frames 3000 and 3001."""
    text = build_match_page(written(tmp_path, {"a": report(root_error_m=column(0.002, s7=0.08))}, from_s=start))
    assert f"</b>, frame {frame}:" in text


def test_nothing_is_loaded_all_is_escaped_and_links_lead_somewhere(tmp_path):
    reports = {name: report(root_error_m=column(0.002, s10=0.1)) for name in ("a", "b", "c")}
    reports["c"]["warnings"] = ["<script>alert(1)</script>"]
    text = build_match_page(written(tmp_path, reports))
    tags = Tags(text)
    assert "script" not in tags.tags and tags.outside == [] and "url(" not in text and "@import" not in text
    assert set(tags.links) <= {f"#{name}" for name in tags.ids} and len(tags.ids) == len(set(tags.ids))
    assert "Player &lt;a&gt;" in text and "A &amp; B" in text and "#d02020" in text and "background:red" not in text


def test_failed_and_unreadable_players_are_marked_and_the_rest_is_told(tmp_path):
    folder = written(tmp_path, {"a": report(), "b": None, "c": report(), "d": report()})
    (folder / "file-c.report.json").write_text('{"fps": 30.0, "per_sec', "utf-8")
    (folder / "file-d.report.json").unlink()
    text = build_match_page(folder)
    assert "1 of 4 players finished" in text and "Partial: 3 not finished" in text
    assert "no &lt;bones&gt; &amp; no luck" in text and "cannot be read" in text
    assert "file-d.report.json is missing" in text


@pytest.mark.parametrize("damage", [{"fps": "fast"}, {"skate": {"gmd_ratio": 0.3, "source_gmd_ratio": "x"}},
                                    {"notes": 3}])
def test_figures_of_another_form_are_those_of_one_player(tmp_path, damage):
    folder = written(tmp_path, {"a": report(), "b": {**report(), **damage}})
    found = read_match_results(folder).players
    assert [one.is_finished for one in found] == [True, False] and "figures in another form" in found[1].reason
    assert "1 of 2 players finished" in build_match_page(folder)


def test_what_all_reports_say_is_told_once_and_not_counted(tmp_path):
    reports = {name: report() for name in ("a", "b", "c")}
    for name, one in reports.items():
        one["warnings"] = ["unit guessed", f"only {name} slides"]
    text = build_match_page(written(tmp_path, reports))
    assert text.count("unit guessed") == 1 and all(text.count(f"only {name} slides") == 1 for name in reports)


def test_a_player_who_comes_late_and_unknown_values(tmp_path):
    late = {"start_s": FIRST + 50.0, "root_error_m": [0.002, None, 0.09], "skate_cm_s": [1.0], "overlap_m": "none"}
    one = {**report(), "per_second": late}
    found = find_worst_seconds(read_match_results(written(tmp_path, {"a": one})).players)
    assert [(second.time, second.value) for second in found] == [(152.0, 0.09)]
    assert "152 s" in build_match_page(tmp_path)
    nobody = {"id": "b", "number": -1, "status": "failed: no track"}
    assert ">b<" in build_match_page(written(tmp_path, {"a": one}, players=[nobody]))


@pytest.mark.parametrize("changed", [{"to_s": 1e12}, {"to_s": 10**400}, {"from_s": -1e300}])
def test_seconds_that_no_match_has_do_not_stop_the_page(tmp_path, changed):
    text = build_match_page(written(tmp_path, {"a": report(root_error_m=column(0.002, s7=0.08))}, **changed))
    assert "1 of 1 players finished" in text and "8.0 cm off the track" in text


@pytest.mark.parametrize("changed, told", [
    ({"warnings": 5}, "its warnings are no list"), ({"warnings": None}, "its warnings are no list"),
    ({"skate": json.loads('{"a":' * 900 + "1" + "}" * 900)}, "nested more than 30 levels deep"),
    ({"root_error_m": {"mean": 10**400}}, ""), ({"per_second": {"start_s": 1e300, "root_error_m": [1.0]}}, ""),
])
def test_odd_values_of_one_player_touch_nobody_else(tmp_path, changed, told):
    folder = written(tmp_path, {"a": {**report(), **changed}, "b": report(root_error_m=column(0.002, s7=0.08))})
    text = build_match_page(folder)
    assert told in text and f"{1 if told else 2} of 2 players finished" in text and "8.0 cm off the track" in text


@pytest.mark.parametrize("told", ["", "[]", "{\"players\": 3}", "{\"players\": [{\"name\": \"x\"}]}", "{", "\xff",
                                  '{"title": ' + "[" * 900 + "]" * 900 + "}"])  # fmt: skip
def test_a_broken_match_json_is_told_in_one_line(tmp_path, told):
    (tmp_path / "match.json").write_text(told, "latin-1")
    with pytest.raises(InputError, match="match.json") as caught:
        build_match_page(tmp_path)
    assert "\n" not in str(caught.value)


def test_an_empty_folder_and_an_empty_match(tmp_path):
    with pytest.raises(InputError, match="match.json"):
        build_match_page(tmp_path)
    (tmp_path / "match.json").write_text('{"players": []}', "utf-8")
    assert "0 of 0 players finished" in build_match_page(tmp_path)


def test_what_the_eye_sees_has_a_table_of_its_own(tmp_path):
    """Spins of 3.0 and 0.1 a minute: mean 1.6, worst 3.0; both feet down 90 and 40 %: worst is the least."""
    seen = [{"spins_per_min": spins, "dwell_s_median": dwell, "standing": {"both_down": down}}
            for spins, dwell, down in ((3.0, 1.25, 0.9), (0.1, 2.5, 0.4))]
    text = build_match_page(written(tmp_path, {"a": {**report(), "naturalness": seen[0]}, "b": report(),
                                               "c": {**report(), "naturalness": seen[1]}}))  # fmt: skip
    assert text.count("What the eye sees") == 1  # player b is of the other team, with a report of version 0.1
    cells = [re.findall(r"<td class=(?:n|&quot;|\"|'|[^>])*>([\d.–]+)", row) for row in text.split("<tr")
             if "mean<" in row or "worst<" in row]
    assert ["–", "1.6", "–", "–", "–", "–", "1.9", "–", "–", "–", "–", "–", "65"] in cells
    assert ["–", "3.0", "–", "–", "–", "–", "1.2", "–", "–", "–", "–", "–", "40"] in cells
    assert "What the eye sees" not in build_match_page(written(tmp_path, {"a": report(), "c": report()}))


def test_physics_has_a_table_of_its_own(tmp_path):
    """Falls of -9.0 and -13.0 m/s²: mean -11.0, worst -13.0, which is farther from -9.81."""
    seen = [{"flight": {"4-6": {"vertical_m_s2_median": fall}}, "boots": {"below_share": share}}
            for fall, share in ((-9.0, 0.4), (-13.0, 0.02))]
    text = build_match_page(written(tmp_path, {"a": {**report(), "physics": seen[0]}, "b": report(),
                                               "c": {**report(), "physics": seen[1]}}))  # fmt: skip
    assert text.count("<h3>Physics") == 1
    cells = [re.findall(r"<td class=[^>]*>(-?[\d.–]+)", row) for row in text.split("<tr")
             if "mean<" in row or "worst<" in row]
    assert ["–", "-11.0", "–", "–", "–", "–", "–", "–", "–", "21"] in cells
    assert ["–", "-13.0", "–", "–", "–", "–", "–", "–", "–", "40"] in cells


def test_touches_have_a_table_of_their_own(tmp_path):
    """Feet of 2.0 and 7.0 m/s at receptions: mean 4.5, worst 7.0; the ball inside a body in 0 and 41 frames."""
    seen = [{"reception": {"receptions": count, "speed_m_s_median": speed}, "ball_inside": {"inside_frames": inside}}
            for count, speed, inside in ((1, 2.0, 0), (3, 7.0, 41))]
    text = build_match_page(written(tmp_path, {"a": {**report(), "touches": seen[0]}, "b": report(),
                                               "c": {**report(), "touches": seen[1]}}))  # fmt: skip
    assert text.count("At the ball") == 1
    cells = [re.findall(r"<td class=[^>]*>([\d.–]+)", row) for row in text.split("<tr")
             if "mean<" in row or "worst<" in row]
    assert ["2", "4.5", "–", "–", "–", "–", "–", "–", "–", "20", "–", "–"] in cells
    assert ["3", "7.0", "–", "–", "–", "–", "–", "–", "–", "41", "–", "–"] in cells


def test_reports_without_seconds_still_make_a_page(tmp_path):
    one = report()
    del one["per_second"]
    assert "No report has figures by the second" in build_match_page(written(tmp_path, {"a": one, "b": {"version": 1}}))


def test_a_thumbnail_is_asked_for_each_worst_second_and_shown_the_right_way_up(tmp_path):
    asked = []

    def draw(player, time):
        asked.append((player, time))
        pose = np.zeros((4, 4, 4))
        pose[0] = (1.0, 0.0, 0.0, 1.0)  # the lowest row
        return pose

    text = build_match_page(written(tmp_path, {"a": report(root_error_m=column(0.002, s10=0.3)), "b": report()}), draw)
    assert asked == [("a", 110.5)] and text.count("class=pose") == 1
    data = base64.b64decode(text.split("class=pose")[1].split("base64,")[1].split('"')[0])
    assert decoded(data)[-1, 0].tolist() == [255, 0, 0, 255] and decoded(data)[0, 0].tolist() == [0, 0, 0, 0]


def decoded(data):
    """The pixels of a PNG that has rows without filter."""
    wide, high, _, kind = struct.unpack(">IIBB", data[16:26])
    length = struct.unpack(">I", data[33:37])[0]
    rows = np.frombuffer(zlib.decompress(data[41 : 41 + length]), np.uint8).reshape(high, -1)
    assert not rows[:, 0].any()
    return rows[:, 1:].reshape(high, wide, 3 if kind == 2 else 4)


def test_a_strip_shows_the_worst_of_each_cell():
    bad = np.full(2700, 0.2)
    bad[1234] = 5.0
    bad[300:320] = np.nan
    row = decoded(render_heat_strip(bad, 0.0, (0.0, 2700.0)))[0]
    assert row.shape == (900, 3)
    assert row[1234 // 3].tolist() == compute_colours(np.array(5.0)).tolist()
    assert row[303 // 3].tolist() == compute_colours(np.array(np.nan)).tolist()
    assert row[0].tolist() == compute_colours(np.array(0.2)).tolist()


def test_a_strip_leaves_out_what_lies_beyond_its_span():
    row = decoded(render_heat_strip(np.full(10, 5.0), 95.0, (100.0, 120.0)))[0]
    assert (row[:5] == compute_colours(np.array(5.0))).all() and (row[5:] == compute_colours(np.array(np.nan))).all()
