"""The queue of experiments with throws: resumable after a kill, and its tables say what was planted."""

from dataclasses import replace

import pytest

from benchmarks.throw_results import keep, read, tidy
from benchmarks.throw_runs import PAPER, QUICK, Run, runs, variants, work_off
from benchmarks.throw_tables import document
from beyond_mocap.evaluation.throws import fredriksson

BY_NAME = {variant.name: variant for variant in variants(QUICK)}


def silent(line):
    pass


def test_a_queue_that_is_killed_goes_on_where_it_was(tmp_path):
    todo = list(
        runs([("planted", ("a", "b")), ("lmd", ("c",))], [BY_NAME[name] for name in ("hierarchy", "feed-forward")])
    )
    assert [run.key for run in todo[:4]] == [
        ("planted", "hierarchy", "a"), ("planted", "hierarchy", "b"), ("lmd", "hierarchy", "c"),
        ("planted", "feed-forward", "a"),
    ]  # fmt: skip
    did = []

    def killed(run):
        if len(did) == 3:
            raise KeyboardInterrupt
        did.append(run)
        return planted_run([0.01 * len(did)] * 4, 0.5)

    with pytest.raises(KeyboardInterrupt):
        work_off(todo, QUICK, tmp_path, killed, told=silent)
    # half a line, as of a process that was killed while writing
    half = (tmp_path / "quick_lmd.jsonl").read_text()[:-40]
    (tmp_path / "quick_lmd.jsonl").write_text(half)
    again = []
    assert (
        work_off(todo, QUICK, tmp_path, lambda run: again.append(run) or planted_run([0.9] * 4, 1.0), told=silent) == 0
    )
    assert again == [todo[2], *todo[3:]]
    found = read(tmp_path, "quick")
    assert set(found) == {run.key for run in todo}
    assert found["planted", "hierarchy", "b"]["each"][0]["deviation"] == [0.02] * 4
    assert work_off(todo, QUICK, tmp_path, killed, told=silent) == 0


def test_what_is_asked_for_differently_now_is_done_anew(tmp_path):
    run, kicks = (Run(data, BY_NAME["hierarchy"], "a") for data in ("planted", "lmd"))
    for deviation in (0.1, 0.2):
        keep(tmp_path, "quick", run.key, {"stamp": run.stamp(QUICK), **planted_run([deviation] * 4, 0.5)})
    wider = Run("planted", {v.name: v for v in variants(replace(QUICK, units=96))}["hierarchy"], "a")
    assert wider.stamp(QUICK) != run.stamp(QUICK) != run.stamp(replace(QUICK, motions=9))
    work_off([run, kicks], QUICK, tmp_path, lambda run: planted_run([0.3] * 4, 0.5), told=silent)
    assert read(tmp_path, "quick")[run.key]["each"][0]["deviation"] == [0.2] * 4  # the later line counts
    work_off([wider], QUICK, tmp_path, lambda run: planted_run([0.4] * 4, 0.5), told=silent)
    before = read(tmp_path, "quick")
    tidy(tmp_path, "quick")
    assert read(tmp_path, "quick") == before and before[run.key]["each"][0]["deviation"] == [0.4] * 4
    assert len((tmp_path / "quick_planted.jsonl").read_text().splitlines()) == 1


def test_no_run_is_begun_after_the_time_is_up(tmp_path):
    todo = [Run("planted", BY_NAME["hierarchy"], name) for name in "ab"]
    assert work_off(todo, QUICK, tmp_path, lambda run: {}, until=0.0, told=silent) == 2
    assert read(tmp_path, "quick") == {}


def test_his_models_are_his():
    his = {variant.name: variant.config for variant in variants(PAPER)}
    assert (his["single-raw"]["layers"], his["single-raw"]["units"], his["single-raw"]["epochs"]) == (4, 512, 600)
    assert (his["hierarchy"]["layers"], his["hierarchy"]["units"], his["hierarchy"]["epochs"]) == (3, 256, 400)
    assert (his["feed-forward"]["layers"], his["feed-forward"]["points"]) == (8, 1)
    assert {v.name for v in variants(PAPER) if not (v.corrected or v.linear)} == {
        "single-raw", "hierarchy-raw", "single-fed-raw", "hierarchy-fed-raw", "single-effectors",
        "single-effectors-fed",
        "start-raw"}
    assert all(his[name]["wrist"] == "inferred" for name in ("single-raw", "hierarchy-raw"))
    assert his["hierarchy"]["wrist"] == "given" and not his["hierarchy"]["conditioned"]


def planted_run(deviation, impact):
    """A run's JSON with these figures (4,) m and m in each of ten motions."""
    limbs = dict.fromkeys(("deviation", "network", "body"), list(deviation))
    one = {**limbs, "impact": impact, "head": 3.0, "head_share": 0.9, "jerk": 1.1, "beyond": None, "seconds": 0.1}
    gone = {**one, **dict.fromkeys(("deviation", "network", "body"), [900.0] * 4), "impact": 80.0, "subject": "s0"}
    each = [*({**one, "subject": f"s{i % 2}"} for i in range(10)), gone]
    told = {"minutes": 1.0, "steps": 3, "units": 64, "layers": 3, "batch": 32}
    return {"parameters": 1000, "training": told, "each": each, "broken": 1}


def test_his_figures_put_in_come_out_with_his_p_values(tmp_path):
    todo = [Run("planted", BY_NAME[name], subject) for name in ("hierarchy", "feed-forward") for subject in "1234"]
    his = {"hierarchy": fredriksson.HIERARCHY, "feed-forward": fredriksson.FEED_FORWARD}

    def do(run):
        row = his[run.variant.name].figures[int(run.subject) - 1]
        return planted_run(row[:4], row[4])

    work_off(todo, QUICK, tmp_path, do, told=silent)
    text = "\n".join(document(read(tmp_path, "quick"), QUICK))
    assert "| p | **0.0065** | 0.0622 | **0.0063** | **0.0038** | **0.0136** |" in text
    assert "| his p | 0.0064 | 0.0625 | 0.0064 | 0.0038 | 0.0136 |" in text
    assert "| 2 of 12 |" in text and "8 of 48" in text  # bodies that are lost are counted, and in no mean
    assert "### Tables 8.5 to 8.8" in text and "Tables 8.1" not in text
    assert "| would be seen | 0.0269 |" in text  # of differences as his, by Student's t
    assert (
        "better at 0.025 in left arm (p 0.0065), left leg (p 0.0063), right leg (p 0.0038), impact (p 0.0136)" in text
    )


def test_kicks_without_a_ball_have_no_impact(tmp_path):
    todo = [Run("lmd", BY_NAME[name], s) for name in ("ours", "hierarchy", "ours-everyone") for s in ("s0", "s1")]
    work_off(todo, QUICK, tmp_path, lambda run: planted_run([0.02] * 4, None), told=silent)
    lines = document(read(tmp_path, "quick"), QUICK)
    assert "| s0 | +0.0000 | +0.0000 | +0.0000 | +0.0000 | - |" in lines
    assert "### One network from all others (§10.2) or from one of them" in lines
