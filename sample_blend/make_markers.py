"""Generate the sample's optical recordings: a synthetic performer with markers placed as in a laboratory.

    python sample_blend/make_markers.py [FOLDER]

`static.trc` is a performer who stands still, `throw.c3d` the same performer throwing a ball with one marker at 28 m/s,
`walk.trc` another performer walking, without a static trial, with gaps, a swap and an unlabeled stretch. What is
reconstructed from them can be compared with the ground truth (`beyond_mocap.synthetic.ground_truth.synthetic_markers`).
The same code gives the same bytes. Needs the core and the C3D package.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
if __name__ == "__main__":
    sys.path.insert(0, str(HERE.parent))

from beyond_mocap.markers.files.trc import write_trc  # noqa: E402
from beyond_mocap.markers.trial import MarkerTrial  # noqa: E402
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton  # noqa: E402
from beyond_mocap.synthetic.gait import build_gait  # noqa: E402
from beyond_mocap.synthetic.ground_truth.synthetic_ball import BallRequest  # noqa: E402
from beyond_mocap.synthetic.ground_truth.synthetic_markers import SyntheticTrial, build_trial  # noqa: E402
from beyond_mocap.synthetic.throws import build_throw  # noqa: E402

SPEED, TARGET = 28.0, (18.0, 0.0, 1.0)
"""The throw: m/s, and the place (3,) m that it hits without air."""
_THROW_FPS, _WALK_FPS = 240.0, 100.0  # frames per second
_STATIC_FRAMES = 60  # frames of the static trial


def generate_throw() -> SyntheticTrial:
    """Generate the throw, its static trial and the ground truth of both; the second around the ball's release."""
    movement = build_throw(TARGET, SPEED, fps=_THROW_FPS)
    return build_trial(movement.motion, "driveline", seed=11, ball=BallRequest(movement.release, spin_rate=18.0,
                                                                               seconds_seen=0.12), occlusion=0.01)


def generate_walk() -> SyntheticTrial:
    """Generate the walk of a smaller performer, with faults."""
    motion = build_gait(1.4, 1.8, fps=_WALK_FPS, skeleton=build_adult_skeleton(1.68), seed=4)
    return build_trial(motion, "plug_in_gait", seed=12, occlusion=0.03, swaps=1, jumps=2, unlabeled=1)


def write_recordings(folder: Path = HERE / "markers") -> None:
    """Write the recordings to `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    throwing, walking = generate_throw(), generate_walk()
    write_trc(throwing.static.select_frames(0, _STATIC_FRAMES), folder / "static.trc")
    release = int(throwing.ball.request.release * _THROW_FPS)
    write_c3d(throwing.trial.select_frames(release - 230, release + 110), folder / "throw.c3d")
    write_trc(walking.trial, folder / "walk.trc")


def write_c3d(trial: MarkerTrial, path: Path) -> None:
    """Write a trial as a C3D file in millimetres, Z up; markers that are not seen have the residual -1."""
    import c3d

    writer = c3d.Writer(point_rate=trial.fps, analog_rate=0, point_scale=-1.0)
    writer.set_point_labels(list(trial.labels))
    for places in trial.positions:
        seen = np.isfinite(places).all(axis=1)
        points = np.zeros((len(places), 5), np.float32)
        points[:, :3] = np.where(seen[:, None], 1000.0 * places, 0.0)
        points[:, 3] = np.where(seen, 0.0, -1.0)
        points[:, 4] = np.where(seen, 0.0, -1.0)
        writer.add_frames([(points, np.zeros((0, 0)))])
    writer.set_screen_axis("+X", "+Z")
    out = io.BytesIO()
    writer.write(out)
    path.write_bytes(out.getvalue())


if __name__ == "__main__":
    write_recordings(*(Path(argument) for argument in sys.argv[1:2]))
