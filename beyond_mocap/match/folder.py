"""The folder of a match: what is in it, which run works in it, and what is done already.

    with open_folder(request.out, identity) as folder:
        folder.write_state({"state": "running", ...})   # match.json, complete
        folder.piece_path("search", name)               # the file of a piece of work

No file in it is ever half-written. One run works in it at a time: the lock is the operating system's, so it ends with
its process, however that ends.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ..base.errors import InputError
from ..files.content import content
from ..files.tables import plain
from ..files.whole import atomic_write
from .order import digest_of

STATE = "match.json"
WORDS = "annotations"
VERSION = 1
_WORK, _LOCK, _ORDER = ".work", "lock", "order"  # the last file has the request's digest, in case match.json is lost
_LONGEST = 100  # characters of a file name
_PART = re.compile(r"\..+\.\d+\.\d+\.part")  # temporary files of `files.whole`
_HEAD, _DIGEST = 1000, re.compile(rb'"digest": *"([0-9a-f]+)"')  # first bytes of match.json, which contain its digest
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\.|$)", re.IGNORECASE)  # names reserved by Windows


@dataclass(eq=False)
class MatchFolder:
    """A folder while a run works in it.

    Attributes:
        path: the folder.
        digest: of the request that is worked on.
        previous_state: content of match.json when the folder was opened, {} if there was none or a damaged one.
        notes: messages for people.
    """

    path: Path
    digest: str
    before: dict = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def of(self, player_file: str, ending: str) -> Path:
        """The path of a player's file with this ending, such as "take.npz"."""
        return self.path / f"{player_file}.{ending}"

    def words_of(self, player_file: str) -> Path:
        """The path of the text with a player's labels."""
        return self.path / WORDS / f"{player_file}.txt"

    def tell(self, state: Mapping) -> None:
        """Write match.json."""
        whole = {"version": VERSION, "digest": self.digest, **state}
        atomic_write(self.path / STATE, json.dumps(plain(whole), indent=1, ensure_ascii=False, allow_nan=False) + "\n")

    def place(self, kind: str, name: str) -> Path:
        """The path of a piece of work, whether it exists or not.

        Args:
            kind: of piece.
            name: its digest.
        Returns:
            The path, in an existing folder.
        """
        folder = self.path / _WORK / kind
        folder.mkdir(parents=True, exist_ok=True)
        return folder / f"{name}.npz"

    def forget(self, kind: str, but: Iterable[str]) -> None:
        """Remove all pieces of a kind except the names in `keep`."""
        wanted = {f"{name}.npz" for name in but}
        for path in (self.path / _WORK / kind).glob("*"):
            if path.name not in wanted:
                path.unlink(missing_ok=True)


@contextlib.contextmanager
def opened(path: Path, identity: Mapping[str, object]) -> Iterator[MatchFolder]:
    """Open the folder for a request whose results are determined by `identity`; create it if needed.

    A damaged match.json is set aside, with a note, if there are pieces of work beside it.

    Args:
        path: the folder.
        identity: what determines the results, by name (`request.build_identity`).
    Returns:
        A context manager that gives the folder.
    Raises:
        InputError: if it cannot be created or written, holds results of another request or other files, or another run
            works in it.
    """
    check_folder(path)
    new, kept = not path.exists(), (path / _WORK).exists()
    if (path / STATE).exists() and not any((path / _WORK).glob("*/*.npz")):  # nothing to resume from
        _own_state(path)
    try:
        (path / _WORK).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        found = f"cannot be written to ({error.strerror or error})"
        raise InputError(path, found, "a writable folder", "choose another folder") from None
    with _locked(path / _WORK / _LOCK, path):
        before, notes = _state_before(path, identity)
        _check_order(path, before, identity)
        _sweep(path)
        atomic_write(path / _WORK / _ORDER, digest_of(identity))
        try:
            yield MatchFolder(path, digest_of(identity), before, notes)
        finally:
            if not (path / STATE).exists() and not kept:  # no work has started
                shutil.rmtree(path / _WORK, ignore_errors=True)
                with contextlib.suppress(OSError):  # the user's own folder, or one with texts in it, stays
                    path.rmdir() if new else None


def _state_before(path: Path, identity: Mapping[str, object]) -> tuple[dict, tuple[str, ...]]:
    """Read match.json and notes for people; set a damaged one aside.

    InputError if it belongs to another version, or is damaged and still names another request.
    """
    if not (path / STATE).exists():
        return {}, ()
    try:
        return _own_state(path), ()
    except _Damaged as error:
        _check_order(path, _digest_kept(path), identity)
        os.replace(path / STATE, path / f"{STATE}.damaged")
        return {}, (f"{error.what}: renamed to {STATE}.damaged; finished work is found by its pieces",)


def _digest_kept(path: Path) -> dict[str, str]:
    """Read the digest of the request from a damaged match.json, or from the folder of pieces."""
    if told := _DIGEST.search((path / STATE).read_bytes()[:_HEAD]):
        return {"digest": told[1].decode()}
    kept = path / _WORK / _ORDER
    return {"digest": kept.read_text("ascii", "replace")} if kept.is_file() else {}


def _own_state(path: Path) -> dict:
    """Read match.json with the digest of its request; InputError as for `read_state`."""
    state = read_state(path)
    if not isinstance(state.get("digest"), str):
        raise _Damaged(path / STATE, "no digest")
    return state


class _Damaged(InputError):
    """A match.json that is not in the expected form. what: where and what, without the next step."""

    def __init__(self, path: Path, found: str):
        super().__init__(path, found, "the state of a match", "choose another folder for the match")
        self.what = f"{path}: {found}"


def _sweep(path: Path) -> None:
    """Remove temporary files of a killed run; only this run writes here."""
    for part in path.rglob(".*.part"):
        if _PART.fullmatch(part.name):
            with contextlib.suppress(OSError):
                part.unlink()


def read_state(folder: str | os.PathLike) -> dict:
    """Read a folder's match.json.

    Args:
        folder: the match's folder.
    Returns:
        Its content.
    Raises:
        InputError: if there is none, or it cannot be read.
    """
    path = Path(folder) / STATE
    try:
        state = json.loads(content(path, "the state of a match"))
    except (ValueError, RecursionError) as error:
        raise _Damaged(path, f"not valid JSON ({' '.join(str(error).split())[:80]})") from None
    players = state.get("players") if isinstance(state, dict) else None
    ids = [one.get("id") if isinstance(one, dict) else None for one in players] if isinstance(players, list) else [None]
    if not all(isinstance(one, str) and one for one in ids):
        raise _Damaged(path, "no list of players")
    if "version" not in state:
        raise _Damaged(path, "no version")
    if state["version"] != VERSION:
        raise InputError(path, f"version {state['version']}", f"{VERSION}", "run the match again with this version")
    return state


def file_names(ids: Iterable[str]) -> dict[str, str]:
    """Build the file name of each player from their id.

    Characters other than letters, digits, dot, minus and underscore are replaced; no two names are equal, ignoring
    case.

    Args:
        ids: of the players.
    Returns:
        Name by id.
    """
    out: dict[str, str] = {}
    taken: set[str] = set()
    for player in ids:
        bare = re.sub(r"[^\w.-]", "_", player, flags=re.ASCII).strip(".")[:_LONGEST] or "player"
        bare = f"_{bare}" if _RESERVED.match(bare) else bare
        name, number = bare, 2
        while name.lower() in taken:
            name, number = f"{bare}-{number}", number + 1
        taken.add(name.lower())
        out[player] = name
    return out


def check_folder(path: Path) -> None:
    """Check before work starts that the folder is a match's, empty, or can be created; InputError otherwise."""
    if path.exists() and not path.is_dir():
        raise InputError(path, "is a file", "a folder", "choose another name")
    if not path.exists() and not path.absolute().parent.is_dir():
        raise InputError(path, "the folder above it does not exist", "an existing folder", "create that folder first")
    place = path if path.is_dir() else path.absolute().parent
    if not os.access(place, os.W_OK | os.X_OK):
        raise InputError(path, "cannot be written to", "a writable folder", "choose another folder")
    if path.is_dir() and not (path / STATE).exists() and not (path / _WORK).exists():
        other = next((one.name for one in sorted(path.iterdir()) if one.name != WORDS), None)
        if other is not None:
            raise InputError(path, f"holds other files ({other})", "an empty or a new folder", "choose another folder")


def _check_order(path: Path, before: dict, identity: Mapping[str, object]) -> None:
    """Check that the folder's results belong to this request; InputError names the first difference."""
    if not before or before.get("digest") == digest_of(identity):
        return
    earlier = before.get("identity")
    known = plain(dict(identity)).items() if isinstance(earlier, dict) else ()
    other = next((name for name, value in known if earlier.get(name) != value), None)
    what = f" (its {_NAMES.get(other, other)} differs)" if other else ""
    raise InputError(path, f"holds the results of another request{what}", "a folder for this request only",
                     "choose another folder, or delete this one")


_NAMES = {
    "start": "start time", "end": "end time", "tracking": "tracking file", "meta": "metadata", "events": "events file",
    "events_meta": "events metadata", "events_provider": "events provider",
    "solve_touches": "touch solving", "players": "list of players", "fps": "frame rate", "seed": "seed",
    "nearest": "nearest labels setting", "provider": "provider", "form": "version", "software": "version",
}


@contextlib.contextmanager
def _locked(lock: Path, folder: Path) -> Iterator[None]:
    """Hold the lock; InputError if another process has it."""
    with open(lock, "a+b") as file:
        try:
            _take(file)
        except OSError:
            file.seek(0)
            who = file.read(20).decode("ascii", "replace").strip()
            found = f"another run (process {who}) uses it" if who else "another run uses it"
            raise InputError(folder, found, "one run at a time", "wait for it, or choose another folder") from None
        file.truncate(0)
        file.write(str(os.getpid()).encode())
        file.flush()
        yield


def _take(file) -> None:
    """Acquire the operating system's lock on an open file, or raise OSError."""
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        file.seek(1 << 20)  # a byte beyond the content: locked bytes cannot be read by others
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]  # Windows only
        return
    fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
