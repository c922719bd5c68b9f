#!/usr/bin/python3
"""Trains what tells phones by what the network of words hears, and writes its weights.

    apt-get install python3-numpy libopenblas0-pthread ffmpeg
    tools/train_phones.py --grid ../shared/capture/grid_s1/takes --out src/hearing/network/network_phones.weights

Needs what `make build` makes, and takes a quarter of an hour. With --without-grid no take teaches, so that all of them
can judge. docs/theory/hearing/network_phones.md tells what was learnt from what.
"""
import argparse
import csv
import os
import pathlib
import re
import struct
import subprocess
import tempfile

import numpy as np

PHONES = ("sil AA AE AH AO AW AY EH ER EY IH IY OW OY UH UW B CH D DH F G HH JH K L M N NG P R S SH T TH V W Y Z "
          "ZH").split()
RATE, STEP, NUMBERS, CONTEXT, UNITS = 16000, 0.024, 288, 2, 192
VOICES = ["flite:slt", "flite:awb", "festival:cmu_us_slt_arctic_hts", "espeak:en-us"]
JUDGES = ["flite:rms", "flite:kal16", "festival:kal_diphone", "espeak:en-gb"]
NOISES = [("pink", 20), ("pink", 10), ("white", 15), ("brown", 10), ("pink", 5), ("white", 10), ("room", 0)]
EPOCHS, BATCH, RATE_OF_LEARNING, DECAY = 4, 512, 1e-3, 1e-2
DROPPED_NUMBERS, DROPPED_UNITS = 0.1, 0.2
rng = np.random.default_rng(1)


class Encoder:
    """The network's program, as word_network.cpp asks it."""

    def __init__(self, folder):
        answers, child = os.pipe()
        self.program = subprocess.Popen(["node", str(folder / "hear_words.mjs")], stdin=subprocess.PIPE,
                                        preexec_fn=lambda: os.dup2(child, 3), pass_fds=(3, child))
        self.answers = os.fdopen(answers, "rb")

    def frames(self, samples):
        sound = np.clip(samples, -32768, 32767).astype("<i2")
        self.program.stdin.write(struct.pack("<II", len(sound), 0xFFFFFFFF) + sound.tobytes())
        self.program.stdin.flush()
        upper = np.frombuffer(bytes.fromhex(self.answers.readline().decode().strip().strip('"')), ">u2")
        return (upper.astype(np.uint32) << 16).view(np.float32).reshape(-1, NUMBERS)


def phones_of(grid):
    """Start, end and number of each phone of a TextGrid."""
    tier = next(part for part in re.split(r"item \[\d+\]:", grid.read_text())[1:] if 'name = "phones"' in part)
    found = re.findall(r'xmin = (\S+)\s+xmax = (\S+)\s+text = "(.*?)"', tier)
    return [(float(start), float(end), PHONES.index(name) if name in PHONES else 0) for start, end, name in found]


def samples_of(sound):
    made = subprocess.run(["ffmpeg", "-v", "error", "-i", sound, "-ar", str(RATE), "-ac", "1", "-f", "s16le", "-"],
                          capture_output=True, check=True)
    return np.frombuffer(made.stdout, "<i2").astype(np.float32)


def coloured(count, kind):
    spectrum = np.fft.rfft(rng.standard_normal(count))
    places = np.maximum(np.arange(len(spectrum)), 1)
    return np.fft.irfft(spectrum / places ** {"white": 0, "pink": 0.5, "brown": 1}[kind], count)


def in_noise(samples, phones, kind, snr_db):
    if kind == "room":
        tail = rng.standard_normal(RATE // 2) * 10 ** (-3 * np.arange(RATE // 2) / (0.4 * RATE))
        tail[0] = 3
        made = np.convolve(samples, tail)[:len(samples)]
        return made * np.abs(samples).max() / np.abs(made).max()
    said = np.concatenate([samples[int(a * RATE):int(b * RATE)] for a, b, phone in phones if phone])
    noise = coloured(len(samples), kind)
    made = samples + noise * np.sqrt(np.mean(said ** 2) / 10 ** (snr_db / 10) / np.mean(noise ** 2))
    return made * min(1, 32000 / np.abs(made).max())


def labels_of(frames, start, phones):
    times = (np.arange(frames) + 0.5) * STEP + start
    labels = np.full(frames, -1)
    for begin, end, phone in phones:
        labels[(times >= begin) & (times < end)] = phone
    return labels


def sentences():
    text = re.sub(r"\s+", " ", pathlib.Path("LICENSE").read_text() + pathlib.Path("sample_data/prompts/rich.txt").read_text())
    parts = {part.strip() for part in re.split(r"[.;:(),\[\]]", text)}
    fit = sorted(p for p in parts if re.fullmatch(r"[A-Za-z' ]+", p) and 4 <= len(p.split()) <= 11 and not p.isupper())
    return list(rng.permutation(fit))


def spoken(synth, voice, lines, folder):
    """Sounds and labels of the lines by a voice."""
    folder.mkdir()
    with open(folder / "lines.csv", "w", newline="") as file:
        csv.writer(file).writerows([("id", "text"), *((f"l{i}", line) for i, line in enumerate(lines))])
    subprocess.run([synth, "batch", "-q", folder / "lines.csv", "--corpus", "clock", "--voice", voice, "--format", "wav",
                    "TextGrid", "--out", folder / "out"], check=True)
    return [folder / "out" / f"l{i}.wav" for i in range(len(lines))]


class Perceptron:
    """One hidden layer of rectified units; Adam with decay."""

    def __init__(self, frames):
        self.mean, self.deviation = frames.mean(0), frames.std(0) + 1e-3
        inputs = NUMBERS * (2 * CONTEXT + 1)
        self.weights = [rng.standard_normal((inputs, UNITS)) / np.sqrt(inputs), np.zeros(UNITS),
                        rng.standard_normal((UNITS, len(PHONES))) / np.sqrt(UNITS), np.zeros(len(PHONES))]
        self.weights = [w.astype(np.float32) for w in self.weights]
        self.moments = [(np.zeros_like(w), np.zeros_like(w)) for w in self.weights]
        self.steps = 0

    def normalised(self, frames):
        return (np.pad(frames, ((CONTEXT, CONTEXT), (0, 0)), mode="edge") - self.mean) / self.deviation

    def phones(self, frames):
        around = self.normalised(frames)
        inputs = np.hstack([around[k:k + len(frames)] for k in range(2 * CONTEXT + 1)])
        hidden = np.maximum(inputs @ self.weights[0] + self.weights[1], 0)
        return (hidden @ self.weights[2] + self.weights[3]).argmax(1)

    def step(self, inputs, labels, rate):
        kept = (rng.random((len(inputs), 1, NUMBERS)) > DROPPED_NUMBERS) / (1 - DROPPED_NUMBERS)
        inputs = (inputs * kept.astype(np.float32)).reshape(len(inputs), -1)
        hidden = np.maximum(inputs @ self.weights[0] + self.weights[1], 0)
        units = ((rng.random(hidden.shape) > DROPPED_UNITS) / (1 - DROPPED_UNITS)).astype(np.float32)
        scores = (hidden * units) @ self.weights[2] + self.weights[3]
        likely = np.exp(scores - scores.max(1, keepdims=True))
        likely /= likely.sum(1, keepdims=True)
        likely[np.arange(len(labels)), labels] -= 1
        likely /= len(labels)
        back = (likely @ self.weights[2].T) * units * (hidden > 0)
        gradients = [inputs.T @ back, back.sum(0), (hidden * units).T @ likely, likely.sum(0)]
        self.steps += 1
        for weights, (first, second), gradient in zip(self.weights, self.moments, gradients):
            first += 0.1 * (gradient - first)
            second += 0.001 * (gradient ** 2 - second)
            change = first / (1 - 0.9 ** self.steps) / (np.sqrt(second / (1 - 0.999 ** self.steps)) + 1e-8)
            weights -= (rate * (change + DECAY * weights * (weights.ndim > 1))).astype(np.float32)

    def bytes(self):
        def upper(numbers):
            return ((np.ascontiguousarray(numbers, np.float32).view(np.uint32) + 0x8000) >> 16).astype("<u2").tobytes()

        hidden, bias, output, output_bias = self.weights
        parts = [self.mean, 1 / self.deviation, hidden.T, bias, output.T, output_bias]
        return b"MPPHONE1" + struct.pack("<I", UNITS) + b"".join(upper(part) for part in parts)


def train(taught):
    flat = np.vstack([frames for frames, _ in taught])
    perceptron = Perceptron(flat)
    padded = np.vstack([perceptron.normalised(frames) for frames, _ in taught]).astype(np.float32)
    places, at = [], 0
    for frames, labels in taught:
        places.append(at + np.nonzero(labels >= 0)[0])
        at += len(frames) + 2 * CONTEXT
    places, labels = np.concatenate(places), np.concatenate([labels[labels >= 0] for _, labels in taught])
    batches = len(places) // BATCH
    for epoch in range(EPOCHS):
        order = rng.permutation(len(places))
        for k in range(batches):
            chosen = order[k * BATCH:(k + 1) * BATCH]
            rate = RATE_OF_LEARNING * (0.5 + 0.5 * np.cos(np.pi * (epoch * batches + k) / (EPOCHS * batches)))
            perceptron.step(padded[places[chosen, None] + np.arange(2 * CONTEXT + 1)], labels[chosen], rate)
    return perceptron


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--grid", type=pathlib.Path, required=True, help="takes: the odd ones teach, each fourth judges")
    arguments.add_argument("--without-grid", action="store_true", help="no take teaches")
    arguments.add_argument("--build", type=pathlib.Path, default="build")
    arguments.add_argument("--out", type=pathlib.Path, required=True)
    given = arguments.parse_args()
    encoder = Encoder(given.build / "share/mouthpiece/word_network")
    taught, judged = [], {}

    def teach(sound, number):
        phones, samples = phones_of(sound.with_suffix(".TextGrid")), samples_of(sound)
        kinds = [None] + ([NOISES[number // 2 % len(NOISES)]] if number % 2 == 0 else [])
        for heard in [samples if kind is None else in_noise(samples, phones, *kind) for kind in kinds]:
            end = int(rng.uniform(min(0.8 * RATE, 0.4 * len(heard)), len(heard)))
            first = max(0, end - int(rng.uniform(1, 3) * RATE))
            for begin, part in ((0, heard), (first, heard[first:end])):  # as a stream hears it, too
                frames = encoder.frames(part)
                taught.append((frames, labels_of(len(frames), begin / RATE, phones)))

    def judge(who, sound):
        frames = encoder.frames(samples_of(sound))
        judged.setdefault(who, []).append((frames, labels_of(len(frames), 0, phones_of(sound.with_suffix(".TextGrid")))))

    with tempfile.TemporaryDirectory() as folder:
        lines = sentences()
        for k, voice in enumerate(VOICES + JUDGES):
            is_judge = voice in JUDGES
            sounds = spoken(given.build / "bin/synth", voice, lines[150:190] if is_judge else lines[:150],
                            pathlib.Path(folder) / str(k))
            for i, sound in enumerate(sounds):
                judge(voice, sound) if is_judge else teach(sound, i)
    for i, sound in enumerate(sorted(given.grid.glob("*.wav"))):
        if i % 2 == 1 and not given.without_grid:
            teach(sound, i // 2)
        if i % 4 == 0:
            judge("grid", sound)
    for k in range(40):  # noise alone, steady or in gusts
        noise = coloured(int(rng.uniform(1, 4) * RATE), ["white", "pink", "brown"][k % 3])
        gusts = np.interp(np.arange(len(noise)), np.linspace(0, len(noise), 8), rng.uniform(0, 1, 8)) if k % 2 else 1
        frames = encoder.frames(noise / np.abs(noise).max() * gusts * rng.uniform(100, 20000))
        taught.append((frames, np.zeros(len(frames), int)))
    perceptron = train(taught)
    for who, sounds in judged.items():
        right = [(perceptron.phones(frames) == labels)[labels > 0] for frames, labels in sounds]
        print(f"{who}: {100 * np.concatenate(right).mean():.1f} % of the frames of phones", flush=True)
    given.out.write_bytes(perceptron.bytes())


main()
