"""The questions to raters, about themselves and about every clip (after Faustino App. C), and the page with them.

The page needs no network and sends nothing; it saves the answers as a file. It has neutral names only. Raters whose
browser cannot run it type into a table with the same questions.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ..evaluation.html_page import Html, build_element, build_page, build_section, join_html
from .order import Study

MOVIES = (".mp4", ".webm", ".m4v", ".mov", ".gif")
"""File types that browsers play."""
ANSWER_COLUMNS = ("study", "rater", "question", "answer")
_STYLE = """
body { font-size: 17px; line-height: 1.5; max-width: 900px } p { margin: .8em 0 }
video, img { width: 100%; max-height: 65vh; background: #000; display: block; border-radius: 4px }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: .6em } .pair p { text-align: center }
fieldset { border: 1px solid #ccc; border-radius: 6px; margin: 1em 0; padding: .6em 1em } legend { font-weight: 600 }
label { display: inline-block; padding: .5em .8em; margin: .2em; border: 1px solid #ccc; border-radius: 6px;
  cursor: pointer }
label:has(input:checked) { background: #e3edf8; border-color: #2563a8 }
label:focus-within { outline: 2px solid #2563a8 }
button { font: inherit; padding: .5em 1.4em; margin: .4em .6em .4em 0 }
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


@dataclass(frozen=True)
class Question:
    """One question about the rater.

    Attributes:
        key: its name in the answers.
        text: the question.
        choices: (key, text) of each choice.
        needed: whether an answer is required.
    """

    key: str
    text: str
    choices: tuple[tuple[str, str], ...]
    needed: bool = False


BACKGROUND = (
    Question("age", "How old are you?", (
        ("18-24", "18 to 24"), ("25-34", "25 to 34"), ("35-44", "35 to 44"), ("45-54", "45 to 54"),
        ("55-64", "55 to 64"), ("65-74", "65 to 74"), ("75-", "75 or older"),
    )),
    Question("gender", "What is your gender?", (("woman", "Woman"), ("man", "Man"), ("other", "Another"))),
    Question("characters", "How often, in a usual month, do you play games or watch films with animated people?", (
        ("never", "Never"), ("twice", "Once or twice"), ("weekly", "About once a week"),
        ("often", "Several times a week"), ("daily", "Every day"), ("unknown", "I don't know"),
    ), needed=True),
)  # fmt: skip
SCALE = ("Very bad", "Bad", "Neither bad nor good", "Good", "Very good")
"""Ratings 1 to 5."""
RATE = "How natural does the movement look?"
COMPARE = "Which movement looks more natural?"
SAME = "same"
INTRODUCTION = (
    "You will see short clips of one football player each. Look only at how the body moves, and rate how natural it "
    "looks to you. There are no right or wrong answers, and you do not give your name.",
    "You can watch every clip as often as you like. The first two help you get used to the task; their answers do not "
    "count.",
)


def build_form_page(study: Study, rater: str, sources: Mapping[str, str]) -> str:
    """Build the form of one rater as HTML.

    Args:
        study: the study.
        rater: the rater's name.
        sources: neutral name -> address of the clip: a path relative to the page, or a data URL.
    Returns:
        The page as text.
    """
    pages = [_build_introduction(study), _build_background()]
    order, what = study.orders[rater], "Pair" if study.pairs else "Clip"
    for number, shown in enumerate(order, 1):
        pages.append(_build_clip_page(study, shown, sources, f"{what} {number} of {len(order)}"))
    pages.append(_build_end())
    content = {"study": study.id, "rater": rater, "columns": ANSWER_COLUMNS, "questions": list_questions(study, rater)}
    data = json.dumps(content, ensure_ascii=True).replace("<", "\\u003c")
    return build_page(
        "How natural does it look?", build_element("progress", max=len(pages) - 1, value=0), *pages,
        build_element("p", _build_button("back", "Back"), _build_button("next", "Next")),
        build_element("noscript", build_element("p", f"This form needs JavaScript; fill in {rater}.csv instead.")),
        Html(f'<script type="application/json" id="study">{data}</script>'), build_element("script", Html(_SCRIPT)),
        style=_STYLE,
    )  # fmt: skip


def build_form_table(study: Study, rater: str) -> str:
    """Build the same questions as a CSV to type into, with an empty answer for each, in the rater's order.

    Args:
        study: the study.
        rater: the rater's name.
    Returns:
        The table as text.
    """
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\r\n")
    table.writerow(ANSWER_COLUMNS)
    table.writerows((study.id, rater, question, "") for question in list_questions(study, rater))
    return text.getvalue()


def list_questions(study: Study, rater: str) -> list[str]:
    """List the keys of all questions in a rater's order; the key of a pair is both names with a slash between.

    Args:
        study: the study.
        rater: the rater's name.
    Returns:
        The keys.
    """
    return [question.key for question in BACKGROUND] + ["/".join(shown) for shown in study.orders[rater]]


def find_movie(folder: Path, name: str) -> Path | None:
    """Find the movie of a clip in a folder.

    Args:
        folder: the folder.
        name: the clip's neutral name.
    Returns:
        The file; None if there is none.
    """
    return next((path for suffix in MOVIES if (path := folder / f"{name}{suffix}").is_file()), None)


def _build_introduction(study: Study) -> Html:
    page_count = len(next(iter(study.orders.values()), ()))
    paragraphs = [build_element("p", line) for line in (*INTRODUCTION, f"There are {page_count} pages with clips.")]
    return build_element("section", build_element("h1", "How natural does it look?"), *paragraphs)


def _build_background() -> Html:
    parts = [_build_choices(question.key, question.text, question.choices, question.needed) for question in BACKGROUND]
    return build_element("section", build_section("About you", *parts), hidden=True)


def _build_clip_page(study: Study, shown: tuple[str, ...], sources: Mapping[str, str], title: str) -> Html:
    """Build the page of one clip or of a pair with its question."""
    name = "/".join(shown)
    training = () if study.is_counted(shown) else (" ", build_element("span", "(to get used to it)", class_="quiet"))
    sides = ("Left", "Right") if len(shown) == 2 else ("",)
    clips = [build_element("div", _build_clip(sources[one]), build_element("p", side, class_="quiet")) for one,
             side in zip(shown, sides)]
    if study.pairs:
        choices = tuple(zip((shown[0], SAME, shown[1]), ("Left", "No difference", "Right")))
    else:
        choices = tuple((str(mark), text) for mark, text in enumerate(SCALE, 1))
    question = _build_choices(name, COMPARE if study.pairs else RATE, choices, needed=True)
    shown_clips = build_element("div", *clips, class_="pair" if len(shown) == 2 else "one")
    return build_element("section", build_section(join_html(title, *training), shown_clips, question), hidden=True)


def _build_clip(source: str) -> Html:
    if source.lower().endswith(".gif") or source.startswith("data:image/"):
        return build_element("img", alt="the clip", src=source)
    return build_element("video", src=source, controls=True, loop=True, muted=True, playsinline=True, preload="auto")


def _build_choices(key: str, text: str, choices: tuple[tuple[str, str], ...], needed: bool) -> Html:
    """Build a question with one choice."""
    inputs = [build_element("label", build_element("input", type="radio", name=key, value=value), f" {label}")
              for value, label in choices]  # fmt: skip
    return build_element("fieldset", build_element("legend", text), *inputs, data_needed=needed)


def _build_button(id_: str, text: str) -> Html:
    return build_element("button", text, id=id_, type="button")


def _build_end() -> Html:
    thanks = "Save your answers and send the file to the person who gave you this form. Nothing has been sent."
    buttons = build_element("p", _build_button("csv", "Save as a table (CSV)"), _build_button("json", "Save as JSON"))
    return build_element("section", build_section("Thank you", build_element("p", thanks), buttons), hidden=True)
