"""`hivtac serve --ros2` on Zenoh, on the simulated sensor, received by a client that is none of
this project's: `zenoh-ros2-sdk`, which speaks as `rmw_zenoh_cpp` does, over Zenoh's own router.

    HIVTAC_TOOL=… python tests/python/test_zenoh.py

HIVTAC_TOOL is built with the feature `zenoh`. `cargo xtask test --all zenoh` builds it, and
installs the packages first.
"""

# /// script
# requires-python = ">=3.10"
# dependencies = ["zenoh-ros2-sdk>=0.1.8"]
# ///

import os
import socket
import sys
import unittest

import zenoh
from rig import true_force
from rosbags.typesys import Stores, get_typestore
from serve import INTERRUPTED, Serve, refused, until
from twin import PRESSED, Twin
from zenoh_ros2_sdk.publisher import ROS2Publisher
from zenoh_ros2_sdk.service_client import ROS2ServiceClient
from zenoh_ros2_sdk.subscriber import ROS2Subscriber
from zenoh_ros2_sdk.utils import compute_service_type_hash

TYPES = get_typestore(Stores.ROS2_JAZZY)
WRENCH = "geometry_msgs/msg/WrenchStamped"
TRIGGER = "std_srvs/srv/Trigger"
REQUEST, REPLY = "# no field\n", "bool success\nstring message\n"
# A domain that nobody else is likely to use.
DOMAIN = 97


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


PORT = free_port()


def router():
    """A router of Zenoh on this computer alone, as `rmw_zenohd` is one."""
    config = zenoh.Config()
    config.insert_json5("mode", '"router"')
    config.insert_json5("listen/endpoints", f'["tcp/127.0.0.1:{PORT}"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


def environment(**changes):
    endpoints = f'connect/endpoints=["tcp/127.0.0.1:{PORT}"]'
    return os.environ | {
        "RMW_IMPLEMENTATION": "rmw_zenoh_cpp",
        "ZENOH_CONFIG_OVERRIDE": endpoints,
        **changes,
    }


def options(twin):
    return ["--ros2", "--domain", str(DOMAIN), "--port", twin.port]


def serving(twin, **changes):
    return Serve(*options(twin), env=environment(**changes))


def subscribe(topic, kind, messages):
    definition, _ = TYPES.generate_msgdef(kind)
    return ROS2Subscriber(
        topic,
        kind,
        messages.append,
        msg_definition=definition,
        domain_id=DOMAIN,
        router_port=PORT,
        type_hash=TYPES.hash_rihs01(kind),
    )


class OnZenoh(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.router = router()
        cls.twin = Twin(PRESSED)

    @classmethod
    def tearDownClass(cls):
        cls.twin.__exit__()
        cls.router.close()

    def test_forces_reach_a_subscription_each_once_with_the_true_force(self):
        messages = []
        wrench = subscribe("/hivtac/wrench", WRENCH, messages)
        with serving(self.twin) as serve:
            self.assertEqual(serve.ready, {"ros2": "/hivtac", "domain": str(DOMAIN)})
            until(lambda: len(messages) >= 500)
            errors = serve.end()
        wrench.close()
        stamps = [(it.header.stamp.sec, it.header.stamp.nanosec) for it in messages]
        self.assertEqual(stamps, sorted(set(stamps)))
        last = messages[-1]
        self.assertEqual(last.header.frame_id, "hivtac_film")
        truth = true_force(list(self.twin.truth().values())[-1])
        force = last.wrench.force
        for found, true in zip((force.x, force.y, force.z), truth, strict=True):
            self.assertAlmostEqual(found, true, delta=0.01)
        self.assertEqual((serve.code, errors), (INTERRUPTED, ""))

    def test_every_topic_has_the_type_that_ros_2_gives_it(self):
        kinds = {
            "wrench": WRENCH,
            "place": "geometry_msgs/msg/PointStamped",
            "contacts": "sensor_msgs/msg/PointCloud2",
            "markers": "geometry_msgs/msg/PolygonStamped",
            "contact": "std_msgs/msg/Bool",
            "slip": "std_msgs/msg/Bool",
            "status": "std_msgs/msg/String",
        }
        topics = {f"/hivtac/{name}": kind for name, kind in kinds.items()}
        topics["/diagnostics"] = "diagnostic_msgs/msg/DiagnosticArray"
        received = {topic: [] for topic in topics}
        readers = [subscribe(topic, topics[topic], received[topic]) for topic in topics]
        with serving(self.twin):
            until(lambda: all(received.values()))
            tokens = [
                str(reply.ok.key_expr)
                for reply in self.router.liveliness().get(f"@ros2_lv/{DOMAIN}/**")
            ]
        for reader in readers:
            reader.close()
        own = [token for token in tokens if "/%/%/hivtac" in token]
        # The node, eight writers, a service, and a reader.
        kinds = sorted(token.split("/")[5] for token in own)
        self.assertEqual(kinds, sorted(["NN", *["MP"] * 8, "SS", "MS"]), tokens)
        vector = TYPES.hash_rihs01("geometry_msgs/msg/Vector3Stamped")
        [reader] = [token for token in own if "/MS/" in token]
        self.assertIn(f"Vector3Stamped_/{vector}/", reader)

    def test_a_tare_is_taken_and_gravity_is_heard(self):
        service_hash = compute_service_type_hash(TRIGGER, REQUEST, REPLY)
        client = ROS2ServiceClient(
            "/hivtac/tare",
            TRIGGER,
            request_definition=REQUEST,
            response_definition=REPLY,
            domain_id=DOMAIN,
            router_port=PORT,
            type_hash=service_hash,
        )
        kind = "geometry_msgs/msg/Vector3Stamped"
        gravity = ROS2Publisher(
            "/hivtac/gravity",
            kind,
            msg_definition=TYPES.generate_msgdef(kind)[0],
            domain_id=DOMAIN,
            router_port=PORT,
            type_hash=TYPES.hash_rihs01(kind),
        )
        header = TYPES.types["std_msgs/msg/Header"]
        stamp = TYPES.types["builtin_interfaces/msg/Time"](0, 0)
        vector = TYPES.types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
        with Twin("rest") as twin, serving(twin) as serve:
            reply = until(lambda: client.call(structure_needs_at_least_one_member=0))
            self.assertTrue(reply.success, reply.message)
            self.assertRegex(reply.message, "tare taken over")
            # No direction: it is refused, which shows that it came.
            gravity.publish(header=header(stamp, "hivtac_film"), vector=vector)
            until(lambda: "a vector of gravity is left out" in serve.errors())
        client.close()
        gravity.close()

    def test_a_second_one_of_its_name_is_reported(self):
        words = f"another node in domain {DOMAIN} is called /hivtac, too"
        with Twin() as twin, serving(self.twin) as first, serving(twin) as second:
            until(lambda: words in first.errors() and words in second.errors())

    def test_without_a_router_and_with_a_wrong_setting_it_says_what_to_do(self):
        alone = f'connect/endpoints=["tcp/127.0.0.1:{free_port()}"]'
        with serving(self.twin, ZENOH_CONFIG_OVERRIDE=alone) as serve:
            until(lambda: "rmw_zenohd" in serve.errors())
        for wrong, why in [
            ("mode", "is not key=value"),
            ("no/such/key=1", "no/such/key"),
        ]:
            env = environment(ZENOH_CONFIG_OVERRIDE=wrong)
            ended = refused(*options(self.twin), env=env)
            self.assertEqual(ended.returncode, 1)
            self.assertIn("cannot take part in ROS 2's domain", ended.stderr)
            self.assertIn(why, ended.stderr)
            self.assertIn("ZENOH_CONFIG_OVERRIDE", ended.stderr)


if __name__ == "__main__":
    runner = unittest.TextTestRunner(stream=sys.stdout, verbosity=2)
    unittest.main(testRunner=runner)
