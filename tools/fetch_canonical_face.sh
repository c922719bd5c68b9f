#!/bin/sh
# Brings MediaPipe's canonical face model (468 vertices, Apache-2.0, (c) The MediaPipe Authors) out of the npm package
# mind-ar. `tools/fetch_canonical_face.sh [FILE]`; does nothing when FILE is there already.
set -eu
destination=${1:-build/third_party/canonical_face.obj}
package=mind-ar@1.2.5
member=package/src/face-target/face-geometry/canonical-face-model.obj
sha256=8bac80443397e113f41a8b565ea72c59390bc031d9defab289dba7bc0c54e618

has_right_hash() {
  [ -f "$1" ] && [ "$(sha256sum "$1" | cut -d ' ' -f 1)" = "$sha256" ]
}
has_right_hash "$destination" && exit 0

if ! command -v npm >/dev/null 2>&1; then
  echo "fetch_canonical_face: npm is missing; get it with: sudo apt-get install npm" >&2
  exit 1
fi
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
if ! (cd "$scratch" && npm pack "$package" --silent >npm.out 2>npm.err); then
  echo "fetch_canonical_face: npm cannot get $package; is there a network? (npm pack $package says more)" >&2
  exit 1
fi
tar -xzf "$scratch"/mind-ar-*.tgz -C "$scratch" "$member"
if ! has_right_hash "$scratch/$member"; then
  echo "fetch_canonical_face: $package holds another canonical face than expected (SHA-256 differs); nothing was changed" >&2
  exit 1
fi
mkdir -p "$(dirname "$destination")"
cp "$scratch/$member" "$destination.tmp"
mv "$destination.tmp" "$destination"
