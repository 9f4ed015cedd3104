//! The fields of a force: name, unit and digits for terminal, JSON, CSV, live page and Python.

use crate::decimal::Decimal;
use Quantity::{Angle, Length, NewtonMetres, Newtons};
use hivtac_terms::force::{Force, MOST_CONTACTS, Place, Torque};
use serde::ser::{Serialize, SerializeMap, Serializer};

/// The quantity of a field. The wire counts it in thousandths of a degree, in µN, in µm or in nN·m.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Degrees.
    Angle,
    /// Newtons.
    Newtons,
    /// Millimetres.
    Length,
    /// Newton metres.
    NewtonMetres,
}

impl Quantity {
    /// The unit for a person: a thousand steps of the wire format.
    pub fn unit(self) -> &'static str {
        match self {
            Angle => "°",
            Newtons => "mN",
            Length => "mm",
            NewtonMetres => "mN·mm",
        }
    }

    /// Decimals in the unit of the field's name: all that the wire format has.
    fn decimals(self) -> u32 {
        match self {
            Angle | Length => 3,
            Newtons => 6,
            NewtonMetres => 9,
        }
    }
}

/// A field of a force, or of its place.
pub struct Field<T> {
    /// Its name in JSON and CSV, with the unit.
    pub name: &'static str,
    /// Its column heading for a person; empty if it has no column.
    pub symbol: &'static str,
    /// Its quantity.
    pub quantity: Quantity,
    integer: fn(&T) -> i64,
}

/// All fields except the place.
pub const FORCE: [Field<Force>; 8] = [
    field("alpha_deg", "α", Angle, |it| it.alpha.0.into()),
    field("beta_deg", "β", Angle, |it| it.beta.0.into()),
    field("magnitude_n", "|F|", Newtons, |it| it.magnitude.0.into()),
    field("x_n", "Fx", Newtons, |it| it.cartesian[0].0.into()),
    field("y_n", "Fy", Newtons, |it| it.cartesian[1].0.into()),
    field("z_n", "Fz", Newtons, |it| it.cartesian[2].0.into()),
    field("direction_sigma_deg", "", Angle, |it| {
        it.direction_sigma.0.into()
    }),
    field("magnitude_sigma_n", "", Newtons, |it| {
        it.magnitude_sigma.0.into()
    }),
];

/// The place where the tip touches the film; some models do not give it.
pub const PLACE: [Field<Place>; 3] = [
    field("place_x_mm", "place x", Length, |it| it.x.0.into()),
    field("place_y_mm", "place y", Length, |it| it.y.0.into()),
    field("place_sigma_mm", "place ±", Length, |it| it.sigma.0.into()),
];

/// The torque about the film's normal; few frames show one.
pub const TORQUE: [Field<Torque>; 2] = [
    field("torque_z_nm", "torque", NewtonMetres, |it| it.z.0.into()),
    field("torque_sigma_nm", "", NewtonMetres, |it| it.sigma.0.into()),
];

const fn field<T>(
    name: &'static str,
    symbol: &'static str,
    quantity: Quantity,
    integer: fn(&T) -> i64,
) -> Field<T> {
    Field {
        name,
        symbol,
        quantity,
        integer,
    }
}

impl<T> Field<T> {
    /// Its integer of the wire format.
    pub fn integer(&self, of: &T) -> i64 {
        (self.integer)(of)
    }

    /// Its value in the unit of its name.
    pub fn decimal(&self, of: &T) -> Decimal {
        Decimal::new(self.integer(of), self.quantity.decimals())
    }

    /// Its value in the unit for a person.
    pub fn shown(&self, of: &T) -> Decimal {
        Decimal::thousandths(self.integer(of))
    }

    /// Its value in rad, N, m or N·m.
    pub fn si(&self, of: &T) -> f64 {
        let integer = self.integer(of) as f64;
        match self.quantity {
            Angle => (integer / 1e3).to_radians(),
            Newtons | Length => integer / 1e6,
            NewtonMetres => integer / 1e9,
        }
    }
}

/// The names of all fields of each contact, the first contact's first: `contact1_…`.
pub fn contact_names() -> Vec<String> {
    let of_one = || {
        FORCE
            .map(|it| it.name)
            .into_iter()
            .chain(PLACE.map(|it| it.name))
            .chain(TORQUE.map(|it| it.name))
    };
    let numbers = 1..=MOST_CONTACTS;
    let names =
        numbers.flat_map(|number| of_one().map(move |name| format!("contact{number}_{name}")));
    names.collect()
}

/// A force as a JSON object of all fields; those of an unknown place or torque are `null`.
pub struct ForceJson(pub Force);

impl Serialize for ForceJson {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let ForceJson(force) = self;
        let mut fields =
            serializer.serialize_map(Some(FORCE.len() + PLACE.len() + TORQUE.len()))?;
        for field in FORCE {
            fields.serialize_entry(field.name, &field.decimal(force))?;
        }
        for field in PLACE {
            let number = force.place.as_ref().map(|place| field.decimal(place));
            fields.serialize_entry(field.name, &number)?;
        }
        for field in TORQUE {
            let number = force.torque.as_ref().map(|torque| field.decimal(torque));
            fields.serialize_entry(field.name, &number)?;
        }
        fields.end()
    }
}

/// Returns a place along x and y from the film's middle, m.
pub fn place_m(place: Place) -> [f64; 2] {
    [place.x.0, place.y.0].map(|part| f64::from(part) * 1e-6)
}

/// Returns the place of a force along x and y and its standard uncertainty, m; NaN if unknown.
pub fn place_si(force: &Force) -> [f64; 3] {
    let place = force.place.as_ref();
    place.map_or([f64::NAN; 3], |place| PLACE.map(|it| it.si(place)))
}

/// Returns the torque about the film's normal and its standard uncertainty, N·m; NaN if unknown.
pub fn torque_si(force: &Force) -> [f64; 2] {
    let torque = force.torque.as_ref();
    torque.map_or([f64::NAN; 2], |torque| TORQUE.map(|it| it.si(torque)))
}

/// Returns the torque about the film's middle, N·m: of a force at its place, or of the two contacts
/// whose sum it is, and that about the film's normal. What is unknown adds nothing.
pub fn torque_nm(force: &Force, contacts: &[Force]) -> [f64; 3] {
    let parts = match contacts {
        [_, _] => contacts,
        _ => std::slice::from_ref(force),
    };
    let mut sum = [0.0; 3];
    for part in parts {
        if let Some(torque) = &part.torque {
            sum[2] += TORQUE[0].si(torque);
        }
        let Some(place) = part.place else { continue };
        let [x, y] = place_m(place);
        let [fx, fy, fz] = part.cartesian.map(|un| f64::from(un.0) * 1e-6);
        for (sum, own) in sum.iter_mut().zip([y * fz, -x * fz, x * fy - y * fx]) {
            *sum += own;
        }
    }
    sum
}
