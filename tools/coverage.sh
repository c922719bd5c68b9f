#!/bin/sh
# Builds with counters, runs the tests and tells how much of src, deform and retarget they run, and the worst files.
#   tools/coverage.sh [UNIT...]      all of tests/unit, and what else needs no browser, Blender, farm or package; or these executables
# TARGETS bounds what is built, LIMIT (1800 s) what an executable may take.
set -eu
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}
cmake --preset coverage -DMOUTHPIECE_UNITY=ON >/dev/null
cmake --build build-coverage -j "$jobs" --target ${TARGETS:-all} >build-coverage/build.log 2>&1 || { tail -n 20 build-coverage/build.log >&2; exit 1; }
# The programs' data, as made by the release build: to make it with counters takes an hour.
mkdir -p build-coverage/share/mouthpiece build-coverage/coverage
[ ! -d build/share/mouthpiece ] || cp -ru build/share/mouthpiece/. build-coverage/share/mouthpiece/
find build-coverage -name '*.gcda' -delete -o -name '*CompilerId*.gcno' -delete
others='^(unit_|browser|blender|farm|package|heads|guides|golden\.outputs|faults|load|install|links)'
[ $# -eq 0 ] || others=.
[ $# -gt 0 ] || set -- $(cd build-coverage/test_bin && ls -d unit_*)
# One processor a test: its threads then hardly ever count at once, so that counters need no atomic steps, which are several times slower.
# A process writes the counters of all that it links when it ends, so that an executable runs as one, not as one a test.
printf '%s\n' "$@" | xargs -P "$jobs" --process-slot-var=SLOT -I UNIT sh -c '
  start=$(date +%s)
  cd "build-coverage/tests/$(echo UNIT | sed s#_#/#)"
  taskset -c "$SLOT" timeout "${LIMIT:-1800}" ../../../test_bin/UNIT --gtest_brief=1 >../../../coverage/UNIT.log 2>&1 || result="FAILED, see build-coverage/coverage/UNIT.log"
  echo "UNIT $(($(date +%s) - start)) s ${result-}"'
for job in $(seq "$jobs"); do
  taskset -c "$((job - 1))" ctest --test-dir build-coverage -I "$job,,$jobs" -E "$others" >"build-coverage/coverage/others.$job.log" 2>&1 &
done
wait
grep -h 'tests passed\|(Failed)\|(Timeout)' build-coverage/coverage/others.*.log || true
gcovr --root . --object-directory build-coverage --filter '^src/' --filter '^deform/' --filter '^retarget/' \
  --exclude-throw-branches --exclude-unreachable-branches --gcov-ignore-parse-errors -j "$jobs" \
  --json build-coverage/coverage/lines.json --json-summary build-coverage/coverage/summary.json \
  --txt build-coverage/coverage/files.txt >/dev/null
/usr/bin/python3 - build-coverage/coverage/summary.json <<'END'
import json, sys
facts = json.load(open(sys.argv[1]))
print(f"lines {facts['line_percent']} % of {facts['line_total']}, branches {facts['branch_percent']} % of {facts['branch_total']} (wanted 90 and 75)")
for file in sorted(facts["files"], key=lambda f: f["line_covered"] - f["line_total"])[:15]:
    print(f"  {file['line_total'] - file['line_covered']:4} of {file['line_total']:4} lines not run, branches {file['branch_percent']:5.1f} %  {file['filename']}")
END
