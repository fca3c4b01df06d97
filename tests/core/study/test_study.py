"""A study from table to analysis: orders that are fair, answers that come back, effects that were planted."""

import json
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.main import main
from beyond_mocap.study.analysis import adjust_holm, analyse_study, compute_cliffs_delta, compute_welch_p
from beyond_mocap.study.answers import read_answers
from beyond_mocap.study.form import build_form_page, build_form_table, list_questions
from beyond_mocap.study.order import Clip, build_study, read_study, write_study
from beyond_mocap.study.page import build_study_page, place_bar

SYSTEMS, SCENARIOS = ("ours", "skating", "theirs"), ("s1", "s2", "s3", "s4", "s5")
CLIPS = (
    Clip("good.mp4", "training", ""), Clip("bad.mp4", "training", ""),
    *(Clip(f"{system}/{scenario}.mp4", system, scenario) for scenario in SCENARIOS for system in SYSTEMS),
)  # fmt: skip


def clip_of(study, name):
    return next(clip for clip in study.clips if clip.name == name)


def planted(folder, study, shifts, seed=1, skip=()):
    """Answers of all raters to a study of ratings: a taste of his own, the system's shift and noise, rounded."""
    rng = np.random.default_rng(seed)
    folder.mkdir(exist_ok=True)
    for rater in study.orders:
        taste = rng.normal(3.0, 0.4)
        lines = ["study,rater,question,answer", f"{study.id},{rater},age,25-34", f"{study.id},{rater},characters,daily"]
        for (name,) in study.orders[rater]:
            shift = shifts.get(clip_of(study, name).system, 0.0)
            mark = int(np.clip(round(taste + shift + rng.normal(0.0, 0.7)), 1, 5))
            if name not in skip:
                lines.append(f"{study.id},{rater},{name},{mark}")
        (folder / f"{rater}.csv").write_text("\n".join(lines) + "\n", "utf-8")
    return read_answers(study, [folder])


def test_names_are_neutral_and_training_comes_first():
    study = build_study(CLIPS, 12, seed=3)
    assert len({clip.name for clip in study.clips}) == 17
    for clip in study.clips:
        assert len(clip.name) == 4 and not set(clip.name) & set("aeiou01loi")
    for order in study.orders.values():
        assert {name for (name,) in order[:2]} == set(study.training)
        assert sorted(name for (name,) in order) == sorted(clip.name for clip in study.clips)
    assert len(set(study.orders.values())) == 12


def test_orders_are_the_same_again_and_stay_when_raters_are_added():
    study, more = build_study(CLIPS, 5, seed=3), build_study(CLIPS, 9, seed=3)
    assert study == build_study(CLIPS, 5, seed=3)
    assert list(study.orders.items()) == list(more.orders.items())[:5] and study.id == more.id
    assert build_study(CLIPS, 5, seed=4).orders != study.orders and build_study(CLIPS, 5, seed=4).id != study.id


def test_no_system_has_a_better_place_in_the_order():
    study = build_study(CLIPS, 400, seed=0)
    places = {system: [] for system in SYSTEMS}
    for order in study.orders.values():
        for place, (name,) in enumerate(order[2:]):
            places[clip_of(study, name).system].append(place)
    for values in places.values():  # mean of 15 places is 7, of 2000 draws to within 4 standard errors
        assert abs(np.mean(values) - 7.0) < 4.0 * 4.32 / np.sqrt(2000)


def test_pairs_are_of_one_scenario_and_each_comes_once_either_way_round():
    study = build_study(CLIPS, 40, seed=1, pairs=True)
    left = 0
    for order in study.orders.values():
        assert set(order[0]) == set(study.training) and len(order) == 1 + 15
        assert len({frozenset(shown) for shown in order}) == 16
        for shown in order[1:]:
            first, second = (clip_of(study, name) for name in shown)
            assert first.scenario == second.scenario and first.system != second.system
            left += SYSTEMS.index(first.system) < SYSTEMS.index(second.system)
    assert abs(left - 300) < 60


@pytest.mark.parametrize("clips, words", [
    (CLIPS[1:], "1 clip of the system 'training'"),
    (CLIPS[:-1], "0 clips of scenario 's5' by 'theirs'"),
    ((*CLIPS, Clip("x.mp4", "ours", "s1")), "2 clips of scenario 's1' by 'ours'"),
    (CLIPS[:2] + CLIPS[2::3], "1 system"),
    ((*CLIPS[:-1], Clip("good.mp4", "theirs", "s5")), "good.mp4 is listed twice"),
])
def test_an_unfair_table_is_refused(clips, words):
    with pytest.raises(InputError, match=words):
        build_study(clips, 3)


def test_too_many_raters_for_too_few_orders():
    few = (*CLIPS[:2], *(Clip(f"{s}.mp4", s, "s1") for s in SYSTEMS[:2]))
    assert len(build_study(few, 4).orders) == 4  # two ways round for training, two for the rest
    with pytest.raises(InputError, match="raters"):
        build_study(few, 5)


def test_a_study_comes_back_from_its_file(tmp_path):
    for pairs in (False, True):
        study = build_study(CLIPS, 3, seed=2, pairs=pairs)
        write_study(tmp_path, study)
        assert read_study(tmp_path) == study


@pytest.mark.parametrize("change", [
    {"version": 2}, {"pairs": 1}, {"clips": []}, {"clips": 3}, {"orders": {"R01": ["ab"]}}, {"orders": {"R01": [[]]}},
    {"orders": []}, {"seed": "x"}, {"orders": {"../R01": []}}, {"seed": float("inf")}, {"study": "\ud800"},
    {"clips": [{"name": "../a", "file": "a", "system": "b", "scenario": "c"}], "orders": {}},
])
def test_a_broken_study_file_is_told(tmp_path, change):
    write_study(tmp_path, build_study(CLIPS, 2))
    path = tmp_path / "study.json"
    path.write_text(json.dumps({**json.loads(path.read_text("utf-8")), **change}), "utf-8")
    with pytest.raises(InputError, match="study.json"):
        read_study(tmp_path)


def test_the_form_shows_neutral_names_in_the_raters_order_and_nothing_of_the_systems():
    study = build_study(CLIPS, 2)
    page = build_form_page(study, "R02", {clip.name: f"../clips/{clip.name}.mp4" for clip in study.clips})
    shown = [part.split(".mp4")[0] for part in page.split("../clips/")[1:]]
    assert shown == [name for (name,) in study.orders["R02"]]
    assert not any(word in page for word in (*SYSTEMS, "s1", "good.mp4", "http"))
    assert page.count("to get used to it") == 2


def test_a_form_escapes_what_it_is_given():
    study = build_study(CLIPS, 1)
    sources = {clip.name: f'"><script>{clip.name}' for clip in study.clips}
    assert build_form_page(study, "R01", sources).count("<script>") == 1  # its own


def test_a_typed_table_comes_back(tmp_path):
    study = build_study(CLIPS, 2)
    rows = build_form_table(study, "R01").replace("\r\n", "\n").splitlines()
    assert [row.split(",")[2] for row in rows[1:]] == list_questions(study, "R01")
    with pytest.raises(InputError, match="no answers"):
        (tmp_path / "a.csv").write_text("\n".join(rows), "utf-8")
        read_answers(study, [tmp_path])
    typed = [rows[0], *(row + ("4" if len(row.split(",")[2]) == 4 else "") for row in rows[1:])]
    (tmp_path / "a.csv").write_text("\n".join(typed).replace(",", ";"), "utf-8")  # as spreadsheets of many countries
    answers = read_answers(study, [tmp_path])
    assert answers.raters == ("R01",) and answers.missing == 0 and set(answers.ratings["R01"].values()) == {4}
    assert len(answers.ratings["R01"]) == 15  # the training clips do not count


@pytest.mark.parametrize("row, words", [
    ("other,R01,age,25-34", "study other"), ("ID,R09,age,25-34", "R09"), ("ID,R01,nope,3", "nope"),
    ("ID,R01,age,12", "12"), ("ID,R01,CLIP,6", "6"), ("ID,R01,CLIP,3\nID,R01,CLIP,4", "R01 answers 4"),
])
def test_answers_that_cannot_be_are_told_with_their_line(tmp_path, row, words):
    study = build_study(CLIPS, 2)
    row = row.replace("ID", study.id).replace("CLIP", study.orders["R01"][5][0])
    (tmp_path / "a.csv").write_text(f"study,rater,question,answer\n{row}\n", "utf-8")
    with pytest.raises(InputError, match=words) as caught:
        read_answers(study, [tmp_path])
    assert "a.csv:" in str(caught.value)


def test_the_same_answers_as_table_and_as_json_are_one(tmp_path):
    study = build_study(CLIPS, 1)
    name = study.orders["R01"][7][0]
    (tmp_path / "a.csv").write_text(f"study,rater,question,answer\n{study.id},R01,{name},2\n", "utf-8")
    (tmp_path / "a.json").write_text(json.dumps({"study": study.id, "rater": "R01", "answers": {name: "2"}}), "utf-8")
    answers = read_answers(study, [tmp_path])
    assert answers.ratings == {"R01": {name: 2}} and answers.missing == 14


def test_a_planted_effect_is_found_and_its_size_and_none_where_there_is_none(tmp_path):
    study = build_study(CLIPS, 12, seed=5)
    found = analyse_study(study, planted(tmp_path / "a", study, {"ours": 1.0, "skating": 1.0}))
    better, same = {one.old: one for one in found.findings}["theirs"], found.findings[0]
    assert same.old == "skating" and not same.better and abs(same.mean) < 0.4
    assert better.better and abs(better.mean - 1.0) < 0.25 and better.low < 1.0 < better.high
    assert better.p < 1e-4 and better.wilcoxon_p < 1e-3 and better.pooled_p < 1e-4 and 0.3 < better.delta < 0.9


def test_a_worse_system_is_never_called_better(tmp_path):
    study = build_study(CLIPS, 12, seed=5)
    found = analyse_study(study, planted(tmp_path / "a", study, {"ours": -1.0}), [("ours", "theirs")])
    assert found.findings[0].p > 0.99 and not found.findings[0].better


def test_without_an_effect_one_in_twenty_is_rejected(tmp_path):
    rejected = 0
    study = build_study((*CLIPS[:2], *(c for c in CLIPS[2:] if c.system != "skating" and c.scenario < "s3")), 8, seed=5)
    for seed in range(40):
        found = analyse_study(study, planted(tmp_path / "a", study, {}, seed))
        rejected += found.findings[0].better
    assert rejected <= 7  # 2 expected; more than 7 in 40 comes less than once in a thousand times


def test_p_of_three_raters_as_by_hand(tmp_path):
    """Differences 1, 2, 3: t = 2 sqrt 3 with two degrees, whose upper tail is (1 - t / sqrt(t^2 + 2)) / 2."""
    study = build_study((*CLIPS[:2], Clip("a", "ours", "s1"), Clip("b", "theirs", "s1")), 3)
    names = {clip.system: clip.name for clip in study.clips}
    (tmp_path / "a.csv").write_text("study,rater,question,answer\n" + "".join(
        f"{study.id},{rater},{names['ours']},{1 + number}\n{study.id},{rater},{names['theirs']},1\n"
        for number, rater in enumerate(study.orders, 1)
    ), "utf-8")  # fmt: skip
    one = analyse_study(study, read_answers(study, [tmp_path])).findings[0]
    t = 2.0 * np.sqrt(3.0)
    assert one.t == pytest.approx(t) and one.degrees == 2 and one.d == pytest.approx(2.0)
    assert one.p == pytest.approx((1.0 - t / np.sqrt(t * t + 2.0)) / 2.0) and one.holm_p == one.p
    assert one.delta == 1.0 and one.wilcoxon_p == pytest.approx(0.125)


def test_missing_answers_leave_the_rest_paired(tmp_path):
    """Where every clip of scenario s1 by ours is missing, its scenario is left out on both sides."""
    study = build_study(CLIPS, 6, seed=5)
    lost = next(clip.name for clip in study.clips if (clip.system, clip.scenario) == ("ours", "s1"))
    found = analyse_study(study, planted(tmp_path / "a", study, {"ours": 1.0}, skip=(lost,)), [("ours", "theirs")])
    given = found.answers.ratings["R01"]
    marks = {(clip_of(study, name).system, clip_of(study, name).scenario): mark for name, mark in given.items()}
    own = [marks["ours", s] - marks["theirs", s] for s in SCENARIOS[1:]]
    assert found.findings[0].differences[0] == pytest.approx(np.mean(own))
    assert found.answers.missing == 6 and any("missing answers: 6" in note for note in found.notes)


def test_welch_is_scipys():
    from scipy.stats import ttest_ind

    a, b = np.array([1.0, 4.0, 3.0, 5.0]), np.array([2.0, 2.0, 1.0])
    assert compute_welch_p(a, b) == pytest.approx(ttest_ind(a, b, equal_var=False, alternative="greater").pvalue)
    assert np.isnan(compute_welch_p(np.ones(4), np.ones(3))) and compute_welch_p(b, a) == pytest.approx(1.0
            - compute_welch_p(a, b))


def test_holm_and_cliff_by_hand():
    assert adjust_holm([0.01, 0.04, 0.03, float("nan")]) == pytest.approx([0.03, 0.06, 0.06, float("nan")], nan_ok=True)
    assert compute_cliffs_delta(np.array([2, 3]), np.array([1, 2])) == pytest.approx((3 - 0) / 4)


def test_bars_are_centred_on_the_undecided():
    left, width = place_bar(np.array([1, 2, 4, 2, 1]))
    assert left == pytest.approx([-50.0, -40.0, -20.0, 20.0, 40.0]) and width.sum() == pytest.approx(100.0)
    left, width = place_bar(np.array([0, 0, 0, 3, 1]))
    assert left[3] == 0.0 and left[4] + width[4] == pytest.approx(100.0)


def test_pairs_are_analysed_by_who_was_chosen(tmp_path):
    study = build_study(CLIPS, 10, seed=1, pairs=True)
    rng = np.random.default_rng(0)
    lines = ["study,rater,question,answer"]
    for rater, order in study.orders.items():
        for shown in filter(study.is_counted, order):
            by = {clip_of(study, name).system: name for name in shown}
            likes = by.get("ours") if rng.random() < 0.8 and "ours" in by else shown[rng.integers(2)]
            lines.append(f"{study.id},{rater},{'/'.join(shown)},{likes if rng.random() < 0.9 else 'same'}")
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n", "utf-8")
    found = analyse_study(study, read_answers(study, [tmp_path]), [("ours", "theirs"), ("skating", "theirs")])
    first, second = found.findings
    assert first.better and first.mean > 0.5 and first.pooled_p < 1e-4 and not second.better
    assert found.by_system == ()


def test_the_verb_from_table_to_page(tmp_path, capfd):
    pytest.importorskip("matplotlib")
    for clip in CLIPS:
        (tmp_path / clip.file).parent.mkdir(exist_ok=True)
        (tmp_path / clip.file).write_bytes(b"movie of " + clip.file.encode())
    rows = "".join(f"{clip.file},{clip.system},{clip.scenario}\n" for clip in CLIPS)
    (tmp_path / "clips.csv").write_text("file,system,scenario\n" + rows, "utf-8")
    out = tmp_path / "study"
    assert main(["study", "order", str(tmp_path / "clips.csv"), "--raters", "8", "--out", str(out), "--copy"]) == 0
    study = read_study(out)
    assert {(out / "clips" / f"{c.name}.mp4").read_bytes() for c in study.clips} == {
        b"movie of " + clip.file.encode() for clip in CLIPS}
    assert main(["study", "form", str(out)]) == 0 and len(list((out / "forms").iterdir())) == 16
    assert main(["study", "form", str(out), "--embed"]) == 0
    assert "data:video/mp4;base64," in (out / "forms" / "R03.html").read_text("utf-8")
    planted(out / "answers", study, {"ours": 1.5})
    report, page = tmp_path / "r.json", tmp_path / "r.html"
    assert main(["study", "analyse", str(out), "--report", str(report), "--html", str(page)]) == 0
    found = json.loads(report.read_text("utf-8"))
    assert [one["better"] for one in found["findings"]] == [True, True] and found["background"]["age"] == {"25-34": 8}
    assert sum(map(sum, (one["counts"] for one in found["systems"]))) == 8 * 15
    assert page.read_text("utf-8").count("data:image/png") == 3 and "ours over theirs" in capfd.readouterr().out


@pytest.mark.parametrize("argv, words", [
    (["order", "T/none.csv", "--raters", "3", "--out", "T/o"], "none.csv"),
    (["order", "T/clips.csv", "--raters", "0", "--out", "T/o"], "1 to 1000"),
    (["order", "T/clips.csv", "--raters", "3", "--out", "T/o", "--copy"], "good.mp4"),
    (["form", "T"], "study.json"), (["analyse", "T", "--report", "T/r.json"], "study.json"),
    (["analyse", "T/made", "--report", "T/r.json"], "answers"),
    (["analyse", "T/made", "--answers", "T/a", "--better", "ours", "nobody", "--report", "T/r.json"], "nobody"),
    (["form", "T/made", "--embed"], "17 clips missing"),
])
def test_what_is_wrong_is_one_line(tmp_path, capfd, argv, words):
    rows = "".join(f"{clip.file},{clip.system},{clip.scenario}\n" for clip in CLIPS)
    (tmp_path / "clips.csv").write_text("file,system,scenario\n" + rows, "utf-8")
    (tmp_path / "made").mkdir()
    study = build_study(CLIPS, 2)
    write_study(tmp_path / "made", study)
    planted(tmp_path / "a", study, {})
    assert main(["study", *(f"{word}/".replace("T/", f"{tmp_path}/").rstrip("/") for word in argv)]) == 2
    told = capfd.readouterr().err.strip().splitlines()
    assert len(told) == 1 and words in told[0] and not (tmp_path / "o").exists() and not (tmp_path / "r.json").exists()


def test_only_movies_are_copied_under_neutral_names(tmp_path, capfd):
    """A motion under a neutral name would still tell by its joints who made it."""
    for name in ("good.mp4", "bad.webm"):
        (tmp_path / name).write_bytes(b"movie")
    (tmp_path / "clips.csv").write_text(
        "file,system,scenario\ngood.mp4,training,\nbad.webm,training,\nours.bvh,ours,a\ntheirs.bvh,theirs,a\n", "utf-8")
    argv = ["--raters", "2", "--out", str(tmp_path / "o"), "--copy"]
    assert main(["study", "order", str(tmp_path / "clips.csv"), *argv]) == 0
    assert sorted(path.suffix for path in (tmp_path / "o" / "clips").iterdir()) == [".mp4", ".webm"]
    assert "2 of 4 clips are not movies" in capfd.readouterr().err


def test_a_report_never_takes_the_place_of_answers(tmp_path, capfd):
    study = build_study(CLIPS, 2)
    write_study(tmp_path, study)
    planted(tmp_path / "answers", study, {})
    one = tmp_path / "answers" / "R01.csv"
    before = one.read_bytes()
    assert main(["study", "analyse", str(tmp_path), "--report", str(one)]) == 2
    assert one.read_bytes() == before and "R01.csv" in capfd.readouterr().err


def test_names_are_drawn_as_they_are(tmp_path):
    pytest.importorskip("matplotlib")
    names = {"ours": r"$\frac$", "theirs": "a $ b $ <c>"}
    clips = [
        replace(clip, system=names.get(clip.system, clip.system), scenario=f"${clip.scenario}_$") for clip in CLIPS
    ]
    study = build_study(clips, 4)
    page = build_study_page(analyse_study(study, planted(tmp_path / "a", study, {})))
    assert page.count("data:image/png") == 3 and "&lt;c&gt;" in page and "<c>" not in page


def test_a_hypothesis_that_is_named_twice_counts_once(tmp_path):
    study = build_study(CLIPS, 8)
    answers = planted(tmp_path / "a", study, {"ours": 0.5})
    once, twice = (analyse_study(study, answers, [("ours", "theirs")] * times) for times in (1, 2))
    assert len(twice.findings) == 1 and twice.findings[0].holm_p == once.findings[0].holm_p


def test_the_forms_script_is_javascript(tmp_path):
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not here to read the script")
    study = build_study(CLIPS, 1)
    page = build_form_page(study, "R01", {clip.name: "a.mp4" for clip in study.clips})
    (tmp_path / "form.js").write_text(page.split("<script>")[1].split("</script>")[0], "utf-8")
    read = subprocess.run([node, "--check", str(tmp_path / "form.js")], capture_output=True, text=True)
    assert read.returncode == 0, read.stderr
    told = json.loads(page.split('id="study">')[1].split("</script>")[0])
    assert told["questions"] == list_questions(study, "R01") and told["study"] == study.id
