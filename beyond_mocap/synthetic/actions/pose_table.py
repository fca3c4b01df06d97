"""The actions that are tables of key poses, one row each: at the ball, a goalkeeper's moves,
celebrations and gestures."""

from __future__ import annotations

from collections.abc import Mapping

from ...annotation.vocabulary import SIDES
from ..gestures import Gesture
from .action import Action, ActionSetting
from .ball_poses import BALL_POSES
from .body_gestures import GESTURES
from .celebrations import CELEBRATIONS
from .keeper_dives import DIVES
from .keeper_saves import SAVES
from .keeper_throws import THROWS
from .key_poses import KeyPoses, build_key_poses


def _build_row(name: str, recipe: KeyPoses) -> Action:
    """Build the row of a recipe; those that name a side have their mirrored twin for the other one."""

    def build(setting: ActionSetting) -> Gesture:
        return build_key_poses(recipe, setting.skeleton, setting.fps, example=setting.example)

    labels = frozenset(recipe.labels.split())
    return Action(name=name.replace("_", " "), labels=labels - set(SIDES), build=build,
                  has_side=bool(labels & set(SIDES)), is_span=recipe.is_span)


def _build_rows(*tables: Mapping[str, KeyPoses]) -> tuple[Action, ...]:
    return tuple(_build_row(name, recipe) for table in tables for name, recipe in table.items())


POSE_ACTIONS = _build_rows(BALL_POSES, SAVES, DIVES, THROWS, CELEBRATIONS, GESTURES)
"""Rows for `table.ACTIONS`."""
