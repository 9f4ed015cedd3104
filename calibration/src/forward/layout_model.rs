//! The model file of a layout of dots on the nominal film: a forward model without a network.

use anyhow::{Context, Result, anyhow, bail, ensure};
use hivtac_sensor::force::forward::{Markers, Noise};
use hivtac_sensor::force::model::encode::ModelSpec;
use hivtac_sensor::force::model::{
    CalibratedRange, Conditions, ForwardSpec, InputScaling, Model, Origin, OutputKind, Uncertainty,
    UncertaintyKnot,
};
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::markers::lost::Lost;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::Sensor;
use hivtac_sensor::tare::TareBuilder;
use hivtac_terms::conditions::{CentroidEstimator, ContactReading};
use hivtac_terms::geometry::Geometry;
use hivtac_terms::marker::{Marker, MarkerList};
use hivtac_terms::threshold::{ByteOrder, PixelFormat, Threshold};
use hivtac_terms::units::{MicroNewtons, Micrometres, MilliDegrees, Px};
use hivtac_twin::film::{Film, Layout};
use hivtac_twin::{Load, MarkerTruth, Options, Preset, Scene};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::noise::{Line, MEAN_SIZE};
use super::{FilmModel, of_layout};
use crate::data::conditions;
use crate::data::range::Range;
use crate::data::rest;
use crate::weights::{Training, Weights};

/// Columns and rows of a frame.
const SIZE: [u16; 2] = [320, 240];
/// Frames of the untouched film that show its rest position.
const REST_FRAMES: u16 = 64;
/// Presses that show how exactly dots are seen.
const PRESSES: u64 = 300;
/// The seed of noise and presses.
const SEED: u64 = 11;
/// Standard uncertainty of a coordinate before it is measured, px.
pub(super) const UNMEASURED_PX: f64 = 0.011;
/// Width that the mask adds to a dot's diameters, px.
const EDGE_PX: f64 = 2.8;
/// The calibrated range.
const LARGEST_FORCE: MicroNewtons = MicroNewtons(250_000);
const LARGEST_ANGLE: MilliDegrees = MilliDegrees(12_000);

/// The model of a layout on the nominal film, for presses anywhere on the film's tables, seen by
/// the camera `ov7725` at 320 × 240 in RGB565.
///
/// # Errors
/// If the motion does not fit into tables, or the dots are not seen in frames of the untouched
/// film.
pub fn layout_model(layout: Layout, steps: u8) -> Result<ModelSpec> {
    let last_mm = Film::default().with_layout(layout)?.most_place_mm();
    let scene = layout_scene(layout)?;
    let camera = scene.camera();
    let (forward, _) = of_layout(layout, steps, UNMEASURED_PX, camera)?;
    let conditions = conditions();
    let spec = ModelSpec {
        conditions,
        rest: Rest::of_markers(&expected(&scene)?),
        input: InputScaling::default(),
        layers: Vec::new(),
        forward: Some(ForwardSpec {
            per_px: Some([1.0 / camera.focal_px() as f32, 0.0]),
            ..forward
        }),
        output: OutputKind::ForceAndPlace,
        range: CalibratedRange {
            magnitude: LARGEST_FORCE,
            alpha: LARGEST_ANGLE,
            beta: LARGEST_ANGLE,
            place: Micrometres((last_mm * 1e3) as u32),
        },
        uncertainty: Uncertainty {
            step_bits: 0,
            knots: [UncertaintyKnot::default(); 16],
        },
    };
    seen_at_rest(spec, &scene)
}

/// The weights file of a layout's model, with which `unit` begins. It has no network.
pub fn layout_weights(spec: &ModelSpec) -> Result<Weights> {
    let forward = spec.forward.as_ref().context("the model has no film")?;
    let double = |pair: [f32; 2]| pair.map(f64::from);
    let Conditions { geometry, .. } = spec.conditions;
    let conditions = conditions::Conditions {
        threshold: spec.conditions.threshold.limits(),
        dilations: spec.conditions.dilations,
        centroid: spec.conditions.centroid,
        markers: spec.rest.areas.len(),
        ..conditions::Conditions::simulated(
            spec.conditions.preset,
            geometry.width,
            geometry.height,
            PixelFormat::Rgb565,
        )
    };
    let CalibratedRange {
        magnitude,
        alpha,
        beta,
        place,
    } = spec.range;
    Ok(Weights {
        format: Weights::format(),
        conditions,
        rest: rest::Rest::of_sensor(&spec.rest),
        range: Range {
            force_n: f64::from(magnitude.0) * 1e-6,
            alpha_deg: f64::from(alpha.0) * 1e-3,
            beta_deg: f64::from(beta.0) * 1e-3,
            place_mm: f64::from(place.0) * 1e-3,
        },
        uncertainty: Default::default(),
        training: Training::default(),
        film: Some(FilmModel {
            steps: forward.steps,
            rest_px: forward.noise.rest_px.map(double),
            noise_px: double(forward.noise.at_rest_px),
            noise_at_four_areas: double(forward.noise.at_four_areas),
            beside_px: 0.0,
            others: None,
            own: None,
        }),
        network: None,
    })
}

/// The nominal sensor's scene with these dots.
///
/// # Errors
/// If the film does not take them.
pub fn layout_scene(layout: Layout) -> Result<Scene> {
    let [width, height] = SIZE.map(u32::from);
    let scene = Scene::preset("rest", Preset::Ov7725, width, height, SEED)?;
    let options = Options {
        layout,
        ..scene.options().clone()
    };
    Ok(scene.with_options(options)?)
}

fn conditions() -> Conditions {
    let [width, height] = SIZE;
    let preset = hivtac_terms::geometry::Preset::Ov7725;
    let geometry = Geometry::preset(preset, width, height);
    let settings = Settings::usual(geometry, ByteOrder::Native);
    Conditions {
        preset,
        geometry,
        threshold: Threshold::red(PixelFormat::Rgb565),
        dilations: settings.dilations,
        centroid: CentroidEstimator::RednessWeighted,
        contact: ContactReading::Force,
        origin: Origin::Simulated,
    }
}

/// Where the scene has its dots at rest.
fn expected(scene: &Scene) -> Result<MarkerList> {
    let truth = scene.truth_under(&Load::REST)?;
    let px = |part: f64| Px((part * 65_536.0).round() as i32);
    let marker = |seen: &MarkerTruth| {
        let width = 2.0 * (seen.area_px2 / std::f64::consts::PI).sqrt() + EDGE_PX;
        Marker {
            x: px(seen.centroid_px[0]),
            y: px(seen.centroid_px[1]),
            area: (std::f64::consts::FRAC_PI_4 * width * width) as u32,
        }
    };
    let markers: Option<Vec<Marker>> = (truth.markers.iter())
        .map(|seen| seen.as_ref().map(marker))
        .collect();
    Ok(MarkerList::of(
        markers.context("a dot is not in the picture")?,
    ))
}

/// A sensor with a model, without a tare.
///
/// # Errors
/// If the model's settings are out of range.
pub fn untared<'m>(model: &Model<'m>) -> Result<Box<Sensor<'m>>> {
    let mut sensor: Box<Sensor<'_>> = Box::default();
    let settings = model.conditions.settings(ByteOrder::Native);
    sensor.configure(settings, Some(*model))?;
    Ok(sensor)
}

/// The rest position that the sensor takes from frames of the scene's untouched film, numbered from
/// `first` on.
///
/// # Errors
/// If the frames are refused, or too few show all dots.
pub fn rest_of(sensor: &mut Sensor<'_>, scene: &Scene, first: u64) -> Result<Rest> {
    let mut tare = TareBuilder::new(REST_FRAMES).context("no frames")?;
    for number in 0..2 * u64::from(REST_FRAMES) {
        let frame = scene.render_load(&Load::REST, first + number)?;
        let seen = sensor.measure_frame(&frame.to_rgb565());
        if let Some(outcome) = sensor.tare_with(&mut tare, &seen) {
            return outcome.map_err(|refusal| anyhow!("no rest position: {refusal:?}"));
        }
    }
    bail!("no rest position: too few frames of the untouched film show all dots");
}

/// The same with the rest position that frames of the untouched film show.
fn seen_at_rest(spec: ModelSpec, scene: &Scene) -> Result<ModelSpec> {
    let encoded = spec.encode().map_err(|error| anyhow!("{error}"))?;
    let model = Model::parse(&encoded).map_err(|error| anyhow!("{error}"))?;
    let mut sensor = untared(&model)?;
    let rest = rest_of(&mut sensor, scene, 0)?;
    let off = rest.markers().into_iter().zip(spec.rest.markers());
    let off = off.map(|(seen, own)| [(seen.x - own.x).to_f32(), (seen.y - own.y).to_f32()]);
    let mut forward = spec.forward;
    if let Some(forward) = &mut forward {
        forward.noise = Noise {
            rest_px: Markers::of(off),
            ..noise(&mut sensor, &rest, scene, &forward.rest_image.grain())?
        };
    }
    Ok(ModelSpec {
        rest,
        forward,
        ..spec
    })
}

/// How exactly the dots are seen under presses: away from the axis and across, at rest and with
/// four times the area. Of each dot that is relative to its `grain`.
fn noise(sensor: &mut Sensor<'_>, rest: &Rest, scene: &Scene, grain: &Markers) -> Result<Noise> {
    let at_rest = scene.truth_under(&Load::REST)?;
    let middle =
        [scene.camera().width(), scene.camera().height()].map(|side| (f64::from(side) - 1.0) / 2.0);
    let (mut away, mut across) = (Line::default(), Line::default());
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    for number in 0..PRESSES {
        let mut within = |most: f64| random.random_range(-most..most);
        let angles = [8.0; 2].map(&mut within);
        let place_mm = [4.0; 2].map(&mut within);
        let force_n = 0.11 + within(0.09);
        let load = Load::from_angles(force_n, angles[0], angles[1])?;
        let load = load.with_offset_mm(place_mm)?;
        sensor.forget_frame();
        let frame = scene.render_load(&load, 10_000 + number)?;
        let seen = sensor.measure_frame(&frame.to_rgb565());
        let (truth, Some(markers), Lost::NONE) =
            (scene.truth_under(&load)?, seen.markers, seen.lost)
        else {
            continue;
        };
        let truths = truth.markers.iter().zip(at_rest.markers.iter());
        let seen = markers.iter().zip(grain.iter());
        for (((marker, grain), before), truths) in seen.zip(&rest.markers()).zip(truths) {
            let size = grain.map(|grain| MEAN_SIZE * f64::from(grain));
            let (Some(now), Some(then)) = truths else {
                continue;
            };
            let moved = [marker.x - before.x, marker.y - before.y].map(Px::to_f64);
            let off = [0, 1].map(|i| moved[i] - now.centroid_px[i] + then.centroid_px[i]);
            let at = [0, 1].map(|i| then.centroid_px[i] - middle[i]);
            let far = at[0].hypot(at[1]);
            let more = (f64::from(marker.area) / f64::from(before.area.max(1)) - 1.0) / 3.0;
            let along = (off[0] * at[0] + off[1] * at[1]) / far;
            let beside = (off[1] * at[0] - off[0] * at[1]) / far;
            away.add(more, along.abs() / size[0]);
            across.add(more, beside.abs() / size[1]);
        }
    }
    let [(away, away_grows), (across, across_grows)] = [away.through(), across.through()];
    ensure!(away > 0.0 && across > 0.0, "the dots have no noise");
    let grows = [away_grows / away, across_grows / across];
    Ok(Noise {
        rest_px: Markers::default(),
        at_rest_px: [away as f32, across as f32],
        at_four_areas: grows.map(|grows| (1.0 + grows).clamp(0.1, 10.0) as f32),
    })
}
