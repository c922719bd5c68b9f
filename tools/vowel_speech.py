"""Vowels that people read aloud: the descriptions of Tux Paint's stamps, in six languages with plain vowels, each
aligned with its text by networks that heard none of the singers (docs/theory/hearing/vowel_training.md)."""
import glob
import os
import re
import subprocess

import numpy as np

import vowel_perceptron
from vowel_sounds import CLASSES, CONSONANT, read_sound

STAMPS = "/usr/share/tuxpaint/stamps"
LANGUAGES = ("es", "ca", "bg", "el", "ro", "ru")
UNSTRESSED_ARE_FULL = ("es", "el")  # elsewhere only stressed vowels are taken: the others are reduced
MOST_SOUNDS, BEST_SHARE = 220, 0.6  # of a language: those whose alignment is likeliest, for some readers strayed
SHORTEST_S, LONGEST_S = 0.3, 14.0
STEADY_FROM, STEADY_TO, FEWEST_FRAMES = 0.3, 0.8, 6

VOWELS = {"a": "A", "ɑ": "A", "ä": "A", "e": "E", "ɛ": "E", "ε": "E", "i": "I", "o": "O", "ɔ": "O", "u": "U"}
OTHER_VOWELS = "ɐəɨʊɪœøyæʌɒɯɤʉɵɶɘɜ"
MARKS = str.maketrans("", "", "ˈˌːʲ̪̻͡")  # stress, length, palatal, dental, tie
SILENCE, PAUSE, ANY = "silence", "pause", "any"  # a pause may be left out; any: a vowel that is none of the five
FRAMES_AT_LEAST = {SILENCE: 1, PAUSE: 1, CONSONANT: 2, ANY: 3}
VOWEL_FRAMES_AT_LEAST = 4
ANY_SHARE, LEAST_SHARE = 0.22, 1e-4
STOPS_ARE_SILENT, SILENCE_SOUNDS, UNVOICED_VOWEL = 0.7, 1.5, 2.0  # nepers that each costs
NEVER = -1e9


def phones(text, language):
    """[(class or SILENCE, PAUSE, CONSONANT, ANY; stress)] as espeak-ng reads it: 2 stressed, 1 not, 0 of no use.
    Nothing where it changes into another language."""
    ipa = subprocess.run(["espeak-ng", "-q", "--ipa", "--sep=_", "-v", language, text], stdout=subprocess.PIPE,
                         stderr=subprocess.DEVNULL, text=True, check=True).stdout
    if "(" in ipa:
        return []
    found = [(SILENCE, 0)]
    for word in ipa.split():
        for phone in word.split("_"):
            plain = phone.translate(MARKS)
            vowels = [letter for letter in plain if letter in VOWELS or letter in OTHER_VOWELS]
            if len(plain) == 1 and plain in VOWELS:
                found.append((CLASSES[VOWELS[plain]], 2 if "ˈ" in phone else 1))
            elif vowels:  # a diphthong, or a vowel of another language
                found += [(CLASSES[VOWELS[v]] if v in VOWELS and len(vowels) > 1 else ANY, 0) for v in vowels]
            elif plain:
                found.append((CONSONANT, 0))
        found.append((PAUSE, 0))
    return found + [(SILENCE, 0)]


def aligned(sequence, shares, voiced):
    """The likeliest way through the phones. Returns its mean log share a frame and [(phone, first, end frame)], or
    nothing where the sound is too short."""
    log = np.log(shares + LEAST_SHARE)
    silence, consonant = log[:, CLASSES["SIL"]], log[:, CONSONANT]
    scores = {SILENCE: np.maximum(silence, consonant - SILENCE_SOUNDS),
              PAUSE: np.maximum(silence, consonant - SILENCE_SOUNDS),
              CONSONANT: np.maximum(consonant, silence - STOPS_ARE_SILENT),
              ANY: np.full(len(log), np.log(ANY_SHARE))}
    for vowel in range(5):
        scores[vowel] = log[:, vowel] - UNVOICED_VOWEL * ~voiced
    lengths = [FRAMES_AT_LEAST.get(kind, VOWEL_FRAMES_AT_LEAST) for kind, _ in sequence]
    phone_of = np.repeat(np.arange(len(sequence)), lengths)
    if len(phone_of) > len(log):
        return None
    last = np.cumsum(lengths) - 1
    stays = np.zeros(len(phone_of), bool)
    stays[last] = True
    leaps = np.zeros(len(phone_of), int)  # over a pause, from the end of the phone before it
    for phone in range(2, len(sequence)):
        if sequence[phone - 1][0] == PAUSE:
            leaps[last[phone - 1] + 1] = last[phone - 2]
    emitted = np.stack([scores[sequence[phone][0]] for phone in phone_of], 1)
    best = np.full(len(phone_of), NEVER)
    best[0] = emitted[0, 0]
    came = np.zeros(emitted.shape, int)
    for frame in range(1, len(log)):
        ways = np.stack([np.where(stays, best, NEVER), np.concatenate([[NEVER], best[:-1]]),
                         np.where(leaps > 0, best[leaps], NEVER)])
        came[frame] = ways.argmax(0)
        best = ways.max(0) + emitted[frame]
    state, path = len(phone_of) - 1, np.empty(len(log), int)
    for frame in range(len(log) - 1, -1, -1):
        path[frame] = phone_of[state]
        state = (state, state - 1, leaps[state])[came[frame, state]]
    segments = []
    for phone in np.unique(path):
        frames = np.flatnonzero(path == phone)
        segments.append((sequence[phone], frames[0], frames[-1] + 1))
    return best[-1] / len(log), segments


def read_aloud(language):
    """(path, text) of every description that was recorded in the language."""
    for path in sorted(glob.glob(f"{STAMPS}/**/*_desc_{language}.ogg", recursive=True)):
        written = path[:-len(f"_desc_{language}.ogg")] + ".txt"
        if os.path.exists(written):
            with open(written, encoding="utf-8", errors="replace") as lines:
                texts = [line.split("=", 1)[1].strip() for line in lines if line.startswith(language + ".utf8=")]
            if texts:
                yield path, re.sub(r"\(.*?\)", "", texts[0])


def steady_vowels(segments, language):
    least_stress = 1 if language in UNSTRESSED_ARE_FULL else 2
    found = []
    for (kind, stress), first, end in segments:
        if kind in range(5) and stress >= least_stress and end - first >= FEWEST_FRAMES:
            length = end - first
            found.append((0.01 * (first + STEADY_FROM * length), 0.01 * (first + STEADY_TO * length), kind))
    return found


def speech_files(networks, columns_of):
    """[(who, samples, intervals)], a voice a language. `networks` are perceptrons of seven classes;
    `columns_of(samples)` gives what they hear, and the pitch."""
    files = []
    for language in LANGUAGES:
        found = []
        for path, text in read_aloud(language):
            sequence = phones(text, language)
            samples = read_sound(path)
            if not sequence or not SHORTEST_S < len(samples) / 16000 < LONGEST_S or np.abs(samples).max() < 0.01:
                continue
            samples = (samples * 0.5 / np.abs(samples).max()).astype(np.float32)
            columns, f0 = columns_of(samples)
            way = aligned(sequence, np.mean([network.shares(columns) for network in networks], 0), f0 > 0)
            if way is not None:
                found.append((way[0], samples, steady_vowels(way[1], language)))
        found.sort(key=lambda one: -one[0])
        files += [("speech " + language, samples, vowels)
                  for _, samples, vowels in found[:min(int(BEST_SHARE * len(found)), MOST_SOUNDS)] if vowels]
    return files


def aligners(voices, count=3):
    """Perceptrons that tell the five vowels, silence and consonants. voices as in vowel_perceptron.train."""
    return [vowel_perceptron.train(voices, 70 + k, CONSONANT + 1) for k in range(count)]
