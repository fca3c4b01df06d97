"""Damages of valid files, each decided by one random number generator: text, JSON, arrays and bytes."""

import io
import json
import re
import zipfile
from random import Random

import numpy as np

NUMBERS = (
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-320",
    "0",
    "-0",
    "-1",
    "1e9",
    "-1e9",
    "1e6",
    "0x10",
    "1_0",
    "1,5",
    "99999999999999999999",
    "",
    "x",
    "½",
    "1e",
    "--1",
    "2147483648",
    "0.0000001",
)
WORDS = (
    "",
    " ",
    "\0",
    "\ufeff",
    "é",
    "\u202e",
    "con",
    "../../x",
    "/",
    "-",
    "#",
    '"',
    "'",
    ";",
    ",",
    "\t",
    "{",
    "}",
    "[",
    "]",
    "kick",
    "-kick",
    "transition",
    "unit frames",
    "null",
    "true",
    "<!DOCTYPE x>",
    "A" * 5000,
    "\r",
    "\n",
)
VALUES = (None, True, False, 0, -1, 1e308, 10**400, 0.5, "", "x", "nan", [], {}, [[]], [None], {"": None}, [0] * 1000)
_NUMBER = re.compile(r"-?\d+\.?\d*(?:[eE][-+]?\d+)?")


def mutate(data: bytes, name: str, rng: Random) -> bytes:
    """Damage a file's bytes, mostly once or twice.

    Args:
        data: the valid bytes.
        name: the file's name, which tells its kind.
        rng: decides everything.
    Returns:
        The damaged bytes.
    """
    kinds = _KINDS.get(name.rpartition(".")[2].lower(), (_mutate_text, _mutate_bytes))
    for _ in range(rng.choice((1, 1, 1, 2, 2, 4, 8))):
        try:
            data = rng.choice((*kinds, *kinds, *kinds, _mutate_bytes))(data, rng)
        except Exception:  # what an earlier step damaged can no longer be unpacked
            data = _mutate_bytes(data, rng)
    return data


def _mutate_bytes(data: bytes, rng: Random) -> bytes:
    """Cut, flip, repeat, remove or insert bytes, or encode the text in another way."""
    at, size = rng.randrange(len(data) + 1), rng.choice((1, 1, 4, 40, 400))
    block = data[at : at + size]
    return rng.choice(
        (
            lambda: data[:at],
            lambda: data[:at] + bytes(byte ^ (1 << rng.randrange(8)) for byte in block) + data[at + size :],
            lambda: data[:at] + rng.randbytes(size) + data[at + size :],
            lambda: data[:at] + data[at + size :],
            lambda: data[:at] + block * rng.choice((2, 3, 50)) + data[at + size :],
            lambda: b"\xef\xbb\xbf" + data,
            lambda: data.decode("latin-1").encode("utf-16"),
            lambda: data.replace(b"\n", b"\r\n"),
            lambda: b"",
            lambda: data.replace(b"\n", b"\r"),
            lambda: data + b"\0" * size,
            lambda: data.replace(b",", b";"),
        )
    )()


def _mutate_text(data: bytes, rng: Random) -> bytes:
    """Change numbers, words, cells and lines."""
    text = data.decode("utf-8", "replace")
    return rng.choice((_change_number, _change_number, _change_number, _change_word, _change_lines, _swap_words))(
        text, rng
    ).encode("utf-8", "surrogatepass")


def _change_number(text: str, rng: Random) -> str:
    found = list(_NUMBER.finditer(text))
    if not found:
        return text
    place = rng.choice(found if rng.random() < 0.6 else found[:60])
    return text[: place.start()] + rng.choice(NUMBERS) + text[place.end() :]


def _change_word(text: str, rng: Random) -> str:
    found = list(re.finditer(r"\w+", text[: rng.choice((2000, len(text)))]))
    if not found:
        return rng.choice(WORDS) + text
    place = rng.choice(found)
    return text[: place.start()] + rng.choice(WORDS) + text[place.end() :]


def _swap_words(text: str, rng: Random) -> str:
    found = sorted(set(re.findall(r"[A-Za-z]\w+", text[:20000])))
    if len(found) < 2:
        return text
    one, other = rng.sample(found, 2)
    return re.sub(rf"\b({one}|{other})\b", lambda word: other if word[0] == one else one, text)


def _change_lines(text: str, rng: Random) -> str:
    lines = text.split("\n")
    at, to = rng.randrange(len(lines)), rng.randrange(len(lines))
    low, high = min(at, to), max(at, to)
    choice = rng.randrange(5)
    if choice == 0:
        lines[at], lines[to] = lines[to], lines[at]
    elif choice == 1:
        lines.insert(to, lines[at])
    elif choice == 2:
        del lines[at]
    elif choice == 3:
        del lines[low:high]
    else:
        lines[low:high] = lines[low:high][::-1]
    return "\n".join(lines)


def _mutate_json(data: bytes, rng: Random) -> bytes:
    """Change one value of a JSON text, or of one line of it."""
    text = data.decode("utf-8", "replace")
    try:
        whole = json.loads(text)
    except ValueError:
        lines = text.split("\n")
        at = rng.randrange(len(lines))
        try:
            lines[at] = json.dumps(_change_value(json.loads(lines[at]), rng))
        except ValueError:
            return _mutate_text(data, rng)
        return "\n".join(lines).encode()
    return json.dumps(_change_value(whole, rng)).encode()


def _change_value(value, rng: Random):
    """Replace, remove, repeat or wrap a value somewhere in JSON data."""
    if isinstance(value, (dict, list)) and value and rng.random() < 0.85:
        key = rng.choice(list(value)) if isinstance(value, dict) else rng.randrange(len(value))
        out = dict(value) if isinstance(value, dict) else list(value)
        choice = rng.random()
        if choice < 0.1:
            del out[key]
        elif choice < 0.15 and isinstance(out, list):
            out.append(out[key])
        else:
            out[key] = _change_value(value[key], rng)
        return out
    if rng.random() < 0.05:
        for _ in range(300):
            value = [value]
        return value
    return rng.choice(VALUES)


def _mutate_arrays(data: bytes, rng: Random) -> bytes:
    """Change the arrays or the text of an .npz and pack them with valid checksums again."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files if isinstance(stored[name], np.ndarray)}
    except Exception:  # damaged by an earlier step
        return _mutate_bytes(data, rng)
    if not arrays:
        return data
    name = rng.choice(sorted(arrays))
    if name == "header" and rng.random() < 0.8:
        arrays[name] = np.frombuffer(_mutate_json(arrays[name].tobytes(), rng), np.uint8)
    else:
        _change_array(arrays, name, rng)
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


def _change_array(arrays: dict, name: str, rng: Random) -> None:
    values = arrays[name].copy()
    choice = rng.randrange(6)
    if choice == 0:
        del arrays[name]
        return
    if choice == 1:
        values = values[: len(values) // 2] if values.ndim else values
    elif choice == 2:
        values = values.astype(rng.choice(("<f4", "<i2", "?", "<U3", "<c16")))
    elif choice == 3:
        values = values.reshape(-1)
    elif values.size and values.dtype.kind in "fi":
        at = rng.randrange(values.size)
        extremes = (
            (np.nan, np.inf, 1e300, -1.0, 0.0) if values.dtype.kind == "f" else (-1, 0, 127, np.iinfo(values.dtype).max)
        )
        values.flat[at] = values.dtype.type(rng.choice(extremes))
    arrays[name] = values


def _mutate_zip_names(data: bytes, rng: Random) -> bytes:
    """Add a member to a zip."""
    out = io.BytesIO(data)
    try:
        with zipfile.ZipFile(out, "a") as archive:
            archive.writestr(rng.choice(("header.npy", "x.npy", "../x")), rng.randbytes(40))
    except zipfile.BadZipFile:
        return data
    return out.getvalue()


_KINDS = {
    "npz": (_mutate_arrays, _mutate_arrays, _mutate_zip_names),
    "c3d": (_mutate_bytes,),
    "json": (_mutate_json, _mutate_json, _mutate_text),
    "jsonl": (_mutate_json, _mutate_text),
    "centroids": (_mutate_json, _mutate_text),
    "ball": (_mutate_json, _mutate_text),
}
