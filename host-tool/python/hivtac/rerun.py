"""Shows a sensor or a recording in Rerun, live or into a file. Needs `pip install hivtac[rerun]`.

    python -m hivtac.rerun                            # the only sensor, in Rerun's viewer
    hivtac serve --rerun                              # the same
    python -m hivtac.rerun press.mcap --save press.rrd

In a program of yours, which has its own recording in Rerun:

    hivtac.rerun.log_film("thumb")
    for sample in sensor:
        hivtac.log_rerun(sample, "thumb")

Lengths are in mm, forces in N. The arrow of a force has 100 mm for 1 N, and ends where it presses.
"""

from __future__ import annotations

import argparse
import math
import threading
from collections.abc import Iterable

import numpy as np
import rerun as rr  # type: ignore[import-not-found,unused-ignore]
import rerun.blueprint as rrb  # type: ignore[import-not-found,unused-ignore]

import hivtac

__all__ = ["log_film", "log_picture", "log_sample"]

MM_PER_N = 100.0
"""Length of an arrow."""

_HALF_MM = 14.0
"""Half a side of the film, between its posts."""

_PASSES, _ADDED = 1, 2

_PICTURE_EVERY_S = 0.25


def log_film(name: str = "hivtac") -> None:
    """Logs what does not change below the entity `name`: the film's outline and frame, and the
    names of lines and of the mask's colours."""
    rr.log(name, rr.ViewCoordinates.RDF, static=True)
    around = [(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]
    outline = [(x * _HALF_MM, y * _HALF_MM, 0.0) for x, y in around]
    rr.log(f"{name}/film", rr.LineStrips3D([outline]), static=True)
    lines = {
        "force": ["Fx, N", "Fy, N", "Fz, N"],
        "size": ["|F| − σ, N", "|F|, N", "|F| + σ, N"],
        "place": ["x, mm", "y, mm"],
        "touch": ["contact", "slip"],
    }
    for entity, names in lines.items():
        rr.log(f"{name}/{entity}", rr.SeriesLines(names=names), static=True)
    classes = [
        (_PASSES, "passes the threshold", (255, 255, 255)),
        (_ADDED, "added by dilation", (128, 128, 128)),
    ]
    rr.log(f"{name}/picture", rr.AnnotationContext(classes), static=True)


def log_sample(sample: hivtac.Sample, name: str = "hivtac") -> None:
    """Logs a sample below the entity `name`, at the times `host_time` and `device_time` and the
    number `frame`. A force that is missing is a gap in the lines, and no arrow."""
    rr.set_time("host_time", timestamp=sample.host_time)
    rr.set_time("device_time", duration=sample.time)
    rr.set_time("frame", sequence=sample.frame)
    force = [math.nan] * 3 if sample.force is None else sample.force
    place = [math.nan] * 2 if sample.place is None else sample.place * 1e3
    size, sigma = sample.magnitude, sample.magnitude_sigma
    sizes = [math.nan] * 3
    if size is not None and sigma is not None:
        sizes = [size - sigma, size, size + sigma]
    rr.log(f"{name}/force", rr.Scalars(force))
    rr.log(f"{name}/size", rr.Scalars(sizes))
    rr.log(f"{name}/place", rr.Scalars(place))
    rr.log(f"{name}/touch", rr.Scalars([float(sample.contact), float(sample.slip)]))
    rr.log(f"{name}/status", rr.TextDocument("\n".join(sample.status)))
    rr.log(f"{name}/film/force", _arrows(sample))


def _arrows(sample: hivtac.Sample) -> rr.Arrows3D:
    """An arrow of the force, or one of each of two contacts."""
    each = sample.contacts if len(sample.contacts) > 1 else [sample]
    vectors, origins = [], []
    for one in each:
        if one.force is None:
            continue
        tip = np.zeros(3)
        if one.place is not None:
            tip[:2] = one.place * 1e3
        vectors.append(one.force * MM_PER_N)
        origins.append(tip - vectors[-1])
    return rr.Arrows3D(vectors=vectors, origins=origins)


def log_picture(picture: hivtac.Picture, name: str = "hivtac") -> None:
    """Logs a picture with mask and markers below the entity `name`, at the time `device_time` and
    the number `frame`."""
    rr.disable_timeline("host_time")
    rr.set_time("device_time", duration=picture.time)
    rr.set_time("frame", sequence=picture.frame)
    rr.log(f"{name}/picture", rr.Image(picture.pixels))
    mask = np.zeros(picture.mask.shape, np.uint8)
    mask[picture.mask > 0] = _ADDED
    mask[picture.mask == 255] = _PASSES
    rr.log(f"{name}/picture/mask", rr.SegmentationImage(mask, opacity=0.5))
    markers = np.zeros((0, 2)) if picture.markers is None else picture.markers
    rr.log(f"{name}/picture/markers", rr.Points2D(markers, radii=2.0))


def _layout(name: str) -> rrb.Blueprint:
    lines = [
        rrb.TimeSeriesView(origin=f"{name}/{entity}", name=entity)
        for entity in ("force", "size", "touch")
    ]
    seen = [
        rrb.Spatial3DView(origin=f"{name}/film", name="film"),
        rrb.Spatial2DView(origin=f"{name}/picture", name="picture"),
        rrb.TextDocumentView(origin=f"{name}/status", name="status"),
    ]
    return rrb.Blueprint(rrb.Horizontal(rrb.Vertical(*seen), rrb.Vertical(*lines)))


def _log_all(samples: Iterable[hivtac.Sample], name: str) -> None:
    for sample in samples:
        log_sample(sample, name)


def _log_live(sensor: hivtac.Sensor, name: str) -> None:
    """Logs samples, and pictures beside them, until the connection is lost."""
    # A picture has its markers once samples come.
    log_sample(next(sensor), name)
    is_over = threading.Event()

    def log_pictures() -> None:
        while not is_over.is_set():
            try:
                log_picture(sensor.look(), name)
            except hivtac.Error:
                # Damaged on the way, or none for now; a lost connection ends the samples, too.
                pass
            is_over.wait(_PICTURE_EVERY_S)

    thread = threading.Thread(target=log_pictures)
    thread.start()
    try:
        _log_all(sensor, name)
    finally:
        is_over.set()
        thread.join()


def main() -> None:
    """The command; `--help` has its options."""
    parser = argparse.ArgumentParser(
        prog="python -m hivtac.rerun",
        description="Show a sensor or a recording in Rerun; Ctrl-C ends it.",
    )
    parser.add_argument("recording", nargs="?", help="MCAP file of `hivtac record`")
    parser.add_argument("--port", help="serial port, tcp:HOST:PORT or uart:PORT")
    parser.add_argument("--device", help="name or serial number of a sensor")
    rr.script_add_args(parser)
    arguments = parser.parse_args()
    if arguments.recording and arguments.port:
        parser.error("give a recording or a port, not both")
    try:
        if arguments.recording:
            recording = hivtac.recording(arguments.recording, device=arguments.device)
            name = _begin(arguments, recording.device)
            _log_all(recording, name)
        else:
            with hivtac.open(arguments.port, device=arguments.device) as sensor:
                _log_live(sensor, _begin(arguments, sensor.device))
    except KeyboardInterrupt:
        pass
    except hivtac.Error as error:
        parser.exit(1, f"hivtac: {error}\n")
    finally:
        rr.script_teardown(arguments)


def _begin(arguments: argparse.Namespace, device: hivtac.Device) -> str:
    """Begins a recording in Rerun; returns the entity of the device."""
    name: str = rr.escape_entity_path_part(device.name or "hivtac")
    rr.script_setup(arguments, "hivtac", default_blueprint=_layout(name))
    log_film(name)
    return name


if __name__ == "__main__":
    main()
