#!/bin/sh
# Runs fuzz targets under address and undefined-behaviour sanitizers, each for SECONDS or FUZZ_RUNS inputs, whichever ends
# first, within 3 GB and 20 s an input. What libFuzzer makes goes to a scratch folder; the committed findings
# (tests/fuzz/findings), corpora (tests/fuzz/corpora) and dictionaries (tests/fuzz/dictionaries) are only read. What it
# prints are rows of the table in docs/security.md.
#   tools/fuzz.sh SECONDS [NAME...]        all targets when none is named
set -eu
seconds=${1:-60}
[ $# -eq 0 ] || shift
cmake --preset asan -DMOUTHPIECE_UNITY=ON >/dev/null
if [ $# -eq 0 ]; then
  cmake --build build-asan -j "${JOBS:-$(nproc)}" --target fuzzers
  set -- $(cd tests/fuzz && ls ./*_fuzz.cpp | sed 's|^./||; s|_fuzz.cpp$||')
else
  cmake --build build-asan -j "${JOBS:-$(nproc)}" --target $(printf '%s_fuzz ' "$@")
fi
failed=0
echo "| target | findings and seeds | inputs | edges | when |"
for name in "$@"; do
  scratch=build-asan/scratch/$name
  mkdir -p "$scratch"
  seeds=
  for folder in tests/fuzz/findings/$name tests/fuzz/corpora/$name; do [ ! -d "$folder" ] || seeds="$seeds $folder"; done
  dictionary=tests/fuzz/dictionaries/$name.dict
  [ -f "$dictionary" ] && dictionary="-dict=$dictionary" || dictionary=
  log=build-asan/scratch/$name.log
  # shellcheck disable=SC2086
  build-asan/fuzz/"$name"_fuzz "$scratch" $seeds $dictionary -max_total_time="$seconds" -runs="${FUZZ_RUNS:--1}" \
    -rss_limit_mb=3000 -timeout=20 -print_final_stats=1 -artifact_prefix="$scratch/" >"$log" 2>&1 || {
    failed=1
    tail -n 40 "$log"
  }
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  took=$(sed -n 's/^Done [0-9]* runs in \([0-9]*\) second.*/ in \1 s/p' "$log")
  covered=$(sed -n 's/.* cov: \([0-9]*\) .*/\1/p' "$log" | tail -n 1)
  # shellcheck disable=SC2086
  echo "| $name | $([ -z "$seeds" ] || find $seeds -type f | wc -l) | ${runs:-?}$took | $covered | $(date -u +%F) |"
done
exit $failed
