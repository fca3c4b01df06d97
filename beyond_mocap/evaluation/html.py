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
from ..library.library import Library
from ..motion.track import Track
from ..synthesis.quality import movement
from ..synthesis.quality.movement import contact_speeds
from ..synthesis.quality.played import Played
from . import plots
from .html_page import (
    Html,
    build_image,
    build_list,
    build_page,
    build_row,
    build_section,
    build_table,
    build_title,
    element,
    fragment,
)
from .reference import View
from .report import judge_figures

MOST_MOMENTS = 12
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


def html_report(
    played: Played, report: Mapping, *, track: Track | None = None, timeline: Timeline | None = None,
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
    plots.require_matplotlib()
    view = View(played, track, timeline, library)
    over_time = build_image(plots.curves(view), "distance from the track, toe heights, speed, smoothness")
    return build_page(
        title, _head(view, report, title), _warnings(report), build_section("Over time", over_time), _clips(view),
        _words(view), _moments(view, report), _worst(view), _figures(report), style=_STYLE,
    )  # fmt: skip


def _head(view: View, report: Mapping, title: str) -> Html:
    statuses = [row.status for row in judge_figures(report) if row.status]
    method = f"method {report['method']}, " if report.get("method") else ""
    told = f"{view.count} frames at {view.fps:g} per second, {view.played.motion.duration:.1f} s, {method}"
    met = f"{statuses.count('met')} of {len(statuses)} targets met"
    return fragment(element("h1", title), element("p", told + met, class_="quiet"), between="\n")


def _warnings(report: Mapping) -> Html:
    lines = build_list(report.get("warnings") or ())
    return build_section("Warnings", lines) if lines else Html()


def _clips(view: View) -> Html:
    names = plots.legend(view)
    if not names:
        unknown = "The played clips are unknown without provenance."
        return build_section("Clips", element("p", unknown, class_="quiet"))
    chips = [
        element(
            "span", element("i", style=f"background:{colour}"), f"{number}: {view.played.clips[clip]}, "
            f"{np.sum(view.played.clip == clip) / view.fps:.1f} s",
        ) for clip, (number, colour) in names.items()
    ]  # fmt: skip
    picture = build_image(plots.clips(view), "clips, transitions and playback rate")
    return build_section("Clips", picture, element("p", *chips, class_="chips"))


def _words(view: View) -> Html:
    picture = plots.words(view)
    return build_section("Labels", build_image(picture, "labels requested and played")) if picture else Html()


def _moments(view: View, report: Mapping) -> Html:
    if not view.moments:
        return Html()
    parts = []
    for moment, told in list(zip(view.moments, report["keys"]))[:MOST_MOMENTS]:
        name = f"{moment.asked.time:.2f} s: {' '.join(moment.asked.words)}"
        parts += [element("h3", name), element("p", _told(told), class_="quiet"), _strip(view, moment.frame, name)]
    left = len(view.moments) - MOST_MOMENTS
    if left > 0:
        parts.append(element("p", f"and {left} more, in the table below", class_="quiet"))
    return build_section("Key moments", *parts)


def _strip(view: View, frame: int, name: str) -> Html:
    frames = np.rint(frame + np.array(_STRIP_SECONDS) * view.fps).astype(int)
    around = np.unique(np.clip(frames, 0, view.count - 1)).tolist()
    return build_image(plots.strip(view, around, frame), f"stick figures at {name}")


def _told(key: Mapping) -> str:
    """Describe one key moment in a line."""
    source = f"{key['clip']}, frame {key['clip_frame']:.1f}" if key["clip_frame"] is not None else "no key moment"
    out = [f"played: {source}"]
    if key.get("used_instead"):
        out.append("used instead: " + " ".join(key["used_instead"]))
    out += [text.format(key[name]) for name, text in _KEY_TEXTS.items() if key.get(name) is not None]
    return "; ".join(out)


def _worst(view: View) -> Html:
    parts = []
    for frame, reason in worst_frames(view):
        name = f"{view.played.times[frame]:.2f} s: {reason}"
        parts += [element("h3", name), _strip(view, frame, name)]
    return build_section("Worst seconds", *parts) if parts else Html()


def worst_frames(view: View) -> list[tuple[int, str]]:
    """Find the strongest jolts and the worst slide of a foot in contact, at least a second apart.

    Args:
        view: the take beside its library and track.
    Returns:
        (output frame, description) of each.
    """
    jolts = movement.jerk(view.played.positions, view.fps), 1, "jolt of {:.0f} m/s³"
    speeds = np.nan_to_num(contact_speeds(view.played.feet, view.played.contacts, view.fps))
    slides = speeds.max(axis=1, initial=0.0), 0, "foot slides at {:.2f} m/s"
    found: list[tuple[int, str]] = []
    for values, lead, text in (jolts, slides, jolts):
        values, apart = values.copy(), int(view.fps)
        for frame, _ in found:
            values[max(frame - lead - apart, 0) : max(frame - lead + apart + 1, 0)] = 0.0
        if len(values) and values.max() > 0.0:
            at = int(np.argmax(values))
            found.append((at + lead, text.format(values[at])))
    return found


def _figures(report: Mapping) -> Html:
    head = ("figure", build_title("value"), build_title("recordings"), "target", "")
    rows = [
        build_row(
            row.name, element("td", row.value, class_="n"), element("td", row.own, class_="n"), row.target,
            element("td", row.status, class_=row.status or "quiet"),
        ) for row in judge_figures(report) if not row.name.startswith("keys ")
    ]  # fmt: skip
    return build_section("All figures", build_table(head, rows), _key_table(report))


def _key_table(report: Mapping) -> Html:
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
        told = [element("td", cell.value, class_=cell.status or "plain") if cell else "–" for cell in cells]
        lines.append(build_row(str(number), *told))
    head = ("", *(build_title(leaf, aim, class_="") for leaf, aim in columns.items()))
    return fragment(element("h3", "Key moments"), build_table(head, lines, class_="keys"))
