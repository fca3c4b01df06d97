"""Throws and kicks: the shipped weights on performers that they were not trained on, targets anywhere, and seconds."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from benchmarks import effort
from beyond_mocap.base.errors import BeyondMocapError
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.evaluate_throws import FULL_OPTIONS, RAW_OPTIONS, evaluate_throws
from beyond_mocap.throws.network_npz import read_shipped_model
from beyond_mocap.throws.networks.chains import find_chains
from beyond_mocap.throws.networks.example import build_description, build_example
from beyond_mocap.throws.networks.features import count_widths
from beyond_mocap.throws.networks.generate import generate_motion
from beyond_mocap.throws.networks.model import ModelSettings, ThrowModel
from beyond_mocap.throws.networks.network import PhaseNetwork
from beyond_mocap.throws.networks.phases import weigh_points_at
from beyond_mocap.throws.synthetic_examples import generate_example
from beyond_mocap.throws.throw import throw_at
from beyond_mocap.throws.throw_request import ThrowRequest

UNSEEN, EACH = (901, 902, 903), 3
"""Seeds of synthetic performers that no shipped weights were trained on, and movements of each."""
TARGETS = {"throw": ((6.0, 0.0, 1.2), (12.0, 4.0, 0.4), (12.0, -4.0, 2.2), (18.0, 0.0, 1.0), (24.0, 6.0, 1.5)),
           "kick": ((11.0, 0.0, 0.5), (11.0, 3.4, 2.2), (11.0, -3.4, 0.4), (16.0, 2.0, 1.2), (20.0, -3.0, 1.8))}
"""m, the thrower or the ball at the origin; (x, y) is rotated by any angle."""
FRAMES = 90  # evaluated frames of the networks
SIZES = (("hierarchy", 4, 3, 96), ("hierarchy", 4, 3, 128), ("hierarchy", 4, 3, 256), ("hierarchy", 1, 8, 256),
         ("single", 4, 4, 512))  # fmt: skip
_RUNS = 5


def section() -> list[str]:
    """Build the lines for results.md; an action without weights is reported."""
    lines = []
    for action in TARGETS:
        lines += [f"### {action.capitalize()}s by the shipped weights", ""]
        try:
            model = read_shipped_model(action)
        except BeyondMocapError as error:
            lines += [f"None: {error}", ""]
            continue
        lines += [f"{model.trained_on}.", "", *build_unseen_table(model, action), "",
                  *build_target_table(model, action), ""]
    lines += ["### What the networks cost", "", *build_speed_tables(), ""]
    return lines


@lru_cache(maxsize=None)
def generate_unseen(action: str, fps: float) -> tuple:
    """Generate movements of performers that no weights were trained on."""
    found = []
    for seed in UNSEEN:
        for order in range(EACH):
            name, movement = generate_example(action, seed, order)
            span = (movement.release - 1.6, movement.release + 1.2)
            found.append(build_example(f"{name} {order}", name, movement.motion, movement.limb, movement.release,
                                       movement.impact, fps=fps, span=span))  # fmt: skip
    return tuple(found)


def build_unseen_table(model, action: str) -> list[str]:
    """Evaluate the model on movements that it was not trained on, scaled by height."""
    lines = effort.format_head([f"{len(UNSEEN)} unseen performers, {EACH} each",
                                "left hand, right hand, left foot, right foot, cm", "networks alone, cm",
                                "ball off at 4 m, m", "head off, °", "head turns", "jerk", "beyond limits"])
    for words, options in (("networks alone (target 3 cm)", RAW_OPTIONS), ("corrected", FULL_OPTIONS)):
        report = evaluate_throws(model, generate_unseen(action, model.settings.fps), options).build_report()
        lines.append(effort.format_row([
            words, _format_centimetres(report["deviation_m"]), _format_centimetres(report["network_deviation_m"]),
            *(_format_number(report[name], form) for name, form in (("impact_m", ".2f"), ("head", ".1f"),
                                                                    ("head_share", ".2f"),
                                                                    ("jerk", ".2f"), ("beyond", ".4f"))),
        ]))  # fmt: skip
    return lines


def build_target_table(model, action: str) -> list[str]:
    """Evaluate new targets, after the last correction."""
    lines = effort.format_head(
        ["target, m", "ball off, m (0.10)", "moved, cm (5)", "turned, °", "m/s", "raw, cm (3)", "seconds"]
    )
    for number, target in enumerate(TARGETS[action]):
        angle = 1.1 * number  # rad, any direction on the ground
        turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        request = ThrowRequest(tuple(turn @ target))
        try:
            took, thrown = effort.measure_seconds(lambda request=request: throw_at(model, request))
        except BeyondMocapError as error:
            lines.append(effort.format_row([_format_place(target), f"refused: {error}"[:110], *[""] * 5]))
            continue
        lines.append(effort.format_row([_format_place(target), f"{thrown.impact_error:.3f}",
                                        f"{100 * thrown.displacement:.1f}", f"{np.degrees(thrown.rotation):.1f}",
                                        f"{thrown.speed:.1f}", f"{100 * thrown.network_deviation:.1f}",
                                        f"{took:.2f} for {thrown.motion.duration:.1f}"]))
    return lines


def _format_place(target) -> str:
    """Format a place."""
    return ", ".join(f"{value:g}" for value in target)


def _format_centimetres(values: dict) -> str:
    """Format values in centimetres."""
    return ", ".join(f"{100 * value:.1f}" for value in values.values())


def _format_number(value: float, form: str) -> str:
    """Format a number, "-" where it is not finite."""
    return format(value, form) if np.isfinite(value) else "-"


def build_networks_row(kind: str, points: int, layers: int, units: int) -> str:
    """Measure the networks of one size, evaluated frame after frame on a full body."""
    settings = ModelSettings(kind=kind, points=points, layers=layers, units=units)
    random = np.random.default_rng(1)
    networks = [_build_network(random, *size, settings) for size in count_widths(find_chains(build_adult_skeleton(1.8)),
                                                                                 settings).values()]
    inputs = [random.normal(size=network.inputs).astype(np.float32) for network in networks]
    thetas = [weigh_points_at(frame / FRAMES, points) for frame in range(FRAMES)]

    def all_frames():
        for theta in thetas:
            for network, x in zip(networks, inputs):
                network.frame_network(x, theta)

    seconds, _ = effort.measure_seconds(all_frames, _RUNS)
    count = sum(network.parameters for network in networks)
    return effort.format_row(
        [kind, str(points), str(layers), str(units), f"{count / 1e6:.2f}", f"{2 * count / 1e6:.1f}", f"{seconds:.3f}"]
    )


def _build_network(random, inputs: int, outputs: int, settings: ModelSettings) -> PhaseNetwork:
    """Build a network with random weights."""
    sizes = [inputs, *[settings.units] * settings.layers, outputs]
    shapes = [(settings.points, out, width) for width, out in zip(sizes, sizes[1:])]
    weights = tuple((random.normal(size=shape) / np.sqrt(shape[2])).astype(np.float32) for shape in shapes)
    biases = tuple(np.zeros(shape[:2], np.float32) for shape in shapes)
    return PhaseNetwork(weights, biases, np.zeros(inputs), np.ones(inputs), np.zeros(outputs), np.ones(outputs))


def build_throw_rows(model: ThrowModel, name: str) -> list[str]:
    """Measure a throw of three seconds on the model's skeleton: the networks alone, and with all corrections."""
    movement = build_throw((18.0, 1.0, 1.0), 20.0, "right", skeleton=model.skeleton, fps=120.0)
    begin = max(movement.release - 1.75, 0.0)
    example = build_example("timed", "", movement.motion, "right_hand", movement.release, (18.0, 1.0, 1.0), None,
                            model.settings.fps, (begin, begin + 3.0))  # fmt: skip
    description, rows = build_description(example), []
    for what, options in (("nothing corrected", RAW_OPTIONS),
                          ("start pose, inverse kinematics, limits", FULL_OPTIONS)):  # fmt: skip
        generate_motion(model, description, options=options)
        seconds, result = effort.measure_seconds(lambda options=options: generate_motion(model, description,
                options=options), _RUNS)
        rows.append(effort.format_row([name, str(len(description)), what, str(result.iterations), f"{seconds:.3f}"]))
    return rows


def build_speed_tables() -> list[str]:
    """Measure the networks alone, of several sizes, and a throw of three seconds with the shipped weights."""
    lines = effort.format_head(("networks", "control points", "hidden layers", "units", "parameters, million",
                                "MB as float16", f"s for {FRAMES} frames (target 0.12)"))
    lines += [build_networks_row(*size) for size in SIZES]
    lines += ["", *effort.format_head(("weights", "frames", "corrected by", "start iterations", "s (target 0.2)"))]
    return lines + build_throw_rows(read_shipped_model("throw"), "throw.npz")
