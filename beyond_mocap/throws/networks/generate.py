"""A throw or kick out of its description: a start pose from the examples, then one frame after the other (Fredriksson
§7.7)."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError
from ...motion.motion import Motion
from .description import Description, Windows, phases, windows
from .frame_step import Step, Stepper, blended, stepper
from .kinematics import Pose, motion_of
from .model import ThrowModel
from .start import start_pose

_STILL, _MOVING = 0.15, 0.6  # m/s: a toe that is to be slower stands, a faster one does not
_LOW = 0.03  # metres above its lowest place up to which a toe may stand
_FARTHEST = 1e4  # metres from where it began at which a body is lost
_PATIENCE = 8  # iterations of the start pose that may pass without a millimetre's gain


@dataclass(frozen=True)
class Options:
    """How a motion is generated.

    pose_iterations, tolerance: the start pose is predicted again until hands and feet are within `tolerance` metres of
    where they are to be, or so many times (§7.7.1: 75, 0.01). ik: limbs are corrected in each frame, by `share` of
    the way to where they are wanted (feet that are to stand, all of it), before the next is predicted (§7.7.3).
    blend: networks see trajectories that begin where hands and feet are. limits: joints stay within the range of the
    training data, and what networks are asked stays near it, so that no error feeds itself (§9.4).
    """

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
    iterations: of the start pose. seconds: what it took.
    """

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
    model has to be given, or its networks lose the body.
    """
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
        best = Step(pose, pose, places, np.zeros(len(self.ready.model.skeleton)), self._floating(pose))
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

    def _floating(self, pose: Pose) -> np.ndarray | None:
        single = self.ready.model.settings.kind == "single"
        return pose.positions[list(self.ready.chains.joints)] if single else None


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
        description,
        effectors=np.concatenate([before, description.effectors]),
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
        predicted=np.stack([step.predicted for step in steps]),
        wanted=description.effectors,
        over=np.stack([step.over for step in steps]),
        floating=None if steps[0].floating is None else np.stack([step.floating for step in steps]),
        iterations=iterations,
        seconds=seconds,
    )
