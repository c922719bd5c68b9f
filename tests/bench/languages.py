#!/usr/bin/env python3
"""Times and lips in every tuned language, as a table in Markdown.

For each line of tests/data/language_lines.tsv eSpeak NG speaks it and tells when each phone begins; the same sound is
aligned with its text alone; the borders are compared. From the markers come the lips: whether they shut in the sounds
that shut them, and how round they are in the vowels that round them.

  tests/bench/languages.py --synth build/bin/synth [--only de] [--lines FILE]
"""
import argparse
import csv
import pathlib
import statistics
import subprocess
import tempfile
import wave

# What the sounds do is said here a second time, without the program's own table.
SHUT = set("pbmɓʙʘ")
ROUND_VOWELS = set("yʏøœuʊoɔʉɵɞ")
SPREAD_VOWELS = set("iɪeɛæaɨ")
ARPABET = {"P": "p", "B": "b", "M": "m", "UW": "u", "UH": "ʊ", "OW": "o", "AO": "ɔ", "IY": "i", "IH": "ɪ", "EY": "e",
           "EH": "ɛ", "AE": "æ", "AA": "ɑ"}


def read_grid(path):
    """Phones of a long TextGrid: (start, end, name)."""
    tier, phones, start, end = None, [], 0.0, 0.0
    for line in path.read_text(encoding="utf-8").splitlines():
        key, _, value = line.strip().partition(" = ")
        if key == "name":
            tier = value.strip('"')
        elif key == "xmin":
            start = float(value)
        elif key == "xmax":
            end = float(value)
        elif key == "text" and tier == "phones":
            phones.append((start, end, value[1:-1]))
    return phones


def is_silence(name):
    return name in ("", "sil")


def letter(name):
    return ARPABET.get(name, name)[0] if name else ""


def border_errors(truth, found):
    said = [p for p in truth if not is_silence(p[2])]
    heard = [p for p in found if not is_silence(p[2])]
    alike = sum(letter(a[2]) == letter(b[2]) for a, b in zip(said, heard))
    if len(said) != len(heard) or alike < 0.8 * len(said):
        return None
    errors = []
    for (a, b), (c, d) in zip(zip(said, said[1:]), zip(heard, heard[1:])):
        if abs(a[1] - b[0]) < 1e-6:  # no pause between them in truth
            errors.append(1000 * abs(b[0] - d[0]))
    return errors


def markers(path):
    with open(path, newline="", encoding="utf-8") as file:
        rows = csv.reader(file)
        head = next(rows)
        data = [[float(value) for value in row] for row in rows]
    place = {name: i for i, name in enumerate(head)}

    def point(row, name):
        return [row[place[f"{name}.{axis}"]] for axis in "xyz"]

    def apart(row, a, b):
        return sum((p - q) ** 2 for p, q in zip(point(row, a), point(row, b))) ** 0.5

    times = [row[0] for row in data]
    opening = [apart(row, "LIP_UP_MID", "LIP_LO_MID") for row in data]
    width = [apart(row, "LIP_CORNER_R", "LIP_CORNER_L") for row in data]
    return times, opening, width


def lips(phones, path):
    times, opening, width = markers(path)
    rest = opening[0]
    shut, round_widths, spread_widths = [], [], []
    for start, end, name in phones:
        if is_silence(name):
            continue
        # Lips lead the sound a little, and the burst comes when they are open again.
        inside = [i for i, t in enumerate(times) if start - 0.02 <= t <= end + 0.02]
        if not inside:
            continue
        if letter(name) in SHUT:
            shut.append(min(opening[i] for i in inside) <= rest + 1.0)
        middle = min(range(len(times)), key=lambda i: abs(times[i] - (start + end) / 2))
        if letter(name) in ROUND_VOWELS:
            round_widths.append(width[middle])
        elif letter(name) in SPREAD_VOWELS:
            spread_widths.append(width[middle])
    return shut, round_widths, spread_widths


def put_in_noise(path, level_db):
    """Puts pink noise under a sound of 16 bits, so far under its mean power."""
    import numpy

    with wave.open(str(path), "rb") as file:
        shape, sound = file.getparams(), numpy.frombuffer(file.readframes(file.getnframes()), numpy.int16).astype(float)
    spectrum = numpy.fft.rfft(numpy.random.default_rng(1).standard_normal(len(sound)))
    noise = numpy.fft.irfft(spectrum / numpy.sqrt(numpy.maximum(1, numpy.arange(len(spectrum)))), len(sound))
    both = sound + noise * 10 ** (-level_db / 20) * numpy.sqrt(numpy.mean(sound**2) / numpy.mean(noise**2))
    both *= 32000 / max(32000, numpy.max(numpy.abs(both)))
    with wave.open(str(path), "wb") as file:
        file.setparams(shape)
        file.writeframes(both.astype(numpy.int16).tobytes())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    root = pathlib.Path(__file__).resolve().parents[2]
    parser.add_argument("--synth", default=str(root / "build/bin/synth"))
    parser.add_argument("--lines", default=str(root / "tests/data/language_lines.tsv"))
    parser.add_argument("--only", default="", help="one language")
    parser.add_argument("--worst", action="store_true", help="the sounds whose borders are worst, too")
    parser.add_argument("--noise", type=float, help="dB from the sound that is aligned down to pink noise in it (numpy)")
    options = parser.parse_args()
    lines = {}
    for line in pathlib.Path(options.lines).read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            tag, text = line.split("\t")
            lines.setdefault(tag, []).append(text)
    print("| language | lines | borders | median ms | 90 % ms | lips shut | round narrower by mm |")
    print("|---|---|---|---|---|---|---|")
    failed = False
    for tag, texts in lines.items():
        if options.only and tag != options.only:
            continue
        voice = "espeak:" + tag.lower()
        errors, shut, rounds, spreads, other, worst = [], [], [], [], 0, {}
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            for text in texts:
                wav, truth, found, motion = (folder / name for name in ("a.wav", "a.TextGrid", "b.TextGrid", "m.csv"))
                run = [options.synth, "--voice", voice, "--text", text, "--quiet"]
                subprocess.run([*run, "-o", wav, "-o", truth, "-o", motion], check=True)
                if options.noise is not None:
                    put_in_noise(wav, options.noise)
                subprocess.run([options.synth, "--audio", wav, "--transcript", text, "--language", tag, "--quiet", "-o",
                                found], check=True)
                said = read_grid(truth)
                off = border_errors(said, read_grid(found))
                if off is None:
                    other += 1  # the words were pronounced otherwise (English: another dictionary)
                else:
                    errors += off
                    pairs = [p for p in said if not is_silence(p[2])]
                    joined = [b[2] for a, b in zip(pairs, pairs[1:]) if abs(a[1] - b[0]) < 1e-6]
                    for name, error in zip(joined, off):
                        worst.setdefault(name, []).append(error)
                closed, narrow, wide = lips(said, motion)
                shut += closed
                rounds += narrow
                spreads += wide
        errors.sort()
        median = statistics.median(errors) if errors else float("nan")
        ninety = errors[int(0.9 * (len(errors) - 1))] if errors else float("nan")
        narrower = statistics.mean(spreads) - statistics.mean(rounds) if rounds and spreads else float("nan")
        print(f"| {tag} | {len(texts) - other} of {len(texts)} | {len(errors)} | {median:.1f} | {ninety:.0f} | "
              f"{sum(shut)} of {len(shut)} | {narrower:.1f} |", flush=True)
        failed = failed or (errors and median > 20) or sum(shut) < len(shut) or narrower <= 0
        if options.worst:
            ranked = sorted(worst.items(), key=lambda item: -statistics.median(item[1]))
            print("  " + ", ".join(f"{name} {statistics.median(e):.0f} ({len(e)})" for name, e in ranked[:12]))
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
