"""The paper's pipeline in OpenCV, one thread, on the frames that `host-speed` wrote.

Standard input: its lines of JSON. Standard output: one line for each,
{"name":…,"microseconds":…,"markers":[[x,y],…]}: the fastest of many repetitions, and the centroids
of the four largest contours. Pixels are RGB565, little-endian; expanding them to the BGR that
OpenCV wants costs it nothing here. The pipeline itself is `studies/python/paper_pipeline.py`.
"""

import json
import sys
import time

import cv2
import numpy as np
import paper_pipeline

SECONDS = 0.4


def main():
    cv2.setNumThreads(1)
    for line in sys.stdin:
        frame = json.loads(line)
        width, height = frame["size"]
        pixels = np.fromfile(frame["file"], "<u2").reshape(height, width)
        image = paper_pipeline.bgr(pixels)
        best, end = float("inf"), time.perf_counter() + SECONDS
        while time.perf_counter() < end:
            start = time.perf_counter()
            found = [paper_pipeline.centroid(moments) for moments in paper_pipeline.contours(image)]
            best = min(best, time.perf_counter() - start)
        result = {"name": frame["name"], "microseconds": best * 1e6, "markers": found}
        print(json.dumps(result | {"opencv": cv2.__version__}))


main()
