//! Messages of ROS 2: their definitions, and their encoding as CDR.

pub mod channel;
#[cfg(feature = "zenoh")]
pub mod type_hash;

use crate::force_fields::{FORCE, place_m, place_si, torque_nm, torque_si};
use hivtac_terms::force::Force;
use hivtac_terms::marker::Marker;

/// A type of message: name and definition, with those of the types it uses.
pub struct Definition {
    /// Its name, such as `std_msgs/msg/Bool`.
    pub name: &'static str,
    /// Its definition in ROS's interface language.
    pub text: &'static str,
}

/// The part of a definition that follows the own fields of a message with a header.
macro_rules! header {
    () => {
        "\
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
"
    };
}

/// F along x, y and z, N, and torque around the film's middle, N·m.
pub const WRENCH: Definition = Definition {
    name: "geometry_msgs/msg/WrenchStamped",
    text: concat!(
        "\
std_msgs/Header header
geometry_msgs/Wrench wrench
================================================================================
",
        header!(),
        "\
MSG: geometry_msgs/Wrench
geometry_msgs/Vector3 force
geometry_msgs/Vector3 torque
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"
    ),
};

/// The place where the tip touches the film, m from its middle.
pub const POINT: Definition = Definition {
    name: "geometry_msgs/msg/PointStamped",
    text: concat!(
        "\
std_msgs/Header header
geometry_msgs/Point point
================================================================================
",
        header!(),
        "\
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
"
    ),
};

/// Markers 0–3: column and row of each, px, and its area as z, px.
pub const POLYGON: Definition = Definition {
    name: "geometry_msgs/msg/PolygonStamped",
    text: concat!(
        "\
std_msgs/Header header
geometry_msgs/Polygon polygon
================================================================================
",
        header!(),
        "\
MSG: geometry_msgs/Polygon
geometry_msgs/Point32[] points
================================================================================
MSG: geometry_msgs/Point32
float32 x
float32 y
float32 z
"
    ),
};

/// Each contact: its place as x and y, m, its force, N, and their standard uncertainties, m, N and
/// rad.
pub const CONTACTS: Definition = Definition {
    name: "sensor_msgs/msg/PointCloud2",
    text: concat!(
        "\
std_msgs/Header header
uint32 height
uint32 width
sensor_msgs/PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
================================================================================
",
        header!(),
        "\
MSG: sensor_msgs/PointField
uint8 INT8=1
uint8 UINT8=2
uint8 INT16=3
uint8 UINT16=4
uint8 INT32=5
uint8 UINT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
string name
uint32 offset
uint8 datatype
uint32 count
"
    ),
};

/// Whether something touches the film.
pub const BOOL: Definition = Definition {
    name: "std_msgs/msg/Bool",
    text: "bool data\n",
};

/// A number.
pub const FLOAT64: Definition = Definition {
    name: "std_msgs/msg/Float64",
    text: "float64 data\n",
};

/// Names of status bits.
pub const STRING: Definition = Definition {
    name: "std_msgs/msg/String",
    text: "string data\n",
};

/// Bytes.
pub const BYTES: Definition = Definition {
    name: "std_msgs/msg/UInt8MultiArray",
    text: "\
std_msgs/MultiArrayLayout layout
uint8[] data
================================================================================
MSG: std_msgs/MultiArrayLayout
std_msgs/MultiArrayDimension[] dim
uint32 data_offset
================================================================================
MSG: std_msgs/MultiArrayDimension
string label
uint32 size
uint32 stride
",
};

/// The state of devices.
#[cfg(any(feature = "ros2", feature = "foxglove"))]
pub const DIAGNOSTICS: Definition = Definition {
    name: "diagnostic_msgs/msg/DiagnosticArray",
    text: concat!(
        "\
std_msgs/Header header
diagnostic_msgs/DiagnosticStatus[] status
================================================================================
",
        header!(),
        "\
MSG: diagnostic_msgs/DiagnosticStatus
byte OK=0
byte WARN=1
byte ERROR=2
byte STALE=3
byte level
string name
string message
string hardware_id
diagnostic_msgs/KeyValue[] values
================================================================================
MSG: diagnostic_msgs/KeyValue
string key
string value
"
    ),
};

/// The severity of a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Level {
    /// As it should be.
    Ok = 0,
    /// There are forces, with a warning.
    Warn = 1,
    /// There are no forces.
    Error = 2,
    /// No samples have come.
    Stale = 3,
}

/// The state of a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnosis {
    /// Its severity.
    pub level: Level,
    /// The device's name.
    pub name: String,
    /// Its state, and the remedy.
    pub message: String,
    /// The device's serial number.
    pub hardware_id: String,
    /// All other known values.
    pub values: Vec<(&'static str, String)>,
}

/// A buffer of little-endian CDR. Numbers lie at multiples of their size, counted from behind the
/// first four bytes.
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Cdr {
        Cdr(vec![0, 1, 0, 0])
    }

    fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        let used = self.0.len() - 4;
        self.0.resize(4 + used.next_multiple_of(N), 0);
        self.0.extend(bytes);
    }

    fn string(&mut self, text: &str) {
        self.number((text.len() as u32 + 1).to_le_bytes());
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    /// Adds a header: a time, ns since 1970, and the frame of the coordinates.
    fn header(&mut self, stamp_ns: u64, frame: &str) {
        self.number(((stamp_ns / 1_000_000_000) as i32).to_le_bytes());
        self.number(((stamp_ns % 1_000_000_000) as u32).to_le_bytes());
        self.string(frame);
    }

    fn vector(&mut self, parts: [f64; 3]) {
        parts
            .into_iter()
            .for_each(|part| self.number(part.to_le_bytes()));
    }
}

/// A [`WRENCH`] of a force, or of the two contacts whose sum it is. Its torque is [`torque_nm`].
pub fn wrench(stamp_ns: u64, frame: &str, force: &Force, contacts: &[Force]) -> Vec<u8> {
    let force_n = force.cartesian.map(|part| f64::from(part.0) * 1e-6);
    wrench_of(stamp_ns, frame, force_n, torque_nm(force, contacts))
}

/// A [`WRENCH`] of a force, N, and a torque, N·m.
pub fn wrench_of(stamp_ns: u64, frame: &str, force: [f64; 3], torque: [f64; 3]) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, frame);
    cdr.vector(force);
    cdr.vector(torque);
    cdr.0
}

/// A [`POINT`]; `None` if the force has no place.
pub fn point(stamp_ns: u64, frame: &str, force: &Force) -> Option<Vec<u8>> {
    let place = force.place?;
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, frame);
    let [x, y] = place_m(place);
    cdr.vector([x, y, 0.0]);
    Some(cdr.0)
}

/// A [`POLYGON`].
pub fn polygon(stamp_ns: u64, frame: &str, markers: &[Marker]) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, frame);
    cdr.number((markers.len() as u32).to_le_bytes());
    for marker in markers {
        let numbers = [
            marker.x.to_f64() as f32,
            marker.y.to_f64() as f32,
            marker.area as f32,
        ];
        numbers
            .into_iter()
            .for_each(|number| cdr.number(number.to_le_bytes()));
    }
    cdr.0
}

/// The fields of a contact in [`CONTACTS`].
const CONTACT_FIELDS: [&str; 12] = [
    "x",
    "y",
    "z",
    "force_x",
    "force_y",
    "force_z",
    "magnitude",
    "place_sigma",
    "magnitude_sigma",
    "direction_sigma",
    "torque_z",
    "torque_sigma",
];

/// [`CONTACTS`]. An unknown place is NaN.
pub fn contacts(stamp_ns: u64, frame: &str, contacts: &[Force]) -> Vec<u8> {
    const FLOAT32: u8 = 7;
    let number = |cdr: &mut Cdr, number: usize| cdr.number((number as u32).to_le_bytes());
    let step = size_of::<f32>() * CONTACT_FIELDS.len();
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, frame);
    number(&mut cdr, 1);
    number(&mut cdr, contacts.len());
    number(&mut cdr, CONTACT_FIELDS.len());
    for (nth, name) in CONTACT_FIELDS.into_iter().enumerate() {
        cdr.string(name);
        number(&mut cdr, size_of::<f32>() * nth);
        cdr.number([FLOAT32]);
        number(&mut cdr, 1);
    }
    cdr.number([0]);
    number(&mut cdr, step);
    number(&mut cdr, step * contacts.len());
    number(&mut cdr, step * contacts.len());
    for contact in contacts {
        cdr.0
            .extend(contact_numbers(contact).map(f32::to_le_bytes).concat());
    }
    let are_placed = contacts.iter().all(|contact| contact.place.is_some());
    cdr.number([u8::from(are_placed)]);
    cdr.0
}

/// The numbers of a contact in the order of [`CONTACT_FIELDS`].
fn contact_numbers(force: &Force) -> [f32; CONTACT_FIELDS.len()] {
    let [_, _, size, fx, fy, fz, angle_sigma, size_sigma] = FORCE.map(|it| it.si(force));
    let [x, y, sigma] = place_si(force);
    let [torque, torque_sigma] = torque_si(force);
    let place = [x, y, 0.0];
    let sigmas = [sigma, size_sigma, angle_sigma, torque, torque_sigma];
    let mut numbers = [0.0; CONTACT_FIELDS.len()];
    let all = place.into_iter().chain([fx, fy, fz, size]).chain(sigmas);
    for (number, value) in numbers.iter_mut().zip(all) {
        *number = value as f32;
    }
    numbers
}

/// The frame and the vector of a `geometry_msgs/msg/Vector3Stamped`, from CDR behind its encoding.
/// `None` for other bytes. Little-endian, as on all platforms of ROS 2.
#[cfg(any(test, feature = "ros2"))]
pub fn vector_stamped(body: &[u8]) -> Option<(&str, [f64; 3])> {
    const STAMP: usize = 8;
    let (length, rest) = body.get(STAMP..)?.split_first_chunk()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    let frame = rest.get(..length)?.strip_suffix(&[0])?;
    let behind = (STAMP + 4 + length).next_multiple_of(8);
    let (parts, _) = body.get(behind..)?.as_chunks();
    let vector = [parts.first()?, parts.get(1)?, parts.get(2)?];
    let vector = vector.map(|part| f64::from_le_bytes(*part));
    Some((std::str::from_utf8(frame).ok()?, vector))
}

/// The reply of a service of type `std_srvs/srv/Trigger`.
#[cfg(feature = "ros2")]
pub fn trigger_reply(success: bool, message: &str) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.number([u8::from(success)]);
    cdr.string(message);
    cdr.0
}

/// A [`DIAGNOSTICS`] of one device.
pub fn diagnostics(stamp_ns: u64, diagnosis: &Diagnosis) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.header(stamp_ns, "");
    cdr.number(1u32.to_le_bytes());
    cdr.number([diagnosis.level as u8]);
    cdr.string(&diagnosis.name);
    cdr.string(&diagnosis.message);
    cdr.string(&diagnosis.hardware_id);
    cdr.number((diagnosis.values.len() as u32).to_le_bytes());
    for (key, value) in &diagnosis.values {
        cdr.string(key);
        cdr.string(value);
    }
    cdr.0
}

/// A [`BOOL`].
pub fn bool(value: bool) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.0.push(u8::from(value));
    cdr.0
}

/// A [`FLOAT64`].
pub fn number(value: f64) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.number(value.to_le_bytes());
    cdr.0
}

/// A [`STRING`].
pub fn string(text: &str) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.string(text);
    cdr.0
}

/// A [`BYTES`].
pub fn bytes(bytes: &[u8]) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.number(0u32.to_le_bytes());
    cdr.number(0u32.to_le_bytes());
    cdr.number((bytes.len() as u32).to_le_bytes());
    cdr.0.extend(bytes);
    cdr.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::BEFORE_BYTES;
    use hivtac_terms::force::Place;
    use hivtac_terms::units::{MicroNewtons, Px, SignedMicrometres};

    /// Behind the header: the number of points, then column, row and area of each.
    #[test]
    fn a_polygon_has_a_point_for_each_marker() {
        let marker = |id: i32| Marker {
            x: Px(id << 16),
            y: Px(-(id << 16)),
            area: 170,
        };
        let bytes = polygon(0, "", &[0, 1, 2, 3, 4, 5, 6, 7].map(marker));
        let (header, points) = bytes.split_at(bytes.len() - 8 * 12);
        assert!(header.ends_with(&[8, 0, 0, 0]), "{header:?}");
        let last = [7.0_f32, -7.0, 170.0].map(f32::to_le_bytes).concat();
        assert!(points.ends_with(&last), "{points:?}");
    }

    #[test]
    fn numbers_are_aligned_behind_the_encoding() {
        let mut cdr = Cdr::new();
        cdr.header(1_500_000_000, "ab");
        cdr.vector([1.0, 0.0, 0.0]);
        let header = [
            0, 1, 0, 0, 1, 0, 0, 0, 0, 0x65, 0xcd, 0x1d, 3, 0, 0, 0, b'a', b'b', 0,
        ];
        assert_eq!(cdr.0[..19], header);
        // 15 bytes are used: the next multiple of 8 is 16.
        assert_eq!(cdr.0[19..28], [0, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f]);
        assert_eq!(cdr.0.len(), 20 + 24);
    }

    #[test]
    fn a_stamped_vector_is_read_and_nothing_else() {
        for frame in ["", "hivtac_film", "hivtac_thumb_film"] {
            let mut cdr = Cdr::new();
            cdr.header(1_500_000_000, frame);
            cdr.vector([0.5, -9.0, 1e-3]);
            let body = &cdr.0[4..];
            assert_eq!(vector_stamped(body), Some((frame, [0.5, -9.0, 1e-3])));
            for length in 0..body.len() {
                assert_eq!(vector_stamped(&body[..length]), None);
            }
        }
        assert_eq!(vector_stamped(&[0xff; 64]), None);
    }

    /// Behind the fields: endianness, sizes, numbers of each contact, and whether all are known.
    #[test]
    fn contacts_have_their_numbers_one_after_the_other() {
        let force = |size: i32| Force {
            magnitude: MicroNewtons(size),
            cartesian: [0, 0, -size].map(MicroNewtons),
            place: Some(Place {
                x: SignedMicrometres(size / 10),
                ..Place::default()
            }),
            ..Force::default()
        };
        let both = contacts(0, "film", &[force(50_000), force(20_000)]);
        let place_and_force = [2e-3_f32, 0.0, 0.0, 0.0, 0.0, -0.02, 0.02];
        let sigmas_and_torque = [0.0, 0.0, 0.0, f32::NAN, f32::NAN];
        let second = [&place_and_force[..], &sigmas_and_torque].concat();
        let second = second.into_iter().flat_map(f32::to_le_bytes);
        let end: Vec<u8> = second.chain([1]).collect();
        assert!(both.ends_with(&end), "{both:?}");
        let sizes = [48_u32, 96, 96].map(u32::to_le_bytes).concat();
        let numbers = both.len() - 1 - 96;
        assert_eq!(both[numbers - 12..numbers], sizes);
        let none = contacts(0, "film", &[]);
        assert_eq!(none.len(), both.len() - 96);
        let mut unplaced = force(50_000);
        unplaced.place = None;
        assert_eq!(contacts(0, "film", &[unplaced]).last(), Some(&0));
    }

    #[test]
    fn bytes_lie_where_replay_looks_for_them() {
        assert_eq!(bytes(b"xyz")[BEFORE_BYTES..], *b"xyz");
    }
}
