"""A take as vertex arrays and lines of text, computed before anything is drawn. Metres, the track's clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from . import colours, shapes

if TYPE_CHECKING:  # the core's modules are slow to import, and enabling the extension must be quick
    from ...beyond_mocap.evaluation.per_frame import Footprint, PerFrame, Strike
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.synthesis.plan import Plan, ResolvedPlan
    from ...beyond_mocap.synthesis.search.explanation import ChoiceReason
    from ...beyond_mocap.synthesis.take import Take

RAIL, SOLE, SOLE_EDGE, TRANSITION = 0.020, 0.024, 0.027, 0.030  # metres above the ground, each above the one before
RAILS, HALF_TRANSITION = (0.13, 0.17), 0.35
SPEED_FOOT, PER_SPEED = 0.05, 0.2  # metres of the speed curtain's lower edge, and of its height for each m/s
BALL_SECONDS = 1.0
ARROW, HEADING, HEADING_SECONDS = 0.45, 0.032, 0.5  # m long, m above the ground, s from one arrow to the next
MOST_PARTS = 4


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles or lines to draw.

    Attributes:
        kind: "TRIS" or "LINES".
        points: (N, 3) float32 metres.
        colours: (N, 4) float32.
        width: of lines, in pixels.
    """

    kind: str
    points: np.ndarray
    colours: np.ndarray
    width: float = 1.0


def build_line_mesh(points: np.ndarray, colour, width: float, alpha: float = 1.0) -> Mesh:
    """Build a polyline through points (T, 3) m."""
    return build_uniform_mesh(shapes.build_polyline(points), colour, width, alpha)


def build_segments_mesh(start: np.ndarray, end: np.ndarray, colour, width: float, alpha: float = 1.0) -> Mesh:
    """Build lines from start to end, both (..., 3) m."""
    points = np.stack([start, end], axis=-2).reshape(-1, 3).astype(np.float32)
    return build_uniform_mesh(points, colour, width, alpha)


def build_uniform_mesh(points: np.ndarray, colour, width: float, alpha: float = 1.0) -> Mesh:
    """Build lines of one colour between pairs of points (2 N, 3) m."""
    return Mesh("LINES", points, colours.repeat_colour(colour, len(points), alpha), width)


@dataclass(frozen=True)
class Piece:
    """One uncut piece of a take.

    Attributes:
        start: seconds.
        end: seconds.
        place: (3,) metres, its transition on the ground.
        name: of the clip, short.
        lines: why it was chosen.
    """

    start: float
    end: float
    place: tuple[float, float, float]
    name: str
    lines: tuple[str, ...]


@dataclass(frozen=True)
class Label:
    """Text at a place.

    Attributes:
        time: seconds that it is about.
        place: (3,) metres.
        text: one line.
    """

    time: float
    place: tuple[float, float, float]
    text: str


@dataclass(frozen=True, eq=False)
class PreparedTake:
    """Everything to draw of one take.

    Attributes:
        start: its first second.
        fps: frames per second.
        count: frames.
        meshes: overlay -> its meshes.
        pelvis: (T, 3) metres.
        toes: (T, 2, 3) metres, left and right.
        contacts: (T, 2) bool, contact of left and right foot.
        figures: (T, J, 3) metres of the joints.
        pairs: (B, 2) joints of the lines of stick figures.
        pair_colours: (2 B, 4) of these lines.
        transitions: frames.
        pieces: by time.
        labels: by time.
    """

    start: float
    fps: float
    count: int
    meshes: dict[str, tuple[Mesh, ...]]
    pelvis: np.ndarray
    toes: np.ndarray
    contacts: np.ndarray
    figures: np.ndarray
    pairs: np.ndarray
    pair_colours: np.ndarray
    transitions: tuple[int, ...]
    pieces: tuple[Piece, ...]
    labels: tuple[Label, ...]

    def find_frame(self, seconds: float) -> int:
        """Find the output frame nearest to a second, within the take."""
        return min(max(round((seconds - self.start) * self.fps), 0), self.count - 1)

    def find_piece(self, seconds: float) -> Piece | None:
        """Find the piece that is played at a second."""
        return next((p for p in self.pieces if p.start <= seconds < p.end), None)


def prepare_take(plan: "Plan", take: "Take", library: "Library | None") -> PreparedTake:
    """Build everything to draw of one take.

    Args:
        plan: its plan.
        take: the take.
        library: of its clips; None: no comparison with recordings.
    Returns:
        Meshes and texts.
    """
    from ...beyond_mocap.evaluation.per_frame import find_footprints, find_strikes, measure_per_frame
    from ...beyond_mocap.evaluation.view import View
    from ...beyond_mocap.synthesis.quality.playback import playback_from_take
    from ...beyond_mocap.synthesis.resolve_plan import resolve_plan

    resolved = None if library is None else resolve_plan(plan, library, trajectory=take.solved)
    view = View(playback_from_take(take), plan.track, take.timeline, library)
    figures, strike_list = measure_per_frame(view), find_strikes(view)
    positions = view.played.positions.astype(np.float32)
    ground = view.played.pelvis if view.target is None else figures.track
    skeleton = take.motion.skeleton
    pairs = shapes.list_figure_pairs(skeleton.parents)
    meshes = {"track": _build_track(figures),
              "footprints": _build_footprints(find_footprints(view)),
              "seams": _build_transitions(view.played.pelvis, take.seams),
              "moments": _build_moments(strike_list, take),
              "speed": _build_speed(ground, figures),
              "heading": () if resolved is None else build_heading_arrows(resolved)}
    return PreparedTake(start=float(take.start_time), fps=float(take.motion.fps), count=len(take.motion),
                        meshes={name: found for name, found in meshes.items() if found},
                        pelvis=positions[:, view.played.body.hips], toes=view.played.feet[:, :, 1].astype(np.float32),
                        contacts=view.played.contacts, figures=positions, pairs=pairs,
                        pair_colours=_build_pair_colours(skeleton.names, pairs),
                        transitions=tuple(int(seam) for seam in take.seams),
                        pieces=_build_pieces(resolved, take, library, view.played.pelvis),
                        labels=tuple(_build_label(strike) for strike in strike_list))


def _build_track(figures: "PerFrame") -> tuple[Mesh, ...]:
    """Build rails along the measured track, coloured by root error, with footprints visible in between."""
    if len(figures.times) < 2 or not np.isfinite(figures.track).all():
        return ()
    points, owner = shapes.build_rails(figures.track, *RAILS, RAIL)
    return (Mesh("TRIS", points, colours.map_to_colours(figures.root_error, colours.ROOT_STOPS, 0.9)[owner]),)


def _build_footprints(found: tuple["Footprint", ...]) -> tuple[Mesh, ...]:
    """Build soles coloured by slide, with edges coloured by side."""
    if not found:
        return ()
    side = np.array([p.side for p in found])
    places = [np.array([getattr(p, name) for p in found]) for name in ("heel", "toe", "direction")]
    fill, edge = shapes.build_soles(*places, side, SOLE)
    slide = colours.map_to_colours(np.array([p.slide for p in found]), colours.SLIDE_STOPS, 0.8)
    sides = np.array([(*colours.LEFT, 1.0), (*colours.RIGHT, 1.0)], np.float32)[side]
    edge[:, 2] = SOLE_EDGE
    return (Mesh("TRIS", fill, slide.repeat(len(fill) // len(found), axis=0)),
            Mesh("LINES", edge, sides.repeat(len(edge) // len(found), axis=0), 2.0))


def _build_transitions(pelvis: np.ndarray, seams: np.ndarray) -> tuple[Mesh, ...]:
    """Build a bar across the path at every transition, light on dark."""
    if not len(seams):
        return ()
    points = shapes.build_bars(pelvis, np.asarray(seams, int), HALF_TRANSITION, TRANSITION)
    return build_uniform_mesh(points, colours.BLACK, 5.0, 0.8), build_uniform_mesh(points, colours.TRANSITION, 2.5)


def _build_moments(found: tuple["Strike", ...], take: "Take") -> tuple[Mesh, ...]:
    """Build strike points, the ball and its trajectory around them, and the gap between both."""
    from ...beyond_mocap.motion.track import BALL_RADIUS

    lines: list[tuple[np.ndarray, tuple]] = []
    for strike in found:
        lines.append((shapes.build_cross(strike.part, 0.06), colours.STRIKE))
        if strike.ball is None:
            continue
        lines.append((shapes.build_circle(strike.ball, BALL_RADIUS, up=True), colours.BALL))
        lines.append((np.array([strike.part, strike.ball], np.float32), colours.GAP))
        near = np.abs(take.ball.times - strike.time) <= BALL_SECONDS
        if near.sum() > 1:
            lines.append((shapes.build_polyline(take.ball.positions[near]), colours.BALL))
    if not lines:
        return ()
    points = np.concatenate([points for points, _ in lines]).astype(np.float32)
    return (Mesh("LINES", points, np.concatenate([colours.repeat_colour(rgb, len(p)) for p, rgb in lines]), 2.0),)


def _build_speed(path: np.ndarray, figures: "PerFrame") -> tuple[Mesh, ...]:
    """Build the track's speed as a curtain, and the body's as a line."""
    if len(path) < 2 or not np.isfinite(figures.requested_speed).all() or not np.isfinite(path).all():
        return ()
    track_height, played = (SPEED_FOOT + PER_SPEED * values for values in (figures.requested_speed, figures.speed))
    fill = shapes.build_curtain(path, track_height, SPEED_FOOT)
    over = [np.concatenate([path, top[:, None]], axis=1) for top in (track_height, played)]
    return (Mesh("TRIS", fill, colours.repeat_colour(colours.TRACK_SPEED, len(fill), 0.22)),
            build_line_mesh(over[0], colours.TRACK_SPEED, 1.5), build_line_mesh(over[1], colours.BODY_SPEED, 2.0))


def build_heading_arrows(plan: "ResolvedPlan") -> tuple[Mesh, ...]:
    """Build an arrow along the planned heading every HEADING_SECONDS, and at both ends of every heading key.

    Returns:
        Two meshes, a dark edge and the arrows; none for a method without a heading plan.
    """
    sampled, keys = plan.sample_track(plan.fps), plan.requested.heading_keys
    if sampled.heading is None:
        return ()
    ends = [second for key in keys for second in (key.time, key.time + key.hold)]
    frames = np.round((np.array(ends) - sampled.times[0]) * sampled.fps).astype(int)
    regular = np.arange(0, len(sampled), max(1, round(HEADING_SECONDS * sampled.fps)))
    rows = np.union1d(regular, frames[(frames >= 0) & (frames < len(sampled))])
    points = shapes.build_arrows(plan.size * sampled.positions[rows], sampled.heading[rows], ARROW, HEADING)
    times, half = sampled.times[rows], 0.5 / sampled.fps
    is_held = np.zeros(len(rows), dtype=bool)
    for key in keys:
        is_held |= (times >= key.time - half) & (times <= key.time + key.hold + half)
    rgba = np.where(is_held[:, None], (*colours.HEADING_KEY, 1.0), (*colours.HEADING, 1.0)).astype(np.float32)
    edge = build_uniform_mesh(points, colours.BLACK, 5.0, 0.8)
    return edge, Mesh("LINES", points, rgba.repeat(len(points) // len(rows), axis=0), 2.5)


def _build_pair_colours(names: tuple[str, ...], pairs: np.ndarray) -> np.ndarray:
    from ...beyond_mocap.motion.humanoid import split_joint_name

    table = {"left": colours.LEFT, "right": colours.RIGHT}
    of_joint = [table.get(split_joint_name(names[joint])[0], colours.MIDDLE) for _, joint in pairs]
    return np.array([(*rgb, 0.75) for rgb in of_joint], np.float32).repeat(2, axis=0)


def _build_label(strike: "Strike") -> Label:
    gap_text = f"  gap {1000 * strike.gap:.0f} mm" if np.isfinite(strike.gap) else ""
    place = strike.part if strike.ball is None else strike.ball
    return Label(strike.time, tuple(map(float, place)), f"{strike.time:.2f} s  {' '.join(strike.words)}{gap_text}")


def _build_pieces(plan: "ResolvedPlan | None", take: "Take", library: "Library | None",
                  pelvis: np.ndarray) -> tuple[Piece, ...]:
    """Build the pieces, with the reasons of the search if the library is known."""
    last = len(pelvis) - 1
    return tuple(Piece(take.start_time + start, take.start_time + end,
                       (*map(float, pelvis[min(int(round(start * take.motion.fps)), last)]), TRANSITION), name, lines)
                 for start, end, name, lines in _iter_pieces(plan, take, library))


def _iter_pieces(plan: "ResolvedPlan | None", take: "Take", library: "Library | None"):
    """Iterate over start and end (seconds from the take's first), name and lines of every piece."""
    from ...beyond_mocap.synthesis.search.explanation import explain_choices

    if library is None or plan is None or take.edit is None:
        edges = [0, *map(int, take.seams), len(take.clip)]
        for low, high in zip(edges, edges[1:]):
            name = shorten_clip_name(take.clips[take.clip[low]], bool(take.mirrored[low]))
            clip_frames = take.clip_frame[[low, high - 1]]
            frames_text = f"frames {clip_frames[0]:.0f} to {clip_frames[1]:.0f}"
            yield low / take.motion.fps, high / take.motion.fps, name, (name, frames_text)
        return
    for reason in explain_choices(library, plan, take.edit):
        name = shorten_clip_name(reason.path, reason.mirrored)
        yield reason.first / library.fps, reason.end / library.fps, name, describe_reason(reason, name)


def describe_reason(reason: "ChoiceReason", name: str) -> tuple[str, ...]:
    """Describe why a piece was chosen.

    Args:
        reason: of the search.
        name: of the clip.
    Returns:
        Lines: name, frames, costs, the next candidates.
    """
    from ...beyond_mocap.synthesis.search.cost_weights import TERMS

    lines = [name, f"frames {reason.clip_range[0]:.0f} to {reason.clip_range[1]:.0f}, played at {reason.rate:.2f} x"]
    lines.append(
        f"cost {reason.cost:.2f}" + (f", {sum(reason.cut_costs.values()):.2f} of it for the cut" if reason.cut_costs
                                     else "")
    )
    both = {part: reason.costs.get(part, 0.0) + reason.cut_costs.get(part, 0.0) for part in TERMS}
    costliest = sorted((p for p in both.items() if abs(p[1]) >= 0.005), key=lambda part: -abs(part[1]))[:MOST_PARTS]
    lines += [f"{value:.2f}  {TERMS[part]}" for part, value in costliest]
    if reason.others:
        lines.append("next candidates:")
        lines += [f"{other.extra_cost:+.2f}  {shorten_clip_name(other.path, other.mirrored)}"
                  for other in reason.others]
    return tuple(lines)


def shorten_clip_name(path: str, mirrored: bool) -> str:
    """Shorten a clip's path to its name, with a note if it is mirrored."""
    name = path.rpartition("/")[2].removesuffix(".bvh")
    return f"{name} (mirrored)" if mirrored else name
