#!/usr/bin/python3
"""Lets the n-th write, read, allocation or child of a run fail, and looks at what is left: as SQLite tests itself.

    inject.py --bin build/bin --share build/share/mouthpiece --shim build/faults.so [--all] [--only NAME] [--kind KIND]

Each case is a command with its outputs. It runs once to count its calls of a kind; then again and again, another call
failing each time (and, on a disk that stays full, all from there on). Whatever fails, a run ends with exit code 0 or 1
within its time, not by a signal; with 1 it prints one line and leaves the old outputs whole; with 0 its outputs are
those of an undisturbed run; and nothing else lies in its folders or in TMPDIR afterwards.

Writes, reads and children are few: each fails once. Allocations are a hundred thousands: the first 200 fail, then a
seeded sample. The ordinary suite takes a small sample of all; --all takes 2,000 allocations a case, all the rest, and
the cases that take seconds each.
Exit status 77: no sample data; 1: at least one run was not as it should be, each told with how to see it again.
"""
import argparse
import concurrent.futures
import errno
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import wave

ROOT = pathlib.Path(__file__).resolve().parents[2]
SEED = 19
PATIENCE_S = 120
SHORT_S = 1.2  # "the time is"
KINDS = ("write", "read", "allocation", "child")
ERRORS = {"write": (errno.ENOSPC, errno.EIO), "read": (errno.EIO,), "allocation": (errno.ENOMEM,),
          "child": (errno.EAGAIN,)}
OLD = b"what was here before\n"


class Case:
    """`arguments`: IN is the folder of inputs, OUT that of outputs. `outputs`: files under OUT. `varies`: those that
    hold times of their own making. `falls_back`: without a child it may do with less (another voice). `slow`: a run
    takes a second or more, so that fewer of its calls fail."""

    def __init__(self, program, arguments, outputs, varies=(), falls_back=False, nightly=False, slow=False):
        self.program, self.arguments, self.outputs = program, arguments, outputs
        self.varies, self.falls_back, self.nightly, self.slow = set(varies), falls_back, nightly, slow


SPEAK = ["--text", "the time is now", "--corpus", "clock", "--quiet"]
ALL_FILES = ["speech.wav", "motion.c3d", "motion.csv", "face.glb", "curves.json", "phones.TextGrid", "view.html", "report.json"]


def cases(share):
    def to(names):
        return [part for name in names for part in ("-o", "OUT/" + name)]

    flite = SPEAK + ["--voice", "flite:slt"]
    batch = [f"{line}.{kind}" for line in "ab" for kind in ("arkit.csv", "wav")]
    return {
        "speak": Case("synth", flite + to(["a.csv", "a.wav"]), ["a.csv", "a.wav"]),
        "speak_all": Case("synth", SPEAK + ["--out", "OUT"], ALL_FILES, ["report.json"], falls_back=True),
        "recorded": Case("synth", ["--audio", "IN/takes/take_01.wav", "--phones", "IN/takes/take_01.TextGrid",
                                   "--corpus", "clock", "--quiet", "-o", "OUT/a.arkit.csv"], ["a.arkit.csv"]),
        "heard": Case("synth", ["--audio", "IN/short.wav", "--hear", "phones", "--corpus", "clock", "--quiet", "-o",
                                "OUT/a.arkit.csv"], ["a.arkit.csv"], slow=True),
        "align": Case("corpus", ["align", "IN/short.wav", "--transcript", "the time is", "--quiet", "--out",
                                 "OUT/a.TextGrid"], ["a.TextGrid"]),
        "sing": Case("synth", ["--song", "IN/star.json", "--corpus", "clock", "--quiet"] + to(["a.csv", "a.wav"]),
                     ["a.csv", "a.wav"], falls_back=True),
        "build": Case("corpus", ["build", "IN/takes", "--out", "OUT/t.corpus", "--quiet", "--strict", "--jobs", "2"],
                      ["t.corpus"]),
        "convert": Case("corpus", ["convert", "IN/takes/take_01.c3d", "OUT/a.trc"], ["a.trc"]),
        "batch": Case("synth", ["batch", "IN/lines.csv", "--out", "OUT", "--voice", "flite:slt", "--corpus", "clock",
                                "--format", "arkit.csv,wav", "--quiet", "--jobs", "2"], batch),
        "apply": Case("retarget", ["apply", "--face", f"{share}/default.face", "--motion", "IN/motion.c3d", "--out",
                                   "OUT/a.glb"], ["a.glb"], nightly=True),
        "fit": Case("retarget", ["fit", "--mesh", f"{share}/default.obj", "--anchors", "IN/anchors.json", "--corpus",
                                 f"{share}/clock.corpus", "--out", "OUT/x.face", "--even-if-faulty", "--quiet"],
                    ["x.face"], nightly=True),
    }


def make_inputs(folder, binaries, takes):
    """Two takes of the clock and how one begins, a list of lines, a song, a motion, and the default face's landmarks as
    anchors."""
    folder.mkdir()
    if not (takes / "take_01.c3d").exists():
        takes = folder / "performed"
        subprocess.run([binaries / "corpus", "sample", takes, "--prompts", "clock", "--quiet"], check=True)
    (folder / "takes").mkdir()
    for file in sorted(takes.glob("take_0[12].*")):
        shutil.copy(file, folder / "takes")
    with wave.open(str(folder / "takes/take_01.wav")) as take, wave.open(str(folder / "short.wav"), "wb") as short:
        short.setparams(take.getparams())
        short.writeframes(take.readframes(int(SHORT_S * take.getframerate())))
    song = {"tempo": 120, "words": [{"word": "star", "notes": [{"pitch": "G3", "beats": 1}]}]}
    (folder / "star.json").write_text(json.dumps(song))
    subprocess.run([binaries / "synth", *SPEAK, "-o", folder / "motion.c3d"], check=True)
    (folder / "lines.csv").write_text("id,text\na,the time is now\nb,it is ten\n")
    markers = json.loads((ROOT / "sample_data/layouts/face66.json").read_text())["markers"]
    anchors = {"markers": {marker["name"]: marker["mediapipe_landmark"] for marker in markers}}
    (folder / "anchors.json").write_text(json.dumps(anchors))


class Trial:
    """One command run in folders of its own, over outputs that were there before."""

    def __init__(self, name, case, options, inputs):
        self.name, self.case, self.options, self.inputs = name, case, options, inputs

    def run(self, kind, at, error, always=False):
        """(exit code, standard error, outputs by name, what else lies there, calls counted)"""
        with tempfile.TemporaryDirectory(prefix="faults.") as place:
            place = pathlib.Path(place)
            out, temporary, count = place / "out", place / "tmp", place / "count"
            out.mkdir(), temporary.mkdir()
            for output in self.case.outputs if at else ():
                (out / output).parent.mkdir(parents=True, exist_ok=True)
                (out / output).write_bytes(OLD)
            environment = {**os.environ, "LD_PRELOAD": str(self.options.shim), "FAULT_KIND": kind, "FAULT_AT": str(at),
                           "FAULT_ERROR": str(error), "FAULT_COUNT": str(count), "TMPDIR": str(temporary)}
            if always:
                environment["FAULT_ALWAYS"] = "1"
            if self.options.trace:
                environment["FAULT_TRACE"] = str(self.options.trace)
            try:
                done = subprocess.run(self.command(out), env=environment, capture_output=True, timeout=PATIENCE_S)
                code, told = done.returncode, done.stderr.decode(errors="replace")
            except subprocess.TimeoutExpired:
                code, told = "none", f"still running after {PATIENCE_S} s"
            files = {str(path.relative_to(out)): path.read_bytes() for path in out.rglob("*") if path.is_file()}
            left = [f"TMPDIR/{path.relative_to(temporary)}" for path in temporary.rglob("*")]
            left += [name for name in files if pathlib.Path(name).name.startswith(".")]
            calls = int(count.read_text()) if count.exists() else 0
            return code, told, files, left, calls

    def command(self, out):
        def filled(argument):
            return argument.replace("IN/", f"{self.inputs}/") if argument.startswith("IN/") else (
                str(out) + argument[3:] if argument == "OUT" or argument.startswith("OUT/") else argument)

        return [str(self.options.bin / self.case.program)] + [filled(a) for a in self.case.arguments]

    def faults_of(self, kind, at, error, always, sound):
        """What is wrong with the run whose `at`-th call fails; `sound`: outputs of an undisturbed one."""
        code, told, files, left, _ = self.run(kind, at, error, always)
        wrong = []
        # FFTW itself ends the program when it finds no memory: the old outputs must be whole all the same.
        ended_by_fftw = kind == "allocation" and code == -signal.SIGABRT and told.startswith("fftw: alloc.c")
        if code not in (0, 1) and not ended_by_fftw:
            wrong.append(f"exit code {code}")
        if ended_by_fftw:
            wrong += [f"{name} is not the old one" for name in self.case.outputs if not self.is_whole(name, files, sound)]
            left = []
        if code == 1:
            lines = told.splitlines()
            # A library in C that finds no memory says so first.
            most = 2 if kind == "allocation" else 1
            if not 1 <= len(lines) <= most or not lines[-1].startswith(self.case.program + ": "):
                wrong.append("not one line on standard error")
            wrong += [f"{name} is not the old one" for name in self.case.outputs if not self.is_whole(name, files, sound)]
        if code == 0:
            wrong += [f"{name} is not there" for name in self.case.outputs if name not in files]
            may_differ = self.case.falls_back and kind != "write"
            wrong += [f"{name} is another" for name in self.case.outputs
                      if name in files and name not in self.case.varies and not may_differ and files[name] != sound[name]]
        # Without any memory folders in TMPDIR cannot be cleared; the next start sweeps them.
        wrong += [f"{name} was left" for name in left if not (kind == "allocation" and always and name.startswith("TMPDIR/"))]
        return f"{', '.join(wrong)}: {told.strip()[:300]}" if wrong else None

    def is_whole(self, name, files, sound):
        """The old bytes; a batch keeps the lines that it has made, so that the next goes on from there."""
        return files.get(name) == OLD or ("batch" in self.case.arguments and files.get(name) == sound[name])


def chosen(kind, calls, options, slow, random_source):
    """Which calls are to fail."""
    few, some = (2, 3) if slow else (6, 10)
    allocations = options.allocations // 10 if slow else options.allocations

    def sample(first, last, most):
        numbers = range(first, last + 1)
        return list(numbers) if len(numbers) <= most else sorted(random_source.sample(numbers, most))

    if kind != "allocation":
        return sample(1, calls, calls if options.all else few)
    first = min(calls, 200)
    return sample(1, first, first if options.all else few) + sample(first + 1, calls, allocations if options.all else some)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--share", type=pathlib.Path, required=True)
    parser.add_argument("--shim", type=pathlib.Path, required=True)
    parser.add_argument("--takes", type=pathlib.Path, default=ROOT / "build/clock_takes")
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--allocations", type=int, default=2000, help="of a case, after the first 200, with --all")
    parser.add_argument("--only")
    parser.add_argument("--kind", choices=KINDS)
    parser.add_argument("--at", type=int, help="this call alone")
    parser.add_argument("--trace", type=pathlib.Path, help="where the failing call's origin is written; with --at")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    options.bin, options.shim, share = options.bin.resolve(), options.shim.resolve(), options.share.resolve()
    if not (share / "clock.corpus").exists() or not (share / "default.face").exists():
        print("no sample corpus; make it with `make data`")
        return 77
    failures = 0
    with tempfile.TemporaryDirectory(prefix="fault_inputs.") as place:
        inputs = pathlib.Path(place) / "in"
        make_inputs(inputs, options.bin, options.takes)
        for name, case in cases(share).items():
            if (options.only and name != options.only) or (case.nightly and not options.all and not options.only):
                continue
            trial = Trial(name, case, options, inputs)
            for kind in (options.kind,) if options.kind else KINDS:
                failures += inject(trial, kind, options)
    print(f"{failures} runs were not as they should be" if failures else "every run was as it should be")
    return 1 if failures else 0


def inject(trial, kind, options):
    code, told, sound, _, calls = trial.run(kind, 0, 0)
    assert code == 0, f"{trial.name} fails undisturbed: {told}"
    source = random.Random(f"{SEED} {trial.name} {kind}")
    numbers = [options.at] if options.at else chosen(kind, calls, options, trial.case.slow, source)
    errors = ERRORS[kind]
    # A full disk stays full, and a machine out of memory too: every fourth run has all later calls fail as well.
    runs = [(at, errors[i % len(errors)], i % 4 == 3 and kind in ("write", "allocation")) for i, at in enumerate(numbers)]
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        results = list(pool.map(lambda run: trial.faults_of(kind, *run, sound), runs))
    wrong = [(run, result) for run, result in zip(runs, results) if result]
    print(f"{trial.name:10} {kind:10} {len(runs):5} of {calls:7} calls failed, {len(wrong)} not as they should be", flush=True)
    for (at, error, always), result in wrong[:10]:
        print(f"  --only {trial.name} --kind {kind} --at {at} ({errno.errorcode[error]}{', then all' if always else ''}): {result}",
              flush=True)
    return len(wrong)


if __name__ == "__main__":
    sys.exit(main())
