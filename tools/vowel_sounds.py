"""The sounds the vowel network learns from (docs/theory/hearing/vowel_training.md): the singers of singing_vowels, Festival's
voices, the alphabets of KLettres, and singers modelled on people's measured formants. A sound is (who, samples at
16 kHz, [(start_s, end_s, class)])."""
import csv
import glob
import os
import subprocess
import tempfile

import numpy as np

from vowel_envelope import RATE, mel, pitch, power_frames

CLASSES = {"A": 0, "E": 1, "I": 2, "O": 3, "U": 4, "SIL": 5}
IGNORED = -1
CONSONANT = 6  # told apart only where speech is aligned
TTS_VOICES = {"lp_diphone": "mnlrtdpbsfvkg", "pc_diphone": "mnlrtdpbsfvkg", "hy_fi_mv_diphone": "mnlrtpsvkh",
              "suo_fi_lj_diphone": "mnlrtpsvkh", "czech_dita": "mnlrtdpbsvk", "czech_krb": "mnlrtdpbsvk",
              "czech_machac": "mnlrtdpbsvk", "czech_ph": "mnlrtdpbsvk", "upc_ca_ona_hts": "mnlrtpbsk"}
KLETTRES = "/usr/share/klettres"
# Syllables that end in the vowel they are written with, and the letters and words of other alphabets that do.
OPEN_SYLLABLES = ("it", "es", "pt_BR", "tn", "ml", "ru", "uk")
DIGRAPHS = {"aa": "A", "ii": "I", "uu": "U", "oo": "O", "ee": "E"}
NAMED_LETTERS = {
    "de": "a:A e:E i:I o:O u:U c:E b:E d:E g:E p:E t:E w:E h:A k:A q:U ja:A die:I wo:O zu:U opa:A reh:E rot:O gut:U",
    "hu": "a2:A e2:E i1:I i2:I o1:O o2:O u1:U u2:U b:E c:E d:E g:E t:E p:E k:A h:A 12-ho:O 15-jo:O 17-lo:O 19-ma:A "
          "28-so:O",
    "lt": "a-2:A a-1:A e-2:E e-3:E i-1:I i-2:I y:I o:O u-1:U u-2:U u-3:U b:E c-1:E d:E g:E p:E t:E v:E na:A ko:O yra:A "
          "kilo:O ji:I",
    "cs": "a-0:A a-1:E a-2:E a-3:E a-4:E a-6:E a-7:A a-8:I a-10:A a-14:O a-15:E a-19:E a-20:U a-21:E a-27:E a-29:E a-30:E "
          "ad-0:A ad-1:O ad-2:A ad-3:O ad-4:E ad-5:A ad-6:E ad-7:E ad-8:O ad-9:I ad-10:E ad-11:E ad-12:I ad-13:A ad-14:E "
          "ad-15:O ad-16:U ad-17:E",
    "nl": "a-0:A a-1:E a-2:E a-3:E a-5:E a-6:A a-7:I a-9:A a-13:O a-14:E a-17:E a-19:E a-20:E ad-0:A ad-3:E ad-9:I "
          "ad-14:U ad-16:O",
    "nb": "U0061:A U0062:E U0063:E U0064:E U0065:E U0067:E U0068:O U0069:I U006B:O U006F:U U0070:E U0071:U U0074:E "
          "U0075:U U0076:E U00E5:O",
    "da": "a-1:E a-2:E a-3:E a-4:E a-6:E a-7:O a-8:I a-10:O a-14:O a-15:E a-16:U a-19:E a-20:U a-28:O ad-1:E ad-2:O "
          "ad-11:U ad-14:E ad-15:E ad-16:O ad-17:U ad-23:E ad-25:I",
    "fr": "a-0:A a-1:E a-2:E a-3:E a-6:E a-8:I a-9:I a-10:A a-14:O a-15:E a-19:E a-21:E ad-0:A ad-2:I ad-3:O ad-6:A "
          "ad-7:I ad-8:O ad-11:A ad-12:O ad-13:I ad-15:A ad-17:I ad-18:O ad-20:O ad-21:A ad-22:I ad-24:A ad-25:I ad-26:O",
    "en": "B:I C:I D:I E:I G:I P:I T:I V:I Q:U U:U me:I key:I saw:O aw:O",
    "en_GB": "b:I c:I d:I e:I g:I p:I t:I v:I q:U u:U r:A me:I key:I car:A or:O saw:O",
    "ru": "e:E i:I be:E de:E ge:E pe:E te:E tse:E ve:E ze:E che:E pi:I",
    "uk": "e:E i:I be:E de:E ge:E pe:E te:E tse:E ve:E ze:E zhe:E che:E mi:I ni:I pi:I bi:I chi:I zmi:I hli:I"}
# Praat's measured people: which of their Dutch vowels stand for the five. Where two are named, anything between.
PEOPLES_TABLES = ("Pols & Van Nierop 1973", "Weenink 1985")
PEOPLES_VOWELS = {"A": ["aa"], "E": ["ee", "e"], "I": ["ie"], "O": ["oo", "o"], "U": ["oe"]}


def read_sound(path):
    done = subprocess.run(["sox", path, "-t", "raw", "-r", str(RATE), "-c", "1", "-e", "signed", "-b", "16", "-"],
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True)
    return np.frombuffer(done.stdout, np.int16).astype(np.float32) / 32768


def singer_files(folder):
    intervals = {}
    with open(os.path.join(folder, "labels.csv"), encoding="utf-8") as rows:
        for row in csv.DictReader(rows):
            label = CLASSES.get(row["label"], IGNORED)
            intervals.setdefault(row["file"], []).append((float(row["start_s"]), float(row["end_s"]), label))
    return [(name.rsplit("_", 1)[0], read_sound(os.path.join(folder, "audio", name)), intervals[name])
            for name in sorted(intervals)]


# ---- Festival


def tts_files(rng, lines=10, stretches=(1.2, 2.6), consonants_too=False):
    """Held syllables by Festival's Italian, Finnish, Czech and Catalan voices: people with pure vowels and exact
    labels."""
    files = []
    for voice, consonants in TTS_VOICES.items():
        with tempfile.TemporaryDirectory() as folder:
            script = f"""(voice_{voice})
(define (say text name stretch)
  (Parameter.set 'Duration_Stretch stretch)
  (let ((u (utt.synth (eval (list 'Utterance 'Text text)))) (f (fopen (string-append name ".lab") "wb")))
    (mapcar (lambda (s) (format f "%s %s\\n" (item.name s) (item.feat s "end"))) (utt.relation.items u 'Segment))
    (fclose f) (utt.save.wave u (string-append name ".wav") 'riff)))\n"""
            for line in range(lines):
                words = ["".join(rng.choice(list(consonants)) + rng.choice(list("aeiou")) for _ in range(2))
                         for _ in range(6)]
                script += f'(say "{" ".join(words)}" "{line}" {rng.uniform(*stretches):.2f})\n'
            with open(os.path.join(folder, "say.scm"), "w", encoding="ascii") as out:
                out.write(script)
            subprocess.run(["festival", "-b", "say.scm"], cwd=folder, check=True, stdout=subprocess.DEVNULL,
                           stderr=subprocess.DEVNULL)
            for line in range(lines):
                files.append(("tts " + voice, read_sound(os.path.join(folder, f"{line}.wav")),
                              tts_intervals(os.path.join(folder, f"{line}.lab"), consonants_too)))
    return files


def tts_intervals(path, consonants_too):
    intervals, start = [], 0.0
    with open(path, encoding="ascii") as rows:
        for row in rows:
            name, end = row.split()
            end, vowel = float(end), name.rstrip("1").upper()
            if name in ("#", "pau") and end - start > 0.1:
                intervals.append((start + 0.03, end - 0.04, CLASSES["SIL"]))
            elif vowel in "AEIOU":
                intervals.append((start + 0.025, end - 0.025, CLASSES[vowel]))
            elif consonants_too and name not in ("#", "pau") and end - start > 0.03:
                intervals.append((start + 0.008, end - 0.008, CONSONANT))
            start = end
    return intervals


# ---- KLettres


def letters_vowel(language, name):
    """The vowel that a syllable's or letter's recording ends in, or nothing."""
    if language in NAMED_LETTERS:
        named = dict(entry.split(":") for entry in NAMED_LETTERS[language].split())
        if name in named:
            return named[name]
    if language not in OPEN_SYLLABLES:
        return None
    if language == "ml":
        if name[-2:] in DIGRAPHS and not name.endswith("ooo"):
            return DIGRAPHS[name[-2:]]
        return name[-1].upper() if name[-1] in "iueo" and name[-2:-1] not in tuple("aeiou") else None
    if language in ("ru", "uk"):
        return name[-1].upper() if name[-1] in "aou" and name[-2:-1] not in tuple("yiaou") else None
    return name[-1].upper() if name[-1] in "aeiou" else None


def held_part(samples):
    """Where the loudest voiced stretch is steady: its last part, without the fall."""
    f0 = pitch(samples)
    level = 10 * np.log10(power_frames(samples).sum(1) + 1e-9)
    sounding = (f0 > 0) & (level > level.max() - 12)
    if sounding.sum() < 8:
        return None
    first = last = int(np.argmax(np.where(sounding, level, -np.inf)))
    while first > 0 and sounding[first - 1]:
        first -= 1
    while last < len(sounding) - 1 and sounding[last + 1]:
        last += 1
    length = last - first + 1
    start, end = first + int(0.4 * length), last - int(0.1 * length)
    return (start * 0.01, end * 0.01) if length >= 8 and end - start >= 4 else None


def letter_files(rng, together=7):
    """What people said for the children's alphabets of KLettres, some syllables one after the other in a file."""
    speakers = {}
    for language in sorted(set(OPEN_SYLLABLES) | set(NAMED_LETTERS)):
        for path in sorted(glob.glob(f"{KLETTRES}/{language}/*/*.ogg")):
            vowel = letters_vowel(language, os.path.basename(path)[:-4])
            if vowel is None:
                continue
            samples = read_sound(path)
            held = held_part(samples)
            if held:
                speakers.setdefault("letters " + language, []).append((samples, held, CLASSES[vowel]))
    files = []
    for who, syllables in speakers.items():
        syllables = [syllables[k] for k in rng.permutation(len(syllables))]
        for first in range(0, len(syllables), together):
            at, parts, intervals = 0.0, [], []
            for samples, (start, end), vowel in syllables[first:first + together]:
                intervals.append((at + start, at + end, vowel))
                parts.append(samples * 0.5 / (np.abs(samples).max() + 1e-6))
                at += len(samples) / RATE
            files.append((who, np.concatenate(parts).astype(np.float32), intervals))
    return files


# ---- modelled singers


def measured_people():
    """[{vowel: [formants 1 to 3, Hz]}] of men, women and children: Pols 1973, Van Nierop 1973, Weenink 1985."""
    people = []
    with tempfile.TemporaryDirectory() as folder:
        for table in PEOPLES_TABLES:
            path, script = os.path.join(folder, "table.csv"), os.path.join(folder, "table.praat")
            with open(script, "w", encoding="ascii") as out:
                out.write(f'Create formant table ({table})\nSave as comma-separated file: "{path}"\n')
            subprocess.run(["praat", "--run", script], check=True)
            with open(path, encoding="utf-8") as rows:
                spoken = {}
                for row in csv.DictReader(rows):
                    person = spoken.setdefault((row["Sex"], row.get("Type", ""), row["Speaker"]), {})
                    person.setdefault(row["Vowel"], []).append([float(row[f"F{k}"]) for k in (1, 2, 3)])
            people += [{v: [np.mean(p[name], 0) for name in names] for v, names in PEOPLES_VOWELS.items()}
                       for p in spoken.values() if all(name in p for names in PEOPLES_VOWELS.values() for name in names)]
    return people


def persons_formants(person, rng):
    """Five formants of five vowels, Hz, the person's own but for a few percent, and how short the tract is."""
    formants = np.zeros((5, 5))
    for vowel, found in enumerate(person.values()):
        share = rng.uniform()
        formants[vowel, :3] = found[0] * (1 - share) + found[-1] * share
    shortness = formants[:, 2].mean() / 2500
    formants[:, 3] = np.maximum(3450 * shortness * np.exp(rng.normal(0, 0.05)), formants[:, 2] * 1.15)
    formants[:, 4] = np.maximum(4300 * shortness * np.exp(rng.normal(0, 0.05)), formants[:, 3] * 1.12)
    formants *= np.exp(rng.normal(0, 0.06)) * np.exp(rng.normal(0, 0.03, formants.shape))
    if rng.random() < 0.6:
        formants[4, 1] *= np.exp(rng.uniform(0, 0.7))  # from the Italian U to the Japanese
    return formants, shortness


def modelled_singer(person, rng):
    """Held vowels: harmonics through five resonances, up to 700 Hz, with and without vibrato."""
    formants, shortness = persons_formants(person, rng)
    f0 = min(np.exp(rng.uniform(np.log(95), np.log(300))) * shortness ** 2.2, 700)
    vowels = [*rng.permutation(5)[:rng.integers(1, 6)], *(rng.integers(5) for _ in range(rng.integers(0, 3)))]
    at, intervals, knots = 0.2, [(0, 0.15, CLASSES["SIL"])], []
    for vowel in vowels:
        length = rng.uniform(0.2, 0.6)
        intervals.append((at + 0.04, at + length - 0.04, int(vowel)))
        knots += [at + 0.03, at + length - 0.03]
        at += length
    duration = at + 0.2
    intervals.append((at + 0.06, duration, CLASSES["SIL"]))
    frames = np.arange(0, duration, 0.005)
    track = np.stack([np.interp(frames, knots, formants[np.repeat(vowels, 2), k]) for k in range(5)], 1)
    wander = np.interp(frames, np.linspace(0, duration, 6), rng.normal(0, 2, 6))
    vibrato = rng.choice([0, 0.4, 0.8]) * np.sin(2 * np.pi * rng.uniform(5, 7.5) * frames)
    f0 = f0 * 2 ** ((wander + vibrato) / 12)
    track[:, 0] = np.maximum(track[:, 0], f0 * rng.uniform(0.85, 1.05))  # singers tune F1 to a high pitch
    widths = np.array([70, 90, 130, 200, 280]) * rng.uniform(0.8, 1.7)
    loudness = np.interp(frames, [0.15, 0.21, at - 0.06, at], [0, 1, 1, 0])
    tilt = rng.uniform(-16, -7)
    hz = np.arange(1, int(7800 / f0.min()) + 2)[None] * f0[:, None]
    level = (hz / 100) ** (tilt / 6.02 + 1) * (hz < 7800) * loudness[:, None]
    for k in range(5):
        square = track[:, k:k + 1] ** 2
        level *= square / np.sqrt((square - hz * hz) ** 2 + (widths[k] * hz) ** 2)
    times = np.arange(int(duration * RATE)) / RATE
    turn = np.exp(2j * np.pi * np.cumsum(np.interp(times, frames, f0)) / RATE)
    sound, harmonic = np.zeros(len(times)), np.ones(len(times), complex)
    for k in range(hz.shape[1]):
        harmonic *= turn
        sound += np.interp(times, frames, level[:, k]) * (harmonic * np.exp(1j * rng.uniform(0, 6.28))).imag
    breath = rng.normal(0, 1, len(times)) * np.interp(times, frames, loudness) * 10 ** (rng.uniform(-50, -28) / 20)
    return (0.5 * (sound / np.abs(sound).max() + breath)).astype(np.float32), intervals


def modelled_files(rng, times=2):
    return [("modelled", *modelled_singer(person, rng)) for _ in range(times) for person in measured_people()]


# ---- other recordings of the same


def augmented(samples, rng, formant_spread):
    """Another pitch, other formants, colour, room and noise. Returns the sound, the warp its features need, and how
    much longer it became."""
    speed = np.exp(rng.uniform(np.log(0.72), np.log(1.35)))
    count = int(len(samples) / speed)
    sound = np.interp(np.arange(count) * speed, np.arange(len(samples)), samples)
    warp = float(np.clip(speed / np.exp(rng.uniform(-formant_spread, formant_spread)), 0.6, 1.6))
    if rng.random() < 0.8:
        hz = np.fft.rfftfreq(count, 1 / RATE)
        knots = rng.normal(0, 4, 7)
        colour = np.interp(mel(hz), np.linspace(0, mel(8000), 7), knots - knots.mean())
        colour += rng.uniform(-3, 3) * np.log2((hz + 200) / 1200)
        sound = np.fft.irfft(np.fft.rfft(sound) * 10 ** (colour / 20), count)
    if rng.random() < 0.35:
        length = int(rng.uniform(0.1, 0.6) * RATE)
        room = rng.normal(0, 1, length) * 10 ** (-3 * np.arange(length) / length)
        room *= rng.uniform(0.05, 0.35) / np.sqrt((room ** 2).sum())
        room[0] = 1
        size = 1 << int(np.ceil(np.log2(count + length)))
        sound = np.fft.irfft(np.fft.rfft(sound, size) * np.fft.rfft(room, size), size)[:count]
    noise = rng.normal(0, 1, count)
    if rng.random() < 0.5:
        noise = np.cumsum(noise)
        noise -= np.convolve(noise, np.ones(400) / 400, "same")
        noise /= noise.std() + 1e-9
    sound = sound + noise * np.sqrt((sound ** 2).mean()) * 10 ** (-rng.uniform(15, 60) / 20)
    return sound.astype(np.float32), warp, 1.0 / speed
