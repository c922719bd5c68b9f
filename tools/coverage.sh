#!/bin/sh
# Builds with counters, runs the tests and tells how much of src, deform and retarget they run, and the worst files.
#   tools/coverage.sh [TEST...]      these executables of tests; else all of tests/unit, property, golden and the findings of fuzzers
# Tests that took longer than SLOWEST (25) seconds when ctest last ran in build are left out: with counters they would take an
# hour, and the others run their lines, too. LIMIT (1800 s) is what an executable may take, JOBS how many run at once.
set -eu
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}
[ $# -gt 0 ] || set -- $(ls tests/unit | sed s/^/unit_/) property golden $(ls tests/fuzz/findings | sed s/^/replay_/)
cmake --preset coverage -DMOUTHPIECE_UNITY=ON >/dev/null
cmake --build build-coverage -j "$jobs" --target "$@" >build-coverage/build.log 2>&1 || { tail -n 20 build-coverage/build.log >&2; exit 1; }
# The programs' data, as made by the release build: to make it with counters takes an hour.
mkdir -p build-coverage/share/mouthpiece build-coverage/coverage
[ ! -d build/share/mouthpiece ] || cp -ru build/share/mouthpiece/. build-coverage/share/mouthpiece/
find build-coverage -name '*.gcda' -delete -o -name '*CompilerId*.gcno' -delete
for test in "$@"; do  # as --gtest_filter has it; tests of one name and other numbers go together
  awk -v test="$test." -v most="${SLOWEST:-25}" 'index($1, test) == 1 && $NF > most {
    name = substr($1, length(test) + 1); sub("^[^/]*/[^/]*/", "&*#", name); sub("#.*", "", name); printf ":%s", name }' \
    build/Testing/Temporary/CTestCostData.txt 2>/dev/null >"build-coverage/coverage/$test.slow" || true
done
# One processor a test: its threads then hardly ever count at once, so that counters need no atomic steps, which are several times slower.
# A process writes the counters of all that it links when it ends, so that an executable runs as one, not as one a test.
printf '%s\n' "$@" | xargs -P "$jobs" --process-slot-var=SLOT -I TEST sh -c '
  start=$(date +%s)
  log=$PWD/build-coverage/coverage/TEST.log
  set -- --gtest_brief=1 "--gtest_filter=-$(cat build-coverage/coverage/TEST.slow)"
  case TEST in
    unit_*) folder=tests/unit/$(echo TEST | sed s/unit_//) ;;
    replay_*) folder=. reader=$(echo TEST | sed s/replay_//)
      set -- "$PWD/tests/fuzz/findings/$reader"
      [ ! -d "$PWD/tests/fuzz/corpora/$reader" ] || set -- "$@" "$PWD/tests/fuzz/corpora/$reader" ;;
    *) folder=tests/TEST ;;
  esac
  program=$PWD/build-coverage/test_bin/TEST
  cd "build-coverage/$folder"
  taskset -c "$SLOT" timeout "${LIMIT:-1800}" "$program" "$@" >"$log" 2>&1 || result="FAILED, see build-coverage/coverage/TEST.log"
  echo "TEST $(($(date +%s) - start)) s ${result-}"'
gcovr --root . --object-directory build-coverage --filter '^src/' --filter '^deform/' --filter '^retarget/' \
  --exclude-throw-branches --exclude-unreachable-branches --gcov-ignore-parse-errors -j "$jobs" \
  --json build-coverage/coverage/lines.json --json-summary build-coverage/coverage/summary.json \
  --txt build-coverage/coverage/files.txt build-coverage/src build-coverage/deform build-coverage/retarget >/dev/null
/usr/bin/python3 - build-coverage/coverage/summary.json <<'END'
import json, sys
facts = json.load(open(sys.argv[1]))
print(f"lines {facts['line_percent']} % of {facts['line_total']}, branches {facts['branch_percent']} % of {facts['branch_total']} (wanted 90 and 75)")
wings = {}
for file in facts["files"]:
    parts = file["filename"].split("/")
    wing = wings.setdefault(parts[1] if parts[0] == "src" else parts[0], [0, 0, 0, 0])
    for i, key in enumerate(("line_covered", "line_total", "branch_covered", "branch_total")):
        wing[i] += file[key]
for wing, (lines, of_lines, branches, of_branches) in sorted(wings.items()):
    print(f"  {wing:12} lines {100 * lines / max(of_lines, 1):5.1f} % of {of_lines:5}, branches {100 * branches / max(of_branches, 1):5.1f} %")
for file in sorted(facts["files"], key=lambda f: f["line_covered"] - f["line_total"])[:15]:
    print(f"  {file['line_total'] - file['line_covered']:4} of {file['line_total']:4} lines not run, branches {file['branch_percent']:5.1f} %  {file['filename']}")
END
