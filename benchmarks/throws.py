"""The section on throws and kicks: the shipped weights on people that they never saw, targets anywhere, seconds, and
what the experiments found (`python -m benchmarks.throw_experiments`)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from beyond_mocap.errors import BeyondMocapError
from beyond_mocap.evaluate_throws import FULL, RAW, evaluate_throws
from beyond_mocap.planted_examples import planted
from beyond_mocap.synthesis.phase_network.example import example_of
from beyond_mocap.throw import Order, shipped_model, throw_at

from benchmarks import effort, markdown, throw_speed

UNSEEN, EACH = (901, 902, 903), 3
"""Seeds of made people whom no shipped weights saw, and movements of each."""
TARGETS = {
    "throw": ((6.0, 0.0, 1.2), (12.0, 4.0, 0.4), (12.0, -4.0, 2.2), (18.0, 0.0, 1.0), (24.0, 6.0, 1.5)),
    "kick": ((11.0, 0.0, 0.5), (11.0, 3.4, 2.2), (11.0, -3.4, 0.4), (16.0, 2.0, 1.2), (20.0, -3.0, 1.8)),
}
"""m, the thrower or the ball at the origin; (x, y) is turned by any angle."""


def section() -> list[str]:
    """Lines for results.md; an action without weights is told."""
    lines = []
    for action in TARGETS:
        lines += [f"### {action.capitalize()}s by the shipped weights", ""]
        try:
            model = shipped_model(action)
        except BeyondMocapError as error:
            lines += [f"None: {error}", ""]
            continue
        lines += [f"{model.trained_on}.", "", *unseen_table(model, action), "", *target_table(model, action), ""]
    lines += ["### What the networks cost", "", *throw_speed.section(), ""]
    return [*lines, "The experiments (Fredriksson §8.3) are in docs/throw-experiments.md.", ""]


@lru_cache(maxsize=None)
def unseen(action: str, fps: float) -> tuple:
    """Movements of people whom no weights saw."""
    found = []
    for seed in UNSEEN:
        for order in range(EACH):
            name, made = planted(action, seed, order)
            span = (made.release - 1.6, made.release + 1.2)
            found.append(example_of(f"{name} {order}", name, made.motion, made.limb, made.release, made.impact, fps=fps,
                                    span=span))  # fmt: skip
    return tuple(found)


def unseen_table(model, action: str) -> list[str]:
    """What the model makes of movements that it never saw, scaled by height."""
    lines = markdown.head([
        f"{len(UNSEEN)} unseen people, {EACH} each", "left hand, right hand, left foot, right foot, cm",
        "networks alone, cm", "ball off at 4 m, m", "head off, °", "head turns", "jerk", "beyond limits",
    ])  # fmt: skip
    for words, options in (("networks alone (target 3 cm)", RAW), ("corrected", FULL)):
        report = evaluate_throws(model, unseen(action, model.settings.fps), options).report()
        lines.append(markdown.row([
            words, _centimetres(report["deviation_m"]), _centimetres(report["network_deviation_m"]),
            *(_number(report[name], form) for name, form in (("impact_m", ".2f"), ("head", ".1f"),
                                                             ("head_share", ".2f"),
                                                             ("jerk", ".2f"), ("beyond", ".4f"))),
        ]))  # fmt: skip
    return lines


def target_table(model, action: str) -> list[str]:
    """Targets that nobody aimed at, after the last correction."""
    lines = markdown.head(
        ["target, m", "ball off, m (0.10)", "moved, cm (5)", "turned, °", "m/s", "raw, cm (3)", "seconds"]
    )
    for number, target in enumerate(TARGETS[action]):
        angle = 1.1 * number  # anywhere on the ground
        turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        order = Order(tuple(turn @ target))
        try:
            took, thrown = effort.seconds(lambda order=order: throw_at(model, order))
        except BeyondMocapError as error:
            lines.append(markdown.row([_place(target), f"refused: {error}"[:110], *[""] * 5]))
            continue
        lines.append(markdown.row([
            _place(target), f"{thrown.impact_error:.3f}", f"{100 * thrown.moved:.1f}",
            f"{np.degrees(thrown.turned):.1f}",
            f"{thrown.speed:.1f}", f"{100 * thrown.raw_deviation:.1f}",
            f"{took:.2f} for {thrown.motion.duration:.1f}",
        ]))  # fmt: skip
    return lines


def _place(target) -> str:
    return ", ".join(f"{value:g}" for value in target)


def _centimetres(values: dict) -> str:
    return ", ".join(f"{100 * value:.1f}" for value in values.values())


def _number(value: float, form: str) -> str:
    return format(value, form) if np.isfinite(value) else "-"
