"""Plots of one take: curves and bars over time, and stick figures, each a PNG as bytes, drawn by matplotlib.

matplotlib is imported inside the functions, because only these plots need it; no window and no global state are used.
"""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np

from ..base.time_series import find_runs
from ..motion.contacts import measure_floor_height
from ..motion.humanoid import compute_heading_from_positions, split_joint_name
from ..motion.motion import ACCEPTED_RATES
from ..motion.quaternion import from_up_angle, rotate
from ..motion.track import BALL_RADIUS
from ..synthesis.quality import movement
from ..synthesis.quality.playback import compute_playback_rate
from . import realism
from .annotation_similarity import fill_automatic_spans, list_requested_labels
from .view import View

WIDTH = 11.0
DPI = 100
LEFT, RIGHT, MIDDLE, BALL = "#2563a8", "#c0392b", "#333333", "#e08a00"
_SIDES = {"left": LEFT, "right": RIGHT}
_MAX_ROWS = 30
_SPACING = 1.3  # metres between two figures of a strip


def draw_curves(view: View) -> bytes:
    """Draw root error, feet, speed and smoothness over time, one above the other.

    Args:
        view: the take beside its library and track.
    Returns:
        A PNG.
    """
    canvas, axes = _create_panels(2.0, 2.0, 2.0, 1.6)
    for draw, ax in zip((_draw_root, _draw_feet, _draw_speed, _draw_smoothness), axes):
        draw(ax, view)
        _mark_moments(ax, view)
    _draw_time_axis(axes[-1], view)
    return render_png(canvas)


def choose_clip_colours(view: View) -> dict[int, tuple[int, str]]:
    """Choose number and colour of each played clip.

    Args:
        view: the take beside its library and track.
    Returns:
        Clip index -> (number on the bars of `draw_clips`, colour "#rrggbb"), most played first.
    """
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    table = [to_hex(c) for name in ("Set2", "Pastel1", "Set3") for c in getattr(colormaps[name], "colors")]
    used, counts = np.unique(view.played.clip[view.played.clip >= 0], return_counts=True)
    order = used[np.argsort(-counts, kind="stable")]
    return {int(clip): (place + 1, table[place % len(table)]) for place, clip in enumerate(order)}


def draw_clips(view: View) -> bytes:
    """Draw which clip plays when, by the numbers of `choose_clip_colours`, with transitions and playback rate.

    Args:
        view: the take beside its library and track.
    Returns:
        A PNG.
    """
    canvas, (bar, warp) = _create_panels(0.8, 1.4)
    names = choose_clip_colours(view)
    edges = [0, *view.transitions, view.count]
    for low, high in zip(edges[:-1], edges[1:]):
        _draw_clip_bar(bar, view, low, high, names)
    bar.set_yticks([])
    _draw_title(bar, "clips and transitions; ' marks a mirrored clip", "clip")
    rate = np.append(compute_playback_rate(*view.source), np.nan)
    rate[view.transitions - 1] = np.nan
    warp.plot(view.played.times, rate, color=MIDDLE, lw=1)
    for limit in ACCEPTED_RATES:
        warp.axhline(limit, color="#999999", lw=0.8, ls="--")
    _draw_title(warp, "playback rate", "played / recorded")
    _mark_moments(warp, view)
    _draw_time_axis(warp, view)
    return render_png(canvas)


def draw_labels(view: View) -> bytes | None:
    """Draw requested labels (upper half of each row) and played ones (lower half).

    Args:
        view: the take beside its library and track.
    Returns:
        A PNG; None without labels.
    """
    if view.played.words is None:
        return None
    played = [frozenset(w) for w in view.played.words]
    requested = [None] * view.count
    if view.timeline is not None:
        requested = list_requested_labels(fill_automatic_spans(view), view.played.times, view.moments)
    rows = list(dict.fromkeys(word for pair in zip(requested, played) for words in pair
                              for word in sorted(words or ())))
    for moment in view.moments:
        rows += [word for word in moment.requested.words if word not in rows]
    rows = rows[:_MAX_ROWS]
    if not rows:
        return None
    canvas, (ax,) = _create_panels(0.5 + 0.24 * len(rows))
    for row, word in enumerate(rows):
        _draw_bars(ax, view, np.array([word in (w or ()) for w in requested]), row - 0.38, "#8fb8de")
        _draw_bars(ax, view, np.array([word in w for w in played]), row + 0.02, "#3c7d4e")
        times = [m.requested.resolved_time for m in view.moments if word in m.requested.words]
        ax.plot(times, [row - 0.2] * len(times), "v", color=RIGHT, ms=6)
    ax.set_yticks(range(len(rows)), rows)
    ax.set_ylim(len(rows) - 0.5, -0.5)
    _draw_title(ax, "labels: requested (blue; red: key moments) above played (green)")
    ax.grid(axis="y", visible=False)
    _draw_time_axis(ax, view)
    return render_png(canvas)


def draw_strip(view: View, frames: Sequence[int], marked: int | None = None) -> bytes:
    """Draw stick figures side by side, seen from the body's left and slightly from the front; left blue, right red.

    The ball is drawn where it is near.

    Args:
        view: the take beside its library and track.
        frames: output frames, in drawing order.
        marked: the frame with a bold label, or None.
    Returns:
        A PNG.
    """
    middle = frames[len(frames) // 2]
    heading = float(compute_heading_from_positions(view.played.motion.skeleton, view.played.positions[middle]))
    rotation = from_up_angle(np.array(-heading + np.radians(20.0)))
    top = max(1.6, float(view.played.positions[list(frames), :, 2].max()) + 0.15)
    span = len(frames) * _SPACING
    canvas, (ax,) = _create_panels((top + 0.35) * WIDTH / span)
    for number, frame in enumerate(frames):
        _draw_pose(ax, view, frame, rotation, number * _SPACING)
        weight = "bold" if frame == marked else "normal"
        label = f"{view.played.times[frame]:.2f} s"
        ax.text(number * _SPACING, -0.1, label, ha="center", va="top", fontsize=8, weight=weight)
    ax.axhline(0.0, color="#4a7a4a", lw=0.8)
    ax.set_xlim(-0.5 * _SPACING, span - 0.5 * _SPACING)
    ax.set_ylim(-0.35, top)
    ax.set_aspect("equal")
    ax.axis("off")
    return render_png(canvas)


def create_canvas(height: float, rows: int = 1, **layout):
    """Create a figure without a window.

    Args:
        height: inches.
        rows: number of axes, one below the other.
        layout: arguments of `Figure.subplots`.
    Returns:
        The figure, and its axes from the top down.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
    axes = figure.subplots(rows, squeeze=False, **layout).ravel()
    style_axes(axes)
    return figure, axes


def style_axes(axes) -> None:
    """Apply the common style: a faint grid behind, no frame at the top and right, small text.

    Args:
        axes: the axes.
    """
    for ax in axes:
        ax.grid(color="#e6e6e6", lw=0.6)
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=8)
        ax.yaxis.label.set_fontsize(8)


def render_png(figure) -> bytes:
    """Render a figure as a PNG without metadata of the program.

    Args:
        figure: a matplotlib figure.
    Returns:
        The PNG.
    """
    out = io.BytesIO()
    figure.savefig(out, format="png", metadata={"Software": None})
    return out.getvalue()


def _draw_root(ax, view: View) -> None:
    _draw_title(ax, "distance from the track", "cm")
    if view.target is None:
        ax.text(0.5, 0.5, "no track", ha="center", va="center", transform=ax.transAxes, fontsize=9,
                color="#777777")
        return
    times, pelvis = view.played.times, view.played.pelvis
    error, smooth = movement.measure_pelvis_error(pelvis, view.target), movement.measure_root_error(pelvis, view.target,
            view.fps)
    ax.plot(times, 100 * error, color="#bbbbbb", lw=1, label="pelvis with its sway")
    ax.plot(times, 100 * smooth, color=LEFT, lw=1.4, label="root (1.5 s window)")
    ax.axhline(1.5, color="#999999", lw=0.8, ls="--", label="target for 95 % of root")
    ax.set_ylim(bottom=0.0)
    _draw_legend(ax, 3)


def _draw_feet(ax, view: View) -> None:
    played = view.played
    times, toes = played.times, played.feet[:, :, 1, 2] - measure_floor_height(played.motion, played.positions)
    for side, (name, colour) in enumerate(_SIDES.items()):
        ax.plot(times, 100 * toes[:, side], color=colour, lw=1, label=f"{name} toe")
        in_contact = view.played.contacts[:, side]
        _draw_bars(ax, view, in_contact, bottom=-5.0 - 4.0 * side, colour=colour, height=3.0)
    ax.set_ylim(bottom=-11.0)
    _draw_title(ax, "toe heights; bars: foot in contact", "cm")
    _draw_legend(ax, 2)


def _draw_speed(ax, view: View) -> None:
    times = view.played.times
    if view.target is not None:
        ax.plot(times, movement.measure_travel_speed(view.target, view.fps), color="#8fb8de", lw=3, label="track")
    ax.plot(times, view.speed, color=MIDDLE, lw=1, label="played")
    if view.reference is not None and np.isfinite(view.reference.fastest):
        ax.axhline(ACCEPTED_RATES[1] * view.reference.fastest, color=RIGHT, lw=0.8, ls="--",
                   label=f"fastest recording x {ACCEPTED_RATES[1]}")
    ax.set_ylim(bottom=0.0)
    _draw_title(ax, "speed", "m/s")
    _draw_legend(ax, 3)


def _draw_smoothness(ax, view: View) -> None:
    """Draw the smoothness of Faustino's App. D, with the transitions and the recordings' level."""
    played = view.played
    curve = realism.measure_smoothness(played.motion.skeleton, played.positions, view.fps)
    ax.plot(played.times[1:], 100 * curve, color=MIDDLE, lw=1, label="from the previous frame")
    if view.reference is not None:
        level = view.reference.smoothness_p95[movement.classify_speed(view.speed)]
        ax.plot(played.times, 100 * level, color=LEFT, lw=1, ls="--", label="95 % of recordings at that speed")
    for number, seam in enumerate(view.transitions):
        label = "transition" if number == 0 else None
        ax.axvline(played.times[seam], color=BALL, lw=0.8, alpha=0.7, zorder=0, label=label)
    ax.set_ylim(bottom=0.0)
    _draw_title(ax, "smoothness: distance of features (Faustino App. D)", "cm")
    _draw_legend(ax, 3)


def _mark_moments(ax, view: View) -> None:
    for moment in view.moments:
        ax.axvline(moment.requested.resolved_time, color=RIGHT, lw=0.9, ls=":", zorder=0)


def _draw_clip_bar(ax, view: View, low: int, high: int, names: dict[int, tuple[int, str]]) -> None:
    number, colour = names.get(int(view.played.clip[low]), ("", "#dddddd"))
    start, width = view.played.times[low], (high - low) / view.fps
    ax.broken_barh([(start, width)], (0.0, 1.0), facecolors=colour, edgecolors="white", linewidth=0.8)
    label = f"{number}'" if view.played.mirrored[low] else f"{number}"
    if width / (view.count / view.fps) > 0.008 * len(label):
        ax.text(start + width / 2, 0.5, label, ha="center", va="center", fontsize=8)


def _draw_bars(ax, view: View, flags: np.ndarray, bottom: float, colour: str, height: float = 0.36) -> None:
    """Draw a bar wherever flags (T,) are True."""
    spans = [(view.played.start_time + a / view.fps, (b - a) / view.fps) for a, b in find_runs(flags)]
    ax.broken_barh(spans, (bottom, height), facecolors=colour, linewidth=0)


def _draw_pose(ax, view: View, frame: int, rotation: np.ndarray, offset: float) -> None:
    """Draw one pose and the ball, with the pelvis at `offset`."""
    skeleton, positions = view.played.motion.skeleton, view.played.positions[frame]
    origin = positions[view.played.body.hips] * [1.0, 1.0, 0.0]
    rotated = rotate(rotation, positions - origin)
    for joint, parent in enumerate(skeleton.parents):
        if parent > 0 or (parent == 0 and view.played.body.hips == 0):
            colour = _SIDES.get(split_joint_name(skeleton.names[joint])[0], MIDDLE)
            ax.plot(offset + rotated[[parent, joint], 0], rotated[[parent, joint], 2], color=colour, lw=1.6, zorder=2)
    ball = view.played.ball
    centre = None if ball is None else ball.positions[np.argmin(np.abs(ball.times - view.played.times[frame]))]
    if centre is not None and np.isfinite(centre).all():
        centre = rotate(rotation, centre - origin)
        if abs(centre[0]) < 0.55 * _SPACING and abs(centre[1]) < 1.5 and centre[2] < 2.5:
            from matplotlib.patches import Circle

            place = (offset + centre[0], centre[2])
            ax.add_patch(Circle(place, BALL_RADIUS, facecolor=BALL, edgecolor="black", lw=0.6, zorder=3))


def _create_panels(*heights: float):
    """Create a figure of panels one above another, with heights in inches; return it and its axes."""
    rows = len(heights)
    return create_canvas(sum(heights) + 0.1 * rows, rows, sharex=True, gridspec_kw={"height_ratios": heights})


def _draw_time_axis(ax, view: View) -> None:
    ax.set_xlim(view.played.times[0], max(view.played.times[-1], view.played.times[0] + 1.0 / view.fps))
    ax.set_xlabel("seconds on the track's clock", fontsize=8)


def _draw_legend(ax, columns: int) -> None:
    """Draw the legend above the axes at the right, beside the title, where it covers no curve."""
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns, fontsize=8, frameon=False,
              borderpad=0.1)


def _draw_title(ax, title: str, unit: str = "") -> None:
    ax.set_title(title, loc="left", fontsize=9.5)
    ax.set_ylabel(unit)
