"""Trains the network for two contacts from pairs that the example `pairs` has solved.

    python calibration/python/train_pairs.py pairs.csv sensor/data/pairs-8v.bin

Needs NumPy. The last tenth of the pairs is held out. Then the example `pairs_left` puts into the
file what the sensor's model leaves. `sensor/src/force/forward/pair/` has the network and the file's
format.
"""

import argparse
import struct
import time

import numpy as np

# Channels of the hidden layers: the sensor's network has no others.
CHANNELS = [24, 128]
# The dots of the layout 8v.
DOTS = 8
# |F| = LINEAR_N * s + s**3 at a size s, N.
LINEAR_N = 0.01
# The distance at which the factor is half of the largest, mm.
FAR_MM = 1.0
BATCH = 512
FASTEST, SLOWEST = 1e-2, 1e-6
# Focal length of the camera at 320x240, px.
FOCAL_PX = 175.0
# Slopes count along random steps of this size, deviations of the inputs.
STEP = 0.3
# Errors above this count in proportion, not by their square, px.
FAR_OFF_PX = 0.1

# A parity is three bits: what changes its sign if x is mirrored (1), if y is (2), and if the
# contacts are exchanged (4). Those of the inputs: size, part, sums and differences of tilts and of
# places, along x and y.
PARITIES = np.array([0, 4, 1, 2, 5, 6, 1, 2, 5, 6])
SIGNS = np.array([[(-1.0) ** (a & b).bit_count() for a in range(8)] for b in range(8)])
# Sums and differences of tilts and places.
BOTH = np.eye(10)
for one in (2, 3, 6, 7):
    BOTH[np.ix_([one, one + 2], [one, one + 2])] = [[1, 1], [1, -1]]
# For each dot: its kind (corner, left, top), and the mirrors that take the kind's first dot to it.
IMAGES = [(0, 0), (0, 1), (0, 3), (0, 2), (1, 0), (2, 0), (1, 1), (2, 2)]


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


def inputs_of(numbers):
    """Size of both, the first one's part, tilts of both, places of both."""
    forces = [numbers[:, 0:3], numbers[:, 3:6]]
    sizes_n = [np.linalg.norm(force, axis=1) for force in forces]
    tilts = [tilt_of(force, size_n) for force, size_n in zip(forces, sizes_n)]
    size, part = size_of(sum(sizes_n)), sizes_n[0] / sum(sizes_n)
    return np.column_stack([size, part, *tilts, numbers[:, 6:10]])


def numbers_of(inputs):
    """The components of both forces, N, and both places, mm: what `inputs_of` takes."""
    together_n = LINEAR_N * inputs[:, 0] + inputs[:, 0] ** 3
    forces = []
    for part, tilt in ((inputs[:, 1], inputs[:, 2:4]), (1 - inputs[:, 1], inputs[:, 4:6])):
        angle = np.linalg.norm(tilt, axis=1)
        direction = np.column_stack([tilt * np.sinc(angle / np.pi)[:, None], -np.cos(angle)])
        forces.append((part * together_n)[:, None] * direction)
    return np.column_stack([*forces, inputs[:, 6:10]])


def by_inputs(inputs):
    """Slopes of the numbers by the inputs: pairs, numbers, inputs."""
    columns = []
    for step in 1e-5 * np.eye(10):
        columns.append((numbers_of(inputs + step) - numbers_of(inputs - step)) / 2e-5)
    return np.stack(columns, axis=2)


def known(pairs):
    """(inputs, motions, slopes) of pairs, and of the pairs mirrored in the diagonal.

    Inputs are as the network takes them, but not scaled. Motions are what the mean of single
    contacts leaves, px, with slopes by the inputs.
    """
    inputs = inputs_of(pairs[:, :10])
    both, mean = pairs[:, 10:].reshape(-1, 2, 11, 16, 2).transpose(1, 0, 2, 3, 4)
    left = FOCAL_PX * (both - mean)
    slopes = np.einsum("pndi,pnk->pkdi", left[:, 1:], by_inputs(inputs))
    results = [], [], []
    for axes in ([0, 1], [1, 0]):
        # Mirrored in the diagonal, a pair moves the dots as it moves those of the mirrored layout.
        dots = slice(DOTS * axes[0], DOTS * axes[0] + DOTS)
        order = [0, 1] + [first + axis for first in (2, 4, 6, 8) for axis in axes]
        moved = left[:, 0][:, dots][..., axes].reshape(-1, 16)
        by_order = slopes[:, :, dots][..., axes].reshape(-1, 10, 16)[:, order]
        for result, own in zip(results, (inputs[:, order] @ BOTH, moved, by_order)):
            result.append(own)
    inputs, moved, slopes = [np.concatenate(result) for result in results]
    return inputs, moved, np.einsum("pko,kl->plo", slopes, np.linalg.inv(BOTH))


def outputs_to_dots():
    """Motions of the dots by the network's outputs: parities, their outputs, coordinates.

    The outputs of a parity are x and y of the first corner, and that coordinate of the first left
    and of the first top dot which has this parity.
    """
    matrix = np.zeros((4, 4, 16))
    for parity in range(4):
        axes = [[0], [1], [parity >> 1], [1 - (parity & 1)]]
        for dot, (kind, image) in enumerate(IMAGES):
            outputs = [0, 1] if kind == 0 else [1 + kind]
            for output in outputs:
                (axis,) = axes[output]
                mirrored = -1 if image >> axis & 1 else 1
                matrix[parity, output, 2 * dot + axis] = mirrored * SIGNS[image, parity]
    return matrix


def factor_of(inputs):
    """The factor on the network's outputs, 0 where the mean of single contacts is exact, with its
    slopes by the inputs."""
    size, part, away = inputs[:, 0], inputs[:, 1], inputs[:, 8:10]
    square = np.sum(away**2, axis=1)
    whole = square + FAR_MM**2
    apart, parts = square / whole, 4 * part * (1 - part)
    slopes = np.zeros_like(inputs)
    slopes[:, 0] = parts * apart
    slopes[:, 1] = 4 * size * apart * (1 - 2 * part)
    slopes[:, 8:10] = (2 * size * parts * FAR_MM**2 / whole**2)[:, None] * away
    return size * parts * apart, slopes


class Network:
    """Two hidden layers, in which a pair and its seven images take part alike.

    Each channel of the first layer has a value for each image of the pair: it takes the image's
    inputs. Between layers the values are parted by parity, and each parity has its own weights.
    """

    def __init__(self, random):
        first, second = CHANNELS
        shapes = [(10, first), (1, first), (8, first, second), (1, second), (4, second, 4), (1, 4)]
        scales = [10**-0.5, 0.3, first**-0.5, 0, 0.5 * second**-0.5, 0]
        self.parameters = [
            random.normal(0, 1, shape).astype(np.float32) * np.float32(scale)
            for shape, scale in zip(shapes, scales)
        ]
        self.mix = (SIGNS / np.sqrt(8)).astype(np.float32)
        self.images = SIGNS[:, PARITIES].astype(np.float32)

    def forward(self, inputs, steps):
        """(outputs, their changes along steps of the inputs, what `gradients` needs)."""
        in_first, first_bias, in_second, second_bias, in_last, last_bias = self.parameters
        rows = np.concatenate([inputs, steps])
        # The first rows are values, the others changes.
        count = len(inputs)
        first = np.matmul(rows * self.images[:, None], in_first)
        first[:, :count] += first_bias
        values, first_slopes = bent(first, count)
        parted = np.tensordot(self.mix, values, 1)
        second = np.tensordot(self.mix, np.matmul(parted, in_second), 1)
        second[:, :count] += second_bias
        values, second_slopes = bent(second, count)
        last = np.tensordot(self.mix[:4], values, 1)
        outputs = np.matmul(last, in_last)
        outputs[0, :count] += last_bias[0]
        outputs = outputs.transpose(1, 0, 2).reshape(-1, 16)
        kept = rows, count, first_slopes, parted, second_slopes, last
        return outputs[:count], outputs[count:], kept

    def gradients(self, kept, by_outputs):
        """Gradients by the parameters."""
        _, _, in_second, _, in_last, _ = self.parameters
        rows, count, first_slopes, parted, second_slopes, last = kept
        by_outputs = by_outputs.reshape(-1, 4, 4).transpose(1, 0, 2)
        of_last = np.matmul(last.transpose(0, 2, 1), by_outputs)
        of_last_bias = by_outputs[0, :count].sum(axis=0)[None]
        by_values = np.matmul(by_outputs, in_last.transpose(0, 2, 1))
        by_second = by_bent(np.tensordot(self.mix[:4].T, by_values, 1), count, second_slopes)
        of_second_bias = by_second[:, :count].sum(axis=(0, 1))[None]
        by_second = np.tensordot(self.mix, by_second, 1)
        of_second = np.matmul(parted.transpose(0, 2, 1), by_second)
        by_values = np.matmul(by_second, in_second.transpose(0, 2, 1))
        by_first = by_bent(np.tensordot(self.mix, by_values, 1), count, first_slopes)
        of_first_bias = by_first[:, :count].sum(axis=(0, 1))[None]
        of_first = np.matmul((rows * self.images[:, None]).transpose(0, 2, 1), by_first).sum(axis=0)
        return [of_first, of_first_bias, of_second, of_second_bias, of_last, of_last_bias]


def bent(sums, count):
    """x / (1 + |x|) of the first rows, the changes in the others, and what `by_bent` needs."""
    part = 1 / (1 + np.abs(sums[:, :count]))
    slopes = part * part
    changes = sums[:, count:]
    values = np.concatenate([sums[:, :count] * part, slopes * changes], axis=1)
    return values, (slopes, -2 * np.sign(sums[:, :count]) * slopes * part * changes)


def by_bent(by_values, count, slopes):
    """Gradients by the sums from those by the values."""
    slope, of_slope = slopes
    by_sums = np.concatenate([slope * by_values[:, :count], slope * by_values[:, count:]], axis=1)
    by_sums[:, :count] += of_slope * by_values[:, count:]
    return by_sums


class Soap:
    """Adam in the bases of the gradients' covariances: SOAP (Vyas and others, 2024)."""

    # Parts of the past that a step keeps, and steps between two looks for bases.
    KEPT, EVERY = 0.95, 10

    def __init__(self, parameters):
        self.parameters = parameters
        self.moments = [None] * len(parameters)
        self.steps = 0

    def step(self, gradients, rate):
        """Takes a step against the gradients."""
        self.steps += 1
        for nth, gradient in enumerate(gradients):
            turned = np.swapaxes(gradient, -1, -2)
            sides = [gradient @ turned, turned @ gradient]
            if self.moments[nth] is None:
                bases = [np.linalg.eigh(side)[1] for side in sides]
                self.moments[nth] = [sides, bases, 0 * gradient, 0 * gradient]
                continue
            known_sides, bases, mean, square = self.moments[nth]
            left, right = bases
            mean += (1 - self.KEPT) * (gradient - mean)
            inside = np.swapaxes(left, -1, -2) @ np.stack([gradient, mean]) @ right
            square += (1 - self.KEPT) * (inside[0] ** 2 - square)
            # Both begin at zero.
            whole = 1 - self.KEPT ** (self.steps - 1)
            change = (inside[1] / whole) / (np.sqrt(square / whole) + 1e-8)
            self.parameters[nth] -= np.float32(rate) * (left @ change @ np.swapaxes(right, -1, -2))
            for known_side, side in zip(known_sides, sides):
                known_side += (1 - self.KEPT) * (side - known_side)
            if self.steps % self.EVERY == 0:
                pairs = zip(known_sides, bases)
                self.moments[nth][1] = [np.linalg.qr(side @ basis)[0] for side, basis in pairs]


class Data:
    """Pairs as the network takes them."""

    def __init__(self, pairs, scale=None):
        inputs, moved, slopes = known(pairs)
        # Mirror images and exchanged contacts leave a mean in the size alone, and a half in the
        # part.
        middle = np.where(np.arange(10) == 1, 0.5, inputs.mean(axis=0) * (PARITIES == 0))
        self.scale = scale or (middle, np.sqrt(np.mean((inputs - middle) ** 2, axis=0)))
        self.middle, self.deviation = self.scale
        self.inputs = ((inputs - self.middle) / self.deviation).astype(np.float32)
        self.factor, by_inputs = factor_of(inputs)
        self.factor = self.factor[:, None].astype(np.float32)
        self.by_inputs = (by_inputs * self.deviation).astype(np.float32)
        # In units in which the outputs' squares add up to those of the coordinates.
        matrix = outputs_to_dots().reshape(16, 16)
        self.norms = np.linalg.norm(matrix, axis=1)
        self.to_dots = (matrix / self.norms[:, None]).astype(np.float32)
        self.moved = (moved @ self.to_dots.T).astype(np.float32)
        slopes = slopes @ self.to_dots.T * self.deviation[:, None]
        self.slopes = slopes.astype(np.float32)

    def left(self, network, unit):
        """The errors of the network's motions, px."""
        outputs, _, _ = network.forward(self.inputs, 0 * self.inputs)
        return (self.factor * unit * outputs - self.moved) @ self.to_dots


def train(network, data, unit, steps, report):
    """Takes steps at a rate that falls as a cosine. `unit`: px that an output of 1 is worth."""
    random = np.random.default_rng(1)
    soap = Soap(network.parameters)
    rows = np.arange(0)
    for number in range(steps):
        if len(rows) < BATCH:
            rows = random.permutation(len(data.inputs))
        batch, rows = rows[:BATCH], rows[BATCH:]
        along = random.normal(0, STEP, (len(batch), 10)).astype(np.float32)
        outputs, changes, kept = network.forward(data.inputs[batch], along)
        factor = unit * data.factor[batch]
        grows = unit * np.sum(data.by_inputs[batch] * along, axis=1, keepdims=True)
        off = factor * outputs - data.moved[batch]
        wanted = np.einsum("bk,bko->bo", along, data.slopes[batch])
        off_changes = factor * changes + grows * outputs - wanted
        # A few strong pairs at the border of the drawn range would dominate.
        all_off = np.sum(off**2 + off_changes**2, axis=1, keepdims=True)
        counts = 1 / np.sqrt(1 + all_off / FAR_OFF_PX**2)
        off, off_changes = off * counts, off_changes * counts
        by_outputs = np.concatenate([factor * off + grows * off_changes, factor * off_changes])
        slow = 0.5 + 0.5 * np.cos(np.pi * number / steps)
        rate = SLOWEST + FASTEST * slow * min(1, (number + 1) / 200)
        soap.step(network.gradients(kept, by_outputs * np.float32(4 / BATCH)), rate)
        report(number)


def row_bytes(bias, weights):
    """An output of a layer."""
    step = np.abs(weights).max() / 32767
    return struct.pack("<ff", bias, step) + np.round(weights / step).astype("<i2").tobytes()


def file_bytes(network, data, unit):
    """The network as the sensor takes it, with nothing left."""
    in_first, first_bias, in_second, second_bias, in_last, last_bias = network.parameters
    head = np.stack([data.middle, 1 / data.deviation], axis=1).ravel()
    parts = [bytes([*CHANNELS, DOTS, 0]), np.array([*head, FAR_MM], "<f4").tobytes()]
    parts += map(row_bytes, first_bias[0], in_first.T)
    parts += map(row_bytes, second_bias[0], in_second.transpose(2, 0, 1).reshape(CHANNELS[1], -1))
    # The sensor does not scale sums over images, nor outputs.
    times = unit / FOCAL_PX / data.norms
    weights = in_last.transpose(1, 0, 2).reshape(-1, 16) * (times / np.sqrt(8))
    steps = np.abs(weights).max(axis=0) / 32767
    biases = times * np.concatenate([last_bias[0], np.zeros(12)])
    parts.append(np.stack([biases, steps], axis=1).astype("<f4").tobytes())
    parts.append(np.round(weights / steps).astype("<i2").tobytes())
    parts.append(bytes(4 * 16 * 17 // 2))
    return b"".join(parts)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pairs")
    parser.add_argument("out")
    parser.add_argument("--steps", type=int, default=12_000)
    arguments = parser.parse_args()
    pairs = np.loadtxt(arguments.pairs, delimiter=",")
    held = max(1, len(pairs) // 10)
    data = Data(pairs[:-held])
    unseen = Data(pairs[-held:], data.scale)
    unit = np.float32(np.sqrt(np.mean((data.moved / data.factor) ** 2)))
    network = Network(np.random.default_rng(0))
    begun = time.process_time()

    def report(number):
        if (number + 1) % 1000 == 0:
            rms = [np.sqrt(np.mean(which.left(network, unit) ** 2)) for which in (data, unseen)]
            print(
                f"step {number + 1}: {rms[0]:.4f} px, held out {rms[1]:.4f} px,"
                f" {time.process_time() - begun:.0f} s", flush=True,
            )

    train(network, data, unit, arguments.steps, report)
    off = np.abs(unseen.left(network, unit))
    print(f"held out: median {np.median(off):.4f} px, worst {off.max():.3f} px")
    with open(arguments.out, "wb") as file:
        file.write(file_bytes(network, data, unit))


if __name__ == "__main__":
    main()
