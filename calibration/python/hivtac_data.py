"""Reads a data set of hivtac-calibrate. Needs nothing but Python."""

import csv
import json

FEATURES = [
    "x0_px", "y0_px", "x1_px", "y1_px", "x2_px", "y2_px", "x3_px", "y3_px",
    "rect_x_px", "rect_y_px", "rect_area_px2",
]
FORCE = ["fx_n", "fy_n", "fz_n"]


def read(path):
    """(about, rows, rejected): the header's facts; accepted rows as dictionaries; counts by status.

    Every value is a float, or None where there is none: the pose of a row that is in none of the
    paper's.
    """
    with open(path, newline="") as file:
        if not file.readline().startswith("# hivtac-dataset "):
            raise ValueError(f"{path} is not a data set of hivtac-calibrate")
        about = json.loads(file.readline().removeprefix("# "))
        rows, rejected = [], {}
        for row in csv.DictReader(file):
            status = row.pop("status")
            if status:
                rejected[status] = rejected.get(status, 0) + 1
            else:
                rows.append({name: float(value) if value else None for name, value in row.items()})
    return about, rows, rejected
