#!/bin/sh
# uninstall.sh CMAKE BUILD SCRIPT PREFIX: installs the programs' part into PREFIX beside a file of somebody else's, looks
# for licence and docs, and takes all of it away again.
set -eu
cmake=$1 build=$2 script=$3 prefix=$4
rm -rf "$prefix"
mkdir -p "$prefix/bin" "$prefix/share/doc/other"
echo "not ours" >"$prefix/bin/other"
"$cmake" --install "$build" --prefix "$prefix" --component programs >/dev/null
for file in bin/synth bin/corpus bin/retarget share/doc/mouthpiece/copyright share/doc/mouthpiece/README.md \
  share/doc/mouthpiece/docs/guides/first_line.md share/doc/mouthpiece/docs/glossary.md; do
  [ -e "$prefix/$file" ] || { echo "$file was not installed"; exit 1; }
done
manifest=$build/install_manifest_programs.txt
[ -e "$manifest" ] || manifest=$build/install_manifest.txt
"$cmake" -DMANIFEST="$manifest" -P "$script"
[ "$(cat "$prefix/bin/other")" = "not ours" ] || { echo "somebody else's file is gone"; exit 1; }
left=$(find "$prefix" -type f ! -path "$prefix/bin/other")
[ -z "$left" ] || { echo "left: $left"; exit 1; }
left=$(find "$prefix" -iname "*mouthpiece*")
[ -z "$left" ] || { echo "left: $left"; exit 1; }
if "$cmake" -DMANIFEST="$manifest" -P "$script" 2>/dev/null; then echo "a second time should be told"; exit 1; fi
