"""The road from markers to a skeleton: a planted body is found again, and what cannot be made is told in a line."""

import json
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError, UserCancelledError
from beyond_mocap.cli.main import build_parser, main
from beyond_mocap.cli.reconstructing import build_settings
from beyond_mocap.files.bvh import bvh
from beyond_mocap.markers.files.trc import write_trc
from beyond_mocap.markers.model.model import BallMarker
from beyond_mocap.markers.reconstruct import ReconstructSettings, reconstruct
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.ground_truth.synthetic_markers import BallRequest, build_trial
from beyond_mocap.synthetic.throws import build_throw

FPS = 100.0


@pytest.fixture(scope="module")
def known():
    """A walk of a second under Plug-in Gait's markers."""
    return build_trial(build_gait(1.3, 1.0, FPS), "plug_in_gait", seed=3, softness=0.3, occlusion=0.02)


@pytest.fixture(scope="module")
def made(known):
    return reconstruct(known.trial, known.static)


LIMBS = ("Arm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")


def joints_off(made, known):
    """Metres (T, J) between the found and the true centres of the limbs' joints."""
    places, _ = forward_kinematics(made.motion)
    names = [side + limb for side in ("Left", "Right") for limb in LIMBS]
    found = places[:, [made.motion.skeleton.index(name) for name in names]]
    return np.linalg.norm(found - np.stack([known.centre(name) for name in names], axis=1), axis=-1)


def test_a_planted_body_is_found_again(made, known):
    off = joints_off(made, known)
    assert len(made.motion) == len(known.trial) and made.motion.fps == FPS
    assert np.sqrt(np.mean(off**2)) < 0.015


def test_the_report_has_its_figures(made):
    report = json.loads(json.dumps(made.report()))
    for key in ("markers", "frames", "fps", "seconds", "residual_mm", "weighted_se", "frames_per_second",
                "bones_change_m", "skate", "limits", "gaps", "swaps", "assigned", "warnings"):  # fmt: skip
        assert key in report
    assert 0 < report["residual_mm"]["mean"] < 12 and report["residual_mm"]["single_mean"] is not None
    assert report["bones_change_m"] < 1e-9 and set(report["seconds"]) >= {"clean", "model", "pose", "filter"}


def test_filters_are_chosen(made, known):
    raw = reconstruct(known.trial, model=made.model, settings=ReconstructSettings(filter="none", plant=False))
    smooth = reconstruct(known.trial, model=made.model, settings=ReconstructSettings(filter="kalman", plant=False))
    assert np.array_equal(raw.motion.rotations, raw.solved.motion.rotations)
    jerk = [np.abs(np.diff(one.motion.rotations, n=3, axis=0)).mean() for one in (raw, smooth)]
    assert jerk[1] < 0.6 * jerk[0]


def test_the_same_input_gives_the_same_bits(made, known):
    again = reconstruct(known.trial, model=made.model)
    assert np.array_equal(again.motion.rotations, made.motion.rotations)


def test_the_motion_stays_where_the_markers_are_unless_a_floor_is_asked_for(known, made):
    lifted = known.trial.with_positions(known.trial.positions + [0.0, 0.0, 0.8])
    out = reconstruct(lifted, model=made.model)
    assert out.floor == pytest.approx(0.8, abs=0.05) and any("Floor at 0" in line for line in out.warnings)
    assert np.allclose(out.motion.root_positions - made.motion.root_positions, [0.0, 0.0, 0.8], atol=5e-3)
    moved = reconstruct(lifted, model=made.model, settings=ReconstructSettings(floor=True))
    lowered = out.trial.positions - [0.0, 0.0, out.floor]
    assert moved.grounded and np.allclose(moved.trial.positions, lowered, equal_nan=True)
    assert np.allclose(moved.motion.root_positions, out.place_on_floor().root_positions)
    assert moved.report()["residual_mm"]["output_mean"] == pytest.approx(out.report()["residual_mm"]["output_mean"])


def test_a_model_that_does_not_fit_is_reported(known, made):
    assert not any("on average" in line for line in made.warnings)
    places = np.array(made.model.places)
    places[made.model.markers.index("LFIN")] += [0.0, 0.0, 0.12]
    places[made.model.markers.index("LELB")] += [0.0, 0.0, 0.12]
    out = reconstruct(known.trial, model=replace(made.model, places=places))
    assert any("on average" in line and "LELB" in line for line in out.warnings)


def test_it_can_be_stopped(known):
    with pytest.raises(UserCancelledError):
        reconstruct(known.trial, known.static, cancelled=lambda: True)


@pytest.mark.parametrize("smoothness", [0.0, 0.004])
def test_progress_rises_to_its_end(known, made, smoothness):
    told, settings = [], ReconstructSettings(smoothness=smoothness)
    reconstruct(known.trial, model=made.model, settings=settings, progress=lambda fraction, text: told.append(fraction))
    assert told == sorted(told) and 0 <= told[0] and told[-1] <= 1


def test_markers_of_no_set_and_a_model_of_another_are_refused(known, made):
    strange = known.trial.rename_labels({label: f"q{i}" for i, label in enumerate(known.trial.labels)})
    with pytest.raises(InputError, match="nearest"):
        reconstruct(strange)
    with pytest.raises(InputError, match="model"):
        reconstruct(strange, model=replace(made.model, set_name="mine"))


@pytest.mark.parametrize("wrong", [
    {"filter": "median"}, {"release": "maybe"}, {"smoothness": -0.1}, {"smoothness": np.nan}, {"smoothness": 1000.0},
])  # fmt: skip
def test_settings_that_are_none_are_refused(wrong):
    with pytest.raises(InputError):
        ReconstructSettings(**wrong)


@pytest.fixture(scope="module")
def place(tmp_path_factory, known):
    """A folder with the trial and its static."""
    folder = tmp_path_factory.mktemp("markers")
    write_trc(known.trial, folder / "walk.trc")
    write_trc(known.static, folder / "static.trc")
    return folder


@pytest.fixture
def run(capfd):
    """run(*words) -> status, standard output, lines on standard error."""

    def call(*words):
        capfd.readouterr()
        status = main(["reconstruct", *[str(word) for word in words]])
        said, error = capfd.readouterr()
        return status, said, error.splitlines()

    return call


def test_the_verb_does_what_the_recipe_does(run, place, tmp_path, made):
    out, report, model = (tmp_path / name for name in ("o.bvh", "r.json", "m.json"))
    more = ("--report", report, "--save-model", model)
    status, said, _ = run(place / "walk.trc", "--static", place / "static.trc", "--out", out, *more)
    assert status == 0 and "frames" in said
    motion = bvh.read_bvh(out).motion
    assert len(motion) == len(made.motion) and motion.fps == pytest.approx(FPS, rel=1e-3)
    mine, _ = forward_kinematics(motion)
    recipes, _ = forward_kinematics(made.motion)
    order = [motion.skeleton.names.index(name) for name in made.motion.skeleton.names]
    assert np.abs(mine[:, order] - recipes).max() < 2e-3
    assert json.loads(report.read_text())["frames"] == len(motion)
    status, _, _ = run(place / "walk.trc", "--model", model, "--out", tmp_path / "again.bvh")
    again, _ = forward_kinematics(bvh.read_bvh(tmp_path / "again.bvh").motion)
    assert status == 0 and np.abs(again - mine).max() < 5e-3


def test_a_motion_is_added_to_a_library_with_its_words(run, place, tmp_path, made):
    clips = tmp_path / "clips"
    clips.mkdir()
    words = ("--add-to", clips, "--words", "walking")
    status, _, _ = run(place / "walk.trc", "--static", place / "static.trc", "--out", tmp_path / "o.bvh", *words)
    assert status == 0 and (clips / "walk.bvh").is_file()
    assert (clips / "walk.txt").read_text().split() == ["0f", f"{len(made.motion) - 1}f", "walking"]
    status, _, error = run(place / "walk.trc", "--out", tmp_path / "o.bvh", *words)
    assert status == 2 and "already" in error[0]
    status, _, error = run(place / "walk.trc", "--out", tmp_path / "o.bvh", "--report", clips / "walk.txt", "--add-to",
                           clips)
    assert status == 2 and "walk.txt: is a file of the library" in error[0]
    (clips / "walk.bvh").unlink()
    status, _, error = run(place / "walk.trc", "--static", place / "static.trc", "--out", tmp_path / "p.bvh", *words)
    assert status == 2 and "already has labels" in error[0] and not (tmp_path / "p.bvh").exists()


def test_how_a_ball_lies_in_the_hand_may_be_known():
    made = build_throw((18.0, 0.0, 1.0), 24.0, fps=120.0)
    thrown = build_trial(made.motion, "driveline", seed=2, softness=0.2, ball=BallRequest(made.release))
    first = reconstruct(thrown.trial, thrown.static, settings=ReconstructSettings(plant=False))
    hand, grip = first.model.skeleton.index("RightHand"), tuple(thrown.ball.grip)
    model = replace(first.model, ball=BallMarker(first.trial.labels[-1], hand, grip, 0.0366))
    again = reconstruct(thrown.trial, model=model, settings=ReconstructSettings(plant=False, hold_ball=True))
    assert first.release.method == again.release.method == "ball" and not np.allclose(first.release.centre, grip,
            atol=1e-4)
    assert np.allclose(again.release.centre, grip) and again.release.radius == 0.0366
    assert abs(again.release.speed / thrown.ball.speed - 1.0) < 0.02


def test_a_trial_of_a_folder_goes_without_another_persons_static(run, tmp_path, known):
    trials, out = tmp_path / "trials", tmp_path / "out"
    trials.mkdir()
    few = known.trial.select_frames(0, 40)
    write_trc(known.static, trials / "static.trc")
    write_trc(few, trials / "own.trc")
    write_trc(few.with_positions(few.positions * 1.15), trials / "taller.trc")
    assert run(trials, "--out", out)[0] == 0
    rows = {row["trial"]: row for row in json.loads((out / "trials.json").read_text())["trials"]}
    assert rows["own"]["static"] == "static" and "goes without" not in rows["own"]["line"]
    taller = rows["taller"]
    assert taller["static"] is None and "reconstructed without a static" in taller["line"] and taller["bvh"]


def test_a_folder_is_made_as_a_whole(run, place, tmp_path, known):
    trials = tmp_path / "trials"
    for session in ("monday", "tuesday"):
        (trials / session).mkdir(parents=True)
        write_trc(known.static, trials / session / "static.trc")
        write_trc(known.trial.select_frames(0, 50), trials / session / "walk.trc")
    (trials / "broken.trc").write_text("nothing")
    out, clips = tmp_path / "out", tmp_path / "clips"
    clips.mkdir()
    (clips / "tuesday_walk.bvh").write_text("taken")
    status, said, error = run(trials, "--out", out, "--add-to", clips, "--words", "walking")
    rows = {row["trial"]: row for row in json.loads((out / "trials.json").read_text())["trials"]}
    assert status == 0 and set(rows) == {"broken", "monday/walk", "tuesday/walk"}
    assert rows["broken"]["error"] and rows["monday/walk"]["static"] == "monday/static"
    assert {path.name for path in clips.iterdir()} == {"monday_walk.bvh", "monday_walk.txt", "tuesday_walk.bvh"}
    assert "not added" in rows["tuesday/walk"]["line"] and rows["tuesday/walk"]["bvh"]
    skeletons = [bvh.read_bvh(out / session / "walk.bvh").motion.skeleton for session in ("monday", "tuesday")]
    assert np.allclose(skeletons[0].offsets, skeletons[1].offsets, atol=1e-6)


@pytest.mark.parametrize("words, expected", [
    (("{place}/walk.trc", "--model", "m.json", "--static", "s.trc", "--out", "o.bvh"), "--model"),
    (("{place}/walk.trc", "--words", "throwb", "--out", "{tmp}/o.bvh"), "--add-to"),
    (("{place}/walk.trc", "--out", "{tmp}/o.fbx"), ".fbx"),
    (("{place}/nobody.trc", "--out", "{tmp}/o.bvh"), "nobody.trc"),
    (("{place}/walk.trc", "--marker-set", "mine", "--out", "{tmp}/o.bvh"), "plug_in_gait"),
    (("{place}/walk.trc", "--cutoff", "0", "--out", "{tmp}/o.bvh"), "hertz"),
    (("{place}", "--report", "{tmp}/r.json", "--out", "{tmp}/o"), "--report"),
    (("{tmp}", "--out", "{tmp}/o"), "contains no .c3d"),
    (("{place}", "--out", "{tmp}/o", "--add-to", "{tmp}/gone"), "gone: is not a folder"),
    (("{place}", "--out", "{tmp}/o", "--model", "{tmp}/m.json"), "m.json: no such file"),
    (("{place}", "--out", "{tmp}/o", "--marker-set", "mine"), "plug_in_gait"),
    (("{place}/walk.trc", "--out", "{tmp}/o.bvh", "--add-to", "{tmp}", "--words", "#3"), "words: '#3'"),
])
def test_what_is_wrong_is_reported_in_a_line(run, place, tmp_path, words, expected):
    status, _, error = run(*[word.format(place=place, tmp=tmp_path) for word in words])
    assert status == 2 and len(error) == 1 and expected in error[0] and not list(tmp_path.iterdir())


def test_the_marker_set_of_the_command_line_is_used():
    options = build_parser().parse_args(["reconstruct", "a.c3d", "--marker-set", "plug_in_gait", "--out", "a.bvh"])
    assert build_settings(options).marker_set.name == "plug_in_gait"
