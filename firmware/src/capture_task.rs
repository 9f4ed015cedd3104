//! Keeps the camera running: sets it up, changes its pixel format or exposure, and restarts it when
//! it falls silent.

use crate::board;
use crate::camera::{self, Camera, Demand, Format, Setting};
use crate::capture::Capture;
use crate::condition::{self, Condition};
use crate::session::Origin;
use crate::{log, outbox, self_test, stats, vsync};
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_futures::select::{Either4, select4};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer};
use hivtac_portable::capture::Event;
use hivtac_terms::camera::CameraSettings;
use hivtac_terms::fixed::Q;
use hivtac_wire::message::{DeviceMessage, Inspection, LogLevel, Outcome};

/// The newest request to the capture task.
type Request<T> = Signal<CriticalSectionRawMutex, T>;

/// The requested pixel format. From the pipeline.
static REQUESTED_FORMAT: Request<Format> = Request::new();
/// A host's order for the camera. From the USB tasks.
static CAMERA_ORDER: Request<CameraOrder> = Request::new();
/// True while such an order is carried out. Set by the USB tasks, cleared by the capture task.
static CAMERA_ORDERED: AtomicBool = AtomicBool::new(false);
/// Requests the camera settings of a new device. From the memory task.
static CAMERA_AFRESH: Request<()> = Request::new();

/// Number of frame times without a band or the end of a frame that count as a silence. Bands come
/// all the time except during the vertical blanking, a seventh of a frame.
const SILENCE: u32 = 2;
/// Number of successive silences after which the camera is set up again.
const SILENCES: u32 = 3;
/// Pause before the next attempt if the camera does not answer.
const RETRY: Duration = Duration::from_millis(500);

/// A host's order for the camera, and who sent it.
struct CameraOrder {
    action: Action,
    origin: Origin,
}

/// The action of an order.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Let automatic exposure and gain adapt anew.
    Expose,
    /// Apply these settings; unchecked.
    Set(CameraSettings),
    /// Report the camera's state.
    Inspect,
}

/// Passes an action on for the command `id`; returns `Busy` if one is already being carried out.
pub fn order(action: Action, id: u16) -> Option<Outcome> {
    if CAMERA_ORDERED.swap(true, Ordering::Relaxed) {
        return Some(Outcome::Busy);
    }
    let origin = Origin::by(id);
    CAMERA_ORDER.signal(CameraOrder { action, origin });
    None
}

/// Requests a pixel format from the camera.
pub fn request_format(format: Format) {
    REQUESTED_FORMAT.signal(format);
}

/// Requests the camera settings of a new device.
pub fn set_afresh() {
    CAMERA_AFRESH.signal(());
}

/// Ends an order and replies to it.
fn end_order(origin: Origin, outcome: Outcome) {
    CAMERA_ORDERED.store(false, Ordering::Relaxed);
    if let Some(id) = origin.id() {
        outbox::reply(id, outcome);
    }
}

/// Runs for ever at the capture executor's priority. The camera begins with `format`.
#[embassy_executor::task]
pub async fn run(camera: Camera, mut capture: Capture, format: Format) {
    capture.set_format(format);
    let mut task = CaptureTask {
        camera,
        capture,
        numbering: false,
        starting: true,
        activity: 0,
        quiet: 0,
        silences: 0,
    };
    task.start_camera().await;
    loop {
        let frame_time = Timer::after(task.frame_time());
        let (format, order) = (REQUESTED_FORMAT.wait(), CAMERA_ORDER.wait());
        match select4(format, order, CAMERA_AFRESH.wait(), frame_time).await {
            Either4::First(format) => task.change_format(format).await,
            Either4::Second(order) => task.carry_out(order).await,
            Either4::Third(()) => task.set_up(CameraSettings::default()).await,
            Either4::Fourth(()) if task.is_silent() => task.silent().await,
            Either4::Fourth(()) => {}
        }
    }
}

struct CaptureTask {
    camera: Camera,
    capture: Capture,
    /// True if VSYNC edges have been counted since the first register reset.
    numbering: bool,
    /// True until the camera was set up for the first time.
    starting: bool,
    /// [`Capture::activity`] at the last check.
    activity: u32,
    /// Number of frame times without activity.
    quiet: u32,
    /// Number of successive silences.
    silences: u32,
}

impl CaptureTask {
    /// Time from frame to frame: the nominal one, or that of a camera whose clock is slow.
    fn frame_time(&self) -> Duration {
        let nominal = self.camera.frame_time();
        let measured = self.camera.pace.frame_us().map_or(0, u64::from);
        Duration::from_micros(measured).clamp(nominal, 4 * nominal)
    }

    /// Checks for activity during the last frame time. Returns whether the camera has been inactive
    /// for too long.
    fn is_silent(&mut self) -> bool {
        let activity = self.capture.activity();
        if activity != self.activity {
            (self.quiet, self.silences) = (0, 0);
        } else {
            self.quiet += 1;
        }
        self.activity = activity;
        let silent = self.quiet >= SILENCE;
        if silent {
            self.quiet = 0;
        }
        silent
    }

    async fn silent(&mut self) {
        stats::CAMERA_TIMEOUTS.count();
        self.silences += 1;
        if self.silences >= SILENCES {
            condition::set(Condition::NoCamera);
            self.silences = 0;
            log::say(
                LogLevel::Warning,
                format_args!("camera silent, restarting it"),
            );
            self.start_camera().await;
            stats::CAMERA_RESTARTS.count();
        } else {
            self.capture.start_again();
            // The events of the restart are not a sign of life.
            self.activity = self.capture.activity();
        }
    }

    /// Sets the camera up; repeats until it answers.
    async fn start_camera(&mut self) {
        let restart = self.numbering;
        let from = self.stop();
        self.try_until_it_answers().await;
        self.go_on(from, restart).await;
    }

    /// Changes the camera's pixel format.
    async fn change_format(&mut self, format: Format) {
        let from = self.stop();
        self.capture.set_format(format);
        let answered = self.camera.set_format(format).await;
        self.go_on_when_set_up(from, answered).await;
    }

    async fn carry_out(&mut self, CameraOrder { action, origin }: CameraOrder) {
        let outcome = match action {
            Action::Expose => self.expose().await,
            Action::Set(settings) => self.set(settings).await,
            Action::Inspect => self.inspect(origin).await,
        };
        end_order(origin, outcome);
    }

    async fn set(&mut self, settings: CameraSettings) -> Outcome {
        match camera::limits().check(&settings) {
            Ok(()) => {
                self.set_up(settings).await;
                Outcome::Done
            }
            Err(_) => Outcome::InvalidArgument,
        }
    }

    /// Applies settings to the camera.
    async fn set_up(&mut self, settings: CameraSettings) {
        let from = self.stop();
        camera::tell(settings);
        let answered = self.camera.set(settings).await;
        self.go_on_when_set_up(from, answered).await;
    }

    /// Lets automatic exposure and gain adapt anew.
    async fn expose(&mut self) -> Outcome {
        let from = self.stop();
        let answered = self.camera.lock_exposure().await;
        self.go_on_when_set_up(from, answered).await;
        Outcome::Done
    }

    /// Reports the camera's state while it keeps running.
    async fn inspect(&mut self, origin: Origin) -> Outcome {
        let frame_time = self.camera.frame_time();
        match self.camera.setting(self.capture.format()).await {
            Ok(setting) => {
                if origin.id().is_some() {
                    let inspection = inspection(setting, frame_time);
                    outbox::offer(DeviceMessage::Inspection(inspection));
                }
                Outcome::Done
            }
            Err(error) => {
                log::say(LogLevel::Error, format_args!("camera: {error}"));
                Outcome::NoCamera
            }
        }
    }

    /// Restarts the capture; a camera that did not answer is first set up anew.
    async fn go_on_when_set_up(&mut self, from: u32, answered: Result<(), camera::Error>) {
        if let Err(error) = answered {
            log::say(LogLevel::Error, format_args!("camera: {error}"));
            self.try_until_it_answers().await;
            stats::CAMERA_RESTARTS.count();
        } else {
            self_test::camera_set(self.camera.problems());
        }
        self.go_on(from, answered.is_err()).await;
    }

    /// Stops the capture and returns the number of the newest frame. Frames that pass from now on
    /// count as dropped immediately.
    fn stop(&mut self) -> u32 {
        self.capture.stop();
        let from = match self.numbering {
            true => vsync::newest().number,
            false => 0,
        };
        stats::pass_over_frames_after(from);
        from
    }

    /// Restarts the capture after the frames that passed since [`stop`](Self::stop).
    async fn go_on(&mut self, from: u32, restart: bool) {
        let to = vsync::newest().number;
        stats::end_passing_over(to);
        let passed = Event::Passed { from, to, restart };
        self.capture.start(passed).await;
    }

    async fn try_until_it_answers(&mut self) {
        let mut demand = Demand::All;
        while let Err(error) = self.try_camera(demand).await {
            condition::set(Condition::NoCamera);
            self_test::camera_failed(&error, self.starting);
            log::say(LogLevel::Error, format_args!("camera: {error}"));
            if let Some(order) = CAMERA_ORDER.try_take() {
                end_order(order.origin, Outcome::NoCamera);
            }
            // The second time a register differs, the part is like that.
            let differs = matches!(error, camera::Error::Register { .. });
            if differs && demand == Demand::All {
                demand = Demand::Needed;
            } else {
                Timer::after(RETRY).await;
            }
        }
        self_test::camera_answers(
            self.camera.pace.frame_us(),
            self.camera.frame_time().as_micros() as u32,
            self.camera.problems(),
            self.starting,
        );
        self.starting = false;
    }

    async fn try_camera(&mut self, demand: Demand) -> Result<(), camera::Error> {
        self.camera.reset(demand).await?;
        if !self.numbering {
            self.numbering = true;
            vsync::restart_count();
        }
        let settings = settings();
        let format = self.capture.format();
        self.camera.configure(format, settings).await
    }
}

/// Returns the settings to apply to the camera that answered. They may have been checked for
/// another one.
fn settings() -> CameraSettings {
    let wanted = camera::report().settings;
    if camera::limits().check(&wanted).is_ok() {
        return wanted;
    }
    let name = camera::fitted().name;
    let text = format_args!("camera: an {name} cannot have the kept settings; its usual ones");
    log::say(LogLevel::Warning, text);
    camera::tell(CameraSettings::default());
    CameraSettings::default()
}

fn inspection(setting: Setting, frame_time: Duration) -> Inspection {
    Inspection {
        silicon: board::silicon_revision(),
        camera_id: setting.id,
        registers: setting.comparison.registers,
        different: setting.comparison.different,
        frame_time_us: frame_time.as_micros() as u32,
        exposure_us: setting.exposure.0,
        longest_exposure_us: setting.longest_exposure.0,
        gain_sixteenths: Q::from_bits(setting.gain.0),
    }
}
