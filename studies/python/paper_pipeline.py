"""The paper's image processing (Section 5) in OpenCV: HSV, threshold, dilation, contours, moments.

`python paper_pipeline.py COLUMNS ROWS` reads frames of little-endian RGB565 from standard input.
For each it writes a line of JSON with the four largest contours, in px: [[x, y, area], …]. Without
OpenCV it ends with an error.
"""

import json
import sys

import cv2
import numpy as np

# The usual box: H ≥ 170 or ≤ 10, S ≥ 100, V ≥ 45.
LOW = (np.array([0, 100, 45]), np.array([10, 255, 255]))
HIGH = (np.array([170, 100, 45]), np.array([179, 255, 255]))
SQUARE = np.ones((3, 3), np.uint8)
# Among thousands of contours only the longest can be markers. The moments of all others would cost
# time in Python that says nothing about the pipeline.
CANDIDATES = 8


def bgr(pixels):
    """Converts RGB565 to 8 bits by repeating bits, as cameras and OpenCV's own conversion do."""
    red, green, blue = pixels >> 11, pixels >> 5 & 63, pixels & 31
    channels = (blue << 3 | blue >> 2, green << 2 | green >> 4, red << 3 | red >> 2)
    return np.dstack(channels).astype(np.uint8)


def contours(image):
    """The moments of the four largest contours by the paper's method, the largest first."""
    hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
    mask = cv2.bitwise_or(cv2.inRange(hsv, *LOW), cv2.inRange(hsv, *HIGH))
    mask = cv2.dilate(mask, SQUARE)
    found, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    longest = sorted(found, key=len, reverse=True)[:CANDIDATES]
    moments = sorted((cv2.moments(contour) for contour in longest), key=lambda m: -m["m00"])
    return [m for m in moments[:4] if m["m00"] > 0]


def centroid(moments):
    return moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]


def main(columns, rows):
    cv2.setNumThreads(1)
    every_colour = bgr(np.arange(1 << 16, dtype=np.uint16)[None])[0]
    while frame := sys.stdin.buffer.read(2 * columns * rows):
        pixels = np.frombuffer(frame, "<u2").reshape(rows, columns)
        markers = [(*centroid(m), m["m00"]) for m in contours(every_colour[pixels])]
        print(json.dumps(markers), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
