"""Write the software bill of materials of a staged zip, in CycloneDX 1.6: its wheels, their hashes and licences.

    .venv-pack/bin/python packaging/sbom.py build/extension/stage/linux-x64-cp311

The same wheels give the same bytes.
"""

import datetime
import pathlib
import sys
import tomllib
import uuid

from cyclonedx.contrib.license.factories import LicenseFactory
from cyclonedx.model import HashAlgorithm, HashType
from cyclonedx.model.bom import Bom, BomMetaData
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output.json import JsonV1Dot6
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packageurl import PackageURL

import bundle
from wheels import compute_hash

FILE = "sbom.cdx.json"
STAMP = datetime.datetime(2020, 1, 1, tzinfo=datetime.timezone.utc)  # fixed, so that the file is reproducible


def main(stage):
    """Write the bill of a staging folder into it; return 0 if it follows the schema."""
    text = build_sbom(sorted((stage / "wheels").iterdir()), read_version(stage))
    if error := JsonStrictValidator(SchemaVersion.V1_6).validate_str(text):
        print(f"{FILE}: {error}", file=sys.stderr)
        return 1
    (stage / FILE).write_text(text, "utf-8")
    return 0


def read_version(stage):
    """Read the extension's version from the staged manifest."""
    return tomllib.loads((stage / "blender_manifest.toml").read_text("utf-8"))["version"]


def build_sbom(wheels, version):
    """Build the bill.

    Args:
        wheels: paths of the wheels.
        version: the extension's.
    Returns:
        JSON.
    """
    packages = {bundle.normalize_name(package.name): package for package in bundle.list_packages()}
    parts = [_build_component(path, packages[bundle.parse_wheel_name(path.name).name]) for path in wheels]
    own = Component(name="beyond_mocap", version=version, type=ComponentType.APPLICATION, bom_ref="beyond_mocap",
                    licenses=[LicenseFactory().make_from_string("GPL-3.0-or-later")])
    serial = uuid.uuid5(uuid.NAMESPACE_URL, " ".join([version, *(path.name for path in wheels)]))
    bom = Bom(components=parts, serial_number=serial, metadata=BomMetaData(component=own, timestamp=STAMP))
    bom.register_dependency(own, parts)
    return JsonV1Dot6(bom).output_as_string(indent=1) + "\n"


def _build_component(path, package):
    """Build the entry of one wheel."""
    return Component(
        name=package.name, version=package.version, bom_ref=path.name, copyright=package.copyright,
        licenses=[LicenseFactory().make_from_string(package.license)],
        hashes=[HashType(alg=HashAlgorithm.SHA_256, content=compute_hash(path))],
        purl=PackageURL("pypi", name=package.name, version=package.version, qualifiers={"file_name": path.name}),
    )


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
