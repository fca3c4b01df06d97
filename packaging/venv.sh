#!/usr/bin/env bash
# Makes a virtual environment: with Blender as a Python module and everything the tests need, or what trains networks.
#
#   packaging/venv.sh main      .venv           bpy 5.0.1 on Python 3.11, bpy 5.2.2 on Python 3.13
#   packaging/venv.sh oldest    .venv-4.5       bpy 4.5.15 on Python 3.11; says so and makes none without that Python
#   packaging/venv.sh training  .venv-training  jax and optax on Python 3.11, 3.12 or 3.13, without bpy
#   packaging/venv.sh lint      .venv-lint      ruff, mypy and check-jsonschema
#   packaging/venv.sh docs      .venv-docs      mkdocs
#   packaging/venv.sh package   .venv-package   build and hatchling
#   packaging/venv.sh pack      .venv-pack      what pins and describes the wheels of the zips
#
# The environments live outside the clone, in a cache named by their requirements, so that a second
# clone (or a clean one) gets them in a second; the clone holds links. PYTHON=... chooses an interpreter.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
clone=$(dirname "$here")
cache=${XDG_CACHE_HOME:-$HOME/.cache}/beyond-mocap
libraries="libx11-6 libxrender1 libxfixes3 libxi6 libxxf86vm1 libxkbcommon0 libsm6 libice6 libgl1 libegl1"

fail() { echo "venv: $*" >&2; exit 1; }

version_of() { "$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null; }

find_python() {  # the first interpreter that runs and is one of the wanted versions
  local name version wanted
  for name in ${PYTHON:-python3.11 python3.13 python3 python}; do
    version=$(version_of "$name") || continue
    for wanted in "$@"; do
      [ "$version" = "$wanted" ] && { echo "$name"; return 0; }
    done
  done
  return 1
}

probe() {  # prints nothing where the environment works, else the reason
  "$1/bin/python" - $modules 2>&1 <<'PY' | tail -1
import sys
from importlib import import_module
from importlib.util import find_spec
import_module(sys.argv[1])
for name in sys.argv[2:]:
    if find_spec(name) is None:
        raise SystemExit(f"{name} is missing")
PY
}

build() {  # PYTHON REQUIREMENTS FOLDER
  echo "venv: making $3 (downloads $download)"
  rm -rf "$3"
  "$1" -m venv "$3" >&2 || { rm -rf "$3"; fail "$1 cannot make a virtual environment; on Debian: apt-get install python3-venv"; }
  "$3/bin/python" -m pip install --quiet --disable-pip-version-check -r "$2" || { rm -rf "$3"; fail "pip could not install $2"; }
}

link() {  # FOLDER LINK: a venv that stands in the clone itself gives way, anything else is left alone
  if [ -e "$2" ] && [ ! -L "$2" ]; then
    [ -e "$2/pyvenv.cfg" ] || fail "$2 is not a virtual environment; move it away"
    rm -rf "$2"
  fi
  ln -sfn "$1" "$2"
}

case ${1:-} in
  main) link=$clone/.venv; python=$(find_python 3.11 3.13) || fail "needs Python 3.11 or 3.13 (PYTHON=... names one)" ;;
  oldest) link=$clone/.venv-4.5
    python=$(find_python 3.11) || { rm -f "$link"; echo "venv: no Python 3.11 here: NOT tested under Blender 4.5"; exit 0; } ;;
  training) link=$clone/.venv-training
    python=$(find_python 3.11 3.12 3.13) || fail "training needs Python 3.11, 3.12 or 3.13 (PYTHON=... names one)" ;;
  lint) link=$clone/.venv-lint; python=$(find_python 3.11 3.12 3.13) || fail "needs Python 3.11 or later (PYTHON=... names one)" ;;
  docs) link=$clone/.venv-docs; python=$(find_python 3.11 3.12 3.13) || fail "needs Python 3.11 or later (PYTHON=... names one)" ;;
  package) link=$clone/.venv-package; python=$(find_python 3.11 3.12 3.13) || fail "needs Python 3.11 or later (PYTHON=... names one)" ;;
  pack) link=$clone/.venv-pack; python=$(find_python 3.11 3.12 3.13) || fail "needs Python 3.11 or later (PYTHON=... names one)" ;;
  *) sed -n '2,14s/^# \{0,1\}//p' "$0"; exit 2 ;;
esac
modules="bpy numpy scipy sklearn joblib distributed kloppy c3d pytest xdist hypothesis matplotlib"  # the first is imported, to see it works
download="Blender as a module, about 350 MB"
case $1-$(version_of "$python") in
  main-3.11) kind=blender-5.0 ;;
  main-3.13) kind=blender-5.2 ;;
  oldest-3.11) kind=blender-4.5 ;;
  lint-*) kind=lint; modules="mypy ruff check_jsonschema"; download="ruff and mypy, about 20 MB" ;;
  docs-*) kind=docs; modules="mkdocs material latex2mathml"; download="mkdocs, about 20 MB" ;;
  package-*) kind=package; modules="build hatchling"; download="build and hatchling, about 2 MB" ;;
  pack-*) kind=pack; modules="cyclonedx uv"; download="uv and cyclonedx, about 30 MB" ;;
  training-*) kind=training; modules="jax numpy scipy sklearn optax c3d pytest hypothesis"; download="jax, about 150 MB" ;;
esac
requirements=$here/requirements/$kind.txt
interpreter=$("$python" -c 'import sys; print(sys.version, sys.base_prefix)')
key=$({ cat "$here/requirements/core.txt" "$requirements"; echo "$interpreter"; } | sha256sum | cut -c1-12)
folder=$cache/venv-${kind#blender-}-$key

mkdir -p "$cache"
exec 9>"$folder.lock"
flock 9
[ -x "$folder/bin/python" ] && trouble=$(probe "$folder") || trouble="not there yet"
if [ -n "$trouble" ] && [[ $trouble != *"cannot open shared object file"* ]]; then
  build "$python" "$requirements" "$folder"
  trouble=$(probe "$folder") || true
fi
case $trouble in
  "") ;;
  *"cannot open shared object file"*) fail "Blender's module lacks system libraries (${trouble#ImportError: }); on Debian: apt-get install $libraries" ;;
  *) fail "$folder does not work: $trouble" ;;
esac
link "$folder" "$link"
