"""Writes what OpenCV itself makes of all 65,536 RGB565 values, and of a mask that is dilated.

    python3 -m venv venv && venv/bin/pip install opencv-python-headless==5.0.0.93 numpy
    venv/bin/python reference.py

There is one file for each box of BOXES. It has 8192 bytes: bit p % 8 of byte p // 8 is set where
pixel p (red in bits 15-11), replicated to 8 bits a channel, passes cvtColor(COLOR_RGB2HSV) and
inRange; a box whose hue wraps is two inRange, joined by "or". "dilated.bits" holds four masks of
HEIGHT rows of WIDTH pixels, each row padded with zeros to whole 32-bit words, lowest bit first: a
random mask, and the same after one, two and three dilations by 3x3.

Every way that OpenCV may take must agree before anything is written: with and without its optimized
paths, and as one long row (vector code) and as rows of one pixel (scalar code). The committed files
are those of OpenCV 5.0.0; OpenCV 4.14.0 writes the same bytes.
"""

from pathlib import Path

import cv2
import numpy as np

# name: (hue low, hue high, saturation low, saturation high, value low, value high)
BOXES = {
    "red": (170, 10, 100, 255, 45, 255),
    "green": (35, 85, 60, 255, 40, 255),
    "tight": (175, 4, 150, 220, 90, 200),
    "full": (0, 179, 0, 255, 0, 255),
    "single-hue": (120, 120, 0, 255, 0, 255),
    "dark": (0, 179, 0, 90, 0, 110),
}

WIDTH, HEIGHT = 75, 40


def all_pixels():
    pixel = np.arange(65536, dtype=np.uint32)
    red, green, blue = pixel >> 11, pixel >> 5 & 63, pixel & 31
    channels = [red << 3 | red >> 2, green << 2 | green >> 4, blue << 3 | blue >> 2]
    return np.stack(channels, axis=-1).astype(np.uint8)


def accepted(rgb, box):
    hue_low, hue_high, saturation_low, saturation_high, value_low, value_high = box
    hsv = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV)
    hues = [(hue_low, hue_high)] if hue_low <= hue_high else [(hue_low, 179), (0, hue_high)]
    masks = [
        cv2.inRange(hsv, (low, saturation_low, value_low), (high, saturation_high, value_high))
        for low, high in hues
    ]
    return np.bitwise_or.reduce(masks).reshape(65536) != 0


def agreed(pixels, box):
    answers = []
    for optimized in (True, False):
        cv2.setUseOptimized(optimized)
        answers.append(accepted(pixels.reshape(1, 65536, 3), box))
        # Rows that do not follow each other in memory, so that they cannot be taken as one.
        column = np.zeros((65536, 2, 3), np.uint8)[:, :1]
        column[:] = pixels.reshape(65536, 1, 3)
        answers.append(accepted(column, box))
    agree = all((answer == answers[0]).all() for answer in answers)
    assert agree, f"OpenCV's paths disagree on {box}"
    return answers[0]


def packed(bits):
    return np.packbits(bits, axis=-1, bitorder="little").tobytes()


def dilated():
    random = np.random.default_rng(1)
    mask = (random.random((HEIGHT, WIDTH)) < 0.03).astype(np.uint8)
    square = np.ones((3, 3), np.uint8)
    masks = [mask] + [cv2.dilate(mask, square, iterations=n) for n in (1, 2, 3)]
    return b"".join(packed(np.pad(m, ((0, 0), (0, -WIDTH % 32)))) for m in masks)


def main():
    here = Path(__file__).parent
    print("OpenCV", cv2.__version__)
    for name, box in BOXES.items():
        bits = agreed(all_pixels(), box)
        (here / f"{name}.bits").write_bytes(packed(bits))
        print(f"{name}: {bits.sum()} of 65536")
    (here / "dilated.bits").write_bytes(dilated())


if __name__ == "__main__":
    main()
