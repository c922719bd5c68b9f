#!/usr/bin/python3
"""The processor time that a typed line with all its files takes besides its speech, beside the limit (docs/performance.md).

    line_time.py --bin build/bin [--before OTHER_SYNTH] [--runs 5] [--lengths 1 3 10]

The voice is Festival, a program of its own: what children took is told apart by the kernel, so nothing has to be taken
off. Each line is spoken --runs times, with --before by both programs in turn; told is the least time. The limits are
100 ms for a second and 0.02 of the length for ten. Exit status 77: there is no sample corpus, or no Festival.
"""
import argparse
import dataclasses
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


@dataclasses.dataclass
class TimedLine:
    length_ms: float
    own_ms: float
    speech_ms: float
    before_ms: float | None  # of another synth

    @property
    def limit_ms(self):
        return max(LIMIT_LEAST_MS, LIMIT_SHARE * self.length_ms)


def share_of(folder):
    return pathlib.Path(os.environ.get("MOUTHPIECE_SHARE", folder.resolve().parent / "share/mouthpiece"))


def what_is_missing(folder):
    """Why lines cannot be timed; "" where they can."""
    share = share_of(folder)
    is_there = (share / "sample.corpus").exists() and (share / "default.face").exists() and shutil.which("festival")
    return "" if is_there else "no sample corpus (make it with `make data`), or no Festival: lines are not timed"


def lines_timed(folder, runs=5, lengths=(1, 3, 10), before=None):
    """A TimedLine for each of `lengths`, the least of so many runs, in turn with the synth `before`."""
    os.environ["MOUTHPIECE_SHARE"] = str(share_of(folder))
    programs = ([before] if before else []) + [folder / "synth"]
    with tempfile.TemporaryDirectory(prefix="line_time.") as out:
        for seconds in lengths:
            command = ["--quiet", "--text", text_of(seconds), "--out", out]
            took = {program: [] for program in programs}
            for _ in range(runs):
                for program in programs:
                    took[program].append(took_ms([program] + command))
            length_ms = 1000 * json.load(open(f"{out}/report.json"))["duration_s"]
            own, speech = (min(run[i] for run in took[programs[-1]]) for i in (0, 1))
            yield TimedLine(length_ms, own, speech, min(run[0] for run in took[before]) if before else None)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--before", type=pathlib.Path, help="another synth, spoken with in turn")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--lengths", type=float, nargs="+", default=[1, 3, 10])
    options = parser.parse_args()
    if missing := what_is_missing(options.bin):
        print(missing)
        return 77
    print("line       besides speech        of its length   limit   share of it   speech" +
          ("   before   ratio" if options.before else ""))
    for line in lines_timed(options.bin, options.runs, options.lengths, options.before):
        row = (f"{line.length_ms / 1000:6.2f} s   {line.own_ms:8.0f} ms   {line.own_ms / line.length_ms:18.3f}"
               f"   {line.limit_ms:5.0f} ms   {line.own_ms / line.limit_ms:9.2f}   {line.speech_ms:5.0f} ms")
        if options.before:
            row += f"   {line.before_ms:5.0f} ms   {line.own_ms / line.before_ms:5.2f}"
        print(row, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
