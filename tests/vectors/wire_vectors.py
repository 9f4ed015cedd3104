#!/usr/bin/env python3
"""Makes wire.json, the golden vectors of docs/wire.md, from that text alone.

An implementation of its own, sharing nothing with the Rust one, so that the two check each other:
    python3 tests/vectors/wire_vectors.py
rewrites wire.json and wire-annotated.txt beside this file, and the schema hash and example of
docs/wire.md.
"""

import json
import pathlib
import re
import zlib

PROTOCOL = 2
SCHEMA = 0x9BED6DF6848F805D
SCHEMA_OF_VERSION_1 = 0xE67EC00410F1123B


def varint(value):
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes(out + bytes([value]))


def zigzag(value):
    return varint(value * 2 if value >= 0 else -value * 2 - 1)


def unsigned(note, value):
    return varint(value), f"{note} {value}"


def signed(note, value):
    return zigzag(value), f"{note} {value}"


def raw(note, data):
    return bytes(data), note


def string(note, text):
    data = text.encode()
    return varint(len(data)) + data, f'{note} "{text}"'


def cobs(content):
    out = bytearray()
    block = bytearray()
    for byte in content:
        if byte == 0:
            out += bytes([len(block) + 1]) + block
            block.clear()
        else:
            block.append(byte)
            if len(block) == 254:
                out += b"\xff" + block
                block.clear()
    return bytes(out + bytes([len(block) + 1]) + block)


def body(fields):
    return b"".join(data for data, _ in fields)


def frame(content):
    return cobs(content + zlib.crc32(content).to_bytes(4, "little")) + b"\0"


def hello_start(protocol, schema):
    """The beginning of both hellos in every version."""
    start = [raw("Hello", [0]), unsigned("protocol", protocol)]
    return start + [(varint(schema), f"schema {schema:#018x}")]


COMMAND = [raw("Command", [1])]
RED = [
    raw("threshold: Rgb565", [0]),
    raw("H 170–10, S 100–255, V 45–255", [170, 10, 100, 255, 45, 255]),
]
RED_CR = [raw("threshold: Yuv422", [1]), raw("cr_low 162", [162])]
DARK = [raw("threshold: Mono", [2]), raw("luma_low 0, luma_high 88", [0, 88])]

DEVICE_ID_AND_NAMES = [
    raw("device_id", range(1, 13)),
    string("board", "weact-h743 + ov7725"),
    string("firmware", "hivtac 0.1.0"),
]
HELLO = hello_start(PROTOCOL, SCHEMA) + DEVICE_ID_AND_NAMES


def hello_end(threshold):
    return [
        unsigned("width", 320),
        unsigned("height", 240),
        *threshold,
        string("preset", "ov7725"),
        raw("dilations 1", [1]),
        raw("centroid: RednessWeighted", [1]),
    ]


CAMERA = [
    raw("exposure: Some", [1]),
    unsigned("exposure_us", 2_500),
    raw("gain: None", [0]),
    raw("rate: Half", [1]),
    raw("white: Some; red 76, blue 132", [1, 76, 132]),
]


def at_rate(rate, frames_per_second, shortest, longest):
    return [
        unsigned(f"{rate} rate: frames_per_second", frames_per_second),
        unsigned("shortest_us", shortest),
        unsigned("longest_us", longest),
    ]


DOWN = [signed("x_permille", 0), signed("y_permille", 600), signed("z_permille", -800)]

REST = [
    raw("tare: Some", [1]),
    raw("format: Rgb565", [0]),
    raw("dilations 1", [1]),
    raw("centroid: RednessWeighted", [1]),
    raw("markers: 4", [4]),
    *(field for x, y in [(6_553_600, 3_932_160), (14_417_920, 3_932_160), (14_417_920, 11_796_480),
                         (6_553_600, 11_796_480)]
      for field in (signed("x_q16", x), signed("y_q16", y), unsigned("area_px", 190))),
    signed("rect_center: x_q16", 10_485_760),
    signed("y_q16", 7_864_320),
    signed("rect_area_q16", 943_718_400),
    raw("down: Some", [1]),
    *DOWN,
]


AFTER_FAULT = [
    raw("Health", [10]),
    raw("reset: Software", [3]),
    raw("temperature_centidegrees: Some", [1]),
    signed("temperature_centidegrees", 4_150),
    unsigned("stack_used", 6_120),
    unsigned("stack_bytes", 24_576),
    (varint(0x80), "problems 0x80: software_reset"),
    (varint(0x80), "at_start 0x80: software_reset"),
    raw("brown_out: High", [3]),
]

# Name, threshold, tare, temporal, camera, down, contact_shape.
KEPT = [1, 0, 1, 1, 1, 0, 1]
NO_FILTER = [raw("filter: None", [0])]
LOW_PASS = [raw("filter: LowPass", [1]), unsigned("time_constant_ms", 20)]
LIMITS = [
    unsigned("contact: begins_un", 2_000),
    unsigned("ends_un", 1_000),
    unsigned("slip: distance_um", 60),
    unsigned("within_ms", 50),
    unsigned("ratio_permille", 100),
]
def rezero(total_mpx):
    return [
        raw("rezero: Some", [1]),
        unsigned("after_ms", 10_000),
        unsigned("rate_mpx_per_s", 5),
        unsigned("total_mpx", total_mpx),
    ]


NO_REZERO = [raw("rezero: None", [0])]


def creep(parts):
    return [
        *(unsigned("creep: part_permille", part) for part in parts),
    ]


ANY_FILM = creep([0, 0])
NO_OUTPUT = [raw("output: Off", [0])]
FORCE_LIMIT = [raw("output: Force", [3]), unsigned("limit_un", 200_000)]
USUAL = LIMITS + NO_FILTER + rezero(200) + ANY_FILM + NO_OUTPUT
OWN = LIMITS + LOW_PASS + rezero(100) + creep([31, 42]) + FORCE_LIMIT


MODEL = [
    raw("model: Some", [1]),
    (varint(0xCAFEF00D), "model.crc 0xcafef00d"),
    string("model.name", "11-64-64-3 ov7725"),
    raw("model.markers 4", [4]),
    raw("model.simulated: true", [1]),
]
KEPT_MODEL = [raw("model.source: Kept", [1])]


def sample(sequence, frame_number, time_us, status, names):
    note = f"status {status:#x}: {names}" if names else "status 0"
    return [
        raw("Sample", [1]),
        unsigned("sequence", sequence),
        unsigned("frame", frame_number),
        unsigned("time_us", time_us),
        (varint(status), note),
    ]


ANGLES = [
    raw("force: Some", [1]),
    signed("alpha_mdeg", -5000),
    signed("beta_mdeg", 2500),
    signed("magnitude_un", 100_000),
]
CARTESIAN = [
    signed("cartesian_un: x", -8707),
    signed("y", 4362),
    signed("z", -99_525),
]
SIGMAS = [unsigned("direction_sigma_mdeg", 480), unsigned("magnitude_sigma_un", 900)]
NO_TORQUE = [raw("torque: None", [0])]
TORQUE = [
    raw("torque: Some", [1]),
    signed("z_nnm", -21_000),
    unsigned("sigma_nnm", 3_100),
]
PLACE_ALONE = [
    raw("place: Some", [1]),
    signed("x_um", 1250),
    signed("y_um", -730),
    unsigned("sigma_um", 85),
]
PLACE = PLACE_ALONE + NO_TORQUE
NO_PLACE = [raw("place: None", [0])] + NO_TORQUE
NO_FORCE = [raw("force: None", [0])]
NO_CONTACTS = [raw("contacts: 0", [0])]
NO_MARKERS = [raw("markers: 0", [0])]


def contact(number, angles, size, vector, sigmas, place):
    return [
        signed(f"contact {number}: alpha_mdeg", angles[0]),
        signed("beta_mdeg", angles[1]),
        signed("magnitude_un", size),
        *(signed(f"cartesian_un: {axis}", part) for axis, part in zip("xyz", vector)),
        unsigned("direction_sigma_mdeg", sigmas[0]),
        unsigned("magnitude_sigma_un", sigmas[1]),
        raw("place: Some", [1]),
        signed("x_um", place[0]),
        signed("y_um", place[1]),
        unsigned("sigma_um", place[2]),
        *NO_TORQUE,
    ]


TWO_CONTACTS = [
    raw("contacts: 2", [2]),
    *contact(0, (-5000, 2500), 40_000, (-3483, 1745, -39_810), (2900, 1800), (3250, -730, 110)),
    *contact(1, (-5000, 2500), 60_000, (-5224, 2617, -59_715), (2600, 1900), (-83, -730, 95)),
]


def markers(seen):
    fields = (
        [signed(f"marker {marker}: x_q16", x), signed("y_q16", y), unsigned("area_px", area)]
        for marker, (x, y, area) in enumerate(seen)
    )
    return [raw(f"markers: {len(seen)}", [len(seen)])] + [field for one in fields for field in one]


FOUR = markers([
    (6_553_600, 3_932_160, 190), (14_417_921, 3_932_159, 191),
    (14_417_920, 11_796_480, 189), (6_553_600, 11_796_480, 190),
])
EIGHT = markers([
    (2_621_440, 2_949_120, 160), (18_350_081, 2_949_119, 161),
    (18_350_080, 12_779_520, 159), (2_621_440, 12_779_520, 160),
    (7_208_960, 7_864_320, 172), (13_762_560, 7_864_321, 173),
    (10_485_760, 4_718_592, 171), (10_485_759, 11_010_048, 172),
])

STATS = [
    ("frames_exposed", 1000),
    ("frames_processed", 990),
    ("dropped_busy", 7),
    ("dropped_overrun", 2),
    ("dropped_size", 1),
    ("dropped_setup", 12),
    ("camera_timeouts", 0),
    ("camera_restarts", 0),
    ("capture_overruns", 2),
    ("usb_dropped", 130),
    ("host_frames_rejected", 0),
    ("processing_us", 5300),
    ("latency_us", 4800),
    ("uptime_us", 34_000_000),
]

DEVICE = {
    "device-hello": HELLO + MODEL + RED + KEPT_MODEL + hello_end(RED)
    + [string("name", "thumb")] + LOW_PASS,
    "device-hello-yuv422": HELLO + MODEL + RED_CR + KEPT_MODEL + hello_end(RED_CR)
    + [string("name", "thumb")] + NO_FILTER,
    "device-hello-without-model": HELLO + [raw("model: None", [0])] + hello_end(RED)
    + [string("name", "")] + NO_FILTER,
    "sample-force": sample(41, 42, 1_400_000, 0x12000, "not_calibrated, contact") + ANGLES
    + CARTESIAN + SIGMAS + PLACE + NO_CONTACTS + NO_MARKERS,
    "sample-slip": sample(41, 42, 1_400_000, 0x32000, "not_calibrated, contact, slip")
    + ANGLES + CARTESIAN + SIGMAS + PLACE + NO_CONTACTS + NO_MARKERS,
    "sample-rezeroed": sample(41, 42, 1_400_000, 0x210000, "contact, rezeroed")
    + ANGLES + CARTESIAN + SIGMAS + PLACE + NO_CONTACTS + NO_MARKERS,
    "sample-without-place": sample(41, 42, 1_400_000, 0x50010,
                                   "magnitude_out_of_range, contact, direction_out_of_range")
    + ANGLES + CARTESIAN + SIGMAS + NO_PLACE + NO_CONTACTS + NO_MARKERS,
    "sample-unexplained": sample(300, 301, 10_000_000, 0x100000, "unexplained")
    + NO_FORCE + NO_CONTACTS + NO_MARKERS,
    "sample-without-force": sample(300, 305, 10_000_000, 0x201, "markers_missing, frame_dropped")
    + NO_FORCE + NO_CONTACTS + NO_MARKERS,
    "sample-two-contacts": sample(41, 42, 1_400_000, 0x1001_2000,
                                  "not_calibrated, contact, two_contacts")
    + ANGLES + CARTESIAN + SIGMAS + PLACE + TWO_CONTACTS + NO_MARKERS,
    "sample-sum-of-two": sample(41, 42, 1_400_000, 0x1001_2000,
                                "not_calibrated, contact, two_contacts")
    + ANGLES + CARTESIAN + SIGMAS + PLACE + NO_CONTACTS + NO_MARKERS,
    "sample-with-markers": sample(7, 8, 300_000, 0x4000, "model_missing")
    + NO_FORCE + NO_CONTACTS + FOUR,
    "sample-with-eight-markers": sample(41, 42, 1_400_000, 0x12000, "not_calibrated, contact")
    + ANGLES + CARTESIAN + SIGMAS + PLACE_ALONE + TORQUE + NO_CONTACTS + EIGHT,
    "stats": [raw("Stats", [2])] + [unsigned(name, value) for name, value in STATS],
    "log": [
        raw("Log", [3]),
        raw("level: Warning", [1]),
        unsigned("time_us", 2_500_000),
        string("text", "camera silent, restarting"),
    ],
    "reply-done": [raw("Reply", [4]), unsigned("id", 7), raw("outcome: Done", [0])],
    "reply-no-good-frames": [
        raw("Reply", [4]),
        unsigned("id", 65_535),
        raw("outcome: NoGoodFrames", [3]),
    ],
    "reply-unsupported": [raw("Reply", [4]), unsigned("id", 200), raw("outcome: Unsupported", [5])],
    "reply-markers-implausible": [
        raw("Reply", [4]),
        unsigned("id", 7),
        raw("outcome: MarkersImplausible", [6]),
    ],
    "reply-unsteady": [raw("Reply", [4]), unsigned("id", 7), raw("outcome: Unsteady", [7])],
    "reply-not-read": [raw("Reply", [4]), unsigned("id", 300), raw("outcome: NotRead", [8])],
    "snapshot": [
        raw("Snapshot", [5]),
        unsigned("frame", 8),
        unsigned("time_us", 300_000),
        unsigned("width", 320),
        unsigned("height", 240),
        *RED,
        unsigned("bytes", 153_600),
    ],
    "snapshot-part": [
        raw("SnapshotPart", [6]),
        unsigned("offset", 153_596),
        raw("bytes: 4", [4]),
        raw("two red pixels", [0xD8, 0xA3, 0xD8, 0xA3]),
    ],
    "reply-no-camera": [raw("Reply", [4]), unsigned("id", 10), raw("outcome: NoCamera", [9])],
    "inspection": [
        raw("Inspection", [7]),
        unsigned("silicon", 0x2003),
        unsigned("camera_id", 0x7721),
        unsigned("registers", 56),
        raw("different: 1", [1]),
        raw("address 0x03", [3]),
        unsigned("written", 0x40),
        unsigned("found", 0),
        unsigned("frame_time_us", 6_405),
        unsigned("exposure_us", 5_922),
        unsigned("longest_exposure_us", 6_405),
        unsigned("gain_sixteenths", 24),
    ],
    "settings": [
        raw("Settings", [8]),
        string("name", "thumb"),
        *RED,
        *REST,
        raw("kept: all but threshold and down", KEPT),
        raw("found: Settings", [1]),
        unsigned("erases", 3),
        unsigned("failures", 0),
        *OWN,
        signed("rezeroed_q16", 1_311),
        raw("seen: Some", [1]),
        unsigned("seen_mpx", 100),
        raw("drift: Some", [1]),
        signed("drift_q16", 20_316),
        *CAMERA,
        unsigned("exposure_us", 2_512),
        unsigned("gain_sixteenths", 24),
        *at_rate("full", 156, 24, 6_405),
        *at_rate("half", 78, 47, 12_810),
        *at_rate("quarter", 39, 93, 25_620),
        raw("down: Told", [2]),
        *DOWN,
        raw("contact_shape: Flat", [2]),
        unsigned("radius_um", 2_000),
    ],
    "health": [
        raw("Health", [10]),
        raw("reset: Watchdog", [4]),
        raw("temperature_centidegrees: Some", [1]),
        signed("temperature_centidegrees", 4_150),
        unsigned("stack_used", 6_120),
        unsigned("stack_bytes", 24_576),
        (varint(0x44), "problems 0x44: model_fallback, watchdog_reset"),
        (varint(0x1004), "at_start 0x1004: model_fallback, arithmetic"),
        raw("brown_out: Off", [0]),
        raw("failure: None", [0]),
    ],
    "health-after-a-failure": AFTER_FAULT + [
        raw("failure: Some", [1]),
        raw("kind: BusFault", [3]),
        unsigned("starts_ago", 1),
        unsigned("count", 2),
        raw("program_counter: Some", [1]),
        (varint(0x08061234), "program_counter 0x08061234"),
        raw("link_register: Some", [1]),
        (varint(0x08060ABD), "link_register 0x08060abd"),
        raw("address: Some", [1]),
        (varint(0x26000000), "address 0x26000000"),
        (varint(0x8200), "fault_status 0x8200: BFARVALID, PRECISERR"),
        unsigned("exception", 69),
        string("place", ""),
    ],
    "health-after-a-panic": AFTER_FAULT + [
        raw("failure: Some", [1]),
        raw("kind: Panic", [0]),
        unsigned("starts_ago", 3),
        unsigned("count", 1),
        raw("program_counter: None", [0]),
        raw("link_register: None", [0]),
        raw("address: None", [0]),
        unsigned("fault_status", 0),
        unsigned("exception", 0),
        string("place", "firmware/src/usb.rs:123"),
    ],
    "tared": [
        raw("Tared", [9]),
        *REST[1:],
        signed("spread_q16", 789),
        raw("moved: Some", [1]),
        signed("farthest_q16", 20_316),
        signed("shift: x_q16", 13_107),
        signed("y_q16", -6_554),
        signed("turn_mdeg", 12),
        signed("larger_q16", 197),
        signed("beside_q16", 524),
    ],
    "reply-worn": [raw("Reply", [4]), unsigned("id", 14), raw("outcome: Worn", [10])],
    "reply-model-unusable": [
        raw("Reply", [4]), unsigned("id", 18), raw("outcome: ModelUnusable", [11]),
    ],
    "reply-touched": [
        raw("Reply", [4]), unsigned("id", 7), raw("outcome: Touched", [13]),
        signed("looks_like_un", 1_043),
    ],
    "reply-another-sensor": [
        raw("Reply", [4]), unsigned("id", 18), raw("outcome: AnotherSensor", [12]),
    ],
}

HOST = {
    "host-hello": hello_start(PROTOCOL, SCHEMA),
    "down-told": [raw("Down", [2]), raw("Told", [2]), *DOWN],
    "down-unknown": [raw("Down", [2]), raw("Unknown", [1])],
    "down-fixed": [raw("Down", [2]), raw("Fixed", [0])],
    "get-info": COMMAND + [unsigned("id", 1), raw("GetInfo", [0])],
    "start": COMMAND + [unsigned("id", 2), raw("Start", [1])],
    "stop": COMMAND + [unsigned("id", 3), raw("Stop", [2])],
    "set-threshold": COMMAND + [unsigned("id", 200), raw("SetThreshold", [3])] + RED,
    "set-threshold-yuv422": COMMAND + [unsigned("id", 200), raw("SetThreshold", [3])] + RED_CR,
    "set-threshold-mono": COMMAND + [unsigned("id", 200), raw("SetThreshold", [3])] + DARK,
    "tare": COMMAND + [unsigned("id", 7), raw("Tare", [4]), unsigned("frames", 128)],
    "start-with-markers": COMMAND + [unsigned("id", 2), raw("StartWithMarkers", [5])],
    "expose": COMMAND + [unsigned("id", 9), raw("Expose", [6])],
    "take-snapshot": COMMAND + [unsigned("id", 300), raw("Snapshot", [7])],
    "inspect": COMMAND + [unsigned("id", 10), raw("Inspect", [8])],
    "get-settings": COMMAND + [unsigned("id", 11), raw("GetSettings", [9])],
    "set-name": COMMAND + [unsigned("id", 12), raw("SetName", [10]), string("name", "thumb")],
    "set-tare": COMMAND + [unsigned("id", 13), raw("SetTare", [11]), *REST],
    "forget-tare": COMMAND + [unsigned("id", 13), raw("SetTare", [11]), raw("tare: None", [0])],
    "keep": COMMAND + [unsigned("id", 14), raw("Keep", [12])]
    + [raw("all but threshold and down", KEPT)],
    "set-temporal": COMMAND + [unsigned("id", 15), raw("SetTemporal", [13])] + OWN,
    "set-temporal-usual": COMMAND + [unsigned("id", 15), raw("SetTemporal", [13])] + USUAL,
    "set-temporal-median": COMMAND + [unsigned("id", 15), raw("SetTemporal", [13])] + LIMITS
    + [raw("filter: MedianOfThree", [2])] + NO_REZERO + ANY_FILM + NO_OUTPUT,
    "begin-model": COMMAND
    + [unsigned("id", 16), raw("BeginModel", [14]), unsigned("bytes", 57_976)],
    "model-part": COMMAND
    + [unsigned("id", 17), raw("ModelPart", [15]), unsigned("offset", 57_972),
       raw("bytes: 4", [4]), raw("the file's CRC-32 0xcafef00d", [0x0D, 0xF0, 0xFE, 0xCA])],
    "use-model": COMMAND + [unsigned("id", 18), raw("UseModel", [16])],
    "use-built-in-model": COMMAND + [unsigned("id", 19), raw("UseBuiltInModel", [17])],
    "tare-anyway": COMMAND + [unsigned("id", 7), raw("TareAnyway", [19]), unsigned("frames", 128)],
    "get-health": COMMAND + [unsigned("id", 21), raw("GetHealth", [20])],
    "start-loader": COMMAND + [unsigned("id", 22), raw("StartLoader", [21])],
    "set-camera": COMMAND + [unsigned("id", 23), raw("SetCamera", [22]), *CAMERA],
    "set-camera-automatic": COMMAND + [unsigned("id", 23), raw("SetCamera", [22])]
    + [raw("exposure: None", [0]), raw("gain: None", [0]), raw("rate: Full", [0])]
    + [raw("white: None", [0])],
    "set-contact-shape-needle": COMMAND
    + [unsigned("id", 24), raw("SetContactShape", [23]), raw("Needle", [0])],
    "set-contact-shape-round": COMMAND
    + [unsigned("id", 24), raw("SetContactShape", [23]), raw("Round", [1]),
       unsigned("radius_um", 1_500)],
    "set-contact-shape-flat": COMMAND
    + [unsigned("id", 24), raw("SetContactShape", [23]), raw("Flat", [2]),
       unsigned("radius_um", 2_000)],
    "set-contact-shape-unknown": COMMAND
    + [unsigned("id", 24), raw("SetContactShape", [23]), raw("Unknown", [3])],
    "reset": COMMAND + [unsigned("id", 20), raw("Reset", [18])],
}

FOREIGN = {
    "host-hello-version-1": hello_start(1, SCHEMA_OF_VERSION_1),
    "device-hello-version-1": hello_start(1, SCHEMA_OF_VERSION_1) + DEVICE_ID_AND_NAMES
    + MODEL + RED + hello_end(RED),
    "foreign-hello": hello_start(3, 0x1122334455667788)
    + [raw("unknown to version 2", [0xDE, 0xAD])],
}


def bad_crc():
    """The reply "done" with one bit of its number flipped after the checksum: 7 became 6."""
    content = body(DEVICE["reply-done"])
    damaged = bytes([content[0], content[1] ^ 1, content[2]])
    return cobs(damaged + zlib.crc32(content).to_bytes(4, "little")) + b"\0"


def rejects():
    reply = body(DEVICE["reply-done"])
    return {
        "bad-crc": ("crc", bad_crc()),
        "too-short-for-a-crc": ("crc", cobs(b"\4\7\0") + b"\0"),
        "cobs-past-the-end": ("cobs", bytes.fromhex("09 04 07 00")),
        "unknown-variant": ("body", frame(b"\x64\7\0")),
        "string-too-long": ("body", frame(b"\3\0\0" + varint(97) + b"x" * 97)),
        "cut-body": ("body", frame(reply[:-1])),
        "trailing-byte": ("trailing", frame(reply + b"\0")),
        "overlong": ("overlong", b"\1" * 513 + b"\0"),
    }


def document():
    """Everything that wire.json says."""
    resync = b"\x2a\x55" + b"\0" + frame(body(DEVICE["reply-done"])) + bad_crc() + b"\0\0" \
        + frame(body(DEVICE["sample-without-force"]))
    return {
        "protocol": PROTOCOL,
        "schema": f"{SCHEMA:#018x}",
        "device": {name: frame(body(fields)).hex(" ") for name, fields in DEVICE.items()},
        "host": {name: frame(body(fields)).hex(" ") for name, fields in HOST.items()},
        "foreign": {name: frame(body(fields)).hex(" ") for name, fields in FOREIGN.items()},
        "rejected": {
            name: {"cause": cause, "frame": data.hex(" ")}
            for name, (cause, data) in rejects().items()
        },
        "stream": {
            "bytes": resync.hex(" "),
            "messages": ["reply-done", "sample-without-force"],
            "rejected": {"cobs": 1, "crc": 1, "bytes": 2 + len(bad_crc()) - 1},
        },
    }


def annotated(fields):
    """The body of a message field by field, and its checksum."""
    content = body(fields)
    crc = zlib.crc32(content)
    rows = list(fields) + [(crc.to_bytes(4, "little"), f"CRC-32 {crc:#010x}")]
    width = [35 if len(data) < 12 else 0 for data, _ in rows]
    return "".join(
        f"{data.hex(' '):<{w}} # {note}\n" for w, (data, note) in zip(width, rows)
    )


def written_into(text, messages):
    """docs/wire.md with this schema hash and these bytes."""

    def block(match):
        kind, fields = match[1], messages[match[2]]
        data = annotated(fields) if kind == "body" else frame(body(fields)).hex(" ") + "\n"
        return f"```text {kind} {match[2]}\n{data}```"

    text = re.sub(r"```text (body|frame) ([\w-]+)\n.*?```", block, text, flags=re.S)
    return re.sub(r"schema hash \*\*0x\w+\*\*", f"schema hash **{SCHEMA:#018x}**", text)


if __name__ == "__main__":
    here = pathlib.Path(__file__).parent
    vectors = json.dumps(document(), indent=2, ensure_ascii=False)
    (here / "wire.json").write_text(vectors + "\n")
    messages = {**HOST, **DEVICE, **FOREIGN}
    blocks = [f"{name}\n{annotated(fields)}" for name, fields in messages.items()]
    (here / "wire-annotated.txt").write_text("\n".join(blocks))
    page = here.parent.parent / "docs" / "wire.md"
    page.write_text(written_into(page.read_text(), messages))
