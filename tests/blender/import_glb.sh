#!/bin/sh
# import_glb.sh BLENDER FACE.glb [EXPECTED.json]: 77 when there is nothing to test with.
blender=$1
glb=$2
if ! command -v "$blender" >/dev/null 2>&1; then
  echo "skipped: no Blender found; get it with: sudo apt-get install blender"
  exit 77
fi
if [ ! -f "$glb" ]; then
  echo "skipped: $glb is not there"
  exit 77
fi
shift
exec "$blender" --background --factory-startup --python-exit-code 1 --python "$(dirname "$0")/import_glb.py" -- "$@"
