//! `hivtac settings`: shows, changes, exports, imports and resets what a device keeps.

/// Makes a module for `#[serde(with)]` of an optional value, from the functions that write and read
/// a present one.
macro_rules! optional_json {
    ($module:ident, $type:ty, $json:literal) => {
        mod $module {
            use super::*;
            use serde::{Deserializer, Serializer};

            #[derive(Serialize, Deserialize)]
            struct There(#[serde(with = $json)] $type);

            pub fn serialize<S: Serializer>(it: &Option<$type>, to: S) -> Result<S::Ok, S::Error> {
                it.map(There).serialize(to)
            }

            pub fn deserialize<'d, D>(from: D) -> Result<Option<$type>, D::Error>
            where
                D: Deserializer<'d>,
            {
                Ok(Option::<There>::deserialize(from)?.map(|There(it)| it))
            }
        }
    };
}

mod arguments;
mod camera;
mod conversation;
mod file;
mod gravity;
mod name;
pub mod temporal;

pub use arguments::SettingsCommand;
pub use conversation::{ask, rest_text};
