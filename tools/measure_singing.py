#!/usr/bin/env python3
"""Measures notes and vibrato that `corpus tag` hears in people's singing whose melody is known.

tools/measure_singing.py SINGING_VOWELS SONGS [--as-sung | --uneven] [--singers A,B] [--corpus build/bin/corpus] [--phones] [--json]

The syllables of ../shared/singing_vowels, each sung on one pitch with its vowel marked by hand, are sung again to a made-up melody by
Praat (overlap-add of their own periods, so timbre, consonants and small wavering stay the person's): new pitches, one in four as before,
vowels of 0.25 to 1.2 s, scoops into notes, melismas of two to five notes, vibrato of 5 to 8 Hz in some held notes that grows and is uneven from
swing to swing. With --as-sung they stay as they were recorded: a note a syllable. SONGS keeps
what was made (NAME.wav, NAME.json, NAME.TextGrid). Needs praat and ffmpeg. What nobody marked is not judged. Prints, for each singer and in all:
  onsets            F1 of notes' starts, each counted when within 50 ms of one not yet taken
  offsets           F1 of their ends, within 50 ms or a fifth of the note, as MIREX counts (a mark ends where the next syllable fades in)
  notes             F1 of onsets whose pitch is within half a semitone, too
  vibrato           F1 of stretches (half of their union shared), precision and recall of frames of 10 ms
With --phones the program is given the vowels' times (NAME.TextGrid), without it finds all by itself.
"""
import argparse, bisect, collections, csv, json, math, pathlib, random, subprocess, sys, wave

RATE_HZ = 1000  # of the table of offsets that Praat reads
FULL_SCALE = 24  # semitones that a sample of 1 stands for
NEAR_S = 0.05
ONSET_S = 0.03  # a marked vowel is steady from so long after its onset, and so long before its end


def syllables(rows):
    """Start, end and vowel of what was marked."""
    return [(float(r["start_s"]) - ONSET_S, float(r["end_s"]) + ONSET_S, r["label"]) for r in rows if r["label"] in set("AEIOU")]


def unmarked(rows):
    """Stretches that nobody marked, longer than a border: there may be another syllable, or the last one's end."""
    spans = [(float(r["start_s"]) + ONSET_S, float(r["end_s"]) - ONSET_S) for r in rows if r["label"] == "-"]
    return [(a, b) for a, b in spans if b - a > ONSET_S]


def step(t, middle, length):
    """From 0 to 1 over `length` around `middle`."""
    x = min(1, max(0, (t - middle) / length + 0.5))
    return x * x * (3 - 2 * x)


class Song:
    """One file sung again: its map of time, and its pitch in semitones from what it was."""

    def __init__(self, vowels, length, rng, is_uneven=False):
        self.is_uneven = is_uneven
        self.knots = [(0.0, 0.0)]  # source, target
        self.notes, self.vibrato, self.swings, self.spans = [], [], [], []
        self.steps = []  # target time, length, semitones from there on
        last_end, pitch = 0.0, None
        for start, end, vowel in vowels:
            if start < last_end + 0.01:
                continue
            self.knots.append((start, self.knots[-1][1] + start - last_end))
            wanted = math.exp(rng.uniform(math.log(0.25), math.log(1.2)))
            stretch = min(3, max(0.6, wanted / (end - start)))
            at, until = self.knots[-1][1], self.knots[-1][1] + stretch * (end - start)
            self.knots.append((end, until))
            self.spans.append((at, until, vowel))
            pitch = self.sing(at, until, pitch, rng)
            last_end = end
        self.knots.append((length, self.knots[-1][1] + length - last_end))

    def sing(self, at, until, before, rng):
        length = until - at
        first = before if before is not None and rng.random() < 0.25 else rng.choice([-5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5])
        pitches = [first]
        if length > 0.5 and rng.random() < 0.35:
            for _ in range(rng.randint(1, min(4, int(length / 0.14) - 1))):
                pitches.append(pitches[-1] + rng.choice([-4, -3, -2, -1, 1, 2, 3, 4]))
        edges = [at + length * i / len(pitches) for i in range(len(pitches) + 1)]
        if before is None:
            self.steps.append((at, 1e-3, first))
        else:
            self.steps.append((at - 0.02, rng.uniform(0.04, 0.12), first - before))
        if rng.random() < 0.3:
            scoop = rng.uniform(0.5, 2)
            self.steps += [(at - 0.02, 0.03, -scoop), (at + rng.uniform(0.03, 0.07), rng.uniform(0.08, 0.15), scoop)]
        for i in range(1, len(pitches)):
            self.steps.append((edges[i], rng.uniform(0.04, 0.1), pitches[i] - pitches[i - 1]))
        self.notes += [(edges[i], edges[i + 1], pitches[i]) for i in range(len(pitches))]
        if edges[-1] - edges[-2] > 0.5 and rng.random() < 0.6:
            self.swing(edges[-2] + rng.uniform(0.15, 0.4) * (edges[-1] - edges[-2]), edges[-1] - 0.03, rng)
        return pitches[-1]

    def swing(self, start, end, rng):
        slowest, fastest, least, most = (4.9, 7.6, 0.25, 1.2) if self.is_uneven else (5.4, 7.4, 0.3, 1.1)
        of_time, of_depth = (0.11, 0.3) if self.is_uneven else (0.06, 0.15)
        rate, depth = min(fastest, max(slowest, rng.gauss(6.1, 0.7 if self.is_uneven else 0.5))), rng.uniform(least, most)
        times, at, sign = [], start, 1
        while at < end:
            half = 0.5 / rate * math.exp(rng.gauss(0, of_time))
            times.append((at, min(end, at + half), sign * depth * math.exp(rng.gauss(0, of_depth)) * min(1, 0.4 + (at - start) / 0.3)))
            at, sign = at + half, -sign
        if self.is_uneven:  # and the note drifts
            for _ in range(2):
                self.steps.append((rng.uniform(start, end), rng.uniform(0.3, 0.7), rng.gauss(0, 0.4)))
        if len(times) < 4:
            return
        self.vibrato.append((start, times[-1][1]))
        self.swings += times

    def target(self, source):
        i = min(len(self.knots) - 1, max(1, bisect.bisect_left(self.knots, (source, 0))))
        (a, b), (c, d) = self.knots[i - 1], self.knots[i]
        return b + (source - a) * (d - b) / (c - a) if c > a else b

    def offset(self, source):
        t = self.target(source)
        value = sum(size * step(t, middle, length) for middle, length, size in self.steps)
        for start, end, depth in self.swings:
            if start <= t < end:
                value += depth * math.sin(math.pi * (t - start) / (end - start))
        return value


SCRIPT = """
form x
  sentence sound
  sentence offsets
  sentence durations
  sentence out
endform
off = Read from file: offsets$
Rename: "off"
duration = Read from file: durations$
s = Read from file: sound$
m = To Manipulation: 0.005, 75, 800
p = Extract pitch tier
Formula: "self * 2 ^ (24 * Sound_off(x) / 12)"
selectObject: m, p
Replace pitch tier
selectObject: m, duration
Replace duration tier
selectObject: m
r = Get resynthesis (overlap-add)
Save as WAV file: out$
"""


def sing_again(audio, vowels, folder, name, rng, is_uneven):
    wav = folder / (name + ".source.wav")
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", audio, wav], check=True)
    with wave.open(str(wav)) as sound:
        length = sound.getnframes() / sound.getframerate()
    song = Song(vowels, length, rng, is_uneven)
    with wave.open(str(folder / "offsets.wav"), "wb") as table:
        table.setparams((1, 2, RATE_HZ, 0, "NONE", ""))
        for i in range(int(length * RATE_HZ) + 1):
            table.writeframesraw(int(32767 * max(-1, min(1, song.offset(i / RATE_HZ) / FULL_SCALE))).to_bytes(2, "little", signed=True))
    points = []
    for (a, b), (c, d) in zip(song.knots, song.knots[1:]):
        if c > a:
            points += [(a + 1e-4, (d - b) / (c - a)), (c - 1e-4, (d - b) / (c - a))]
    tier = ['File type = "ooTextFile"', 'Object class = "DurationTier"', "", "0", str(length), str(len(points))]
    (folder / "durations.DurationTier").write_text("\n".join(tier + [f"{t}\n{v}" for t, v in points]) + "\n")
    (folder / "again.praat").write_text(SCRIPT)
    subprocess.run(["praat", "--run", folder / "again.praat", wav, folder / "offsets.wav", folder / "durations.DurationTier",
                    folder / (name + ".wav")], check=True, stdout=subprocess.DEVNULL)
    wav.unlink()
    return song, song.knots[-1][1]


ARPABET = dict(A="AA", E="EH", I="IY", O="AO", U="UW")


def text_grid(spans, length):
    """The vowels, with an N between them where they do not touch and silence outside."""
    rows, at = [], 0.0
    for start, end, vowel in spans:
        if start > at + 1e-3:
            rows.append((at, start, "N" if rows else "sil"))
        rows.append((max(at, start), end, ARPABET[vowel]))
        at = end
    rows.append((at, length, "sil"))
    tiers = []
    for tier in ("words", "phones"):
        cells = [(a, b, ("" if p == "sil" else p.lower()) if tier == "words" else p) for a, b, p in rows]
        tiers += ['"IntervalTier"', f'"{tier}"', "0", f"{length:.6f}", str(len(cells))]
        tiers += [f'{a:.6f}\n{b:.6f}\n"{p}"' for a, b, p in cells]
    return "\n".join(['File type = "ooTextFile"', 'Object class = "TextGrid"', "", "0", f"{length:.6f}", "<exists>", "2"] + tiers) + "\n"


GLIDES = set("ゃゅょぁぃぅぇぉゎやゆよわをャュョァィゥェォワヤユヨyw")  # after these a mark may be 150 ms late (the data's README)


def as_sung(audio, vowels, folder, name):
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", audio, folder / (name + ".wav")], check=True)
    with wave.open(str(folder / (name + ".wav"))) as sound:
        length = sound.getnframes() / sound.getframerate()
    song = Song([], length, None)
    song.spans, song.notes = vowels, [(a, b, 0) for a, b, _ in vowels]  # no semitones from what it was
    return song, length


def make(data, folder, options):
    marks, files = collections.defaultdict(list), collections.defaultdict(list)
    for row in csv.DictReader(open(data / "labels.csv")):
        marks[row["file"]].append(row)
    pitches, glides = {}, {}
    for row in csv.DictReader(open(data / "files.csv")):
        files[row["singer"]].append(row["file"])
        pitches[row["file"]] = float(row["median_f0_hz"])
        glides[row["file"]] = bool(GLIDES & set(pathlib.PurePath(row["source_file"]).stem))
    folder.mkdir(parents=True, exist_ok=True)
    for singer, names in sorted(files.items()):
        picked = [name for name in names if pitches[name] < 450 and not glides[name]]
        for name in picked[:: max(1, len(picked) // options.files)][: options.files]:
            stem, audio, vowels = name[: -len(".flac")], data / "audio" / name, syllables(marks[name])
            if options.as_sung:
                song, length = as_sung(audio, vowels, folder, stem)
            else:
                song, length = sing_again(audio, vowels, folder, stem, random.Random(f"{options.seed} {stem}"), options.uneven)
            truth = dict(singer=singer, spans=song.spans, vibrato=song.vibrato,
                         unmarked=[(song.target(a), song.target(b)) for a, b in unmarked(marks[name])],
                         notes=[(a, b, pitches[name] * 2 ** (p / 12)) for a, b, p in song.notes])
            (folder / (stem + ".TextGrid")).write_text(text_grid(song.spans, length))
            (folder / (stem + ".json")).write_text(json.dumps(truth))


def matched(truth, found, is_match):
    """Pairs in order of time, each taken once: of all such matchings one with the most pairs."""
    taken, count = set(), 0
    for t in truth:
        for i, f in enumerate(found):
            if i not in taken and is_match(t, f):
                taken.add(i)
                count += 1
                break
    return count


def f1(hits, truths, founds):
    return 2 * hits / max(1, truths + founds)


def shared(a, b):
    both = max(0, min(a[1], b[1]) - max(a[0], b[0]))
    return both / (a[1] - a[0] + b[1] - b[0] - both)


def judge(truth, tags, sums):
    is_known = lambda t: not any(a - 1e-6 <= t < b for a, b in truth["unmarked"])
    all_notes = [(n["start_s"], n["end_s"], n["hz"]) for n in tags["notes"]]
    is_near = lambda t, k: any(abs(n[k] - t) <= NEAR_S for n in truth["notes"])
    notes = [n for n in all_notes if is_known(n[0]) or is_near(n[0], 0)]
    swings = [(v["start_s"], v["end_s"]) for v in tags["vibrato"]]
    near = lambda k: lambda t, f: abs(t[k] - f[k]) <= NEAR_S
    sums["onsets"] += matched(truth["notes"], notes, near(0))
    by_end = lambda some: sorted(some, key=lambda n: n[1])
    ends = [by_end(n for n in truth["notes"] if is_known(n[1])), by_end(n for n in all_notes if is_known(n[1]))]
    sums["offsets"] += matched(*ends, lambda t, f: abs(t[1] - f[1]) <= max(NEAR_S, 0.2 * (t[1] - t[0])))
    sums["true ends"] += len(ends[0])
    sums["found ends"] += len(ends[1])
    sums["notes"] += matched(truth["notes"], notes, lambda t, f: near(0)(t, f) and abs(12 * math.log2(t[2] / f[2])) < 0.5)
    sums["true notes"] += len(truth["notes"])
    sums["found notes"] += len(notes)
    sums["vibrato"] += matched(truth["vibrato"], swings, lambda t, f: shared(t, f) >= 0.5)
    sums["true vibrato"] += len(truth["vibrato"])
    sums["found vibrato"] += len(swings)
    frames = lambda spans: {i for a, b in spans for i in range(round(100 * a), round(100 * b))}
    wanted, heard = frames(truth["vibrato"]), frames(swings)
    sums["frames both"] += len(wanted & heard)
    sums["frames wanted"] += len(wanted)
    sums["frames heard"] += len(heard)


def table(sums):
    n, m = sums["true notes"], sums["found notes"]
    return dict(notes_true=n, notes_found=m, onsets=f1(sums["onsets"], n, m), offsets=f1(sums["offsets"], sums["true ends"], sums["found ends"]), notes=f1(sums["notes"], n, m),
                vibrato_true=sums["true vibrato"], vibrato_found=sums["found vibrato"],
                vibrato=f1(sums["vibrato"], sums["true vibrato"], sums["found vibrato"]),
                frame_precision=sums["frames both"] / max(1, sums["frames heard"]), frame_recall=sums["frames both"] / max(1, sums["frames wanted"]))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("songs", type=pathlib.Path)
    parser.add_argument("--singers", default="")
    parser.add_argument("--files", type=int, default=12, help="of each singer")
    parser.add_argument("--as-sung", action="store_true")
    parser.add_argument("--uneven", action="store_true", help="vibrato as uneven as people's at their worst, in notes that drift")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--corpus", default="build/bin/corpus")
    parser.add_argument("--phones", action="store_true")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if not any(options.songs.glob("*.json")):
        make(options.data, options.songs, options)
    sums = collections.defaultdict(collections.Counter)
    for path in sorted(options.songs.glob("*.json")):
        truth = json.loads(path.read_text())
        if options.singers and truth["singer"] not in options.singers.split(","):
            continue
        tags = options.songs / "tags.out"
        command = [options.corpus, "tag", path.with_suffix(".wav"), "--out", tags, "--quiet"]
        if options.phones:
            command += ["--phones", path.with_suffix(".TextGrid")]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        for row in (truth["singer"], "all"):
            judge(truth, json.loads(tags.read_text()), sums[row])
    result = {singer: table(counts) for singer, counts in sorted(sums.items(), key=lambda item: (item[0] == "all", item[0]))}
    if options.json:
        print(json.dumps(result, indent=1))
        return
    for singer, row in result.items():
        print(f"{singer:16}", "  ".join(f"{k} {v:.3f}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items()))


if __name__ == "__main__":
    main()
