//! Pictures of the simulated sensor, for tests of the library and of the tool.

use hivtac_host::frame::Frame;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::threshold::{HsvBox, Mono, Threshold, Yuv422};
use hivtac_twin::{Format, Load, Options, Preset, Scene};
use hivtac_wire::message::{DeviceHello, ModelIdentity, ModelSource};

const RED: [u8; 6] = [170, 10, 100, 255, 45, 255];

/// A device that sends frames such as these.
pub fn device() -> DeviceHello {
    DeviceHello {
        protocol: 2,
        schema: 0,
        device_id: [0; 12],
        board: "board".try_into().unwrap(),
        firmware: "firmware".try_into().unwrap(),
        model: None,
        width: 320,
        height: 240,
        threshold: Threshold::Yuv422(Yuv422::RED),
        preset: "ov7725".try_into().unwrap(),
        dilations: 1,
        centroid: CentroidEstimator::RednessWeighted,
        name: Default::default(),
        filter: Default::default(),
    }
}

/// The same with a model for the eight dots of `8v`.
pub fn device_of_eight() -> DeviceHello {
    let device = device();
    let model = ModelIdentity {
        markers: 8,
        crc: 0,
        name: "model".try_into().unwrap(),
        simulated: true,
        threshold: device.threshold,
        source: ModelSource::Kept,
    };
    DeviceHello {
        model: Some(model),
        ..device
    }
}

/// The film at rest with some options changed.
pub fn frame(change: impl Fn(&mut Options)) -> Frame {
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 1).unwrap();
    let mut options = scene.options().clone();
    change(&mut options);
    let format = options.format;
    let scene = scene.with_options(options).unwrap();
    let rendered = scene.render_load(&Load::REST, 7).unwrap();
    let in_order = |pixel: u16| match format {
        Format::Rgb565 => pixel.to_be_bytes(),
        _ => pixel.to_le_bytes(),
    };
    Frame {
        number: 7,
        time_us: 0,
        width: 320,
        height: 240,
        threshold: match format {
            Format::Rgb565 => Threshold::Rgb565(HsvBox::of_limits(RED)),
            Format::Mono => Threshold::Mono(Mono::DARK),
            _ => Threshold::Yuv422(Yuv422::RED),
        },
        bytes: match format {
            Format::Mono => rendered.mono,
            _ => rendered.pixels.into_iter().flat_map(in_order).collect(),
        },
    }
}
