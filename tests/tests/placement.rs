//! Tests where the firmware's code and data lie, from the very ELF that is flashed: at the places
//! that `memory.x` promises.

use std::fs;
use std::ops::Range;

use hivtac_tests::artifact;
use object::{Object, ObjectSymbol, SymbolKind};

const ITCM: Range<u64> = 0..0x1_0000;
const STACK: Range<u64> = 0x2000_0000..0x2000_A000;
const DTCM: Range<u64> = 0x2000_A000..0x2002_0000;
const SRAM: Range<u64> = 0x3000_0000..0x3004_8000;
const AXI_SRAM: Range<u64> = 0x2400_0000..0x2405_0000;
const AXI_CACHED: Range<u64> = 0x2405_0000..0x2408_0000;

struct Symbol {
    name: String,
    address: u64,
    size: u64,
    is_code: bool,
}

impl Symbol {
    fn lies_in(&self, memory: &Range<u64>) -> bool {
        memory.contains(&self.address) && self.address + self.size <= memory.end
    }
}

/// Returns the firmware's functions and variables, under their mangled names.
fn symbols() -> Vec<Symbol> {
    let bytes = fs::read(artifact::named_by("HIVTAC_ELF")).unwrap();
    let file = object::File::parse(&*bytes).unwrap();
    let symbols = file.symbols().filter(|symbol| symbol.size() > 0);
    symbols
        .map(|symbol| Symbol {
            name: symbol.name().unwrap().to_owned(),
            // Bit 0 of a function's address marks Thumb code.
            address: symbol.address() & !1,
            size: symbol.size(),
            is_code: symbol.kind() == SymbolKind::Text,
        })
        .collect()
}

/// Returns the variables whose names contain all of these words.
fn variables<'a>(symbols: &'a [Symbol], words: &[&str]) -> Vec<&'a Symbol> {
    let named = |symbol: &&Symbol| words.iter().all(|word| symbol.name.contains(word));
    let found: Vec<_> = symbols
        .iter()
        .filter(|symbol| !symbol.is_code)
        .filter(named)
        .collect();
    assert!(!found.is_empty(), "the firmware has no {words:?}");
    found
}

#[test]
fn the_sensing_runs_from_itcm() {
    let symbols = symbols();
    let code = symbols.iter().filter(|symbol| symbol.is_code);
    // The linker's bridges between the memories are not code of the project.
    let code = code.filter(|symbol| !symbol.name.contains("Thunk"));
    let is_sensing = |symbol: &&Symbol| {
        let packages = ["hivtac_terms", "hivtac_sensor"];
        packages.iter().any(|package| symbol.name.contains(package))
            || symbol.name.starts_with("hivtac_")
    };
    // Code that rarely runs: for a model, a setting, a tare, a message or a self-test; after a
    // force, or in place of one without a film; for second looks, lost markers, contacts other than
    // needles, torques, steep steps, and two contacts; and what moves markers to one time, once a
    // frame. It has no loop over pixels; two contacts have one over weights, for which there is no
    // room.
    let seldom = [
        "hivtac_sensor5force5model",
        "hivtac_sensor..force..model",
        "hivtac_sensor4tare",
        "hivtac_sensor8temporal",
        "hivtac_sensor6rezero",
        "6Motion12unsteadiness",
        "8pipeline9following",
        "serde_core",
        "$GT$7prepare17h",
        "7forward8mounting",
        "4axis4Axis3new",
        "5table5Table3new",
        "6Tables3new",
        "14CovarianceGrid3new",
        "7Resting8of_model",
        "7Resting9of_turned",
        "7Resting3new",
        "7Resting5touch",
        "7Resting13touch_of_unit",
        "7Resting8touch_by",
        "7Resting9set_drift",
        "7forward5drift",
        "7forward6weight",
        "7forward6shapes",
        "7forward6widths",
        "8pipeline13at_the_middle",
        "9held_back",
        "7forward7motions",
        "7forward7torsion",
        "8pipeline7hanging",
        "5force6misfit",
        "10NoiseLevel9end_frame",
        "10NoiseLevel10set_beside",
        "hivtac_sensor12known_answer",
        "5force10of_outputs",
        "8Geometry9rest_area",
        "8Geometry10along_flat",
        "$GT$9configure17h",
        "$GT$13set_threshold17h",
        "$GT$11reconfigure17h",
        "$GT$14set_tare_under17h",
        "8pipeline6taring",
        "hivtac_sensor5force4rest",
        "5trust5Trust3new",
        "8pipeline5again",
        "8pipeline5three",
        "5rules5three",
        "7forward5three",
        "7forward4pair",
        "5force3two",
        "8pipeline3two",
        "7Resting17estimate_of_three",
        "8pipeline6placed",
        "5rules6placed",
        "7Resting16estimate_without",
        "8majority8Majority",
        "8portable8multiply",
        "8portable6spline",
        "8portable8products",
        "hivtac_products",
        "17mask_covered_rows",
    ];
    let runs_for_frames = |symbol: &&Symbol| !seldom.iter().any(|part| symbol.name.contains(part));
    let sensing: Vec<_> = code.filter(is_sensing).filter(runs_for_frames).collect();
    assert!(sensing.len() > 20, "the ELF has its symbols");
    for symbol in sensing {
        let Symbol { name, address, .. } = symbol;
        assert!(symbol.lies_in(&ITCM), "{name} lies at {address:#x}");
        assert_ne!(*address, 0, "{name} would be no pointer");
    }
}

#[test]
fn what_every_pixel_needs_lies_in_dtcm() {
    let symbols = symbols();
    let rows = variables(&symbols, &["band_copy", "BUFFERS"]);
    let table = variables(&symbols, &["dtcm_table", "TABLE"]);
    for symbol in rows.into_iter().chain(table) {
        assert!(symbol.lies_in(&DTCM), "{}", symbol.name);
    }
}

#[test]
fn axi_sram_has_what_the_dma_uses_and_nothing_else() {
    let symbols = symbols();
    let buffers = [
        ["bands", "RING"],
        ["snapshot", "FRAME"],
        ["uart", "UART_FRAME"],
    ];
    for words in buffers {
        for symbol in variables(&symbols, &words) {
            assert!(symbol.lies_in(&AXI_SRAM), "{}", symbol.name);
        }
    }
    for symbol in &symbols {
        let named = |words: &[&str; 2]| words.iter().all(|word| symbol.name.contains(word));
        assert!(
            buffers.iter().any(named) || !AXI_SRAM.contains(&symbol.address),
            "{}",
            symbol.name
        );
    }
}

#[test]
fn a_place_for_a_model_lies_in_each_of_two_cached_memories() {
    let symbols = symbols();
    for (words, memory) in [
        (["model_slots", "FIRST"], SRAM),
        (["model_slots", "SECOND"], AXI_CACHED),
    ] {
        for symbol in variables(&symbols, &words) {
            assert!(symbol.lies_in(&memory), "{}", symbol.name);
        }
    }
}

/// The first stage, which an update does not write, has the addresses of the last two.
#[test]
fn what_outlives_a_reset_lies_where_nothing_initializes_it() {
    let symbols = symbols();
    for (words, address) in [
        (["7failure", "FAILURE"], 0x2001_FF80),
        (["6starts", "STARTS"], 0x2001_FFF0),
        (["LOADER", "WANTED"], 0x2001_FFF8),
    ] {
        let found: Vec<u64> = variables(&symbols, &words)
            .iter()
            .map(|symbol| symbol.address)
            .collect();
        assert_eq!(found, [address], "{words:?}");
    }
}

#[test]
fn nothing_lies_below_the_stack_and_every_variable_in_a_memory() {
    let symbols = symbols();
    let is_variable = |symbol: &&Symbol| !symbol.is_code && symbol.address >= STACK.start;
    for symbol in symbols.iter().filter(is_variable) {
        let Symbol { name, address, .. } = symbol;
        let memories = [DTCM, SRAM, AXI_SRAM, AXI_CACHED];
        let known = memories.iter().any(|memory| symbol.lies_in(memory));
        let is_peripheral = (0x4000_0000..0x6000_0000).contains(address);
        assert!(known || is_peripheral, "{name} lies at {address:#x}");
    }
}
