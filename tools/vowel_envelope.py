"""Spectra of a voice without its pitch, as src/hearing/tags/vowel_envelope.cpp has them, number by number."""
import numpy as np

RATE, HOP, WINDOW, TRANSFORM = 16000, 160, 400, 512
BANDS = 26
LOWEST_HZ, HIGHEST_HZ = 80.0, 7600.0
FLOOR, SILENT = 1e-7, 1e-12

PITCH_WINDOW, PITCH_TRANSFORM = 640, 2048
SHORTEST_LAG, LONGEST_LAG = RATE // 800, RATE // 70
PITCH_TOP_HZ = 2500.0  # overtones above it do not tell the pitch
PERIODIC = 0.5         # a frame's autocorrelation at its period, at least
UNVOICED_HZ = 100.0
MARGIN = 64            # bins mirrored at both ends of a spectrum
LOWEST_LEVEL = -12.0   # nepers


def mel(hz):
    return 2595 * np.log10(1 + hz / 700.0)


def hz_of_mel(value):
    return 700 * (10 ** (value / 2595.0) - 1)


EDGES = hz_of_mel(np.linspace(mel(LOWEST_HZ), mel(HIGHEST_HZ), BANDS + 2))


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
    return bank


def frames_of(samples, length):
    """Every 10 ms the `length` samples around it; zero outside."""
    count = len(samples) // HOP + 1
    padded = np.concatenate([np.zeros(length // 2), samples, np.zeros(length + HOP)])
    return padded[np.arange(count)[:, None] * HOP + np.arange(length)]


def power_frames(samples):
    samples = np.asarray(samples, np.float64)
    emphasised = np.concatenate([samples[:1], samples[1:] - 0.97 * samples[:-1]])
    window = 0.54 - 0.46 * np.cos(2 * np.pi * np.arange(WINDOW) / (WINDOW - 1))
    return np.abs(np.fft.rfft(frames_of(emphasised, WINDOW) * window, TRANSFORM)) ** 2


def pitch(samples):
    """Hz of every frame, 0 where there is none: the highest peak of the normalised autocorrelation, short lags a little
    favoured; then the median of the voiced among seven frames, of which three must be."""
    window = 0.5 - 0.5 * np.cos(2 * np.pi * (np.arange(PITCH_WINDOW) + 0.5) / PITCH_WINDOW)
    frames = frames_of(np.asarray(samples, np.float64), PITCH_WINDOW)
    frames = (frames - frames.mean(1, keepdims=True)) * window
    power = np.abs(np.fft.rfft(frames, PITCH_TRANSFORM)) ** 2
    power *= np.arange(power.shape[1]) * RATE / PITCH_TRANSFORM < PITCH_TOP_HZ
    own = np.fft.irfft(np.abs(np.fft.rfft(window, PITCH_TRANSFORM)) ** 2)[:LONGEST_LAG + 1]
    r = np.fft.irfft(power)[:, :LONGEST_LAG + 1]
    r = r / (r[:, :1] + SILENT) / (own / own[0])
    lags = np.arange(SHORTEST_LAG, LONGEST_LAG)
    middle = r[:, SHORTEST_LAG:LONGEST_LAG]
    peak = (middle >= r[:, SHORTEST_LAG - 1:LONGEST_LAG - 1]) & (middle >= r[:, SHORTEST_LAG + 1:LONGEST_LAG + 1])
    score = np.where(peak, middle * (1 - 0.02 * np.log2(lags / SHORTEST_LAG)), -1)
    rows, best = np.arange(len(r)), score.argmax(1) + SHORTEST_LAG
    before, at, after = r[rows, best - 1], r[rows, best], r[rows, best + 1]
    bend = before - 2 * at + after
    shift = np.where(bend < 0, 0.5 * (before - after) / np.where(bend < 0, bend, 1), 0)
    found = np.where(score.max(1) > PERIODIC, RATE / (best + np.clip(shift, -1, 1)), 0)
    padded = np.pad(found, 3)
    near = np.stack([padded[k:k + len(found)] for k in range(7)], 1)
    smoothed = np.zeros(len(found))
    for k in np.flatnonzero((near > 0).sum(1) >= 3):
        smoothed[k] = np.median(near[k][near[k] > 0])
    return smoothed


def without_harmonics(power, f0):
    """Each spectrum averaged under a triangle that reaches one f0 to both sides, which joins the harmonics' tops by
    straight lines; below f0 what it is there. The triangle is the second difference of a sum of sums."""
    width = np.clip(np.where(f0 > 0, f0, UNVOICED_HZ) * TRANSFORM / RATE, 1, MARGIN - 2)
    bins = power.shape[1]
    mirrored = np.concatenate([power[:, MARGIN:0:-1], power, power[:, -2:-MARGIN - 2:-1]], 1)
    sums = np.cumsum(np.cumsum(mirrored, 1), 1)

    def at(place):
        below = np.floor(place).astype(int)
        share = place - below
        return np.take_along_axis(sums, below, 1) * (1 - share) + np.take_along_axis(sums, below + 1, 1) * share

    place = np.arange(bins)[None] + MARGIN - 1 + np.zeros((len(power), 1))
    smooth = at(place + width[:, None]) - 2 * at(place) + at(place - width[:, None])
    smooth = np.maximum(smooth, 0) / width[:, None] ** 2
    lowest = np.minimum(np.ceil(width).astype(int), bins - 1)
    return np.take_along_axis(smooth, np.maximum(np.arange(bins)[None], lowest[:, None]), 1)


def envelopes(samples, warp=1.0):
    """(log mel energies without the harmonics, averaged over five frames; Hz). Relative to the loud frames."""
    f0 = pitch(samples)
    energy = without_harmonics(power_frames(samples), f0) @ filter_bank(warped_edges(warp)).T
    loud = np.quantile(energy.sum(1), 0.95) + SILENT
    level = np.maximum(np.log(energy / loud + FLOOR), LOWEST_LEVEL)
    padded = np.pad(level, ((2, 2), (0, 0)), "edge")
    return sum(padded[k:k + len(level)] for k in range(5)) / 5, f0
