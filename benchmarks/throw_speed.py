"""What throws cost: the networks alone, of several sizes, and a throw of three seconds with the weights that are
shipped.

`python -m benchmarks.throw_speed` prints the tables; OPENBLAS_NUM_THREADS=1 for one core."""

from __future__ import annotations

import numpy as np

from beyond_mocap.motion.adult import adult_skeleton
from beyond_mocap.motion.throws import throw
from beyond_mocap.synthesis.phase_network import phase_function
from beyond_mocap.synthesis.phase_network.chains import chains_of
from beyond_mocap.synthesis.phase_network.example import describe, example_of
from beyond_mocap.synthesis.phase_network.features import widths
from beyond_mocap.synthesis.phase_network.generate import Options, generate
from beyond_mocap.synthesis.phase_network.model import ModelSettings, ThrowModel
from beyond_mocap.synthesis.phase_network.network import PhaseNetwork
from beyond_mocap.throw import shipped_model

from benchmarks.effort import seconds
from benchmarks.markdown import head, row

FRAMES = 90
SIZES = (("hierarchy", 4, 3, 96), ("hierarchy", 4, 3, 128), ("hierarchy", 4, 3, 256), ("hierarchy", 1, 8, 256),
         ("single", 4, 4, 512))  # fmt: skip
_RUNS = 5


def networks_row(kind: str, points: int, layers: int, units: int) -> str:
    """The networks of one size, evaluated frame after frame on a full body."""
    settings = ModelSettings(kind, points, layers, units)
    random = np.random.default_rng(1)
    made = [_network(random, *size, settings) for size in widths(chains_of(adult_skeleton(1.8)), settings).values()]
    inputs = [random.normal(size=network.inputs).astype(np.float32) for network in made]
    thetas = [phase_function.weights_at(frame / FRAMES, points) for frame in range(FRAMES)]

    def all_frames():
        for theta in thetas:
            for network, x in zip(made, inputs):
                network.frame(x, theta)

    spent, _ = seconds(all_frames, _RUNS)
    count = sum(network.parameters for network in made)
    return row(
        [kind, str(points), str(layers), str(units), f"{count / 1e6:.2f}", f"{2 * count / 1e6:.1f}", f"{spent:.3f}"]
    )


def _network(random, inputs: int, outputs: int, settings: ModelSettings) -> PhaseNetwork:
    sizes = [inputs, *[settings.units] * settings.layers, outputs]
    shapes = [(settings.points, out, width) for width, out in zip(sizes, sizes[1:])]
    weights = tuple((random.normal(size=shape) / np.sqrt(shape[2])).astype(np.float32) for shape in shapes)
    biases = tuple(np.zeros(shape[:2], np.float32) for shape in shapes)
    return PhaseNetwork(weights, biases, np.zeros(inputs), np.ones(inputs), np.zeros(outputs), np.ones(outputs))


def throw_rows(model: ThrowModel, name: str) -> list[str]:
    """A throw of three seconds on the model's skeleton: what the networks say, and with everything after the fact."""
    made = throw((18.0, 1.0, 1.0), 20.0, "right", skeleton=model.skeleton, fps=120.0)
    begin = max(made.release - 1.75, 0.0)
    example = example_of("timed", "", made.motion, "right_hand", made.release, (18.0, 1.0, 1.0), None,
                         model.settings.fps, (begin, begin + 3.0))  # fmt: skip
    description, rows = describe(example), []
    for what, options in (("nothing corrected", Options(pose_iterations=0, ik=False, blend=False, limits=False)),
                          ("start pose, inverse kinematics, limits", Options())):  # fmt: skip
        generate(model, description, options=options)
        spent, done = seconds(lambda options=options: generate(model, description, options=options), _RUNS)
        rows.append(row([name, str(len(description)), what, str(done.iterations), f"{spent:.3f}"]))
    return rows


def section() -> list[str]:
    """Lines for results.md."""
    lines = head(("networks", "control points", "hidden layers", "units", "parameters, million", "MB as float16",
                  f"s for {FRAMES} frames (target 0.12)"))  # fmt: skip
    lines += [networks_row(*size) for size in SIZES]
    lines += ["", *head(("weights", "frames", "corrected by", "start iterations", "s (target 0.2)"))]
    return lines + throw_rows(shipped_model("throw"), "throw.npz")


if __name__ == "__main__":
    print("\n".join(section()))
