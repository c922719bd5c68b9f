#!/usr/bin/python3
"""A typed line of three seconds with all its files: the memory and the processor time that it takes (docs/performance.md).

    line_memory.py --bin build/bin [--most-own-mib 70] [--most-mib 105] [--synth OTHER_SYNTH]

Told are the most that was resident (ru_maxrss, exact) and of it the program's own (RssAnon of /proc, looked at every half
a millisecond), which leaves out what is mapped of libraries and shared with other programs. Exits with 1 when either is
over its bound. The bounds leave room for other libraries and allocators, not for a matrix of every vertex of every frame.
The voice is Flite, since Festival is a program of its own. Exit status 77: there is no sample corpus.
"""
import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time

TEXT = "She sells sea shells by the sea shore every morning"


def status_kib(pid, name):
    """A size of a program's status, RssAnon or so; 0 when it has gone."""
    try:
        for line in open(f"/proc/{pid}/status"):
            if line.startswith(name + ":"):
                return int(line.split()[1])
    except OSError:
        pass
    return 0


def measured(command):
    """Most of its own memory and most in all, MiB; processor time, ms."""
    program = subprocess.Popen(command)
    most_own = 0
    while True:
        pid, status, usage = os.wait4(program.pid, os.WNOHANG)
        if pid != 0:
            break
        most_own = max(most_own, status_kib(program.pid, "RssAnon"))
        time.sleep(0.0005)
    program.returncode = os.waitstatus_to_exitcode(status)
    if program.returncode != 0:
        sys.exit(f"{command[0]} failed: {program.returncode}")
    return most_own / 1024, usage.ru_maxrss / 1024, 1000 * (usage.ru_utime + usage.ru_stime)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--synth", type=pathlib.Path, help="another one, which must find its corpus (MOUTHPIECE_SHARE)")
    parser.add_argument("--most-own-mib", type=float, default=70)
    parser.add_argument("--most-mib", type=float, default=105)
    parser.add_argument("--text", default=TEXT)
    parser.add_argument("--runs", type=int, default=3)
    options = parser.parse_args()
    share = pathlib.Path(os.environ.get("MOUTHPIECE_SHARE", options.bin.resolve().parent / "share/mouthpiece"))
    if not (share / "sample.corpus").exists() or not (share / "default.face").exists():
        print("no sample corpus: make it with `make data`")
        return 77
    synth = options.synth or options.bin / "synth"
    wrong = 0
    with tempfile.TemporaryDirectory(prefix="line_memory.") as folder:
        outputs = {"all files": ["--out", folder]}
        for name in ("speech.wav", "motion.csv", "face.glb", "view.html"):
            outputs[name] = ["-o", f"{folder}/one/{name}"]
        for name, output in outputs.items():
            command = [synth, "--text", options.text, "--voice", "flite:slt", "--quiet"] + output
            runs = [measured(command) for _ in range(options.runs)]
            own, whole, took = max(run[0] for run in runs), max(run[1] for run in runs), min(run[2] for run in runs)
            print(f"{name:10}  {own:6.1f} MiB of its own, {whole:6.1f} in all, {took:5.0f} ms of processor")
            wrong += own > options.most_own_mib or whole > options.most_mib
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
