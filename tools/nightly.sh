#!/bin/sh
# All that takes hours. Each part writes build-nightly/PART.log; a table of what passed and how long it took ends it.
#   tools/nightly.sh [PART...]       lint dev portable fuzz asan tsan valgrind faults coverage mutation load heads long processors reproducible
# FUZZ_SECONDS (1800) and FUZZ_RUNS (10000000) end a fuzz target, ALLOCATIONS (2000) fail in a case, MUTANTS (300) are
# tried in each room.
set -eu
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}
mkdir -p build-nightly
table=build-nightly/table.txt
[ "${1:-}" = --run ] || : >"$table"

share_data() {  # what the release build has performed and fitted
  mkdir -p "$1/share/mouthpiece"
  cp -ru build/share/mouthpiece/. "$1/share/mouthpiece/"
}
sanitized() {  # PRESET CTEST-OPTION...
  preset=$1
  shift
  cmake --preset "$preset" -DMOUTHPIECE_UNITY=ON
  cmake --build "build-$preset" -j "$jobs"
  share_data "build-$preset"
  ctest --preset "$preset" -j "$jobs" "$@"
}
no_pages='^(browser|blender|farm|package|guides|heads|install|load|faults|golden\.outputs)'

run_lint() { tools/lint.sh; }
run_portable() { cmake --preset portable && cmake --build build-portable -j "$jobs" && ctest --preset portable; }
run_dev() { cmake --preset dev && cmake --build build-dev -j "$jobs"; }
run_fuzz() { FUZZ_RUNS=${FUZZ_RUNS:-10000000} tools/fuzz.sh "${FUZZ_SECONDS:-1800}"; }
run_asan() { sanitized asan -E "$no_pages"; }
# What starts threads, or says that it may be used by several; elsewhere there is one.
threaded='^(unit_(base|exports|local_server|speaker|voices)\.|unit_programs\.(Streaming|Batch)|unit_corpus_tools\.(BuildParts|BuildCorpusFile|SettingsFit)$'
threaded="$threaded|unit_(deform\.FaceDeformer|retarget\.FaceJudgeTest|synthesis\.Plan|units\.UnitDatabase)$)"
run_tsan() { TSAN_OPTIONS=suppressions=$PWD/tools/tsan.supp sanitized tsan -R "$threaded"; }
# Uninitialised reads, which no sanitizer of GCC sees, in what reads bytes.
run_valgrind() {
  cmake --build build -j "$jobs" --target unit_base unit_phonetics unit_motion
  for test in unit_base unit_phonetics unit_motion; do
    valgrind --quiet --error-exitcode=9 --leak-check=full --errors-for-leak-kinds=definite --trace-children=no \
      build/test_bin/"$test" --gtest_brief=1 --gtest_filter="${VALGRIND_FILTER:--ChildProcess*:ParallelFor*:*Memory*:*Law*}"
  done
}
run_faults() {
  tests/faults/inject.py --bin build/bin --share build/share/mouthpiece --shim build/test_bin/faults.so --all \
    --allocations "${ALLOCATIONS:-2000}"
}
run_coverage() { tools/coverage.sh; }
run_mutation() {
  cmake --preset release -DMOUTHPIECE_TESTS=ON -DMOUTHPIECE_UNITY=ON
  tools/mutate.py src/motion/*.cpp src/motion/*/*.cpp --target unit_motion --count "${MUTANTS:-300}"
  tools/mutate.py src/units/*/*.cpp --target unit_units --target property --count "${MUTANTS:-300}"
  tools/mutate.py deform/*/*.cpp --target unit_deform --longest 10 --count "${MUTANTS:-300}"
}
run_load() {
  cmake --build build -j "$jobs" --target load_trial repeat_corpus
  build/test_bin/load_trial phones
  build/test_bin/load_trial lines 2000 build/share/mouthpiece/clock.corpus
  tests/load/load.py --build build
}
run_heads() {  # all heads that have to fit; `make test` takes every third
  cmake --build build -j "$jobs" --target heads heads_trial golden
  export MOUTHPIECE_ALL_HEADS=1
  build/test_bin/heads --gtest_brief=1 --gtest_filter='*RandomHeads*'
  build/test_bin/golden --gtest_brief=1 --gtest_filter='*RealHeads*'
}
run_long() {  # what `make test` leaves out: long recordings, a page's frames, the package in a bare root
  cmake --preset release -DMOUTHPIECE_TESTS=ON -DMOUTHPIECE_UNITY=ON
  cmake --build build -j "$jobs"
  ctest --preset release -C nightly -L nightly
}
run_processors() { tools/other_processors.sh s390x armhf arm64; }
run_reproducible() { tools/reproducible.sh; }

if [ "${1:-}" = --run ]; then  # in a process of its own, where the first command that fails ends it
  "run_$2"
  exit
fi
failed=0
[ $# -gt 0 ] || set -- lint dev portable fuzz asan tsan valgrind faults coverage mutation load heads long processors reproducible
for part in "$@"; do
  start=$(date +%s)
  if tools/nightly.sh --run "$part" >"build-nightly/$part.log" 2>&1; then result=passed; else result=FAILED failed=1; fi
  printf '%-14s %-7s %6d s   %s\n' "$part" "$result" $(($(date +%s) - start)) "$(tail -n 1 "build-nightly/$part.log")" | tee -a "$table"
done
exit $failed
