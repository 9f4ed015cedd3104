//! All state that more than one context touches: who writes it, and who reads it.
//!
//! Contexts are those of [`priorities`](crate::priorities): the *VSYNC handler*, the *capture
//! handlers* (DCMI and its DMA, of one priority), the *capture task*, the *USB tasks* (receiver,
//! sender, watch on DTR, statistics; of one executor, as are the *LED task* and the *memory task*),
//! and in thread mode the *pipeline*. Each item is a lock, a queue or an atomic; the functions
//! around it stand in the module of its subject, and nothing else touches it.
//!
//! Elsewhere, with the type or the list that belongs to them:
//!
//! | static | where | written by | read by |
//! |---|---|---|---|
//! | counters | `stats`, one for each field of the wire's statistics | see there | USB tasks |
//! | `RING` | `bands`, in AXI SRAM | DMA of the camera; the core clears it at boot | MDMA |
//! | `BUFFERS` | `band_copy`, in DTCM | MDMA | pipeline, which owns it from boot on |
//! | `FRAME` | `snapshot`, in AXI SRAM | MDMA | USB tasks, once the pipeline says that it is whole |
//! | `FILES` | `model_slots`, in SRAM | USB tasks, boot | whom a slot is lent to: memory task, pipeline |
//! | `CAPTURE_EXECUTOR`, `USB_EXECUTOR` | `main` | embassy | embassy: boot and one handler each |
//!
//! Not shared: memory with one owner, which takes it once (`main::SENSOR`, `near_table::TABLE`),
//! and constants (`model`).

use crate::camera::{Format, LIMITS, USUAL_FORMAT};
use crate::capture::{CaptureEvent, Running};
use crate::capture_task::CameraOrder;
use crate::health::Condition;
use crate::memory::MemoryOrder;
use crate::model::Chosen;
use crate::model_slots;
use crate::model_upload::Upload;
use crate::pipeline_task::Order;
use crate::settings::OfPipeline;
use crate::snapshot::Taken;
use crate::stats;
use core::cell::{Cell, RefCell};
use core::sync::atomic::{AtomicBool, AtomicI32, AtomicU8, AtomicU32};
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use hivtac_capture::Edge;
use hivtac_terms::camera::{CameraSettings, Rate};
use hivtac_terms::down::Down;
use hivtac_terms::units::{Microseconds, Sixteenths};
use hivtac_wire::health::ResetReason;
use hivtac_wire::message::{DeviceMessage, Sample};
use hivtac_wire::settings::{CameraReport, Name};

/// What waits for one receiver; whoever sends never waits longer than for room.
type Queue<T, const N: usize> = Channel<CriticalSectionRawMutex, T, N>;

/// The newest thing that one receiver is asked for.
type Request<T> = Signal<CriticalSectionRawMutex, T>;

// The camera and its capture.

/// The newest VSYNC edge. Written by the VSYNC handler, and set to zero by the capture task; read
/// by the capture handlers, the capture task, the pipeline and the USB tasks (`vsync`).
pub static NEWEST_EDGE: CriticalSectionMutex<Cell<Edge>> =
    CriticalSectionMutex::new(Cell::new(Edge {
        number: 0,
        time_us: 0,
    }));

/// The tracker and the hardware that it steers. Used by the capture handlers, the capture task and
/// the pipeline, one at a time (`capture`).
pub static CAPTURE: CriticalSectionMutex<RefCell<Option<Running>>> =
    CriticalSectionMutex::new(RefCell::new(None));

/// Pixels of the frames that are captured. Written by the capture task while the capture is
/// stopped; read by the capture handlers and the capture task (`capture`).
pub static CAPTURED_FORMAT: CriticalSectionMutex<Cell<Format>> =
    CriticalSectionMutex::new(Cell::new(USUAL_FORMAT));

/// Bands finished since boot, modulo 2³². Written by whoever uses [`CAPTURE`]; read by the
/// pipeline.
pub static BANDS_FINISHED: AtomicU32 = AtomicU32::new(0);

/// Capture events so far, lost ones too. Written by the capture handlers and the capture task; read
/// by the capture task.
pub static CAPTURE_ACTIVITY: AtomicU32 = AtomicU32::new(0);

/// Capture events that wait: more than bands that are still whole.
const CAPTURE_EVENTS_WAITING: usize = 72;

/// What happens, in order. From the capture handlers and the capture task to the pipeline. When
/// there is no room a handler's event is lost; the pipeline notices that by the next one.
pub static CAPTURE_EVENTS: Queue<CaptureEvent, CAPTURE_EVENTS_WAITING> = Queue::new();

/// What pixels the camera shall send. From the pipeline to the capture task.
pub static REQUESTED_FORMAT: Request<Format> = Request::new();

/// What a host asks of the camera. From the USB tasks to the capture task.
pub static CAMERA_ORDER: Request<CameraOrder> = Request::new();

/// Such an order is under way. Set by the USB tasks, cleared by the capture task (`capture_task`).
pub static CAMERA_ORDERED: AtomicBool = AtomicBool::new(false);

/// From VSYNC to the middle of the exposure, µs. Written by the capture task; read by the pipeline
/// (`camera`).
pub static EXPOSURE_MIDDLE_US: AtomicI32 = AtomicI32::new(0);

/// How the camera is set. Written at boot and by the capture task; read by the USB tasks, the
/// memory task and the pipeline (`camera`).
pub static CAMERA: CriticalSectionMutex<Cell<CameraReport>> =
    CriticalSectionMutex::new(Cell::new(CameraReport {
        settings: CameraSettings {
            exposure: None,
            gain: None,
            rate: Rate::Full,
        },
        exposure: Microseconds(0),
        gain: Sixteenths(0),
        limits: LIMITS,
    }));

/// The camera is to be set as a new device's. From the memory task to the capture task.
pub static CAMERA_AFRESH: Request<()> = Request::new();

/// Number of the newest frame before the camera's set-up, while that lasts. Written by the capture
/// task; read by the USB tasks (`stats`).
pub static PASSING_OVER: AtomicU32 = AtomicU32::new(stats::NOT_PASSING);

// The pipeline.

/// Orders of the host that wait. From the USB tasks to the pipeline.
pub static ORDERS: Queue<Order, 4> = Queue::new();

/// What the pipeline measures with; nothing before it is configured. Written at boot and by the
/// pipeline; read by the USB tasks and the memory task (`settings`).
pub static PIPELINE: CriticalSectionMutex<Cell<Option<OfPipeline>>> =
    CriticalSectionMutex::new(Cell::new(None));

/// The model that is to be used next. From the memory task to the pipeline, with an order.
pub static NEXT_MODEL: Request<Chosen> = Request::new();

/// How the sensor is doing, a [`Condition`]. Written by the pipeline and the capture task; read by
/// the LED task (`health`).
pub static CONDITION: AtomicU8 = AtomicU8::new(Condition::NoCamera as u8);

/// The conversation that a snapshot is under way for; 0 when none is. Set by the USB tasks, cleared
/// by them and the pipeline (`snapshot`).
pub static SNAPSHOT_FOR: AtomicU32 = AtomicU32::new(0);

/// A frame that was kept whole. From the pipeline to the sender, one of the USB tasks.
pub static SNAPSHOT_TAKEN: Request<Taken> = Request::new();

/// Why the microcontroller started, a `ResetReason`. Written at boot; read by the memory task
/// (`faults`).
pub static RESET_REASON: AtomicU8 = AtomicU8::new(ResetReason::Other as u8);

/// What the self-test found at the start, bits of `Problem`. Written at boot and by the capture
/// task; read by the memory task and the LED task (`self_test`).
pub static AT_START: AtomicU32 = AtomicU32::new(0);

/// Why the camera could not be set up, a bit of `Problem`; 0 when it could. Written by the capture
/// task; read by the memory task (`self_test`).
pub static CAMERA_PROBLEM: AtomicU32 = AtomicU32::new(0);

// What is kept.

/// The device's name. Written at boot and by the USB tasks; read by them and the memory task
/// (`settings`).
pub static NAME: CriticalSectionMutex<Cell<Name>> =
    CriticalSectionMutex::new(Cell::new(Name::new()));

/// What is known of gravity. Written at boot, by the USB tasks and, when all is forgotten, by the
/// memory task; read by that and, before each frame, by the pipeline (`settings`).
pub static DOWN: CriticalSectionMutex<Cell<Down>> =
    CriticalSectionMutex::new(Cell::new(Down::Fixed));

/// What a host asks of the flash. From the USB tasks to the memory task.
pub static MEMORY_ORDER: Request<MemoryOrder> = Request::new();

/// Such an order is under way. Set by the USB tasks, cleared by the memory task (`memory`).
pub static MEMORY_ORDERED: AtomicBool = AtomicBool::new(false);

/// Slots for models that may not be written. Set at boot and by the memory task; cleared by them
/// and the pipeline (`model_slots`).
pub static LENT: [AtomicBool; model_slots::COUNT] = [const { AtomicBool::new(false) }; _];

/// A model on its way. Used by the USB tasks and the memory task (`model_upload`).
pub static UPLOAD: CriticalSectionMutex<Cell<Option<Upload>>> =
    CriticalSectionMutex::new(Cell::new(None));

// The conversation with the host.

/// Hellos, replies, statistics and log lines. From the USB tasks, the pipeline and the capture task
/// to the sender, one of the USB tasks (`outbox`).
pub static ANSWERS: Queue<DeviceMessage, 8> = Queue::new();

/// Samples: 0.2 s of them. Older ones are worth more than a gap, but not more than a fresh
/// measurement's latency. From the pipeline to the sender (`outbox`).
#[unsafe(link_section = ".sram.samples")]
pub static SAMPLES: Queue<Sample, 32> = Queue::new();

/// A host speaks our version. This and the following are written by the USB tasks (`session`); this
/// one is read by them, the pipeline and the capture task.
pub static SESSION_OPEN: AtomicBool = AtomicBool::new(false);
/// Samples and statistics flow. Read by the pipeline and the USB tasks.
pub static STREAMING: AtomicBool = AtomicBool::new(false);
/// Samples carry markers. Read by the pipeline.
pub static WITH_MARKERS: AtomicBool = AtomicBool::new(false);
/// Another one for each conversation. Read by the USB tasks, the pipeline and the capture task.
pub static CONVERSATION: AtomicU32 = AtomicU32::new(0);
