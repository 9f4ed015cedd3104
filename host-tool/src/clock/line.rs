//! The straight line below delays: how far this computer's clock is ahead of a device's.
//!
//! Delays only add, so the points (device time, arrival − device time) lie above a line whose slope
//! is the difference of the two clocks' rates. Of all lines with no point below, the one nearest to
//! the points on average is the edge of their lower convex hull at their middle.

use std::collections::VecDeque;

/// Largest difference between the rates of two quartz crystals, relative.
const DRIFT: f64 = 1e-4;
/// The same while the computer's clock is slewed, as it is when it is set by and by.
const SLEWED: f64 = 6e-4;
/// Time in which only the sample with the shortest delay is kept, µs.
const SLOT_US: u64 = 250_000;
/// Most slots: a minute. In a longer time warmth bends the line.
const SLOTS: usize = 240;
/// Least time for a slope, µs; in a shorter one clocks stay together.
const SLOPE_FROM_US: u64 = 2_000_000;
/// Least time for a slope that only a slewed clock has, µs.
const SLEWED_FROM_US: u64 = 10_000_000;

/// A sample: device time, µs, and how far its arrival is ahead of it, ns.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    pub device_us: u64,
    pub ahead_ns: i64,
}

impl Point {
    /// Time since an origin, s, and how much farther ahead than there, ns.
    fn from(self, origin: Point) -> [f64; 2] {
        let since_us = self.device_us as i64 - origin.device_us as i64;
        let farther_ns = self.ahead_ns - origin.ahead_ns;
        [since_us as f64 * 1e-6, farther_ns as f64]
    }
}

/// The soonest samples of the last minute, and the line below them.
#[derive(Clone, Debug, Default)]
pub struct Line {
    soonest: VecDeque<Point>,
    /// The line's point at the first of `soonest`, ns above it, and its slope, ns/s.
    height: f64,
    slope: f64,
}

impl Line {
    /// How far ahead the line is at a device time, ns; `None` before the first sample.
    pub fn at(&self, device_us: u64) -> Option<i64> {
        let origin = *self.soonest.front()?;
        let [since, _] = Point {
            device_us,
            ahead_ns: 0,
        }
        .from(origin);
        Some(origin.ahead_ns + (self.height + self.slope * since).floor() as i64)
    }

    /// Adds a sample, which is later than those before.
    pub fn add(&mut self, point: Point) {
        let slot = |point: &Point| point.device_us / SLOT_US;
        let newest = self.soonest.back().copied();
        match newest.filter(|newest| slot(newest) == slot(&point)) {
            Some(newest) if self.above(point) >= self.above(newest) => return,
            Some(_) => drop(self.soonest.pop_back()),
            None => (),
        }
        self.soonest.push_back(point);
        if self.soonest.len() > SLOTS {
            self.soonest.pop_front();
        }
        self.fit();
    }

    /// How far a sample is above the line, ns: how much later it came than the soonest.
    pub fn above(&self, point: Point) -> i64 {
        let line_ns = self.at(point.device_us).unwrap_or(point.ahead_ns);
        point.ahead_ns - line_ns
    }

    /// Moves all samples, and the line, by this many ns.
    pub fn shift(&mut self, by_ns: i64) {
        for point in &mut self.soonest {
            point.ahead_ns += by_ns;
        }
    }

    /// Forgets the samples before a device time, µs.
    pub fn forget_before(&mut self, device_us: u64) {
        self.soonest.retain(|point| point.device_us >= device_us);
        self.fit();
    }

    fn fit(&mut self) {
        let (Some(origin), Some(newest)) = (self.soonest.front(), self.soonest.back()) else {
            return;
        };
        let points: Vec<[f64; 2]> = self.soonest.iter().map(|it| it.from(*origin)).collect();
        let limit = match newest.device_us - origin.device_us {
            ..SLOPE_FROM_US => 0.0,
            SLOPE_FROM_US..SLEWED_FROM_US => DRIFT * 1e9,
            SLEWED_FROM_US.. => SLEWED * 1e9,
        };
        self.slope = middle_slope(&points).clamp(-limit, limit);
        let heights = points.iter().map(|[x, y]| y - self.slope * x);
        self.height = heights.fold(f64::INFINITY, f64::min);
    }
}

/// The slope of the lower convex hull's edge at the points' mean x. At least two points, x rising.
fn middle_slope(points: &[[f64; 2]]) -> f64 {
    let mean = points.iter().map(|[x, _]| x).sum::<f64>() / points.len() as f64;
    let mut hull: Vec<[f64; 2]> = Vec::with_capacity(points.len());
    for point in points {
        while let [.., a, b] = hull[..]
            && slope(a, b) >= slope(b, *point)
        {
            hull.pop();
        }
        hull.push(*point);
    }
    let at_mean = hull.windows(2).find(|edge| edge[1][0] >= mean);
    at_mean.map_or(0.0, |edge| slope(edge[0], edge[1]))
}

fn slope(a: [f64; 2], b: [f64; 2]) -> f64 {
    (b[1] - a[1]) / (b[0] - a[0])
}
