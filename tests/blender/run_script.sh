#!/bin/sh
# run_script.sh BLENDER SCRIPT FILE...: 77 when there is nothing to test with.
blender=$1
script=$2
if ! command -v "$blender" >/dev/null 2>&1; then
  echo "skipped: no Blender found; get it with: sudo apt-get install blender"
  exit 77
fi
shift 2
for file in "$@"; do
  [ -e "$file" ] && continue
  echo "skipped: $file is not there"
  exit 77
done
# Blender's own files are this run's alone.
resources=$(mktemp -d)
trap 'rm -rf "$resources"' EXIT
BLENDER_USER_RESOURCES=$resources "$blender" --background --factory-startup --python-exit-code 1 --python "$(dirname "$0")/$script" -- "$@"
