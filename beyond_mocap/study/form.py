"""What a rater fills in: one page that needs no network and sends nothing; the answers are saved as a file.

The page knows neutral names only. Who has no browser for it types into a table with the same questions.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from html import escape
from pathlib import Path

from .order import Study
from .questions import BACKGROUND, COMPARE, INTRODUCTION, RATE, SAME, SCALE

MOVIES = (".mp4", ".webm", ".m4v", ".mov", ".gif")
"""What browsers show."""
ANSWER_COLUMNS = ("study", "rater", "question", "answer")
_STYLE = """
body { font: 17px/1.5 system-ui, sans-serif; color: #222; background: #fff; max-width: 900px; margin: 1.5em auto;
  padding: 0 1em }
video, img { width: 100%; max-height: 65vh; background: #000; display: block; border-radius: 4px }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: .6em } .pair p { text-align: center }
fieldset { border: 1px solid #ccc; border-radius: 6px; margin: 1em 0; padding: .6em 1em } legend { font-weight: 600 }
label { display: inline-block; padding: .5em .8em; margin: .2em; border: 1px solid #ccc; border-radius: 6px;
  cursor: pointer }
label:has(input:checked) { background: #e3edf8; border-color: #2563a8 }
label:focus-within { outline: 2px solid #2563a8 }
button { font: inherit; padding: .5em 1.4em; margin: .4em .6em .4em 0 } .quiet { color: #666 }
[hidden] { display: none } progress { width: 100% }
"""
_SCRIPT = """
const study = JSON.parse(document.getElementById("study").textContent);
const pages = [...document.querySelectorAll("section")], kept = "study-" + study.study + "-" + study.rater;
let answers = {}, at = 0;
try { answers = JSON.parse(localStorage.getItem(kept)) || {}; } catch (error) { answers = {}; }
for (const input of document.querySelectorAll("input")) {
  input.checked = answers[input.name] === input.value;
  input.addEventListener("change", () => { answers[input.name] = input.value; keep(); show(at); });
}
function keep() { try { localStorage.setItem(kept, JSON.stringify(answers)); } catch (error) { /* private window */ } }
function missing(page) {
  const names = new Set([...page.querySelectorAll("fieldset[data-needed] input")].map(input => input.name));
  return [...names].filter(name => !(name in answers));
}
function show(number) {
  if (number !== at) for (const video of pages[at].querySelectorAll("video")) video.pause();
  at = number;
  pages.forEach((page, order) => { page.hidden = order !== at; });
  document.querySelector("progress").value = at;
  document.getElementById("back").hidden = at === 0;
  const next = document.getElementById("next");
  next.hidden = at === pages.length - 1;
  next.disabled = missing(pages[at]).length > 0;
}
function move(by) {
  show(at + by);
  scrollTo(0, 0);
  for (const video of pages[at].querySelectorAll("video")) { video.currentTime = 0; video.play().catch(() => {}); }
}
function rows() { return study.questions.map(name => [study.study, study.rater, name, answers[name] || ""]); }
function save(kind) {
  const cell = text => '"' + String(text).replaceAll('"', '""') + '"';
  const table = [study.columns, ...rows()].map(row => row.map(cell).join(",")).join("\\r\\n") + "\\r\\n";
  const object = JSON.stringify({study: study.study, rater: study.rater, answers: answers}, null, 1);
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([kind === "csv" ? table : object], {type: "text/plain"}));
  link.download = study.study + "-" + study.rater + "." + kind;
  document.body.append(link);
  link.click();
  link.remove();
}
document.getElementById("back").addEventListener("click", () => move(-1));
document.getElementById("next").addEventListener("click", () => move(1));
document.getElementById("csv").addEventListener("click", () => save("csv"));
document.getElementById("json").addEventListener("click", () => save("json"));
show(0);
"""


def form_page(study: Study, rater: str, sources: Mapping[str, str]) -> str:
    """The form of one rater as HTML text. sources: neutral name -> address of the clip as the page finds it: a path
    from where the page lies, or the clip itself as a data address."""
    pages = [_introduction(study), _background()]
    order, what = study.orders[rater], "Pair" if study.pairs else "Clip"
    for number, shown in enumerate(order, 1):
        pages.append(_clip_page(study, shown, sources, f"{what} {number} of {len(order)}"))
    pages.append(_end())
    told = {"study": study.id, "rater": rater, "columns": ANSWER_COLUMNS, "questions": questions_of(study, rater)}
    data = json.dumps(told, ensure_ascii=True).replace("<", "\\u003c")
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>How natural does it look?</title>'
        f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head>\n<body>\n'
        f"<progress max={len(pages) - 1} value=0></progress>\n" + "\n".join(pages)
        + '\n<p><button id="back" type="button">Back</button><button id="next" type="button">Next</button></p>\n'
        f"<noscript><p>This form needs JavaScript; {escape(rater)}.csv can be filled in instead.</p></noscript>\n"
        f'<script type="application/json" id="study">{data}</script>\n<script>{_SCRIPT}</script>\n</body></html>\n'
    )  # fmt: skip


def form_table(study: Study, rater: str) -> str:
    """The same questions as a CSV to type into: an empty answer for each, in the rater's order."""
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\r\n")
    table.writerow(ANSWER_COLUMNS)
    table.writerows((study.id, rater, question, "") for question in questions_of(study, rater))
    return text.getvalue()


def questions_of(study: Study, rater: str) -> list[str]:
    """The keys of all questions in a rater's order; a pair is its two names with a stroke between."""
    return [question.key for question in BACKGROUND] + ["/".join(shown) for shown in study.orders[rater]]


def clip_source(folder: Path, name: str) -> Path | None:
    """The movie of a neutral name in a folder; None where there is none."""
    return next((path for suffix in MOVIES if (path := folder / f"{name}{suffix}").is_file()), None)


def _introduction(study: Study) -> str:
    told = "".join(f"<p>{escape(line)}</p>" for line in INTRODUCTION)
    many = len(next(iter(study.orders.values()), ()))
    return f"<section><h1>How natural does it look?</h1>{told}<p>There are {many} pages with clips.</p></section>"


def _background() -> str:
    parts = [_choices(question.key, question.text, question.choices, question.needed) for question in BACKGROUND]
    return f"<section hidden><h2>About you</h2>{''.join(parts)}</section>"


def _clip_page(study: Study, shown: tuple[str, ...], sources: Mapping[str, str], title: str) -> str:
    name = "/".join(shown)
    training = "" if study.counts(shown) else " <span class=quiet>(to get used to it)</span>"
    sides = ("Left", "Right") if len(shown) == 2 else ("",)
    clips = "".join(
        f"<div>{_clip(sources[one])}<p class=quiet>{side}</p></div>" for one, side in zip(shown, sides)
    )
    if study.pairs:
        choices = tuple(zip((shown[0], SAME, shown[1]), ("Left", "No difference", "Right")))
    else:
        choices = tuple((str(mark), text) for mark, text in enumerate(SCALE, 1))
    asked = _choices(name, COMPARE if study.pairs else RATE, choices, needed=True)
    look = "pair" if len(shown) == 2 else "one"
    return f"<section hidden><h2>{escape(title)}{training}</h2><div class={look}>{clips}</div>{asked}</section>"


def _clip(source: str) -> str:
    if source.lower().endswith(".gif") or source.startswith("data:image/"):
        return f'<img alt="the clip" src="{escape(source)}">'
    return f'<video src="{escape(source)}" controls loop muted playsinline preload="auto"></video>'


def _choices(key: str, text: str, choices: tuple[tuple[str, str], ...], needed: bool) -> str:
    """A question with one choice."""
    inputs = "".join(f'<label><input type="radio" name="{escape(key)}" value="{escape(value)}"> {escape(said)}</label>'
                     for value, said in choices)  # fmt: skip
    return f"<fieldset{' data-needed' if needed else ''}><legend>{escape(text)}</legend>{inputs}</fieldset>"


def _end() -> str:
    return ("<section hidden><h2>Thank you</h2><p>Save your answers and send the file to whoever gave you this form. "
            'Nothing has been sent.</p><p><button id="csv" type="button">Save as a table (CSV)</button>'
            '<button id="json" type="button">Save as JSON</button></p></section>')  # fmt: skip
