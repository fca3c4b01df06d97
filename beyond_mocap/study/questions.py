"""What raters are asked: about themselves, and of every clip; after Faustino App. C, in words of our own."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Question:
    """One question about the rater. key: in the answers. needed: whether it has to be answered. choices: (key,
    text)."""

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
    "You will see short clips of one football player each. Look only at how the body moves, and tell how natural that "
    "looks to you. There are no right or wrong answers, and nobody asks for your name.",
    "Every clip may be watched as often as you like. The first two are there to get used to the task; their answers do "
    "not count.",
)
