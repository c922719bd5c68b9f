#!/usr/bin/python3
"""Two long recordings, one twice as long, of which nobody knows the words: the memory that a minute more takes
(docs/performance.md). With --transcript they come with words, of which a third is not said, so that the network is to judge them.

    long_recording.py --bin build/bin [--transcript] [--most-mib-a-minute 2] [--most-mib 420] [--short-minutes 6] [--short-alone]

A sentence every half a minute, over a soft hiss: what is heard takes its time, what is kept grows with the whole sound.
Samples take 3.7 MiB a minute as numbers, 1.8 as they are heard; who holds both at once takes 5.5. Counted are the
program and its children (the network). Exits with 1 when a minute, or the whole, takes more than its bound. Exit status
77: there is no sample corpus.
"""
import argparse
import array
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import time
import wave

from line_memory import status_kib

RATE = 16000
LINES = ("She sells sea shells by the sea shore every morning.", "The birch canoe slid on the smooth planks.")


def children(pid):
    """Of all threads of a program."""
    found = []
    try:
        for thread in pathlib.Path(f"/proc/{pid}/task").iterdir():
            found += (thread / "children").read_text().split()
    except OSError:
        pass
    return found


def most_together(command):
    """Most memory of a program and its children at once, MiB."""
    program = subprocess.Popen(command)
    most = 0
    while program.poll() is None:
        most = max(most, sum(status_kib(pid, "VmRSS") for pid in [program.pid, *children(program.pid)]))
        time.sleep(0.02)
    if program.returncode != 0:
        sys.exit(f"{command[0]} failed: {program.returncode}")
    return most / 1024


def samples_of(path):
    with wave.open(str(path)) as file:
        if file.getframerate() != RATE:
            sys.exit(f"{path}: found {file.getframerate()} Hz; expected {RATE}")
        return array.array("h", file.readframes(file.getnframes()))


def words_of(minutes):
    """A line a sentence; of three in a row the third is not said."""
    lines = [LINES[half % len(LINES)] for half in range(2 * minutes)]
    lines[2::3] = ["Nobody knows the trouble of our yellow garages."] * len(lines[2::3])
    return "\n".join(lines)


def write_recording(path, sentences, minutes):
    draw = random.Random(1)
    hiss = array.array("h", (draw.randint(-6, 6) for _ in range(30 * RATE)))
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, RATE, 0, "NONE", ""))
        for half in range(2 * minutes):
            part = array.array("h", hiss)
            for i, sample in enumerate(sentences[half % len(sentences)]):
                part[5 * RATE + i] = max(-32768, min(32767, part[5 * RATE + i] + sample))
            file.writeframes(part.tobytes())


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--short-minutes", type=int, default=6)
    parser.add_argument("--short-alone", action="store_true", help="not the longer one, nor what a minute more takes")
    parser.add_argument("--transcript", action="store_true")
    parser.add_argument("--most-mib-a-minute", type=float, default=2)
    parser.add_argument("--most-mib", type=float, default=420)
    options = parser.parse_args()
    share = pathlib.Path(os.environ.get("MOUTHPIECE_SHARE", options.bin.resolve().parent / "share/mouthpiece"))
    if not (share / "sample.corpus").exists():
        print("no sample corpus: make it with `make data`")
        return 77
    synth = options.bin / "synth"
    with tempfile.TemporaryDirectory(prefix="long_recording.") as folder:
        folder = pathlib.Path(folder)
        sentences = []
        for text in LINES:
            subprocess.run([synth, "--text", text, "--voice", "flite:rms", "--quiet", "-o", folder / "said.wav"], check=True)
            sentences.append(samples_of(folder / "said.wav"))
        taken = []
        for minutes in (options.short_minutes,) if options.short_alone else (options.short_minutes, 2 * options.short_minutes):
            write_recording(folder / "long.wav", sentences, minutes)
            (folder / "words.txt").write_text(words_of(minutes))
            given = ["--transcript-file", folder / "words.txt"] if options.transcript else []
            taken.append(most_together([synth, "--audio", folder / "long.wav", *given, "--quiet", "-o", folder / "motion.csv"]))
            print(f"{minutes:3} minutes  {taken[-1]:6.1f} MiB with its children", flush=True)
        grows = (taken[-1] - taken[0]) / options.short_minutes
        print(f"{grows:.2f} MiB a minute")
    return 1 if grows > options.most_mib_a_minute or max(taken) > options.most_mib else 0


if __name__ == "__main__":
    sys.exit(main())
