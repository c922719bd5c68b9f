#!/usr/bin/env python3
"""What `corpus track` finds, against given takes of the same clips and against the sound.

  measure_tracking.py TRACKED [--given TAKES] [--labels TAKES]

TRACKED holds NAME.c3d and NAME.wav as `corpus track` writes them. --given: takes of the same clips; lips after one rigid
fit a take with a constant offset of each marker taken off, and how far the sounds are apart. --labels: NAME.TextGrid
with a tier `phones`; noise at rest, depth of /b p m/, and the correlation of lip opening with the sound."""
import argparse
import re
import struct
import wave
from pathlib import Path

import numpy as np

STABLE = ("FOREHEAD", "TEMPLE", "BROW", "CANTHUS", "NOSE_ROOT", "NOSE_BRIDGE", "NOSE_TIP")


def read_c3d(path):
    data = path.read_bytes()
    count, first, last = struct.unpack("<H2xHH", data[2:10])
    block, rate = struct.unpack("<H2xf", data[16:24])
    frames = last - first + 1
    samples = np.frombuffer(data, "<f4", frames * count * 4, (block - 1) * 512).reshape(frames, count, 4)
    positions = samples[:, :, :3].astype(float)
    positions[samples[:, :, 3] < 0] = np.nan
    names = next(m for m in re.finditer(rb"LABELS..\xff\x02(.)(.)", data, re.S) if m[2][0] == count)
    width, rows = names[1][0], names[2][0]
    labels = data[names.end():names.end() + width * rows]
    return rate, [labels[i * width:(i + 1) * width].decode().strip() for i in range(rows)], positions


def read_sound(path):
    with wave.open(str(path)) as file:
        return file.getframerate(), np.frombuffer(file.readframes(file.getnframes()), "<i2").astype(float) / 32768


def rigid(source, target):
    a, b = source.mean(0), target.mean(0)
    u, _, v = np.linalg.svd((source - a).T @ (target - b))
    turn = (u @ np.diag([1, 1, np.sign(np.linalg.det(u @ v))]) @ v).T
    return turn, b - turn @ a


def compare(name, tracked, given):
    _, names, ours = read_c3d(tracked / f"{name}.c3d")
    _, other_names, theirs = read_c3d(given / f"{name}.c3d")
    theirs = theirs[:, [other_names.index(n) for n in names]]
    count = min(len(ours), len(theirs))
    seen = ~(np.isnan(ours[:count]).any((1, 2)) | np.isnan(theirs[:count]).any((1, 2)))
    ours, theirs = ours[:count][seen], theirs[:count][seen]
    turn, shift = rigid(ours.reshape(-1, 3), theirs.reshape(-1, 3))
    error = ours @ turn.T + shift - theirs
    error -= error.mean(0)
    lips = [i for i, n in enumerate(names) if n.startswith("LIP_")]
    (rate, sound), (other_rate, other_sound) = read_sound(tracked / f"{name}.wav"), read_sound(given / f"{name}.wav")
    late = float("nan")
    if rate == other_rate:
        size = 2 ** int(np.ceil(np.log2(len(sound) + len(other_sound))))
        likeness = np.fft.irfft(np.fft.rfft(sound, size) * np.conj(np.fft.rfft(other_sound, size)))
        late = int(np.argmax(likeness))
        late = 1000 * (late - size if late > size / 2 else late) / rate
    return np.sqrt((error[:, lips] ** 2).sum(2).mean()), np.sqrt((error ** 2).sum(2).mean()), late


def phones(path):
    text = path.read_text()
    text = text[text.index('"phones"'):]
    rows = re.findall(r'xmin = ([\d.]+)\s+xmax = ([\d.]+)\s+text = "([^"]*)"', text)
    return [(float(a), float(b), c) for a, b, c in rows]


def still_head(names, positions):
    stable = [i for i, n in enumerate(names) if n.startswith(STABLE)]
    seen = np.flatnonzero(~np.isnan(positions).any((1, 2)))
    still = np.full_like(positions, np.nan)
    for frame in seen:
        turn, shift = rigid(positions[frame, stable], positions[seen[0], stable])
        still[frame] = positions[frame] @ turn.T + shift
    return still


def loudness(rate, sound, times):
    spectrum, pitch = np.fft.rfft(sound), np.fft.rfftfreq(len(sound), 1 / rate)
    spectrum[(pitch < 300) | (pitch > 3500)] = 0
    band = np.fft.irfft(spectrum, len(sound)) ** 2
    power = [band[max(0, int((t - 0.02) * rate)):int((t + 0.02) * rate) + 1].mean() for t in times]
    return 10 * np.log10(np.array(power) + 1e-9)


def facts(name, tracked, labels):
    rate, names, positions = read_c3d(tracked / f"{name}.c3d")
    positions = still_head(names, positions)
    gap = np.linalg.norm(positions[:, names.index("LIP_UP_MID")] - positions[:, names.index("LIP_LO_MID")], axis=1)
    said = phones(labels / f"{name}.TextGrid")
    depths = []
    for start, end, phone in said:
        window = gap[max(0, int(np.ceil((start - 0.06) * rate))):int((start + end) / 2 * rate) + 1]
        if phone in "BPM" and start > 0.3 and len(window) and not np.isnan(window).all():
            depths.append(np.nanmin(window))
    speech = [p for p in said if p[2] not in ("sil", "")]
    sound_rate, sound = read_sound(tracked / f"{name}.wav")
    frames = np.arange(int(speech[0][0] * rate), min(int(speech[-1][1] * rate), int(len(sound) / sound_rate * rate) - 1))
    frames = frames[~np.isnan(gap[frames])]
    r = np.corrcoef(gap[frames], loudness(sound_rate, sound, frames / rate))[0, 1]
    rest = positions[int(speech[-1][1] * rate) + 4:][:, [i for i, n in enumerate(names) if n.startswith("LIP_")]]
    bend = rest[2:] - 2 * rest[1:-1] + rest[:-2]
    noise = np.sqrt(np.nanmean(bend ** 2) / 6) if len(bend) > 3 else np.nan
    return noise, depths, r


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tracked", type=Path)
    parser.add_argument("--given", type=Path)
    parser.add_argument("--labels", type=Path)
    given = parser.parse_args()
    names = sorted(p.stem for p in given.tracked.glob("*.c3d"))
    if given.given:
        rows = {n: compare(n, given.tracked, given.given) for n in names if (given.given / f"{n}.c3d").exists()}
        for name, row in rows.items():
            print(f"{name}: lips {row[0]:.3f} mm, all {row[1]:.3f} mm, sound {row[2]:+.1f} ms late")
        table = np.array(list(rows.values()))
        print(f"{len(rows)} takes: lips median {np.median(table[:, 0]):.3f}, largest {table[:, 0].max():.3f} mm RMS; "
              f"sound off by at most {np.abs(table[:, 2]).max():.1f} ms")
    if given.labels:
        rows = [facts(n, given.tracked, given.labels) for n in names if (given.labels / f"{n}.TextGrid").exists()]
        depths = np.array(sum((r[1] for r in rows), []))
        print(f"{len(rows)} takes: lips at rest {np.nanmedian([r[0] for r in rows]):.3f} mm a coordinate; {len(depths)} closings "
              f"of /b p m/: {depths.mean():.2f} mm, scatter {depths.std():.2f} (quartiles "
              f"{np.percentile(depths, 25):.2f} {np.percentile(depths, 75):.2f}); opening with loudness r = "
              f"{np.mean([r[2] for r in rows]):.3f}")


if __name__ == "__main__":
    main()
