"""A library of made gaits, and takes cut from it by hand, so that every figure of the report is known beforehand."""

from typing import NamedTuple

import numpy as np
import pytest

from beyond_mocap.annotation import Timeline
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.library.library import Library
from beyond_mocap.motion.motion import Motion, concatenate_motions, place_motion, sample_frames
from beyond_mocap.motion.track import Track, smooth_zero_phase_hann
from beyond_mocap.motion.track.ball_path import BallPath
from beyond_mocap.synthesis.quality.playback import playback_from_take
from beyond_mocap.synthesis.take import KeyResult, Take
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0
SOURCE_FPS = 60.0
KEY_FRAME = 300
CLIPS = {
    "walk.bvh": (1.3, "0 12 walking front\n"),
    "jog.bvh": (2.8, "0 12 jogging front\n4.5 5.6 kick right\n5.0 kick right\n"),
    "run.bvh": (4.2, "0 12 running front\n"),
    "stand.bvh": (0.0, "0 12 standing\n"),
}


@pytest.fixture(scope="session")
def library(tmp_path_factory) -> Library:
    folder = tmp_path_factory.mktemp("library")
    for seed, (name, (speed, words)) in enumerate(CLIPS.items()):
        bvh.write_bvh(folder / name, build_gait(speed, 12.0, SOURCE_FPS, seed=seed))
        (folder / name).with_suffix(".txt").write_text(words)
    return build_library(folder)


class Part(NamedTuple):
    """A piece of a clip: from source frame `first` on, `count` output frames at `rate` times its speed."""

    path: str
    first: float
    count: int
    rate: float = 1.0
    mirrored: bool = False


@pytest.fixture(scope="session")
def cut(library):
    """cut((path, first, count[, rate[, mirrored]]), ..., asked=(KeyMoment, ...), timeline=None, ball=None) -> Take: the
    parts, each begun where the last ended."""

    def build_take(*parts, requested=(), timeline=None, ball=None, start_time=10.0) -> Take:
        pieces, end = [], None
        for part in (Part(*part) for part in parts):
            motion, frames = _build_piece(library, part)
            if end is not None:
                motion = place_motion(motion, 0.0, (*(end - motion.root_positions[0])[:2], 0.0))
            end = 2 * motion.root_positions[-1] - motion.root_positions[-2]
            pieces.append((part, motion, frames))
        return _build_take(library, pieces, requested, timeline, ball, start_time)

    return build_take


def find_clip(library, part):
    return next(clip for clip in library.clips if (clip.path, clip.mirrored) == (part.path, part.mirrored))


def _build_piece(library, part):
    clip = find_clip(library, part)
    frames = part.first + np.arange(part.count) * part.rate * clip.motion.fps / FPS
    root, rotations = sample_frames(clip.motion, frames)
    return Motion(clip.motion.skeleton, root, rotations, FPS), frames


def _build_take(library, pieces, requested, timeline, ball, start_time) -> Take:
    paths = tuple(sorted({part.path for part, _, _ in pieces}))
    frames = np.concatenate([frames for _, _, frames in pieces])
    counts = [len(frames) for _, _, frames in pieces]
    clips = [find_clip(library, part) for part, _, frames in pieces for _ in range(len(frames))]
    contacts = np.array([clip.contacts[int(np.rint(frame))] for clip, frame in zip(clips, frames)])
    keys = tuple(_build_result(key, pieces, frames, start_time) for key in requested)
    return Take(
        motion=concatenate_motions([motion for _, motion, _ in pieces]),
        start_time=start_time,
        clips=paths,
        clip=np.array([paths.index(clip.path) for clip in clips]),
        clip_frame=frames,
        mirrored=np.array([clip.mirrored for clip in clips]),
        words=tuple(tuple(sorted(clip.labels_at(frame))) for clip, frame in zip(clips, frames)),
        contacts=contacts,
        seams=np.cumsum(counts)[:-1],
        timeline=timeline or Timeline(keys=tuple(requested)),
        keys=keys,
        ball=ball,
        method="blocks",
        seed=0,
    )


def _build_result(key, pieces, frames, start_time) -> KeyResult:
    frame = float(np.argmin(np.abs(frames - KEY_FRAME)))
    return KeyResult(requested=key, frame=frame, clip=pieces[0][0].path, clip_frame=KEY_FRAME, mirrored=False,
                     words=("jogging", "kick", "right"))


@pytest.fixture(scope="session")
def track_of():
    """track_of(take, shift=(0, 0), ball=None) -> Track: samples at 25 Hz of the take's pelvis behind a 1.5 s window,
    moved."""
    def build_track(take, shift=(0.0, 0.0), ball=None) -> Track:
        played = playback_from_take(take)
        path = smooth_zero_phase_hann(played.pelvis, FPS, 1.5)
        times = np.arange(played.times[0], played.times[-1] + 1e-9, 0.04)
        positions = np.stack([np.interp(times, played.times, path[:, axis]) for axis in (0, 1)], axis=-1)
        return Track(times, positions + shift, ball=None if ball is None else np.broadcast_to(ball, (len(times), 3)))

    return build_track


@pytest.fixture(scope="session")
def still_ball():
    """still_ball(take, place) -> BallPath: a ball that lies at `place` (3,) m in every frame of the take."""

    def build_ball_path(take, place) -> BallPath:
        times = take.start_time + np.arange(len(take.motion)) / take.motion.fps
        return BallPath(times, np.broadcast_to(np.asarray(place, float), (len(times), 3)), np.ones(len(times), bool))

    return build_ball_path
