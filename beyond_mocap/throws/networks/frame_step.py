"""Predict one frame after another, within the joints' limits and towards the targets of hands and feet.

`HierarchyPredictor` evaluates a hierarchy with the same result as `features` and `network_output`, without free axes
and jax, as fast as numpy allows; tests compare both.
Source: Fredriksson section 7.7.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...base.errors import InputError
from . import features
from . import network_output as answers
from .chains import HIERARCHY, LIMB_OF, Chains, find_chains
from .description import BACK, SAMPLES, STEP, Windows
from .kinematics import Pose
from .limb_reach import LimbReach, build_static_pose
from .limits import JointLimits, estimate_joint_limits
from .model import SINGLE, ThrowModel
from .phases import weigh_points_at

_SETTLING_TIME = 0.12
"""Seconds in which tanh moves an offset trajectory back to the requested one by three quarters (section 7.7.3)."""

_MIN_LIMIT_CORRECTION = 2e-3
"""Radians of limit correction above which the limbs reach again."""

_IDENTITY_SIX = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0])  # the identity rotation
_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
_TINY = 1e-12
_GROUND = np.array([1.0, 1.0, 0.0])


class Step(NamedTuple):
    """The next frame.

    Attributes:
        pose: the resulting pose.
        state: state from which the following frame is predicted: the pose, or for a single network without inverse
            kinematics its own inconsistent positions (section 7.2).
        predicted: (4, 3) m, positions of the effectors as predicted by the networks.
        over: (J,) rad by which joints were beyond their limits.
        floating: (j, 3) m, positions predicted by a single network, or None.
    """

    pose: Pose
    state: Pose
    predicted: np.ndarray
    over: np.ndarray
    floating: np.ndarray | None


class Stepper:
    """A model prepared to predict one frame after another."""

    def __init__(self, model: ThrowModel):
        """Prepare the model; InputError if the networks' inputs and outputs do not match its settings."""
        self.model = model
        self.chains = find_chains(model.skeleton, model.settings.shoulder)
        _check_widths(model, self.chains)
        self.limits = JointLimits(model.skeleton, _choose_limits(model))
        self.effectors = list(self.chains.effectors)
        self.floating_effectors = [self.chains.joints.index(joint) for joint in self.effectors]
        self.hierarchy = HierarchyPredictor(model, self.chains) if model.settings.kind == "hierarchy" else None
        self.reach = LimbReach(self.chains, self.limits, model.settings.wrist == "given")

    def predict_step(self, pose: Pose, window: Windows, requested: np.ndarray, share: np.ndarray | None,
                     limited: bool) -> Step:
        """Predict frame n + 1 from the pose and window of frame n.

        Args:
            pose: state in frame n.
            window: network inputs of frame n.
            requested: (4, 3) m, targets of the effectors.
            share: (4,) share of the distance from prediction to target that each effector moves, None for none.
            limited: joints stay within their limits, and network inputs near the training data.
        """
        after, floating = self.predict_pose(pose, window, limited)
        predicted = after.positions[self.effectors] if floating is None else floating[self.floating_effectors]
        over = np.zeros(len(self.model.skeleton))
        if limited and share is None:
            after, over = self._limit_joints(after)
        elif limited:
            after, over = self._reach_within_limits(after, requested, share)
        elif share is not None:
            after = self.reach(after, requested, share)
        state = after if floating is None or share is not None else self._replace_positions(after, floating)
        return Step(after, state._replace(moved=state.positions - pose.positions), predicted, over, floating)

    def predict_pose(self, pose: Pose, window: Windows, bounded: bool) -> tuple[Pose, np.ndarray | None]:
        """Predict the next frame with the networks alone.

        Args:
            pose: state in frame n.
            window: network inputs of frame n.
            bounded: limit the inputs to what is near the training data.
        Returns:
            The pose, and for a single network the positions (j, 3) m of the joints that it moves.
        """
        if self.hierarchy is not None:
            return self.hierarchy(pose, window, bounded), None
        network, settings = self.model.networks[SINGLE], self.model.settings
        theta = weigh_points_at(float(window.phase), network.points)
        x = features.build_single_input(self.chains, settings, pose, window)
        y = network.frame_network(np.clip(x, *network.input_bounds) if bounded else x, theta).astype(float)
        floating = answers.split_single_output(self.chains, settings, y, pose)[0]
        return answers.apply_output(SINGLE, self.chains, settings, y=y, pose=pose, after=pose, window=window), floating

    def _replace_positions(self, pose: Pose, floating: np.ndarray) -> Pose:
        """Replace the positions of the joints that the single network moves."""
        places = pose.positions.copy()
        places[list(self.chains.joints)] = floating
        return pose._replace(positions=places)

    def _reach_within_limits(self, after: Pose, requested: np.ndarray, share: np.ndarray) -> tuple[Pose, np.ndarray]:
        """Reach with the limbs and limit the joints; reach again with the rest where a limit changed a joint."""
        after, over = self._limit_joints(self.reach(after, requested, share))
        if over.max() > _MIN_LIMIT_CORRECTION:
            after, more = self._limit_joints(self.reach(after, requested, share))
            over = np.maximum(over, more)
        return after, over

    def _limit_joints(self, pose: Pose) -> tuple[Pose, np.ndarray]:
        """Limit the joints of a pose; also return the excess (J,) rad."""
        local, over = self.limits.limit_rotations(pose.local)
        return (pose, over) if local is pose.local else (build_static_pose(self.chains, pose.root, local), over)


@lru_cache(maxsize=8)
def prepare_stepper(model: ThrowModel) -> Stepper:
    """Prepare a model; cached, since models are evaluated repeatedly."""
    return Stepper(model)


def _check_widths(model: ThrowModel, chains: Chains) -> None:
    """Raise InputError if inputs or outputs of a network do not match the settings on this skeleton."""
    for name, (inputs, outputs) in features.count_widths(chains, model.settings).items():
        network = model.networks[name]
        if (network.inputs, network.outputs) != (inputs, outputs):
            found = f"{network.inputs} inputs and {network.outputs} outputs"
            raise InputError(
                f"model: network {name}", found, f"{inputs} and {outputs} on this skeleton", "train it again"
            )


def _choose_limits(model: ThrowModel) -> np.ndarray:
    """Return the model's joint limits, or estimate them from its examples."""
    if model.joint_limits is not None:
        return model.joint_limits
    free = (0, *list_unlimited_joints(model))
    return estimate_joint_limits(np.concatenate([example.motion.rotations for example in model.examples]), free)


def list_unlimited_joints(model: ThrowModel) -> tuple[int, ...]:
    """List the joints without limits besides the root: those between it and the hips, and the hips."""
    chains = find_chains(model.skeleton)
    return (*chains.above, chains.hips)


@lru_cache(maxsize=8)
def _compute_fade(fps: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Compute how an offset fades over a window.

    Returns:
        Remaining share at the samples (9, 1), its change one frame later (9, 1), and the share in the next frame.
    """
    seconds = (np.arange(SAMPLES) - BACK) * STEP

    def remaining_share(t):
        return 1.0 - np.tanh(np.maximum(t, 0.0) / _SETTLING_TIME)

    return remaining_share(seconds)[:, None], (remaining_share(seconds + 1.0 / fps) - remaining_share(seconds))[:,
            None], float(remaining_share(1.0 / fps))


def blend_window(window: Windows, offset: np.ndarray, fps: float) -> Windows:
    """Blend a window's trajectories from the current positions of the effectors to the requested ones by tanh.

    Args:
        window: network inputs of the frame.
        offset: (4, 3) m, current minus requested positions.
        fps: frames per second.
    Source: Fredriksson section 7.7.3.
    """
    left, change, following = _compute_fade(fps)
    return window._replace(
        points=window.points + offset[:, None, :] * left, deltas=window.deltas + offset[:, None, :] * change,
        next=window.next + offset * following,
    )


class HierarchyPredictor:
    """The networks of a hierarchy, prepared to predict one frame after another. Keeps no state between frames."""

    def __init__(self, model: ThrowModel, chains: Chains):
        """Prepare a `model` of kind hierarchy; `chains` are those of its skeleton."""
        settings = model.settings
        self.chains, self.points = chains, settings.points
        self.is_static, self.has_hand_rotations = settings.frame == "static", settings.wrist == "given"
        self.has_carried_hips = settings.carried
        self.networks = [model.networks[name].frame_network for name in HIERARCHY]
        self.bounds = [model.networks[name].input_bounds for name in HIERARCHY]
        self.reach = [model.leg_reach[name[:-4]] for name in LIMB_OF[2:]]
        parents, offsets = chains.skeleton.parents, chains.skeleton.offsets
        self.plans = {name: [(joint, parents[joint], offsets[joint]) for joint in chains.known[name]]
                      for name in HIERARCHY}  # fmt: skip
        self.predicted_joints = [list(answers.list_predicted_joints(name, chains, settings)) for name in HIERARCHY]
        self.limb_joints = [joint for said in self.predicted_joints[2:] for joint in said]
        self.hip_inputs, self.body_inputs = list(chains.hip_inputs), list(chains.body_inputs)
        self.references = [chains.references[name] for name in LIMB_OF]
        self.tops, self.trunk = list(chains.tops), list(chains.trunk)
        self.arm_inputs = [[self.trunk.index(joint) for joint in seen] for seen in chains.arm_inputs]
        self.leg_inputs = list(chains.leg_inputs)
        self.guide = LimbReach(chains, None, True) if settings.guided else None

    def __call__(self, pose: Pose, window: Windows, bounded: bool = False) -> Pose:
        """Predict frame n + 1 from the state and the window of frame n, both of one frame.

        `moved` stays that of n. With `bounded`, inputs are limited to `PhaseNetwork.input_bounds`.
        """
        theta = np.array(weigh_points_at(float(window.phase), self.points), np.float32)
        after = Pose(pose.root, pose.local.copy(), pose.positions.copy(), pose.turns.copy(), pose.moved)
        sixes = pose.turns.swapaxes(1, 2)[:, :2].reshape(-1, 6)
        relative = pose.local.swapaxes(1, 2)[:, :2].reshape(-1, 6)
        after = self._place_hips(after, self._evaluate_network(0, self._build_hip_input(pose, window, sixes), theta,
                                                               bounded), pose)
        turns = _from_six(self._evaluate_network(1, self._build_body_input(pose, after, window, relative), theta,
                                                 bounded))
        after.local[self.predicted_joints[1]] = turns
        _update_joints(self.plans["body"], after, {})
        turns = _from_six(self._evaluate_limbs(pose, after, window, relative=relative, theta=theta, bounded=bounded))
        after.local[self.limb_joints] = turns
        for number, name in enumerate(LIMB_OF):
            hand = self.has_hand_rotations and number < 2
            given = {self.chains.effectors[number]: window.hands_next[number]} if hand else {}
            _update_joints(self.plans[name], after, given)
        return after

    def _evaluate_network(self, number: int, x: np.ndarray, theta: np.ndarray, bounded: bool) -> np.ndarray:
        """Evaluate network `number` of the hierarchy."""
        if bounded:
            x = np.minimum(np.maximum(x, self.bounds[number][0]), self.bounds[number][1])
        return self.networks[number](x, theta)

    def _build_hip_input(self, pose: Pose, window: Windows, sixes: np.ndarray) -> np.ndarray:
        """Build the input of the hip network."""
        start = pose.positions[self.chains.hips] * (0.0 if self.is_static else _GROUND)
        trajectories = np.concatenate([window.points - start, window.deltas], axis=1)
        places = pose.positions[self.hip_inputs] - start
        guide = [features.carry_hips(self.chains, pose, window, start)] if self.has_carried_hips else []
        return _join_row(window.sides, window.impact - start, trajectories, places, sixes[self.hip_inputs], *guide)

    def _place_hips(self, after: Pose, y: np.ndarray, pose: Pose) -> Pose:
        """Place the hips where the first network predicts them; joints above them only move."""
        y, hips, offsets = y.astype(float), self.chains.hips, self.chains.skeleton.offsets
        place = y[:3] + (0.0 if self.is_static else pose.positions[hips] * _GROUND)
        turn = _from_six(y[3:])[0]
        root, above = place, None
        for joint in (*self.chains.above, hips):
            if joint:
                root = root - above @ offsets[joint]
            above = after.local[joint] if above is None else above @ after.local[joint]
        after = after._replace(root=root)
        _update_joints(self.plans["hip"], after, {hips: turn})
        return after

    def _build_body_input(self, pose: Pose, after: Pose, window: Windows, relative: np.ndarray) -> np.ndarray:
        """Build the input of the body network."""
        joint = self.chains.references["body"]
        origin, axes = after.positions[joint], after.turns[joint]
        trajectories = np.concatenate([window.points[:2] - origin, window.deltas[:2]], axis=1) @ axes
        toes, impact = (window.next[2:] - origin) @ axes, (window.impact - origin) @ axes
        turned = _to_six(pose.turns[joint].T @ axes) - _IDENTITY_SIX
        places = (pose.positions[self.body_inputs] - origin) @ axes
        return _join_row(window.sides, impact, trajectories, toes, turned, relative[self.predicted_joints[1]], places,
                         _to_six(axes.T @ pose.turns[self.body_inputs]))  # fmt: skip

    def _evaluate_limbs(
        self, pose: Pose, after: Pose, window: Windows, relative: np.ndarray, theta: np.ndarray, bounded: bool
    ) -> np.ndarray:
        """Evaluate the networks of arms and legs: (rotations * 6,), one limb after the other."""
        # leading axis 4: left arm, right arm, left leg, right leg; [:2] are the arms, [2:] the legs
        origins, axes = after.positions[self.references][:, None], after.turns[self.references]
        back = axes.swapaxes(1, 2)
        # per limb 9 points, 9 deltas and the next position, in the axes of its reference joint
        trajectories = np.concatenate([window.points - origins, window.deltas, window.next[:, None] - origins],
                                      axis=1) @ axes
        turned = _to_six(pose.turns[self.references].swapaxes(1, 2) @ axes) - _IDENTITY_SIX
        tops = after.positions[self.tops]
        stretch = np.sqrt(((window.next - tops) ** 2).sum(-1))
        trunk = (after.positions[self.trunk] - origins[:2]) @ axes[:2]
        above = np.concatenate([after.positions[self.chains.head][None], tops[:2]])
        others = *(trunk[arm, self.arm_inputs[arm]] for arm in (0, 1)), *((above - origins[2:]) @ axes[2:])
        turns = *_to_six(back[:2, None] @ after.turns[self.trunk]), *_to_six(back[2:, None]
                                                                             @ after.turns[self.leg_inputs])
        hands = _to_six(back[:2] @ window.hands_next) if self.has_hand_rotations else ()
        outputs, guides = [], self._build_guides(after, window)
        for number in range(4):
            arm = number < 2
            x = _join_row(*([window.sides] if arm else []), trajectories[number], turned[number],
                          *([hands[number]] if arm and self.has_hand_rotations else []), stretch[number : number + 1],
                          relative[self.predicted_joints[2 + number]], others[number], turns[number],
                          *guides[number])  # fmt: skip
            outputs.append(self._evaluate_network(
                2 + number, x, theta if arm else self._weigh_leg_points(number, stretch[number]), bounded))
        return np.concatenate(outputs)

    def _build_guides(self, after: Pose, window: Windows) -> list[list[np.ndarray]]:
        """Build what `features.compute_reach_guide` returns for each limb, empty if the model is not guided.

        The limbs in `after` are left as they hang on the body of the next frame with the rotations of this one.
        """
        if self.guide is None:
            return [[]] * 4
        for name in LIMB_OF:
            _update_joints(self.plans[name], after, {})
        sixes = _to_six(self.guide.reach_fully(after, window.next))
        return [[sixes[said]] for said in self.predicted_joints[2:]]

    def _weigh_leg_points(self, number: int, stretch: float) -> np.ndarray:
        """Compute the control point weights of a leg stretched to `stretch` metres (eq. 7.3)."""
        low, high = self.reach[number - 2]
        return np.array(weigh_points_at((float(stretch) - low) / (high - low), self.points), np.float32)


def _update_joints(plan: list[tuple[int, int, np.ndarray]], after: Pose, given: dict[int, np.ndarray]) -> None:
    """Update the joints of a plan (joint, parent, offset), parents first, in `after` itself.

    Local rotations are those of `after`; `given` contains world rotations, which replace them.
    """
    local, places, turns = after.local, after.positions, after.turns
    for joint, parent, offset in plan:
        if parent < 0:
            local[joint] = turns[joint] = given.get(joint, local[joint])
            places[joint] = after.root
            continue
        base = turns[parent]
        if joint in given:
            turns[joint] = given[joint]
            local[joint] = base.T @ given[joint]
        else:
            np.dot(base, local[joint], out=turns[joint])
        places[joint] = places[parent] + base @ offset


def _join_row(*parts: np.ndarray) -> np.ndarray:
    """Join arrays to one input row, float32."""
    return np.concatenate([part.reshape(-1) for part in parts], dtype=np.float32, casting="same_kind")


def _to_six(turns: np.ndarray) -> np.ndarray:
    """Convert rotations (..., 3, 3) to six numbers (..., 6)."""
    return turns.swapaxes(-1, -2)[..., :2, :].reshape(*turns.shape[:-2], 6)


def _from_six(values: np.ndarray) -> np.ndarray:
    """Convert values (6 N,) to the nearest rotations (N, 3, 3): Gram-Schmidt, the x axis first."""
    both = values.astype(float).reshape(-1, 2, 3)
    first, second = both[:, 0], both[:, 1]
    first = first / np.sqrt((first * first).sum(1)[:, None] + _TINY)
    second = second - (first * second).sum(1)[:, None] * first
    second = second / np.sqrt((second * second).sum(1)[:, None] + _TINY)
    third = first[:, _NEXT] * second[:, _LAST] - first[:, _LAST] * second[:, _NEXT]
    return np.stack([first, second, third], axis=2)
