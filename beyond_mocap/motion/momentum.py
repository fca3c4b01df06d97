"""A centre of mass that obeys momentum: it flies on parabolas, and only feet on the ground push and brake it.

A curve x of the centre of mass and the force b that the ground gives per mass are solved together, as one banded least
squares problem per axis: x'' = b - g, b zero while no foot is on the ground, x near the constructed curve. The force of
a phase of support is a sum of hat functions about a frame apart with zero ends, which may begin and end between frames;
a second difference of x sees it through a triangle of +-1 frame, so contacts shorter than three frames stay exact.

Source: Reitsma and Pollard 2003, "Perceptual metrics for character animation": added acceleration in flight is what
people see. Strength: peaks of vertical force of sprinters and of braking steps (Weyand 2000; Harper 2022).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..base.banded_least_squares import BandedLeastSquares
from ..base.easing import smoothstep
from ..base.vectors import measure_lengths
from .supports import GRAVITY, list_flights

STRENGTH = 4.5
"""Greatest vertical force of the legs in body weights: sprinters reach 4.4 at top speed (Weyand 2000)."""

FRICTION = 1.0
"""Greatest level force as a share of the vertical one: boots on grass hold about that."""

_NEAR_LEVEL, _NEAR_UP = 0.02, 0.03  # m by which the curve may leave the constructed one, level and up
_EXACT = 0.5  # m/s^2 of acceleration that no force explains
_SMOOTH_LEVEL, _SMOOTH_UP = 10.0, 20.0  # m/s^2 of a force's third difference: a parabolic pulse costs nothing
_BLOCK_SECONDS, _BLOCK_LEVEL, _BLOCK_UP = 0.75, 0.004, 0.02  # m that the mean over a block may move: keeps the track
_BLOCK_SAMPLE = 1.0 / 10.0  # s between the frames of which a block's mean is taken
_STEP_FLIGHT = 0.2  # s; a longer flight is no step: what it moves grows with the square of its time
_FLIGHT_SECONDS, _FLIGHT_FADE = 0.4, 0.2  # s beside a flight in which momentum counts, and over which it fades
_WEIGHT_ELSEWHERE = 1e-4  # far from flights, where a body walks or stands, its recording knows better
_CLAMP_UP, _CLAMP_LEVEL = 1e3, 1e2  # weights of forces beyond strength and friction; friction is soft: tracks brake so
_CLAMP_ROUNDS = 2
_REST = 1e-9  # of a force that no term determines: it is 0
_RATE = 30.0  # frames per second at which the terms above have these weights
_HOLD = 1e4  # a curve that stays is held within a tenth of a millimetre
_FEWEST_SEGMENTS = 3  # of a phase of support, between knots of the force


class MomentumPlanner:
    """Plans the centre of mass over given phases of support.

    Args:
        phases: (P, 2) frames, first and last of each phase (`supports.find_support_phases`).
        count: T frames.
        fps: frames per second.
        share: (T,) from 0, where the constructed curve stays, to 1.
        strength: greatest vertical force in body weights.
    """

    def __init__(self, phases: np.ndarray, count: int, fps: float, share: np.ndarray, strength: float = STRENGTH):
        self.phases, self.count, self.fps, self.share, self.strength = phases, count, fps, share, strength
        self._ground: tuple[np.ndarray, BandedLeastSquares, np.ndarray] | None = None
        segments = np.maximum(np.round(phases[:, 1] - phases[:, 0]).astype(int), _FEWEST_SEGMENTS)
        spacing = (phases[:, 1] - phases[:, 0]) / segments
        inner = segments - 1
        self._phase = np.repeat(np.arange(len(phases)), inner)
        number = np.arange(inner.sum()) - np.repeat(np.cumsum(inner) - inner, inner) + 1
        self._spacing = spacing[self._phase]
        self._knots = phases[self._phase, 0] + number * self._spacing
        order = np.argsort(np.concatenate([np.arange(count), self._knots]), kind="stable")
        rank = np.empty(len(order), int)
        rank[order] = np.arange(len(order))
        self._frame_index, self._knot_index = rank[:count], rank[count:]

    def plan_height(self, height: np.ndarray, firmness: np.ndarray | float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Plan how the centre of mass goes up and down.

        Args:
            height: (T,) m, constructed.
            firmness: (T,) or one number, by which its weight is multiplied where legs reach no higher.
        Returns:
            Height (T,) m, and the vertical force (K,) m/s^2 at the knots.
        """
        squares = self._add_values(self._motion_up, height[:, None], firmness / _NEAR_UP**2, _BLOCK_UP)
        for _ in range(_CLAMP_ROUNDS + 1):
            solved = squares.solve()
            force = solved[self._knot_index, 0]
            allowed = np.clip(force, 0.0, self.strength * GRAVITY)
            beyond = np.abs(force - allowed) > 0.0
            if not beyond.any():
                break
            squares = squares.copy()
            self._hold_forces(squares, _CLAMP_UP * beyond, allowed[:, None])
        return self._mix(height, solved[self._frame_index, 0]), force

    def plan_ground(self, ground: np.ndarray, force_up: np.ndarray) -> np.ndarray:
        """Plan how the centre of mass moves over the ground.

        Args:
            ground: (T, 2) m, constructed, world.
            force_up: (K,) m/s^2 of `plan_height`: level forces stay within friction of it.
        Returns:
            (T, 2) m, world.
        """
        squares, solved = self._solve_ground(ground)
        most = FRICTION * np.maximum(force_up, 0.0)
        for done in range(_CLAMP_ROUNDS + 1):
            force = solved[self._knot_index]
            size = measure_lengths(force)
            beyond = size > most
            if done == _CLAMP_ROUNDS or not beyond.any():
                break
            squares = squares.copy()
            self._hold_forces(squares, _CLAMP_LEVEL * beyond,
                              force * (np.minimum(most, size) / np.maximum(size, 1e-9))[:, None])
            solved = squares.solve()
        return self._mix(ground, solved[self._frame_index])

    def _solve_ground(self, ground: np.ndarray) -> tuple[BandedLeastSquares, np.ndarray]:
        """Solve the level plan without friction; once for rounds in which only the height changes."""
        if self._ground is None or not np.array_equal(self._ground[0], ground):
            squares = self._add_values(self._motion_level, ground, 1.0 / _NEAR_LEVEL**2, _BLOCK_LEVEL)
            self._ground = ground.copy(), squares, squares.solve()
        return self._ground[1:]

    @cached_property
    def _motion_up(self) -> BandedLeastSquares:
        return self._build_motion(self._law.right, _SMOOTH_UP)

    @cached_property
    def _motion_level(self) -> BandedLeastSquares:
        return self._build_motion(np.zeros((self._law.count, 2)), _SMOOTH_LEVEL)

    @cached_property
    def _flights(self) -> np.ndarray:
        """(F, 2) frames, first and last of each flight."""
        return list_flights(self.phases, self.count)

    @cached_property
    def _weight(self) -> np.ndarray:
        """(T,) how much momentum counts: within and beside flights."""
        at, flights = np.arange(self.count), np.concatenate([[[-np.inf] * 2], self._flights, [[np.inf] * 2]])
        after = np.searchsorted(flights[:, 0], at, side="right")  # the first flight that begins behind a frame
        away = np.minimum(flights[after, 0] - at, np.maximum(at - flights[after - 1, 1], 0.0)) / self.fps
        beyond = (away - _FLIGHT_SECONDS) / _FLIGHT_FADE
        return self.share * _WEIGHT_ELSEWHERE ** smoothstep(np.clip(beyond, 0.0, 1.0))

    @cached_property
    def _looseness(self) -> np.ndarray:
        """(T,) by how many times farther the curve may leave the constructed one: in long flights, and beside them."""
        loose, reach = np.ones(self.count), _FLIGHT_SECONDS * self.fps
        for start, stop in self._flights[np.diff(self._flights, axis=1)[:, 0] > _STEP_FLIGHT * self.fps]:
            at = np.arange(max(int(start - reach), 0), min(int(stop + reach) + 1, self.count))
            away = np.maximum(np.maximum(start - at, at - stop), 0.0)
            near = smoothstep(np.clip(1.0 - away / reach, 0.0, 1.0))
            loose[at] = np.maximum(loose[at], ((stop - start) / self.fps / _STEP_FLIGHT) ** (2.0 * near))
        return loose

    @cached_property
    def _law(self) -> BandedLeastSquares:
        """Newton's law, upward; level only its goal differs, which is 0."""
        law = self._law_rows
        reach = max(int(np.ptp(index, axis=1).max(initial=1))
                    for index in (law[0], self._force_rows[0], self._block_index))
        squares = BandedLeastSquares(len(self._frame_index) + len(self._knot_index), reach=reach, columns=1)
        squares.add_rows(*law, self._weight[1:-1] / _EXACT**2, -GRAVITY)
        return squares

    def _build_motion(self, right: np.ndarray, smooth: float) -> BandedLeastSquares:
        """Build the terms of Newton's law, with its right-hand side (count, columns), and of smooth forces."""
        squares, forces = self._law.copy(), self._force_rows
        squares.right = right.copy()
        # sums over frames grow with the rate, and third differences shrink with its third power
        squares.add_rows(*forces, np.full(len(forces[0]), (self.fps / _RATE) ** 6 / smooth**2))
        self._hold_forces(squares, np.full(len(self._knots), _REST), np.zeros((len(self._knots), right.shape[1])))
        return squares

    @cached_property
    def _law_rows(self) -> tuple[np.ndarray, np.ndarray]:
        """x'' - b in frames 1 to T - 2: unknowns (T - 2, M) and coefficients (T - 2, M)."""
        at = np.arange(1, self.count - 1)
        # knots seen by a frame: those whose hat, as wide as its spacing, touches the triangle of +-1 frame
        first = np.searchsorted(self._knots + self._spacing, at - 1.0, side="right")
        most = int((np.searchsorted(self._knots - self._spacing, at + 1.0) - first).max(initial=0))
        seen = first[:, None] + np.arange(most)
        is_there = seen < len(self._knots)
        seen = np.minimum(seen, max(len(self._knots) - 1, 0))
        force = _overlap_hat(at[:, None] - self._knots[seen], self._spacing[seen]) * is_there
        frames = self._frame_index[at[:, None] + [-1, 0, 1]]
        rate = np.broadcast_to(self.fps**2 * np.array([1.0, -2.0, 1.0]), frames.shape)
        knots = np.where(force > 0.0, self._knot_index[seen], frames[:, 1:2])
        return np.concatenate([frames, knots], axis=1), np.concatenate([rate, -force], axis=1)

    @cached_property
    def _force_rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Third differences of the forces of a phase, 0 at its ends: unknowns (R, 4) and coefficients (R, 4)."""
        at = np.arange(len(self._knots))
        rows = at[:, None] + [-1, 0, 1, 2]  # of the segment behind each knot but the last of a phase
        rows = rows[np.append(self._phase[1:] == self._phase[:-1], False)[: len(at)]]
        inside = np.clip(rows, 0, max(len(at) - 1, 0))
        own = self._phase[inside] == self._phase[inside[:, 1:2]]
        is_knot = own & (rows == inside)
        return self._knot_index[np.where(is_knot, inside, inside[:, 1:2])], is_knot * np.array([-1.0, 3.0, -3.0, 1.0])

    @cached_property
    def _block_frames(self) -> np.ndarray:
        """(B, M) frames of half overlapping blocks, M of each."""
        step = max(int(round(_BLOCK_SAMPLE * self.fps)), 1)
        length = max(int(round(_BLOCK_SECONDS * self.fps)) // step, 1)
        starts = np.arange(0, max(self.count - length * step, 0) + 1, max(length * step // 2, 1))
        return np.minimum(starts[:, None] + step * np.arange(length), self.count - 1)

    @cached_property
    def _block_index(self) -> np.ndarray:
        """(B, M) unknowns of the blocks' frames."""
        return self._frame_index[self._block_frames]

    def _add_values(self, motion: BandedLeastSquares, curve: np.ndarray, weight: np.ndarray | float, block: float
                    ) -> BandedLeastSquares:
        """Add that x is near a curve (T, columns), in every frame and on average over blocks."""
        squares = motion.copy()
        weights, goals = np.zeros(squares.count), np.zeros((squares.count, curve.shape[1]))
        held = weight / self._looseness**2 * (1.0 + _HOLD * (1.0 - self.share))
        weights[self._frame_index], goals[self._frame_index] = held, curve
        squares.add_value(weights, goal=goals)
        samples = self._block_frames.shape[1]
        firm = np.full(len(self._block_index), self.fps / _RATE / block**2)
        squares.add_rows(self._block_index, np.full(samples, 1.0 / samples), firm,
                         curve[self._block_frames].mean(axis=1))
        return squares

    def _hold_forces(self, squares: BandedLeastSquares, weight: np.ndarray, goal: np.ndarray) -> None:
        """Add weight (K,) on the forces at the knots being a goal (K, columns)."""
        weights, goals = np.zeros(squares.count), np.zeros((squares.count, goal.shape[1]))
        weights[self._knot_index], goals[self._knot_index] = weight, goal
        squares.add_value(weights, goal=goals)

    def _mix(self, constructed: np.ndarray, planned: np.ndarray) -> np.ndarray:
        """Mix both curves by the share of each frame."""
        share = self.share.reshape(-1, *np.ones(constructed.ndim - 1, int))
        return constructed + share * (planned - constructed)


def _overlap_hat(away: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """Compute the integral of a hat function times the triangle of +-1 frame.

    Both are second differences of ramps; two ramps convolve to a cubic, of which each takes its second difference.

    Args:
        away: (...) frames between their middles.
        spacing: (...) frames, half width of the hat, which is 1 high.
    Returns:
        (...) frames.
    """
    out = np.zeros(np.broadcast_shapes(away.shape, spacing.shape))
    for i, outer in ((-1, 1.0), (0, -2.0), (1, 1.0)):
        for j, inner in ((-1, 1.0), (0, -2.0), (1, 1.0)):
            out += outer * inner * np.maximum(away + i * spacing + j, 0.0) ** 3
    return np.maximum(out / (6.0 * spacing), 0.0)
