"""The folder of a match: what is in it, who works in it, and what is done already.

    with opened(order.out, identity) as folder:
        folder.tell({"state": "running", ...})          # match.json, whole
        folder.place("search", name)                    # where a piece of work is kept

Nothing in it is ever half-written. One run works in it at a time: the lock is the operating system's, so that it ends
with its process however that ends.
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
_WORK, _LOCK, _ORDER = ".work", "lock", "order"  # the last has the order's digest, should match.json be lost
_LONGEST = 100  # characters of a file's name
_PART = re.compile(r"\..+\.\d+\.\d+\.part")  # what `files.whole.beside` writes before it has its name
_HEAD, _DIGEST = 1000, re.compile(rb'"digest": *"([0-9a-f]+)"')  # bytes in which match.json says whose it is
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\.|$)", re.IGNORECASE)  # names that Windows keeps for itself


@dataclass(eq=False)
class MatchFolder:
    """A folder while somebody works in it. path: the folder; before: what its match.json said when it was opened, {}
    where there was none, or a damaged one; digest: of the order that is worked on; notes: lines for people."""

    path: Path
    digest: str
    before: dict = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def of(self, player_file: str, ending: str) -> Path:
        """The file of one player's that ends so, such as "take.npz"."""
        return self.path / f"{player_file}.{ending}"

    def words_of(self, player_file: str) -> Path:
        """The text of a player's words."""
        return self.path / WORDS / f"{player_file}.txt"

    def tell(self, state: Mapping) -> None:
        """Writes match.json."""
        whole = {"version": VERSION, "digest": self.digest, **state}
        atomic_write(self.path / STATE, json.dumps(plain(whole), indent=1, ensure_ascii=False, allow_nan=False) + "\n")

    def place(self, kind: str, name: str) -> Path:
        """Where a piece of work of that kind and name is kept, whether it is there or not."""
        folder = self.path / _WORK / kind
        folder.mkdir(parents=True, exist_ok=True)
        return folder / f"{name}.npz"

    def forget(self, kind: str, but: Iterable[str]) -> None:
        """Takes away the pieces of a kind that nobody needs any more: all `but` these."""
        wanted = {f"{name}.npz" for name in but}
        for path in (self.path / _WORK / kind).glob("*"):
            if path.name not in wanted:
                path.unlink(missing_ok=True)


@contextlib.contextmanager
def opened(path: Path, identity: Mapping[str, object]) -> Iterator[MatchFolder]:
    """The folder for an order whose results are decided by `identity`, made where there is none.

    A match.json that is damaged is set aside, which `notes` tell, where there are pieces of work beside it. InputError
    where it cannot be made or written, holds results of another order or files that are none of a match, or somebody
    else works in it."""
    check_folder(path)
    new, kept = not path.exists(), (path / _WORK).exists()
    if (path / STATE).exists() and not any((path / _WORK).glob("*/*.npz")):  # nothing that a run can go on from
        _own_state(path)
    try:
        (path / _WORK).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        found = f"cannot be written ({error.strerror or error})"
        raise InputError(path, found, "a folder that can be written", "choose another place") from None
    with _locked(path / _WORK / _LOCK, path):
        before, notes = _state_before(path, identity)
        _check_order(path, before, identity)
        _sweep(path)
        atomic_write(path / _WORK / _ORDER, digest_of(identity))
        try:
            yield MatchFolder(path, digest_of(identity), before, notes)
        finally:
            if not (path / STATE).exists() and not kept:  # nothing was begun
                shutil.rmtree(path / _WORK, ignore_errors=True)
                with contextlib.suppress(OSError):  # the user's own folder, or one with texts in it
                    path.rmdir() if new else None


def _state_before(path: Path, identity: Mapping[str, object]) -> tuple[dict, tuple[str, ...]]:
    """What match.json says, and lines for people: a damaged one is set aside. InputError where it is another version's,
    or is damaged and still says that it is another order's."""
    if not (path / STATE).exists():
        return {}, ()
    try:
        return _own_state(path), ()
    except _Damaged as error:
        _check_order(path, _digest_kept(path), identity)
        os.replace(path / STATE, path / f"{STATE}.damaged")
        return {}, (f"{error.what}: kept as {STATE}.damaged, and what is done is found by its pieces",)


def _digest_kept(path: Path) -> dict[str, str]:
    """The digest of the order whose match.json is damaged, as far as that or the pieces' folder still says."""
    if told := _DIGEST.search((path / STATE).read_bytes()[:_HEAD]):
        return {"digest": told[1].decode()}
    kept = path / _WORK / _ORDER
    return {"digest": kept.read_text("ascii", "replace")} if kept.is_file() else {}


def _own_state(path: Path) -> dict:
    """What match.json says, with the digest of its order. InputError as `read_state`."""
    state = read_state(path)
    if not isinstance(state.get("digest"), str):
        raise _Damaged(path / STATE, "no digest")
    return state


class _Damaged(InputError):
    """A match.json that is not as we write it. what: where and what, without the next step."""

    def __init__(self, path: Path, found: str):
        super().__init__(path, found, "the state of a match", "make the match in another folder")
        self.what = f"{path}: {found}"


def _sweep(path: Path) -> None:
    """Takes away what a killed run was about to rename: nobody else writes here."""
    for part in path.rglob(".*.part"):
        if _PART.fullmatch(part.name):
            with contextlib.suppress(OSError):
                part.unlink()


def read_state(folder: str | os.PathLike) -> dict:
    """What a folder's match.json says. InputError where there is none, or none that can be read."""
    path = Path(folder) / STATE
    try:
        state = json.loads(content(path, "the state of a match"))
    except (ValueError, RecursionError) as error:
        raise _Damaged(path, f"no JSON ({' '.join(str(error).split())[:80]})") from None
    players = state.get("players") if isinstance(state, dict) else None
    ids = [one.get("id") if isinstance(one, dict) else None for one in players] if isinstance(players, list) else [None]
    if not all(isinstance(one, str) and one for one in ids):
        raise _Damaged(path, "no list of players")
    if "version" not in state:
        raise _Damaged(path, "no version")
    if state["version"] != VERSION:
        raise InputError(path, f"version {state['version']}", f"{VERSION}", "make the match anew with this version")
    return state


def file_names(ids: Iterable[str]) -> dict[str, str]:
    """What the files of each player are called: his id with other characters than letters, digits, dot, minus and
    underscore replaced, no two alike, whatever the case of their letters."""
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
    """Before work begins: the folder is a match's, empty, or can be made. InputError where it is not."""
    if path.exists() and not path.is_dir():
        raise InputError(path, "is a file", "a folder", "choose another name")
    if not path.exists() and not path.absolute().parent.is_dir():
        raise InputError(path, "the folder above it does not exist", "an existing folder", "make that folder first")
    place = path if path.is_dir() else path.absolute().parent
    if not os.access(place, os.W_OK | os.X_OK):
        raise InputError(path, "cannot be written to", "a folder of yours", "choose another folder")
    if path.is_dir() and not (path / STATE).exists() and not (path / _WORK).exists():
        other = next((one.name for one in sorted(path.iterdir()) if one.name != WORDS), None)
        if other is not None:
            raise InputError(path, f"holds other files ({other})", "an empty or a new folder", "choose another folder")


def _check_order(path: Path, before: dict, identity: Mapping[str, object]) -> None:
    """InputError where the folder's results are another order's, with the first thing in which the orders differ."""
    if not before or before.get("digest") == digest_of(identity):
        return
    earlier = before.get("identity")
    known = plain(dict(identity)).items() if isinstance(earlier, dict) else ()
    other = next((name for name, value in known if earlier.get(name) != value), None)
    what = f" (its {_NAMES.get(other, other)} differs)" if other else ""
    raise InputError(path, f"holds the results of another order{what}", "a folder of this order's own",
                     "choose another folder, or delete this one")


_NAMES = {
    "start": "--from", "end": "--to", "tracking": "tracking file", "meta": "metadata", "events": "events file",
    "events_meta": "--events-meta", "events_provider": "--events-provider",
    "solve_touches": "--no-solve-touches", "players": "list of players", "fps": "--fps", "seed": "--seed",
    "nearest": "--exact", "provider": "--provider", "form": "version", "software": "version",
}


@contextlib.contextmanager
def _locked(lock: Path, folder: Path) -> Iterator[None]:
    """The lock held; InputError where another process has it."""
    with open(lock, "a+b") as file:
        try:
            _take(file)
        except OSError:
            file.seek(0)
            who = file.read(20).decode("ascii", "replace").strip()
            found = f"another run (process {who}) works in it" if who else "another run works in it"
            raise InputError(folder, found, "one run at a time", "wait for it, or choose another folder") from None
        file.truncate(0)
        file.write(str(os.getpid()).encode())
        file.flush()
        yield


def _take(file) -> None:
    """Takes the operating system's lock on an open file, or raises OSError."""
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        file.seek(1 << 20)  # a byte that nobody reads: what is locked there cannot be read by others
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]  # Windows alone has it
        return
    fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
