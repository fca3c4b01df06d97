"""Takes against recordings: the same motion cannot be distinguished, a changed joint is found and named."""

import json

import numpy as np
import pytest

from beyond_mocap.annotation.vocabulary import SIDES
from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.main import main
from beyond_mocap.evaluation.two_sample_test.comparison import compare_with_recordings, list_top_features
from beyond_mocap.evaluation.two_sample_test.cross_validation import (
    CLASSIFIERS,
    assign_folds,
    cross_validate,
    list_folds,
    measure_areas,
)
from beyond_mocap.evaluation.two_sample_test.window_features import measure_windows
from beyond_mocap.evaluation.two_sample_test.windows import (
    Windows,
    collect_recorded_windows,
    collect_take_windows,
    match_windows,
)
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mirror import mirror
from beyond_mocap.motion.motion import Motion, place_motion, resample, sample_frames
from beyond_mocap.synthesis.provenance import Provenance, write_provenance
from beyond_mocap.synthesis.quality.playback import Playback
from beyond_mocap.synthetic.gait import build_gait

FPS, SECONDS = 30.0, 14.0
SPEEDS = (0.9, 1.1, 1.3, 1.5, 1.7, 1.3, 1.1, 1.5)
LOOK = np.array([1.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def walks(tmp_path_factory):
    """A library of eight walkers, of whom one kicks."""
    folder = tmp_path_factory.mktemp("walks")
    for number, speed in enumerate(SPEEDS):
        bvh.write_bvh(folder / f"walk{number}.bvh", build_gait(speed, SECONDS, 60.0, seed=number))
        (folder / f"walk{number}.txt").write_text(f"0 {SECONDS} walking front\n")
    (folder / "walk7.txt").write_text(f"0 {SECONDS} walking front\n0 3 kick right\n1.5 kick right\n")
    return build_library(folder)


def play_clips(library, numbers, change=lambda motion: motion, rate=1.0) -> Playback:
    """A take that shows one clip after the other, every second one mirrored, each for 4 s."""
    clips = [library.clips[2 * number + number % 2] for number in numbers]
    count = int(4 * FPS)
    frames = [rate * (np.arange(count) + 60) * 60.0 / FPS for _ in clips]
    parts = [Motion(clip.motion.skeleton, *sample_frames(clip.motion, at), FPS) for clip, at in zip(clips, frames)]
    ends = np.cumsum([0.0, *(part.root_positions[-1, 0] - part.root_positions[0, 0] for part in parts)])
    parts = [place_motion(part, 0.0, (end - part.root_positions[0, 0], 0.0, 0.0)) for part, end in zip(parts, ends)]
    motion = Motion(library.skeleton, *(np.concatenate([getattr(part, name) for part in parts])
                                        for name in ("root_positions", "rotations")), FPS)
    paths = tuple(sorted({clip.path for clip in clips}))
    labels = [tuple(sorted(clip.labels_at(f))) for clip, at in zip(clips, frames) for f in at]
    return Playback(
        motion=change(motion), start_time=0.0, clips=paths, clip=np.repeat([paths.index(c.path) for c in clips], count),
        clip_frame=np.concatenate(frames), mirrored=np.repeat([c.mirrored for c in clips], count), words=tuple(labels),
        contacts=np.zeros((len(motion), 2), bool),
    )  # fmt: skip


def play_takes(library, change=lambda motion: motion) -> dict[str, Playback]:
    orders = [np.random.default_rng(seed).permutation(8) for seed in range(8)]
    return {f"take{i}": play_clips(library, order, change) for i, order in enumerate(orders)}


def shake_left_elbow(motion: Motion) -> Motion:
    """The same motion with a left forearm that shakes 3 times a second."""
    rotations = np.array(motion.rotations)
    elbow = identify_joints(motion.skeleton).left.lower_arm
    angle = 0.15 * np.sin(2 * np.pi * 3.0 * np.arange(len(motion)) / FPS)
    shake = quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), angle)
    rotations[:, elbow] = quaternion.multiply(rotations[:, elbow], shake)
    return Motion(motion.skeleton, motion.root_positions, rotations, FPS)


@pytest.fixture(scope="module")
def same(walks):
    return compare_with_recordings(play_takes(walks), walks)


@pytest.fixture(scope="module")
def shaken(walks):
    return compare_with_recordings(play_takes(walks, shake_left_elbow), walks)


def test_the_recordings_themselves_as_takes_cannot_be_distinguished(same):
    without = same["subsets"]["without a cut"]
    assert all(0.3 < without["auc"][kind] < 0.65 for kind in CLASSIFIERS), without["auc"]


def test_a_shaking_elbow_is_found_and_named(shaken):
    subset = shaken["subsets"]["all"]
    for kind in CLASSIFIERS:
        assert subset["auc"][kind] > 0.95
        names = [feature["name"] for feature in list_top_features(subset, kind, 2)]
        assert all(name.startswith(("hand", "left hand", "elbow flexion")) for name in names), names
    (shake,) = (f for f in subset["features"] if f["name"] == "hand acceleration, high (greater side)")
    assert shake["auc"] > 0.95 and shake["takes"] > 1.5 * shake["recordings"]


def test_legs_are_not_blamed_for_an_elbow(shaken):
    legs = [feature for feature in shaken["subsets"]["without a cut"]["features"] if feature["name"].startswith("toe ")]
    assert legs and all(0.3 < feature["auc"] < 0.7 for feature in legs)


def test_the_same_input_gives_the_same_bits(walks, same):
    assert json.dumps(compare_with_recordings(play_takes(walks), walks)) == json.dumps(same)


def test_groups_and_windows_are_counted(same):
    assert same["groups"] == {"takes": 8, "clips_shown": 8, "recordings": 8}
    sides = [same["subsets"][name]["windows"] for name in ("with a cut", "without a cut")]
    assert sides[0][0] + sides[1][0] == same["subsets"]["all"]["windows"][0] == same["subsets"]["all"]["windows"][1]
    assert same["subsets"]["above 4.5 m/s"]["features"] == []
    assert np.isnan(same["subsets"]["above 4.5 m/s"]["auc"]["gradient_boosting"])


def test_actions_are_left_out_of_recordings_and_takes(walks):
    recorded = collect_recorded_windows(walks)
    counts = {path: int(np.sum(recorded.recording == path)) for path in set(recorded.recording)}
    assert counts["walk7.bvh"] < counts["walk6.bvh"] - 3
    kicks = play_clips(walks, [7, 1], rate=0.3)
    windows, _ = collect_take_windows({"kicks": kicks}, walks)
    assert set(windows.recording) == {"walk1.bvh"}


def random_windows(count, seed, groups=8, shift=0.0, spread=0.0, sources="abcdefgh") -> Windows:
    """Windows of eight groups whose first feature is shifted, and whose groups differ by `spread` in all features."""
    generator = np.random.default_rng(seed)
    group = np.arange(count) % groups
    offsets = np.random.default_rng(99).normal(size=(groups, 6)) * spread
    values = generator.normal(size=(count, 6)) + offsets[group]
    values[:, 0] += shift
    return Windows(values=values, speed=np.full(count, 1.5), recording=np.array([f"r{i}" for i in group]),
                   source=np.array([sources[i % len(sources)] for i in range(count)]), has_cut=np.zeros(count, bool))


@pytest.mark.parametrize("spread", [0.0, 5.0])
def test_the_same_distribution_gives_a_half_also_where_every_recording_could_be_known_by_heart(spread):
    areas, _ = cross_validate(random_windows(400, 1, spread=spread), random_windows(400, 2, spread=spread))
    assert all(abs(areas["all"][kind] - 0.5) < 0.08 for kind in CLASSIFIERS), areas["all"]


def test_a_shift_gives_its_own_area_and_only_its_feature_is_missed():
    areas, losses = cross_validate(random_windows(600, 1, shift=1.5), random_windows(600, 2))
    for kind in CLASSIFIERS:
        assert areas["all"][kind] == pytest.approx(0.856, abs=0.05)  # Phi(1.5 / sqrt 2)
        assert losses["all"][kind][0] > 0.2 and np.abs(losses["all"][kind][1:]).max() < 0.05


@pytest.mark.parametrize("sources", ["abcdefgh", "a"])
def test_no_fold_asks_about_a_recording_or_take_that_it_learned_from(sources):
    synthesized, recorded = random_windows(200, 1, sources=sources), random_windows(200, 2)
    folds = list_folds(synthesized, recorded)
    asked = np.zeros(200, int)
    for train, test in folds:
        learned = {*synthesized.recording[train[0]], *recorded.recording[train[1]]}
        assert not learned & {*synthesized.recording[test[0]], *recorded.recording[test[1]]}
        assert len(sources) == 1 or not {*synthesized.source[train[0]]} & {*synthesized.source[test[0]]}
        assert not np.any(train[0] & test[0])
        asked += test[0]
    assert (asked == 1).all()


def test_folds_keep_groups_together():
    groups = np.array(list("aabbbccdde"))
    folds = assign_folds(groups)
    assert all(len(set(folds[groups == group])) == 1 for group in "abcde") and folds.max() == 3
    assert not assign_folds(np.array(["a"] * 5)).any()


def test_areas_are_those_of_scikit_learn():
    from sklearn.metrics import roc_auc_score

    generator = np.random.default_rng(0)
    a, b = generator.integers(0, 6, size=(30, 2)).astype(float), generator.integers(1, 8, size=(50, 2)).astype(float)
    expected = [roc_auc_score(np.repeat([1, 0], [30, 50]), [*a[:, k], *b[:, k]]) for k in (0, 1)]
    assert measure_areas(a, b) == pytest.approx(expected)


def test_windows_are_matched_by_speed():
    def of_speeds(speeds):
        return Windows(values=np.zeros((len(speeds), 1)), speed=np.asarray(speeds), recording=np.array(["r"] * len(
            speeds)), source=np.array(["s"] * len(speeds)), has_cut=np.zeros(len(speeds), bool))

    a, b = match_windows(of_speeds([0.3] * 10 + [1.1] * 4 + [7.0] * 3), of_speeds([1.05] * 8 + [0.4] * 5 + [3.0] * 9))
    assert sorted(np.round(a.speed, 2)) == [0.3] * 5 + [1.1] * 4 and sorted(b.speed) == [0.4] * 5 + [1.05] * 4


def test_sides_floors_and_places_do_not_count():
    motion = build_gait(1.4, 8.0, FPS, seed=3)
    plain = measure_windows(motion, LOOK)
    mirrored = measure_windows(mirror(motion), LOOK)
    moved = measure_windows(place_motion(motion, 2.0, (30.0, -20.0, 0.07)), LOOK)
    assert plain.values.shape[1] == len(plain.features) == len({feature.name for feature in plain.features})
    assert np.allclose(mirrored.values, plain.values, atol=1e-6) and np.allclose(moved.values, plain.values, atol=1e-6)
    assert not any(side in feature.name.split() for feature in plain.features for side in SIDES
                   if "against" not in feature.name)


def test_the_rate_of_a_recording_hardly_counts():
    fast = build_gait(1.4, 8.0, 120.0, seed=3)
    half_way = Motion(fast.skeleton, *sample_frames(fast, np.arange(240) * 4 + 1.5), FPS)
    plain = measure_windows(resample(fast, FPS), LOOK)
    late = measure_windows(half_way, LOOK)
    for i, feature in enumerate(plain.features):
        if "speed, median" in feature.name or "acceleration, median" in feature.name:
            ratio = np.median(late.values[:, i]) / np.median(plain.values[:, i])
            assert 0.9 < ratio < 1.1, feature.name


def test_input_that_says_nothing_is_refused(walks):
    take = play_clips(walks, [0, 1, 2, 3])
    with pytest.raises(InputError, match="takes: none; expected one take or more"):
        compare_with_recordings({}, walks)
    with pytest.raises(InputError, match="short: lasts 1.0 s; expected 2 s or more"):
        compare_with_recordings({"short": play_from_frames(take, 30)}, walks)
    with pytest.raises(InputError, match="takes: .* windows of 1 s that match by speed.*expected 40 or more"):
        compare_with_recordings({"few": play_from_frames(take, 120)}, walks)
    with pytest.raises(InputError, match="takes: show 1 clip, such as walk2.bvh"):
        compare_with_recordings({f"t{i}": play_clips(walks, [2] * 8) for i in range(2)}, walks)
    unknown = Playback(**{**vars(take), "words": None})
    with pytest.raises(InputError, match="unknown: the clips that it shows are not known"):
        compare_with_recordings({"unknown": unknown}, walks)


def play_from_frames(take: Playback, count: int) -> Playback:
    cut = {name: getattr(take, name)[:count] for name in ("clip", "clip_frame", "mirrored", "words", "contacts")}
    return Playback(motion=take.motion.frames(0, count), start_time=0.0, clips=take.clips, **cut)


def test_a_library_with_one_recording_is_refused(tmp_path, walks):
    bvh.write_bvh(tmp_path / "walk.bvh", build_gait(1.3, SECONDS, 60.0))
    (tmp_path / "walk.txt").write_text(f"0 {SECONDS} walking front\n")
    with pytest.raises(InputError, match="1 recording with 2 s of locomotion; expected 2 or more"):
        compare_with_recordings({"take": play_clips(walks, [0, 1])}, build_library(tmp_path))


def write_take(folder, name, take: Playback) -> None:
    bvh.write_bvh(folder / f"{name}.bvh", take.motion)
    labels = Provenance(times=take.times, clip=tuple(take.clips[i] for i in take.clip), clip_frame=take.clip_frame,
                        mirrored=take.mirrored, words=take.words, contacts=take.contacts)
    write_provenance(folder / f"{name}.provenance.csv", labels)


def test_the_command_compares_a_folder_of_takes(walks, tmp_path, capsys):
    takes, report = tmp_path / "takes", tmp_path / "r.json"
    takes.mkdir()
    for name, take in list(play_takes(walks).items())[:3]:
        write_take(takes, name, take)
    assert main(["evaluate", str(takes), "--against", walks.folder, "--report", str(report)]) == 0
    out, found = capsys.readouterr().out, json.loads(report.read_text())
    assert "| all |" in out and "gradient boosting: feature" in out and str(report) in out
    assert found["subsets"]["above 4.5 m/s"]["auc"]["logistic_regression"] is None
    assert 0.0 < found["subsets"]["all"]["auc"]["logistic_regression"] < 1.0 and found["groups"]["takes"] == 3


def test_takes_of_another_library_are_refused_in_one_line(walks, tmp_path, capsys):
    """Which recordings must not be learned from with them is unknown: an area would be wrong."""
    takes, report = tmp_path / "takes", tmp_path / "r.json"
    takes.mkdir()
    for name, take in list(play_takes(walks).items())[:3]:
        write_take(takes, name, take)
    table = sorted(takes.glob("*.csv"))[1]
    table.write_text(table.read_text().replace(".bvh", "_x.bvh"))
    assert main(["evaluate", str(takes), "--against", walks.folder, "--report", str(report)]) == 2
    errors = capsys.readouterr().err.strip().splitlines()
    assert len(errors) == 1 and str(table).replace(".provenance.csv", ".bvh") in errors[0] and not report.exists()
    assert "not have, such as" in errors[0] and "_x.bvh; expected a take synthesized from this library" in errors[0]


@pytest.mark.parametrize("arguments, message", [
    (["empty", "--against", "L"], "empty: no BVH file in it; expected takes as NAME.bvh and NAME.provenance.csv"),
    (["a.bvh", "--against", "L"], "a.bvh: a.provenance.csv is missing; expected the table of its sources"),
    (["a.bvh", "b.bvh", "--against", "L", "--provenance", "p.csv"], "--provenance: one table for 2 takes"),
    (["a.bvh", "--against", "L", "--track", "t.csv"], "--track: set with --against"),
    (["a.bvh", "b.bvh"], "evaluate: 2 motions; expected one motion, or --against LIBRARY"),
    (["none.bvh", "--against", "L"], "none.bvh"),
])
def test_the_command_names_what_is_missing(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    for name in ("a.bvh", "b.bvh", "p.csv"):
        (tmp_path / name).write_text("")
    assert main(["evaluate", *arguments, "--report", "r.json"]) == 2
    errors = capsys.readouterr().err
    assert message in errors and len(errors.strip().splitlines()) == 1
