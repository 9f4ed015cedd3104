//! Hashes of the types of messages, by which `rmw_zenoh_cpp` distinguishes versions of a type.
//!
//! They are those of ROS 2 Jazzy and later (REP 2016); `tests/python/test_zenoh.py` has them
//! computed by another program.

/// The hashes by the names of the types.
pub const ALL: [(&str, &str); 10] = [
    (
        "diagnostic_msgs/msg/DiagnosticArray",
        "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    ),
    (
        "geometry_msgs/msg/PointStamped",
        "RIHS01_4c0296af86e01e562e9e0405d138a01537247580076c58ea38d7923ac1045897",
    ),
    (
        "geometry_msgs/msg/PolygonStamped",
        "RIHS01_b7cf07932f1523d4b4088075945c1a0141f7cd21da87cc940fc61652e9138b46",
    ),
    (
        "geometry_msgs/msg/Vector3Stamped",
        "RIHS01_d4829622288cbb443886e7ea94ea5671a3b1be6bab4ad04224432a65f7d7887a",
    ),
    (
        "geometry_msgs/msg/WrenchStamped",
        "RIHS01_8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77",
    ),
    (
        "sensor_msgs/msg/PointCloud2",
        "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
    ),
    (
        "std_msgs/msg/Bool",
        "RIHS01_feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9",
    ),
    (
        "std_msgs/msg/Float64",
        "RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a",
    ),
    (
        "std_msgs/msg/String",
        "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    ),
    (
        "std_srvs/srv/Trigger",
        "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f",
    ),
];

/// The hash of a type; `None` for a type that the node does not use.
pub fn of(name: &str) -> Option<&'static str> {
    let known = ALL.iter().find(|(known, _)| *known == name);
    known.map(|(_, hash)| *hash)
}
