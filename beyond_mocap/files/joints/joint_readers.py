"""Read skeletal tracking: Common Data Format, Hawk-Eye, a plain CSV, arrays of FIFA's fifteen points, and of SMPL.

The content shows whose form a file has; joints are known by `landmarks.identify_landmark`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from ...base.errors import InputError, build_read_error, describe_damage, format_count, format_seconds
from ..plain_npz import list_arrays, read_named_arrays
from ..smpl.smpl import is_smpl_file
from ..tables import parse_number, read_rows
from ..tracking.feed import read_head
from ..tracking.formats.cdf import parse_time, read_json
from ..tracking.formats.samples import iter_json_lines
from .joint_feed import JointCollector, JointFeed
from .landmarks import identify_landmark
from .smpl_people import is_people_file, read_smpl_people

FIFA_15 = ("nose", "right_shoulder", "left_shoulder", "right_elbow", "left_elbow", "right_wrist", "left_wrist",
           "right_hip", "left_hip", "right_knee", "left_knee", "right_ankle", "left_ankle", "right_big_toe",
           "left_big_toe")
"""The points of the FIFA Skeletal Tracking Challenge in their order (numbers 0, 2, 5, 3, 6, 4, 7, 9, 12, 10, 13, 11,
14, 22, 19 of OpenPose's BODY_25)."""
_FIFA_RATE = 50.0  # frames per second of the challenge
_FORMS = "Common Data Format skeletal.jsonl, Hawk-Eye .samples.joints, CSV with time_s,player,joint,x,y,z, or .npz"
_JOINTS = ".joints"  # how Hawk-Eye's files end
_FLOATS = tuple(np.dtype(kind) for kind in ("<f4", "<f8", "<f2"))
_MAX_BYTES = 4 << 30
_CSV_NAMES = {"time": "time_s", "x_m": "x", "y_m": "y", "z_m": "z", "landmark": "joint", "id": "player"}


@dataclass(frozen=True)
class _Reader:
    """How a form of file is read.

    Attributes:
        read: file -> feed.
        read_with_ball: the same with the ball; None: the form has none.
    """

    read: Callable[[Path], JointFeed]
    read_with_ball: Callable[[Path], JointFeed] | None = None


def read_joints(path, with_ball: bool = False) -> JointFeed:
    """Read a file of skeletal tracking.

    Args:
        path: the file; of Hawk-Eye, one of a half: all of that half beside it are read.
        with_ball: read the ball too, which Hawk-Eye has in files beside its joints.
    Returns:
        The feed in metres, Z up.
    Raises:
        InputError: if it is none, or damaged.
    """
    path = Path(path)
    if not path.is_file():
        raise build_read_error(path, "a file of skeletal tracking")
    reader = _find_reader(path)
    with _name_damaged_file(path):
        return ((with_ball and reader.read_with_ball) or reader.read)(path)


@contextmanager
def _name_damaged_file(path: Path) -> Iterator[None]:
    """Context manager: errors of values that are not where they are expected become one line that names the file."""
    try:
        yield
    except (LookupError, TypeError, AttributeError, ValueError, ArithmeticError) as error:
        raise InputError(path, describe_damage(error), _FORMS, "export it again") from None


def is_joint_file(path) -> bool:
    """Say whether a file looks like skeletal tracking."""
    path = Path(path)
    if path.suffix.lower() == ".npz":
        return path.is_file()  # no other tracking comes as arrays
    return _find_text_reader(path) is not None


def _find_reader(path: Path) -> _Reader:
    """Find how a file is read, by its content."""
    if path.suffix.lower() == ".npz":
        if is_people_file(path):
            return _Reader(read_smpl_people)
        if is_smpl_file(path) and list_arrays(path) & {"trans", "transl"}:
            raise InputError(path, "one person's motion of SMPL", "the joints of people",
                             "put it into a library of clips, or retarget it")
        return _Reader(_read_fifa)
    found = _find_text_reader(path)
    if found is None:
        what = "unknown form" if read_head(path).strip() else "the file is empty"
        raise InputError(path, what, _FORMS, "choose such a file; positions of players without joints are for match")
    return found


def _find_text_reader(path: Path) -> _Reader | None:
    """Find how a file that is no .npz is read; None if it is no skeletal tracking."""
    head = read_head(path)
    if re.match(rb'(?s)\s*\{.{0,4000}"landmarks"', head):
        return _Reader(_read_cdf)
    if re.match(rb"(?s)\s*\{", head) and path.name.lower().endswith(_JOINTS):
        return _Reader(partial(_read_hawkeye, with_ball=False), partial(_read_hawkeye, with_ball=True))
    columns = re.findall(rb"[a-z_]+", head.partition(b"\n")[0].lower())
    return _Reader(_read_table) if b"joint" in columns or b"landmark" in columns else None


def _read_cdf(path: Path) -> JointFeed:
    """Read the Common Data Format's skeletal data; points that are not visible count as not seen."""
    found, begin = JointCollector(path), None
    for line, frame in iter_json_lines(path):
        if "timestamp" not in frame:
            raise InputError(f"{path}:{line}", "no 'timestamp'", "Common Data Format 0.2.3 (0.2.0 has no times)",
                             "export it in 0.2.3, or add the times")
        stamp = parse_time(frame["timestamp"], f"{path}:{line}")
        begin = begin or stamp
        seconds = round((stamp - begin).total_seconds(), 4)
        for ground, team in frame["teams"].items():
            for player in team.get("players") or ():
                found.set_team(str(player["id"]), ground if ground in ("home", "away") else "")
                for point in player.get("landmarks") or ():
                    if point.get("is_visible", True):
                        _add(found, str(player["id"]), seconds, str(point["name"]),
                             (point.get("x"), point.get("y"), point.get("z")))
    return found.build()


def _read_hawkeye(path: Path, with_ball: bool) -> JointFeed:
    """Read Hawk-Eye's joints, and the ball: files for each minute, their times from its start."""
    found, files = JointCollector(path), _list_minutes(path)
    balls = [ball for file in files for ball in _find_balls(file)] if with_ball else []
    begin = None
    for file in (*files, *balls):
        content = read_json(file)
        with _name_damaged_file(file):
            start = parse_time(content["time"]["startUTC"], str(file))
            begin = begin or start
            add = _add_balls if file in balls else _add_people
            add(found, content, (start - begin).total_seconds())
    if len(files) > 1:
        found.notes.append(f"{format_count(len(files), 'file')} of one half are read, {files[0].name} first")
    return _describe_ball(found.build(), balls) if balls else found.build()


def _describe_ball(feed: JointFeed, files: list[Path]) -> JointFeed:
    """Note the files of a feed's ball; one at other times than the people's is left out."""
    times, where = feed.ball[:, 0], f"{format_count(len(files), 'file')}, {files[0].name} first"
    begin, end = min(person.times[0] for person in feed.people), max(person.times[-1] for person in feed.people)
    if not len(times) or ((times >= begin) & (times <= end)).any():
        return replace(feed, notes=(*feed.notes, f"the ball is read from {where}"))
    line = (f"the ball is left out: its times in {where}, {format_seconds(times[0])} to {format_seconds(times[-1])} s, "
            f"do not overlap the joints', {format_seconds(begin)} to {format_seconds(end)} s")
    return replace(feed, ball=feed.ball[:0], notes=(*feed.notes, line))


def _add_people(found: JointCollector, content: dict, offset: float) -> None:
    """Add the people of a minute of Hawk-Eye that begins at `offset` s."""
    homes = {str(team["id"]): team.get("home") for team in (content.get("details") or {}).get("teams") or ()}
    for person in content["samples"]["people"]:
        ids = person["personId"]
        key = str(ids.get("fifaId") or ids.get("uefaId") or ids.get("heId"))
        home = homes.get(str(person.get("teamId")))
        found.set_team(key, "" if home is None else "home" if home else "away")
        for sample in person["joints"]:
            seconds = round(offset + float(sample["time"]), 4)
            for name, place in sample.items():
                if isinstance(place, list):
                    _add(found, key, seconds, name, place)


def _add_balls(found: JointCollector, content: dict, offset: float) -> None:
    """Add where the ball is seen in a minute of Hawk-Eye that begins at `offset` s."""
    for sample in content["samples"]["ball"]:
        if isinstance(place := sample.get("pos"), list):
            found.add_ball(round(offset + float(sample["time"]), 4), place)


def list_joint_files(path: Path, with_ball: bool) -> list[Path]:
    """List the files that `read_joints` reads: of Hawk-Eye all of the same half from `path` on, with balls or not."""
    files = _list_minutes(path)
    return [*files, *(ball for file in files if with_ball for ball in _find_balls(file))]


def _find_balls(file: Path) -> list[Path]:
    """Find the ball's file of the same minute of Hawk-Eye."""
    ball = file.with_name(file.name.removesuffix(_JOINTS) + ".ball")
    return [ball] if file.name.endswith(_JOINTS) and ball.is_file() else []


def _list_minutes(path: Path) -> list[Path]:
    """List the files of joints of the same half from `path` on, ..._HALF_MINUTE[_ADDED].football.samples.joints."""
    parts = re.fullmatch(r"(.*?_?\d+_)(\d+)(?:_(\d+))?(\.football\.samples\.joints)", path.name)
    if parts is None:
        return [path]
    form = re.compile(re.escape(parts[1]) + r"(\d+)(?:_(\d+))?" + re.escape(parts[4]))
    numbered = {}
    for one in path.parent.glob(f"*{parts[4]}"):
        if one.is_file() and (match := form.fullmatch(one.name)):
            numbered[int(match[1]), int(match[2] or 0)] = one
    first = int(parts[2]), int(parts[3] or 0)
    return [numbered[key] for key in sorted(numbered) if key >= first]


def _read_table(path: Path) -> JointFeed:
    """Read a CSV with a row for each point: time_s, player, joint, x, y, z, and team where there is one."""
    found = JointCollector(path)
    columns = ("time_s", "player", "joint", "x", "y", "z")
    for place, row in read_rows(path, columns, others=_CSV_NAMES, separators=",;\t"):
        seconds = parse_number(row["time_s"], "time_s", place)
        team = row.get("team", "").lower()
        found.set_team(row["player"], team if team in ("home", "away") else "")
        _add(found, row["player"], round(seconds, 4), row["joint"],
             [parse_number(row[axis], axis, place, blank=True) for axis in "xyz"])
    return found.build()


def _read_fifa(path: Path) -> JointFeed:
    """Read arrays (N, T, 15, 3) of FIFA's fifteen points: NaN where a person is absent."""
    arrays = read_named_arrays(path, _FORMS, _FLOATS, _MAX_BYTES, sorted(list_arrays(path)), is_finite=False)
    fitting = {name: array for name, array in arrays.items() if array.ndim == 4 and array.shape[2:] == (15, 3)}
    if len(fitting) != 1:
        raise InputError(path, f"{format_count(len(fitting), 'array')} of shape (N, T, 15, 3)", "one, or those "
                         "of SMPL: global_orient, body_pose, transl", "save the people's fifteen points as one array")
    (points,) = fitting.values()
    found = JointCollector(path)
    found.notes.append(f"{_FIFA_RATE:g} frames per second assumed, which the arrays do not say")
    for number, person in enumerate(points):
        for frame in np.flatnonzero(np.isfinite(person).any(axis=(1, 2))).tolist():
            for landmark, place in zip(FIFA_15, person[frame].tolist()):
                found.add_point(str(number), frame / _FIFA_RATE, landmark, place)
    return found.build(_FIFA_RATE)


def _add(found: JointCollector, person: str, seconds: float, name: str, place) -> None:
    """Add a point by its name in the feed."""
    landmark = identify_landmark(name)
    if landmark is None:
        found.unknown.add(name[:40])
    else:
        found.add_point(person, seconds, landmark, place)
