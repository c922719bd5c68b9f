#!/usr/bin/env python3
"""Takes of a speaker made into another person's, to try `corpus adapt` on where there is one speaker only.

  made_person.py TRACKED OUT

TRACKED holds NAME.c3d, NAME.wav, NAME.txt as `corpus track` writes them; OUT gets NAME.csv beside copies of the others.
The head is held still. The made person's face is larger and wider; the lower lip and the jaw open less and come to an
end, the upper lip opens more, the left corner moves more than the right, the upper lip reaches further forward and
opens the mouth with it, and the jaw comes 20 ms later."""
import shutil
import sys
from pathlib import Path

import numpy as np

from measure_tracking import read_c3d, rigid, STABLE

SIZE = np.array([1.12, 0.98, 1.05])
MOST_OPEN_MM = 10.0
JAW_LATE_S = 0.020


def still(names, positions, reference):
    stable = [i for i, n in enumerate(names) if n.startswith(STABLE)]
    out = np.full_like(positions, np.nan)
    for frame, points in enumerate(positions):
        if not np.isnan(points[stable]).any():
            turn, shift = rigid(points[stable], reference[stable])
            out[frame] = points @ turn.T + shift
    return out


def later(values, seconds, rate):
    times = np.arange(len(values)) / rate
    return np.stack([np.interp(times - seconds, times, column) for column in values.T], axis=1)


def moved(name, move, rate):
    """move: frames x 3, from rest: x to the speaker's left, y up, z forward."""
    x, y, z = move.T.copy()
    if name.startswith(("CHIN", "JAW", "LIP_LO")):
        y = MOST_OPEN_MM * np.tanh(0.8 * y / MOST_OPEN_MM)
    if name.startswith("LIP_UP"):
        y, z = 1.8 * y + 0.35 * z, 1.6 * z
    if name.startswith("LIP_LO"):
        z = 0.7 * z
    if name.startswith("LIP_CORNER") or name.startswith("LIP") and not name.endswith("MID"):
        x = x * (1.3 if name.endswith("_L") else 0.5)
    move = np.stack([x, y, z], axis=1)
    return later(move, JAW_LATE_S, rate) if name.startswith(("CHIN", "JAW")) else move


def main():
    tracked, out = Path(sys.argv[1]), Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    takes = sorted(tracked.glob("*.c3d"))
    _, names, first = read_c3d(takes[0])
    reference = np.nanmedian(first, axis=0)
    clips = {take.stem: (read_c3d(take)[0], still(names, read_c3d(take)[2], reference)) for take in takes}
    # At rest: the twentieth of all frames whose lips are nearest to each other.
    every = np.concatenate([positions for _, positions in clips.values()])
    gap = np.linalg.norm(every[:, names.index("LIP_UP_MID")] - every[:, names.index("LIP_LO_MID")], axis=1)
    rest = np.nanmedian(every[gap <= np.nanquantile(gap, 0.05)], axis=0)
    middle = rest.mean(0)
    for stem, (rate, positions) in clips.items():
        made = np.stack([middle + SIZE * (rest[i] - middle + moved(name, positions[:, i] - rest[i], rate))
                         for i, name in enumerate(names)], axis=1)
        with open(out / f"{stem}.csv", "w", encoding="utf-8") as file:
            file.write("time_s," + ",".join(f"{n}.{a}" for n in names for a in "xyz") + "\n")
            for frame, points in enumerate(made):
                cells = ["" if np.isnan(v) else f"{v:.4f}" for v in points.ravel()]
                file.write(f"{frame / rate:.6f}," + ",".join(cells) + "\n")
        for ending in (".wav", ".txt", ".TextGrid"):
            if (tracked / (stem + ending)).exists():
                shutil.copy(tracked / (stem + ending), out)


if __name__ == "__main__":
    main()
