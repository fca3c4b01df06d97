"""The report on a folder of trials as one HTML page (Fredriksson sections 8.1-8.2).

It shows how well markers fit, how long the solver took, where throws land, and how fast they are compared with a radar
gun. The page loads nothing from elsewhere, and all names are escaped.

    page = build_trials_report(folder)

`folder` is the output of `beyond-mocap reconstruct FOLDER --out OUT`. Pictures are PNGs as bytes; matplotlib is
imported inside functions.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..base.errors import format_count
from ..evaluation import html_page as html
from ..evaluation.plots import render_png, style_axes
from .trial_results import (
    MIN_PAIRS,
    TrialResult,
    align_impacts,
    compare_speeds,
    find_dominant_sides,
    read_results,
    select_near_mean,
)

DOMINANT, OTHER, QUIET = "#2563a8", "#e08a00", "#999999"
_WIDTH, _DPI = 11.0, 100
_BINS = 24


def build_trials_report(folder: Path) -> str:
    """Build the page.

    Args:
        folder: the output folder of a reconstructed folder of trials.
    Returns:
        The page as HTML text.
    Raises:
        InputError: if the folder has no reports, or matplotlib is not installed.
    """
    results = read_results(Path(folder))
    solved = [result for result in results if not result.error]
    title = Path(folder).resolve().name
    parts = [html.build_element("h1", f"{title}: {format_count(len(results), 'trial')}")]
    if solved:
        parts.append(_build_section("Markers and time", _describe_fit(solved), draw_residuals_and_time(results),
                                    draw_residuals_by_trial(results)))
    return html.build_page(title, *parts, *_build_throw_sections(solved),
                           html.build_section("All trials", _build_table(results)))


def _describe_fit(solved: Sequence[TrialResult]) -> html.Html:
    """Describe how well the markers fit and how fast the solver is."""
    residual, single = (_compute_mean([getattr(r, name) for r in solved]) for name in ("residual", "single"))
    rate = _compute_mean([r.rate for r in solved])
    text = f"Residuals {residual:.1f} mm (segments alone {single:.1f} mm), {rate:.0f} frames per second overall."
    return html.build_element("p", f"{text} Error bars show one standard deviation.")


def _build_throw_sections(solved: Sequence[TrialResult]) -> list[html.Html]:
    """Build the sections on throws; none where no throw was found."""
    throws = [result for result in solved if result.throw is not None]
    if not throws:
        return []
    parts = []
    points = align_impacts(throws)
    near = select_near_mean(points)
    if near.any():
        text = f"{int(near.sum())} of {len(throws)} throws; those beyond three standard deviations are left out."
        parts.append(_build_section("Where throws land", html.build_element("p", text), draw_impact_map(points[near]),
                                    draw_impact_scatter(throws, points)))
    pairs = [(r.throw.radar, r.throw.speed) for r in throws if r.throw.radar]
    if pairs:
        measured, estimated = np.array(pairs, float).T
        parts.append(_build_section("How fast they are", _describe_speeds(estimated, measured),
                                    draw_speeds(measured, estimated)))
    return parts


def _describe_speeds(estimated: np.ndarray, measured: np.ndarray) -> html.Html:
    """Describe the differences between estimated and measured speeds, with both tests."""
    comparison = compare_speeds(estimated, measured)
    many = "throws" if comparison.count != 1 else "throw"
    lines = [f"{comparison.count} {many} with a measured speed: estimated - measured {comparison.mean:+.2f} m/s"
             + (f" (standard deviation {comparison.sd:.2f})" if np.isfinite(comparison.sd) else "")
             + f", {100 * comparison.share:.1f} % off on average, {100 * comparison.within:.0f} % of them within 10 %."]
    if np.isfinite(comparison.normal):
        lines.append(f"Normality of the differences (Shapiro-Wilk): p = {comparison.normal:.3f}.")
    if np.isfinite(comparison.wilcoxon):
        lines.append(f"No difference (Wilcoxon, paired, two-sided): p = {comparison.wilcoxon:.4f}.")
    else:
        lines.append(f"No paired test: it needs at least {MIN_PAIRS} throws that differ.")
    return html.join_html(*(html.build_element("p", line) for line in lines))


def _build_table(results: Sequence[TrialResult]) -> html.Html:
    """Build the table of all trials."""
    number = html.build_title
    titles = ("trial", "subject", number("frames"), number("residual, mm"), number("frames/s"), "hand",
              number("speed, m/s"), number("radar"), "")
    return html.build_table(titles, map(_build_row, results))


def _build_row(result: TrialResult) -> html.Html:
    side, speed, radar = (result.throw.side, result.throw.speed, result.throw.radar) if result.throw else ("", None, 0)
    cell = html.build_number_cell
    return html.build_row(result.name, result.subject, cell(result.frames or None), cell(result.residual, 1),
                          cell(result.rate), side, cell(speed, 1), cell(radar or None, 1),
                          html.build_element("td", result.error, class_="missed"))


def _build_section(title: str, body: html.Html, *images: bytes) -> html.Html:
    return html.build_section(title, body, *(html.build_image(png, title) for png in images))


def _compute_mean(values: Sequence[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return float(np.mean(known)) if known else float("nan")


def draw_residuals_and_time(results: Sequence[TrialResult]) -> bytes:
    """Draw figure 8.1: weighted squared residuals and milliseconds per frame, by subject, with one standard deviation.

    Args:
        results: the results; failed trials are left out.
    Returns:
        A PNG image.
    """
    solved = [result for result in results if not result.error]
    subjects = sorted({result.subject for result in solved})
    figure, (left, right) = _build_canvas(1, 2, 3.6)
    squares = [_merge_frame_statistics([r for r in solved if r.subject == subject]) for subject in subjects]
    times = [[1000.0 / r.rate for r in solved if r.subject == subject and r.rate > 0] for subject in subjects]
    names = [subject or "no name" for subject in subjects]
    _draw_bars(left, names, [1e4 * mean for mean, _ in squares], [1e4 * sd for _, sd in squares])
    left.set_ylabel("cm², sum over markers")
    left.set_title("squared residuals per frame, weighted", loc="left", fontsize=9.5)
    _draw_bars(right, names, [np.mean(t) if t else np.nan for t in times], [np.std(t) if t else 0.0 for t in times])
    right.set_ylabel("ms")
    right.set_title("solving time per frame", loc="left", fontsize=9.5)
    return render_png(figure)


def draw_residuals_by_trial(results: Sequence[TrialResult]) -> bytes:
    """Draw the root mean square residuals of every trial, beside those of fitting each segment alone.

    Args:
        results: the results; failed trials are left out.
    Returns:
        A PNG image.
    """
    solved = [result for result in results if not result.error]
    figure, (ax,) = _build_canvas(1, 1, 0.9 + 0.28 * len(solved))
    rows = np.arange(len(solved))
    ax.barh(rows - 0.19, [r.residual for r in solved], 0.36, color=DOMINANT, label="whole body")
    ax.barh(rows + 0.19, [r.single for r in solved], 0.36, color=QUIET, label="segments alone")
    ax.set_yticks(rows, [_shorten_name(r.name) for r in solved])
    ax.invert_yaxis()
    ax.set_xlabel("mm, root mean square", fontsize=8)
    ax.set_title("markers against the model", loc="left", fontsize=9.5)
    ax.legend(fontsize=8, frameon=False)
    return render_png(figure)


def draw_impact_map(points: np.ndarray) -> bytes:
    """Draw figure 8.2: how many throws land where, with both marginal histograms.

    Args:
        points: (N, 2) metres, as `align_impacts` returns them.
    Returns:
        A PNG image.
    """
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    figure = Figure(figsize=(8.0, 7.0), dpi=_DPI, layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(4, 1), height_ratios=(1, 4))
    main = figure.add_subplot(grid[1, 0])
    above, beside = figure.add_subplot(grid[0, 0], sharex=main), figure.add_subplot(grid[1, 1], sharey=main)
    edges = [_compute_bin_edges(points[:, axis]) for axis in (0, 1)]
    counts, *_ = np.histogram2d(points[:, 0], points[:, 1], bins=edges)
    mesh = main.pcolormesh(*edges, np.where(counts > 0, counts, np.nan).T, cmap="viridis", vmin=0)
    bar = figure.colorbar(mesh, ax=beside, label="throws", ticks=MaxNLocator(integer=True))
    bar.ax.tick_params(labelsize=8)
    above.hist(points[:, 0], bins=list(edges[0]), color=DOMINANT)
    beside.hist(points[:, 1], bins=list(edges[1]), color=DOMINANT, orientation="horizontal")
    above.tick_params(labelbottom=False, labelsize=8)
    beside.tick_params(labelleft=False, labelsize=8)
    _draw_ground_axes(main)
    return render_png(figure)


def draw_impact_scatter(results: Sequence[TrialResult], points: np.ndarray) -> bytes:
    """Draw figure 8.3: where each subject's throws land, by dominant and other arm.

    Args:
        results: N results.
        points: (N, 2) metres, as `align_impacts` returns them.
    Returns:
        A PNG image.
    """
    sides = find_dominant_sides(results)
    figure, axes = _build_canvas((len(sides) + 2) // 3, min(len(sides), 3), 3.6)
    for ax, (subject, strong) in zip(axes, sorted(sides.items())):
        for name, colour, is_dominant in (("dominant arm", DOMINANT, True), ("other arm", OTHER, False)):
            rows = [i for i, r in enumerate(results) if r.subject == subject and r.throw is not None
                    and (r.throw.side == strong) is is_dominant and np.isfinite(points[i]).all()]
            if rows:
                ax.plot(*points[rows].T, "o", color=colour, ms=4, label=f"{name}: {len(rows)}")
        ax.set_title(subject or "no name", loc="left", fontsize=9.5)
        _draw_ground_axes(ax)
        if ax.get_legend_handles_labels()[1]:
            ax.legend(fontsize=8, frameon=False)
    for ax in axes[len(sides):]:
        ax.axis("off")
    return render_png(figure)


def draw_speeds(measured: np.ndarray, estimated: np.ndarray) -> bytes:
    """Draw figure 8.4: the distribution of speeds, measured and estimated, and the pairs.

    Args:
        measured: (N,) m/s.
        estimated: (N,) m/s.
    Returns:
        A PNG image.
    """
    figure, (left, right) = _build_canvas(1, 2, 3.8)
    edges = _compute_bin_edges(np.concatenate([measured, estimated]), 16)
    for values, colour, name in ((measured, QUIET, "measured"), (estimated, DOMINANT, "estimated")):
        share = np.full(len(values), 1.0 / len(values))
        left.hist(values, bins=edges, weights=share, color=colour, alpha=0.6, label=name)
    left.set_xlabel("m/s", fontsize=8)
    left.set_ylabel("share of throws")
    left.set_title("ball speeds", loc="left", fontsize=9.5)
    left.legend(fontsize=8, frameon=False)
    span = np.array([edges[0], edges[-1]])
    right.plot(span, span, color=QUIET, lw=1)
    right.fill_between(span, 0.9 * span, 1.1 * span, color=QUIET, alpha=0.15, lw=0, label="within 10 %")
    right.plot(measured, estimated, "o", color=DOMINANT, ms=4)
    right.set_xlabel("measured, m/s", fontsize=8)
    right.set_ylabel("estimated, m/s")
    right.set_title("pair by pair", loc="left", fontsize=9.5)
    right.legend(fontsize=8, frameon=False)
    return render_png(figure)


def _merge_frame_statistics(results: Sequence[TrialResult]) -> tuple[float, float]:
    """Return mean and standard deviation of the squared residuals over all frames of several trials."""
    count = np.array([r.frames for r in results], float)
    mean, spread = np.array([r.squares for r in results], float).reshape(-1, 2).T
    known = np.isfinite(mean) & np.isfinite(spread) & (count > 0)
    if not known.any():
        return np.nan, 0.0
    share = count[known] / count[known].sum()
    whole = float(share @ mean[known])
    # total variance = mean of (variance + squared mean) minus the squared total mean
    return whole, float(np.sqrt(max(share @ (spread[known] ** 2 + mean[known] ** 2) - whole**2, 0.0)))


def _draw_bars(ax, names, values, spread) -> None:
    ax.bar(range(len(names)), values, 0.6, yerr=spread, color=DOMINANT, ecolor="#333333", capsize=4)
    ax.set_xticks(range(len(names)), [_shorten_name(name) for name in names])
    ax.set_ylim(bottom=0.0)


def _draw_ground_axes(ax) -> None:
    """Label the axes of an impact plot and mark the thrower."""
    ax.set_xlabel("m to the right of the throw", fontsize=8)
    ax.set_ylabel("m from the hips", fontsize=8)
    ax.tick_params(labelsize=8)
    ax.plot(0.0, 0.0, "+", color="#c0392b", ms=9)
    ax.grid(color="#e6e6e6", lw=0.6)
    ax.set_axisbelow(True)


def _compute_bin_edges(values: np.ndarray, bins: int = _BINS) -> np.ndarray:
    """Return the edges of `bins` bins over the values, with a margin of 5 %."""
    low, high = float(np.min(values)), float(np.max(values))
    room = max(0.05 * (high - low), 0.25)
    return np.linspace(low - room, high + room, bins + 1)


def _shorten_name(name: str) -> str:
    return name if len(name) <= 34 else name[:15] + " … " + name[-15:]


def _build_canvas(rows: int, columns: int, height: float):
    """Build a figure without a window; return it with its axes, row by row."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH, height * rows), dpi=_DPI, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    style_axes(axes)
    return figure, axes
