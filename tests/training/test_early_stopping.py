"""Networks are never left random; as many epochs are trained as help subjects that were held out."""

import re
from dataclasses import replace
from types import SimpleNamespace

import jax
import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.motion import Motion
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.throws.evaluate_throws import RAW_OPTIONS, evaluate_throws
from beyond_mocap.throws.networks.chains import find_chains
from beyond_mocap.throws.networks.example import build_example
from beyond_mocap.throws.synthetic_examples import generate_example
from training import train
from training.config import build_config
from training.fit import EpochChoice, TrainingResult

START = {"epochs": 0, "ridge": 0.01, "start_noise": 0.0, "mirrored": False, "fps": 15.0}


def split_spine(motion: Motion, joint: int) -> Motion:
    """Put two joints without a rotation of their own on the bone above a joint: the same motion, a longer chain."""
    skeleton = motion.skeleton
    old = np.append(np.arange(joint), np.arange(joint, len(skeleton)) + 2)  # a joint's new number
    parents = np.zeros(len(skeleton) + 2, int)
    parents[old] = [-1 if parent < 0 else old[parent] for parent in skeleton.parents]
    parents[[joint, joint + 1, joint + 2]] = parents[joint + 2], joint, joint + 1
    names, offsets = np.full(len(parents), "extra", object), np.zeros((len(parents), 3))
    names[old], offsets[old] = skeleton.names, skeleton.offsets
    names[[joint, joint + 1]], offsets[joint : joint + 3] = ("Split1", "Split2"), skeleton.offsets[joint] / 3.0
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (len(motion), len(parents), 1))
    rotations[:, old] = motion.rotations
    longer = Skeleton(tuple(names), tuple(parents), offsets, tuple(old[list(skeleton.end_parents)]),
                      skeleton.end_offsets)
    return Motion(longer, motion.root_positions, rotations, motion.fps)


def build_examples(split: bool):
    made = [generate_example("throw", 0, number)[1] for number in range(10)]
    chest = find_chains(made[0].motion.skeleton).chest
    return [build_example(f"throw {n}", "ann", split_spine(one.motion, chest) if split else one.motion, one.limb,
                          one.release, one.impact, one.velocity, fps=15.0) for n, one in enumerate(made)]


def test_a_long_spine_is_learnt_like_the_usual_one():
    """Its body network has more outputs than half of the units, for which there was once no linear start."""
    off, models = [], []
    for split in (False, True):
        examples = build_examples(split)
        models.append(train.train(examples[:8], build_config(START)))
        off.append(evaluate_throws(models[-1], examples[8:], RAW_OPTIONS).deviations.mean())
    assert off[1] < 1.3 * off[0] + 0.002 and off[1] < 0.05
    assert models[0].settings.units == 96 < models[1].settings.units and "network body" in models[1].notes[0]


def test_networks_that_would_stay_random_are_refused():
    with pytest.raises(InputError, match="0 from random weights"):
        train.train(build_examples(False)[:1], build_config({**START, "linear_start": False}))


@pytest.mark.parametrize("errors, patience, is_late, chosen, said", [
    ([3.0, 2.0, 1.0, 1.5, 1.2, 1.1], 3, False, 4, "4 of 10 epochs: .* 300.00 cm off without epochs and 100.00 cm"),
    ([1.0, 3.0, 2.0], 2, False, 0, "0 of 4 epochs: .* 100.00 cm off without epochs and 200.00 cm with 4"),
    ([3.0, 2.0, 1.0, 0.5], 9, False, 6, "6 of 6 epochs: "),
    ([3.0, 2.0], 9, True, 2, r"2 of 2 epochs \(the time limit ended the choice after 2\): "),
])
def test_epochs_stop_where_held_out_subjects_improve_no_more(monkeypatch, errors, patience, is_late, chosen, said):
    left, trained = list(errors), []

    def fit(problem, config, *, is_done, **_):
        trained.append(problem)
        for epoch in range(config.macro, config.epochs + 1, config.macro):
            if is_done({}, epoch):
                break
        return SimpleNamespace(is_out_of_time=is_late, seconds=5.0)

    monkeypatch.setattr(train, "_measure_errors", lambda model, tested, cancelled: left.pop(0))
    monkeypatch.setattr(train, "fit", fit)
    kept = SimpleNamespace(build_parameters=lambda key: {})
    held = [SimpleNamespace(subject="bob")] * 2
    config = replace(build_config({"macro": 2, "epochs": 2 * (len(errors) - 1)}), patience=patience)
    found, seconds = train.choose_epochs(SimpleNamespace(without_held_out=lambda: kept), config, held,
                                         lambda params, line: None, minutes=None)
    assert found.epochs == chosen and re.match(said, found.line) and "bob" in found.line
    assert trained == [kept] and seconds == 5.0


def test_without_a_second_subject_the_start_stays():
    found, _ = train.choose_epochs(None, build_config({}), [], None, minutes=None)
    assert found.epochs == 0 and "no second subject" in found.line


def test_the_training_gets_the_time_that_the_choice_leaves(monkeypatch):
    given = []

    def fit(problem, config, *, minutes, choice=None, **_):
        given.append(minutes)
        params = problem.build_parameters(jax.random.key(0))
        return TrainingResult(params, 1, 60.0, (0.1,), {}, choice.line, is_out_of_time=True)

    examples = [replace(one, subject=f"s{number % 2}") for number, one in enumerate(build_examples(False)[:4])]
    monkeypatch.setattr(train, "fit", fit)
    monkeypatch.setattr(train, "choose_epochs", lambda *_, minutes, **__: (
        given.append(minutes), (EpochChoice(4, "4 of 9"), 60.0))[1])
    model = train.train(examples, build_config({**START, "epochs": 9}), minutes=10.0)
    assert given == [pytest.approx(4.0), pytest.approx(9.0)]
    assert model.notes[-2:] == ("4 of 9", "the time limit ended the training after 1 epochs")
