#!/usr/bin/python3
"""Runs the benchmarks, speaks the timed lines, and prints one table: each row beside its rival of the same run, and what
share of its limit it takes (docs/performance.md). Rows come as they are measured to stderr, the table at the end.

    table.py --benches build-bench/benchmarks --bin build/bin [--only REGEX] [--min-time 0.5]

--only: rows whose names match, as Google Benchmark's filter has it; "line" for the lines besides speech.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys

import line_time

# What a benchmark is measured beside: the counter that tells how many times as fast it is, and as what.
RIVALS = {
    "ictDeformAgainstAsRigidAsPossible": ("times_faster", "CGAL's as-rigid-as-possible"),
    "deformAgainstDenseBlend": ("times_faster", "a dense blend of 52 shapes"),
    "portableDeformAgainstDenseBlend": ("times_faster", "a dense blend of 52 shapes"),
    "ictDeformAgainstDenseBlend": ("times_faster", "a dense blend of 52 shapes"),
    "ictManyTimesOver": ("share_of_copy", "a plain copy of the vertices"),
    "ictDeformOnTwoThreads": ("times_faster", "one thread"),
    "principalShapesAgainstComponentsOfTheWhole": ("times_faster", "components of all vertices"),
    "base64AgainstLetterByLetter": ("times_faster", "letter by letter"),
    "resampleWindowedAgainstDense": ("times_faster", "one dense system"),
    "retargetAllFrames": ("times_faster", "marker by marker"),
    "longestMatch": ("times_naive", "a search of all takes"),
    "readCorpusFile": ("times_reading_all", "all motion read at once"),
    "hearVowelsOfTenSeconds": ("times_real_time", "real time"),
    "hearAVoiceForTenSeconds": ("times_real_time", "real time"),
    "tagTenSeconds": ("times_real_time", "real time"),
}
HEAD = ("what", "takes", "beside", "times as fast", "limit", "share of it")


def said(row):
    print("  ".join(cell for cell in row if cell), file=sys.stderr, flush=True)
    return row


def bench_rows(program, only, min_time):
    command = [program, "--benchmark_format=json", f"--benchmark_min_time={min_time}"]
    listed = subprocess.run(command[:1] + ["--benchmark_list_tests", f"--benchmark_filter={only}"],
                            capture_output=True, text=True).stdout
    if not listed.strip():
        return
    ran = subprocess.run(command + [f"--benchmark_filter={only}"], stdout=subprocess.PIPE, text=True)
    if ran.returncode != 0:
        sys.exit(f"{program} failed: {ran.returncode}")
    for found in json.loads(ran.stdout)["benchmarks"]:
        name = found["name"]
        if found.get("error_occurred"):
            yield said((name, "not measured: " + found["error_message"], "", "", "", ""))
            continue
        counter, rival = RIVALS.get(name.split("/")[0], (None, "-"))
        ratio = f"{found[counter]:.3g}" if counter else "-"
        yield said((name, f"{found['real_time']:.3g} {found['time_unit']}", rival, ratio, "-", "-"))


def line_rows(folder, runs):
    for line in line_time.lines_timed(folder, runs=runs):
        yield said((f"line of {line.length_ms / 1000:.1f} s besides speech", f"{line.own_ms:.0f} ms", "real time",
                    f"{line.length_ms / line.own_ms:.1f}", f"{line.limit_ms:.0f} ms",
                    f"{line.own_ms / line.limit_ms:.2f}"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--benches", type=pathlib.Path, required=True)
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--only", default=".*")
    parser.add_argument("--min-time", type=float, default=0.5, help="seconds a benchmark runs at least")
    parser.add_argument("--runs", type=int, default=5, help="of each line")
    options = parser.parse_args()
    programs = sorted(options.benches.glob("*_bench"))
    if not programs:
        parser.error(f"no benchmarks in {options.benches}")
    rows = [row for program in programs for row in bench_rows(program, options.only, options.min_time)]
    if re.search(options.only, "line"):
        missing = line_time.what_is_missing(options.bin)
        rows += [("lines", "not measured: " + missing, "", "", "", "")] if missing else line_rows(options.bin, options.runs)
    if not rows:
        parser.error(f"no row matches {options.only}")
    print("| " + " | ".join(HEAD) + " |\n" + "|---" * len(HEAD) + "|")
    for row in rows:
        print("| " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()
