//! `hivtac-studies`: what only proves or compares: the project's numbers beside what is possible,
//! on units drawn at random, and beside programs that nobody here wrote.

mod anywhere;
mod calculix;
mod convergence;
mod coverage;
mod creep;
mod document;
mod large;
mod maps;
mod mono;
mod page;
mod paper;
mod peers;
mod press;
mod refused;
mod scene;
mod slip;
mod tangential;
mod tips;
mod touches;
mod tradeoff;
mod units;
mod unseen;

use anyhow::Result;
use clap::{Parser, Subcommand};
use hivtac_calibration::progress::bar;

/// What only proves or compares: each study writes its page under docs/results.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Press anywhere within ±4 mm and hold the errors against the Cramér–Rao bound.
    Anywhere(anywhere::Anywhere),
    /// Press the film in CalculiX, too, and compare markers and tip. Needs the program `ccx`.
    Calculix(calculix::Calculix),
    /// Follow Gauss–Newton steps from many starts to contacts all over the film.
    Convergence(convergence::Convergence),
    /// Ask in every tenth of |F| and of the distance from the middle whether stated uncertainties
    /// hold.
    Coverage(coverage::Coverage),
    /// Press films that creep and unload late: hold, let go, and press by sines of time.
    Creep(creep::CreepStudy),
    /// Make a model for frames of 800×600, and hold its errors against the Cramér–Rao bound.
    Large(large::Large),
    /// Render black, red and blue markers under a camera that sees no colours, in white and in cyan
    /// light, and find how many rows they reach.
    Mono(mono::MonoStudy),
    /// Press films as they are mounted in CalculiX, too: stretched, of rubber, heavy, uneven. Needs
    /// the program `ccx`.
    MountedFilms(calculix::MountedFilms),
    /// Train the paper's network with the place as two more outputs, and judge it beside ours.
    Paper(paper::Paper),
    /// Compare with the paper's own pipeline (OpenCV, a float network 3×512) on the same rendered
    /// frames. What it renders and trains is kept in a folder: an interrupted run goes on.
    Peers(peers::PeersArgs),
    /// Disturb frames by salt, specks, glare, dim light, noise and JPEG, and count those that keep
    /// their force.
    Refused(refused::Refused),
    /// Look at the simulated sensor: frames, its film, what each of its effects does.
    #[command(subcommand)]
    Scene(scene::SceneCommand),
    /// Press, drag, release, grasp and catch, and count what contact and slip miss, invent, and how
    /// late they come.
    Slip(slip::Slip),
    /// Press with a tangential force to 0.8 of the normal one.
    Tangential(tangential::Tangential),
    /// Press with tips of other sizes than the model believes in.
    Tips(tips::Tips),
    /// Press with two tips at once, and with flat faces, by the film's full solver.
    Touches(touches::Touches),
    /// Speed against accuracy: sweep frame sizes, estimators and arithmetics, and write
    /// docs/tradeoff.md; or pick the best under limits. An interrupted sweep goes on.
    Tradeoff(tradeoff::TradeoffArgs),
    /// Displace one marker and see what the residual does not tell.
    Unseen(unseen::Unseen),
    /// Draw units as people build them; measure them with a tare alone, and after ten loads.
    Units(units::Units),
}

fn main() -> Result<()> {
    // Whoever reads the output may have enough of it.
    sigpipe::reset();
    match Cli::parse().command {
        Command::Anywhere(study) => study.run(),
        Command::Calculix(study) => study.run(),
        Command::Convergence(study) => study.run(),
        Command::Coverage(study) => study.run(),
        Command::Creep(study) => study.run(),
        Command::Large(study) => study.run(),
        Command::Mono(study) => study.run(),
        Command::MountedFilms(study) => study.run(),
        Command::Paper(study) => study.run(),
        Command::Peers(study) => study.run(),
        Command::Refused(study) => study.run(),
        Command::Scene(command) => command.run(),
        Command::Slip(study) => study.run(),
        Command::Tangential(study) => study.run(),
        Command::Tips(study) => study.run(),
        Command::Touches(study) => study.run(),
        Command::Tradeoff(study) => study.run(sweep_bars),
        Command::Unseen(study) => study.run(),
        Command::Units(study) => study.run(),
    }
}

/// What to call at every step of so many frames and trainings.
fn sweep_bars([frames, trainings]: [usize; 2]) -> impl Fn(tradeoff::Step) + Sync {
    let (rendering, training) = (bar("rendering", frames), bar("training", trainings));
    move |step| match step {
        tradeoff::Step::Frame => rendering.inc(1),
        tradeoff::Step::Training => training.inc(1),
    }
}
