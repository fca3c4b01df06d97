"""Adam on a problem whose answer is known; a training that was killed goes on to the same bits."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from beyond_mocap.base.errors import InputError, UserCancelledError
from training.config import build_config
from training.fit import EpochChoice, build_checkpoint_path, compute_rate, fit, list_stretches, split_batches

TOP = Path(__file__).resolve().parents[2]
CONFIG = build_config({"epochs": 12, "macro": 3, "batch": 16, "learning_rate": 0.05, "final_rate": 0.01, "seed": 3})


class Line:
    """A line through noisy points: slope 3, offset -1."""

    lengths = (20, 31, 3)
    fits = "line"

    def __init__(self):
        x = np.random.default_rng(0).normal(size=(3, 31))
        self.data = jax.tree.map(lambda a: jnp.asarray(a, jnp.float32), (x, 3.0 * x - 1.0))

    def count_frames(self, share):
        return 2 if share >= 0.5 else 0

    def build_parameters(self, key):
        return {"line": {"slope": jax.random.normal(key, ()), "offset": jnp.zeros(())}}

    def compute_loss(self, params, data, rows, key, frames):
        x, y = (one[rows[:, 0], rows[:, 1]] for one in data)
        x = x + 0.01 * jax.random.normal(key, x.shape)
        missed = params["line"]["slope"] * x + params["line"]["offset"] - y
        return jnp.mean(missed**2), {"missed": jnp.mean(jnp.abs(missed))}


def bits(trained):
    return b"".join(np.asarray(leaf).tobytes() for leaf in jax.tree.leaves(trained.params))


def test_the_line_is_found():
    line = fit(Line(), replace(CONFIG, epochs=150)).params["line"]
    assert abs(line["slope"] - 3.0) < 0.05 and abs(line["offset"] + 1.0) < 0.05


def test_same_seed_same_bits_and_another_seed_others():
    assert bits(fit(Line(), CONFIG)) == bits(fit(Line(), CONFIG)) != bits(fit(Line(), replace(CONFIG, seed=4)))


def test_killed_and_resumed_gives_the_same_bits(tmp_path):
    """kill -9 in the middle of an epoch after a checkpoint."""
    path = tmp_path / "w.checkpoint.npz"
    code = f"""
import os, signal, sys
sys.path.insert(0, {str(TOP)!r}); sys.path.insert(0, {str(Path(__file__).parent)!r})
from pathlib import Path
from test_fit import CONFIG, Line
from training.fit import fit
def progress(share, text):
    if share > 0.6: os.kill(os.getpid(), signal.SIGKILL)
fit(Line(), CONFIG, checkpoint=Path({str(path)!r}), progress=progress)
"""
    done = subprocess.run([sys.executable, "-P", "-c", code], env={**os.environ, "JAX_PLATFORMS": "cpu"}, check=False)
    assert done.returncode == -signal.SIGKILL and path.exists()
    resumed = fit(Line(), CONFIG, checkpoint=path, resume=True)
    whole = fit(Line(), CONFIG)
    assert bits(resumed) == bits(whole) and resumed.losses == whole.losses and resumed.epochs == 12


@pytest.mark.parametrize("most", [5, 6, 9])
def test_cancelled_keeps_whole_epochs(tmp_path, most):
    """An epoch asks once before and after each of its batches; one that is cancelled within is trained again."""
    path, asked = tmp_path / "w.checkpoint.npz", []

    def cancelled():
        asked.append(1)
        return len(asked) > most

    with pytest.raises(UserCancelledError, match="1 epochs"):
        fit(Line(), CONFIG, checkpoint=path, cancelled=cancelled)
    assert bits(fit(Line(), CONFIG, checkpoint=path, resume=True)) == bits(fit(Line(), CONFIG))


def test_cancelled_without_an_epoch_to_train():
    with pytest.raises(UserCancelledError):
        fit(Line(), CONFIG, choice=EpochChoice(0), cancelled=lambda: True)


@pytest.mark.parametrize("harm", ["cut", "empty", "text", "missing", "other"])
def test_a_bad_checkpoint_is_one_line(tmp_path, harm):
    path = tmp_path / "w.checkpoint.npz"
    problem = Line()
    fit(problem, CONFIG, checkpoint=path)
    whole = path.read_bytes()
    if harm == "other":
        problem.fits = "another line"
    elif harm == "missing":
        path.unlink()
    else:
        path.write_bytes({"cut": whole[: len(whole) // 2], "empty": b"", "text": b"no checkpoint"}[harm])
    with pytest.raises(InputError) as error:
        fit(problem, CONFIG, checkpoint=path, resume=True)
    assert len(str(error.value).splitlines()) == 1


class SlowToCompile(Line):
    """The line, whose step takes 0.7 s longer to compile."""

    def compute_loss(self, *arguments):
        time.sleep(0.7)  # runs when the step is traced, never in an epoch
        return super().compute_loss(*arguments)


def test_a_limit_of_time_counts_epochs_and_not_compiling():
    measured, config = [], replace(CONFIG, epochs=100_000, macro=10_000)
    trained = fit(SlowToCompile(), config, minutes=0.01, is_done=lambda params, epoch: measured.append(epoch))
    assert 1 < trained.epochs < 100_000 and trained.is_out_of_time and 0.6 <= trained.seconds < 30
    assert measured == [trained.epochs]


def test_the_first_epoch_is_trained_in_any_time():
    assert fit(Line(), CONFIG, minutes=1e-9).epochs == 1


def test_the_rate_falls():
    rates = [compute_rate(share, CONFIG) for share in (0.02, 0.3, 0.7, 1.0)]
    assert rates == sorted(rates, reverse=True) and rates[-1] == pytest.approx(0.05 * 0.01)


def test_stretches_take_every_frame_once_and_the_seed_decides():
    rows = list_stretches((10, 4, 2), 3, 0, 0)
    assert set(map(tuple, list_stretches((10, 4, 2), 1, 0, 5))) == {(0, i) for i in range(9)} | {
        (1, i) for i in range(3)
    } | {(2, 0)}
    assert all(start + 3 <= (10, 4, 2)[who] - 1 for who, start in rows)
    assert np.array_equal(rows, list_stretches((10, 4, 2), 3, 0, 0))
    assert split_batches(np.arange(5), 2).tolist() == [[0, 1], [2, 3], [4, 0]]


def test_no_example_long_enough_is_told():
    problem = Line()
    problem.lengths = (1, 1)
    with pytest.raises(InputError, match="no example"):
        fit(problem, CONFIG)


def test_the_checkpoint_stands_beside_the_weights(tmp_path):
    assert build_checkpoint_path(tmp_path / "w.npz") == tmp_path / "w.checkpoint.npz"
