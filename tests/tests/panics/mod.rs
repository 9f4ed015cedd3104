//! Tests which functions of the firmware could panic, from the very ELF that is flashed. Sensing
//! and capture must have none; the rest must be in this list, with reasons.

mod branches;

use std::fs;

use branches::{Branch, branches};
use hivtac_tests::artifact;

/// Parts of the mangled names of panicking functions.
const PANICS: [&str; 9] = [
    "9panicking",
    "unwrap_failed",
    "expect_failed",
    "panic_already",
    "index_fail",
    "slice_error_fail",
    "len_mismatch",
    "defmt_panic",
    "defmt_default_panic",
];

/// Code in which there shall be none.
const NEVER: [&str; 8] = [
    "hivtac_terms",
    "hivtac_sensor",
    "hivtac_portable7capture",
    "hivtac_portable6device",
    "hivtac_wire",
    "9band_copy",
    "8band_dma",
    // A difference of times: the clock may go back for an instant (`firmware/src/stats.rs`).
    "7Instant7elapsed",
];

/// Functions that may panic: a part of their mangled names, the most sites, and why none is
/// reached. The first that fits counts.
const REASONS: [(&str, usize, &str); 19] = [
    (
        "embassy_usb_synopsys_otg",
        40,
        "the driver's assertions about its own endpoints: requests about others are stalled \
         before (`usb_guard`), and the interrupt has one bit for each endpoint that there is; a \
         stage of a control transfer is not polled after its end",
    ),
    (
        "embassy_usb",
        68,
        "descriptors are written at the start, into buffers that hold them; answers fit the \
         control buffer of 64 bytes; a USB task ends never, so that no future of it is polled \
         after its end",
    ),
    (
        "embassy_futures",
        52,
        "the USB task: its five parts never end, and of what they wait for nothing is polled \
         after its end",
    ),
    (
        "hivtac_firmware5board",
        4,
        "at the start only: pins that are constants, and what is taken once",
    ),
    (
        "hivtac_firmware6camera",
        5,
        "the camera's set-up and what it is set to: what has ended is not polled again; its bus's \
         pins are constants",
    ),
    (
        "hivtac_firmware12capture_task",
        12,
        "set-up of the camera: what has ended is not polled again",
    ),
    (
        "hivtac_firmware13pipeline_task",
        1,
        "a queue's cell, in a critical section and so never borrowed twice",
    ),
    (
        "hivtac_firmware..flash",
        6,
        "an operation of the flash is waited for once: what has ended is not polled again",
    ),
    (
        "hivtac_firmware6memory",
        8,
        "the same of what is saved: writing and reading back, one after the other",
    ),
    (
        "hivtac_firmware",
        12,
        "at the start only: tasks are spawned once, and the settings are constants that the \
         model's proof fits; what serves USB, which is not polled after its end; queues' cells, in \
         a critical section and so never borrowed twice",
    ),
    (
        "embassy_executor",
        33,
        "the same of the capture, USB, UART and memory tasks, compiled into their executor; the \
         UART's driver has its DMA; executors start once",
    ),
    (
        "embassy_sync",
        15,
        "cells of queues and signals, in a critical section and so never borrowed twice",
    ),
    (
        "embassy_stm32",
        99,
        "clocks, pins, rates and timings that are constants, at the start; the UART's DMA, whose \
         addresses are constants within its reach, and whose lengths are those of frames; the \
         time driver's cells, in a critical section and so never borrowed twice",
    ),
    (
        "embassy_time",
        13,
        "sums of times that 64 bits of microseconds hold for 500,000 years",
    ),
    (
        "poll_fn..PollFn",
        5,
        "the USB driver's waits for an endpoint, by the number of an endpoint that there is; a \
         stage of a control transfer is not polled after its end",
    ),
    ("static_cell", 2, "at the start only: each is taken once"),
    (
        "defmt",
        2,
        "the log takes itself once: in a critical section",
    ),
    (
        "cobs",
        2,
        "indices that its own loop keeps below the length; random frames are tested",
    ),
    (
        "postcard",
        1,
        "the checksum's place in a buffer that holds the longest frame; every message is tested",
    ),
];

fn panics(names: &[String]) -> bool {
    let panics = |name: &String| PANICS.iter().any(|part| name.contains(part));
    names.iter().any(panics)
}

/// Returns the calls of panicking functions, except those within them and the linker's bridges to
/// them.
fn sites() -> Vec<Branch> {
    let bytes = fs::read(artifact::named_by("HIVTAC_ELF")).unwrap();
    let branches = branches(&bytes).unwrap();
    assert!(branches.len() > 1_000, "the ELF has its symbols");
    let outside = |branch: &Branch| {
        let from = std::slice::from_ref(&branch.from);
        panics(&branch.to) && !panics(from) && !branch.from.contains("Thunk")
    };
    branches.into_iter().filter(outside).collect()
}

#[test]
fn nothing_of_the_sensing_and_the_capture_can_panic() {
    for Branch { address, from, to } in sites() {
        let never = NEVER.iter().any(|part| from.contains(part));
        assert!(!never, "{address:#x} in {from} calls {to:?}");
    }
}

#[test]
fn whatever_else_could_panic_has_its_reason() {
    let mut counts = [0; REASONS.len()];
    for Branch { address, from, to } in sites() {
        let known = REASONS.iter().position(|(part, ..)| from.contains(part));
        let known = known.unwrap_or_else(|| panic!("{address:#x} in {from} calls {to:?}: why?"));
        counts[known] += 1;
    }
    println!("{} sites", counts.iter().sum::<usize>());
    for (count, (part, most, reason)) in counts.into_iter().zip(REASONS) {
        println!("{count:>4} {part}: {reason}");
        assert!(
            count <= most,
            "{part}: {count} sites, of which {most} are known"
        );
        assert!(count > 0, "{part} has none any more: take it off the list");
    }
}
