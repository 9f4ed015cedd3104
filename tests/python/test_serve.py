"""`hivtac serve` on the firmware in the rig, received by programs that are none of this project's:
Cyclone DDS, which ROS 2 itself uses, and a WebSocket client with PyPI's reader of ROS 2's messages.

    HIVTAC_RIG=… HIVTAC_ELF=… HIVTAC_TOOL=… python tests/python/test_serve.py

HIVTAC_TOOL is built with the features `ros2` and `foxglove`. `cargo xtask test --all serve` builds
these programs and installs the packages first.
"""

# /// script
# requires-python = ">=3.10"
# dependencies = ["cyclonedds", "mcap-ros2-support", "websockets"]
# ///
# There must be cyclonedds for this Python and computer.

import gc
import io
import json
import math
import os
import statistics
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import zlib
from pathlib import Path

# Everything stays on this computer, whatever networks it has.
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["CYCLONEDDS_URI"] = (
    "<General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces>"
    "</General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer address='127.0.0.1'/></Peers></Discovery>"
)

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from mcap.reader import make_reader
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from rig import PATIENCE, Rig, true_force
from ros2_types import (
    Bool,
    CycloneReply,
    CycloneRequest,
    DiagnosticArray,
    Float64,
    Reply,
    Request,
    WrenchStamped,
)
from serve import INTERRUPTED, Serve, refused, until
from websockets.sync.client import connect

# Of a domain that nobody else is likely to use.
DOMAIN = 97
RELIABLE = Policy.Reliability.Reliable(duration(seconds=1))
# As the usual readers of sensor data.
BEST_EFFORT = Policy.Reliability.BestEffort
# How ROS 2 codes messages.
XCDR1 = Policy.DataRepresentation(use_cdrv0_representation=True)
# Levels of diagnostics.
WARN, ERROR = 1, 2
ROS2 = ["--ros2", "--domain", str(DOMAIN)]
# At a port that is free.
FOXGLOVE = ["--foxglove", "--listen", "127.0.0.1:0"]
# How a tare ends.
TARED = (True, "tare taken over 32 frames")
# Frames that must be recognized by their forces, one after the other.
ALIKE = 20


class Node:
    """A participant that is none of hivtac's, in a domain."""

    def __init__(self):
        self._participant = DomainParticipant(DOMAIN)

    def reader(self, topic, kind, reliability=RELIABLE):
        qos = Qos(reliability, Policy.History.KeepLast(4096), XCDR1)
        return DataReader(self._participant, Topic(self._participant, topic, kind), qos)

    def writer(self, topic, kind):
        qos = Qos(RELIABLE, Policy.History.KeepLast(10), XCDR1)
        return DataWriter(self._participant, Topic(self._participant, topic, kind), qos)


class Client(Node):
    """A client of the service that takes a tare, for as long as it is needed."""

    def __init__(self, request, reply):
        super().__init__()
        self._ask = self.writer("rq/hivtac/tareRequest", request)
        self._replies = self.reader("rr/hivtac/tareReply", reply)

    def ask(self, request):
        until(lambda: self._ask.get_matched_subscriptions())
        until(lambda: self._replies.get_matched_publications())
        self._ask.write(request)
        [reply] = until(lambda: self._replies.take(10))
        return reply

    def __enter__(self):
        return self

    def __exit__(self, *_):
        # As long as Cyclone DDS has its reader, it reports replies of the other kind.
        del self._ask, self._replies, self._participant
        gc.collect()


def number(vector):
    return [vector.x, vector.y, vector.z]


def distance(one, other):
    return max(abs(a - b) for a, b in zip(one, other))


def first_alike(forces, truth):
    """Of which frame the first force is, by those of all; frames follow each other."""
    frames = sorted(truth)
    for start in frames:
        of_these = range(start, start + len(forces))
        if all(frame in truth for frame in of_these):
            off = (
                distance(force, true_force(truth[frame]))
                for force, frame in zip(forces, of_these)
            )
            if max(off) < 2e-3:
                return start
    return None


def pressed(messages):
    """The newest wrenches, once the tip presses more and more, so that they can be recognized."""
    newest = []
    for message in messages:
        newest = [*newest, message][-ALIKE:]
        sizes = [math.hypot(*number(it.wrench.force)) for it in newest]
        if len(newest) == ALIKE and max(sizes) - min(sizes) > 0.06:
            return newest
    raise AssertionError("the wrenches ended")


class OnTheRig(unittest.TestCase):
    def test_forces_are_those_of_the_scene_and_a_pulled_cable_is_reported(self):
        node = Node()
        wrenches = [
            node.reader("rt/hivtac/wrench", WrenchStamped, reliability)
            for reliability in (RELIABLE, BEST_EFFORT)
        ]
        contacts = node.reader("rt/hivtac/contact", Bool, BEST_EFFORT)
        self.diagnostics = node.reader("rt/diagnostics", DiagnosticArray)
        begun = time.time()
        with Rig() as rig:
            rig.set_needle()
            with Serve(*ROS2, *FOXGLOVE, *port(rig)) as serve:
                self.assertEqual(serve.ready["ros2"], "/hivtac")
                self.assertEqual(serve.ready["domain"], str(DOMAIN))
                to_foxglove = [number(it.wrench.force) for it in pressed(wrenches_of(serve))]
                received = [pressed(taken(reader)) for reader in wrenches]
                truth = rig.truth()
                touched = [it.data for it in contacts.take(4096)]
                self.check_a_pulled_cable(rig)
                said = serve.end()
        self.assertRegex(said, "lost: (?s:.*)connected again to tcp:")
        self.assertEqual(serve.code, INTERRUPTED)
        self.assertIsNotNone(first_alike(to_foxglove, truth), to_foxglove)
        for messages in received:
            self.check_wrenches(messages, truth, begun)
        self.assertTrue(any(touched))

    def check_wrenches(self, messages, truth, begun):
        forces = [number(it.wrench.force) for it in messages]
        self.assertIsNotNone(first_alike(forces, truth), forces)
        self.assertEqual({it.header.frame_id for it in messages}, {"hivtac_film"})
        stamps = [it.header.stamp.sec + it.header.stamp.nanosec / 1e9 for it in messages]
        steps = [after - before for before, after in zip(stamps, stamps[1:])]
        # By the device's clock.
        self.assertAlmostEqual(statistics.median(steps), 1 / 156.12, delta=2e-5)
        self.assertTrue(begun < stamps[0] < stamps[-1] < time.time())
        # That of a force of less than 0.3 N within 5 mm of the middle.
        for torque in (it.wrench.torque for it in messages):
            self.assertLess(max(map(abs, number(torque))), 1.5e-3)
            self.assertGreater(max(map(abs, number(torque))), 0)

    def check_a_pulled_cable(self, rig):
        status = self.told(WARN)
        self.assertEqual(status.hardware_id, b"hivtac-rig-1".hex())
        self.assertIn("not of this unit", status.message)
        values = {value.key: value.value for value in status.values}
        self.assertEqual(values["frames_lost"], "0")
        self.assertEqual(values["samples_not_published"], "0")
        self.assertIn("not_calibrated", values["status"].split())
        rig.kill()
        self.assertRegex(self.told(ERROR).message, "connection to .* lost")
        with Rig(tcp=rig.port.rsplit(":", 1)[1]):
            values = {value.key: value.value for value in self.told(WARN).values}
            self.assertEqual(values["connections"], "2")

    def told(self, level):
        """The next diagnosis of this level."""

        def newest():
            statuses = [it.status[0] for it in self.diagnostics.take(100)]
            return next((it for it in reversed(statuses) if it.level == level), None)

        return until(newest)

    def test_a_tare_is_taken_for_clients_of_both_kinds(self):
        client = 0x0123_4567_89AB_CDEF
        with Rig("rest") as rig, Serve(*ROS2, *port(rig)):
            with Client(Request, Reply) as plainly:
                reply = plainly.ask(Request(0))
                self.assertEqual((reply.success, reply.message), TARED)
            with Client(CycloneRequest, CycloneReply) as cyclone:
                reply = cyclone.ask(CycloneRequest(client, 7, 0))
                self.assertEqual((reply.success, reply.message), TARED)
                self.assertEqual((reply.client, reply.sequence), (client, 7))
                rig.kill()
                reply = cyclone.ask(CycloneRequest(client, 8, 0))
                self.assertEqual(reply.sequence, 8)
                self.assertFalse(reply.success)
                self.assertRegex(reply.message, "not there|lost")


class OfARecording(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.file = Path(cls.folder.name) / "demo.mcap"
        with Rig() as rig:
            tool = [os.environ["HIVTAC_TOOL"], "record", cls.file, "--seconds", "6"]
            subprocess.run([*tool, *port(rig)], check=True, stderr=subprocess.DEVNULL)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_it_is_served_as_it_was(self):
        data = io.BytesIO(self.file.read_bytes())
        reader = make_reader(data, decoder_factories=[DecoderFactory()])
        kept = [
            number(message.wrench.force)
            for _, channel, _, message in reader.iter_decoded_messages()
            if channel.topic.endswith("/wrench")
        ]
        with Replay(self.file) as replay, Serve(*FOXGLOVE, *replay.port) as serve:
            received = []
            for message in wrenches_of(serve):
                received.append(number(message.wrench.force))
                if received[-1] == kept[-1]:
                    break
        self.assertGreater(len(received), len(kept) // 2)
        self.assertEqual(received, kept[-len(received) :])

    def test_a_second_one_of_its_name_and_of_its_port_is_reported(self):
        with Replay(self.file) as one, Replay(self.file) as other:
            with Serve(*ROS2, *FOXGLOVE, *one.port) as first:
                taken = ["--listen", first.ready["foxglove"].removeprefix("ws://")]
                ended = refused("--foxglove", *taken, *other.port)
                self.assertEqual(ended.returncode, 1)
                self.assertIn("choose another port with --listen", ended.stderr)
                with Replay(self.file) as third, Serve(*ROS2, *third.port) as second:
                    words = f"another node in domain {DOMAIN} is called /hivtac, too"
                    until(lambda: all(words in serve.errors() for serve in (second, first)))

    def test_of_several_sensors_each_has_names_of_its_own(self):
        other_file = self.file.with_name("other.mcap")
        other_file.write_bytes(of_another(self.file.read_bytes(), b"hivtac-rig-2"))
        node = Node()
        units = [b"hivtac-rig-1".hex(), b"hivtac-rig-2".hex()]
        readers = [
            node.reader(f"rt/hivtac/unit_{unit}/wrench", WrenchStamped) for unit in units
        ]
        with Replay(self.file) as one, Replay(other_file) as other:
            with Serve(*ROS2, *one.port, *other.port):
                for unit, reader in zip(units, readers):
                    wrench = next(taken(reader))
                    self.assertEqual(
                        wrench.header.frame_id, f"hivtac_unit_{unit}_film"
                    )

    def test_nobody_there_is_reported(self):
        alone = ["--ros2", "--domain", "231"]
        with Replay(self.file) as replay, Serve(*alone, *replay.port) as serve:
            until(lambda: "nothing else of ROS 2 is in domain 231" in serve.errors())

    def test_a_grip_of_two_sensors_has_topics_of_its_own(self):
        other_file = self.file.with_name("second.mcap")
        other_file.write_bytes(of_another(self.file.read_bytes(), b"hivtac-rig-2"))
        node = Node()
        forces = node.reader("rt/hivtac/grip/force", Float64)
        wrenches = node.reader("rt/hivtac/grip/wrench", WrenchStamped)
        with Replay(self.file) as one, Replay(other_file) as other:
            fingers = ["--grip", f"{one.port[1]},{other.port[1]}"]
            with Serve(*ROS2, *FOXGLOVE, *fingers) as serve:
                with connect(serve.ready["foxglove"], subprotocols=["foxglove.sdk.v1"]) as it:
                    channels = advertised(it, 21)
                    data = messages(it, channels["/hivtac/grip/force"])
                    known = next(it.data for it in data if not math.isnan(it.data))
                self.assertLess(abs(known), 0.3)
                self.assertFalse(all(math.isnan(it.data) for it in until(lambda: forces.take(99))))
                wrench = next(taken(wrenches))
                self.assertEqual(wrench.header.frame_id, "hivtac_grip")

    def test_one_sensor_is_not_served_twice(self):
        with Replay(self.file) as one, Replay(self.file) as other:
            ended = refused("--foxglove", *one.port, *other.port[:2])
        self.assertEqual(ended.returncode, 2)
        self.assertIn("the same sensor is named twice", ended.stderr)


class WithoutASensor(unittest.TestCase):
    def test_what_ros_2_does_not_have_is_refused(self):
        for options, domain, code, words in [
            (["--name", "left thumb"], "0", 2, "--name left thumb: a node's name"),
            ([], "lab", 2, "ROS_DOMAIN_ID is lab; .* from 0 to 232"),
            ([], "233", 2, "ROS_DOMAIN_ID is 233"),
            (["--port", "no-such-port"], "232", 3, "no-such-port"),
        ]:
            ended = refused("--ros2", *options, env=os.environ | {"ROS_DOMAIN_ID": domain})
            self.assertEqual(ended.returncode, code, ended.stderr)
            self.assertRegex(ended.stderr, words)


class Replay:
    """`hivtac replay`, a recording at a port."""

    def __init__(self, file):
        self._process = subprocess.Popen(
            [os.environ["HIVTAC_TOOL"], "replay", file],
            stdout=subprocess.PIPE,
            text=True,
        )
        said = self._process.stdout.readline()
        self.port = ["--port", "tcp:" + said.strip().split("tcp=", 1)[1]]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        self._process.stdout.close()


def of_another(recording, unit):
    """The recording with the number of another sensor in its hellos (docs/wire.md)."""
    old, place = b"hivtac-rig-1", 0
    while (place := recording.find(old, place)) >= 0:
        begin, end = recording.rfind(b"\0", 0, place) + 1, recording.find(b"\0", place)
        body = cobs_decoded(recording[begin:end])[:-4].replace(old, unit)
        frame = cobs_encoded(body + zlib.crc32(body).to_bytes(4, "little"))
        assert len(frame) == end - begin
        # A channel's metadata has the hello, too, in hexadecimal digits.
        was = recording[begin:end].hex().encode()
        recording = recording[:begin] + frame + recording[end:]
        recording = recording.replace(was, frame.hex().encode())
        place = end
    return without_checksums(recording)


def without_checksums(recording):
    """The MCAP file with 0, which means none, in place of its checksums."""
    file, place = bytearray(recording), 8
    while place + 9 <= len(file) - 8:
        kind, length = file[place], int.from_bytes(file[place + 1 : place + 9], "little")
        begin, end = place + 9, place + 9 + length
        chunk, data_end, footer = 6, 15, 2
        if kind == chunk:
            file[begin + 24 : begin + 28] = bytes(4)
        elif kind in (data_end, footer):
            file[end - 4 : end] = bytes(4)
        place = end
    return bytes(file)


def cobs_decoded(frame):
    bytes_, place = b"", 0
    while place < len(frame):
        code = frame[place]
        bytes_ += frame[place + 1 : place + code]
        place += code
        if code < 255 and place < len(frame):
            bytes_ += b"\0"
    return bytes_


def cobs_encoded(bytes_):
    assert all(len(part) < 254 for part in bytes_.split(b"\0"))
    return b"".join(bytes([len(part) + 1]) + part for part in bytes_.split(b"\0"))


def port(rig):
    return ["--port", rig.port, "--timeout", str(PATIENCE)]


def taken(reader):
    """Samples that a reader has, and later ones."""
    while True:
        yield from until(lambda: reader.take(100))


def wrenches_of(serve):
    """The wrenches that Foxglove gets, as their schema says."""
    with connect(serve.ready["foxglove"], subprotocols=["foxglove.sdk.v1"]) as socket:
        channels = advertised(socket)
        unit = b"hivtac-rig-1".hex()
        names = ["contact", "contacts", "markers", "place", "slip", "status", "wrench"]
        expected = {"/diagnostics", *(f"/hivtac/unit_{unit}/{name}" for name in names)}
        assert set(channels) == expected, channels
        yield from messages(socket, channels[f"/hivtac/unit_{unit}/wrench"])


def advertised(socket, count=8):
    """As many channels that a server of Foxglove's protocol tells of, by their topics."""
    channels = {}
    while len(channels) < count:
        told = json.loads(socket.recv(timeout=PATIENCE))
        for channel in told.get("channels", []):
            channels[channel["topic"]] = channel
    return channels


def messages(socket, channel):
    """Subscribes, and gives each message as its schema says."""
    wanted = {"id": 3, "channelId": channel["id"]}
    socket.send(json.dumps({"op": "subscribe", "subscriptions": [wanted]}))
    schema = Schema(
        id=1,
        name=channel["schemaName"],
        encoding=channel["schemaEncoding"],
        data=channel["schema"].encode(),
    )
    decode = DecoderFactory().decoder_for(channel["encoding"], schema)
    while True:
        data = socket.recv(timeout=PATIENCE)
        if isinstance(data, bytes) and data[0] == 1:
            subscription, _ = struct.unpack_from("<IQ", data, 1)
            assert subscription == 3, data
            yield decode(data[13:])


if __name__ == "__main__":
    runner = unittest.TextTestRunner(stream=sys.stdout, verbosity=2)
    unittest.main(testRunner=runner)
