"""What is made small: how far answers are from the truth, how far hands and feet are from where they are to be, and how
large weights are (Fredriksson §7.5 eq. 7.4, 7.5)."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from beyond_mocap.synthesis.phase_network.chains import LIMB_OF, Chains
from beyond_mocap.synthesis.phase_network.description import Windows
from beyond_mocap.synthesis.phase_network.answers import ends
from beyond_mocap.synthesis.phase_network.kinematics import Pose
from beyond_mocap.synthesis.phase_network.model import ModelSettings

from .arrays import ARRAYS


def joint_error(y, wanted, scale):
    """The first term of eq. 7.4: mean square of what answers y (B, out) miss, each value in its own deviations
    (out,)."""
    return jnp.mean(((y - wanted) / scale) ** 2)


def effector_error(
    name: str, chains: Chains, settings: ModelSettings, y, wanted, after: Pose, window: Windows
):
    """The third term of eq. 7.5 without its lambda: mean square distance, m^2.

    Of a limb that of its wrist or toe in `after` from where the description has it in frame n + 1; else `missed_ends`.
    """
    if name not in LIMB_OF:
        return missed_ends(name, chains, settings, y, wanted)
    number = LIMB_OF.index(name)
    return _mean_square(after.positions[..., chains.effectors[number], :] - window.next[..., number, :])


def missed_ends(name: str, chains: Chains, settings: ModelSettings, y, wanted):
    """Mean square distance, m^2, of the ends that answers y (B, out) lead to from those of the truth, in the chain's
    own reference frame."""
    reached, told = (ends(name, chains, settings, one, ARRAYS) for one in (y, wanted))
    return _mean_square(reached - told)


def _mean_square(missed):
    return jnp.mean(jnp.sum(missed**2, axis=-1))


def sizes(params) -> jax.Array:
    """The second term of eq. 7.4 without its lambda: the mean size of the weights, mean over the networks."""
    weights = [jnp.mean(jnp.concatenate([jnp.abs(w).ravel() for w in one["weights"]])) for one in params.values()]
    return jnp.mean(jnp.stack(weights))
