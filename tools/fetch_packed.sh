#!/bin/sh
# Brings files out of an npm package: `tools/fetch_packed.sh PACKAGE@VERSION SHA256 FOLDER MEMBER...`. SHA256 is the packed
# package's; a MEMBER is a path in it and lands in FOLDER without the folders above, or as NAME with MEMBER:NAME. Nothing is
# written where the hash differs or a member is missing.
set -eu
package=$1 sha256=$2 folder=$3
shift 3

complain() {
  echo "fetch_packed: $*" >&2
  exit 1
}
command -v npm >/dev/null 2>&1 || complain "npm is missing; get it with: sudo apt-get install npm"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
(cd "$scratch" && npm pack "$package" --silent >npm.out 2>npm.err) ||
  complain "npm cannot get $package; is there a network? (npm pack $package says more)"
[ "$(cat "$scratch"/*.tgz | sha256sum | cut -d ' ' -f 1)" = "$sha256" ] ||
  complain "$package is another than expected (SHA-256 differs); nothing was changed"
for member in "$@"; do
  tar -xzmf "$scratch"/*.tgz -C "$scratch" "package/${member%%:*}" 2>/dev/null || complain "$package holds no ${member%%:*}"
done
for member in "$@"; do
  name=${member##*:}
  [ "$name" != "$member" ] || name=${member##*/}
  mkdir -p "$(dirname "$folder/$name")"
  mv "$scratch/package/${member%%:*}" "$folder/$name.tmp"
  mv "$folder/$name.tmp" "$folder/$name"
done
