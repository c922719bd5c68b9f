#!/bin/sh
# The quick lane: what the change against BASE touches, under sanitizers. The unit tests of the changed wings run under
# asan and ubsan, and the fuzz targets of the changed readers FUZZ_SECONDS each, their findings and stored seeds first.
#   BASE=origin/main FUZZ_SECONDS=60 tools/quick.sh
#   CHANGED="FILE..." tools/quick.sh --list        what it would run for these files
set -eu
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}
if [ -n "${CHANGED:-}" ]; then
  base=CHANGED changed=$(printf '%s\n' $CHANGED)
else
  base=${BASE:-$(git merge-base HEAD origin/main 2>/dev/null || git rev-parse HEAD~1)}
  changed=$(git diff --name-only "$base"; git ls-files --others --exclude-standard)
fi
wings=$(echo "$changed" | sed -nE 's#^include/.*#speaker#p; s#^(src/|tests/unit/|)([a-z_]+)/.*#\2#p' | sort -u | while read -r wing; do
  [ ! -d "tests/unit/$wing" ] || echo "$wing"
done)
tests=$(for wing in $wings; do echo "unit_$wing"; done)
! echo "$changed" | grep -q '^tests/property/\|^src/units/' || tests="$tests property"

# A reader has changed when its target, a seed, finding or dictionary of it, a mutator of it, or a
# room that the target includes has. All include base: a change of it asks a few that between them use its readers of
# bytes, text, JSON, numbers and archives.
readers=$({
  ! echo "$changed" | grep -q '^src/base/' || printf '%s\n' corpus mesh song packed_musicxml times
  for target in tests/fuzz/*_fuzz.cpp; do
    name=$(basename "$target" _fuzz.cpp)
    rooms=$(sed -nE 's#^\#include "(.*)/[^/]*".*#\1#p' "$target" | grep -v '^base$' | sort -u)
    sources=$(sed -nE "s#^target_sources\\(${name}_fuzz PRIVATE (.*)\\)#\\1#p" tests/fuzz/CMakeLists.txt)
    for file in $changed; do
      case $file in "$target" | tests/fuzz/*/"$name"/* | tests/fuzz/dictionaries/"$name".dict) echo "$name"; continue ;; esac
      for source in $sources; do
        case "$source $file" in "${file#tests/fuzz/} $file" | *_mutator.cpp\ tests/fuzz/mutator.h) echo "$name" ;; esac
      done
      for room in $rooms; do
        [ "$(dirname "$file")" != "src/$room" ] && [ "$(dirname "$file")" != "$room" ] || echo "$name"
      done
    done
  done
} | sort -u)
echo "changed since $base: wings" ${wings:-none} "- readers" ${readers:-none}
[ "${1:-}" != --list ] && [ -n "$tests$readers" ] || exit 0

if [ -n "$tests" ]; then
  cmake --preset asan -DMOUTHPIECE_UNITY=ON >/dev/null
  cmake --build build-asan -j "$jobs" --target $tests
  mkdir -p build-asan/share/mouthpiece
  [ ! -d build/share/mouthpiece ] || cp -ru build/share/mouthpiece/. build-asan/share/mouthpiece/
  for test in $tests; do build-asan/test_bin/"$test" --gtest_brief=1; done
fi
[ -z "$readers" ] || tools/fuzz.sh "${FUZZ_SECONDS:-60}" $readers
