#!/usr/bin/python3
"""The processor time that a typed line with all its files takes besides its speech, beside the limit (docs/performance.md).

    line_time.py --bin build/bin [--before OTHER_SYNTH] [--runs 5] [--lengths 1 3 10]

The voice is Festival, a program of its own: what children took is told apart by the kernel, so nothing has to be taken
off. Each line is spoken --runs times, with --before by both programs in turn; told is the least time. The limits are
100 ms for a second and 0.02 of the length for ten. Exit status 77: there is no sample corpus, or no Festival.
"""
import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

SENTENCE = "She sells sea shells by the sea shore every morning"
STORY = ("and the old man who lives in the house beside the harbour buys them for his daughter, because she likes the "
         "sound of water very much")
LIMIT_SHARE, LIMIT_LEAST_MS = 0.02, 100


def text_of(seconds):
    if seconds <= 1:
        return "The time is now"
    if seconds <= 3:
        return SENTENCE
    return " ".join([f"{SENTENCE}, {STORY}."] * max(1, round(seconds / 10)))


def took_ms(command):
    """Of the program itself and of its children, user and system."""
    program = subprocess.Popen(command)
    os.waitid(os.P_PID, program.pid, os.WEXITED | os.WNOWAIT)
    fields = open(f"/proc/{program.pid}/stat").read().rsplit(")", 1)[1].split()
    if program.wait() != 0:
        sys.exit(f"{command[0]} failed: {program.returncode}")
    ticks = [int(field) for field in fields[11:15]]
    a_tick = 1000 / os.sysconf("SC_CLK_TCK")
    return a_tick * sum(ticks[:2]), a_tick * sum(ticks[2:])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--before", type=pathlib.Path, help="another synth, spoken with in turn")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--lengths", type=float, nargs="+", default=[1, 3, 10])
    options = parser.parse_args()
    share = pathlib.Path(os.environ.get("MOUTHPIECE_SHARE", options.bin.resolve().parent / "share/mouthpiece"))
    if not (share / "sample.corpus").exists() or not (share / "default.face").exists() or not shutil.which("festival"):
        print("no sample corpus (make it with `make data`), or no Festival: lines are not timed")
        return 77
    os.environ["MOUTHPIECE_SHARE"] = str(share)
    programs = ([options.before] if options.before else []) + [options.bin / "synth"]
    print("line       besides speech        of its length   limit   share of it   speech" +
          ("   before   ratio" if options.before else ""))
    with tempfile.TemporaryDirectory(prefix="line_time.") as folder:
        for seconds in options.lengths:
            command = ["--quiet", "--text", text_of(seconds), "--out", folder]
            runs = {program: [] for program in programs}
            for _ in range(options.runs):
                for program in programs:
                    runs[program].append(took_ms([program] + command))
            length_ms = 1000 * json.load(open(f"{folder}/report.json"))["duration_s"]
            own, speech = (min(run[i] for run in runs[programs[-1]]) for i in (0, 1))
            limit = max(LIMIT_LEAST_MS, LIMIT_SHARE * length_ms)
            row = (f"{length_ms / 1000:6.2f} s   {own:8.0f} ms   {own / length_ms:18.3f}   {limit:5.0f} ms"
                   f"   {own / limit:9.2f}   {speech:5.0f} ms")
            if options.before:
                before = min(run[0] for run in runs[options.before])
                row += f"   {before:5.0f} ms   {own / before:5.2f}"
            print(row, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
