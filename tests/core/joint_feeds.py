"""Recordings of the sample library as joints that cameras would see, in the forms of feeds; for tests of both readers
and bodies."""

import functools
import json
import pathlib

import numpy as np

from beyond_mocap.files.bvh.bvh import read_bvh
from beyond_mocap.files.joints.joint_readers import FIFA_15
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics

SAMPLE = pathlib.Path(__file__).resolve().parents[2] / "sample_blend" / "library"
ROLES = {"shoulder": "upper_arm", "elbow": "lower_arm", "wrist": "hand", "hip": "upper_leg", "knee": "lower_leg",
         "ankle": "foot", "big_toe": "toe"}
NAMES = ("nose", *(f"{side}_{part}" for side in ("left", "right") for part in ROLES))


@functools.cache
def sample_joints(clip="kick_low_inside", fps=50.0):
    """Joints (T, 15, 3) m of a recording at a rate, in the order of NAMES; the nose is ahead of the head joint."""
    motion = read_bvh(SAMPLE / f"{clip}.bvh").motion
    places, world = forward_kinematics(motion)
    body = identify_joints(motion.skeleton)
    across = places[:, body.left.upper_arm] - places[:, body.right.upper_arm]
    ahead = np.cross(across, (0.0, 0.0, 1.0))
    joints = [places[:, body.head] + 0.1 * ahead / np.linalg.norm(ahead, axis=1)[:, None]]
    joints += [places[:, getattr(getattr(body, side), role)] for side in ("left", "right") for role in ROLES.values()]
    at = np.arange(0.0, motion.duration, 1.0 / fps) * motion.fps
    frames = np.arange(len(motion))
    sampled = [[np.interp(at, frames, joint[:, axis]) for axis in range(3)] for joint in joints]
    return np.transpose(sampled, (2, 0, 1))


def write_table(path, people, fps, names=NAMES, unit=1.0):
    """people: id -> (T, L, 3)."""
    rows = ["time_s,player,team,joint,x,y,z\n"]
    for person, joints in people.items():
        for frame, row in enumerate(joints / unit):
            rows += [f"{frame / fps:.4f},{person},home,{name},{x:.6f},{y:.6f},{z:.6f}\n"
                     for name, (x, y, z) in zip(names, row) if np.isfinite(x)]
    path.write_text("".join(rows))
    return path


def write_cdf(path, people, fps):
    count = max(map(len, people.values()))
    rows = []
    for frame in range(count):
        players = [{"id": person, "landmarks": [
            {"index": str(number), "name": "_".join(reversed(name.split("_", 1))) if "_" in name else name,
             "x": x, "y": y, "z": z, "children": [], "is_visible": True}
            for number, (name, (x, y, z)) in enumerate(zip(NAMES, joints[frame].tolist()))]}
            for person, joints in people.items() if frame < len(joints)]  # fmt: skip
        rows.append({"frame_id": frame, "timestamp": f"2024-12-21T06:00:{frame / fps:09.6f}Z", "period": "first_half",
                     "match": {"id": "1"}, "teams": {"home": {"id": "h", "players": players}, "away": {
                         "id": "a", "players": []}}})
    path.write_text("".join(f"{json.dumps(row)}\n" for row in rows))
    return path


def write_hawkeye(folder, people, fps):
    """Two files of a half, one second apart."""
    def spell(name):
        side, _, part = name.partition("_")
        return name if not part else side[0] + "".join(word.capitalize() for word in part.split("_"))

    for minute, begin in ((1, 0), (2, int(fps))):
        samples = [{"personId": {"fifaId": person}, "teamId": {"heId": "t"}, "role": {"name": "Outfielder"}, "joints": [
            {"time": frame / fps, **{spell(name): place for name, place in zip(NAMES, row.tolist())}}
            for frame, row in enumerate(joints[begin : begin + int(fps) if minute == 1 else None])]}
            for person, joints in people.items()]  # fmt: skip
        content = {"details": {"teams": [{"id": {"heId": "t"}, "home": True}]},
                   "time": {"startUTC": f"2024-09-22T21:00:{10 + minute:02d}.000Z"}, "samples": {"people": samples}}
        (folder / f"match_1_{minute}.football.samples.joints").write_text(json.dumps(content))
    return folder / "match_1_1.football.samples.joints"


def write_fifa(path, people):
    count = max(map(len, people.values()))
    points = np.full((len(people), count, 15, 3), np.nan)
    for number, joints in enumerate(people.values()):
        points[number, : len(joints)] = joints[:, [NAMES.index(name) for name in FIFA_15]]
    np.savez(path, poses=points)
    return path
