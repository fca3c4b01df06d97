"""Train the networks of a model on recordings in three ways.

Each alone on the truth (sections 7.5 and 7.6), in order, so that child networks receive the output of their parents
(section 9.4), and with several frames fed back as in use.
"""

from __future__ import annotations

import json

import jax
import jax.numpy as jnp
import numpy as np

from beyond_mocap.base.errors import InputError
from beyond_mocap.throws.networks.answers import answered, ends, network_output
from beyond_mocap.throws.networks.chains import LIMB_OF, Chains
from beyond_mocap.throws.networks.description import Windows
from beyond_mocap.throws.networks.features import guides, network_input, phase_of
from beyond_mocap.throws.networks.kinematics import Pose
from beyond_mocap.throws.networks.limb_reach import bent_limb, hinge_axes
from beyond_mocap.throws.networks.limits import JointLimits
from beyond_mocap.throws.networks.model import SINGLE, ModelSettings
from beyond_mocap.throws.networks.network import forward
from beyond_mocap.throws.networks.phases import weigh_points

from .config import TrainingConfig
from .networks import ARRAYS, RIDGES, Linear, Sums, first_weights, linear_start, scales_of, sums
from .recordings import Recordings, disturbed, drawn, single_steps, step_arrays

DROPPED = (SINGLE, "hip", "body")
"""Networks that are trained with dropout (section 7.6)."""
ROOT_NOISE = 0.3
"""Metres of root error at the start of a stretch, for each radian of noise."""

IK_SHARE = 0.5
"""Share of the distance that the inverse-kinematics layer moves a limb; in use it is `generate.Options.share`, more."""


# Terms of the loss: errors of the outputs, distances of hands and feet from their targets, and the size of the weights
# (Fredriksson section 7.5 eq. 7.4, 7.5).


def joint_error(y, wanted, scale):
    """Compute the first term of eq. 7.4: the mean square error of outputs y (B, out), divided by `scale` (out,)."""
    return jnp.mean(((y - wanted) / scale) ** 2)


def effector_error(name: str, chains: Chains, settings: ModelSettings, y, wanted, after: Pose, window: Windows):
    """Compute the third term of eq. 7.5 without its lambda: mean square distance, m^2.

    For a limb that of its wrist or toe in `after` from the description's position in frame n + 1; otherwise
    `compute_end_error`.
    """
    if name not in LIMB_OF:
        return missed_ends(name, chains, settings, y, wanted)
    number = LIMB_OF.index(name)
    return _mean_square(after.positions[..., chains.effectors[number], :] - window.next[..., number, :])


def missed_ends(name: str, chains: Chains, settings: ModelSettings, y, wanted):
    """Compute the mean square distance (m^2) of the ends of outputs y (B, out) from those of the truth.

    The ends are in the chain's own reference frame.
    """
    reached, told = (ends(name, chains, settings, one, ARRAYS) for one in (y, wanted))
    return _mean_square(reached - told)


def _mean_square(missed):
    """Compute the mean square length of vectors (..., 3)."""
    return jnp.mean(jnp.sum(missed**2, axis=-1))


def sizes(params) -> jax.Array:
    """Compute the second term of eq. 7.4 without its lambda: the mean absolute weight, averaged over the networks."""
    weights = [jnp.mean(jnp.concatenate([jnp.abs(w).ravel() for w in one["weights"]])) for one in params.values()]
    return jnp.mean(jnp.stack(weights))


class Networks:
    """The problem that `fit` solves: all networks of one model. Recordings are moved to the device once."""

    def __init__(
        self, recorded: Recordings, chains: Chains, config: TrainingConfig, leg_reach: dict, limits: JointLimits,
        held: np.ndarray | None = None,
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
        self.axes = hinge_axes(chains, limits).astype(np.float32)
        self.lengths = recorded.lengths
        self.fits = json.dumps({**config.flat(), "recordings": recorded.digest}, sort_keys=True)
        self.ridge = config.ridge
        self.scales, self._sums, alone = {}, {}, {}
        held = np.zeros(len(self.lengths), bool) if held is None else held
        held = np.repeat(held, np.array(self.lengths) - 1)
        told = single_steps(recorded)
        beside = None  # the same steps from disturbed poses
        if config.linear_start and config.start_noise:
            off = drawn(chains, len(told.pose.root), config.start_noise, config.seed)
            beside = told._replace(pose=disturbed(chains, told.pose, *(one.astype(np.float32) for one in off)))
        for name in self.settings.networks:
            x, y, phase = step_arrays(name, chains, self.settings, told, leg_reach)
            (mean_x, scale_x), (mean_y, scale_y) = scales_of(x), scales_of(y)
            self.scales[name] = {
                "input_mean": mean_x, "input_scale": scale_x, "output_mean": mean_y, "output_scale": scale_y,
            }
            theta = weigh_points(phase, self.settings.points).astype(np.float32)
            alone[name] = ((x - mean_x) / scale_x, y, theta)
            if config.linear_start:
                parts = [(x, y)]
                if beside is not None:
                    parts.append(step_arrays(name, chains, self.settings, beside, leg_reach)[:2])
                self._sums[name] = self._sums_of(name, parts, theta, held)
        firsts = np.concatenate([[0], np.cumsum(np.array(self.lengths[:-1], int) - 1)])
        self.data = jax.tree.map(jnp.asarray, (recorded._replace(lengths=()), alone, firsts))

    def _sums_of(self, name: str, parts: list, theta, held) -> list[Sums]:
        """Compute regression sums of the rows that are not held out, and of those that are.

        `parts` are pairs of inputs (F, in) and outputs (F, out).
        """
        scales, guided = self.scales[name], guides(name, self.chains, self.settings)
        found = []
        for rows in (~held, held):
            every = [
                sums((x[rows] - scales["input_mean"]) / scales["input_scale"],
                     (y[rows] - scales["output_mean"]) / scales["output_scale"], theta[rows], guided)
                for x, y in parts
            ]  # fmt: skip
            found.append(every[0] if len(every) == 1 else every[0].plus(every[1]))
        return found

    def frames(self, share: float) -> int:
        """Return the number of frames to feed back when `share` of the training is done.

        0: each network alone, one frame from the truth.
        """
        conditioned = self.settings.conditioned or self.settings.kind == SINGLE and self.config.rollout > 1
        return self.config.rollout if conditioned and share >= self.config.single_frames else 0

    def linear(self, ridge: float, whole: bool = True) -> dict[str, Linear]:
        """Fit the linear outputs by name that networks start from; whole: also use the examples that are held out."""
        told = {name: kept.plus(held) if whole else kept for name, (kept, held) in self._sums.items()}
        return {name: linear_start(one, ridge) for name, one in told.items()}

    def first(self, key) -> dict:
        """Build the first weights of all networks, by name."""
        return self.started(key, self.linear(self.ridge or RIDGES[-1]))

    def started(self, key, linear: dict[str, Linear]) -> dict:
        """Build first weights by name, starting from linear outputs where given."""
        settings = self.settings
        return {
            name: first_weights(
                jax.random.fold_in(key, number), len(self.scales[name]["input_mean"]),
                len(self.scales[name]["output_mean"]), settings.layers, settings.units, settings.points,
                linear.get(name),
            )
            for number, name in enumerate(settings.networks)
        }

    def loss(self, params, data, rows, key, frames: int):
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
            parts = self._alone(params, alone, firsts[rows[:, 0]] + rows[:, 1], key)
        else:
            parts = self._fed_back(params, recorded, rows, key, frames)
        parts["sizes"] = self.config.l1 * sizes(params)
        return sum(parts.values()), parts

    def _alone(self, params, alone, steps, key):
        """Compute the losses by name of single steps (B,), every network on the truth."""
        parts = {}
        for number, name in enumerate(self.settings.networks):
            x, wanted, theta = (one[steps] for one in alone[name])
            y = self._answer(params, name, x, theta, jax.random.fold_in(key, number))
            parts[name] = joint_error(y, wanted, self.scales[name]["output_scale"])
            if self._looks_at_ends(name):
                error = missed_ends(name, self.chains, self.settings, y, wanted)
                parts[f"{name} ends"] = self._weight(name) ** 2 * error
        return parts

    def _fed_back(self, params, recorded: Recordings, rows, key, frames: int):
        """Compute the losses by name of stretches in which every frame is predicted from the previous prediction."""
        example, start = rows[:, 0], rows[:, 1]
        pose, _ = recorded.at(example, start)
        pose = self._disturbed(pose, jax.random.fold_in(key, frames))

        def one_frame(pose, number):
            _, window = recorded.at(example, start + number)
            truth, _ = recorded.at(example, start + number + 1)
            return self._frame(params, pose, truth, window, jax.random.fold_in(key, number))

        _, parts = jax.lax.scan(one_frame, pose, jnp.arange(frames))
        return {name: jnp.mean(one) for name, one in parts.items()}

    def _frame(self, params, pose: Pose, truth: Pose, window: Windows, key):
        """Predict one frame: the next state, and the losses by name."""
        after, parts = pose, {}
        for number, name in enumerate(self.settings.networks):
            x = network_input(name, self.chains, self.settings, pose, after, window, ARRAYS)
            phase = phase_of(name, self.chains, after, window, self.leg_reach, ARRAYS)
            x = (x - self.scales[name]["input_mean"]) / self.scales[name]["input_scale"]
            theta = weigh_points(phase, self.settings.points, jnp)
            y = self._answer(params, name, x, theta, jax.random.fold_in(key, number))
            wanted = network_output(name, self.chains, self.settings, pose, truth, ARRAYS)
            parts[name] = joint_error(y, wanted, self.scales[name]["output_scale"])
            after = answered(name, self.chains, self.settings, y, pose, after, window, ARRAYS)
            if self._looks_at_ends(name):
                error = effector_error(name, self.chains, self.settings, y, wanted, after, window)
                parts[f"{name} ends"] = self._weight(name) ** 2 * error
            if self.settings.ik_layer and name in LIMB_OF:
                after = self._bent(LIMB_OF.index(name), after, window)
        return after._replace(moved=after.positions - pose.positions), parts

    def _answer(self, params, name, x, theta, key):
        """Compute the output (B, out) of a network for normalised inputs x (B, in)."""
        weights, scales = params[name]["weights"], self.scales[name]
        y = forward(weights, params[name]["biases"], x, theta, jnp, self._masks(name, weights, len(x), key))
        return y * scales["output_scale"] + scales["output_mean"]

    def _bent(self, number: int, after: Pose, window: Windows) -> Pose:
        """Move a limb towards its target, as in use."""
        kept = number >= 2 or self.settings.wrist == "given"
        wanted = window.next[..., number, :]
        return bent_limb(number, self.chains, after, wanted, IK_SHARE, self.axes, kept, ARRAYS)

    def _masks(self, name: str, weights, rows: int, key):
        """Sample the dropout masks (eq. 3.27) of each layer's input, or None."""
        share = self.config.keep
        if share >= 1.0 or name not in DROPPED:
            return None
        keys = jax.random.split(key, len(weights))
        shapes = [(rows, weight.shape[2]) for weight in weights]
        return [jax.random.bernoulli(one, share, shape) / share for one, shape in zip(keys, shapes)]

    def _looks_at_ends(self, name: str) -> bool:
        """Return whether the loss of a network includes its end positions."""
        config = self.config
        return config.single_effector if name == SINGLE else config.effector_loss

    def _weight(self, name: str) -> float:
        """Return lambda 2 of a network."""
        return self.config.limb_weight if name in LIMB_OF or name == SINGLE else self.config.body_weight

    def _disturbed(self, pose: Pose, key) -> Pose:
        """Disturb poses (B, ...) by noise on the root's position and on the joints that networks move.

        In use the state is never exactly the truth.
        """
        if not self.config.noise:
            return pose
        joints, count = np.array(self.chains.joints), len(pose.root)
        turn, shift = jax.random.split(key)
        vectors = self.config.noise * jax.random.normal(turn, (count, len(joints), 3))
        every = jnp.zeros((count, len(self.chains.skeleton), 3)).at[:, joints].set(vectors)
        beside = self.config.noise * ROOT_NOISE * jax.random.normal(shift, pose.root.shape)
        return disturbed(self.chains, pose, every, jnp.zeros(count), beside, ARRAYS)
