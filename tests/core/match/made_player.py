"""A player of two stretches with all that can be asked of one, for tests of its file."""

import numpy as np

from beyond_mocap.annotation import KeyMoment, Span, Timeline
from beyond_mocap.match.crowd.correction import CURVES, Correction
from beyond_mocap.match.pieces.named_edit import NamedEdit, NamedKey
from beyond_mocap.match.player_edit import PlayerEdit, Stretch, to_stored_plan
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.heading_path import HeadingPath
from beyond_mocap.synthesis.heading_request import HeadingKey
from beyond_mocap.synthesis.plan import Pin, Plan, PlayerTouch, SolvedTrajectory


def made_player(seed: int = 3) -> PlayerEdit:
    """A player of two stretches with all that can be asked of one."""
    random = np.random.default_rng(seed)
    curves = np.zeros((60, CURVES))
    curves[10:40, :2] = 0.1
    stretches = tuple(made_stretch(random, begin) for begin in (0.04, 2000.0))
    return PlayerEdit("home_7", 30.0, stretches, Correction.from_curves(curves, 100, 25.0))


def made_stretch(random, begin: float) -> Stretch:
    times = begin + np.cumsum(random.uniform(0.03, 0.05, 200))
    ball = random.normal(size=(200, 3)) * 30.0
    ball[random.random(200) < 0.3] = np.nan
    ball[:9, 2] = np.nan
    track = Track(times, random.normal(size=(200, 2)) * 40.0, ball, None, random.random(200) < 0.1,
                  random.random(200) < 0.1, "home_7")  # fmt: skip
    fine = np.arange(times[0], times[-1], 0.01)
    course = random.normal(size=(len(fine), 3))
    course[:30] = np.nan
    touches = (PlayerTouch(begin + 1.0, True, "foot", "kick"), PlayerTouch(begin + 3.1, None, "", "receive"))
    timeline = Timeline(
        (Span(begin, begin + 2.0, ("walking",), avoid=("kick",)),), (KeyMoment(begin + 1.1, ("kick", "left")),)
    )
    plan = Plan(
        track=track, timeline=timeline, library="clips", nearest=True, seed=9, fps=25.0, height=1.83,
        solve_touches=True, solved=SolvedTrajectory(fine, course, random.random(len(fine)) < 0.2, touches),
        style=("academy",),
        gaits=(("walking", "walk.bvh"),), strong_foot="left",
        pins=(Pin(begin + 2.0, "gaze", (0.0, 1.0, 1.5), 0.5),),
        heading_keys=(HeadingKey(begin + 1.0, 0.7), HeadingKey(begin + 3.0, target=(1.0, -2.5), hold=1.5)),
        heading_path=HeadingPath(np.round(begin + np.arange(40) / 6.0, 6), random.integers(-50, 50, 40)),
    )  # fmt: skip
    edit = NamedEdit(clips=(("a.bvh", False), ("sub/ü.bvh", True)), clip=[0, 1, 0], first=random.normal(size=3) * 100.0,
                     rate=[1.0, 0.875, 0.7], length=[90, 60, 90], cut=[True, False, True],
                     keys=(NamedKey(
                         time=begin + 1.1, clip=1, frame=20.5, start=10.0, end=30.0, words=("kick", "left"),
                     ),))  # fmt: skip
    return Stretch(to_stored_plan(plan), edit, ("the library has no clip for 'bow'",), ((begin, begin + 1.0),))
