//! `cargo xtask bench`: what a frame and an inference cost on the microcontroller: instructions,
//! counted in QEMU, exactly and repeatably, and cycles that follow from them by LLVM's model of the
//! core.

mod baseline;
pub mod board;
mod cases;
mod disassembly;
mod document;
mod items;
mod lowering;
mod mca;
mod measure;
mod memory;
mod paper;
mod peers;
mod record;
mod stages;
mod tables;

use anyhow::Result;
use clap::Args;

use crate::toolchain::Toolchain;
use crate::{artifacts, packages, size, workspace};
use baseline::Baseline;
use items::{Item, Report};

/// Options of `cargo xtask bench`.
#[derive(Args, Default)]
pub struct Bench {
    /// Print one JSON object instead of tables.
    #[arg(long)]
    json: bool,
    /// Make what is measured now the baseline that later counts are held to.
    #[arg(long)]
    write_baseline: bool,
    /// Put the tables into docs/results/performance.md.
    #[arg(long)]
    write_docs: bool,
    /// Compare with OpenCV on this computer instead.
    #[arg(long, conflicts_with_all = ["json", "write_baseline"])]
    peers: bool,
    /// Draw the paper's Figure 14 and Table 1 with this sensor's rows, into docs.
    #[arg(long, conflicts_with_all = ["json", "write_baseline", "write_docs", "peers"])]
    paper: bool,
    /// Measure on an STM32H743 that is attached by a debug probe instead.
    #[arg(long, conflicts_with_all = ["json", "write_baseline", "write_docs", "peers"])]
    board: bool,
}

impl Bench {
    /// Measures and prints every case, and holds the counts to the baseline.
    ///
    /// # Errors
    /// When something cannot be built or run, or a count is not the baseline's.
    pub fn run(&self, toolchain: &Toolchain) -> Result<()> {
        if self.peers {
            return peers::run(self.write_docs);
        }
        if self.board {
            return board::run(toolchain);
        }
        if !mca::is_installed() {
            eprintln!(
                "no modelled cycles: llvm-mca and llvm-objdump are missing; install the package {} \
                 (Debian's name)",
                mca::PACKAGE
            );
        }
        let folder = workspace::work_folder("bench")?;
        let mut bench = prepare(toolchain)?;
        let measured = bench.measure_all(cases::write(&folder)?)?;
        let items = items::of(&measured);
        if self.paper {
            let times = paper::sample_times(toolchain)?;
            let frames = bench.measure_all(cases::write_frames(&folder, &times)?)?;
            return paper::write(&times, &frames, &items);
        }
        if self.json {
            println!(
                "{}",
                serde_json::to_string_pretty(&Report { items: &items })?
            );
        } else {
            println!("{}", tables::all(&items, &measured));
        }
        if self.write_docs {
            document::write("bench", &tables::all(&items, &measured))?;
            document::write("memory", &size::table(&size::of_firmware(toolchain)?.0))?;
        }
        self.gate(toolchain, &items)
    }

    fn gate(&self, toolchain: &Toolchain, items: &[Item]) -> Result<()> {
        let now = Baseline::of(toolchain.compiler()?, items);
        if self.write_baseline {
            now.write()
        } else {
            Baseline::committed()?.check(&now)
        }
    }
}

/// The image and the plugin, ready to measure.
fn prepare(toolchain: &Toolchain) -> Result<measure::Bench> {
    packages::ensure_qemu()?;
    let image = artifacts::qemu_image(toolchain)?;
    let plugin = artifacts::instruction_counter(measure::plugin_version()?)?;
    measure::Bench::new(image, plugin, workspace::work_folder("bench")?)
}
