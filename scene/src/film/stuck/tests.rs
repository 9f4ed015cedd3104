//! The splines against a film whose answer is known, and the committed solutions.

use super::*;
use crate::MARKERS;
use proptest::prelude::*;

/// A made-up film with the symmetry of a square, of third order in the offset (mm).
fn made_up(size: f64, [tx, ty]: [f64; 2], [ox, oy]: [f64; 2]) -> Answer {
    let along = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let (t, o) = ([tx, ty], [ox, oy]);
    let steep = along(t, t);
    let discs = MARKERS.map(|marker| {
        let p = marker.centre_mm;
        let side = |k: usize| {
            let own = 0.1 * p[k] + t[k] + 3.0 * t[k] * t[k] * t[k];
            own + 0.2 * o[k] * along(p, t) + 0.3 * o[k] * along(o, p)
        };
        let linear = along(p, t) + along(p, o) * steep - p[0] * p[1] * tx * ty;
        let z =
            linear + along(o, o) * (1.0 + along(p, o)) + o[0] * o[1] * (p[0] * o[1] + p[1] * o[0]);
        let slope = |k: usize, c: usize| size * (0.05 * p[k] * t[c] + p[c] * t[k]);
        DiscMotion {
            moved_mm: [size * side(0), size * side(1), size * z],
            along_x: [slope(0, 0), slope(0, 1), size * (p[0] + tx)],
            along_y: [slope(1, 0), slope(1, 1), size * (p[1] + ty)],
        }
    });
    let tip = |k: usize| size * (t[k] + o[k] * along(t, o));
    Answer {
        tip: [tip(0), tip(1), -size * (1.0 + steep + along(t, o))],
        discs,
    }
}

fn numbers(answer: &Answer) -> [f64; 15] {
    let moved_mm = answer.discs.map(|disc| disc.moved_mm);
    let tip = answer.tip;
    Shift { tip, moved_mm }.numbers()
}

/// Sums of numbers, each times a factor.
fn combined(terms: &[(f64, Numbers)]) -> Shift {
    let sum = |k: usize| terms.iter().map(|(by, numbers)| by * numbers[k]).sum();
    Shift::from_numbers(std::array::from_fn(sum))
}

/// The made-up film whose squares and cubes of the offset are what a [`Bend`] has for them.
fn as_told(size: f64, tangents: [f64; 2], offset_mm: [f64; 2]) -> Numbers {
    let at = |x: f64, y: f64| {
        let offset = [x, y].map(|part| MAX_OFFSET_MM * part);
        numbers(&made_up(size, tangents, offset))
    };
    let [xx, _, yy, xxx, _, _, yyy] = bend(at).map(|shift| shift.numbers());
    let [x, y] = offset_mm.map(|part| part / MAX_OFFSET_MM);
    let terms = [
        (1.0, at(x, y)),
        (even(x) - x * x, xx),
        (even(y) - y * y, yy),
        (odd(x) - x * x * x, xxx),
        (odd(y) - y * y * y, yyy),
    ];
    combined(&terms).numbers()
}

/// The coefficients of second and third order of a polynomial of third order, by its values on a square.
fn bend(at: impl Fn(f64, f64) -> Numbers) -> Bend {
    let (r, l, u, d) = (at(1.0, 0.0), at(-1.0, 0.0), at(0.0, 1.0), at(0.0, -1.0));
    let (ru, ld, lu, rd) = (at(1.0, 1.0), at(-1.0, -1.0), at(-1.0, 1.0), at(1.0, -1.0));
    let (o, rr, ll) = (at(0.0, 0.0), at(2.0, 0.0), at(-2.0, 0.0));
    let (uu, dd) = (at(0.0, 2.0), at(0.0, -2.0));
    [
        combined(&[(0.5, r), (0.5, l), (-1.0, o)]),
        combined(&[(0.25, ru), (0.25, ld), (-0.25, lu), (-0.25, rd)]),
        combined(&[(0.5, u), (0.5, d), (-1.0, o)]),
        combined(&[
            (1.0 / 12.0, rr),
            (-1.0 / 12.0, ll),
            (-1.0 / 6.0, r),
            (1.0 / 6.0, l),
        ]),
        // Half the second difference along x, and of that the difference along y.
        combined(&[
            (0.25, ru),
            (0.25, lu),
            (-0.5, u),
            (-0.25, rd),
            (-0.25, ld),
            (0.5, d),
        ]),
        combined(&[
            (0.25, ru),
            (0.25, rd),
            (-0.5, r),
            (-0.25, lu),
            (-0.25, ld),
            (0.5, l),
        ]),
        combined(&[
            (1.0 / 12.0, uu),
            (-1.0 / 12.0, dd),
            (-1.0 / 6.0, u),
            (1.0 / 6.0, d),
        ]),
    ]
}

fn made_up_solutions() -> Solved {
    let mut solved = Solved::default();
    for size in [0.1, 0.3, 0.5, 0.7, 0.9, 1.0] {
        for steepness in [0.1, 0.3, 0.5, 0.7, 0.9, 1.0] {
            for turn_deg in [0.0, 11.25, 22.5, 33.75, 45.0] {
                let way = Way {
                    size,
                    steepness,
                    turn_deg,
                };
                let (sin, cos) = libm::sincos(turn_deg.to_radians());
                let tangents = [cos, sin].map(|part| tangent(size, steepness) * part);
                let at = |x: f64, y: f64| {
                    let offset = [x, y].map(|part| MAX_OFFSET_MM * part);
                    numbers(&made_up(size, tangents, offset))
                };
                let state = State {
                    answer: made_up(size, tangents, [0.0; 2]),
                    by_offset: [[1e-4, 0.0], [0.0, 1e-4]]
                        .map(|[x, y]| combined(&[(2e4, at(x, y)), (-2e4, at(-x, -y))])),
                };
                solved.states.push((way, state));
                solved.bends.push((way, bend(at)));
            }
        }
    }
    solved
}

#[test]
fn every_octant_and_offset_comes_from_one_octants_solutions() {
    let stuck = Stuck::new(&made_up_solutions()).unwrap();
    for size in [0.3, 0.62, 0.95] {
        for k in 0..48 {
            let (sin, cos) = libm::sincos(f64::from(k) * 0.1309 + 0.02);
            let tangents = [0.19 * cos, 0.19 * sin];
            let offset = [0.2 * sin, -0.24 * cos];
            let (found, expected) = (
                stuck.at(size, tangents, offset),
                made_up(size, tangents, offset),
            );
            let pairs = numbers(&found)
                .into_iter()
                .zip(as_told(size, tangents, offset));
            for (a, b) in pairs {
                assert!((a - b).abs() < 1e-3, "{size} {tangents:?}: {a} {b}");
            }
            for (found, expected) in found.discs.iter().zip(&expected.discs) {
                let slopes = |disc: &DiscMotion| [disc.along_x, disc.along_y].concat();
                let pairs = slopes(found).into_iter().zip(slopes(expected));
                for (a, b) in pairs {
                    assert!((a - b).abs() < 2e-3, "{size} {tangents:?}: {a} {b}");
                }
            }
            let tip = stuck.placed(size, tangents, offset).tip();
            assert_eq!(tip, found.tip);
        }
    }
}

#[test]
fn what_is_no_grid_is_refused() {
    let mut solved = made_up_solutions();
    solved.states.remove(17);
    let error = Stuck::new(&solved).unwrap_err().to_string();
    assert!(error.contains("179 solutions are no grid"), "{error}");
    assert!(Stuck::new(&Solved::default()).is_err());
}

#[test]
fn ways_are_tangents_and_back() {
    for size in [1e-6, 0.1, 1.0] {
        for way in [1e-12, 0.05, 0.3] {
            let back = tangent(size, steepness(size, way));
            assert!((back - way).abs() < 1e-12, "{size} {way}");
        }
        assert!((steepness(size, STEEPEST) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn solutions_are_read_as_written() {
    let text = made_up_solutions().to_string();
    let solved: Solved = format!("# a note\n\n{text}").parse().unwrap();
    assert_eq!(solved.states.len(), 180);
    assert_eq!(solved.to_string(), text);
    let error = "# a note\nstate,0.1,0.2,0,1\n"
        .parse::<Solved>()
        .unwrap_err();
    assert!(error.to_string().contains("line 2"), "{error}");
    let line = text.lines().next().unwrap();
    for bad in [
        format!("{line},0"),
        format!("{line}.5"),
        line.replace("state", "stat"),
    ] {
        assert!(bad.parse::<Solved>().is_err(), "{bad}");
    }
}

proptest! {
    /// The committed solutions: no jump where octants meet, nor where the way turns over.
    #[test]
    fn octants_meet(size_n in 1e-5..0.3, part in -1.0..1.0, x in -0.25..0.25, y in -0.25..0.25) {
        const NEXT: f64 = 1e-9;
        let stuck = crate::film::CLAMPED.stick.as_ref().unwrap();
        let size = libm::cbrt(size_n / crate::film::MAX_STUCK_N);
        let way = part * MAX_TANGENT;
        let borders = [([way, 0.0], [0.0, 1.0]), ([0.0, way], [1.0, 0.0]), ([way, way], [0.5, -0.5])];
        for (border, across) in borders {
            let beside = |by: f64| [0, 1].map(|c| border[c] + by * across[c]);
            let [a, b] = [NEXT, -NEXT].map(|by| numbers(&stuck.at(size, beside(by), [x, y])));
            for (a, b) in a.iter().zip(b) {
                prop_assert!((a - b).abs() < 2e-4, "{} {} at {:?}", a, b, border);
            }
        }
    }
}
