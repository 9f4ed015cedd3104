"""Trains the network for two contacts from pairs that the example `pairs` has solved.

    python calibration/python/train_pairs.py pairs.csv sensor/data/pairs-8v.bin

Needs NumPy. The last tenth of the pairs is held out: the covariance that the network leaves comes
from them. `sensor/src/force/forward/pair/interaction.rs` has the file's format.
"""

import argparse
import struct
import time

import numpy as np

# Neurons of a hidden layer: the sensor's network has no others.
WIDTH = 192
# The dots of the layout 8v, mm.
PLACES = np.array([
    [-7.0, -4.5], [7.0, -4.5], [7.0, 4.5], [-7.0, 4.5], [-2.5, 0.0], [0.0, -2.4], [2.5, 0.0],
    [0.0, 2.4],
])
# |F| = LINEAR_N * s + s**3 at a size s, N.
LINEAR_N = 0.01
# The distance at which the factor is half of the largest, mm.
FAR_MM = 1.0
BATCH = 512
FASTEST, SLOWEST = 3e-3, 1e-6
# Focal length of the camera at 320x240, px.
FOCAL_PX = 175.0


def size_of(force_n):
    """The sizes of forces, N."""
    size = np.cbrt(force_n)
    for _ in range(30):
        size -= (LINEAR_N * size + size**3 - force_n) / (LINEAR_N + 3 * size**2)
    return size


def tilt_of(force, force_n):
    """Tilts along x and y, rad."""
    angle = np.arccos(-force[:, 2] / force_n)
    sideways = np.maximum(np.linalg.norm(force[:, :2], axis=1), 1e-12)
    return force[:, :2] * (angle / sideways)[:, None]


def images_of(pairs):
    """(inputs, motions): of pairs and their mirror images, in both orders.

    Inputs: size of both, the first one's part, tilts of both, places of both. Motions: what the
    mean of single contacts leaves, focal lengths.
    """
    forces, places = [pairs[:, 0:3], pairs[:, 3:6]], [pairs[:, 6:8], pairs[:, 8:10]]
    sizes_n = [np.linalg.norm(force, axis=1) for force in forces]
    tilts = [tilt_of(force, size_n) for force, size_n in zip(forces, sizes_n)]
    size, part = size_of(sum(sizes_n)), sizes_n[0] / sum(sizes_n)
    left = (pairs[:, 10:42] - pairs[:, 42:74]).reshape(-1, 16, 2)
    inputs, motions = [], []
    for exchanged in (False, True):
        # Mirrored in the diagonal, a pair moves the dots as it moves those of the mirrored layout.
        moved = left[:, 8:, ::-1] if exchanged else left[:, :8]
        axes = [1, 0] if exchanged else [0, 1]
        first, second, here, there = [vector[:, axes] for vector in tilts + places]
        for way in np.array([[1, 1], [-1, 1], [1, -1], [-1, -1]]):
            from_dots = [
                int(np.argmin(np.linalg.norm(PLACES - place * way, axis=1))) for place in PLACES
            ]
            motion = (moved[:, from_dots] * way).reshape(-1, 16)
            one = [first * way, second * way, here * way, there * way]
            two = [second * way, first * way, there * way, here * way]
            inputs += [np.column_stack([size, part, *one]), np.column_stack([size, 1 - part, *two])]
            motions += [motion, motion]
    return np.concatenate(inputs), np.concatenate(motions)


def factor_of(inputs):
    """The factor on the network's outputs: 0 where the mean of single contacts is exact."""
    size, part = inputs[:, 0], inputs[:, 1]
    square = np.sum((inputs[:, 6:8] - inputs[:, 8:10]) ** 2, axis=1)
    return size * 4 * part * (1 - part) * square / (square + FAR_MM**2)


class Network:
    """Layers with x / (1 + |x|) between them."""

    def __init__(self, widths, random):
        pairs = list(zip(widths, widths[1:]))
        self.weights = [
            random.normal(0, 1 / np.sqrt(a), (a, b)).astype(np.float32) for a, b in pairs
        ]
        self.biases = [np.zeros(b, np.float32) for _, b in pairs]

    def forward(self, inputs):
        """(values that enter each layer, slopes between layers, outputs)."""
        values, slopes = [inputs], []
        for weights, bias in zip(self.weights[:-1], self.biases[:-1]):
            total = values[-1] @ weights + bias
            part = 1 / (1 + np.abs(total))
            values.append(total * part)
            slopes.append(part * part)
        return values, slopes, values[-1] @ self.weights[-1] + self.biases[-1]

    def gradients(self, values, slopes, by_outputs):
        """Gradients by weights, then by biases."""
        of_weights, of_biases = [], []
        for layer in reversed(range(len(self.weights))):
            of_weights.append(values[layer].T @ by_outputs)
            of_biases.append(by_outputs.sum(axis=0))
            if layer > 0:
                by_outputs = (by_outputs @ self.weights[layer].T) * slopes[layer - 1]
        return of_weights[::-1] + of_biases[::-1]


def train(network, inputs, factor, motions, passes, report):
    """Adam, with a rate that falls as a cosine."""
    random = np.random.default_rng(1)
    parameters = network.weights + network.biases
    means = [np.zeros_like(one) for one in parameters]
    squares = [np.zeros_like(one) for one in parameters]
    batches = len(inputs) // BATCH
    for number in range(passes):
        order = random.permutation(len(inputs))
        for batch in range(batches):
            step = number * batches + batch
            rows = order[batch * BATCH:(batch + 1) * BATCH]
            values, slopes, outputs = network.forward(inputs[rows])
            off = outputs * factor[rows] - motions[rows]
            gradients = network.gradients(values, slopes, off * factor[rows] * (4 / BATCH))
            rate = SLOWEST + FASTEST * (0.5 + 0.5 * np.cos(np.pi * step / (passes * batches)))
            for one, gradient, mean, square in zip(parameters, gradients, means, squares):
                mean += 0.1 * (gradient - mean)
                square += 0.001 * (gradient * gradient - square)
                root = np.sqrt(square / (1 - 0.999 ** (step + 1)))
                one -= np.float32(rate) * (mean / (1 - 0.9 ** (step + 1))) / (root + 1e-8)
        report(number)


def layer_bytes(weights, bias, times):
    """A layer's outputs, times a number."""
    parts = []
    for column, own in zip(weights.T * times, bias * times):
        step = np.abs(column).max() / 32767
        steps = np.round(column / step).astype("<i2")
        parts.append(struct.pack("<ff", own, step) + steps.tobytes())
    return b"".join(parts)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pairs")
    parser.add_argument("out")
    parser.add_argument("--passes", type=int, default=150)
    arguments = parser.parse_args()
    pairs = np.loadtxt(arguments.pairs, delimiter=",")
    held = max(1, len(pairs) // 10)
    (inputs, motions), (unseen, wanted) = images_of(pairs[:-held]), images_of(pairs[-held:])
    mean, deviation = inputs.mean(axis=0), inputs.std(axis=0)
    scaled = [((one - mean) / deviation).astype(np.float32) for one in (inputs, unseen)]
    factors = [factor_of(one) for one in (inputs, unseen)]
    times = np.sqrt(np.mean((motions / factors[0][:, None]) ** 2))
    columns = [(times * one)[:, None].astype(np.float32) for one in factors]
    widths = [10, WIDTH, WIDTH, 16]
    network = Network(widths, np.random.default_rng(0))
    # The loss is in px, so that gradients are neither tiny nor huge.
    in_px = [np.float32(FOCAL_PX) * one.astype(np.float32) for one in (motions, wanted)]
    px = [np.float32(FOCAL_PX) * one for one in columns]
    begun = time.process_time()

    def off(which):
        return network.forward(scaled[which])[2] * px[which] - in_px[which]

    def report(number):
        if number % 10 == 9:
            rms = [np.sqrt(np.mean(off(which) ** 2)) for which in (0, 1)]
            print(
                f"pass {number + 1}: {rms[0]:.4f} px, held out {rms[1]:.4f} px,"
                f" {time.process_time() - begun:.0f} s", flush=True,
            )

    train(network, scaled[0], px[0], in_px[0], arguments.passes, report)
    ratio = off(1) / FOCAL_PX / factors[1][:, None]
    worst = np.abs(off(1))
    print(f"held out: median {np.median(worst):.4f} px, worst {worst.max():.3f} px")
    left = np.linalg.cholesky(ratio.T @ ratio / len(ratio))
    numbers = [*PLACES.ravel()]
    for middle, wide in zip(mean, deviation):
        numbers += [middle, 1 / wide]
    with open(arguments.out, "wb") as file:
        file.write(bytes([widths[1], widths[2], len(PLACES), 0]))
        file.write(np.array([*numbers, FAR_MM], "<f4").tobytes())
        for layer, (weights, bias) in enumerate(zip(network.weights, network.biases)):
            file.write(layer_bytes(weights, bias, times if layer == 2 else 1.0))
        file.write(left[np.tril_indices(16)].astype("<f4").tobytes())


if __name__ == "__main__":
    main()
