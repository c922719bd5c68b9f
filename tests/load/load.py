#!/usr/bin/python3
"""64 programs at once on one corpus, and a line from a corpus of ten hours: what they take (docs/performance.md).

    load.py --build build [--hours 10]

Exits with 1 when one of the 64 fails or writes other bytes than the first; times and memory are told, not judged: they
are the machine's.
"""
import argparse
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

TEXT = "the time is now exactly twenty five past seven in the evening"


def many(build, folder, count=64):
    """`count` programs that speak the same line beside one another."""
    start = time.monotonic()
    outputs = [folder / f"{i}.csv" for i in range(count)]
    command = [build / "bin/synth", "--text", TEXT, "--corpus", "clock", "--voice", "flite:slt", "--quiet", "-o"]
    programs = [subprocess.Popen(command + [output]) for output in outputs]
    failed = sum(program.wait() != 0 for program in programs)
    others = sum(not output.exists() or output.read_bytes() != outputs[0].read_bytes() for output in outputs)
    print(f"{count} at once: {time.monotonic() - start:.1f} s, {failed} failed, {others} wrote other bytes")
    return failed + others


def hours(build, folder, wanted):
    """A line from the sample corpus said over and over, each time a little faster or slower."""
    source, large = build / "share/mouthpiece/sample.corpus", folder / "large.corpus"
    facts = json.loads(subprocess.run([build / "bin/corpus", "info", source, "--json"], check=True, capture_output=True).stdout)
    times = max(1, round(wanted * 3600 / facts["duration_s"]))
    subprocess.run([build / "benchmarks/repeat_corpus", source, str(times), large], check=True)
    for method in ("viterbi", "greedy"):
        report = folder / "report.json"
        command = [build / "bin/synth", "--text", TEXT, "--corpus", large, "--voice", "flite:slt", "--select", method,
                   "--quiet", "-o", folder / "a.csv", "-o", report]
        for run in ("read from disk or cache", "again"):
            start = time.monotonic()
            program = subprocess.Popen(command)
            _, status, usage = os.wait4(program.pid, 0)
            wall = time.monotonic() - start
            took = json.loads(report.read_text())["timing_ms"]
            print(f"{times} x {facts['duration_s'] / 60:.0f} min, {method}, {run}: {wall:.2f} s wall, "
                  f"{usage.ru_utime + usage.ru_stime:.2f} s of processor, {usage.ru_maxrss / 1024:.0f} MiB; " +
                  ", ".join(f"{name} {value:.0f} ms" for name, value in took.items()))
            if status != 0:
                return 1
    return 0


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--hours", type=float, default=10)
    options = parser.parse_args()
    build = options.build.resolve()
    with tempfile.TemporaryDirectory(prefix="load.") as folder:
        wrong = many(build, pathlib.Path(folder))
        if options.hours > 0:
            wrong += hours(build, pathlib.Path(folder), options.hours)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
