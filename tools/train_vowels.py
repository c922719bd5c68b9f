#!/usr/bin/python3
"""Trains the vowel network (docs/theory/hearing/vowel_training.md) and writes its weights.

    apt-get install python3-torch python3-numpy libopenblas0-pthread sox libsox-fmt-all festival festvox-italp16k \\
        festvox-itapc16k festvox-suopuhe-lj festvox-suopuhe-mv festvox-czech-dita festvox-czech-krb \\
        festvox-czech-machac festvox-czech-ph festvox-ca-ona-hts klettres-data praat tuxpaint-stamps-default espeak-ng
    tools/train_vowels.py --data ../shared/singing_vowels --leave-one-out    what it reaches on singers left out, each
    tools/train_vowels.py --data ../shared/singing_vowels --out src/hearing/tags/vowel_network.weights

The features are those of src/hearing/tags/vowel_spectra.cpp, number by number.
"""
import argparse
import os
import struct
import time

import numpy as np
import torch

import vowel_adaptation
import vowel_perceptron
import vowel_speech
from vowel_envelope import (BANDS, EDGES, FLOOR, RATE, SILENT, TRANSFORM, envelopes, filter_bank, power_frames,
                            warped_edges)
from vowel_sounds import (CLASSES, IGNORED, augmented, letter_files, measured_people, modelled_files, modelled_singer,
                          singer_files, tts_files)

HOP, MFCCS, CONTEXT = 160, 13, 12
FEATURES = MFCCS + 2 * BANDS
LOUD_RANGE, TAKEN_OFF_MEAN = 5.0, 0.5
MERGED = np.array([0, 1, 1, 2, 2, 3])
# Of a group: copies beside the plain sounds, how far formants are moved, its share of the sequences, how much a sound
# of it tells about voices.
GROUPS = {"singers": (5, 0.26, 0.55, 1.0), "letters": (3, 0.2, 0.2, 0.5), "tts": (2, 0.2, 0.1, 0.4),
          "modelled": (1, 0.05, 0.15, 0.15), "speech": (2, 0.2, 0.05, 0.6), "consonants": (2, 0.2, 0.35, 0.0)}
RECURRENT_GROUPS = ("singers", "letters", "tts", "modelled")  # what the recurrent networks hear
ALIGNING_GROUPS = ("letters", "tts", "modelled", "consonants")
SEED = 1
AVERAGED = 0.985  # of the weights so far in the running mean that is kept
VOICE_COPIES = 3  # plain and copied sounds that the prior of voices is learnt from

# ---- features

COSINES = np.sqrt(2.0 / BANDS) * np.cos(np.pi * np.arange(MFCCS)[:, None] * (np.arange(BANDS) + 0.5) / BANDS)


def raw_features(samples, warp=1.0):
    edges = warped_edges(warp)
    bank = filter_bank(edges)
    bank_hz = bank * np.arange(TRANSFORM // 2 + 1) * RATE / TRANSFORM
    power = power_frames(samples)
    energy, moment = power @ bank.T, power @ bank_hz.T
    loud = np.quantile(energy.sum(1), 0.95) + SILENT
    relative = energy / loud
    log_mel = np.log(relative + FLOOR)
    centroid = (moment / loud - relative * edges[1:-1]) / (relative + FLOOR) / ((edges[2:] - edges[:-2]) / 2)
    return np.hstack([log_mel @ COSINES.T, log_mel, centroid])


def taken_off(values, bands):
    """Half of the mean of the frames that are loud by these bands."""
    loudest = bands.max(1)
    return TAKEN_OFF_MEAN * values[loudest > np.quantile(loudest, 0.95) - LOUD_RANGE].mean(0)


def features(samples, warp=1.0):
    values = raw_features(samples, warp)
    return (values - taken_off(values, values[:, MFCCS:MFCCS + BANDS])).astype(np.float32)


def targets(intervals, frames, stretch=1.0):
    classes, middle = np.full(frames, IGNORED, np.int64), np.arange(frames) * HOP / RATE
    for start, end, label in intervals:
        classes[(middle >= start * stretch) & (middle < end * stretch)] = label
    return classes


class Clip:
    """A sound, plain or copied: features and classes for the network, envelopes for the prior of voices."""

    def __init__(self, group, who, copy, samples, intervals, rng):
        _, spread, _, _ = GROUPS[group]
        sound, warp, stretch = augmented(samples, rng, spread) if copy else (samples, 1.0, 1.0)
        self.group, self.who, self.copy = group, who, copy
        self.features = features(sound, warp)
        self.classes = targets(intervals, len(self.features), stretch)
        self.level, self.f0 = envelopes(sound, warp) if copy <= VOICE_COPIES else (None, None)

    def columns(self):
        return vowel_perceptron.columns(self.features[:, MFCCS:MFCCS + BANDS], self.level, taken_off)


def clips_of(group, files, rng):
    clips = [Clip(group, who, copy, samples, intervals, rng) for copy in range(GROUPS[group][0] + 1)
             for who, samples, intervals in files]
    return [clip for clip in clips if (clip.classes != IGNORED).any()]


def prepared(data, rng):
    sounds = {"singers": singer_files(data), "letters": letter_files(rng), "tts": tts_files(rng),
              "modelled": modelled_files(rng)}
    clips = [clip for group, files in sounds.items() for clip in clips_of(group, files, rng)]
    return clips + clips_of("speech", speech(clips, np.random.default_rng(SEED)), np.random.default_rng(SEED))


def speech(clips, rng):
    """What people read aloud, aligned with its text by networks that heard no singer."""
    syllables = clips_of("consonants", tts_files(rng, 12, (0.9, 1.6), True), rng)
    voices = heard([clip for clip in clips + syllables if clip.group in ALIGNING_GROUPS])

    def columns_of(samples):
        clip = Clip("speech", "", 0, samples, [], rng)
        return clip.columns(), clip.f0

    return vowel_speech.speech_files(vowel_speech.aligners(voices), columns_of)


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


def joined_batch(voices, names, shares, rng, size=32, pieces=2, length=50):
    """Clips joined, so that any vowel can follow any other (VOCAL 4.3)."""
    inputs, classes = [], []
    for _ in range(size):
        values, labels = [], []
        for _ in range(pieces):
            voice = voices[names[rng.choice(len(names), p=shares)]]
            one = voice[rng.integers(len(voice))]
            clip, clip_labels = one.features, one.classes
            labelled = np.flatnonzero(clip_labels != IGNORED)
            frames = labelled[rng.integers(len(labelled))] - rng.integers(length) + np.arange(length)
            inside = (frames >= 0) & (frames < len(clip))
            frames = np.clip(frames, 0, len(clip) - 1)
            values.append(clip[frames])
            labels.append(np.where(inside, clip_labels[frames], IGNORED))
        inputs.append(np.pad(np.concatenate(values), ((CONTEXT, CONTEXT), (0, 0)), "edge"))
        classes.append(np.concatenate(labels))
    return torch.tensor(np.stack(inputs)), torch.tensor(np.stack(classes))


def hidden(x, mean, rng):
    """Sequences of which some columns are the mean: a kind of feature (SSC most often), or neighbouring bands."""
    mask = np.ones((len(x), 1, FEATURES), np.float32)
    for row in mask[:, 0]:
        kind = rng.random()
        if kind < 0.7:
            row[MFCCS + BANDS:] = 0
            if kind < 0.2:
                row[:MFCCS] = 0
        elif kind < 0.8:
            row[MFCCS:MFCCS + BANDS] = 0
        if rng.random() < 0.5:
            first = MFCCS + rng.integers(BANDS - 2)
            last = min(first + rng.integers(1, 7), MFCCS + BANDS)
            row[first:last] = row[first + BANDS:last + BANDS] = 0
    return mean + (x - mean) * torch.tensor(mask)


def voices_of(clips):
    """{(group, who): clips}, and what share of the training each has."""
    voices = {}
    for clip in clips:
        voices.setdefault((clip.group, clip.who), []).append(clip)
    shares = {name: GROUPS[name[0]][2] / sum(other[0] == name[0] for other in voices) for name in voices}
    return voices, {name: share / sum(shares.values()) for name, share in shares.items()}


def train(clips, args, seed):
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    voices, share_of = voices_of(clips)
    names = sorted(voices)
    shares = np.array([share_of[name] for name in names])
    every = np.concatenate([clip.features for voice in voices.values() for clip in voice[:100]])
    network = VowelNetwork(args.units, torch.tensor(every.mean(0)), torch.tensor(1 / (every.std(0) + 1e-2)))
    optimiser = torch.optim.Adam(network.parameters(), args.rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, args.steps, args.rate / 5)
    averaged = [parameter.detach().clone() for parameter in network.parameters()]
    started, total = time.time(), 0.0
    for step in range(1, args.steps + 1):
        x, y = joined_batch(voices, names, shares, rng)
        x = hidden(x + 0.15 * torch.randn(len(x), 1, FEATURES) / network.inverse_deviation, network.mean, rng)
        loss = torch.nn.functional.cross_entropy(network(x).reshape(-1, len(CLASSES)), y.reshape(-1),
                                                 ignore_index=IGNORED, label_smoothing=0.05)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        schedule.step()
        with torch.no_grad():
            for mean, parameter in zip(averaged, network.parameters()):
                mean.lerp_(parameter, max(1 - AVERAGED, 1 / (step + 1)))
        total += loss.item()
        if step % 50 == 0:
            print(f"step {step} loss {total / 50:.3f} {time.time() - started:.0f} s", flush=True)
            total = 0.0
    with torch.no_grad():
        for mean, parameter in zip(averaged, network.parameters()):
            parameter.copy_(mean)
    return network.eval()


def heard(clips):
    """What the perceptrons hear of the clips: {voice: (share of the frames, [(columns, labels)])}."""
    voices, share_of = voices_of([clip for clip in clips if clip.level is not None])
    return {name: (share_of[name], [(clip.columns(), clip.classes) for clip in voice])
            for name, voice in voices.items()}


def trained(clips, args):
    """(recurrent networks, perceptrons)"""
    recurrent = [clip for clip in clips if clip.group in RECURRENT_GROUPS]
    voices = heard(clips)
    return ([rounded_to_half(train(recurrent, args, SEED + k)) for k in range(args.networks)],
            [vowel_perceptron.train(voices, SEED + k) for k in range(vowel_perceptron.COUNT)])


def voice_prior(clips):
    return vowel_adaptation.learn([(GROUPS[clip.group][3], clip.level, clip.classes) for clip in clips
                                   if clip.level is not None], np.random.default_rng(SEED))


def shares_of(networks, prior, clip):
    """Frames x 6 by the networks alone, and adapted to the clip's voice."""
    recurrent = np.mean([torch.softmax(network.scores(clip.features), 1).numpy() for network in networks[0]], 0)
    framewise = np.mean([network.shares(clip.columns()) for network in networks[1]], 0)
    share = vowel_perceptron.RECURRENT_SHARE
    alone = share * recurrent + (1 - share) * framewise
    return alone, vowel_adaptation.adapted(prior, clip.level, clip.f0, alone)


def rates(predicted, wanted):
    vowels = wanted < CLASSES["SIL"]
    recalls = [np.mean(predicted[wanted == k] == k) for k in CLASSES.values() if (wanted == k).any()]
    return [np.mean((predicted == wanted)[vowels]), np.mean((MERGED[predicted] == MERGED[wanted])[vowels])] + recalls


def report(networks, prior, clips, name):
    """Each file by itself, by the networks and adapted; and adapted as if all files were one recording, as a song is."""
    answers = [shares_of(networks, prior, clip) for clip in clips]
    alone, adapted = (np.concatenate([answer[which] for answer in answers]) for which in (0, 1))
    level, f0, wanted = (np.concatenate([getattr(clip, part) for clip in clips]) for part in ("level", "f0", "classes"))
    kinds = {"networks alone": alone, "adapted": adapted,
             "one recording": vowel_adaptation.adapted(prior, level, f0, alone)}
    result = []
    for kind, shares in kinds.items():
        result.append(rates(shares.argmax(1)[wanted != IGNORED], wanted[wanted != IGNORED]))
        print(f"{name}, {kind}: five-way {result[-1][0]:.3f}, merged {result[-1][1]:.3f}; recall",
              " ".join(f"{v} {r:.2f}" for v, r in zip(CLASSES, result[-1][2:])), flush=True)
    return [r[:2] for r in result]


def rounded_to_half(network):
    with torch.no_grad():
        for layer in network.layers:  # the two biases of torch are one in the file
            layer.bias_ih_l0.copy_((layer.bias_ih_l0 + layer.bias_hh_l0).half().float())
            layer.bias_hh_l0.zero_()
        for parameter in network.parameters():
            parameter.copy_(parameter.half().float())
    return network


def weight_bytes(networks, prior, units):
    recurrent, perceptrons = networks
    parts = [b"MPVOWEL3", struct.pack("<5I", len(recurrent), FEATURES * (2 * CONTEXT + 1), 3, units, len(CLASSES))]
    for network in recurrent:
        parts += [v.numpy().astype("<f4").tobytes() for v in (network.mean, network.inverse_deviation)]
        for layer in network.layers:
            for matrix in (layer.weight_ih_l0, layer.weight_hh_l0, layer.bias_ih_l0):
                parts.append(matrix.detach().numpy().astype("<f2").tobytes())
        for matrix in (network.output.weight, network.output.bias):
            parts.append(matrix.detach().numpy().astype("<f2").tobytes())
    return b"".join(parts) + vowel_perceptron.weight_bytes(perceptrons) + prior.bytes()


def write_example(networks, prior, path, rng):
    """A sound and what is made of it here, for tests/unit/hearing: counts, samples, features, shares, envelopes, f0,
    adapted shares."""
    sound, _ = modelled_singer(measured_people()[40], rng)
    sound = np.round(sound * 32767).astype(np.int16)[:3 * RATE]
    clip = Clip("modelled", "", 0, sound.astype(np.float32) / 32768, [], rng)
    alone, adapted = shares_of(networks, prior, clip)
    with open(path, "wb") as out:
        out.write(struct.pack("<2I", len(sound), len(clip.features)) + sound.astype("<i2").tobytes())
        for values in clip.features, alone, clip.level, clip.f0, adapted:
            out.write(values.astype("<f4").tobytes())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", required=True, help="the folder singing_vowels")
    parser.add_argument("--leave-one-out", action="store_true", help="train without each singer in turn, and report")
    parser.add_argument("--out", help="weights to write")
    parser.add_argument("--example", help="a sound and the answers to it to write for the test")
    parser.add_argument("--steps", type=int, default=260)
    parser.add_argument("--units", type=int, default=64)
    parser.add_argument("--rate", type=float, default=2e-3)
    parser.add_argument("--networks", type=int, default=2, help="that begin differently and are averaged")
    args = parser.parse_args()
    torch.set_num_threads(1)
    clips = prepared(args.data, np.random.default_rng(SEED))
    if args.leave_one_out:
        results = []
        for singer in sorted({clip.who for clip in clips if clip.group == "singers"}):
            others = [clip for clip in clips if clip.who != singer]
            held_out = [clip for clip in clips if clip.who == singer and clip.copy == 0]
            results.append(report(trained(others, args), voice_prior(others), held_out, singer))
        print("mean five-way and merged, networks alone, adapted, one recording:", np.mean(results, 0).round(3).tolist())
    if args.out or args.example:
        networks, prior = trained(clips, args), voice_prior(clips)
    if args.out:
        with open(args.out + ".part", "wb") as out:
            out.write(weight_bytes(networks, prior, args.units))
        os.replace(args.out + ".part", args.out)
    if args.example:
        write_example(networks, prior, args.example, np.random.default_rng(SEED))


if __name__ == "__main__":
    main()
