//! Compares the threshold with OpenCV's own output for every pixel value (`opencv/reference.py`).

use hivtac_sensor::markers::tables::{ByteTable, Table};
use hivtac_terms::threshold::{ByteOrder, HsvBox};

/// A box and the pixels that OpenCV accepts: bit p % 8 of byte p / 8.
struct Reference {
    hsv_box: HsvBox,
    accepted: &'static [u8; 8192],
}

const fn hsv_box(hue: [u8; 2], saturation: [u8; 2], value: [u8; 2]) -> HsvBox {
    HsvBox {
        hue_low: hue[0],
        hue_high: hue[1],
        saturation_low: saturation[0],
        saturation_high: saturation[1],
        value_low: value[0],
        value_high: value[1],
    }
}

/// The same boxes as `BOXES` in the generator.
const REFERENCES: [Reference; 6] = [
    Reference {
        hsv_box: HsvBox::RED,
        accepted: include_bytes!("opencv/red.bits"),
    },
    Reference {
        hsv_box: hsv_box([35, 85], [60, 255], [40, 255]),
        accepted: include_bytes!("opencv/green.bits"),
    },
    Reference {
        hsv_box: hsv_box([175, 4], [150, 220], [90, 200]),
        accepted: include_bytes!("opencv/tight.bits"),
    },
    Reference {
        hsv_box: hsv_box([0, 179], [0, 255], [0, 255]),
        accepted: include_bytes!("opencv/full.bits"),
    },
    Reference {
        hsv_box: hsv_box([120, 120], [0, 255], [0, 255]),
        accepted: include_bytes!("opencv/single-hue.bits"),
    },
    Reference {
        hsv_box: hsv_box([0, 179], [0, 90], [0, 110]),
        accepted: include_bytes!("opencv/dark.bits"),
    },
];

fn assert_equals_opencv(table: &impl Table, reference: &Reference, order: ByteOrder) {
    for pixel in 0..=u16::MAX {
        let raw = match order {
            ByteOrder::Native => pixel,
            ByteOrder::Swapped => pixel.rotate_left(8),
        };
        let expected = reference.accepted[usize::from(pixel / 8)] >> (pixel % 8) & 1 == 1;
        assert_eq!(
            table.accepts(raw),
            expected,
            "{:?}, pixel {pixel:#06x}",
            reference.hsv_box
        );
    }
}

#[test]
fn every_pixel_value_of_six_boxes_equals_opencv() {
    for order in [ByteOrder::Native, ByteOrder::Swapped] {
        for reference in &REFERENCES {
            let table = ByteTable::new(&reference.hsv_box, order).unwrap();
            assert_equals_opencv(&table, reference, order);
        }
    }
}

#[test]
fn a_table_set_again_forgets_the_box_before() {
    let mut table = ByteTable::CLOSED;
    for reference in &REFERENCES {
        table.set(&reference.hsv_box, ByteOrder::Native).unwrap();
        assert_equals_opencv(&table, reference, ByteOrder::Native);
    }
}
