"""A whole passing scene: bodies, ball, files; and one line for what is wrong."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation.striking import measure_ball_gap
from beyond_mocap.ball.contact import find_striking_surface
from beyond_mocap.base.errors import NotInLibraryError, UserCancelledError
from beyond_mocap.cli.main import main
from beyond_mocap.cli.outputs import ProgressReporter
from beyond_mocap.files.bvh import bvh
from beyond_mocap.files.tables import read_ball
from beyond_mocap.library import synthetic_clips
from beyond_mocap.motion.humanoid import estimate_stature, identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.passes.pass_scene import Weights
from beyond_mocap.passes.passes import (
    build_ball,
    build_bone_weights,
    list_unlabelled_strikes,
    plan_scene,
    synthesize_passes,
)
from beyond_mocap.passes.pose_distance import BONES, BoneWeights
from beyond_mocap.passes.scene_json import SAMPLES, parse_scene
from beyond_mocap.synthesis.provenance import read_provenance

TALL = {
    "players": [{"name": "Ann", "place": [0, 0], "height": 1.5}, {"name": "Ben", "place": [4, 0], "height": 2.0}],
    "passes": [{"from": "Ann", "to": "Ben"}, {"from": "Ben", "to": "Ann", "at": [0.5, 1.2]}],
}


@pytest.fixture(scope="module")
def played(strikes_library):
    """played(name) -> Passes of a sample or of TALL, each made once."""
    kept = {}

    def play(name):
        if name not in kept:
            said = TALL if name == "tall" else json.loads(json.dumps(SAMPLES[name]))
            kept[name] = synthesize_passes(strikes_library, parse_scene(said))
        return kept[name]

    return play


@pytest.mark.parametrize("name", ["dropped", "racquet", "tall"])
def test_every_strike_meets_the_ball(played, name):
    """The part's surface in the motion as it is written touches the ball's, within 5 mm."""
    whole = played(name)
    radius = build_ball(whole.scene).radius
    for player in whole.players:
        motion = player.take.motion
        places, world = forward_kinematics(motion)
        for order in whole.plan.list_orders(player.name):
            frame = int(round(order.time * whole.plan.fps))
            surface = find_striking_surface(motion.skeleton, order.part, order.side, order.tool)
            line, ball = surface.compute_line(places[frame], world[frame]), whole.ball.positions[frame]
            gap = measure_ball_gap(line, surface.radius, ball, radius)
            assert abs(gap) < (0.005 if name != "tall" else 0.01)
    assert max(whole.find_gap(number) for number in range(len(whole.plan.strikes))) < 0.005
    assert whole.warnings == ()


def test_everybody_is_there_for_the_whole_scene(played):
    whole = played("dropped")
    assert [player.name for player in whole.players] == ["Ann", "Ben", "Cho"]
    assert {len(player.take.motion) for player in whole.players} == {len(whole.ball.times)}
    for player, asked in zip(whole.players, whole.scene.players):
        way = player.take.motion.root_positions[:, :2] - asked.place
        assert np.linalg.norm(way[0]) < 0.1 and np.linalg.norm(way, axis=1).max() < 1.0


def test_who_waits_stands_ready(played):
    """Bent knees, as the library's own waiting players have them, not upright as its walkers stand."""
    whole = played("dropped")
    for player in whole.players:
        times = [order.time for order in whole.plan.list_orders(player.name)]
        motion = player.take.motion
        places, _ = forward_kinematics(motion)
        leg = identify_joints(motion.skeleton).left
        bones = [np.linalg.norm(places[:, a] - places[:, b], axis=1)
                 for a, b in ((leg.upper_leg, leg.lower_leg), (leg.lower_leg, leg.foot), (leg.upper_leg, leg.foot))]
        waits = np.all([np.abs(np.arange(len(motion)) / motion.fps - time) > 1.2 for time in times], axis=0)
        assert waits.sum() > 30 and np.median((bones[2] / (bones[0] + bones[1]))[waits]) < 0.97


def test_a_small_players_tool_keeps_its_size(strikes_library):
    """The hand hardly has to move: the racquet of the plan is the one in his hand."""
    said = json.loads(json.dumps(SAMPLES["racquet"]))
    said.update(repeat=1, players=[{**one, "height": 1.2} for one in said["players"]])
    whole = synthesize_passes(strikes_library, parse_scene(said))
    assert max(float(np.nanmax(player.part_shifts)) for player in whole.players) < 0.01


def test_players_of_their_own_height(played):
    whole = played("tall")
    sizes = [estimate_stature(player.take.motion.skeleton) for player in whole.players]
    assert np.allclose(sizes, [1.5, 2.0], atol=0.02)


def test_who_is_to_meet_it_elsewhere_goes_there(played):
    whole = played("tall")
    last = whole.plan.strikes[-1].order
    frame = int(round(last.time * whole.plan.fps))
    assert np.allclose(whole.players[0].take.motion.root_positions[frame, :2], [0.5, 1.2], atol=0.1)


def test_the_same_bits(played, strikes_library):
    again = synthesize_passes(strikes_library, parse_scene(json.loads(json.dumps(SAMPLES["dropped"]))))
    for one, other in zip(played("dropped").players, again.players):
        assert one.take.motion.rotations.tobytes() == other.take.motion.rotations.tobytes()
    assert played("dropped").ball.positions.tobytes() == again.ball.positions.tobytes()


def test_progress_goes_up_and_work_can_be_stopped(strikes_library):
    shares = []

    def stop():
        return bool(shares) and shares[-1] > 0.4

    with pytest.raises(UserCancelledError):
        synthesize_passes(strikes_library, parse_scene(SAMPLES["dropped"]), lambda share, text: shares.append(share),
                          stop)
    assert shares == sorted(shares) and shares[-1] < 0.9


def test_weights_of_equation_1_are_so_many_times_the_usual_ones():
    own, asked = BoneWeights(), build_bone_weights(Weights(position=2.0, bones={"left foot": 3.0}))
    foot = BONES.index("left foot")
    assert asked.position[foot] == 6.0 * own.position[foot] and asked.velocity[foot] == 3.0 * own.velocity[foot]
    assert asked.position[0] == 2.0 * own.position[0] and asked.velocity[0] == own.velocity[0]


# -- the verb


@pytest.fixture
def run(capfd, tmp_path, strikes_library):
    """run(scene, *more, library=...) -> status, standard output, lines on standard error."""
    strikes, kept = strikes_library.folder, strikes_library.cache_location[0]

    def call(scene, *more, out="out", library=strikes):
        capfd.readouterr()
        (tmp_path / "scene.json").write_text(scene if isinstance(scene, str) else json.dumps(scene))
        files = (tmp_path / "scene.json", "--library", library, "--out", tmp_path / out, "--cache", kept)
        words = ("passes", *files, *more)
        status = main([str(word) for word in words])
        said, error = capfd.readouterr()
        return status, said, error.splitlines()

    return call


def test_what_is_written(run, tmp_path):
    status, said, error = run({**SAMPLES["dropped"], "passes": SAMPLES["dropped"]["passes"][3:]}, "--json")
    assert status == 0 and "3 players, 2 strikes" in said
    assert [json.loads(line) for line in error][-1]["progress"] > 0.9
    files = sorted(path.name for path in (tmp_path / "out").iterdir())
    names = [f"{name}{end}" for name in ("Ann", "Ben", "Cho") for end in (".bvh", ".provenance.csv")]
    assert files == sorted([*names, "ball.csv", "strikes.csv", "scene.report.json"])
    ball = read_ball(tmp_path / "out" / "ball.csv")
    report = json.loads((tmp_path / "out" / "scene.report.json").read_text())
    rows = list(csv.DictReader((tmp_path / "out" / "strikes.csv").open()))
    assert [row["outcome"] for row in rows] == ["struck", "dropped"] == [one["outcome"] for one in report["strikes"]]
    assert len(ball.times) == report["frames"] == len(bvh.read_bvh(tmp_path / "out" / "Ann.bvh").motion)
    assert len(read_provenance(tmp_path / "out" / "Cho.provenance.csv")) == report["frames"]
    frame = int(rows[0]["frame"])
    assert np.allclose(ball.positions[frame], [float(rows[0][axis]) for axis in ("x_m", "y_m", "z_m")], atol=1e-3)
    assert float(rows[0]["contact_gap_m"]) < 0.005 and report["players"][0]["skate"]


@pytest.mark.parametrize("change, word", [
    ({"players": [{"name": "Ann", "place": [0, 0]}, {"name": "Ben", "place": [0, 0.1]}]}, "0.5 m or more"),
    ({"passes": [{"from": "Ann", "to": "Ann"}]}, "both passer and receiver"),
    ({"passes": [{"from": "Ann", "to": "Ben", "seconds": -1}]}, "from 0.2 to 10"),
    ({"passes": [{"from": "Ann", "to": "Ben", "part": "Tail"}]}, "lacks"),
    ({"passes": [{"from": "Ann", "to": "Ben", "seconds": 0.2, "bounces": 0}],
      "players": [{"name": "Ann", "place": [0, 0]}, {"name": "Ben", "place": [60, 0]}]}, "up to 38 m/s"),
    ({"ball": "cannon"}, "one of paper"),
    ({"ball": {"kind": "football", "drag": 0.5, "linear_drag": 2}}, "no flight"),
    ({"pases": []}, "one of ball, defaults, directions"),
    ({"players": [{"name": "Ann", "place": [0, 0]}, {"name": "Ben", "place": [0, 1e6]}]}, "up to 1000"),
    ({"passes": [{"from": "Ann", "to": "Ben", "example": {"clip": "none.bvh"}}]}, "no recording"),
])
def test_fouls_are_one_line_and_nothing_is_written(run, tmp_path, change, word):
    status, said, error = run({**SAMPLES["dropped"], **change})
    assert status == 2 and said == "" and len(error) == 1 and word in error[0] and "scene.json" in error[0]
    assert not (tmp_path / "out").exists()


def test_players_of_another_scene_are_named_and_stay(run, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "Zoe.bvh").write_text("hers")
    status, _, error = run({**SAMPLES["dropped"], "passes": SAMPLES["dropped"]["passes"][3:]})
    assert status == 0 and [line for line in error if "of another scene: Zoe" in line]
    assert (tmp_path / "out" / "Zoe.bvh").read_text() == "hers"


def test_a_folder_without_a_name_is_none(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["passes", "scene.json", "--library", ".", "--out", ""]) == 2
    assert "no file or folder is named" in capfd.readouterr().err and not list(tmp_path.iterdir())


def test_other_fouls(run, tmp_path, clips_folder, monkeypatch):
    assert run("{")[0] == 2
    assert run(SAMPLES["three"], library=tmp_path / "none")[0] == 2
    assert run(SAMPLES["three"], out="scene.json")[0] == 2
    assert run(SAMPLES["three"], out="no/such/place")[0] == 2
    status, _, error = run({**SAMPLES["three"], "defaults": {"part": "chest"}}, library=clips_folder)
    assert status == 3 and len(error) == 1 and "chest" in error[0] and "add clips" in error[0]
    monkeypatch.setattr(ProgressReporter, "is_cancelled", lambda self: True)
    assert run(SAMPLES["three"])[0] == 130
    assert not (tmp_path / "out").exists()


def test_strikes_that_no_words_tell_of_are_told(strikes_library, monkeypatch):
    monkeypatch.setattr(synthetic_clips, "MAX_SPEED", 2.4)  # no synthetic runs, which would take half of the time

    def quiet(row):
        return replace(row, words=("standing",), key=None) if "stroke" in row.words else row

    scene = parse_scene(SAMPLES["racquet"])
    assert list_unlabelled_strikes(strikes_library, plan_scene(strikes_library, scene)) == []
    silent = tuple(
        replace(clip, annotations=tuple(quiet(row) for row in clip.annotations)) for clip in strikes_library.clips
    )
    told = synthesize_passes(replace(strikes_library, clips=silent, cache_location=None), scene).warnings
    assert any("no labels of the library name strikes with the tool" in line for line in told)


def test_who_gets_up_strikes_nothing(strikes_library):
    up = tuple(replace(clip, annotations=tuple(replace(row, words=("getting_up",)) for row in clip.annotations))
               for clip in strikes_library.clips)
    with pytest.raises(NotInLibraryError, match="strikes with"):
        synthesize_passes(replace(strikes_library, clips=up, cache_location=None), parse_scene(SAMPLES["racquet"]))
