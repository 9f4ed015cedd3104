//! Formats the sensing's result for a picture as text and as JSON.

use crate::lines::{contact_text, status_text};
use hivtac_host::force_fields::{FORCE, ForceJson, PLACE};
use hivtac_host::marker_fields::MarkerJson;
use hivtac_host::shown::to_json;
use hivtac_sensor::markers::blob::Blob;
use hivtac_sensor::markers::rules::pattern::{LARGEST_STRAIN, LARGEST_TURN, SCALE};
use hivtac_sensor::markers::rules::{Finder, Unlike};
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::Measurement;
use hivtac_terms::force::{self, Force};
use hivtac_terms::status::Status;
use serde::Serialize;

/// A picture with a median brightness below the first, of 255, is dark; from the second on, white.
const DARK: u8 = 20;
const WHITE: u8 = 240;

/// The markers 0 to 3 of four.
const CORNERS: [&str; 4] = ["upper left", "upper right", "lower right", "lower left"];

/// Everything found in one picture. Positions are in pixels, exact, with 16 binary places.
#[derive(Serialize)]
pub struct Finding<'a> {
    image: &'a str,
    width: u16,
    height: u16,
    blobs: Vec<BlobJson>,
    markers: Option<Vec<MarkerJson>>,
    features: Option<Vec<f64>>,
    force: Option<ForceJson>,
    contacts: Vec<ForceJson>,
    contact: Option<bool>,
    status: Vec<&'static str>,
    #[serde(skip)]
    focal_px: f64,
    #[serde(skip)]
    overflow: bool,
    /// Median of the picture's value or luma if nothing passes the threshold.
    #[serde(skip)]
    brightness: Option<u8>,
    /// By which rule there is no force, where blobs are there.
    #[serde(skip)]
    rule: Option<String>,
}

#[derive(Serialize)]
struct BlobJson {
    /// Why it is no marker; `None` if it could be one.
    no_marker: Option<String>,
    area: u32,
    cx: f64,
    cy: f64,
    x0: u16,
    y0: u16,
    x1: u16,
    y1: u16,
}

impl BlobJson {
    fn new(blob: &Blob, finder: &Finder) -> BlobJson {
        let (x, y) = blob.centroid();
        let Blob {
            area,
            x0,
            y0,
            x1,
            y1,
            ..
        } = *blob;
        BlobJson {
            no_marker: finder.unlike(blob).map(unlike),
            area,
            cx: x.to_f64(),
            cy: y.to_f64(),
            x0,
            y0,
            x1,
            y1,
        }
    }
}

/// Why a blob is no marker, and the remedy if it should be one.
fn unlike(why: Unlike) -> String {
    match why {
        Unlike::Small(least) => format!("fewer than {least} pixels, or another --preset"),
        Unlike::Large(most) => format!("more than {most} pixels, or another --preset"),
        Unlike::Cut => "cut by the picture's border".to_owned(),
        Unlike::Uneven => "not filled as an ellipse is: cut, holed, or two things".to_owned(),
    }
}

/// By which rule of the markers there is no force.
fn rule(status: Status, is_square: bool) -> Option<String> {
    let turn_deg = LARGEST_TURN.atan().to_degrees();
    let ((least, most), strain) = (SCALE, 100.0 * LARGEST_STRAIN);
    Some(match status {
        _ if status.contains(Status::MARKERS_MISSING) => {
            "fewer blobs can be markers than the film has dots".to_owned()
        }
        _ if status.contains(Status::MARKERS_AMBIGUOUS) && is_square => format!(
            "no four blobs, or more than one four, lie as dots do: a square around the picture's \
             middle,\n            turned by at most {turn_deg:.0}°, strained by {strain:.1} %, \
             {least} to {most} times as large as --preset has it at rest"
        ),
        _ if status.contains(Status::MARKERS_AMBIGUOUS) => {
            "the blobs do not lie as the dots of the model's film do".to_owned()
        }
        _ if status.contains(Status::MARKERS_IMPLAUSIBLE) => {
            "they lie as dots do, but their sizes or shapes do not fit each other: one may be cut, \
             stained, in glare, or no dot"
                .to_owned()
        }
        _ => return None,
    })
}

impl<'a> Finding<'a> {
    /// Of the picture `image`, by a model of a film with `dots` dots.
    pub fn new(
        image: &'a str,
        settings: &Settings,
        blobs: &[Blob],
        measurement: Measurement,
        brightness: u8,
        dots: usize,
    ) -> Finding<'a> {
        let markers = measurement.markers.as_deref().map(|markers| {
            let mut all = MarkerJson::all(markers);
            all.retain(|marker| !measurement.lost.contains(marker.id));
            all
        });
        let finder = Finder::new(settings);
        // The paper's features are those of four markers.
        let features = measurement
            .features
            .filter(|features| features.centroids.len() == CORNERS.len())
            .map(|features| features.to_array().map(|number| number.to_f64()).to_vec());
        let Measurement {
            status, contacts, ..
        } = &measurement;
        let each = force::contacts(*status, measurement.force.as_ref(), contacts);
        Finding {
            image,
            width: settings.geometry.width,
            height: settings.geometry.height,
            blobs: blobs
                .iter()
                .map(|blob| BlobJson::new(blob, &finder))
                .collect(),
            markers,
            features,
            force: measurement.force.map(ForceJson),
            contacts: each.iter().copied().map(ForceJson).collect(),
            contact: measurement
                .force
                .map(|_| measurement.status.contains(Status::CONTACT)),
            status: measurement.status.names().collect(),
            focal_px: settings.geometry.focal.to_f64(),
            overflow: measurement.status.contains(Status::BLOB_OVERFLOW),
            brightness: (measurement.status.contains(Status::IMAGE_DARK)).then_some(brightness),
            rule: rule(measurement.status, dots == CORNERS.len()),
        }
    }

    /// One JSON object without a line end.
    pub fn json(&self) -> String {
        to_json(self)
    }

    /// Lines for a person, without the last line end.
    pub fn text(&self) -> String {
        let Finding {
            image,
            width,
            height,
            focal_px,
            ..
        } = self;
        let mut lines = vec![format!(
            "{image}: {width} × {height} px, taken with a focal length of {focal_px:.2} px"
        )];
        lines.extend(self.blob_lines());
        lines.extend(self.marker_lines());
        lines.extend(self.feature_line());
        if let Some(ForceJson(force)) = &self.force {
            let [name, at] = match self.is_of_two() {
                true => ["sum of 2", "middle"],
                false => ["force", "place"],
            };
            lines.push(force_line(name, force));
            lines.push(place_line(at, force));
            lines.extend(self.parts_lines());
            lines.push(format!("  contact   {}", contact_text(self.contact)));
        }
        lines.push(format!(
            "  status    {}",
            status_text(&self.status, self.force.is_some())
        ));
        lines.extend(self.brightness_line());
        lines.extend(self.rule.iter().map(|rule| format!("            {rule}")));
        lines.join("\n")
    }

    /// Why nothing passes the threshold: the status alone calls each such picture dark.
    fn brightness_line(&self) -> Option<String> {
        let brightness = self.brightness?;
        let why = match brightness {
            ..DARK => "the picture is dark: cap off, light on",
            WHITE.. => "the picture is white: less light, and no glare",
            _ => {
                "the picture is not dark, but no pixel has the markers' colours: look at the \
                 light's colour, and at --threshold"
            }
        };
        Some(format!(
            "            {why} (median brightness {brightness} of 255)"
        ))
    }

    fn blob_lines(&self) -> Vec<String> {
        let more = if self.overflow {
            ", and more than can be kept"
        } else {
            ""
        };
        let mut lines = vec![format!("  blobs     {}{more}", self.blobs.len())];
        if !self.blobs.is_empty() {
            lines.push(format!("{:>10}{:>22}  box", "area", "centroid"));
        }
        lines.extend(self.blobs.iter().map(|blob| {
            let BlobJson {
                area,
                cx,
                cy,
                x0,
                y0,
                x1,
                y1,
                no_marker,
            } = blob;
            let why = no_marker.as_ref();
            let why = why.map_or(String::new(), |why| format!("; no marker: {why}"));
            format!(
                "{area:>10}{:>22}  x {x0}–{x1}, y {y0}–{y1}{why}",
                format!("({cx:.3}, {cy:.3})")
            )
        }));
        lines
    }

    fn marker_lines(&self) -> Vec<String> {
        let Some(markers) = &self.markers else {
            return vec!["  markers   none".to_owned()];
        };
        let is_square = markers.len() == CORNERS.len();
        let lines = markers.iter().map(|marker| {
            let MarkerJson { id, x, y, area } = marker;
            let corner = CORNERS.get(*id).filter(|_| is_square);
            let corner = corner.map_or(String::new(), |corner| format!("{corner:<12} "));
            format!("  marker {id}  {corner}({x:.3}, {y:.3}), area {area}")
        });
        lines.collect()
    }

    fn feature_line(&self) -> Option<String> {
        let numbers: Vec<_> = self
            .features
            .as_ref()?
            .iter()
            .map(|number| format!("{number:.3}"))
            .collect();
        Some(format!("  features  {}", numbers.join(" ")))
    }

    /// Whether two contacts press.
    fn is_of_two(&self) -> bool {
        self.status.contains(&"two_contacts")
    }

    /// The lines of each of two contacts.
    fn parts_lines(&self) -> Vec<String> {
        if !self.is_of_two() {
            return Vec::new();
        }
        if self.contacts.is_empty() {
            let why = "each is not known: they are near, or two others fit as well";
            return vec![format!("            {why}")];
        }
        let parts = (1..).zip(&self.contacts);
        let lines = parts.flat_map(|(number, ForceJson(force))| {
            let name = format!("contact {number}");
            [force_line(&name, force), place_line("place", force)]
        });
        lines.collect()
    }
}

fn force_line(name: &str, force: &Force) -> String {
    let [alpha, beta, size, x, y, z, angle_sigma, size_sigma] = FORCE.map(|it| it.shown(force));
    format!(
        "  {name:<10}α {alpha}°, β {beta}°, |F| {size} mN, F ({x}, {y}, {z}) mN; \
         ± {angle_sigma}°, ± {size_sigma} mN"
    )
}

/// The line for a force's place; a dash if the model gives no place.
fn place_line(name: &str, force: &Force) -> String {
    match &force.place {
        Some(place) => {
            let [x, y, sigma] = PLACE.map(|field| field.shown(place));
            format!("  {name:<10}({x}, {y}) mm; ± {sigma} mm")
        }
        None => format!("  {name:<10}–"),
    }
}
