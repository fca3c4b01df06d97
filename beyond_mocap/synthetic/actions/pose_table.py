"""The actions that are tables of key poses, one row each: a goalkeeper's moves, celebrations and gestures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...annotation.vocabulary import SIDES
from ...motion.supports import GRAVITY
from ..gestures import Gesture
from .action import Action, ActionSetting
from .body_gestures import GESTURES
from .celebrations import CELEBRATIONS
from .keeper_dives import DIVES
from .keeper_saves import HANDS_AT_TOP, SAVES
from .keeper_slide import SLIDES
from .keeper_throws import THROWS
from .key_poses import KeyPoses, build_key_poses, retime_flight

_LEAST_JUMP, _MOST_JUMP = 0.14, 0.29  # s from take-off to the top: jumps of 0.1 and 0.4 m
_BALL_ABOVE = 0.1  # m from the hands' joints to the centre of a ball that they meet overhead


def _jump_to(recipe: KeyPoses, hands: float, setting: ActionSetting) -> KeyPoses:
    """Retime a jump so that the hands, at height `hands` (m of an adult) in the table, meet the ball at its top."""
    if setting.height is None:
        return recipe
    higher = setting.height - _BALL_ABOVE - hands * setting.scale
    half = np.sqrt(max(recipe.flights[0][1] ** 2 + 2.0 * higher / GRAVITY, 0.0))
    return retime_flight(recipe, float(np.clip(half, _LEAST_JUMP, _MOST_JUMP)))


def _build_row(name: str, recipe: KeyPoses) -> Action:
    """Build the row of a recipe; those that name a side have their mirrored twin for the other one."""
    hands = HANDS_AT_TOP.get(name)

    def build(setting: ActionSetting) -> Gesture:
        chosen = recipe if hands is None else _jump_to(recipe, hands, setting)
        return build_key_poses(chosen, setting.skeleton, setting.fps, example=setting.example, seconds=setting.seconds)

    labels = frozenset(recipe.labels.split())
    return Action(name=name.replace("_", " "), labels=labels - set(SIDES), build=build, meets=recipe.meets,
                  needs=frozenset(recipe.needs.split()), heights=(1.9, 2.7) if hands else (),
                  has_side=bool(labels & set(SIDES)), is_span=recipe.is_span,
                  can_last=recipe.can_last, varies=recipe.varies)


def build_pose_actions(*tables: Mapping[str, KeyPoses]) -> tuple[Action, ...]:
    """Build the actions of tables of key poses, by their names."""
    return tuple(_build_row(name, recipe) for table in tables for name, recipe in table.items())


POSE_ACTIONS = build_pose_actions(SAVES, DIVES | SLIDES, THROWS, GESTURES, CELEBRATIONS)
"""Rows for `table.ACTIONS`."""
