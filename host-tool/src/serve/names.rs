//! Checks names and converts them to those that ROS 2 allows.

use hivtac_host::failure::{Failure, Kind};
use hivtac_host::shown::{shown, unit_number};
use hivtac_wire::message::DeviceHello;

/// Whether a name can be a node's or a part of a topic's: letters, digits and single underscores, a
/// letter first.
fn is_legal(name: &str) -> bool {
    let of_it = |c: char| c.is_ascii_alphanumeric() || c == '_';
    name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(of_it)
        && !name.contains("__")
        && !name.ends_with('_')
}

/// Checks the user's name of the node.
///
/// # Errors
/// [`Kind::Usage`] when ROS 2 does not allow the name.
pub fn check(name: &str) -> Result<(), Failure> {
    match is_legal(name) {
        true => Ok(()),
        false => Err(Failure::new(
            Kind::Usage,
            format!(
                "--name {}: a node's name in ROS 2 has letters (a–z, A–Z), digits and single \
                 underscores, a letter first and no underscore last",
                shown(name)
            ),
        )),
    }
}

/// A device's own name as ROS 2 allows it, with underscores for other characters. `None` if there
/// is no letter to begin with, or if it is the grip's.
fn of_device(name: &str) -> Option<String> {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let plain: String = name.chars().map(plain).collect();
    let parts: Vec<&str> = plain.split('_').filter(|part| !part.is_empty()).collect();
    Some(parts.join("_")).filter(|name| is_legal(name) && name != GRIP)
}

/// The name of the grip's topics, which no device has.
const GRIP: &str = "grip";

/// Names of the devices' topics, in the devices' order. `None` for a single device; otherwise each
/// device's name. It is `unit_NUMBER` if ROS 2 does not allow the name or two devices share it.
pub fn of_devices(hellos: &[DeviceHello]) -> Vec<Option<String>> {
    if hellos.len() == 1 {
        return vec![None];
    }
    let own: Vec<Option<String>> = hellos.iter().map(|hello| of_device(&hello.name)).collect();
    let is_alone = |name: &Option<String>| own.iter().filter(|it| *it == name).count() == 1;
    let names = hellos.iter().zip(&own).map(|(hello, name)| {
        let unit = || format!("unit_{}", unit_number(&hello.device_id));
        let alone = name.clone().filter(|_| is_alone(name));
        Some(alone.unwrap_or_else(unit))
    });
    names.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_ros_2_allows_stay_and_others_are_made_so() {
        for (name, expected) in [
            ("thumb", Some("thumb")),
            ("Left_Thumb2", Some("Left_Thumb2")),
            ("left thumb", Some("left_thumb")),
            ("_a--b__c_", Some("a_b_c")),
            ("Daumen rechts äußen", Some("Daumen_rechts_u_en")),
            ("\u{1b}[31mred", None),
            ("3rd", None),
            ("grip", None),
            ("±", None),
            ("", None),
        ] {
            let found = of_device(name);
            assert_eq!(found.as_deref(), expected, "{name:?}");
        }
    }

    #[test]
    fn a_nodes_name_is_checked() {
        for name in ["hivtac", "a", "Tip_2"] {
            assert!(check(name).is_ok(), "{name}");
        }
        for name in [
            "", "2tip", "a__b", "a_", "_a", "a/b", "a b", "ä", "a\u{1b}b",
        ] {
            let failure = check(name).unwrap_err();
            assert_eq!(failure.kind, Kind::Usage, "{name:?}");
            assert!(!failure.to_string().contains('\u{1b}'), "{failure}");
        }
    }
}
