#!/usr/bin/python3
"""Breaks one line of a room at a time and asks its tests: a mutant that they do not notice is a line that nothing holds.

    mutate.py src/motion/*.cpp --target unit_motion [--count 40] [--seed 1] [--build build-coverage]

Operators: comparisons (< for <=, == for !=), arithmetic (+ for -, * for /), && for ||, constants (one more; a float by a
tenth), true for false, removed statements. The sample is drawn with the seed from all mutants of the files; lines of
checks that only our own mistakes reach (MOUTHPIECE_EXPECT), of messages and of constexpr assertions are left out. A
mutant counts when it compiles; tests that fail, crash or take ten times as long kill it. Survivors are printed as
FILE:LINE, what was and what became of it. The tree is as it was afterwards; a file with changes that are not committed is
refused. For the preset `coverage`, which compiles source by source; with --lines FILE.json (gcovr --json) only lines
that the tests run are taken.
"""
import argparse
import json
import pathlib
import random
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
SWAPS = [(" < ", " <= "), (" <= ", " < "), (" > ", " >= "), (" >= ", " > "), (" == ", " != "), (" != ", " == "),
         (" + ", " - "), (" - ", " + "), (" * ", " / "), (" / ", " * "), (" && ", " || "), (" || ", " && "),
         (" += ", " -= "), (" -= ", " += "), ("true", "false"), ("false", "true"), ("std::min(", "std::max("),
         ("std::max(", "std::min(")]
LEFT_OUT = re.compile(r"MOUTHPIECE_EXPECT|static_assert|^\s*(//|#|template|using|namespace)|InputError|fmt::|fail\(|refuse\(")
STATEMENT = re.compile(r"^\s+(?!return|const|auto|throw|if|for|while|else|case|break|double|int|std::size_t|}|using|static)[\w.\->\[\]():]+.*;\s*$")


def mutants_of(file):
    """(line number, what it becomes) for every mutant of a file."""
    for number, line in enumerate(file.read_text().splitlines(), 1):
        code = line.split("//")[0].rstrip()
        if not code.strip() or LEFT_OUT.search(line) or '"' in code:
            continue
        for old, new in SWAPS:
            for found in re.finditer(re.escape(old) if old.startswith(" ") else r"\b" + re.escape(old), code):
                if old.startswith(" ") and "template" in code:
                    continue
                yield number, code[:found.start()] + new + code[found.end():]
        for found in re.finditer(r"(?<![\w.:<])(\d+)(\.\d+)?(?![\w.>])", code):
            value = found.group(0)
            yield number, code[:found.start()] + (f"{float(value) * 1.1 + 0.1:.6g}" if "." in value else str(int(value) + 1)) + code[found.end():]
        if STATEMENT.match(code) and code.count("(") == code.count(")"):
            yield number, re.match(r"\s*", code).group(0) + ";"


def quietly(command, limit=None):
    try:
        return subprocess.run(command, cwd=ROOT, capture_output=True, timeout=limit).returncode
    except subprocess.TimeoutExpired:
        return "too long"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("files", nargs="+", type=pathlib.Path)
    parser.add_argument("--target", action="append", required=True, help="a test executable; several are run in turn")
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-coverage")
    parser.add_argument("--lines", type=pathlib.Path, help="gcovr --json: only lines that were run")
    parser.add_argument("--filter", default="*", help="of the tests, as --gtest_filter has it")
    parser.add_argument("--minutes", type=float, default=1e9, help="no new mutant after that")
    options = parser.parse_args()
    files = [file.resolve().relative_to(ROOT) for file in options.files]
    if quietly(["git", "diff", "--quiet", "HEAD", "--", *map(str, files)]) != 0:
        sys.exit("mutate.py: files with changes that are not committed")
    run = None
    if options.lines:
        run = {(f["file"], l["line_number"]) for f in json.loads(options.lines.read_text())["files"]
               for l in f["lines"] if l["count"] > 0}
    all_mutants = [(file, *mutant) for file in files for mutant in mutants_of(ROOT / file)
                   if run is None or (str(file), mutant[0]) in run]
    sample = random.Random(options.seed).sample(all_mutants, min(options.count, len(all_mutants)))
    tests = [[options.build / "test_bin" / target, "--gtest_brief=1", "--gtest_fail_fast", "--gtest_filter=" + options.filter]
             for target in options.target]
    build = ["ninja", "-C", options.build, *options.target]
    if quietly(build) != 0:
        sys.exit("mutate.py: does not build as it is")
    start = time.monotonic()
    if any(quietly(test) != 0 for test in tests):
        sys.exit("mutate.py: the tests fail as it is")
    limit = 30 + 10 * (time.monotonic() - start)
    killed, survivors, no_code = 0, [], 0
    started = time.monotonic()
    for file, number, becomes in sample:
        if time.monotonic() - started > 60 * options.minutes:
            break
        original = (ROOT / file).read_text()
        lines = original.splitlines()
        was, lines[number - 1] = lines[number - 1], becomes
        try:
            (ROOT / file).write_text("\n".join(lines) + "\n")
            if quietly(build) != 0:
                no_code += 1
            elif any(quietly(test, limit) != 0 for test in tests):
                killed += 1
            else:
                survivors.append(f"{file}:{number}: `{was.strip()}` -> `{becomes.strip()}`")
                print("survived", survivors[-1], flush=True)
        finally:
            (ROOT / file).write_text(original)
    quietly(build)
    judged = killed + len(survivors)
    share = 100 * killed / judged if judged else 0
    print(f"{killed} of {judged} killed ({share:.0f} %), {no_code} did not compile; drawn from {len(all_mutants)} with seed {options.seed}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
