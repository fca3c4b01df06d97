"""Generate a throw or kick at a target: plan from examples, generate with networks, correct until it hits.

    thrown = throw_at(model, ThrowRequest(target=(18.0, 2.0, 1.2)))

`throws.launch_planner` chooses the launch, `throws.networks.plan` blends a description from the model's examples,
`throws.networks.generate` generates the motion, `throws.correction` changes it as physics requires, and `ball.flight`
computes the flight of the ball.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..appearance.arm_clearance import clear_arms
from ..appearance.trunk import build_trunk
from ..ball.flight import Launch, find_crossing, simulate_flight
from ..base.errors import InputError, UserCancelledError
from ..motion.humanoid import estimate_stature, identify_joints
from ..motion.mirror import mirror
from ..motion.motion import Motion, place_motion, sample_frames_cubic
from ..motion.retargeting.neutral import build_neutral_stance
from ..motion.retargeting.retarget import Retargeter
from ..motion.skeleton import Skeleton
from .ball_release import AtFoot, InHand, compute_launch
from .corrected_motion import CorrectedMotion
from .correction import correct_motion
from .launch_planner import MAX_PLANS, LaunchPlanner, find_max_speed
from .networks.chains import EFFECTORS
from .networks.limits import LimbLimits
from .networks.model import ThrowModel
from .networks.plan import PlannedMotion, plan_motion
from .throw_request import KINDS, ThrowRequest, ThrowResult, build_ball_path, build_release_part

_MAX_BALL_HEIGHT = 0.25  # share of the stature: largest height above the ground of a ball that is kicked
STATURE_RANGE = (0.1, 10.0)
"""Range of the stature, m, of a body that throws."""
_WARN_SPEED_ERROR = 0.05  # share of the requested speed by which the ball's may differ without a warning
_WARN_LIMIT_EXCESS = np.radians(2.0)  # excess over joint limits that is reported
_MAX_DISPLACEMENT, _MAX_MISS = 0.15, 1.0
"""m: largest displacement of wrist or ankle and largest miss with which a throw is returned."""
_FOLLOW_THROUGH = 1.0  # s of flight beyond the target


def throw_at(
    model: ThrowModel, request: ThrowRequest, skeleton: Skeleton | None = None,
    progress: Callable[[float, str], None] | None = None, cancelled: Callable[[], bool] | None = None,
) -> ThrowResult:
    """Generate a throw or kick as requested.

    Args:
        model: the model.
        request: target and conditions.
        skeleton: any humanoid skeleton; None: the model's.
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop.
    Raises:
        InputError: if the skeleton lacks the limb or the model was not trained for it, or the target is out of reach
            of people or of the model's examples.
        UserCancelledError: if `cancelled` returns True.
    """
    def report_progress(share: float, text: str) -> None:
        if cancelled and cancelled():
            raise UserCancelledError("cancelled")
        if progress:
            progress(share, text)

    report_progress(0.0, "Planning")
    work = _ThrowGenerator(model, request, skeleton or model.skeleton)
    best = None
    for number, plan in enumerate(work.iter_plans()):
        report_progress(0.1 + 0.8 * number / MAX_PLANS, "Generating")
        placed = work.generate_placed(plan)
        report_progress(0.1 + 0.8 * (number + 0.6) / MAX_PLANS, "Correcting")
        correction = work.correct_motion(placed)
        if best is None or correction.cost < best[1].cost:
            best = placed, correction
        if correction.is_small:
            break
    return work.build_result(*best)


@dataclass(frozen=True, eq=False, kw_only=True)
class _PlacedMotion:
    """A generated motion at its final position, at the requested frame rate and on the requested skeleton.

    Attributes:
        plan: plan that it was generated from.
        motion: the motion.
        release: s of the release.
        network_deviation: m, mean distance of hands and feet from their targets before any correction.
        limits: joint limits of the limb.
    """

    plan: PlannedMotion
    motion: Motion
    release: float
    network_deviation: float
    limits: LimbLimits


class _ThrowGenerator:
    """Generation of one requested throw."""

    def __init__(self, model: ThrowModel, request: ThrowRequest, skeleton: Skeleton):
        self.model, self.request, self.skeleton = model, request, skeleton
        self.is_kick = model.settings.action == "kick"
        self.limb = EFFECTORS.index(request.limb) if request.limb else _find_usual_limb(model)
        self.max_speed = find_max_speed(model.settings.action)
        self._check_request()
        used = {example.limb for example in model.examples}
        self.mirrored = self.limb not in used and self.limb ^ 1 in used
        self.own_limb = self.limb ^ 1 if self.mirrored else self.limb
        kind = request.ball or ("football" if self.is_kick else "baseball")
        self.ball = KINDS[kind] if isinstance(kind, str) else kind
        self.target = np.maximum(np.asarray(request.target, float), [-np.inf, -np.inf, self.ball.radius])
        self.planner = LaunchPlanner(model, request, self.own_limb, self.ball, self.target)
        self.warnings: list[str] = []
        if request.target[2] < -self.ball.radius:
            self.warnings.append(
                f"the target is {-request.target[2]:.2f} m below the ground: the ball aims at the point above it"
            )

    def _check_request(self) -> None:
        """Raise InputError if limb, action, body or speed are impossible."""
        name, what = EFFECTORS[self.limb], self.model.settings.action
        if name.endswith("foot") != self.is_kick:
            raise InputError("throw", f"a {what} with the {name.replace('_', ' ')}", "a model trained for it",
                             f"this one was trained for {what}s: choose another model")  # fmt: skip
        body = identify_joints(self.skeleton)
        limb = getattr(body, name.split("_")[0])
        if not self.is_kick and None in (limb.upper_arm, limb.lower_arm, limb.hand):
            raise InputError("skeleton", f"a body without a {name.replace('_', ' ')}", "arms and hands",
                             "choose a skeleton with arms, or kick instead")  # fmt: skip
        if not STATURE_RANGE[0] <= estimate_stature(self.skeleton) <= STATURE_RANGE[1]:
            raise InputError("skeleton", f"a body of {estimate_stature(self.skeleton):.3g} m",
                             f"{STATURE_RANGE[0]:g} to {STATURE_RANGE[1]:g} m", "check the unit")  # fmt: skip
        most = _MAX_BALL_HEIGHT * estimate_stature(self.skeleton)
        if self._ball_height > most:
            raise InputError("ball", f"{self._ball_height:.2f} m above the ground",
                             f"at most {most:.2f} m, in reach of a foot", "move it down")  # fmt: skip
        if not self.model.examples:
            raise InputError("model", "no examples", "examples, from which motions are planned", "train it again")
        most = self.max_speed
        if self.request.speed and self.request.speed > most:
            raise InputError("speed", f"{self.request.speed:.0f} m/s", f"at most {most:.0f} m/s, the human limit")

    @property
    def _ball_height(self) -> float:
        """Height (m) above the ground of the centre of the ball that is kicked."""
        place = self.request.ball_place
        return float(place[2]) if place is not None and len(place) > 2 else 0.0

    def iter_plans(self) -> Iterator[PlannedMotion]:
        """Iterate over the plans to try: other paces, or other weights, if the first does not hit."""
        launches = self.planner.launches
        for request, seed in self.planner.list_launch_requests():
            yield plan_motion(launches.examples, launches.velocities, request, seed)

    # Generating, and placing the motion where it is requested.

    def generate_placed(self, plan: PlannedMotion) -> _PlacedMotion:
        """Generate the motion of a plan at its final position, with the requested frame rate and skeleton."""
        from .networks.frame_step import prepare_stepper
        from .networks.generate import generate_motion

        generated = generate_motion(self.model, plan.description)
        motion, release = generated.motion, plan.description.release / plan.description.fps
        own = motion = self._resample(motion)
        if self.mirrored:
            motion = mirror(motion)
        if not motion.skeleton.has_same_bones(self.skeleton):
            motion = Retargeter(motion, self.skeleton).retarget(motion)
        motion = clear_arms(motion, build_trunk(build_neutral_stance(self.skeleton, motion)))
        part = build_release_part(self.skeleton, self.limb, self.ball)
        limits = LimbLimits.from_motions(
            prepare_stepper(self.model).limits, own, build_release_part(own.skeleton, self.own_limb,
                                                                        self.ball).list_joints(own),
            target_motion=motion, joints=part.list_joints(motion), mirrored=self.mirrored,
        )
        frame = release * motion.fps
        hips = motion.root_positions[0, :2]
        motion = place_motion(motion, 0.0, (-hips[0], -hips[1], 0.0))
        ahead = np.array([plan.description.impact[0], 0.0, self.target[2]])
        ball_position, velocity, _ = compute_launch(motion, part, frame, ahead, self.ball)
        anchor = np.zeros(2)
        if self.request.ball_place is not None:
            anchor = ball_position[:2]
        elif self.request.over is not None:
            anchor = sample_frames_cubic(motion, np.array([frame]))[0][0, :2]
        begin, turn = self.planner.place_frame(anchor)
        return _PlacedMotion(plan=plan, motion=place_motion(motion, turn, (*begin, 0.0)), release=release,
                             network_deviation=float(np.mean(generated.network_deviation)), limits=limits)

    def _resample(self, motion: Motion) -> Motion:
        fps = self.request.fps or motion.fps
        if abs(fps - motion.fps) < 1e-9:
            return motion
        count = int(np.floor(motion.duration * fps + 1e-6)) + 1
        return Motion(motion.skeleton, *sample_frames_cubic(motion, np.arange(count) * (motion.fps / fps)), fps)

    # Correcting, and computing the flight of the ball.

    def _build_part(self) -> InHand | AtFoot:
        """Build the hand or foot that releases the ball."""
        lies = None
        if self.request.ball_place is not None:
            lies = np.array([*self.planner.find_position(), max(self._ball_height, self.ball.radius)])
        return build_release_part(self.skeleton, self.limb, self.ball, lies)

    def correct_motion(self, placed: _PlacedMotion) -> CorrectedMotion:
        """Correct the motion so that the ball hits, or passes as near as possible."""
        order, frame = self.request, placed.release * placed.motion.fps
        return correct_motion(placed.motion, self._build_part(), frame, target=self.target, ball=self.ball,
                              freedom=order.freedom, speed=order.speed,
                              limit_rotations=placed.limits.limit_rotations)  # fmt: skip

    def build_result(self, placed: _PlacedMotion, correction: CorrectedMotion) -> ThrowResult:
        """Build the result, with flight, ball path and warnings."""
        part, motion = self._build_part(), placed.motion
        beyond = float(placed.limits.measure_excess(correction.motion).max())
        self._check_correction(correction)
        release = correction.frame / motion.fps
        start = 0.0 if self.request.release_time is None else self.request.release_time - release
        launch = Launch(start + release, correction.position, correction.velocity, correction.spin)
        flight = simulate_flight(launch, self.ball, correction.seconds + _FOLLOW_THROUGH + correction.motion.duration)
        impact = find_crossing(flight, self.target)
        self._collect_warnings(correction, impact, beyond)
        return ThrowResult(
            motion=correction.motion, start_time=start, release=release, limb=EFFECTORS[self.limb], ball=self.ball,
            grip=getattr(part, "grip", None), path=build_ball_path(correction.motion, part, flight, start,
                                                                   correction.seconds + _FOLLOW_THROUGH), launch=launch,
            flight=flight, target=self.target, impact=impact, displacement=correction.displacement,
            shift=correction.shift, rotation=correction.rotation, pace=correction.pace,
            release_delay=correction.release_delay, foot_tilt=correction.tilt,
            start_offset=correction.start_offset, min_speed=self.planner.arcs.slowest,
            requested_speed=self.request.speed or float(np.linalg.norm(correction.velocity)),
            network_deviation=placed.network_deviation, limit_excess=beyond,
            examples=tuple(zip(placed.plan.names, map(float, placed.plan.weights))), warnings=tuple(self.warnings),
        )  # fmt: skip

    def _check_correction(self, correction: CorrectedMotion) -> None:
        """Raise InputError if the ball reaches the target only with an implausible pose, or never."""
        action = "kick" if self.is_kick else "throw"
        if correction.seconds <= 0.0 or correction.total_miss > _MAX_MISS:
            what = "the ball does not reach it"
        elif correction.displacement > _MAX_DISPLACEMENT:
            joint = "an ankle" if self.is_kick else "a wrist"
            what = f"it needs {joint} moved by {100 * correction.displacement:.0f} cm"
        else:
            return
        raise InputError("target", what, f"one that a {action} like the examples reaches",
                         "move a near target further away, a far one nearer or lower")  # fmt: skip

    def _collect_warnings(self, correction: CorrectedMotion, impact: np.ndarray, beyond: float) -> None:
        """Collect warnings about the result."""
        error = float(np.linalg.norm(impact - self.target))
        what, speed = ("ankle" if self.is_kick else "wrist"), float(np.linalg.norm(correction.velocity))
        if not error <= 0.10:
            missed = f"by {error:.2f} m" if np.isfinite(error) else "and does not reach it"
            self.warnings.append(f"the ball misses the target {missed}: the body cannot reach the required pose")
        if correction.displacement > 0.05:
            self.warnings.append(f"the {what} is moved by {100 * correction.displacement:.0f} cm so that the ball hits")
        if beyond > _WARN_LIMIT_EXCESS:
            self.warnings.append(f"a joint bends {np.degrees(beyond):.0f} degrees further than in any of the examples")
        if speed > self.max_speed:
            self.warnings.append(
                f"the ball leaves at {speed:.0f} m/s, above the human limit of {self.max_speed:.0f}: a body of "
                f"{estimate_stature(self.skeleton):.1f} m moves faster"
            )
        if self.request.speed and abs(speed - self.request.speed) > _WARN_SPEED_ERROR * self.request.speed:
            self.warnings.append(f"the ball leaves at {speed:.1f} m/s instead of {self.request.speed:.1f}")


def _find_usual_limb(model: ThrowModel) -> int:
    """Return the limb that most examples use, the right one if there are no examples."""
    limbs = [example.limb for example in model.examples]
    return int(np.bincount(limbs).argmax()) if limbs else (3 if model.settings.action == "kick" else 1)
