//! Hard cases that the camera causes on a good film.

use super::{Expected, HardCase};
use crate::{
    Camera, Catch, Lens, MARKERS, Motion, Mounting, Options, Paint, Salt, Scene, Shutter, Vibration,
};

/// A knock to the camera that moves the upper markers out of the frame at its upper edge.
pub(super) fn leaving() -> Vec<HardCase> {
    let case = |(name, what, part): (&str, &str, f64)| {
        HardCase::new(name, what, Expected::Either, move |nominal| Options {
            mounting: lifted(nominal, part),
            ..Options::default()
        })
    };
    let cases = [
        ("leaving-touching", "a marker touches the border", 0.0),
        ("leaving-tenth", "a marker is a tenth outside", 0.1),
        ("leaving-half", "a marker is half outside", 0.5),
    ];
    let mut cases: Vec<HardCase> = cases.into_iter().map(case).collect();
    let gone = "two markers are outside";
    cases.push(HardCase::new(
        "leaving-gone",
        gone,
        Expected::Rejected,
        |nominal| Options {
            mounting: shifted(0.0, -gone_px(nominal.camera())),
            ..Options::default()
        },
    ));
    let knocked = "a camera turned by 12° and shifted by half a marker's width";
    cases.push(HardCase::new(
        "knocked",
        knocked,
        Expected::Either,
        |nominal| {
            let shift = 0.02 * f64::from(nominal.camera().width());
            Options {
                mounting: Mounting {
                    roll_deg: 12.0,
                    ..shifted(shift, -shift)
                },
                ..Options::default()
            }
        },
    ));
    cases
}

fn shifted(x: f64, y: f64) -> Mounting {
    Mounting {
        shift_px: [x, y],
        roll_deg: 0.0,
    }
}

/// Returns a shift upwards that moves this part of marker 0's height out of the frame under the
/// scene's load.
fn lifted(nominal: &Scene, part: f64) -> Mounting {
    let Some(marker) = nominal.truth(0.0).markers[0] else {
        return Mounting::default();
    };
    let radius = (marker.area_px2 / std::f64::consts::PI).sqrt();
    let top = marker.centroid_px[1] + 0.5 - radius;
    shifted(0.0, -(top + part * 2.0 * radius))
}

/// Returns a shift that moves marker 0 at rest out of the frame; a press moves it further.
fn gone_px(camera: &Camera) -> f64 {
    let [x, y] = MARKERS[0].centre_mm;
    let lower_edge = y + 1.2 * MARKERS[0].radius_mm;
    camera.project([x, lower_edge, 0.0])[1] + 0.5
}

/// Noise of the sensor.
pub(super) fn noise() -> Vec<HardCase> {
    let salt = |(name, what, fraction, paint): (&str, &str, f64, Paint)| {
        HardCase::new(name, what, Expected::Either, move |_| Options {
            salt: Salt { fraction, paint },
            ..Options::default()
        })
    };
    let salts = [
        (
            "salt-1-percent",
            "1 % of all pixels show the markers' red",
            0.01,
            Paint::Red,
        ),
        (
            "salt-5-percent",
            "5 % of all pixels show the markers' red",
            0.05,
            Paint::Red,
        ),
        (
            "salt-5-percent-white",
            "5 % of all pixels are white",
            0.05,
            Paint::Glare,
        ),
    ];
    let mut cases: Vec<HardCase> = salts.into_iter().map(salt).collect();
    let fourfold = HardCase::new("noise-4x", "four times the noise", Expected::Found, |_| {
        let usual = Options::default();
        Options {
            noise: 4.0 * usual.noise,
            ..usual
        }
    });
    cases.push(HardCase {
        noisy: true,
        ..fourfold
    });
    cases
}

/// Pictures out of focus. Blur is in pixels of QVGA, and grows with the frame.
pub(super) fn unsharp() -> Vec<HardCase> {
    let blurred = |(qvga_px, expected): (f64, _)| {
        let name = format!("blur-{qvga_px}");
        HardCase::new(name, "a lens out of focus", expected, move |nominal| {
            Options {
                lens: Lens {
                    blur_px: qvga_px * f64::from(nominal.camera().width()) / 320.0,
                    ..Lens::default()
                },
                ..Options::default()
            }
        })
    };
    let blurs = [
        (1.0, Expected::Found),
        (2.0, Expected::Either),
        (4.0, Expected::Either),
    ];
    let mut cases: Vec<HardCase> = blurs.into_iter().map(blurred).collect();
    let what = "a lens of F/2.8 focused 8 mm away: sharper the nearer the film comes, then less";
    cases.push(HardCase::new(
        "focus-at-8-mm",
        what,
        Expected::Either,
        |_| Options {
            lens: Lens {
                aperture_mm: 0.75,
                focus_mm: 8.0,
                ..Lens::default()
            },
            ..Options::default()
        },
    ));
    cases
}

/// Motion under a rolling shutter that takes 1/60 s for a frame.
pub(super) fn moving() -> Vec<HardCase> {
    let case = |name: &str, what: &str, exposure_s, motion| {
        let still = HardCase::new(name, what, Expected::Either, move |_| Options {
            shutter: Shutter {
                exposure_s,
                readout_s: 1.0 / 60.0,
            },
            ..Options::default()
        });
        HardCase { motion, ..still }
    };
    let shaken = Vibration::default();
    vec![
        case(
            "rolling-shutter",
            "a vibration of 20 Hz",
            0.0,
            Motion::Vibration(shaken),
        ),
        case(
            "motion-blur",
            "a vibration of 20 Hz, exposed for 10 ms",
            0.01,
            Motion::Vibration(shaken),
        ),
        case(
            "caught",
            "an object is caught, exposed for 5 ms",
            0.005,
            Motion::Catch(Catch::default()),
        ),
    ]
}

/// Pictures compressed by JPEG.
pub(super) fn compressed() -> Vec<HardCase> {
    let case = |(quality, expected): (u8, _)| {
        let name = format!("jpeg-{quality}");
        let what = format!("JPEG of quality {quality}");
        HardCase::new(name, what, expected, move |_| Options {
            format: crate::Format::Jpeg { quality },
            ..Options::default()
        })
    };
    let qualities = [
        (90, Expected::Found),
        (70, Expected::Either),
        (30, Expected::Either),
    ];
    qualities.into_iter().map(case).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Dots, Load, Preset};

    #[test]
    fn markers_leave_the_frame_as_far_as_said() {
        for preset in [Preset::Ov7725, Preset::Paper] {
            let visible = |name: &str| {
                let cases = leaving();
                let case = cases.iter().find(|case| case.name == name).unwrap();
                let scene = case.scene(preset, 320, 240, 1).unwrap();
                let rest = scene.render_load(&Load::REST, 0).unwrap();
                let seen = |markers: Dots<Option<crate::MarkerTruth>>| {
                    markers[0].map_or(0.0, |marker| marker.visible)
                };
                [seen(rest.truth.markers), seen(scene.truth(0.0).markers)]
            };
            assert_eq!(visible("leaving-half")[0], 1.0);
            assert!((visible("leaving-half")[1] - 0.5).abs() < 0.03);
            assert!((0.85..1.0).contains(&visible("leaving-tenth")[1]));
            assert_eq!(visible("leaving-gone"), [0.0, 0.0]);
        }
    }
}
