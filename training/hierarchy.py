"""Train the networks of a model on recordings in three ways.

Each alone on the truth (sections 7.5 and 7.6), in order, so that child networks receive the output of their parents
(section 9.4), and with several frames fed back as in use.
"""

from __future__ import annotations

import copy
import json

import jax
import jax.numpy as jnp
import numpy as np

from beyond_mocap.base.errors import InputError
from beyond_mocap.throws.networks.chains import LIMB_OF, Chains
from beyond_mocap.throws.networks.description import Windows
from beyond_mocap.throws.networks.features import build_input, compute_phase, count_guides
from beyond_mocap.throws.networks.kinematics import Pose
from beyond_mocap.throws.networks.limb_reach import find_hinge_axes, reach_limb
from beyond_mocap.throws.networks.limits import JointLimits
from beyond_mocap.throws.networks.model import SINGLE, ModelSettings
from beyond_mocap.throws.networks.network import forward
from beyond_mocap.throws.networks.network_output import apply_output, build_output, compute_end_positions
from beyond_mocap.throws.networks.phases import weigh_points

from .config import TrainingConfig
from .networks import (
    ARRAYS,
    RIDGES,
    LinearOutput,
    RegressionSums,
    build_first_weights,
    compute_scales,
    compute_sums,
    fit_linear,
)
from .recordings import Recordings, build_single_steps, build_step_arrays, disturb_poses, sample_noise

DROPOUT_NETWORKS = (SINGLE, "hip", "body")
"""Networks that are trained with dropout (section 7.6)."""
ROOT_NOISE = 0.3
"""Metres of root error at the start of a stretch, for each radian of noise."""

IK_SHARE = 0.5
"""Share of the distance that the inverse-kinematics layer moves a limb; in use it is `generate.Options.share`, more."""


# Terms of the loss: errors of the outputs, distances of hands and feet from their targets, and the size of the weights
# (Fredriksson section 7.5 eq. 7.4, 7.5).


def compute_joint_error(y, truth, scale):
    """Compute the first term of eq. 7.4: the mean square error of outputs y (B, out), divided by `scale` (out,)."""
    return jnp.mean(((y - truth) / scale) ** 2)


def compute_effector_error(name: str, chains: Chains, settings: ModelSettings, y, truth, after: Pose, window: Windows):
    """Compute the third term of eq. 7.5 without its lambda: mean square distance, m^2.

    For a limb that of its wrist or toe in `after` from the description's position in frame n + 1; otherwise
    `compute_end_error`.
    """
    if name not in LIMB_OF:
        return compute_end_error(name, chains, settings, y, truth)
    number = LIMB_OF.index(name)
    return _compute_mean_square(after.positions[..., chains.effectors[number], :] - window.next[..., number, :])


def compute_end_error(name: str, chains: Chains, settings: ModelSettings, y, truth):
    """Compute the mean square distance (m^2) of the ends of outputs y (B, out) from those of the truth.

    The ends are in the chain's own reference frame.
    """
    output_ends, true_ends = (compute_end_positions(name, chains, settings, one, ARRAYS) for one in (y, truth))
    return _compute_mean_square(output_ends - true_ends)


def _compute_mean_square(errors):
    """Compute the mean square length of vectors (..., 3)."""
    return jnp.mean(jnp.sum(errors**2, axis=-1))


def compute_weight_size(params) -> jax.Array:
    """Compute the second term of eq. 7.4 without its lambda: the mean absolute weight, averaged over the networks."""
    weights = [jnp.mean(jnp.concatenate([jnp.abs(w).ravel() for w in one["weights"]]))
               for one in params.values()]
    return jnp.mean(jnp.stack(weights))


class TrainingProblem:
    """The problem that `fit` solves: all networks of one model. Recordings are moved to the device once."""

    def __init__(
        self, recorded: Recordings, chains: Chains, config: TrainingConfig, leg_reach: dict, limits: JointLimits,
        is_held_out: np.ndarray | None = None,
    ):
        """Prepare data, scales and regression sums.

        Args:
            recorded: the recordings.
            chains: chains of the skeleton.
            config: configuration of the training.
            leg_reach: {"left": (shortest, longest) m, "right": ...} of eq. 7.3.
            limits: joint limits, which give the bending direction of elbows and knees.
            is_held_out: (N,) bool, examples that `fit_linear` can leave out.
        Raises:
            InputError: if networks that are trained alone have to feed frames back.
        """
        if config.rollout > 1 and not config.settings.conditioned and config.settings.kind == "hierarchy":
            raise InputError("training: rollout", f"{config.rollout} frames without conditioned",
                             "conditioned true, or rollout 1",
                             "networks that are trained alone cannot feed frames back")  # fmt: skip
        self.config, self.settings, self.chains, self.leg_reach = config, config.settings, chains, leg_reach
        self.axes = find_hinge_axes(chains, limits).astype(np.float32)
        self.lengths = recorded.lengths
        self.fits = json.dumps({**config.to_dict(), "recordings": recorded.digest}, sort_keys=True)
        self.ridge = config.ridge
        self.scales, self._sums, alone = {}, {}, {}
        self._starts_from_held_out = True
        is_held_out = np.zeros(len(self.lengths), bool) if is_held_out is None else is_held_out
        self._is_held_out = is_held_out
        is_held_out = np.repeat(is_held_out, np.array(self.lengths) - 1)
        steps = build_single_steps(recorded)
        disturbed_steps = None  # the same steps from disturbed poses
        if config.linear_start and config.start_noise:
            noise = sample_noise(chains, len(steps.pose.root), config.start_noise, config.seed)
            disturbed_steps = steps._replace(pose=disturb_poses(chains, steps.pose,
                                                                *(one.astype(np.float32) for one in noise)))
        for name in self.settings.networks:
            x, y, phase = build_step_arrays(name, chains, self.settings, steps, leg_reach)
            (mean_x, scale_x), (mean_y, scale_y) = compute_scales(x), compute_scales(y)
            self.scales[name] = {
                "input_mean": mean_x, "input_scale": scale_x, "output_mean": mean_y, "output_scale": scale_y,
            }
            theta = weigh_points(phase, self.settings.points).astype(np.float32)
            alone[name] = ((x - mean_x) / scale_x, y, theta)
            if config.linear_start:
                parts = [(x, y)]
                if disturbed_steps is not None:
                    parts.append(build_step_arrays(name, chains, self.settings, disturbed_steps, leg_reach)[:2])
                self._sums[name] = self._compute_sums(name, parts, theta, is_held_out)
        firsts = np.concatenate([[0], np.cumsum(np.array(self.lengths[:-1], int) - 1)])
        self.data = jax.tree.map(jnp.asarray, (recorded._replace(lengths=()), alone, firsts))

    def _compute_sums(self, name: str, parts: list, theta, is_held_out) -> list[RegressionSums]:
        """Compute regression sums of the rows that are not held out, and of those that are.

        `parts` are pairs of inputs (F, in) and outputs (F, out).
        """
        scales, guided = self.scales[name], count_guides(name, self.chains, self.settings)
        found = []
        for rows in (~is_held_out, is_held_out):
            every = [
                compute_sums((x[rows] - scales["input_mean"]) / scales["input_scale"],
                             (y[rows] - scales["output_mean"]) / scales["output_scale"], theta[rows], guided)
                for x, y in parts
            ]  # fmt: skip
            found.append(every[0] if len(every) == 1 else every[0].add_sums(every[1]))
        return found

    def without_held_out(self) -> TrainingProblem:
        """Return the same problem without the examples that are held out: neither start nor training use them."""
        found = copy.copy(self)
        found._starts_from_held_out = False
        found.lengths = tuple(0 if out else length for out, length in zip(self._is_held_out, self.lengths))
        return found

    def count_frames(self, share: float) -> int:
        """Return the number of frames to feed back when `share` of the training is done.

        0: each network alone, one frame from the truth.
        """
        conditioned = self.settings.conditioned or self.settings.kind == SINGLE and self.config.rollout > 1
        return self.config.rollout if conditioned and share >= self.config.single_frames else 0

    def fit_linear(self, ridge: float, use_held_out: bool = True) -> dict[str, LinearOutput]:
        """Fit the linear outputs by name that networks start from; `use_held_out`: from all examples."""
        sums = {name: kept.add_sums(held) if use_held_out else kept for name, (kept, held) in self._sums.items()}
        return {name: fit_linear(one, ridge) for name, one in sums.items()}

    def build_parameters(self, key) -> dict:
        """Build the first weights of all networks, by name."""
        return self.build_weights(key, self.fit_linear(self.ridge or RIDGES[-1], self._starts_from_held_out))

    def build_weights(self, key, linear: dict[str, LinearOutput]) -> dict:
        """Build first weights by name, starting from linear outputs where given."""
        settings = self.settings
        return {
            name: build_first_weights(
                jax.random.fold_in(key, number), len(self.scales[name]["input_mean"]),
                len(self.scales[name]["output_mean"]), settings.layers, settings.units, settings.points,
                linear.get(name),
            )
            for number, name in enumerate(settings.networks)
        }

    def compute_loss(self, params, data, rows, key, frames: int):
        """Compute eq. 7.5 summed over the networks, mean over stretches and their frames.

        Args:
            params: weights by name.
            data: `data`, passed in so that the compiled code does not contain it as a constant.
            rows: (B, 2) stretches (example, first frame).
            key: random key of jax.
            frames: result of `count_frames`.
        Returns:
            The loss, and its parts by name.
        """
        recorded, alone, firsts = data
        if frames == 0:
            parts = self._compute_single_losses(params, alone, firsts[rows[:, 0]] + rows[:, 1], key)
        else:
            parts = self._compute_rollout_losses(params, recorded, rows, key, frames)
        parts["sizes"] = self.config.l1 * compute_weight_size(params)
        return sum(parts.values()), parts

    def _compute_single_losses(self, params, alone, steps, key):
        """Compute the losses by name of single steps (B,), every network on the truth."""
        parts = {}
        for number, name in enumerate(self.settings.networks):
            x, truth, theta = (one[steps] for one in alone[name])
            y = self._evaluate_network(params, name, x, theta, jax.random.fold_in(key, number))
            parts[name] = compute_joint_error(y, truth, self.scales[name]["output_scale"])
            if self._uses_end_loss(name):
                error = compute_end_error(name, self.chains, self.settings, y, truth)
                parts[f"{name} ends"] = self._choose_weight(name) ** 2 * error
        return parts

    def _compute_rollout_losses(self, params, recorded: Recordings, rows, key, frames: int):
        """Compute the losses by name of stretches in which every frame is predicted from the previous prediction."""
        example, start = rows[:, 0], rows[:, 1]
        pose, _ = recorded.select_frames(example, start)
        pose = self._disturb(pose, jax.random.fold_in(key, frames))

        def predict_frame(pose, number):
            _, window = recorded.select_frames(example, start + number)
            truth, _ = recorded.select_frames(example, start + number + 1)
            return self._predict_frame(params, pose, truth, window, jax.random.fold_in(key, number))

        _, parts = jax.lax.scan(predict_frame, pose, jnp.arange(frames))
        return {name: jnp.mean(one) for name, one in parts.items()}

    def _predict_frame(self, params, pose: Pose, truth: Pose, window: Windows, key):
        """Predict one frame: the next state, and the losses by name."""
        after, parts = pose, {}
        for number, name in enumerate(self.settings.networks):
            x = build_input(name, self.chains, self.settings, pose, after, window, ARRAYS)
            phase = compute_phase(name, self.chains, after, window, self.leg_reach, ARRAYS)
            x = (x - self.scales[name]["input_mean"]) / self.scales[name]["input_scale"]
            theta = weigh_points(phase, self.settings.points, jnp)
            y = self._evaluate_network(params, name, x, theta, jax.random.fold_in(key, number))
            true_output = build_output(name, self.chains, self.settings, pose, truth, ARRAYS)
            parts[name] = compute_joint_error(y, true_output, self.scales[name]["output_scale"])
            after = apply_output(name, self.chains, self.settings, y, pose, after, window, ARRAYS)
            if self._uses_end_loss(name):
                error = compute_effector_error(name, self.chains, self.settings, y, true_output, after, window)
                parts[f"{name} ends"] = self._choose_weight(name) ** 2 * error
            if self.settings.ik_layer and name in LIMB_OF:
                after = self._reach_limb(LIMB_OF.index(name), after, window)
        return after._replace(moved=after.positions - pose.positions), parts

    def _evaluate_network(self, params, name, x, theta, key):
        """Compute the output (B, out) of a network for normalised inputs x (B, in)."""
        weights, scales = params[name]["weights"], self.scales[name]
        y = forward(weights, params[name]["biases"], x, theta, jnp, self._sample_masks(name, weights, len(x), key))
        return y * scales["output_scale"] + scales["output_mean"]

    def _reach_limb(self, number: int, after: Pose, window: Windows) -> Pose:
        """Move a limb towards its target, as in use."""
        keeps_rotation = number >= 2 or self.settings.wrist == "given"
        requested = window.next[..., number, :]
        return reach_limb(number, self.chains, after, requested, IK_SHARE, self.axes, keeps_rotation, ARRAYS)

    def _sample_masks(self, name: str, weights, rows: int, key):
        """Sample the dropout masks (eq. 3.27) of each layer's input, or None."""
        share = self.config.keep
        if share >= 1.0 or name not in DROPOUT_NETWORKS:
            return None
        keys = jax.random.split(key, len(weights))
        shapes = [(rows, weight.shape[2]) for weight in weights]
        return [jax.random.bernoulli(one, share, shape) / share for one, shape in zip(keys, shapes)]

    def _uses_end_loss(self, name: str) -> bool:
        """Return whether the loss of a network includes its end positions."""
        config = self.config
        return config.single_effector if name == SINGLE else config.effector_loss

    def _choose_weight(self, name: str) -> float:
        """Return lambda 2 of a network."""
        return self.config.limb_weight if name in LIMB_OF or name == SINGLE else self.config.body_weight

    def _disturb(self, pose: Pose, key) -> Pose:
        """Disturb poses (B, ...) by noise on the root's position and on the joints that networks move.

        In use the state is never exactly the truth.
        """
        if not self.config.noise:
            return pose
        joints, count = np.array(self.chains.joints), len(pose.root)
        turn, shift = jax.random.split(key)
        vectors = self.config.noise * jax.random.normal(turn, (count, len(joints), 3))
        rotation_vectors = jnp.zeros((count, len(self.chains.skeleton), 3)).at[:, joints].set(vectors)
        shifts = self.config.noise * ROOT_NOISE * jax.random.normal(shift, pose.root.shape)
        return disturb_poses(self.chains, pose, rotation_vectors, jnp.zeros(count), shifts, ARRAYS)
