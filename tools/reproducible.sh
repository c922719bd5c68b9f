#!/bin/sh
# Builds the programs of this commit twice, in two folders of other names and without a compiler cache, and compares them
# byte by byte as `make deb` ships them (without symbol tables).
set -eu
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
commit=$(git rev-parse HEAD)  # which may be another one by the time of the second build
for folder in first "second, of a longer name"; do
  git clone -q . "$place/$folder" && git -C "$place/$folder" -c advice.detachedHead=false checkout -q "$commit"
  (cd "$place/$folder" && cmake --preset release -DMOUTHPIECE_TESTS=OFF -DMOUTHPIECE_UNITY=ON -DCMAKE_CXX_COMPILER_LAUNCHER= \
    -DMOUTHPIECE_CCACHE=OFF >/dev/null && cmake --build build -j "$jobs" --target synth corpus retarget >/dev/null)
  strip "$place/$folder"/build/bin/*
done
for program in synth corpus retarget; do
  cmp "$place/first/build/bin/$program" "$place/second, of a longer name/build/bin/$program"
  sha256sum "$place/first/build/bin/$program" | sed "s|  .*|  $program|"
done
echo "the same bytes from two folders"
