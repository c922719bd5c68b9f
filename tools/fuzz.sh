#!/bin/sh
# Runs every fuzz target for SECONDS under address and undefined-behaviour sanitizers. What libFuzzer makes goes to a
# scratch folder; the committed findings (tests/fuzz/findings) are only read.
set -eu
seconds=${1:-60}
cmake --preset fuzz >/dev/null
cmake --build build-fuzz --target fuzzers
for target in build-fuzz/fuzz/*_fuzz; do
  name=$(basename "$target" _fuzz)
  scratch=build-fuzz/scratch/$name
  seeds=tests/fuzz/findings/$name
  mkdir -p "$scratch"
  [ -d "$seeds" ] || seeds=
  echo "== $name, $seconds s"
  "$target" "$scratch" $seeds -max_total_time="$seconds" -rss_limit_mb=3000 -timeout=20 -print_final_stats=1 \
    -artifact_prefix="$scratch/" 2>&1 | tail -n 12
done
