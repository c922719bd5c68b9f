#!/usr/bin/python3
"""Two long typed lines, one three times as long: the memory that a minute more takes (docs/performance.md).

    long_line.py --bin build/bin [--most-mib-a-minute 12] [--short 30] [--synth OTHER_SYNTH]

Marker motion of 60 frames a second as doubles takes 5.7 MiB a minute each time that it is held, sound 3.7. What is written
as it is made (motion.csv), and what needs no motion (a TextGrid), shall take what is known of the line, and its sound once.
Exits with 1 when a minute takes more than its bound. Exit status 77: there is no sample corpus.
"""
import argparse
import os
import pathlib
import sys
import tempfile

from line_memory import measured

TEXT = "She sells sea shells by the sea shore every morning. "


def seconds_of(grid):
    """The end of a TextGrid."""
    for line in open(grid):
        if line.startswith("xmax"):
            return float(line.split("=")[1])
    sys.exit(f"{grid}: found no xmax")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--synth", type=pathlib.Path, help="another one, which must find its corpus (MOUTHPIECE_SHARE)")
    parser.add_argument("--short", type=int, default=30, help="sentences of the shorter line")
    parser.add_argument("--most-mib-a-minute", type=float, default=12)
    options = parser.parse_args()
    share = pathlib.Path(os.environ.get("MOUTHPIECE_SHARE", options.bin.resolve().parent / "share/mouthpiece"))
    if not (share / "sample.corpus").exists():
        print("no sample corpus: make it with `make data`")
        return 77
    synth = options.synth or options.bin / "synth"
    wrong = 0
    with tempfile.TemporaryDirectory(prefix="long_line.") as folder:
        for name in ("phones.TextGrid", "motion.csv"):
            taken = []
            for sentences in (options.short, 3 * options.short):
                text = pathlib.Path(folder) / "text"
                text.write_text(sentences * TEXT)
                grid = f"{folder}/length.TextGrid"
                command = [synth, "--text-file", text, "--voice", "flite:slt", "--quiet", "-o", grid, "-o", f"{folder}/{name}"]
                own, _, took = measured(command)
                taken.append((seconds_of(grid) / 60, own))
                print(f"{name:16} {60 * taken[-1][0]:6.1f} s  {own:6.1f} MiB of its own  {took / 1000:5.1f} s of processor")
            grows = (taken[1][1] - taken[0][1]) / (taken[1][0] - taken[0][0])
            print(f"{name:16} {grows:5.1f} MiB a minute")
            wrong += grows > options.most_mib_a_minute
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
