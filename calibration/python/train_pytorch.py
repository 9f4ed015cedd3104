"""Trains a network on a data set in PyTorch and saves it for `hivtac-calibrate train --start`.

    python calibration/python/train_pytorch.py data.csv net.safetensors
        [--hidden 64,64] [--epochs 100]

Needs torch and safetensors. The layout that it writes is described in docs/training.md.
"""

import argparse

import torch
from safetensors.torch import save_file

import hivtac_data


def tensors_of(path):
    _, rows, rejected = hivtac_data.read(path)
    print(f"{len(rows)} accepted rows, rejected: {rejected or 'none'}")

    def pick(names):
        values = [[row[name] for name in names] for row in rows]
        return torch.tensor(values, dtype=torch.float64)

    return pick(hivtac_data.FEATURES), pick(hivtac_data.FORCE)


def scaling(data):
    return data.mean(dim=0), data.std(dim=0, unbiased=False).clamp_min(1e-9)


def train(x, y, hidden, epochs, batch=64, rate=1e-3):
    widths = [x.shape[1], *hidden, y.shape[1]]
    layers = []
    for inputs, outputs in zip(widths, widths[1:]):
        layers += [torch.nn.Linear(inputs, outputs), torch.nn.ReLU()]
    net = torch.nn.Sequential(*layers[:-1])
    optimizer = torch.optim.Adam(net.parameters(), lr=rate)
    for epoch in range(epochs):
        for rows in torch.randperm(len(x)).split(batch):
            optimizer.zero_grad()
            torch.nn.functional.mse_loss(net(x[rows]), y[rows]).backward()
            optimizer.step()
    print(f"loss {torch.nn.functional.mse_loss(net(x), y).item():.5f} of 1 for a constant answer")
    return net


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("data")
    arguments.add_argument("out")
    arguments.add_argument("--hidden", default="64,64")
    arguments.add_argument("--epochs", type=int, default=100)
    arguments.add_argument("--examples", type=int, default=0,
                           help="also save this many features with the net's answers")
    arguments = arguments.parse_args()

    torch.manual_seed(1)
    features, force = tensors_of(arguments.data)
    (x_mean, x_sigma), (y_mean, y_sigma) = scaling(features), scaling(force)
    x, y = ((features - x_mean) / x_sigma).float(), ((force - y_mean) / y_sigma).float()
    net = train(x, y, [int(width) for width in arguments.hidden.split(",")], arguments.epochs)

    tensors = dict(net.state_dict())
    tensors |= {"input.mean": x_mean, "input.sigma": x_sigma,
                "output.mean": y_mean, "output.sigma": y_sigma}
    if arguments.examples:
        some = slice(0, arguments.examples)
        with torch.no_grad():
            answers = net(x[some]).double() * y_sigma + y_mean
        tensors |= {"example.features": features[some].clone(), "example.answers": answers}
    metadata = {"meaning": "force-vector", "writer": f"PyTorch {torch.__version__}"}
    save_file(tensors, arguments.out, metadata=metadata)


if __name__ == "__main__":
    main()
