#!/usr/bin/python3
"""What a stream of sound takes as it goes on (docs/performance.md).

    stream_memory.py --bin build/bin [--minutes 3] [--most-growth 0.05]

A sentence again and again, with pauses, on standard input; frames are pulled as they are known. Memory of the program and
its children (the network) is read every second of sound. Exits with 1 when its most in the last quarter is over that in
the second by more than the growth. Exit status 77: there is no sample corpus.
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile

from line_memory import status_kib
from long_recording import LINES, RATE, children, samples_of


def memory_mib(pid):
    return sum(status_kib(one, "VmRSS") for one in [pid, *children(pid)]) / 1024


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--bin", type=pathlib.Path, required=True)
    arguments.add_argument("--minutes", type=int, default=3)
    arguments.add_argument("--most-growth", type=float, default=0.05)
    given = arguments.parse_args()
    synth = given.bin / "synth"
    if not (given.bin.parent / "share/mouthpiece/sample.corpus").exists():
        print("no sample corpus: run `make data`")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        said = pathlib.Path(folder) / "said.wav"
        subprocess.run([synth, "--text", LINES[0], "-o", said, "--voice", "flite:rms", "-q"], check=True)
        sound = samples_of(said)
        sound.extend([0] * (-len(sound) % RATE + RATE))
    seconds = len(sound) // RATE
    stream = subprocess.Popen([synth, "--stream", "--as", "rows", "-q"], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL)
    memory = []
    for second in range(60 * given.minutes):
        at = second % seconds * RATE
        stream.stdin.write(sound[at:at + RATE].tobytes())
        stream.stdin.flush()
        memory.append(memory_mib(stream.pid))
    stream.stdin.close()
    if stream.wait() != 0:
        sys.exit(f"{synth} failed: {stream.returncode}")
    quarter = len(memory) // 4
    before, after = max(memory[quarter:2 * quarter]), max(memory[-quarter:])
    print(f"{given.minutes} minutes of sound: {before:.1f} MiB in the second quarter, {after:.1f} in the last")
    return 1 if after > (1 + given.most_growth) * before else 0


if __name__ == "__main__":
    sys.exit(main())
