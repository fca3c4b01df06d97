"""The report as one page for a browser: pictures, stick figures and every figure beside its target, in a single file.

    page = html_report(played, evaluate_played(played, track=track, library=library), track=track, library=library)
    Path("report.html").write_text(page, encoding="utf-8")

The page loads nothing and runs nothing: pictures are inside it, all names are escaped.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from html import escape

import numpy as np

from ..annotation import Timeline
from ..library.library import Library
from ..motion.track import Track
from . import jerk, plots
from .feet import contact_speeds
from .judged import judged
from .played import Played
from .view import View

MOST_MOMENTS = 12
"""Strips of key moments on the page; the table tells all of them."""

_STRIP_SECONDS = (-0.5, -0.3, -0.2, -0.1, -1e-9, 0.1, 0.2, 0.3, 0.5)
_KEY_TEXTS = {
    "time_error_s": "time error {:.3f} s",
    "contact_gap_m": "gap to the ball {:.3f} m",
    "ball_shift_m": "ball moved {:.3f} m",
}
_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; background: #fff; max-width: 1120px; margin: 1.5em auto;
  padding: 0 1em }
h1 { font-size: 1.5em; margin-bottom: 0 } h2 { font-size: 1.15em; margin: 1.6em 0 .4em }
h3 { font-size: 1em; margin: 1em 0 .2em } p { margin: .3em 0 } .quiet { color: #666; font-weight: normal }
img { max-width: 100%; height: auto; display: block }
table { border-collapse: collapse; font-size: 14px } tr { border-bottom: 1px solid #eee }
th, td { padding: .18em .8em .18em 0; text-align: left; vertical-align: top }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums }
.keys td { max-width: 16em; overflow-wrap: break-word }
.met { color: #23703a } .missed { color: #b3261e; font-weight: 600 } .scroll { overflow-x: auto }
.chips span { display: inline-block; margin: 0 1em .2em 0; overflow-wrap: anywhere }
.chips i { display: inline-block; width: .9em; height: .9em; margin-right: .35em; border-radius: 2px }
"""


def html_report(
    played: Played,
    report: Mapping,
    *,
    track: Track | None = None,
    timeline: Timeline | None = None,
    library: Library | None = None,
    title: str = "Take",
) -> str:
    """The page as text. played, track, timeline and library: what `report` (of `evaluate_played`) was made from.

    Raises InputError where matplotlib is not installed, or the library has another skeleton than the motion.
    """
    plots.require_matplotlib()
    view = View(played, track, timeline, library)
    sections = [
        _head(view, report, title),
        _warnings(report),
        _section("Over time", _image(plots.curves(view), "distance from the track, toe heights, speed, smoothness")),
        _clips(view),
        _words(view),
        _moments(view, report),
        _worst(view),
        _figures(report),
    ]
    body = "\n".join(section for section in sections if section)
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head>\n'
        f"<body>\n{body}\n</body></html>\n"
    )


def _head(view: View, report: Mapping, title: str) -> str:
    statuses = [row.status for row in judged(report) if row.status]
    method = f"method {escape(str(report['method']))}, " if report.get("method") else ""
    told = f"{view.count} frames at {view.fps:g} per second, {view.played.motion.duration:.1f} s, {method}"
    return (
        f"<h1>{escape(title)}</h1>\n<p class=quiet>{told}{statuses.count('met')} of {len(statuses)} targets met</p>"
    )


def _warnings(report: Mapping) -> str:
    lines = "".join(f"<li>{escape(str(line))}</li>" for line in report.get("warnings") or ())
    return _section("Warnings", f"<ul>{lines}</ul>") if lines else ""


def _clips(view: View) -> str:
    names = plots.legend(view)
    if not names:
        return _section("Clips", "<p class=quiet>No provenance was given: it is not known which clips are played.</p>")
    chips = "".join(
        f'<span><i style="background:{colour}"></i>{number}: {escape(view.played.clips[clip])}, '
        f"{np.sum(view.played.clip == clip) / view.fps:.1f} s</span>"
        for clip, (number, colour) in names.items()
    )
    picture = _image(plots.clips(view), "clips, seams and time warp")
    return _section("Clips", f"{picture}\n<p class=chips>{chips}</p>")


def _words(view: View) -> str:
    picture = plots.words(view)
    return _section("Words", _image(picture, "words asked and got")) if picture else ""


def _moments(view: View, report: Mapping) -> str:
    if not view.moments:
        return ""
    parts = []
    for moment, told in list(zip(view.moments, report["keys"]))[:MOST_MOMENTS]:
        name = f"{moment.asked.time:.2f} s: {' '.join(moment.asked.words)}"
        picture = _image(plots.strip(view, _around(view, moment.frame), moment.frame), f"stick figures at {name}")
        parts.append(f"<h3>{escape(name)}</h3>\n<p class=quiet>{escape(_told(told))}</p>\n{picture}")
    left = len(view.moments) - MOST_MOMENTS
    more = f"<p class=quiet>and {left} more, in the table below</p>" if left > 0 else ""
    return _section("Key moments", "\n".join(parts) + more)


def _told(key: Mapping) -> str:
    """One key moment in a line."""
    source = f"{key['clip']}, frame {key['clip_frame']:.1f}" if key["clip_frame"] is not None else "no key of a clip"
    out = [f"played: {source}"]
    if key.get("used_instead"):
        out.append("used instead: " + " ".join(key["used_instead"]))
    out += [text.format(key[name]) for name, text in _KEY_TEXTS.items() if key.get(name) is not None]
    return "; ".join(out)


def _worst(view: View) -> str:
    parts = []
    for frame, reason in worst_frames(view):
        name = f"{view.played.times[frame]:.2f} s: {reason}"
        picture = _image(plots.strip(view, _around(view, frame), frame), f"stick figures at {name}")
        parts.append(f"<h3>{escape(name)}</h3>\n{picture}")
    return _section("Worst seconds", "\n".join(parts)) if parts else ""


def worst_frames(view: View) -> list[tuple[int, str]]:
    """(output frame, why) of the hardest jolts and of the worst slide of a standing foot, each at least a second
    apart."""
    jolts = jerk.jerk(view.played.positions, view.fps), 1, "jolt of {:.0f} m/s³"
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


def _around(view: View, frame: int) -> list[int]:
    frames = np.rint(frame + np.array(_STRIP_SECONDS) * view.fps).astype(int)
    return np.unique(np.clip(frames, 0, view.count - 1)).tolist()


def _figures(report: Mapping) -> str:
    head = "<tr><th>figure<th class=n>value<th class=n>recordings<th>target<th></tr>"
    lines = [
        f"<tr><td>{escape(row.name)}<td class=n>{escape(row.value)}<td class=n>{escape(row.own)}"
        f"<td>{escape(row.target)}<td class={row.status or 'quiet'}>{row.status}</tr>"
        for row in judged(report)
        if not row.name.startswith("keys ")
    ]
    table = f"<div class=scroll><table>{head}\n" + "\n".join(lines) + "\n</table></div>"
    return _section("All figures", table + _key_table(report))


def _key_table(report: Mapping) -> str:
    """One line per key moment, one column per figure; the targets stand in the head."""
    if not report["keys"]:
        return ""
    rows = {row.name: row for row in judged(report)}
    numbers = range(1, len(report["keys"]) + 1)
    known = {leaf: [rows[name] for k in numbers if (name := f"keys {k}.{leaf}") in rows] for leaf in report["keys"][0]}
    columns = {leaf: found[0].target for leaf, found in known.items() if found}
    head = "".join(f"<th>{escape(leaf)}<br><span class=quiet>{escape(aim)}</span>" for leaf, aim in columns.items())
    lines = []
    for number in numbers:
        cells = [rows.get(f"keys {number}.{leaf}") for leaf in columns]
        told = [f"<td class={cell.status or 'plain'}>{escape(cell.value)}" if cell else "<td>–" for cell in cells]
        lines.append(f"<tr><td>{number}{''.join(told)}</tr>")
    table = f"<table class=keys><tr><th>{head}</tr>\n" + "\n".join(lines) + "\n</table>"
    return f"<h3>Key moments</h3><div class=scroll>{table}</div>"


def _section(title: str, body: str) -> str:
    return f"<h2>{escape(title)}</h2>\n{body}"


def _image(png: bytes, text: str) -> str:
    return f'<img alt="{escape(text)}" src="data:image/png;base64,{base64.b64encode(png).decode("ascii")}">'
