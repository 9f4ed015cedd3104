"""The paper's pipeline in OpenCV, one thread, on the frames that `host-speed` wrote.

Standard input: its lines of JSON. Standard output: one line for each, {"name":…,"microseconds":…,"markers":[[x,y],…]}: the
fastest of many repetitions, and the centroids of the four largest contours. Pixels are RGB565, little-endian; expanding
them to the BGR that OpenCV wants costs it nothing here.
"""

import json
import sys
import time

import cv2
import numpy as np

# The usual box: H ≥ 170 or ≤ 10, S ≥ 100, V ≥ 45.
LOW = (np.array([0, 100, 45]), np.array([10, 255, 255]))
HIGH = (np.array([170, 100, 45]), np.array([179, 255, 255]))
SQUARE = np.ones((3, 3), np.uint8)
SECONDS = 0.4
# Of thousands of contours only the longest can be markers: moments of the others would measure Python.
CANDIDATES = 8


def bgr(pixels):
    """RGB565 with its bits replicated to 8, as cameras and OpenCV's own conversion do it."""
    red, green, blue = pixels >> 11, pixels >> 5 & 63, pixels & 31
    channels = (blue << 3 | blue >> 2, green << 2 | green >> 4, red << 3 | red >> 2)
    return np.dstack(channels).astype(np.uint8)


def markers(image):
    """Centroids of the four largest contours, as the paper finds them."""
    hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
    mask = cv2.bitwise_or(cv2.inRange(hsv, *LOW), cv2.inRange(hsv, *HIGH))
    mask = cv2.dilate(mask, SQUARE)
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    longest = sorted(contours, key=len, reverse=True)[:CANDIDATES]
    moments = sorted((cv2.moments(contour) for contour in longest), key=lambda m: -m["m00"])
    return [(m["m10"] / m["m00"], m["m01"] / m["m00"]) for m in moments[:4] if m["m00"] > 0]


def main():
    cv2.setNumThreads(1)
    for line in sys.stdin:
        frame = json.loads(line)
        width, height = frame["size"]
        pixels = np.fromfile(frame["file"], "<u2").reshape(height, width)
        image = bgr(pixels)
        best, end = float("inf"), time.perf_counter() + SECONDS
        while time.perf_counter() < end:
            start = time.perf_counter()
            found = markers(image)
            best = min(best, time.perf_counter() - start)
        result = {"name": frame["name"], "microseconds": best * 1e6, "markers": found}
        print(json.dumps(result | {"opencv": cv2.__version__}))


main()
