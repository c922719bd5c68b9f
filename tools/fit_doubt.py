#!/usr/bin/env python3
"""Fits src/hearing/alignment/doubt_weights.h: how far a text is believed that was aligned with a sound.

usage: fit_doubt.py EVIDENCE [HEADER]

EVIDENCE is what build/benchmarks/doubt_evidence writes. Lines of the sets *fit are learnt from, lines of the sets
*judge (other takes, other voices, other texts) only judged; without HEADER nothing is written. Needs python3-numpy.
"""
import collections
import sys

import numpy as np

KINDS = ("right", "other", "cut", "cutfront", "changed")
FALSE_ALARMS = 0.02  # of right lines of the *fit sets
PHONES = ("sil AA AE AH AO AW AY EH ER EY IH IY OW OY UH UW B CH D DH F G HH JH K L M N NG P R S SH T TH V W Y Z "
          "ZH").split()
# As WordFact and LineFact of src/hearing/alignment/text_doubt.h have them, and the bounds of its source file.
WORD_FACTS = ["match", "fit", "least fit", "longest", "untold", "line match", "few phones", "rival", "after"]
LINE_FACTS = ["worst word", "words", "match", "untold", "uneven", "worst 150", "worst 400", "longest", "unsteady"]
LEAST_RATIO, MOST_DEVIATIONS, MOST_BESIDE, MOST_UNTOLD, MOST_ODDS = 1e-3, 4, 0.3, 1.0, 8
SHORT_PART, LONG_PART = 15, 40
RIVAL_REACH, RIVAL_FRAME, RIVAL_PHONE, MOST_RIVAL = 10, 1.0, 1.0, 100
# So many frames a phone's ratios are drawn towards hearing the phone itself in most of its frames; so many phones
# towards what phones usually reach.
HELD_FRAMES, HELD_ITSELF, HELD_PHONES = 30, 0.7, 15


def read(path):
    """Sounds with posteriors, and the texts that were aligned with each; a phone: word (-1: silence), whether it is
    said (textsFor() in tests/bench/doubt_evidence_main.cpp), its number, first frame, frames, score."""
    data = open(path, "rb").read()
    lines, at = [], 0
    while at < len(data):
        end = data.index(b"\n", at)
        _, name, group, under, noise, unsteady, frames, size = data[at:end].decode().split()
        frames, size, at = int(frames), int(size), end + 1
        levels = np.frombuffer(data, np.uint8, frames * len(PHONES), at).reshape(frames, len(PHONES))
        at += levels.size
        sound = dict(name=name, fits=group.endswith("fit"), group=group, noise=float(noise), unsteady=float(unsteady), clean=under == "clean",
                     under=under, posteriors=np.exp(-levels.astype(np.float32) / 20))
        for row in data[at:at + size].decode().splitlines():
            part = row.split()
            if part[0] == "U":
                lines.append(dict(sound=sound, kind=part[1], phones=[]))
            else:
                lines[-1]["phones"].append(tuple(map(int, part[1:])))
        at += size
    return lines


def learnt_rights(lines):
    return [line for line in lines if line["sound"]["fits"] and line["sound"]["clean"] and line["kind"] == "right"]


def ratios_of(lines):
    """[p, q]: how much more often q is heard where p is said than at any time."""
    heard, frames, total = np.zeros((len(PHONES),) * 2), np.zeros(len(PHONES)), np.zeros(len(PHONES))
    for line in learnt_rights(lines):
        for _, _, phone, first, count, _ in line["phones"]:
            part = line["sound"]["posteriors"][first:first + count]
            heard[phone] += part.sum(0)
            frames[phone] += len(part)
            total += part.sum(0)
    usual = total / total.sum()
    held = HELD_ITSELF * np.eye(len(PHONES)) + (1 - HELD_ITSELF) * usual
    return (heard + HELD_FRAMES * held) / (frames[:, None] + HELD_FRAMES) / usual


def usual_phones(lines):
    """Per phone: means of the score a frame and of log(frames) in right texts, and their deviations."""
    seen = collections.defaultdict(list)
    for line in learnt_rights(lines):
        for word, _, phone, _, count, score in line["phones"]:
            if word >= 0:
                seen[phone].append((score / count, np.log(count)))
    every = np.concatenate([np.array(rows) for rows in seen.values()])
    mean, variance = every.mean(0), every.var(0)
    usual = []
    for phone in range(len(PHONES)):
        rows = np.array(seen.get(phone, [])).reshape(-1, 2)
        own = (rows.sum(0) + HELD_PHONES * mean) / (len(rows) + HELD_PHONES)
        spread = np.sqrt((((rows - own) ** 2).sum(0) + HELD_PHONES * variance) / (len(rows) + HELD_PHONES))
        usual.append(np.concatenate([own, spread]))
    return np.array(usual)


def least_mean(values, count):
    count = min(count, len(values))
    return np.convolve(values, np.ones(count) / count, "valid").min()


def rival_of(word, matches, path, before, after):
    """By how much any row of phones beats the word's own, each frame and phone of it at a price; its ends lie up to
    RIVAL_REACH frames beside the word's, whose neighbours then lose frames or keep their nearest phone longer."""
    start, end = word["first"], word["end"]
    low, high = max(0, start - RIVAL_REACH), min(len(matches), end + RIVAL_REACH)
    told = path[low:high]
    left = np.concatenate([path[low:start], matches[start:high, before]])
    right = np.concatenate([matches[low:end, after], path[end:high]])
    until, since = np.r_[0, np.cumsum(left)], np.r_[np.cumsum(right[::-1])[::-1], 0]
    best, rival = np.full(len(PHONES) - 1, -np.inf), -np.inf
    for t in range(high - low):
        enter = max(best.max(), until[t] if low + t <= min(start + RIVAL_REACH, end) else -np.inf)
        best = np.maximum(best, enter - RIVAL_PHONE) + matches[low + t, 1:] - RIVAL_FRAME
        if low + t + 1 >= max(end - RIVAL_REACH, start):
            rival = max(rival, best.max() + since[t + 1])
    phones = len(word["matches"])
    return min(rival - told.sum() + RIVAL_PHONE * phones, MOST_RIVAL) / np.sqrt(phones)


def word_facts(line, matches, usual):
    """Of each word facts and truth, and the line's own facts."""
    silence, noise = line["sound"]["posteriors"][:, 0], line["sound"]["noise"]
    words, frames, log_lengths, untold_before, untold_of_all = [], [], [], 0.0, 0.0
    path = np.zeros(len(matches))
    for k, (word, truth, phone, first, count, score) in enumerate(line["phones"]):
        first = min(first, len(matches) - 1)
        part = path[first:first + count] = matches[first:first + count, phone]
        frames.append(part)
        if words and (word < 0 or word == len(words)):
            words[-1].setdefault("after", phone)
        if word < 0:
            untold = 0.01 * len(part) * (1 - silence[first:first + count].mean())
            untold_of_all += untold
            if words:
                words[-1]["untold"] = max(words[-1]["untold"], untold)
            untold_before = max(untold_before, untold)
            continue
        if word == len(words):
            words.append(dict(matches=[], fits=[], lengths=[], untold=untold_before, truth=truth,
                              first=first, before=line["phones"][k - 1][2] if k else 0))
        untold_before = 0.0
        words[-1]["end"] = first + len(part)
        own, length = words[-1], np.log(len(part))
        fit, log_frames, fit_spread, log_spread = usual[phone]
        own["matches"].append(part.mean())
        own["fits"].append((score / len(part) - fit) / fit_spread)
        own["lengths"].append(np.clip((length - log_frames) / log_spread, -MOST_DEVIATIONS, MOST_DEVIATIONS))
        log_lengths.append(length)
    match = np.concatenate([word["matches"] for word in words]).mean()
    frames = np.concatenate(frames)
    facts = []
    for word in words:
        root = np.sqrt(len(word["matches"]))
        facts.append([sum(word["matches"]) / root, np.mean(word["fits"]), min(word["fits"]), max(word["lengths"]),
                      min(word["untold"], MOST_BESIDE), match, 1 / root,
                      rival_of(word, matches, path, word["before"], word.get("after", 0)),
                      path[word["end"]:word["end"] + RIVAL_REACH].mean() if word["end"] < len(path) else 0.0])
    own = [match, min(untold_of_all, MOST_UNTOLD), np.std(log_lengths), least_mean(frames, SHORT_PART),
           least_mean(frames, LONG_PART), max(max(word["lengths"]) for word in words), line["sound"]["unsteady"]]
    facts = np.array(facts)
    return with_noise(facts, noise), np.array([word["truth"] for word in words]), own


def with_noise(facts, noise):
    """Facts, the noisiness, and the facts again, so many times: weights go with the noisiness from one set to another."""
    return np.hstack([facts, np.full((len(facts), 1), noise), noise * facts])


def line_facts(odds, own, noise):
    odds = np.clip(odds, -MOST_ODDS, MOST_ODDS)
    return with_noise(np.array([[odds.min(), odds.mean(), *own]]), noise)[0]


def logistic(facts, right, weights, held=2.0):
    """Ridge-held logistic regression: constant and slopes, for the facts as they are."""
    mean, spread = facts.mean(0), facts.std(0) + 1e-9
    rows = np.c_[np.ones(len(facts)), (facts - mean) / spread]
    found = np.zeros(rows.shape[1])
    ridge = held * np.eye(len(found))
    ridge[0, 0] = 1e-6
    for _ in range(30):
        believed = 1 / (1 + np.exp(-np.clip(rows @ found, -30, 30)))
        gradient = rows.T @ (weights * (right - believed)) - ridge @ found
        curve = (rows * (weights * believed * (1 - believed))[:, None]).T @ rows + ridge
        found += np.linalg.solve(curve, gradient)
    slopes = found[1:] / spread
    return found[0] - slopes @ mean, slopes


def balanced(right):
    return np.where(right == 1, 1.0, (right == 1).sum() / max(1, (right == 0).sum()))


def fit_words(learnt):
    rows, right = [], []
    for line in learnt:
        for facts, truth in zip(line["facts"], line["truth"]):
            # 2: a word of another line that this line has, too; 3: beside what was cut off.
            if truth == 2 or (truth == 1 and line["kind"] != "right"):
                continue
            rows.append(facts)
            right.append(1 if truth == 1 else 0)
    right = np.array(right)
    return logistic(np.array(rows), right, balanced(right))


def threshold_of(rights, allowed):
    """Odds that `allowed` of right lines are under: constant, slope by noise, slope by unsteady noise."""
    odds, noise, unsteady = (np.array(values) for values in zip(
        *[(line["odds"], line["sound"]["noise"], line["sound"]["unsteady"]) for line in rights]))
    clean = np.quantile(odds[noise < 0.1], allowed)
    steady = (noise >= 0.1) & (unsteady < 0.1)
    by_noise = np.quantile((odds[steady] - clean) / noise[steady], allowed)
    moving = unsteady >= 0.1
    return clean, by_noise, np.quantile((odds - clean - by_noise * noise)[moving] / unsteady[moving], allowed)


def table(lines, groups, under):
    for group in groups:
        cells = []
        for kind in KINDS:
            own = [line["odds"] < 0 for line in lines
                   if line["sound"]["group"] == group and under(line["sound"]) and line["kind"] == kind]
            cells.append(f"{100 * np.mean(own):.1f} of {len(own)}" if own else "-")
        yield [group] + cells


def main():
    lines = read(sys.argv[1])
    ratios, usual = ratios_of(lines), usual_phones(lines)
    aligned = [line for line in lines if line["phones"]]
    for line in aligned:
        sound = line["sound"]
        if "matches" not in sound:
            sound["matches"] = np.log(np.maximum(sound["posteriors"] @ ratios.T, LEAST_RATIO))
        line["facts"], line["truth"], line["own"] = word_facts(line, sound["matches"], usual)
    learnt = [line for line in aligned if line["sound"]["fits"]]
    word_constant, word_slopes = fit_words(learnt)
    for line in aligned:
        line["line"] = line_facts(word_constant + line["facts"] @ word_slopes, line["own"], line["sound"]["noise"])
    right = np.array([1 if line["kind"] == "right" else 0 for line in learnt])
    line_constant, line_slopes = logistic(np.array([line["line"] for line in learnt]), right, balanced(right))
    for line in lines:
        line["odds"] = line_constant + line["line"] @ line_slopes if line["phones"] else -99.0
    threshold = threshold_of([line for line in learnt if line["kind"] == "right"], FALSE_ALARMS)
    line_constant -= threshold[0]
    line_slopes[len(LINE_FACTS)] -= threshold[1]
    line_slopes[LINE_FACTS.index("unsteady")] -= threshold[2]
    for line in lines:
        line["odds"] = line_constant + line["line"] @ line_slopes if line["phones"] else -99.0
    print(f"{len(lines)} texts; doubted, %")
    groups = sorted({line["sound"]["group"] for line in lines})
    for title, under in [("clean", lambda sound: sound["clean"]), ("not clean", lambda sound: not sound["clean"])]:
        print("".join(f"{cell:>18}" for cell in (title,) + KINDS))
        for cells in table(lines, groups, under):
            print("".join(f"{cell:>18}" for cell in cells))
    for kind in sorted({line["sound"]["under"] for line in lines}):
        for cells in table(lines, [group for group in groups if group.endswith("judge")], lambda sound: sound["under"] == kind):
            print("".join(f"{cell:>18}" for cell in [kind] + cells))
    print("words:", word_constant, dict(zip(WORD_FACTS, np.round(word_slopes, 3))))
    print("lines:", line_constant, dict(zip(LINE_FACTS, np.round(line_slopes, 3))))
    if len(sys.argv) > 2:
        write(sys.argv[2], ratios, usual, (word_constant, word_slopes), (line_constant, line_slopes))


def write(path, ratios, usual, words, lines):
    def numbers(values):
        return ", ".join(f"{value:.4g}" for value in values)

    def floats(values):
        return ", ".join(f"{float(f'{value:.3g}')}F" for value in values)

    with open(path, "w") as out:
        out.write("""#pragma once

#include <array>

#include "hearing/alignment/text_doubt.h"

// Written by tools/fit_doubt.py from what build/benchmarks/doubt_evidence heard: do not edit.
// What was learnt from and what was only judged: docs/theory/hearing/doubt.md.

namespace mouthpiece {

/// What a phone reaches in right texts: the decoder's score a frame and the logarithm of its frames; means, deviations.
struct UsualPhone {
  double fit, log_frames, fit_spread, log_frames_spread;
};

/// By phone.
inline constexpr std::array<UsualPhone, kPhoneCount> kUsualPhones{{
""")
        for phone, row in zip(PHONES, usual):
            out.write(f"    {{{numbers(row)}}},  // {phone}\n")
        out.write("""}};

/// How much more often the phone of a column is heard where the phone of a row is said than at any time.
// clang-format off
inline constexpr std::array<float, kPhoneCount * kPhoneCount> kHeardRatios{
""")
        for phone, row in zip(PHONES, ratios):
            out.write(f"    {floats(row)},  // {phone}\n")
        out.write("""};
// clang-format on

/// Of the logarithm of the odds; slopes by WordFact or LineFact.
template <typename Facts>
struct Evidence {
  double constant;
  Facts slopes;
};
template <typename Facts>
struct Weights {
  Evidence<Facts> in_silence, more_in_noise;  ///< the second times the noisiness
};
""")
        for name, (constant, slopes) in (("Word", words), ("Line", lines)):
            count = len(slopes) // 2
            out.write(f"inline constexpr Weights<{name}Facts> k{name}Weights{{\n"
                      f"    {{{constant:.5g}, {{{numbers(slopes[:count])}}}}},\n"
                      f"    {{{slopes[count]:.5g}, {{{numbers(slopes[count + 1:])}}}}}}};\n")
        out.write("\n}  // namespace mouthpiece\n")


if __name__ == "__main__":
    main()
