"""Configuration of a training, read from a small JSON file.

docs/reference/network-weights.md has a table of all names.
"""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path

from beyond_mocap.base.content import read_utf8
from beyond_mocap.base.errors import InputError
from beyond_mocap.files import json_values as values
from beyond_mocap.throws.networks.model import ModelSettings

PAGE = "docs/reference/network-weights.md"
MAX_FILE_SIZE = 1_000_000
"""Largest size of a config file, bytes."""
LIMITS = {
    "epochs": (0, 1_000_000), "macro": (1, 10_000), "batch": (1, 65_536), "learning_rate": (1e-7, 1.0),
    "final_rate": (0.0, 1.0), "keep": (0.05, 1.0), "l1": (0.0, 10.0), "limb_weight": (0.0, 1000.0),
    "body_weight": (0.0, 1000.0), "rollout": (1, 64), "single_frames": (0.0, 1.0), "noise": (0.0, 0.5),
    "start_noise": (0.0, 0.5), "seed": (0, 2**31 - 1), "examples": (1, 1000), "patience": (1, 10_000),
    "ridge": (0.0, 10.0),
}


@dataclass(frozen=True)
class TrainingConfig:
    """How networks are trained.

    Attributes:
        settings: settings of the model; a linear start widens `units` where the skeleton needs more.
        epochs: passes through all frames at most.
        early_stopping: as many of them as help a subject that is held out, none if there is only one; otherwise all.
        patience: macro-epochs without an improvement there after which the search for their number ends.
        macro: epochs between two checkpoints (section 7.6).
        batch: frames per step.
        learning_rate: Adam's learning rate at the start.
        final_rate: share of it at the end; it falls along a cosine.
        keep: share of values that dropout keeps, in single, hip and body (section 7.6).
        l1: lambda 1 of eq. 7.5, on the mean absolute weight.
        limb_weight: lambda 2 of eq. 7.5, per metre, for arms and legs.
        body_weight: lambda 2 of eq. 7.5, per metre, for hip and body.
        effector_loss: whether lambda 2 is used at all.
        single_effector: whether it is used for the single network too (section 9.2).
        rollout: frames that are fed back before the loss is computed; 1 is one frame from the truth, as in section
            7.5.
        single_frames: share of the training with single frames before that.
        noise: rad, error of the pose at the start of a stretch.
        mirrored: also use the mirror image of each example.
        linear_start: networks start from linear regression, otherwise at random.
        ridge: ridge of that regression, per row; 0: chosen on examples that are held out.
        start_noise: rad, error of the joints in a copy of all frames that the regression also uses
            (`disturb_poses`); 0: none.
        examples: largest number of examples that the model contains for start poses (section 7.7.1) and plans.
        all_subjects: these are examples of all subjects, otherwise of the first one.
        seed: of first weights, order, dropout and noise.
    """

    settings: ModelSettings = field(
        default_factory=lambda: ModelSettings(units=96, conditioned=True, guided=True, carried=True)
    )
    epochs: int = 30
    early_stopping: bool = True
    patience: int = 3
    macro: int = 2
    batch: int = 512
    learning_rate: float = 1e-4
    final_rate: float = 0.05
    keep: float = 1.0
    l1: float = 0.01
    limb_weight: float = 50.0
    body_weight: float = 33.0
    effector_loss: bool = True
    single_effector: bool = False
    rollout: int = 8
    single_frames: float = 0.0
    noise: float = 0.02
    mirrored: bool = True
    linear_start: bool = True
    ridge: float = 0.0
    start_noise: float = 0.07
    examples: int = 120
    all_subjects: bool = True
    seed: int = 0

    def __post_init__(self):
        for name, (low, high) in LIMITS.items():
            if not low <= getattr(self, name) <= high:
                raise InputError(f"training: {name}", f"{getattr(self, name)}", f"{low} to {high}", f"see {PAGE}")

    def to_dict(self) -> dict:
        """Return all names of the JSON with their values."""
        own = {name: value for name, value in asdict(self).items() if name != "settings"}
        return {**asdict(self.settings), **own}


def read_config(path: str | os.PathLike | None, **changes) -> TrainingConfig:
    """Read a training from a JSON file; names that it lacks, and a missing file, mean the defaults.

    Args:
        path: the file, or None.
        changes: values that replace the file's; None means no change.
    Raises:
        InputError: one line: no such file, no JSON, an unknown name, a value out of its range.
    """
    entries = {}
    if path is not None:
        entries = values.parse_json(read_utf8(Path(path), "a training's config", MAX_FILE_SIZE), str(path), PAGE)
        values.check_object(entries, str(path))
    changes = {name: value for name, value in changes.items() if value is not None}
    return build_config({**entries, **changes}, path or "config")


def build_config(entries: dict, where: object = "config") -> TrainingConfig:
    """Build a training from names and values; InputError as for `read_config`."""
    known = TrainingConfig().to_dict()
    values.check_names(entries, str(where), known, ())
    read = {name: _parse_value(value, known[name], f"{where}: {name}") for name, value in entries.items()}
    of_model = {one.name for one in fields(ModelSettings)}
    start = TrainingConfig()
    try:
        settings = replace(start.settings, **{name: value for name, value in read.items() if name in of_model})
        return replace(start, settings=settings, **{name: read[name] for name in read if name not in of_model})
    except InputError as error:  # its text does not name the file
        raise InputError(where, str(error)) from None


def _parse_value(value, default, where: str):
    """Parse a value of the same type as the default."""
    if isinstance(default, bool):
        return values.check_bool(value, where)
    if isinstance(default, int):
        return values.check_whole_number(value, where)
    return values.check_number(value, where) if isinstance(default, float) else values.check_text(value, where)
