#!/usr/bin/env python3
"""Measures `synth --voice corpus` on sentences of GRID's grammar that the corpus does not hold, beside real takes.

tools/measure_corpus_voice.py X.corpus TAKES LEXICON [--synth build/bin/synth] [--count 20]

Needs numpy and pocketsphinx_continuous (Debian: python3-numpy pocketsphinx pocketsphinx-en-us). Prints one table:
  clicks   energy of the sound's derivative within 4 ms of a join over that within 25 ms around it, dB: median, 95th percentile;
           inside units the same at places as far from joins as that
  f0 jump  change of pitch over 20 ms across a join, semitones; inside units likewise
  words    share of the words that PocketSphinx hears with a grammar of that domain
"""
import argparse, json, pathlib, random, re, subprocess, sys, tempfile, wave
import numpy as np

COMMANDS = "bin lay place set".split()
COLOURS = "blue green red white".split()
PREPOSITIONS = "at by in with".split()
LETTERS = "a b c d e f g h i j k l m n o p q r s t u v x y z".split()
DIGITS = "zero one two three four five six seven eight nine".split()
ADVERBS = "again now please soon".split()
SLOTS = [COMMANDS, COLOURS, PREPOSITIONS, LETTERS, DIGITS, ADVERBS]


def new_sentences(takes, count):
    known = {" ".join(path.read_text().lower().split()) for path in takes.glob("*.txt")}
    rng = random.Random(1)
    found = ["place red at g nine again"]
    while len(found) < count + 1:
        words = " ".join(rng.choice(slot) for slot in SLOTS)
        if words not in known and words not in found:
            found.append(words)
    return found


def read(path):
    with wave.open(str(path)) as sound:
        rate = sound.getframerate()
        return rate, np.frombuffer(sound.readframes(sound.getnframes()), np.int16).astype(float) / 32768


def click_db(samples, rate, time):
    slope = np.diff(samples)
    at = int(time * rate)
    near, around = int(0.004 * rate), int(0.025 * rate)
    if at - around < 0 or at + around >= len(slope):
        return None
    return 10 * np.log10((np.mean(slope[at - near : at + near] ** 2) + 1e-12) / (np.mean(slope[at - around : at + around] ** 2) + 1e-12))


def pitch(samples, rate, time):
    """Autocorrelation over 40 ms; None where unvoiced."""
    half = int(0.02 * rate)
    at = int(time * rate)
    piece = samples[max(0, at - half) : at + half]
    if len(piece) < 2 * half:
        return None
    piece = piece - piece.mean()
    full = np.correlate(piece, piece, "full")[len(piece) - 1 :]
    if full[0] < 1e-4 * len(piece):
        return None
    low, high = int(rate / 300), int(rate / 65)
    window = full[low:high] / full[0] * len(piece) / (len(piece) - np.arange(low, high))
    best = int(np.argmax(window))
    return rate / (low + best) if window[best] > 0.6 else None


def f0_jump(samples, rate, time):
    before, after = pitch(samples, rate, time - 0.02), pitch(samples, rate, time + 0.02)
    return None if before is None or after is None else abs(12 * np.log2(after / before))


def hear(lines, folder):
    """lines: (wav, words). The share of words heard right, by edit distance."""
    grammar = folder / "grid.jsgf"
    dictionary = pathlib.Path("/usr/share/pocketsphinx/model/en-us/cmudict-en-us.dict").read_text()
    entries = set(re.findall(r"^(\S+)", dictionary, re.M))
    letter = {x: (f"{x}." if f"{x}." in entries else x) for x in LETTERS}
    rules = [" | ".join(letter[w] if slot is LETTERS else w for w in slot) for slot in SLOTS]
    grammar.write_text("#JSGF V1.0;\ngrammar grid;\npublic <line> = " + " ".join(f"({rule})" for rule in rules) + ";\n")
    wrong = total = 0
    for wav, words in lines:
        raw = folder / "line.wav"
        subprocess.run(["sox", wav, "-r", "16000", "-c", "1", "-b", "16", raw, "pad", "0.2", "0.2"], check=True)
        heard = subprocess.run(["pocketsphinx_continuous", "-infile", raw, "-jsgf", grammar, "-logfn", "/dev/null"], capture_output=True, text=True).stdout.split()
        heard = [word.rstrip(".") for word in heard]
        wanted = words.split()
        total += len(wanted)
        wrong += sum(a != b for a, b in zip(wanted, heard)) + abs(len(wanted) - len(heard))
    return 1 - wrong / total


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpus")
    parser.add_argument("takes", type=pathlib.Path)
    parser.add_argument("lexicon")
    parser.add_argument("--synth", default="build/bin/synth")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the sounds")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        keep = args.keep or folder
        keep.mkdir(parents=True, exist_ok=True)
        values = {name: ([], []) for name in ("click", "f0")}
        lines, units, backed_off = [], 0, 0
        for number, text in enumerate(new_sentences(args.takes, args.count)):
            wav, report = keep / f"{number}.wav", keep / f"{number}.json"
            subprocess.run([args.synth, "--quiet", "--corpus", args.corpus, "--lexicon", args.lexicon, "--voice", "corpus", "--text", text, "-o", wav, "-o", report], check=True)
            rate, samples = read(wav)
            facts = json.loads(report.read_text())
            units += len(facts["units"])
            backed_off += len(facts["backoff"])
            spans = [unit["sound"] for unit in facts["units"] if "sound" in unit]
            joins = [start for start, end in spans if start > 0]
            inside = [t for t in np.arange(0.1, len(samples) / rate - 0.1, 0.02) if all(abs(t - join) > 0.05 for join in joins)]
            for name, measure in (("click", click_db), ("f0", f0_jump)):
                for place, kept in zip((joins, inside), values[name]):
                    kept += [x for x in (measure(samples, rate, t) for t in place) if x is not None]
            lines.append((wav, text))
        takes = sorted(args.takes.glob("*.wav"))[:: max(1, len(list(args.takes.glob("*.wav"))) // len(lines))][: len(lines)]
        real = [(take, " ".join(take.with_suffix(".txt").read_text().lower().split())) for take in takes]
        print(f"{len(lines)} sentences, {units} units, {backed_off} backed off")
        for name, unit in (("click", "dB"), ("f0", "semitones")):
            for where, kept in zip(("joins", "inside units"), values[name]):
                print(f"{name:6} {where:13} median {np.median(kept):6.2f}  95 % {np.percentile(kept, 95):6.2f} {unit}  ({len(kept)})")
        print(f"words heard: corpus voice {100 * hear(lines, folder):.1f} %, real takes {100 * hear(real, folder):.1f} %")


if __name__ == "__main__":
    main()
