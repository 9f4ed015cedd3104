//! Whether a host listens, and what it wants: a conversation as `docs/wire.md` defines it.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// A host speaks our version. This and the following are written by the USB tasks; this one is read
/// by them, the pipeline and the capture task.
static SESSION_OPEN: AtomicBool = AtomicBool::new(false);
/// Samples and statistics flow. Read by the pipeline and the USB tasks.
static STREAMING: AtomicBool = AtomicBool::new(false);
/// Samples carry markers. Read by the pipeline.
static WITH_MARKERS: AtomicBool = AtomicBool::new(false);
/// Another one for each conversation. Read by the USB tasks, the pipeline and the capture task.
static CONVERSATION: AtomicU32 = AtomicU32::new(0);

/// A hello began a new conversation; `understood` when host and device speak the same version.
pub fn begin(understood: bool) {
    STREAMING.store(false, Ordering::Relaxed);
    SESSION_OPEN.store(understood, Ordering::Relaxed);
    CONVERSATION.fetch_add(1, Ordering::Relaxed);
}

/// The host is gone.
pub fn end() {
    begin(false);
}

/// True between the host's hello and its end.
pub fn is_open() -> bool {
    SESSION_OPEN.load(Ordering::Relaxed)
}

/// Another one for each conversation, so that no reply of an earlier one reaches the next.
pub fn number() -> u32 {
    CONVERSATION.load(Ordering::Relaxed)
}

/// Starts or stops the flow of samples and stats.
pub fn stream(on: bool) {
    STREAMING.store(on, Ordering::Relaxed);
}

/// From the next sample on, with markers or without.
pub fn send_markers(on: bool) {
    WITH_MARKERS.store(on, Ordering::Relaxed);
}

/// True while samples shall carry the markers.
pub fn wants_markers() -> bool {
    WITH_MARKERS.load(Ordering::Relaxed)
}

/// True while samples and stats flow.
pub fn is_streaming() -> bool {
    STREAMING.load(Ordering::Relaxed)
}

/// Who asked.
#[derive(Clone, Copy)]
pub struct Asked {
    id: u16,
    conversation: u32,
}

impl Asked {
    /// By the command `id` of the present conversation.
    pub fn by(id: u16) -> Self {
        let conversation = number();
        Self { id, conversation }
    }

    /// The command to reply to, unless its host has gone.
    pub fn id(self) -> Option<u16> {
        (self.conversation == number()).then_some(self.id)
    }

    /// The conversation that the command came in.
    pub fn conversation(self) -> u32 {
        self.conversation
    }
}
