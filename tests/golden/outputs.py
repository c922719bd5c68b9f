#!/usr/bin/python3
"""What the programs make, held against what they made before: motion to a micrometre, the rest by value.

    outputs.py --bin build/bin --reference tests/golden/outputs [--update] [--only NAME]

Each case runs a program and boils its files down to a digest, a small JSON: texts by hash, numbers by their count and
by eight sums with pseudo-random signs, so that a reference stays small. Numbers that differ by x (root mean square)
make sums that differ by about x times the root of their count, so that is what a sum may be off: processors differ in
the last bits of a float's root and the corpus' networks learn from them, which moves lips by about 0.1 micrometres.
`--update` writes the references anew; do that only for a change that an issue asks for, and say so in the commit.
The sample corpora and the face must be what these programs make: they may not be older than `corpus`.
Exit status 77: nothing could be run (no sample corpus); cases that need ../shared are named when they are left out.
"""
import argparse
import functools
import hashlib
import json
import math
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile

import numpy

ROOT = pathlib.Path(__file__).resolve().parents[2]
GRID = ROOT.parent / "shared/capture/grid_s1/takes"
SUMS = 8
MOTION_MM = 1e-3  # a micrometre, root mean square
VALUE, ROUNDED = 1e-3, 2e-3  # of a field's own root mean square; and what rounding to four places may do to a sum
SETTING = 5e-3  # of a number in a text, which is given with three digits
GEOMETRY_M = 1e-3  # a micrometre of a file in millimetres, root mean square over a cache's numbers
POSED_M, POSED_NORMAL = 1e-5, 0.01  # of a GLB's posed vertices, each within 0.09 mm of the full motion

LINES = {
    "now": ["--text", "the time is now"],
    "clock": ["--text", "the time is now exactly twenty five past seven in the evening", "--fps", "120"],
    "greedy": ["--text", "the time is now almost quarter past six in the morning", "--select", "greedy"],
    "paper": ["--text", "the time is now just after half past eleven pm", "--units", "paper", "--select", "greedy"],
    "backed_off": ["--text", "seven lazy foxes jumped over my garden wall, didn't they?"],
    "numbers": ["--text", "In 1984, 3.5 million people paid $20 at 10:45."],
    "viseme": ["--text", "measure the garage with a yellow ruler", "--backoff", "viseme"],
    "curves": ["--text", "bob put five pumpkins above my mother's wolf", "--style", "speech"],
    "flite": ["--text", "almost ten past two", "--voice", "flite:slt", "--blend", "linear", "--overlap-ms", "30"],
    "own_voice": ["--text", "the time is now almost ten past nine in the morning", "--voice", "corpus"],
    "styled": ["--text", "good evening", "--voice", "espeak:en-us", "--style", "sing", "--ma", "0.5", "--ja", "1.3"],
}
SONGS = {"twinkle": ["--song", "sample_data/songs/twinkle.json"], "gloria": ["--song", "sample_data/songs/gloria.json"]}
RECORDED = {
    "said_again": ["--audio", "{now}/speech.wav", "--transcript", "the time is now"],
    "labelled_again": ["--audio", "{clock}/speech.wav", "--phones", "{clock}/phones.TextGrid"],
    "sung_again": ["--audio", "{twinkle}/speech.wav", "--lyrics", "{lyrics}"],
}
REAL = {
    "grid_labels": ["--audio", f"{GRID}/bbaf2n.wav", "--phones", f"{GRID}/bbaf2n.TextGrid"],
    "grid_words": ["--audio", f"{GRID}/bbal7s.wav", "--transcript", "bin blue at l seven soon"],
}
BATCH = 'id,text\nfirst,the time is now\nsecond,"good evening, and welcome"\nthird,almost ten past two\n'
LYRICS = "Twinkle twinkle little star, how I wonder what you are\n"
NOT_COMPARED = ("timing_ms", "real_time_factor", "path", "version", "generator")
NOT_OF_MANIFESTS = ("made_with", "mouthpiece", "corpus", "face", "mesh", "hash", "bytes")  # hashes of learnt floats, sizes


@functools.cache
def hashes(count):
    """A byte for each of `count` numbers, the same on every machine (splitmix64's finalizer)."""
    with numpy.errstate(over="ignore"):
        x = (numpy.arange(1, count + 1, dtype=numpy.uint64) * numpy.uint64(0x9E3779B97F4A7C15))
        x = (x ^ (x >> numpy.uint64(30))) * numpy.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> numpy.uint64(27))) * numpy.uint64(0x94D049BB133111EB)
        return (x ^ (x >> numpy.uint64(31))).astype(numpy.uint8)


def signed_sums(values, sums):
    """Each bit of a number's hash is its sign in one of SUMS sums; numbers of the same signs are added up first."""
    of_hash = numpy.bincount(hashes(1 << max(20, int(values.size).bit_length()))[:values.size], values, 256)
    bits = numpy.arange(256)[None, :] >> numpy.arange(sums)[:, None] & 1
    return (2.0 * bits - 1.0) @ of_hash


def digest_numbers(values, each, sums=SUMS):
    """`each` is by how much a number may be off, root mean square."""
    values = numpy.asarray(values, dtype=float).ravel()
    return {"count": int(values.size), "sums": [round(s, 7) for s in signed_sums(values, sums)],
            "tolerance": float(f"{each * math.sqrt(max(1, values.size)):.3g}")}


def digest_fields(values, share):
    size = numpy.sqrt(numpy.mean(numpy.square(numpy.asarray(values, dtype=float))))
    return digest_numbers(values, share * size + ROUNDED, 3)


def digest_text(text):
    return {"sha256": hashlib.sha256(text if isinstance(text, bytes) else text.encode()).hexdigest()[:24]}


def flatten(value, path, numbers, texts, left_out):
    if isinstance(value, dict):
        for key, each in value.items():
            if key not in left_out:
                flatten(each, f"{path}.{key}", numbers, texts, left_out)
    elif isinstance(value, list):
        for each in value:
            flatten(each, path + "[]", numbers, texts, left_out)
    elif isinstance(value, str) and re.fullmatch(r"-?\d+\.\d+", value):
        numbers.setdefault(path + "~", []).append(float(value))
    elif isinstance(value, bool) or value is None or isinstance(value, str):
        texts.setdefault(path, []).append(str(value))
    else:
        numbers.setdefault(path, []).append(value)


def digest_json(tree, left_out=NOT_COMPARED):
    numbers, texts = {}, {}
    flatten(tree, "", numbers, texts, left_out)
    digest = {path: digest_fields(values, SETTING if path.endswith("~") else VALUE) for path, values in numbers.items()}
    digest.update({path + "=": digest_text("\n".join(values)) for path, values in texts.items()})
    return digest


def digest_csv(path, tolerance):
    rows = path.read_text().splitlines()
    numbers, texts = [], [rows[0]]
    for cell in (cell for row in rows[1:] for cell in row.split(",")):
        try:
            numbers.append(float(cell))
        except ValueError:
            texts.append(cell)
    return {"rows": len(rows), "texts": digest_text("\n".join(texts)),
            "values": digest_numbers(numpy.nan_to_num(numbers, nan=-1e4), tolerance)}


def digest_glb(path):
    """The posed mesh of at most forty frames. Not the shapes that make it: which vertices get shapes of their own, once
    the others are within the tolerance, hangs on the last bit of a float, and so on the processor."""
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    tree = json.loads(data[20:20 + length])
    binary = data[20 + length + 8:]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
    kinds = {5121: numpy.uint8, 5123: numpy.uint16, 5125: numpy.uint32, 5126: numpy.float32}

    def stored(part, kind, count):
        start = tree["bufferViews"][part["bufferView"]].get("byteOffset", 0) + part.get("byteOffset", 0)
        return numpy.frombuffer(binary, kinds[kind], count, start)

    def accessor(index):
        given = tree["accessors"][index]
        columns = width[given["type"]]
        values = numpy.zeros((given["count"], columns))
        if "bufferView" in given:
            values[:] = stored(given, given["componentType"], values.size).reshape(-1, columns)
        if "sparse" in given:
            sparse = given["sparse"]
            rows = stored(sparse["indices"], sparse["indices"]["componentType"], sparse["count"])
            values[rows] = stored(sparse["values"], given["componentType"], sparse["count"] * columns).reshape(-1, columns)
        return values

    digest = {"names": digest_text(" ".join(node.get("name", "") for node in tree["nodes"]))}
    weights = accessor(tree["animations"][0]["samplers"][0]["output"]).ravel()
    for key, tolerance in (("POSITION", POSED_M), ("NORMAL", POSED_NORMAL)):
        posed = []
        for part in tree["meshes"][0]["primitives"]:
            frames = weights.reshape(-1, len(part["targets"]))
            frames = frames[::max(1, len(frames) // 40)][:40]
            shapes = numpy.array([accessor(target[key]) for target in part["targets"]])
            posed.append((accessor(part["attributes"][key]) + numpy.tensordot(frames, shapes, 1)).ravel())
        digest[key] = digest_numbers(numpy.concatenate(posed), tolerance)
    return digest


def digest_sound(path):
    data = path.read_bytes()
    return digest_text(data[data.index(b"data") + 8:])


def digest_folder(folder):
    digest = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.name == "manifest.json":
            digest[name] = digest_json(json.loads(path.read_text()), NOT_COMPARED + NOT_OF_MANIFESTS)
        elif path.name.startswith("manifest."):
            digest[name] = {"is": "there"}
        elif path.suffix == ".csv":
            digest[name] = digest_csv(path, MOTION_MM)
        elif path.suffix == ".json":
            digest[name] = digest_json(json.loads(path.read_text()))
        elif path.suffix == ".glb":
            digest[name] = digest_glb(path)
        elif path.suffix == ".wav":
            digest[name] = digest_sound(path)
        elif path.suffix in (".TextGrid", ".obj"):
            numbers = re.findall(r"-?\d+\.\d+(?:e-?\d+)?", path.read_text())
            digest[name] = {"numbers": digest_fields([float(n) for n in numbers], 0),
                            "rest": digest_text(re.sub(r"-?\d+\.\d+(?:e-?\d+)?", "#", path.read_text()))}
        elif path.suffix in (".pc2", ".mdd"):
            values = numpy.frombuffer(path.read_bytes()[32:], "<f4" if path.suffix == ".pc2" else ">f4")
            digest[name] = digest_numbers(values, GEOMETRY_M)
        elif path.is_file():
            digest[name] = {"is": "there"}
    return digest


def differences(now, before, path=""):
    """Lines that say what is not as it was."""
    if "sums" in before:
        if now.get("count") != before["count"]:
            return [f"{path}: {now.get('count')} numbers, there were {before['count']}"]
        worst = max((abs(a - b) for a, b in zip(now["sums"], before["sums"])), default=0)
        return [f"{path}: a sum is {worst:.3g} off, {before['tolerance']:.3g} allowed"] \
            if not worst <= before["tolerance"] else []
    lines = []
    for key in sorted(set(now) | set(before)):
        if key not in now or key not in before:
            lines.append(f"{path}/{key}: {'is gone' if key not in now else 'is new'}")
        elif isinstance(before[key], dict):
            lines += differences(now[key], before[key], f"{path}/{key}")
        elif now[key] != before[key]:
            lines.append(f"{path}/{key}: {now[key]}, was {before[key]}")
    return lines


class Runner:
    def __init__(self, arguments, folder):
        self.bin, self.share, self.folder, self.only = arguments.bin, shared_files(arguments.bin), folder, arguments.only
        self.digests, self.failures = {}, []

    def run(self, program, *arguments):
        done = subprocess.run([self.bin / program, *arguments], cwd=ROOT, capture_output=True, text=True)
        if done.returncode != 0:
            self.failures.append(f"{program} {' '.join(map(str, arguments))}: {done.stderr.strip()[:500]}")
        return done.returncode == 0

    def case(self, name, program, *arguments, made=None):
        """Runs a program whose files land in the case's folder."""
        if self.only and name not in self.only:
            return
        (self.folder / name).mkdir(exist_ok=True)
        if self.run(program, *arguments):
            self.digests[name] = digest_folder(made or self.folder / name)

    def all(self):
        at = self.folder
        (at / "lyrics.txt").write_text(LYRICS)
        (at / "lines.csv").write_text(BATCH)
        places = {"lyrics": at / "lyrics.txt", **{name: at / name for name in (*LINES, *SONGS)}}
        for name, line in {**LINES, **SONGS, **RECORDED, **(REAL if GRID.exists() else {})}.items():
            self.case(name, "synth", *[word.format(**places) for word in line], "--out", at / name, "--quiet")
        if not GRID.exists():
            print(f"left out, for want of ../shared: {' '.join(REAL)}")
        self.case("batch", "synth", "batch", at / "lines.csv", "--out", at / "batch", "--quiet")
        self.case("curve_files", "synth", "--text", "good evening", "--quiet", "-o", at / "curve_files/curves.csv",
                  "-o", at / "curve_files/a.curve_frames.csv", "-o", at / "curve_files/a.c3d")
        self.case("aligned", "corpus", "align", at / "now/speech.wav", "--transcript", "the time is now", "--quiet",
                  "--out", at / "aligned/a.TextGrid")
        self.case("tagged", "corpus", "tag", at / "gloria/speech.wav", "--out", at / "tagged/tags.json", "--quiet")
        self.case("converted", "corpus", "convert", at / "now/motion.c3d", at / "converted/motion.csv", "--quiet")
        face = self.share / "default.face"
        for name in ("a.pc2", "a.mdd", "a.glb"):
            self.case("applied_" + name, "retarget", "apply", "--face", face, "--motion", at / "now/motion.c3d",
                      "--out", at / ("applied_" + name) / name)
        self.case("default_face", "retarget", "sample", "--out", at / "default_face", "--quiet",
                  "--canonical", self.share.parent.parent / "third_party/canonical_face.obj", "--corpus",
                  self.share / "clock.corpus")


def shared_files(bin):
    """What the programs find beside themselves."""
    return bin.parent / "share/mouthpiece"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build/bin")
    parser.add_argument("--reference", type=pathlib.Path, default=ROOT / "tests/golden/outputs")
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--keep", type=pathlib.Path, help="leave what was made in this folder")
    arguments = parser.parse_args()
    arguments.bin = arguments.bin.resolve()
    share = shared_files(arguments.bin)
    if not (share / "sample.corpus").exists():
        print(f"no sample corpus in {share}: run `make data`")
        return 77
    for name in ("sample.corpus", "clock.corpus", "default.face"):
        if (share / name).stat().st_mtime < (arguments.bin / "corpus").stat().st_mtime:
            print(f"{share / name} is older than the program `corpus`: run `make data`")
            return 1
    folder = arguments.keep or pathlib.Path(tempfile.mkdtemp(prefix="mouthpiece_outputs_"))
    folder.mkdir(parents=True, exist_ok=True)
    try:
        runner = Runner(arguments, folder.resolve())
        runner.all()
    finally:
        if not arguments.keep:
            shutil.rmtree(folder)
    lines = list(runner.failures)
    arguments.reference.mkdir(exist_ok=True)
    for name, digest in runner.digests.items():
        reference = arguments.reference / (name + ".digest.json")
        if arguments.update:
            reference.write_text(json.dumps(digest, separators=(",", ":"), sort_keys=True) + "\n")
        elif not reference.exists():
            lines.append(f"{name}: has no reference; make it with --update")
        else:
            lines += differences(digest, json.loads(reference.read_text()), name)
    for line in lines:
        print(line)
    print(f"{len(runner.digests)} outputs {'written' if arguments.update else 'compared'}, {len(lines)} differences")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
