//! Messages of ROS 2: their definitions, and their encoding as CDR.

pub mod channel;

use hivtac_terms::force::{Force, Place};
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
=========================================================================
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

    #[test]
    fn bytes_lie_where_replay_looks_for_them() {
        assert_eq!(bytes(b"xyz")[BEFORE_BYTES..], *b"xyz");
    }
}
