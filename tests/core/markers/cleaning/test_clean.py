"""The clean-up on planted faults: what is found of them, what is made of it, and that a clean trial stays as it is."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError, UserCancelledError, line_spans
from beyond_mocap.markers.cleaning.clean import CleanSettings, clean_trial
from beyond_mocap.markers.trial import MarkerTrial
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.ground_truth.synthetic_markers import build_trial


@pytest.fixture(scope="module")
def walk():
    """A walk with Plug-in Gait markers, skin and noise, without faults."""
    return build_trial(build_gait(1.4, 1.8, fps=100.0), "plug_in_gait", seed=3)


def clusters_of(known):
    """Segment -> markers, as a marker set would give them."""
    out = {}
    for label, joint in known.segments.items():
        out.setdefault(joint, []).append(label)
    return out


def spoiled(known, change):
    """The trial with `change(positions, index)` done to a copy of its places."""
    positions = np.array(known.trial.positions)
    change(positions, {label: i for i, label in enumerate(known.trial.labels)})
    return known.trial.with_positions(positions)


def off(known, trial, label):
    """(T,) m: how far a marker of a cleaned trial is from where it truly was."""
    return np.linalg.norm(trial.positions[:, trial.index_of(label)] - known.clean[:, known.trial.index_of(label)],
                          axis=-1)


def test_a_clean_trial_comes_back_bit_for_bit(walk):
    cleaned, report = clean_trial(walk.trial, clusters_of(walk))
    np.testing.assert_array_equal(cleaned.positions, walk.trial.positions)
    assert (report.swaps, report.jumps, report.gaps, report.left, report.assigned) == ((), (), (), (), ())
    assert set(report.seen.values()) == {1.0}


def test_precision_and_recall_on_many_planted_faults():
    known = build_trial(
        build_gait(1.4, 3.0, fps=100.0), "plug_in_gait", seed=5, occlusion=0.03, swaps=4, jumps=8, unlabeled=4
    )
    cleaned, report = clean_trial(known.trial, clusters_of(known))
    frame = lambda seconds: round(seconds * known.trial.fps)  # noqa: E731

    def hit(fault, stretches):
        return any(
            set(fault.labels) == set(one.labels) and frame(one.start) < fault.stop and frame(one.end) >= fault.start
            for one in stretches
        )

    kinds = ("swap", "jump", "unlabeled")
    planted_as = {kind: [fault for fault in known.faults if fault.kind == kind] for kind in kinds}
    told = {"swap": report.swaps, "jump": report.jumps, "unlabeled": report.assigned}
    for kind, least in (("swap", 1.0), ("jump", 0.85), ("unlabeled", 0.75)):
        found = [hit(fault, told[kind]) for fault in planted_as[kind]]
        assert np.mean(found) >= least, kind
        assert len(told[kind]) <= sum(found) + 1, kind
    wrong = np.concatenate([off(known, cleaned, label) for label in walk_labels(known)])
    assert np.nanpercentile(wrong, 99.0) < 0.01
    assert np.mean(np.isnan(wrong)) < 0.01


def walk_labels(known):
    return [label for label in known.trial.labels if not label.startswith("*")]


@pytest.mark.parametrize("pair, first, end", [
    (("LKNE", "RKNE"), 60, 100), (("LANK", "LTIB"), 0, 40), (("LASI", "RASI"), 140, 180), (("LFHD", "RBHD"), 60, 100),
    (("LKNE", "RKNE"), 0, 40),
])
def test_a_swap_is_corrected_to_the_frame_also_at_the_ends(walk, pair, first, end):
    def exchange(positions, index):
        two = [index[label] for label in pair]
        positions[first:end, two] = positions[first:end, two[::-1]]

    cleaned, report = clean_trial(spoiled(walk, exchange), clusters_of(walk), CleanSettings(jumps=False))
    assert [set(swap.labels) for swap in report.swaps] == [set(pair)]
    np.testing.assert_array_equal(cleaned.positions, walk.trial.positions)


def test_a_swap_that_begins_unseen_is_corrected(walk):
    def exchange(positions, index):
        two = [index["LKNE"], index["RKNE"]]
        positions[80:120, two] = positions[80:120, two[::-1]]
        positions[75:80, two], positions[120:124, two] = np.nan, np.nan

    cleaned, report = clean_trial(spoiled(walk, exchange), clusters_of(walk))
    assert len(report.swaps) == 1 and report.swaps[0].how == "mended"
    assert max(off(walk, cleaned, "LKNE").max(), off(walk, cleaned, "RKNE").max()) < 0.02


def test_a_foot_whose_labels_are_all_exchanged_is_corrected(walk):
    def exchange(positions, index):
        for a, b in (("LHEE", "RHEE"), ("LTOE", "RTOE"), ("LANK", "RANK")):
            positions[100:160, [index[a], index[b]]] = positions[100:160, [index[b], index[a]]]

    cleaned, _ = clean_trial(spoiled(walk, exchange), clusters_of(walk), CleanSettings(jumps=False))
    np.testing.assert_array_equal(cleaned.positions, walk.trial.positions)


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_samples_that_jump_are_taken_out_and_filled(walk, frames):
    def throw(positions, index):
        positions[120 : 120 + frames, index["RTIB"]] += [0.05, -0.03, 0.04]

    cleaned, report = clean_trial(spoiled(walk, throw), clusters_of(walk))
    assert [(jump.labels, jump.frames) for jump in report.jumps] == [(("RTIB",), frames)]
    assert off(walk, cleaned, "RTIB").max() < 0.005


def test_noise_of_millimetres_is_left_as_it_is():
    """In a run, cameras and skin move single samples by 6 to 9 mm; a jump of 4 cm is found among them."""
    run = build_trial(build_gait(5.0, 2.0, fps=200.0), "sprinter", seed=3)

    def shake(positions, index):
        shaken_markers = np.resize([index[label] for label in ("LTOE", "RTHAD", "LPAT", "C7")], 14)
        positions[np.arange(60, 340, 20), shaken_markers] += [0.0, 0.0, 0.007]
        positions[205, index["RTIAD"]] += [0.03, 0.0, -0.03]

    shaken = spoiled(run, shake)
    cleaned, report = clean_trial(shaken, clusters_of(run))
    assert [(jump.labels, jump.frames) for jump in report.jumps] == [(("RTIAD",), 1)]
    changed = np.argwhere((cleaned.positions != shaken.positions).any(axis=-1))
    assert changed.tolist() == [[205, shaken.index_of("RTIAD")]]


def test_gaps_ride_on_the_cluster_without_a_jump_at_either_end(walk):
    def hide(positions, index):
        positions[60:140, index["LFHD"]] = np.nan
        positions[100:106, index["LFIN"]] = np.nan

    cleaned, report = clean_trial(spoiled(walk, hide), clusters_of(walk))
    assert {gap.labels[0]: gap.how for gap in report.gaps}["LFHD"] == "cluster"
    assert off(walk, cleaned, "LFHD").max() < 0.005 and off(walk, cleaned, "LFIN").max() < 0.01
    steps = np.linalg.norm(np.diff(cleaned.positions[:, cleaned.index_of("LFHD")], 2, axis=0), axis=-1)
    assert steps[58:142].max() < 2.0 * steps[:58].max()


def test_gaps_longer_than_asked_for_stay_open_and_are_reported(walk):
    def hide(positions, index):
        positions[60:140, index["LFHD"]] = np.nan

    settings = CleanSettings(longest_gap=0.5, longest_soft_gap=0.1)
    cleaned, report = clean_trial(spoiled(walk, hide), clusters_of(walk), settings)
    assert np.isnan(off(walk, cleaned, "LFHD")[60:140]).all()
    assert [(gap.labels, gap.frames) for gap in report.left] == [(("LFHD",), 80)]
    line = next(line for line in report.lines if "LFHD" in line)
    assert line_spans(line) == ((0.6, 1.39),)


def test_an_unlabeled_marker_takes_the_label_that_is_missing_there_and_no_other(walk):
    positions = np.array(walk.trial.positions)
    knee = positions[:, walk.trial.index_of("LKNE")].copy()
    positions[80:150, walk.trial.index_of("LKNE")] = np.nan
    extra = np.full((len(positions), 2, 3), np.nan)
    extra[82:150, 0] = knee[82:150]
    extra[60:170, 1] = knee[60:170] + [0.0, 0.4, 0.2]
    trial = MarkerTrial(labels=(*walk.trial.labels, "*12", "*13"), positions=np.concatenate([positions, extra], axis=1),
                        fps=walk.trial.fps)
    cleaned, report = clean_trial(trial, clusters_of(walk))
    assert [one.labels for one in report.assigned] == [("*12", "LKNE")]
    assert off(walk, cleaned, "LKNE").max() < 0.02
    assert "*12" not in cleaned.labels and "*13" in report.unnamed


def test_without_a_marker_set_the_trial_itself_tells_what_moves_together(walk):
    def exchange(positions, index):
        two = [index["LKNE"], index["RKNE"]]
        positions[60:100, two] = positions[60:100, two[::-1]]
        positions[120:160, index["RFHD"]] = np.nan

    cleaned, report = clean_trial(spoiled(walk, exchange))
    assert [swap.labels for swap in report.swaps] == [("LKNE", "RKNE")]
    assert off(walk, cleaned, "RFHD").max() < 0.005


def test_each_step_can_be_left_out(walk):
    def spoil(positions, index):
        two = [index["LKNE"], index["RKNE"]]
        positions[60:100, two] = positions[60:100, two[::-1]]
        positions[120, index["RTIB"]] += 0.1
        positions[30:40, index["LFHD"]] = np.nan

    trial = spoiled(walk, spoil)
    settings = CleanSettings(
        swaps=False, jumps=False, assign=False, longest_gap=0, longest_soft_gap=0, longest_spline=0
    )
    cleaned, report = clean_trial(trial, clusters_of(walk), settings)
    np.testing.assert_array_equal(cleaned.positions, trial.positions)
    assert len(report.left) == 1


def test_odd_trials_do_no_harm(walk):
    none = MarkerTrial(labels=(), positions=np.zeros((5, 0, 3)), fps=100.0)
    assert clean_trial(none).report.lines == ()
    empty = MarkerTrial(labels=("A", "B"), positions=np.zeros((0, 2, 3)), fps=100.0)
    assert len(clean_trial(empty).trial) == 0
    one = MarkerTrial(labels=("A", "B"), positions=np.full((1, 2, 3), 1.0), fps=100.0)
    np.testing.assert_array_equal(clean_trial(one).trial.positions, one.positions)
    unseen = replace(walk.trial, positions=np.full_like(walk.trial.positions, np.nan))
    assert np.isnan(clean_trial(unseen, clusters_of(walk)).trial.positions).all()
    same = MarkerTrial(labels=tuple("ABCDE"), positions=np.zeros((50, 5, 3)), fps=100.0)
    np.testing.assert_array_equal(clean_trial(same).trial.positions, 0.0)


def test_it_can_be_stopped_and_says_how_far_it_is(walk):
    told = []
    clean_trial(walk.trial, progress=lambda share, text: told.append((share, text)))
    assert told[-1][0] == 1.0 and [share for share, _ in told] == sorted(share for share, _ in told)
    with pytest.raises(UserCancelledError):
        clean_trial(walk.trial, cancelled=lambda: True)


def test_settings_that_cannot_be_are_refused():
    with pytest.raises(InputError, match="longest_gap"):
        CleanSettings(longest_gap=-1.0)


def test_markers_that_are_all_gone_together_are_reported_in_one_line(walk):
    def hide(positions, index):
        positions[60:100] = np.nan

    cleaned, report = clean_trial(spoiled(walk, hide), clusters_of(walk))
    assert len(report.left) == len(walk.trial.labels) and len(report.lines) == 1
    assert report.lines[0].startswith(f"{len(walk.trial.labels)} markers") and "0.600 to 0.990 s" in report.lines[0]
    assert np.isnan(cleaned.positions[60:100]).all()


def test_the_pose_gets_no_long_guesses(walk):
    def hide(positions, index):
        positions[60:69, [index[label] for label in ("LFIN", "LWRA", "LWRB", "LFRM", "LELB", "LUPA")]] = np.nan
        positions[60:80, index["LFHD"]] = np.nan

    done = clean_trial(spoiled(walk, hide), clusters_of(walk))
    how = {gap.labels[0]: gap.how for gap in done.report.gaps}
    assert how["LFHD"] == "cluster" and how["LFIN"] in ("soft", "spline")
    assert np.isnan(off(walk, done.build_pose_trial(), "LFIN")[60:69]).all()
    assert not np.isnan(off(walk, done.trial, "LFIN")).any()
    assert off(walk, done.build_pose_trial(), "LFHD").max() < 0.005


@pytest.mark.filterwarnings("error")
def test_a_trial_that_hardly_sees_anything_says_nothing_on_the_terminal(walk):
    chance = np.random.default_rng(1)
    positions = np.where(chance.random(walk.trial.positions.shape[:2])[..., None] < 0.9, np.nan, walk.trial.positions)
    cleaned, _ = clean_trial(walk.trial.with_positions(positions), clusters_of(walk))
    seen = np.isfinite(positions)
    assert np.mean(cleaned.positions[seen] == positions[seen]) > 0.95


def test_what_no_cluster_carries_and_no_curve_would_meet_stays_open(walk):
    foot = ("LANK", "LHEE", "LTOE")

    def hide(positions, index):
        positions[60:78, [index[label] for label in foot]] = np.nan
        positions[120:123, [index[label] for label in foot]] = np.nan

    cleaned, _ = clean_trial(spoiled(walk, hide), clusters_of(walk), CleanSettings(longest_spline=0.25))
    away = np.stack([off(walk, cleaned, label) for label in foot], axis=1)
    assert not np.isnan(away[120:123]).any() and np.isnan(away[60:78]).any()
    assert np.nanmax(away) < 0.03


def test_a_stretch_in_which_a_label_lies_on_a_ghost_is_taken_out(walk):
    def haunt(positions, index):
        positions[60:110, index["LFHD"]] = positions[60:110, index["C7"]] + [0.3, 0.4, 0.1]

    cleaned, report = clean_trial(spoiled(walk, haunt), clusters_of(walk))
    assert [(jump.labels, jump.frames) for jump in report.jumps] == [(("LFHD",), 50)]
    assert off(walk, cleaned, "LFHD").max() < 0.005


def test_a_marker_that_was_attached_again_is_reported_and_one_that_the_body_moves_is_not(walk):
    def move(positions, index):
        positions[130:, index["LFHD"]] += [0.0, 0.0, 0.09]
        positions[128:131, index["LFHD"]] = np.nan

    _, report = clean_trial(spoiled(walk, move), clusters_of(walk), CleanSettings(jumps=False))
    assert {one.labels for one in report.strayed} == {("LFHD",)}
    assert clean_trial(walk.trial, clusters_of(walk)).report.strayed == ()


def test_what_many_markers_have_in_common_is_one_line(walk):
    def hide(positions, index):
        for number, label in enumerate(("LFHD", "RFHD", "C7", "LASI", "RASI", "LPSI", "CLAV", "STRN")):
            positions[10 + 15 * number : 14 + 15 * number, index[label]] = np.nan

    _, report = clean_trial(spoiled(walk, hide), clusters_of(walk))
    assert len(report.gaps) == 8 and len(report.lines) == 1
    assert report.lines[0].startswith("32 occluded frames filled: ") and len(line_spans(report.lines[0])) == 8
