"""The report as one HTML page: plots, stick figures and every figure beside its target, in a single file.

    page = build_html_report(played, evaluate_played(played, track=track, library=library), track=track,
    library=library)
    Path("report.html").write_text(page, encoding="utf-8")

The page loads nothing and runs nothing: pictures are inside it, all names are escaped.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..annotation import Timeline
from ..base.optional_packages import import_optional
from ..library.library import Library
from ..motion.track import Track
from ..synthesis.quality import movement
from ..synthesis.quality.movement import measure_contact_speeds
from ..synthesis.quality.playback import Playback
from ..synthesis.quality.targets import find_target
from . import naturalness_figures, physics_figures, plots, touch_figures
from .html_page import (
    Html,
    build_element,
    build_image,
    build_list,
    build_number_cell,
    build_page,
    build_row,
    build_section,
    build_table,
    build_title,
    join_html,
)
from .report import find_twin_name, flatten_report, format_rest, judge_figures
from .titles import Title
from .view import View

MAX_MOMENTS = 12
"""Key moments with stick figures on the page; the table lists all."""

# Seconds around a moment at which stick figures are drawn.
_STRIP_SECONDS = (-0.5, -0.3, -0.2, -0.1, -1e-9, 0.1, 0.2, 0.3, 0.5)
_KEY_TEXTS = {"time_error_s": "time error {:.3f} s", "contact_gap_m": "gap to the ball {:.3f} m",
              "ball_shift_m": "ball moved {:.3f} m"}  # fmt: skip
_STYLE = """
.keys td { max-width: 16em; overflow-wrap: break-word }
.chips span { display: inline-block; margin: 0 1em .2em 0; overflow-wrap: anywhere }
.chips i { display: inline-block; width: .9em; height: .9em; margin-right: .35em; border-radius: 2px }
"""


def build_html_report(
    played: Playback, report: Mapping, *, track: Track | None = None, timeline: Timeline | None = None,
    library: Library | None = None, title: str = "Take",
) -> str:  # fmt: skip
    """Build the page.

    Args:
        played: the motion with its sources.
        report: its report, from `evaluate_played`.
        track, timeline, library: what the report was built from, or None.
        title: title of the page.
    Returns:
        The page as text.
    Raises:
        InputError: if matplotlib is not installed, or the library has another skeleton than the motion.
    """
    import_optional("matplotlib", "HTML report")
    view = View(played, track, timeline, library)
    over_time = build_image(plots.draw_curves(view), "distance from the track, toe heights, speed, smoothness")
    return build_page(
        title, _build_head(view, report, title), _build_warnings(report), build_section("Over time", over_time),
        _build_clips(view), _build_labels(view), _build_moments(view, report), _build_worst(view),
        build_naturalness_section(report), build_physics_section(report), build_touch_section(report),
        _build_figures(report), style=_STYLE,
    )  # fmt: skip


def _build_head(view: View, report: Mapping, title: str) -> Html:
    statuses = [row.status for row in judge_figures(report) if row.status]
    method = f"method {report['method']}, " if report.get("method") else ""
    summary = f"{view.count} frames at {view.fps:g} per second, {view.played.motion.duration:.1f} s, {method}"
    targets = f"{statuses.count('met')} of {len(statuses)} targets met"
    return join_html(build_element("h1", title), build_element("p", summary + targets, class_="quiet"), separator="\n")


def _build_warnings(report: Mapping) -> Html:
    warnings, notes = (build_list(report.get(name) or ()) for name in ("warnings", "notes"))
    return join_html(build_section("Warnings", warnings) if warnings else Html(),
                     build_section("Notes", notes) if notes else Html())


def _build_clips(view: View) -> Html:
    names = plots.choose_clip_colours(view)
    if not names:
        unknown = "The played clips are unknown without provenance."
        return build_section("Clips", build_element("p", unknown, class_="quiet"))
    chips = [
        build_element(
            "span", build_element("i", style=f"background:{colour}"), f"{number}: {view.played.clips[clip]}, "
            f"{np.sum(view.played.clip == clip) / view.fps:.1f} s",
        ) for clip, (number, colour) in names.items()
    ]  # fmt: skip
    picture = build_image(plots.draw_clips(view), "clips, transitions and playback rate")
    return build_section("Clips", picture, build_element("p", *chips, class_="chips"))


def _build_labels(view: View) -> Html:
    picture = plots.draw_labels(view)
    return build_section("Labels", build_image(picture, "labels requested and played")) if picture else Html()


def _build_moments(view: View, report: Mapping) -> Html:
    if not view.moments:
        return Html()
    parts, is_known = [], bool(np.any(view.played.clip >= 0))
    for moment, figures in list(zip(view.moments, report["keys"]))[:MAX_MOMENTS]:
        name = f"{moment.requested.time:.2f} s: {' '.join(moment.requested.words)}"
        line = build_element("p", _describe_key_moment(figures, is_known), class_="quiet")
        parts += [build_element("h3", name), line, _build_strip(view, moment.frame, name)]
    more = len(view.moments) - MAX_MOMENTS
    if more > 0:
        parts.append(build_element("p", f"and {more} more, in the table below", class_="quiet"))
    return build_section("Key moments", *parts)


def _build_strip(view: View, frame: int, name: str) -> Html:
    frames = np.rint(frame + np.array(_STRIP_SECONDS) * view.fps).astype(int)
    around = np.unique(np.clip(frames, 0, view.count - 1)).tolist()
    return build_image(plots.draw_strip(view, around, frame), f"stick figures at {name}")


def _describe_key_moment(key: Mapping, is_known: bool) -> str:
    """Describe one key moment in a line; is_known: whether the played clips are known."""
    source = "no key moment" if is_known else "unknown"
    if key["clip_frame"] is not None:
        source = f"{key['clip']}, frame {key['clip_frame']:.1f}"
    out = [f"played: {source}"]
    if key.get("used_instead"):
        out.append("used instead: " + " ".join(key["used_instead"]))
    out += [text.format(key[name]) for name, text in _KEY_TEXTS.items() if key.get(name) is not None]
    return "; ".join(out)


def _build_worst(view: View) -> Html:
    parts = []
    for frame, reason in find_worst_frames(view):
        name = f"{view.played.times[frame]:.2f} s: {reason}"
        parts += [build_element("h3", name), _build_strip(view, frame, name)]
    return build_section("Worst seconds", *parts) if parts else Html()


def find_worst_frames(view: View) -> list[tuple[int, str]]:
    """Find the strongest jolts and the worst slide of a foot in contact, at least a second apart.

    Args:
        view: the take beside its library and track.
    Returns:
        (output frame, description) of each.
    """
    jolts = movement.compute_jerk(view.played.positions, view.fps), 1, "jolt of {:.0f} m/s³"
    speeds = np.nan_to_num(measure_contact_speeds(view.played.feet, view.played.contacts, view.fps))
    slides = speeds.max(axis=1, initial=0.0), 0, "foot slides at {:.2f} m/s"
    frames: list[tuple[int, str]] = []
    for values, lead, text in (jolts, slides, jolts):
        values, min_distance = values.copy(), int(view.fps)
        for frame, _ in frames:
            values[max(frame - lead - min_distance, 0) : max(frame - lead + min_distance + 1, 0)] = 0.0
        if len(values) and values.max() > 0.0:
            peak = int(np.argmax(values))
            frames.append((peak + lead, text.format(values[peak])))
    return frames


def build_naturalness_section(report: Mapping) -> Html:
    """Build the section of the group `naturalness`, with readable names; empty for a report without it."""
    table = _build_titled_table(report, "naturalness", naturalness_figures.TITLES)
    return build_section("What the eye sees", table) if table else Html()


def build_physics_section(report: Mapping) -> Html:
    """Build the section of the group `physics`, with readable names; empty for a report without it."""
    table = _build_titled_table(report, "physics", physics_figures.TITLES)
    return build_section("Physics", table) if table else Html()


def build_touch_section(report: Mapping) -> Html:
    """Build the section of the group `touches`, with the key moments that other labels or synthetic clips show."""
    table = _build_titled_table(report, "touches", touch_figures.TITLES)
    return build_section("At the ball", table, _build_substituted(report["touches"])) if table else Html()


def _build_substituted(group: Mapping) -> Html:
    """Build the table of key moments that are shown by other labels or by synthetic clips; empty without any."""
    rows = [build_row(build_number_cell(row["time_s"], 2), " ".join(row["labels"]), " ".join(row["shown"]),
                      "synthetic" if row["is_synthetic"] else "", row["clip"] or "")
            for row in group.get("substituted") or ()]
    head = (build_title("s"), "labels asked for", "labels shown", "", "clip")
    return build_table(head, rows, class_="keys") if rows else Html()


def _build_titled_table(report: Mapping, group: str, titles: Mapping[str, Title]) -> Html:
    """Build the table of a group's figures by their readable names; empty for a report without them."""
    if not report.get(group):
        return Html()
    table, unknown = flatten_report(report), report.get("unknown") or {}
    lines = []
    for leaf, title in titles.items():
        name = f"{group}.{leaf}"
        target = find_target(name, float(report.get("fps") or 30.0))
        value, own = table.get(name), table.get(twin := find_twin_name(name, table))
        if value is None and name not in unknown:
            continue
        is_met = target.is_met(value, table) if target and value is not None else None
        status = {True: "met", False: "missed", None: ""}[is_met]
        reason = "" if value is not None else f"not known: {unknown[name]}"
        own_rest = format_rest(twin, table) if own is not None else ""
        if twin in unknown:
            own_rest = f"not known: {unknown[twin]}"
        lines.append(build_row(
            title.name, build_number_cell(value, title.digits, title.scale, status),
            format_rest(name, table), build_number_cell(own, title.digits, title.scale), own_rest,
            title.describe_target(target), build_element("td", reason or status, class_=status or "quiet"),
        ))  # fmt: skip
    head = ("", build_title("value"), "over", build_title("recordings"), "over", "target", "")
    return build_table(head, lines) if lines else Html()


def _build_figures(report: Mapping) -> Html:
    head = ("figure", build_title("value"), build_title("recordings"), "target", "")
    rows = [
        build_row(
            row.name, build_element("td", row.value, class_="n"),
            build_element("td", f"{row.own} ({row.rests_on})" if row.rests_on else row.own, class_="n"), row.target,
            build_element("td", f"not known: {row.reason}" if row.reason else row.status, class_=row.status or "quiet"),
        ) for row in judge_figures(report) if not row.name.startswith(("keys ", "touches.substituted"))
    ]  # fmt: skip
    return build_section("All figures", build_table(head, rows), _build_key_table(report))


def _build_key_table(report: Mapping) -> Html:
    """Build the table of key moments: one line for each, one column for each figure, targets in the head."""
    if not report["keys"]:
        return Html()
    rows = {row.name: row for row in judge_figures(report)}
    numbers = range(1, len(report["keys"]) + 1)
    known = {leaf: [rows[name] for k in numbers if (name := f"keys {k}.{leaf}") in rows] for leaf in report["keys"][0]}
    columns = {leaf: found[0].target for leaf, found in known.items() if found}
    lines = []
    for number in numbers:
        cells = [rows.get(f"keys {number}.{leaf}") for leaf in columns]
        cells_html = [build_element("td", cell.value, class_=cell.status or "plain") if cell else "–" for cell in cells]
        lines.append(build_row(str(number), *cells_html))
    head = ("", *(build_title(leaf, target, class_="") for leaf, target in columns.items()))
    return join_html(build_element("h3", "Key moments"), build_table(head, lines, class_="keys"))
