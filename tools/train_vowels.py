#!/usr/bin/python3
"""Trains the vowel network (docs/theory/vowel_network.md) and writes its weights.

    apt-get install python3-torch python3-numpy libopenblas0-pthread sox festival festvox-italp16k festvox-itapc16k \\
        festvox-suopuhe-lj festvox-suopuhe-mv festvox-czech-dita festvox-czech-krb festvox-czech-machac festvox-czech-ph
    tools/train_vowels.py --data ../shared/singing_vowels --hold-out ibuki        what it reaches on a singer left out
    tools/train_vowels.py --data ../shared/singing_vowels --out src/vocal/vowel_network.weights

The features are those of src/audio/vowel_features.cpp, number by number.
"""
import argparse
import csv
import os
import struct
import subprocess
import tempfile
import time

import numpy as np
import torch

RATE, HOP, WINDOW, TRANSFORM = 16000, 160, 400, 512
MFCCS, BANDS, CONTEXT = 13, 26, 12
FEATURES = MFCCS + 2 * BANDS
LOWEST_HZ, HIGHEST_HZ = 80.0, 7600.0
FLOOR, SILENT, LOUD_RANGE, TAKEN_OFF_MEAN = 1e-7, 1e-12, 5.0, 0.5
CLASSES = {"A": 0, "E": 1, "I": 2, "O": 3, "U": 4, "SIL": 5}
MERGED = np.array([0, 1, 1, 2, 2, 3])
IGNORED = -1
TTS_VOICES = {"lp_diphone": "mnlrtdpbsfvkg", "pc_diphone": "mnlrtdpbsfvkg", "hy_fi_mv_diphone": "mnlrtpsvkh",
              "suo_fi_lj_diphone": "mnlrtpsvkh", "czech_dita": "mnlrtdpbsvk", "czech_krb": "mnlrtdpbsvk",
              "czech_machac": "mnlrtdpbsvk", "czech_ph": "mnlrtdpbsvk"}

# ---- features


def mel(hz):
    return 2595 * np.log10(1 + hz / 700.0)


def hz_of_mel(value):
    return 700 * (10 ** (value / 2595.0) - 1)


EDGES = hz_of_mel(np.linspace(mel(LOWEST_HZ), mel(HIGHEST_HZ), BANDS + 2))
COSINES = np.sqrt(2.0 / BANDS) * np.cos(np.pi * np.arange(MFCCS)[:, None] * (np.arange(BANDS) + 0.5) / BANDS)


def warped_edges(warp):
    """Band edges at which formants `warp` times as high look like the plain ones; bent to stay under 7.9 kHz."""
    if warp <= 1:
        return EDGES * warp
    top = 7900.0
    knee = 0.8 * top / warp
    return np.where(EDGES <= knee, EDGES * warp, 0.8 * top + (EDGES - knee) * 0.2 * top / (HIGHEST_HZ - knee))


def filter_bank(edges):
    hz = np.arange(TRANSFORM // 2 + 1) * RATE / TRANSFORM
    bank = np.zeros((BANDS, hz.size))
    for band in range(BANDS):
        left, middle, right = edges[band:band + 3]
        bank[band] = np.clip(np.minimum((hz - left) / (middle - left), (right - hz) / (right - middle)), 0, None)
    return bank, bank * hz


def raw_features(samples, warp=1.0):
    samples = np.asarray(samples, np.float64)
    frames = len(samples) // HOP + 1
    emphasised = np.concatenate([samples[:1], samples[1:] - 0.97 * samples[:-1]])
    padded = np.concatenate([np.zeros(WINDOW // 2), emphasised, np.zeros(WINDOW + HOP)])
    window = 0.54 - 0.46 * np.cos(2 * np.pi * np.arange(WINDOW) / (WINDOW - 1))
    cut = padded[np.arange(frames)[:, None] * HOP + np.arange(WINDOW)] * window
    power = np.abs(np.fft.rfft(cut, TRANSFORM)) ** 2
    edges = warped_edges(warp)
    bank, bank_hz = filter_bank(edges)
    energy, moment = power @ bank.T, power @ bank_hz.T
    loud = np.quantile(energy.sum(1), 0.95) + SILENT
    relative = energy / loud
    log_mel = np.log(relative + FLOOR)
    centroid = (moment / loud - relative * edges[1:-1]) / (relative + FLOOR) / ((edges[2:] - edges[:-2]) / 2)
    return np.hstack([log_mel @ COSINES.T, log_mel, centroid])


def features(samples, warp=1.0):
    values = raw_features(samples, warp)
    loudest = values[:, MFCCS:MFCCS + BANDS].max(1)
    loud = loudest > np.quantile(loudest, 0.95) - LOUD_RANGE
    return (values - TAKEN_OFF_MEAN * values[loud].mean(0)).astype(np.float32)


def targets(intervals, frames, stretch=1.0):
    classes, middle = np.full(frames, IGNORED, np.int64), np.arange(frames) * HOP / RATE
    for start, end, label in intervals:
        classes[(middle >= start * stretch) & (middle < end * stretch)] = label
    return classes


# ---- sounds


def read_sound(path):
    done = subprocess.run(["sox", path, "-t", "raw", "-r", str(RATE), "-c", "1", "-e", "signed", "-b", "16", "-"],
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True)
    return np.frombuffer(done.stdout, np.int16).astype(np.float32) / 32768


def singer_files(folder):
    """[(singer, samples, intervals)] of singing_vowels."""
    intervals = {}
    with open(os.path.join(folder, "labels.csv"), encoding="utf-8") as rows:
        for row in csv.DictReader(rows):
            label = CLASSES.get(row["label"], IGNORED)
            intervals.setdefault(row["file"], []).append((float(row["start_s"]), float(row["end_s"]), label))
    return [(name.rsplit("_", 1)[0], read_sound(os.path.join(folder, "audio", name)), intervals[name])
            for name in sorted(intervals)]


def tts_files(rng, lines=16):
    """Held syllables by Festival's Italian, Finnish and Czech voices: people with pure vowels and exact labels."""
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
                script += f'(say "{" ".join(words)}" "{line}" {rng.uniform(1.2, 2.6):.2f})\n'
            with open(os.path.join(folder, "say.scm"), "w", encoding="ascii") as out:
                out.write(script)
            subprocess.run(["festival", "-b", "say.scm"], cwd=folder, check=True, stdout=subprocess.DEVNULL,
                           stderr=subprocess.DEVNULL)
            for line in range(lines):
                files.append(("tts", read_sound(os.path.join(folder, f"{line}.wav")),
                              tts_intervals(os.path.join(folder, f"{line}.lab"))))
    return files


def tts_intervals(path):
    intervals, start = [], 0.0
    with open(path, encoding="ascii") as rows:
        for row in rows:
            name, end = row.split()
            end, vowel = float(end), name.rstrip("1").upper()
            if name == "#" and end - start > 0.1:
                intervals.append((start + 0.03, end - 0.04, CLASSES["SIL"]))
            elif vowel in "AEIOU":
                intervals.append((start + 0.025, end - 0.025, CLASSES[vowel]))
            start = end
    return intervals


# Formants 1 to 5 of a man, Hz: the corners of Italian; single singers spread around them.
FORMANTS = np.array([[760, 1250, 2600, 3500, 4300], [500, 1850, 2600, 3500, 4300], [300, 2250, 3000, 3600, 4300],
                     [490, 860, 2500, 3400, 4200], [330, 1000, 2300, 3300, 4200]], float)


def modelled_singer(rng):
    """Harmonics through five resonances: every string another singer, up to 700 Hz, with and without vibrato."""
    tract = np.exp(rng.uniform(np.log(0.9), np.log(1.38)))
    formants = FORMANTS * tract * np.exp(rng.normal(0, 0.05, FORMANTS.shape))
    formants[4, 1] *= np.exp(rng.uniform(0, 0.55))  # from the Italian U to the Japanese
    pitch = min(np.exp(rng.uniform(np.log(95), np.log(300))) * tract ** 1.6, 700)
    at, intervals, knots, vowels = 0.25, [(0, 0.2, CLASSES["SIL"])], [], []
    for _ in range(rng.integers(3, 7)):
        vowel = int(rng.integers(5))
        vowel = (vowel + 1) % 5 if vowels and vowel == vowels[-1] else vowel
        length = rng.uniform(0.25, 0.7)
        intervals.append((at + 0.04, at + length - 0.04, vowel))
        vowels += [vowel, vowel]
        knots += [at + 0.03, at + length - 0.03]
        at += length
    duration = at + 0.3
    intervals.append((at + 0.08, duration, CLASSES["SIL"]))
    frames = np.arange(0, duration, 0.005)
    track = np.stack([np.interp(frames, knots, formants[vowels, k]) for k in range(5)], 1)
    wander = np.interp(frames, np.linspace(0, duration, 6), rng.normal(0, 2, 6)) / 12
    vibrato = rng.choice([0, 0.4, 0.8]) * np.sin(2 * np.pi * rng.uniform(5, 7.5) * frames) / 12
    f0 = pitch * 2 ** (wander + vibrato)
    track[:, 0] = np.maximum(track[:, 0], f0 * rng.uniform(0.85, 1.05))  # singers tune F1 to a high pitch
    widths = np.array([80, 100, 140, 200, 280]) * rng.uniform(0.8, 1.6)
    loudness = np.interp(frames, [0.2, 0.26, at - 0.06, at], [0, 1, 1, 0])
    loudness *= 10 ** (np.interp(frames, np.linspace(0, duration, 5), rng.normal(0, 2, 5)) / 20)
    tilt = rng.uniform(-15, -8)

    def gain(hz, resonances):
        product = 1.0
        for k in range(5):
            square = resonances[:, k] ** 2
            product = product * square / np.sqrt((square - hz * hz) ** 2 + (widths[k] * hz) ** 2)
        return product

    count = int(duration * RATE)
    times = np.arange(count) / RATE
    phase = 2 * np.pi * np.cumsum(np.interp(times, frames, f0)) / RATE
    sound = np.zeros(count)
    for harmonic in range(1, int(7800 / f0.min()) + 1):
        hz = harmonic * f0
        level = gain(hz, track) * (hz / 100) ** (tilt / 6.02 + 1) * (hz < 7800) * loudness
        sound += np.interp(times, frames, level) * np.sin(harmonic * phase + rng.uniform(0, 6.28))
    bins = np.fft.rfftfreq(count, 1 / RATE)
    breath = np.fft.irfft(np.fft.rfft(rng.normal(0, 1, count)) * gain(bins, np.repeat(track[len(track) // 2][None],
                                                                                      len(bins), 0)), count)
    sound /= np.abs(sound).max()
    sound += breath / np.abs(breath).max() * np.interp(times, frames, loudness) * 10 ** (rng.uniform(-45, -22) / 20)
    return (0.5 * sound).astype(np.float32), intervals


def augmented(samples, rng, formant_spread=0.26):
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


def prepared(files, copies, rng, with_plain, formant_spread=0.26):
    """[(features, classes)] of the files and of augmented copies."""
    clips = []
    for copy in range(copies + with_plain):
        for _, samples, intervals in files:
            if with_plain and copy == 0:
                values, stretch = features(samples), 1.0
            else:
                sound, warp, stretch = augmented(samples, rng, formant_spread)
                values = features(sound, warp)
            clips.append((values, targets(intervals, len(values), stretch)))
    return [clip for clip in clips if (clip[1] != IGNORED).any()]


# ---- network


def with_context(x):
    """batch x (frames + 24) x 65 to batch x frames x 1625."""
    frames = x.shape[1] - 2 * CONTEXT
    return torch.cat([x[:, k:frames + k] for k in range(2 * CONTEXT + 1)], 2)


class VowelNetwork(torch.nn.Module):
    def __init__(self, units, mean, inverse_deviation):
        super().__init__()
        self.register_buffer("mean", mean)
        self.register_buffer("inverse_deviation", inverse_deviation)
        self.layers = torch.nn.ModuleList(
            torch.nn.LSTM(FEATURES * (2 * CONTEXT + 1) if k == 0 else units, units, batch_first=True)
            for k in range(3))
        self.output = torch.nn.Linear(units, len(CLASSES))

    def forward(self, x):
        x = with_context((x - self.mean) * self.inverse_deviation)
        for k, layer in enumerate(self.layers):
            x, _ = layer(torch.nn.functional.dropout(x, 0.1 if k == 0 else 0.25, self.training))
        return self.output(torch.nn.functional.dropout(torch.relu(x), 0.25, self.training))

    def scores(self, values):
        padded = np.pad(values, ((CONTEXT, CONTEXT), (0, 0)), "edge")
        with torch.no_grad():
            return self(torch.tensor(padded)[None])[0]


def joined_batch(groups, names, shares, rng, size=32, pieces=2, length=50):
    """Clips joined, so that any vowel can follow any other (VOCAL 4.3)."""
    inputs, classes = [], []
    for _ in range(size):
        values, labels = [], []
        for _ in range(pieces):
            group = groups[names[rng.choice(len(names), p=shares)]]
            clip, clip_labels = group[rng.integers(len(group))]
            labelled = np.flatnonzero(clip_labels != IGNORED)
            frames = labelled[rng.integers(len(labelled))] - rng.integers(length) + np.arange(length)
            inside = (frames >= 0) & (frames < len(clip))
            frames = np.clip(frames, 0, len(clip) - 1)
            values.append(clip[frames])
            labels.append(np.where(inside, clip_labels[frames], IGNORED))
        inputs.append(np.pad(np.concatenate(values), ((CONTEXT, CONTEXT), (0, 0)), "edge"))
        classes.append(np.concatenate(labels))
    return torch.tensor(np.stack(inputs)), torch.tensor(np.stack(classes))


def train(groups, args, rng):
    every = np.concatenate([clip for group in groups.values() for clip, _ in group[:200]])
    network = VowelNetwork(args.units, torch.tensor(every.mean(0)), torch.tensor(1 / (every.std(0) + 1e-2)))
    optimiser = torch.optim.Adam(network.parameters(), args.rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, args.steps, 1e-4)
    names = sorted(groups)
    singers = len(names) - 2
    shares = np.array([{"tts": 0.22, "modelled": 0.13}.get(name, 0.65 / singers) for name in names])
    started, total = time.time(), 0.0
    for step in range(1, args.steps + 1):
        x, y = joined_batch(groups, names, shares, rng)
        x = x + 0.15 * torch.randn(len(x), 1, FEATURES) / network.inverse_deviation
        loss = torch.nn.functional.cross_entropy(network(x).reshape(-1, len(CLASSES)), y.reshape(-1),
                                                 ignore_index=IGNORED, label_smoothing=0.05)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        schedule.step()
        total += loss.item()
        if step % 50 == 0:
            print(f"step {step} loss {total / 50:.3f} {time.time() - started:.0f} s", flush=True)
            total = 0.0
    return network.eval()


def report(network, clips, name):
    predicted = np.concatenate([network.scores(x).argmax(1).numpy()[y != IGNORED] for x, y in clips])
    wanted = np.concatenate([y[y != IGNORED] for _, y in clips])
    vowels = wanted < CLASSES["SIL"]
    recalls = " ".join(f"{v} {np.mean(predicted[wanted == k] == k):.2f}" for v, k in CLASSES.items()
                       if (wanted == k).any())
    print(f"{name}: five-way {np.mean((predicted == wanted)[vowels]):.3f}, merged "
          f"{np.mean((MERGED[predicted] == MERGED[wanted])[vowels]):.3f}; recall {recalls}", flush=True)


def rounded_to_half(network):
    with torch.no_grad():
        for layer in network.layers:  # the two biases of torch are one in the file
            layer.bias_ih_l0.copy_((layer.bias_ih_l0 + layer.bias_hh_l0).half().float())
            layer.bias_hh_l0.zero_()
        for parameter in network.parameters():
            parameter.copy_(parameter.half().float())
    return network


def weight_bytes(network, units):
    parts = [b"MPVOWEL1", struct.pack("<4I", FEATURES * (2 * CONTEXT + 1), 3, units, len(CLASSES))]
    parts += [v.numpy().astype("<f4").tobytes() for v in (network.mean, network.inverse_deviation)]
    for layer in network.layers:
        for matrix in (layer.weight_ih_l0, layer.weight_hh_l0, layer.bias_ih_l0):
            parts.append(matrix.detach().numpy().astype("<f2").tobytes())
    for matrix in (network.output.weight, network.output.bias):
        parts.append(matrix.detach().numpy().astype("<f2").tobytes())
    return b"".join(parts)


def write_example(network, path, rng):
    """A sound's features and what this framework answers, for tests/unit/vocal: counts, samples, features, shares."""
    sound, _ = modelled_singer(rng)
    sound = np.round(sound * 32767).astype(np.int16)[:3 * RATE]
    values = features(sound.astype(np.float32) / 32768)
    shares = torch.softmax(network.scores(values), 1).numpy()
    with open(path, "wb") as out:
        out.write(struct.pack("<2I", len(sound), len(values)) + sound.astype("<i2").tobytes() +
                  values.astype("<f4").tobytes() + shares.astype("<f4").tobytes())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", required=True, help="the folder singing_vowels")
    parser.add_argument("--hold-out", help="a singer to leave out of training and to report on")
    parser.add_argument("--out", help="weights to write")
    parser.add_argument("--example", help="features and outputs to write for the test")
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--units", type=int, default=64)
    parser.add_argument("--rate", type=float, default=2e-3)
    parser.add_argument("--copies", type=int, default=6)
    args = parser.parse_args()
    torch.set_num_threads(1)
    torch.manual_seed(0)
    rng = np.random.default_rng(1)
    files = singer_files(args.data)
    groups = {singer: prepared([f for f in files if f[0] == singer], args.copies, rng, True)
              for singer in sorted({f[0] for f in files}) if singer != args.hold_out}
    groups["tts"] = prepared(tts_files(rng), 4, rng, False)
    groups["modelled"] = prepared([("modelled", *modelled_singer(rng)) for _ in range(250)], 1, rng, False, 0.05)
    network = rounded_to_half(train(groups, args, rng))
    if args.hold_out:
        report(network, prepared([f for f in files if f[0] == args.hold_out], 0, rng, True), args.hold_out)
    if args.out:
        with open(args.out + ".part", "wb") as out:
            out.write(weight_bytes(network, args.units))
        os.replace(args.out + ".part", args.out)
    if args.example:
        write_example(network, args.example, rng)


if __name__ == "__main__":
    main()
