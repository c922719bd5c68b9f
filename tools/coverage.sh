#!/bin/sh
# Builds with counters, runs the tests and tells how much of src, deform and retarget they run, and the worst files.
#   tools/coverage.sh [TEST-REGEX]      by default every test that needs no browser, Blender, farm or package
set -eu
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}
cmake --preset coverage -DMOUTHPIECE_UNITY=ON >/dev/null
cmake --build build-coverage -j "$jobs" --target ${TARGETS:-all} >build-coverage/build.log 2>&1 || { tail -n 20 build-coverage/build.log >&2; exit 1; }
# The programs' data, as made by the release build: to make it with counters takes an hour.
mkdir -p build-coverage/share/mouthpiece
[ ! -d build/share/mouthpiece ] || cp -ru build/share/mouthpiece/. build-coverage/share/mouthpiece/
find build-coverage -name '*.gcda' -delete
if [ $# -gt 0 ]; then set -- -R "$1"; else set -- -E '^(browser|blender|farm|package|heads|guides|golden\.outputs|install|links)'; fi
# One processor a test: its threads then hardly ever count at once, so that counters need no atomic steps, which are several times slower.
for job in $(seq "$jobs"); do
  taskset -c "$((job - 1))" ctest --test-dir build-coverage -I "$job,,$jobs" "$@" >"build-coverage/tests.$job.log" 2>&1 &
done
wait
for job in $(seq "$jobs"); do grep -q '^100% tests passed' "build-coverage/tests.$job.log" || tail -n 30 "build-coverage/tests.$job.log"; done
mkdir -p build-coverage/coverage
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
