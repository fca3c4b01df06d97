"""Generate a throw or kick from its description: a start pose from the examples, then one frame after another.

The start pose is the frame of all examples whose hands and feet have the most similar positions and velocities to
those at the beginning of the description (section 7.7.1).
Source: Fredriksson section 7.7.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ...base.errors import InputError
from ...motion import quaternion
from ...motion.motion import Motion, forward_kinematics
from .chains import find_chains
from .description import Description, Windows, build_windows, compute_phases
from .frame_step import Step, Stepper, blend_window, prepare_stepper
from .gaze import turn_head
from .kinematics import Pose, compute_world_transforms, to_matrices, to_motion
from .model import ThrowModel

_CONTACT_SPEED, _FREE_SPEED = 0.15, 0.6  # m/s of a toe: slower ones are in contact with the ground, faster ones are not
_CONTACT_HEIGHT = 0.03  # metres above its lowest position up to which a toe may be in contact
_MAX_COORDINATE = 1e4  # metres from the origin beyond which the generated body is invalid
_PATIENCE = 8  # iterations of the start pose allowed without an improvement of a millimetre

_VELOCITY_SECONDS = 0.12  # a difference in velocity counts as the distance it makes in this time
_ROTATION_COST = 0.25  # m per radian: cost of rotating an example, since a body with another heading throws differently
_LATE_COST = 0.5  # m: cost of a frame at the end of its example as the beginning of a movement


@dataclass(frozen=True)
class Options:
    """Options of generating a motion.

    Attributes:
        pose_iterations: maximum number of predictions of the start pose (section 7.7.1: 75).
        tolerance: m; the start pose is predicted again until hands and feet are this near to their targets (0.01).
        ik: limbs are corrected in each frame before the next is predicted (section 7.7.3).
        share: share of the distance to the target by which they are corrected; feet in contact with the ground are
            corrected fully.
        blend: networks receive trajectories that begin at the current positions of hands and feet.
        limits: joints stay within the range of the training data, and network inputs near it, so that errors do not
            accumulate (section 9.4).
        gaze: share of the way by which the head of a kick moves, in the end, as heads of the examples do.
    """

    pose_iterations: int = 75
    tolerance: float = 0.01
    ik: bool = True
    share: float = 0.8
    blend: bool = True
    limits: bool = True
    gaze: float = 0.5

    def __post_init__(self):
        shares = (self.share, self.gaze)
        if not (self.pose_iterations >= 0 and self.tolerance >= 0.0 and all(0.0 <= one <= 1.0 for one in shares)):
            found = (f"{self.pose_iterations} iterations, tolerance {self.tolerance:g} m, share {self.share:g}, gaze "
                     f"{self.gaze:g}")
            raise InputError("options", found, "values of 0 or more, shares of at most 1")


@dataclass(frozen=True, eq=False, kw_only=True)
class GeneratedMotion:
    """A generated motion.

    Attributes:
        motion: the motion.
        effectors: (T, 4, 3) m, positions of hands and feet.
        predicted: (T, 4, 3) m, positions predicted by the networks in that frame, before corrections.
        requested: (T, 4, 3) m, targets.
        over: (T, J) rad by which joints would have been beyond their limits.
        floating: (T, j, 3) m, positions that a single network predicts for the joints `Chains.joints`, else None.
        iterations: iterations of the start pose.
        seconds: computing time.
    """

    motion: Motion
    effectors: np.ndarray
    predicted: np.ndarray
    requested: np.ndarray
    over: np.ndarray
    floating: np.ndarray | None
    iterations: int
    seconds: float = 0.0

    @property
    def deviation(self) -> np.ndarray:
        """Metres (T, 4) between each effector and its target (eq. 4.1)."""
        return np.linalg.norm(self.effectors - self.requested, axis=-1)

    @property
    def network_deviation(self) -> np.ndarray:
        """Metres (T, 4) between the networks' prediction of each effector and its target."""
        return np.linalg.norm(self.predicted - self.requested, axis=-1)


def generate_motion(
    model: ThrowModel, description: Description, start: Pose | None = None, options: Options | None = None
) -> GeneratedMotion:
    """Generate the motion that follows a description.

    Args:
        model: the model; the motion has its skeleton.
        description: the description, T frames.
        start: state in the first frame, in the normalised frame; None to choose a pose of the examples and predict
            it until it matches.
        options: options, or None for the defaults.
    Raises:
        InputError: if the frame rate is not the model's, required hand rotations are missing, or the networks'
            output is invalid.
    """
    options = options or Options()
    _check_description(model, description)
    start_time = time.perf_counter()
    all_windows = _list_windows(model, description)
    loop = _FrameLoop(prepare_stepper(model), description, options)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        first, iterations = loop.predict_first_frame(start, all_windows[0])
        steps = [first]
        for frame in range(len(description) - 1):
            steps.append(loop.predict_frame(steps[-1].state, all_windows[frame + 1], frame, frame + 1))
    result = _build_result(model, description, steps, iterations)
    limits = prepare_stepper(model).limits if options.limits else None
    motion = turn_head(model, description, result.motion, options.gaze, limits)
    return replace(result, motion=motion, seconds=time.perf_counter() - start_time)


class _FrameLoop:
    """Values that stay the same from frame to frame."""

    def __init__(self, stepper: Stepper, description: Description, options: Options):
        self.stepper, self.options = stepper, options
        self.requested = description.effectors
        self.fps, self.limb = description.fps, description.limb
        self.shares = _compute_shares(description, options) if options.ik else None

    def predict_frame(self, pose: Pose, window: Windows, now: int, then: int) -> Step:
        """Predict frame `then` from the pose of frame `now`."""
        if self.options.blend:
            window = blend_window(window, pose.positions[self.stepper.effectors] - self.requested[now], self.fps)
        share = None if self.shares is None else self.shares[then]
        step = self.stepper.predict_step(pose, window, self.requested[then], share, self.options.limits)
        _check_pose(step, then)
        return step

    def predict_first_frame(self, pose: Pose | None, window: Windows) -> tuple[Step, int]:
        """Predict the first frame (section 7.7.1): the best result of the iterations, and their number."""
        if pose is None:
            velocities = (self.requested[1] - self.requested[0]) * self.fps
            pose = choose_start_pose(self.stepper.model, self.requested[0], velocities, self.limb)
        places = pose.positions[self.stepper.effectors]
        single = self.stepper.model.settings.kind == "single"
        floating = pose.positions[list(self.stepper.chains.joints)] if single else None
        best = Step(pose, pose, places, np.zeros(len(self.stepper.model.skeleton)), floating)
        least, stale, count = self._measure_error(best), 0, 0
        last = best
        while least > self.options.tolerance and count < self.options.pose_iterations and stale < _PATIENCE:
            last = self.predict_frame(last.state, window, 0, 0)
            count, stale = count + 1, stale + 1
            if self._measure_error(last) < least - 1e-3:
                best, least, stale = last, self._measure_error(last), 0
        return best, count

    def _measure_error(self, step: Step) -> float:
        """Measure the largest distance (m) of an effector from its target in the first frame."""
        places = step.state.positions[self.stepper.effectors]
        return float(np.sqrt(((places - self.requested[0]) ** 2).sum(-1)).max())


def _compute_shares(description: Description, options: Options) -> np.ndarray:
    """Compute the share (T, 4) of the distance to its target that each effector moves: 1 for feet in contact."""
    places = description.effectors
    speed = np.linalg.norm(np.gradient(places, 1.0 / description.fps, axis=0), axis=-1)
    height = places[..., 2] - places[..., 2].min(axis=0)
    contact = np.clip((_FREE_SPEED - speed) / (_FREE_SPEED - _CONTACT_SPEED), 0.0, 1.0) * np.clip(2.0 - height
            / _CONTACT_HEIGHT, 0.0, 1.0)
    contact[:, :2] = 0.0
    return options.share + (1.0 - options.share) * contact


def _list_windows(model: ThrowModel, description: Description) -> list[Windows]:
    """Build the window of the frame before the first, then those of all frames; the first two have the same phase."""
    before = description.effectors[:1] if description.before is None else description.before[-1:]
    extended = replace(
        description, effectors=np.concatenate([before, description.effectors]),
        before=None if description.before is None or len(description.before) < 2 else description.before[:-1],
        hands=None if description.hands is None else np.concatenate([description.hands[:1], description.hands]),
        release=description.release + 1.0,
    )
    phase = compute_phases(description, model.reference)
    all_windows = build_windows(extended)._replace(phase=np.concatenate([phase[:1], phase]))
    return [Windows(*(None if part is None else part[n] for part in all_windows)) for n in range(len(extended))]


def _check_description(model: ThrowModel, description: Description) -> None:
    """Raise InputError if frame rate or hand rotations do not match the model."""
    if abs(description.fps - model.settings.fps) > 1e-6:
        found = f"{description.fps:g} frames per second"
        raise InputError("description", found, f"the model's {model.settings.fps:g}", "resample it to that rate")
    if description.hands is None and model.settings.kind == "hierarchy" and model.settings.wrist == "given":
        raise InputError("description", "no hand rotations", "hand rotations, which the model was trained with")


def _check_pose(step: Step, frame: int) -> None:
    """Raise InputError if the body is invalid: networks may return NaN or huge values far from their training data."""
    if not (np.isfinite(step.pose.positions).all() and np.abs(step.pose.positions).max() < _MAX_COORDINATE):
        raise InputError("model", f"an invalid pose in frame {frame}", "a pose like those of the examples",
                         "choose a target like theirs, or train the model longer")  # fmt: skip


def _build_result(model, description: Description, steps: list[Step], iterations: int) -> GeneratedMotion:
    """Build the result from the predicted frames."""
    root = np.stack([step.pose.root for step in steps])
    local = np.stack([step.pose.local for step in steps])
    effectors = list(prepare_stepper(model).effectors)
    return GeneratedMotion(
        motion=to_motion(model.skeleton, root, local, description.fps),
        effectors=np.stack([step.pose.positions[effectors] for step in steps]),
        predicted=np.stack([step.predicted for step in steps]), requested=description.effectors,
        over=np.stack([step.over for step in steps]),
        floating=None if steps[0].floating is None else np.stack([step.floating for step in steps]),
        iterations=iterations,
    )


@dataclass(frozen=True, eq=False)
class ExampleFrames:
    """All frames of the examples.

    Attributes:
        places: (N, 4, 3) m, positions of the effectors in the normalised frame.
        velocities: (N, 4, 3) m/s of the effectors.
        limb: (N,) limb of the example.
        example: (N,) index of the example.
        frame: (N,) index of the frame in its example.
        progress: (N,) progress, 0 at the beginning of the example, 1 at its end.
    """

    places: np.ndarray
    velocities: np.ndarray
    limb: np.ndarray
    example: np.ndarray
    frame: np.ndarray
    progress: np.ndarray


@lru_cache(maxsize=8)
def collect_frames(model: ThrowModel) -> ExampleFrames:
    """Collect all frames of a model's examples; cached, since models are evaluated repeatedly.

    Raises:
        InputError: if the model has no examples.
    """
    if not model.examples:
        raise InputError("model: examples", "none", "at least one, for the start pose", "train the model again")
    effectors = list(find_chains(model.skeleton).effectors)
    rows = []
    for index, example in enumerate(model.examples):
        places = forward_kinematics(example.motion)[0][:, effectors]
        count = len(places)
        velocity = np.gradient(places, 1.0 / example.motion.fps, axis=0) if count > 1 else np.zeros_like(places)
        many = np.full(count, 1)
        rows.append((places, velocity, many * example.limb, many * index, np.arange(count), np.linspace(0, 1, count)))
    return ExampleFrames(*(np.concatenate(column) for column in zip(*rows)))


def find_nearest_frame(model: ThrowModel, places: np.ndarray, velocities: np.ndarray, limb: int) -> tuple[int, int,
        float]:
    """Find the frame of the examples that best fits effectors; frames of the same limb are preferred to all others.

    A candidate may be moved over the ground and rotated about the vertical; its heights have to match.

    Args:
        model: the model.
        places: (4, 3) m, positions of the effectors.
        velocities: (4, 3) m/s of the effectors.
        limb: index into `EFFECTORS`.
    Returns:
        Index of the example, its frame, and the rotation about the vertical, rad.
    """
    candidates = collect_frames(model)
    requested = places[:, :2] - places[:, :2].mean(axis=0)
    level_positions = candidates.places[..., :2] - candidates.places[..., :2].mean(axis=1, keepdims=True)
    # best rotation of each candidate about the vertical through the middle of the effectors (2D Procrustes)
    turn = np.arctan2(
        (level_positions[..., 0] * requested[:, 1] - level_positions[..., 1] * requested[:, 0]).sum(-1),
        (level_positions * requested).sum((-1, -2))
    )
    rotated_positions = quaternion.rotate_level(level_positions, turn[:, None])
    rotated_velocities = quaternion.rotate_level(candidates.velocities[..., :2], turn[:, None])
    cost = ((rotated_positions - requested) ** 2).sum((-1, -2)) + ((candidates.places[..., 2]
                                                                    - places[:, 2]) ** 2).sum(-1)
    change = ((rotated_velocities - velocities[:, :2]) ** 2).sum((-1, -2))
    change = change + ((candidates.velocities[..., 2] - velocities[:, 2]) ** 2).sum(-1)
    cost = cost + _VELOCITY_SECONDS**2 * change + (_ROTATION_COST * turn) ** 2 + (_LATE_COST * candidates.progress) ** 2
    cost = cost + 1e3 * (candidates.limb != limb)
    best = int(np.argmin(cost))
    return int(candidates.example[best]), int(candidates.frame[best]), float(turn[best])


def place_frame(model: ThrowModel, example: int, frame: int, turn: float, places: np.ndarray) -> Pose:
    """Place the pose of an example's frame so that its effectors lie about `places` (4, 3) m.

    It is rotated by `turn` rad about the vertical; its joints have the velocities of the example.
    """
    motion = model.examples[example].motion
    both = slice(max(frame - 1, 0), frame + 1)
    local = to_matrices(motion.frames(both.start, both.stop))
    root = motion.root_positions[both]
    spin = quaternion.to_matrix(quaternion.from_up_angle(np.array(turn)))
    local = np.concatenate([(spin @ local[:, 0])[:, None], local[:, 1:]], axis=1)
    root = root @ spin.T
    positions, turns = compute_world_transforms(model.skeleton.offsets, model.skeleton.parents, root, local, np)
    effectors = list(find_chains(model.skeleton).effectors)
    shift = np.append((places - positions[-1, effectors])[:, :2].mean(axis=0), 0.0)
    return Pose(root[-1] + shift, local[-1], positions[-1] + shift, turns[-1], positions[-1] - positions[0])


def choose_start_pose(model: ThrowModel, places: np.ndarray, velocities: np.ndarray, limb: int) -> Pose:
    """Choose and place the pose of the examples that best begins a movement.

    Arguments as of `find_nearest_frame`.
    """
    return place_frame(model, *find_nearest_frame(model, places, velocities, limb), places)
