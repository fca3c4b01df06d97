"""A hand that throws nothing is refused: arms that swing in a gait, and a hand that a racquet pulls down."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.main import main
from beyond_mocap.files.bvh import bvh
from beyond_mocap.markers.files.trc import write_trc
from beyond_mocap.markers.release.release import ReleaseSettings, estimate_release
from beyond_mocap.markers.release.throw_check import check_throw
from beyond_mocap.motion.hand import Hand
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.ground_truth.synthetic_markers import build_trial
from beyond_mocap.synthetic.throws import build_throw

FPS = 200.0


def build_swing(speed, descent, seconds=2.0):
    """A hand that moves once, straight along -`descent` rad against the horizon, at most at `speed` m/s."""
    times = np.arange(0.0, seconds, 1.0 / FPS)
    along = np.cumsum(speed * np.exp(-(((times - 1.0) / 0.1) ** 2))) / FPS
    origin = along[:, None] * [np.cos(descent), 0.0, -np.sin(descent)] + [0.0, 0.0, 1.5]
    return Hand(side="right", fps=FPS, origin=origin, rotation=np.repeat(np.eye(3)[None], len(times), axis=0),
                finger=np.array([0.0, -1.0, 0.0]), reach=0.18, elbow=origin - [0.0, 0.25, 0.0])


@pytest.mark.parametrize("speed, hand, step", [
    (1.4, None, "choose the .*hand"), (3.5, None, "choose the .*hand"), (7.0, "left", "choose the other hand"),
])
def test_a_gait_is_no_throw(speed, hand, step):
    """The next step is never to choose the hand that was chosen."""
    known = build_trial(build_gait(speed, 2.0, FPS), "driveline")
    with pytest.raises(InputError, match=f"as in a run.*, or {step}$"):
        estimate_release(known.trial, known.motion, ReleaseSettings(hand=hand))


def test_half_a_stride_is_no_throw():
    known = build_trial(build_gait(7.0, 1.0, FPS).frames(40, 80), "driveline")
    with pytest.raises(InputError, match="as in a run"):
        estimate_release(known.trial, known.motion)


@pytest.mark.parametrize("style", ["overarm", "sidearm"])
@pytest.mark.parametrize("speed", [5.0, 12.0, 38.0])
def test_throws_are_throws_however_slow(speed, style):
    thrown = build_throw((min(0.5 * speed, 15.0), 0.0, 1.0), speed, style=style, fps=120.0)
    known = build_trial(thrown.motion, "driveline")
    assert abs(estimate_release(known.trial, known.motion).speed / speed - 1.0) < 0.25


def test_a_hand_that_is_fastest_downwards_holds_a_racquet():
    hips = np.zeros((400, 3))
    check_throw(build_swing(9.0, np.radians(45.0)), (), hips, "throw")
    with pytest.raises(InputError, match="racquet"):
        check_throw(build_swing(9.0, np.radians(75.0)), (), hips, "serve")


def test_a_hand_that_the_body_carries_does_not_throw():
    swing = build_swing(9.0, 0.0)
    for others, step in (((), "choose another trial, or the other hand"), ((swing,), "choose another trial")):
        with pytest.raises(InputError, match=f"at most 0.0 m/s relative to the hips; expected a throw; {step}$"):
            check_throw(swing, others, swing.origin, "slide")


def test_a_chosen_hand_is_compared_with_itself_alone():
    """Both hands of a two-handed throw are equally fast; the user may say that one of them throws."""
    swing = build_swing(5.0, 0.3)
    with pytest.raises(InputError, match="as in a run.*choose the hand"):
        check_throw(swing, (build_swing(5.0, 0.3),), np.zeros((400, 3)), "pass")
    check_throw(swing, (), np.zeros((400, 3)), "pass")


def test_the_verb_refuses_a_run_with_one_line_and_writes_nothing(tmp_path, capsys):
    known = build_trial(build_gait(6.0, 1.5, FPS), "driveline")
    write_trc(known.trial, tmp_path / "run.trc")
    bvh.write_bvh(tmp_path / "m.bvh", known.motion)
    files = [str(tmp_path / name) for name in ("run.trc", "m.bvh", "r.json")]
    assert main(["release", files[0], "--motion", files[1], "--report", files[2]]) == 2
    told = capsys.readouterr().err.strip()
    assert f"{files[0]}: a " in told and "\n" not in told and "expected a throw" in told
    assert len(list(tmp_path.iterdir())) == 2
