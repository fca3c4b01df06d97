"""Methods side by side: what the tables say is what the takes are, and what is said of them follows from figures."""

import html
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.evaluation.methods.comparison import choose_methods, compare_methods, measure_take
from beyond_mocap.evaluation.methods.report import build_comparison_page, build_comparison_report
from beyond_mocap.evaluation.methods.scenarios import check_labels, read_scenarios
from beyond_mocap.evaluation.methods.tables import build_tables, describe_differences, format_markdown
from beyond_mocap.evaluation.methods.thesis import THESIS
from beyond_mocap.evaluation.report import evaluate
from beyond_mocap.library.build import build_library
from beyond_mocap.motion.track import sample_track
from beyond_mocap.synthesis.search.blocks import SEARCH_MORE

METHODS = ("blocks", "fs", "baseline")


def write_track(path, speed, turn_rate=0.0):
    """Four seconds at a speed, m/s, turning by rad/s."""
    times = np.arange(0.0, 4.001, 0.04)
    steps = speed * 0.04 * np.stack([np.cos(turn_rate * times), np.sin(turn_rate * times)], axis=1)
    rows = np.column_stack([times, np.cumsum(steps, axis=0)])
    path.write_text("time_s,x_m,y_m\n" + "\n".join(",".join(f"{v:.4f}" for v in row) for row in rows) + "\n")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("scenarios")
    write_track(place / "scenario1_track.csv", 1.4)
    (place / "scenario1_annotations.txt").write_text("0 1 walking\n2 kick right\n")
    write_track(place / "turn.csv", 2.6, 0.3)
    (place / "events.csv").write_text("time,event\n1,kick\n")
    return place


@pytest.fixture(scope="module")
def comparison(folder, clips_folder):
    library = build_library(clips_folder)
    return library, compare_methods(library, read_scenarios(folder, 30.0)[0], METHODS, 30.0)


def test_scenarios_are_tracks_with_their_labels(folder):
    scenarios, notes = read_scenarios(folder, 30.0)
    assert [scenario.name for scenario in scenarios] == ["scenario1", "turn"]
    assert len(scenarios[0].timeline.keys) == 1 and not scenarios[1].timeline.keys
    assert [line.rpartition("/")[2].split(":")[0] for line in notes] == ["events.csv", "turn.csv"]


def test_a_name_alone_makes_no_scenario_of_the_thesis(folder):
    assert not any(scenario.thesis for scenario in read_scenarios(folder, 30.0)[0]) and len(THESIS) == 5


def test_the_tables_have_the_figures_of_the_reports(comparison):
    library, found = comparison
    distance, similarity, *_ = build_tables(found)
    for row, method in zip(distance.rows, METHODS):
        reports = [evaluate(found.results[s.name, method].take, s.track, library) for s in found.scenarios]
        off = [report["pelvis_error_m"]["mean"] for report in reports]
        assert row[0] == method and [cell.split(" / ")[0] for cell in row[1:]] == [
            f"{value:.2f}" for value in (*off, np.mean(off))]  # fmt: skip
    assert all(row[2].split(" / ")[1].startswith("–") for row in similarity.rows)  # no key moment in "turn"


def test_all_methods_are_measured_by_the_labels_of_the_scenario_alone(comparison):
    _, found = comparison
    for method in METHODS:
        result = found.results["scenario1", method]
        first = result.take.words[:30]  # up to 1 s
        met = np.mean(["walking" in words for words in first])
        assert result.figures["annotation_similarity"]["asked"] == pytest.approx(1.0 - 2.0 * met)
    similarity = build_tables(found)[1]
    assert all(row[2].endswith("(– / –)") for row in similarity.rows)  # "turn" asks for nothing


def test_labels_that_no_recording_carries_count_for_no_method(comparison, timeline_of):
    library, found = comparison
    take = found.results["turn", "baseline"].take
    asked, unknown, both = (
        measure_take(take, library, timeline_of((0.0, 2.0, words)), 1.0).figures["annotation_similarity"]["asked"]
        for words in ("running", "dribble", "dribble running"))
    assert np.isnan(unknown) and both == asked


def test_key_labels_that_no_recording_carries_count_for_no_method(folder, clip_file, tmp_path):
    clip_file(tmp_path / "walk.bvh", 1.4, 4.0)
    scenario = read_scenarios(folder, 30.0)[0][0]
    found = compare_methods(build_library(tmp_path), [scenario], ("blocks", "baseline"), 30.0)
    kick = found.results["scenario1", "blocks"].figures["annotation_similarity"]
    assert kick["keys"] == 1.0 and np.isnan(kick["asked_keys"])
    assert not any(line.startswith("Labels at key moments") for line in describe_differences(found))
    assert all(row[1].endswith(" / –)") for row in build_tables(found)[1].rows)


def test_key_labels_of_recordings_count_for_each_method(comparison):
    _, found = comparison
    shown = [found.results["scenario1", method].figures["annotation_similarity"]["asked_keys"] for method in METHODS]
    assert shown == [-1.0, -1.0, 1.0]


def test_what_is_noted_of_scenarios_is_in_every_report(comparison):
    pytest.importorskip("matplotlib")
    _, found = comparison
    noted = replace(found, notes=["turn.csv: no labels beside it"])
    assert build_comparison_report(noted)["notes"] == ["turn.csv: no labels beside it"]
    for text in ("\n".join(format_markdown(noted)), build_comparison_page(noted)):
        assert "turn.csv: no labels beside it" in text


def test_no_setting_that_a_comparison_lacks_is_advised(comparison):
    _, found = comparison
    line = f"the 500 nearest in labels were; {SEARCH_MORE}"
    results = {place: replace(result, take=replace(result.take, warnings=(line,)))
               for place, result in found.results.items()}
    text = "\n".join(format_markdown(replace(found, results=results)))
    assert "all takes: the 500 nearest in labels were\n" in text and SEARCH_MORE not in text
    assert "`blocks` compared no more than 500 blocks at once in 2 of 2 takes: the library has more" in text


def test_what_is_said_follows_from_the_figures(comparison):
    _, found = comparison
    first = describe_differences(found)[0]
    assert first.startswith("Distance from the track, least first: ") and first.index("fs") < first.index("blocks")
    off = np.linalg.norm(found.results["turn", "fs"].take.motion.root_positions[:, :2]
                         - sample_track(found.scenarios[1].track, 30.0).positions, axis=1)
    assert off.mean() < 0.1
    text = "\n".join(format_markdown(found))
    assert all(f"| {method} |" in text for method in METHODS) and "Faustino's thesis" not in text
    assert "- `blocks`, `fs`: motion that the library leaves out of locomotion is played like any other" in text


def test_the_page_has_a_curve_of_every_scenario_and_the_report_every_figure(comparison):
    pytest.importorskip("matplotlib")
    _, found = comparison
    assert build_comparison_page(found).count("data:image/png") == len(found.scenarios)
    report = build_comparison_report(found)
    take = report["takes"]["scenario1"]["fs"]
    assert len(take["smoothness_m"]) == len(found.results["scenario1", "fs"].take.motion) - 1
    warnings = report["takes"]["scenario1"]["baseline"]["warnings"]
    assert any("key moment" in line for line in warnings)
    for text in ("\n".join(format_markdown(found)), build_comparison_page(found)):
        assert "Warnings" in text and all(line in html.unescape(text) for line in warnings)


def test_one_method_alone_has_no_section_on_how_it_differs(comparison):
    pytest.importorskip("matplotlib")
    _, found = comparison
    alone = replace(found, methods=("fs",), results={place: result for place, result in found.results.items()
                                                     if place[1] == "fs"})
    assert "How they differ" not in build_comparison_page(alone)
    assert "How they differ" not in "\n".join(format_markdown(alone))


@pytest.mark.parametrize("text, found", [
    ("", "no method"), ("path,magic", "'magic'; expected .*; correct the name"), ("fs, path,fs", "fs twice"),
])
def test_methods_that_nobody_has_are_refused(text, found):
    with pytest.raises(InputError, match=found):
        choose_methods(text)


def test_odd_tables_are_no_tracks_and_two_tracks_are_not_one_scenario(tmp_path):
    write_track(tmp_path / "run.CSV", 3.0)
    (tmp_path / "old.csv").write_text("time_s,x_m,y_m\n0,0,0\n0.1,1,0\n".replace("\n", "\r"), newline="")
    (tmp_path / "wide.csv").write_bytes((tmp_path / "run.CSV").read_text().encode("utf-16"))
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfet\x00i")
    (tmp_path / "folder.csv").mkdir()
    scenarios, notes = read_scenarios(tmp_path, 30.0)
    assert {"run", "wide"} <= {scenario.name for scenario in scenarios}
    assert any("bytes.csv: not a track" in line for line in notes)
    write_track(tmp_path / "run_track.csv", 2.0)
    with pytest.raises(InputError, match="run_track.csv: has the name of run.CSV"):
        read_scenarios(tmp_path, 30.0)


def test_a_track_with_semicolons_is_no_table_that_is_left_out(tmp_path):
    (tmp_path / "run.csv").write_text("time_s;x_m;y_m\n0;0;0\n")
    with pytest.raises(InputError, match="run.csv:1: .*semicolons"):
        read_scenarios(tmp_path, 30.0)


@pytest.mark.parametrize("text, found", [("2 kik right", "kik"), ("99 kick right", "99")])
def test_labels_are_checked_as_synthesize_does(tmp_path, text, found):
    write_track(tmp_path / "a.csv", 2.0)
    (tmp_path / "a.txt").write_text(text + "\n")
    scenarios, _ = read_scenarios(tmp_path, 30.0)
    with pytest.raises(InputError, match=found):
        check_labels(scenarios, ())
