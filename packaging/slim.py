"""kloppy without its weight: 213 MB of test recordings, and the HTTP client that only its downloads need.

We read files that lie on disk. What stays is kloppy's code as released, its licence and its metadata; the metadata
no longer asks for `fsspec[http]` (the aiohttp family), the version says that something was taken out, and RECORD
lists what is really there.
"""

import base64
import csv
import hashlib
import io
import zipfile

LEFT_OUT = ("kloppy/tests/",)
STAMP = (2020, 1, 1, 0, 0, 0)  # the same wheel, bit for bit, whenever it is made


def slim(source, folder, package):
    """Write the slimmed wheel of `source` (a path) into `folder` and return its path."""
    old, new = (f"{package.name}-{version}" for version in (package.version, package.bundled_version))
    target = folder / source.name.replace(old, new)
    files = {name.replace(f"{old}.dist-info/", f"{new}.dist-info/"): text for name, text in _kept(source)}
    metadata = f"{new}.dist-info/METADATA"
    files[metadata] = _slim_metadata(files[metadata].decode("utf-8"), package).encode("utf-8")
    record = f"{new}.dist-info/RECORD"
    files[record] = _record(files, record)
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name, STAMP), data, zipfile.ZIP_DEFLATED)
    return target


def _kept(source):
    with zipfile.ZipFile(source) as archive:
        for name in archive.namelist():
            if not name.startswith(LEFT_OUT):
                yield name, archive.read(name)


def _slim_metadata(text, package):
    """The same metadata with the marked version and fsspec without its "http" extra."""
    head, gap, description = text.partition("\n\n")
    lines = [line.replace("fsspec[http]", "fsspec") for line in head.splitlines()]
    lines[lines.index(f"Version: {package.version}")] = f"Version: {package.bundled_version}"
    return "\n".join(lines) + gap + description


def _record(files, record):
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    for name, data in files.items():
        if name != record:
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode("ascii")
            rows.writerow([name, f"sha256={digest}", len(data)])
    rows.writerow([record, "", ""])
    return out.getvalue().encode("utf-8")
