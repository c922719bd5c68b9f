"""How the vowels of one voice lie, found from a recording of it: the statistics are learnt here, and used here and in
src/hearing/tags/vowel_adaptation.cpp, number by number (docs/theory/hearing/vowel_network.md, "The voice of a recording")."""
import struct

import numpy as np

from vowel_envelope import BANDS

VOWELS, DIRECTIONS, STARTS, ROUNDS = 5, 8, 16, 10
SILENCE = 5
FRAME_COUNT, MOST_FRAMES = 0.04, 600  # a frame counts little, for its neighbours are like it; no recording counts more
VOICE_SHARE, NETWORK_SHARE = 0.5, 0.7
USUAL_SCATTER = 30.0  # frames' worth of belief that a vowel's own frames scatter by 1 in this recording too
REACH, ALIKE = 35, 12.0  # frames to both sides that a decision leans on, if they sound alike
NEAR, MOVING = 3, 4.0  # frames to both sides whose squared distance tells how far the sound moves
WIDE, LEAST_TRUST = 24.0, 0.5  # squared spread of a recording with several vowels; one vowel's is a third of it or less
FEWEST_FRAMES, LEAST_SHARE = 5, 1e-12


class VoicePrior:
    """P: bands to 8 directions in which a voice's vowels lie apart, a vowel's own frames scattered by 1; a normal
    distribution of the five means of a voice; and some voices drawn from it."""

    def __init__(self, directions, mean, covariance, starts):
        self.directions, self.mean, self.covariance, self.starts = (
            np.asarray(x, np.float32).astype(np.float64) for x in (directions, mean, covariance, starts))

    def bytes(self):
        return struct.pack("<2I", self.directions.shape[1], len(self.starts)) + b"".join(
            x.astype("<f4").tobytes() for x in (self.directions, self.mean, self.covariance, self.starts))


def learn(clips, rng):
    """clips: [(weight, envelopes, classes)]. Every clip is a voice, of which some vowels are known."""
    within, between = np.zeros((BANDS, BANDS)), np.zeros((BANDS, BANDS))
    within_count = between_count = 0
    voices = []
    for weight, level, classes in clips:
        means = {}
        for vowel in range(VOWELS):
            frames = level[classes == vowel]
            if len(frames) >= 8:
                means[vowel] = frames.mean(0)
                within += weight * (frames - means[vowel]).T @ (frames - means[vowel]) / len(frames)
                within_count += weight
        if len(means) >= 2:
            middle = np.mean(list(means.values()), 0)
            for mean in means.values():
                between += weight * np.outer(mean - middle, mean - middle)
                between_count += weight
        if means:
            voices.append((weight, means))
    whiten = np.linalg.inv(np.linalg.cholesky(within / within_count + 1e-3 * np.eye(BANDS)))
    _, vectors = np.linalg.eigh(whiten @ (between / between_count) @ whiten.T)
    directions = whiten.T @ vectors[:, ::-1][:, :DIRECTIONS]
    mean, count = np.zeros((VOWELS, DIRECTIONS)), np.zeros(VOWELS)
    for weight, means in voices:
        for vowel, value in means.items():
            mean[vowel] += weight * (value @ directions)
            count[vowel] += weight
    mean /= count[:, None]
    covariance, pairs = np.zeros((VOWELS, DIRECTIONS, VOWELS, DIRECTIONS)), np.zeros((VOWELS, VOWELS))
    for weight, means in voices:  # of the vowels that a voice has, pair by pair
        off = {vowel: value @ directions - mean[vowel] for vowel, value in means.items()}
        for one, first in off.items():
            for other, second in off.items():
                covariance[one, :, other] += weight * np.outer(first, second)
                pairs[one, other] += weight
    covariance = (covariance / pairs[:, None, :, None]).reshape(VOWELS * DIRECTIONS, -1)
    values, vectors = np.linalg.eigh(covariance)
    covariance = (vectors * np.maximum(values, 0.02)) @ vectors.T
    starts = rng.multivariate_normal(mean.ravel(), covariance, STARTS)
    return VoicePrior(directions, mean.ravel(), covariance, starts)


def log_shares(values):
    top = values.max(1, keepdims=True)
    sums = top[:, 0] + np.log(np.exp(values - top).sum(1))
    return values - sums[:, None], sums


def log_densities(places, mean, covariance, scatter=1.0):
    out = np.empty((len(places), VOWELS))
    for vowel in range(VOWELS):
        of = slice(vowel * DIRECTIONS, (vowel + 1) * DIRECTIONS)
        lower = np.linalg.cholesky(scatter * np.eye(DIRECTIONS) + covariance[of, of])
        off = np.linalg.solve(lower, (places - mean[of]).T)
        out[:, vowel] = -0.5 * (off * off).sum(0) - np.log(np.diag(lower)).sum()
    return out


def scattered(places, counts, mean, covariance):
    """By how much (squared, in each direction) the frames scatter about the means, never less than they usually do: a
    song's many pitches move a vowel."""
    apart = 0.0
    for vowel in range(VOWELS):
        of = slice(vowel * DIRECTIONS, (vowel + 1) * DIRECTIONS)
        apart += counts[:, vowel] @ ((places - mean[of]) ** 2).sum(1)
        apart += counts[:, vowel].sum() * np.trace(covariance[of, of])
    usual = USUAL_SCATTER * DIRECTIONS
    return max((usual + apart) / (usual + DIRECTIONS * counts.sum()), 1.0)


def fitted(prior, places, heard, shares, steady):
    """Expectation and maximisation from these shares of the frames. Returns the frames' shares and how well it all
    fits."""
    weight = FRAME_COUNT * min(1.0, MOST_FRAMES / max(steady.sum(), 1.0)) * steady
    precision, scatter = np.linalg.inv(prior.covariance), 1.0
    for _ in range(ROUNDS):
        inverse, drive = precision.copy(), precision @ prior.mean
        for vowel in range(VOWELS):
            of = slice(vowel * DIRECTIONS, (vowel + 1) * DIRECTIONS)
            counts = weight * shares[:, vowel]
            inverse[of, of] += counts.sum() / scatter * np.eye(DIRECTIONS)
            drive[of] += counts @ places / scatter
        covariance = np.linalg.inv(inverse)
        mean = covariance @ drive
        scatter = scattered(places, weight[:, None] * shares, mean, covariance)
        log, sums = log_shares(VOICE_SHARE * log_densities(places, mean, covariance, scatter) + NETWORK_SHARE * heard)
        shares = np.exp(log)
    off = mean - prior.mean
    return shares, weight @ sums - 0.5 * off @ precision @ off


def by_voices(prior, places, heard, steady):
    """The frames' shares by the voices found from what the network heard and from those known, each as it fits."""
    begins = [np.exp(heard)]
    for start in prior.starts:
        log, _ = log_shares(VOICE_SHARE * log_densities(places, start, np.zeros_like(prior.covariance)))
        begins.append(np.exp(log))
    fits = [fitted(prior, places, heard, begin, steady) for begin in begins]
    best = max(fit for _, fit in fits)
    weights = [np.exp(fit - best) for _, fit in fits]
    return sum(weight * shares for weight, (shares, _) in zip(weights, fits)) / sum(weights)


def trust(places, steady):
    """How far to believe the voice that was found: one vowel alone tells little of the others."""
    weight = steady / (steady.sum() + LEAST_SHARE)
    spread = weight @ ((places - weight @ places) ** 2).sum(1)
    return min(max(spread / WIDE, LEAST_TRUST), 1.0)


def adapted(prior, level, f0, shares):
    """The network's shares (frames x 6) as this voice's vowels have it; silence and its share stay."""
    shares = np.asarray(shares, np.float64)
    voiced = np.flatnonzero((shares.argmax(1) != SILENCE) & (f0 > 0))
    if len(voiced) < FEWEST_FRAMES:
        return shares
    everywhere = level @ prior.directions
    after, before = np.minimum(voiced + NEAR, len(level) - 1), np.maximum(voiced - NEAR, 0)
    steady = np.exp(-((everywhere[after] - everywhere[before]) ** 2).sum(1) / MOVING)
    places = everywhere[voiced]
    heard, _ = log_shares(np.log(shares[voiced, :VOWELS] + LEAST_SHARE))
    share = trust(places, steady)
    log = share * np.log(by_voices(prior, places, heard, steady) + LEAST_SHARE) + (1 - share) * heard
    leant, weights = np.zeros_like(log), np.zeros(len(log))
    for offset in range(-REACH, REACH + 1):
        other = np.clip(np.arange(len(log)) + offset, 0, len(log) - 1)
        near = np.exp(-((places[other] - places) ** 2).sum(1) / ALIKE) * (np.abs(voiced[other] - voiced) <= REACH)
        near *= np.arange(len(log)) + offset == other
        leant += near[:, None] * log[other]
        weights += near
    log, _ = log_shares(leant / weights[:, None])
    result = shares.copy()
    result[voiced, :VOWELS] = np.exp(log) * (1 - shares[voiced, SILENCE:])
    return result
