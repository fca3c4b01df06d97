"""A throw or kick out of its description: a start pose from the examples, then one frame after the other (Fredriksson
§7.7).

The start pose is, of all frames of the examples, the one whose hands and feet lie and move most as they are to at the
beginning (§7.7.1).
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ...base.errors import InputError
from ...motion import quaternion
from ...motion.motion import Motion, forward_kinematics
from .chains import chains_of
from .description import Description, Windows, phases, windows
from .frame_step import Step, Stepper, blended, stepper
from .kinematics import Pose, matrices, motion_of, places_and_turns
from .model import ThrowModel

_STILL, _MOVING = 0.15, 0.6  # m/s: a toe that is to be slower stands, a faster one does not
_LOW = 0.03  # metres above its lowest place up to which a toe may stand
_FARTHEST = 1e4  # metres from where it began at which a body is lost
_PATIENCE = 8  # iterations of the start pose that may pass without a millimetre's gain

_SECONDS = 0.12  # a difference in velocity counts as the distance it makes in this time
_TURN = 0.25  # m that a turn by one radian costs: a body that faces elsewhere throws otherwise
_LATE = 0.5  # m that a frame at the end of its example costs at the beginning of a movement


@dataclass(frozen=True)
class Options:
    """How a motion is generated.

    pose_iterations, tolerance: the start pose is predicted again until hands and feet are within `tolerance` metres of
    where they are to be, or so many times (§7.7.1: 75, 0.01). ik: limbs are corrected in each frame, by `share` of
    the way to where they are wanted (feet that are to stand, all of it), before the next is predicted (§7.7.3).
    blend: networks see trajectories that begin where hands and feet are. limits: joints stay within the range of the
    training data, and what networks are asked stays near it, so that no error feeds itself (§9.4)."""

    pose_iterations: int = 75
    tolerance: float = 0.01
    ik: bool = True
    share: float = 0.8
    blend: bool = True
    limits: bool = True

    def __post_init__(self):
        if not (self.pose_iterations >= 0 and self.tolerance >= 0.0 and 0.0 <= self.share <= 1.0):
            found = f"{self.pose_iterations} iterations, tolerance {self.tolerance:g} m, share {self.share:g}"
            raise InputError("options", found, "none of them negative, a share of at most 1")


@dataclass(frozen=True, eq=False, kw_only=True)
class Generated:
    """A generated motion.

    effectors, predicted: (T, 4, 3) m, where hands and feet are, and where the networks had them in that frame before
    anything was corrected. wanted: (T, 4, 3) m. over: (T, J) radians by which joints would have been beyond their
    limits. floating: (T, j, 3) m, the places that a single network says of the joints `Chains.joints`, else None.
    iterations: of the start pose. seconds: what it took."""

    motion: Motion
    effectors: np.ndarray
    predicted: np.ndarray
    wanted: np.ndarray
    over: np.ndarray
    floating: np.ndarray | None
    iterations: int
    seconds: float

    @property
    def deviation(self) -> np.ndarray:
        """Metres (T, 4) between each effector and where it was to be (eq. 4.1)."""
        return np.linalg.norm(self.effectors - self.wanted, axis=-1)

    @property
    def raw(self) -> np.ndarray:
        """The same (T, 4) of what the networks said in each frame."""
        return np.linalg.norm(self.predicted - self.wanted, axis=-1)

    @property
    def corrected(self) -> np.ndarray:
        """Metres (T, 4) by which limits and inverse kinematics moved each effector."""
        return np.linalg.norm(self.effectors - self.predicted, axis=-1)


def generate(
    model: ThrowModel, description: Description, start: Pose | None = None, options: Options | None = None
) -> Generated:
    """The motion (T frames, as the description has) of the model's skeleton that follows the description.

    start: the state in the first frame, in the normalised frame; without it one of the examples' poses is taken and
    predicted until it fits. InputError where the description's rate is not the model's, hands are not given that the
    model has to be given, or its networks lose the body."""
    options = options or Options()
    _check(model, description)
    began = time.perf_counter()
    seen = _windows(model, description)
    loop = _Loop(stepper(model), description, options)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        first, iterations = loop.start(start, seen[0])
        steps = [first]
        for frame in range(len(description) - 1):
            steps.append(loop.step(steps[-1].state, seen[frame + 1], frame, frame + 1))
    return _generated(model, description, steps, iterations, time.perf_counter() - began)


class _Loop:
    """What stays the same from frame to frame."""

    def __init__(self, ready: Stepper, description: Description, options: Options):
        self.ready, self.options = ready, options
        self.wanted = description.effectors
        self.fps, self.limb = description.fps, description.limb
        self.shares = _shares(description, options) if options.ik else None

    def step(self, pose: Pose, window: Windows, now: int, then: int) -> Step:
        """Frame `then` out of the pose of frame `now`."""
        if self.options.blend:
            window = blended(window, pose.positions[self.ready.effectors] - self.wanted[now], self.fps)
        share = None if self.shares is None else self.shares[then]
        made = self.ready.step(pose, window, self.wanted[then], share, self.options.limits)
        _check_numbers(made, then)
        return made

    def start(self, pose: Pose | None, window: Windows) -> tuple[Step, int]:
        """The first frame (§7.7.1): the best of what the iterations came by, and how many there were."""
        if pose is None:
            velocities = (self.wanted[1] - self.wanted[0]) * self.fps
            pose = start_pose(self.ready.model, self.wanted[0], velocities, self.limb)
        places = pose.positions[self.ready.effectors]
        single = self.ready.model.settings.kind == "single"
        floating = pose.positions[list(self.ready.chains.joints)] if single else None
        best = Step(pose, pose, places, np.zeros(len(self.ready.model.skeleton)), floating)
        least, stale, count = self._off(best), 0, 0
        last = best
        while least > self.options.tolerance and count < self.options.pose_iterations and stale < _PATIENCE:
            last = self.step(last.state, window, 0, 0)
            count, stale = count + 1, stale + 1
            if self._off(last) < least - 1e-3:
                best, least, stale = last, self._off(last), 0
        return best, count

    def _off(self, step: Step) -> float:
        places = step.state.positions[self.ready.effectors]
        return float(np.sqrt(((places - self.wanted[0]) ** 2).sum(-1)).max())


def _shares(description: Description, options: Options) -> np.ndarray:
    """How much of the way to where it is wanted each effector is taken (T, 4): feet that are to stand, all of it."""
    places = description.effectors
    speed = np.linalg.norm(np.gradient(places, 1.0 / description.fps, axis=0), axis=-1)
    height = places[..., 2] - places[..., 2].min(axis=0)
    still = np.clip((_MOVING - speed) / (_MOVING - _STILL), 0.0, 1.0) * np.clip(2.0 - height / _LOW, 0.0, 1.0)
    still[:, :2] = 0.0
    return options.share + (1.0 - options.share) * still


def _windows(model: ThrowModel, description: Description) -> list[Windows]:
    """The window of the frame before the first, then those of all frames; the first two have the same phase."""
    before = description.effectors[:1] if description.before is None else description.before[-1:]
    longer = replace(
        description, effectors=np.concatenate([before, description.effectors]),
        before=None if description.before is None or len(description.before) < 2 else description.before[:-1],
        hands=None if description.hands is None else np.concatenate([description.hands[:1], description.hands]),
        release=description.release + 1.0,
    )
    phase = phases(description, model.reference)
    every = windows(longer)._replace(phase=np.concatenate([phase[:1], phase]))
    return [Windows(*(None if part is None else part[n] for part in every)) for n in range(len(longer))]


def _check(model: ThrowModel, description: Description) -> None:
    if abs(description.fps - model.settings.fps) > 1e-6:
        found = f"{description.fps:g} frames per second"
        raise InputError("description", found, f"the model's {model.settings.fps:g}", "sample it at that rate")
    if description.hands is None and model.settings.kind == "hierarchy" and model.settings.wrist == "given":
        raise InputError("description", "no rotations of the hands", "them, as the model was trained with them")


def _check_numbers(step: Step, frame: int) -> None:
    """InputError where networks answered what is no number, as they may where all is far from what they know."""
    if not (np.isfinite(step.pose.positions).all() and np.abs(step.pose.positions).max() < _FARTHEST):
        raise InputError("model", f"networks that lose the body in frame {frame}", "a body near its description",
                         "ask for what its examples are like, or train it longer")  # fmt: skip


def _generated(model, description: Description, steps: list[Step], iterations: int, seconds: float) -> Generated:
    root = np.stack([step.pose.root for step in steps])
    local = np.stack([step.pose.local for step in steps])
    effectors = list(stepper(model).effectors)
    return Generated(
        motion=motion_of(model.skeleton, root, local, description.fps),
        effectors=np.stack([step.pose.positions[effectors] for step in steps]),
        predicted=np.stack([step.predicted for step in steps]), wanted=description.effectors,
        over=np.stack([step.over for step in steps]),
        floating=None if steps[0].floating is None else np.stack([step.floating for step in steps]),
        iterations=iterations, seconds=seconds,
    )


@dataclass(frozen=True, eq=False)
class Stock:
    """Every frame of the examples. places (N, 4, 3) m and velocities (N, 4, 3) m/s of the effectors in the normalised
    frame; limb (N,); example, frame (N,) indices; late (N,) 0 at the beginning of its example, 1 at its end."""

    places: np.ndarray
    velocities: np.ndarray
    limb: np.ndarray
    example: np.ndarray
    frame: np.ndarray
    late: np.ndarray


@lru_cache(maxsize=8)
def stock(model: ThrowModel) -> Stock:
    """All frames of a model's examples; kept, as models are asked again and again. InputError where it has none."""
    if not model.examples:
        raise InputError("model: examples", "none", "one at least, to begin with", "train the model again")
    effectors = list(chains_of(model.skeleton).effectors)
    rows = []
    for index, example in enumerate(model.examples):
        places = forward_kinematics(example.motion)[0][:, effectors]
        count = len(places)
        velocity = np.gradient(places, 1.0 / example.motion.fps, axis=0) if count > 1 else np.zeros_like(places)
        many = np.full(count, 1)
        rows.append((places, velocity, many * example.limb, many * index, np.arange(count), np.linspace(0, 1, count)))
    return Stock(*(np.concatenate(column) for column in zip(*rows)))


def nearest(model: ThrowModel, places: np.ndarray, velocities: np.ndarray, limb: int) -> tuple[int, int, float]:
    """Example, frame and turn (radians about the upright) that fit effectors at places (4, 3) m, moving at velocities
    (4, 3) m/s, best; frames of the same limb before all others.

    A candidate may be moved over the ground and turned; heights have to fit."""
    among = stock(model)
    mine = places[:, :2] - places[:, :2].mean(axis=0)
    theirs = among.places[..., :2] - among.places[..., :2].mean(axis=1, keepdims=True)
    turn = np.arctan2(
        (theirs[..., 0] * mine[:, 1] - theirs[..., 1] * mine[:, 0]).sum(-1), (theirs * mine).sum((-1, -2))
    )
    turned = quaternion.turned_level(theirs, turn[:, None])
    swift = quaternion.turned_level(among.velocities[..., :2], turn[:, None])
    cost = ((turned - mine) ** 2).sum((-1, -2)) + ((among.places[..., 2] - places[:, 2]) ** 2).sum(-1)
    change = ((swift - velocities[:, :2]) ** 2).sum((-1, -2))
    change = change + ((among.velocities[..., 2] - velocities[:, 2]) ** 2).sum(-1)
    cost = cost + _SECONDS**2 * change + (_TURN * turn) ** 2 + (_LATE * among.late) ** 2
    cost = cost + 1e3 * (among.limb != limb)
    best = int(np.argmin(cost))
    return int(among.example[best]), int(among.frame[best]), float(turn[best])


def placed(model: ThrowModel, example: int, frame: int, turn: float, places: np.ndarray) -> Pose:
    """The pose of an example's frame, turned by `turn` radians and moved over the ground so that its effectors lie
    about places (4, 3) m; its joints move as they do there."""
    motion = model.examples[example].motion
    both = slice(max(frame - 1, 0), frame + 1)
    local = matrices(motion.frames(both.start, both.stop))
    root = motion.root_positions[both]
    spin = quaternion.to_matrix(quaternion.about_up(np.array(turn)))
    local = np.concatenate([(spin @ local[:, 0])[:, None], local[:, 1:]], axis=1)
    root = root @ spin.T
    positions, turns = places_and_turns(model.skeleton.offsets, model.skeleton.parents, root, local, np)
    effectors = list(chains_of(model.skeleton).effectors)
    shift = np.append((places - positions[-1, effectors])[:, :2].mean(axis=0), 0.0)
    return Pose(root[-1] + shift, local[-1], positions[-1] + shift, turns[-1], positions[-1] - positions[0])


def start_pose(model: ThrowModel, places: np.ndarray, velocities: np.ndarray, limb: int) -> Pose:
    """The examples' pose that begins a movement best, placed; arguments as of `nearest`."""
    return placed(model, *nearest(model, places, velocities, limb), places)
