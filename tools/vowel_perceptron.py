"""Small networks that hear a frame and four around it: mel bands as they are and without the pitch. They are averaged
with the recurrent ones (docs/theory/hearing/vowel_network.md), here and in src/hearing/tags/vowel_network.cpp, number by number."""
import struct

import numpy as np
import torch

from vowel_envelope import BANDS

OFFSETS = (-9, -4, 0, 4, 9)
COLUMNS = 2 * BANDS
HIDDEN = (128, 64)
CLASSES = 6
COUNT = 8
RECURRENT_SHARE = 0.1  # of the mean of both kinds
STEPS, FRAMES, RATE, LAST_RATE = 700, 400, 3e-3, 1e-4
NOISE = 0.2
SILENCE, SILENCE_SHARE = 5, 0.5  # a class that is easy


def columns(mel, level, take_off):
    """Frames x 52: mel bands of the features, and envelopes less a part of their loud frames' mean."""
    return np.hstack([mel, level - take_off(level, level)]).astype(np.float32)


def with_context(values, frames):
    return np.concatenate([values[np.clip(frames + offset, 0, len(values) - 1)] for offset in OFFSETS], 1)


class VowelPerceptron(torch.nn.Module):
    def __init__(self, mean, inverse_deviation, classes=CLASSES):
        super().__init__()
        self.register_buffer("mean", torch.tensor(mean))
        self.register_buffer("inverse_deviation", torch.tensor(inverse_deviation))
        sizes = (len(OFFSETS) * COLUMNS, *HIDDEN, classes)
        self.layers = torch.nn.ModuleList(torch.nn.Linear(a, b) for a, b in zip(sizes, sizes[1:]))

    def forward(self, x):
        x = (x - self.mean.repeat(len(OFFSETS))) * self.inverse_deviation.repeat(len(OFFSETS))
        if self.training:
            x = x + NOISE * torch.randn(x.shape)
        for layer, dropped in zip(self.layers, (0.1, 0.3, 0.3)):
            x = layer(torch.nn.functional.dropout(torch.relu(x) if layer is not self.layers[0] else x, dropped,
                                                  self.training))
        return x

    def shares(self, values):
        with torch.no_grad():
            return torch.softmax(self(torch.tensor(with_context(values, np.arange(len(values))))), 1).numpy()


def train(voices, seed, classes=CLASSES):
    """voices: {voice: (share of the frames, [(columns, labels)])}; every vowel of a voice is as frequent."""
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    inputs, wanted, pools, weights, at = [], [], [], [], 0
    for _, (share, clips) in sorted(voices.items()):
        x = np.concatenate([with_context(values, np.flatnonzero(labels >= 0)) for values, labels in clips])
        y = np.concatenate([labels[labels >= 0] for _, labels in clips])
        for label in range(classes):
            if (y == label).any():
                pools.append(at + np.flatnonzero(y == label))
                weights.append(share * (SILENCE_SHARE if label == SILENCE else 1))
        inputs.append(x)
        wanted.append(y)
        at += len(y)
    inputs, wanted = np.concatenate(inputs), torch.tensor(np.concatenate(wanted))
    middle = inputs[:, OFFSETS.index(0) * COLUMNS:][:, :COLUMNS]
    network = VowelPerceptron(middle.mean(0), 1 / (middle.std(0) + 1e-2), classes)
    optimiser = torch.optim.Adam(network.parameters(), RATE, weight_decay=1e-5)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, STEPS, LAST_RATE)
    weights = np.array(weights) / sum(weights)
    for _ in range(STEPS):
        counts = rng.multinomial(FRAMES, weights)
        chosen = np.concatenate([pool[rng.integers(len(pool), size=count)] for pool, count in zip(pools, counts)])
        loss = torch.nn.functional.cross_entropy(network(torch.tensor(inputs[chosen])), wanted[chosen],
                                                 label_smoothing=0.05)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.copy_(parameter.half().float())
    return network.eval()


def weight_bytes(networks):
    parts = [struct.pack("<4If", len(networks), len(OFFSETS) * COLUMNS, *HIDDEN, RECURRENT_SHARE)]
    for network in networks:
        parts += [v.numpy().astype("<f4").tobytes() for v in (network.mean, network.inverse_deviation)]
        for layer in network.layers:
            parts += [v.detach().numpy().astype("<f2").tobytes() for v in (layer.weight, layer.bias)]
    return b"".join(parts)
