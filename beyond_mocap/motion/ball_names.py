"""Names by which recordings call a ball, or another prop that is played like one."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

_KINDS = "soccer|foot|basket|volley|hand|base|tennis|rugby|game|match"
_NAME = re.compile(rf"({_KINDS})?ball(cent(er|re)|root|\d+)?|prop(\d+)?")


def is_ball_name(name: str) -> bool:
    """Whether a joint, marker or object is named as a ball or prop; the balls of feet ("ball_l") are not.

    Args:
        name: with or without a prefix such as "actor:", numbers and blanks.
    """
    plain = re.sub(r"^.*[:|]", "", name)
    return bool(_NAME.fullmatch(re.sub(r"[^a-z0-9]", "", plain.lower())))


def choose_ball(names: Sequence[str], paths: Sequence[np.ndarray], root: np.ndarray) -> tuple[int, tuple[str, ...]]:
    """Choose the ball of a recording that has several: the one that comes nearest to the body.

    Args:
        names: of the N balls.
        paths: N arrays (T, 3) m, NaN where a ball is not known.
        root: (T, 3) m of the body.
    Returns:
        The ball's number, and a note for the user where there are several.
    """
    gaps = [np.linalg.norm(path - root, axis=1) for path in paths]
    nearest = [float(np.min(gap[np.isfinite(gap)], initial=np.inf)) for gap in gaps]
    chosen = int(np.argmin(nearest))
    several = f"{len(names)} balls ({', '.join(names)}): {names[chosen]} is used, which comes nearest to the body"
    return chosen, (several,) if len(names) > 1 else ()
