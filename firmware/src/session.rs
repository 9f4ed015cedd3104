//! Holds the state of a conversation with a host, as `docs/wire.md` defines it.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// True if the host uses our version. This and the following are written by the USB tasks; this one
/// is read by them, the pipeline and the capture task.
static SESSION_OPEN: AtomicBool = AtomicBool::new(false);
/// True while samples and statistics are sent. Read by the pipeline and the USB tasks.
static STREAMING: AtomicBool = AtomicBool::new(false);
/// True if samples carry markers. Read by the pipeline.
static WITH_MARKERS: AtomicBool = AtomicBool::new(false);
/// Number of the conversation. Read by the USB tasks, the pipeline and the capture task.
static CONVERSATION: AtomicU32 = AtomicU32::new(0);

/// Begins a conversation, after a hello; `understood` is true if host and device use the same
/// version.
pub fn begin(understood: bool) {
    STREAMING.store(false, Ordering::Relaxed);
    SESSION_OPEN.store(understood, Ordering::Relaxed);
    CONVERSATION.fetch_add(1, Ordering::Relaxed);
}

/// Ends the conversation: the host is gone.
pub fn end() {
    begin(false);
}

/// True between the host's hello and its end.
pub fn is_open() -> bool {
    SESSION_OPEN.load(Ordering::Relaxed)
}

/// Number of the conversation, so that no reply of an earlier one reaches the next.
pub fn number() -> u32 {
    CONVERSATION.load(Ordering::Relaxed)
}

/// Starts or stops the flow of samples and stats.
pub fn stream(on: bool) {
    STREAMING.store(on, Ordering::Relaxed);
}

/// Sends samples with or without markers, from the next one on.
pub fn send_markers(on: bool) {
    WITH_MARKERS.store(on, Ordering::Relaxed);
}

/// True if samples carry the markers.
pub fn wants_markers() -> bool {
    WITH_MARKERS.load(Ordering::Relaxed)
}

/// True while samples and stats are sent.
pub fn is_streaming() -> bool {
    STREAMING.load(Ordering::Relaxed)
}

/// The command that requested something, and its conversation.
#[derive(Clone, Copy)]
pub struct Origin {
    id: u16,
    conversation: u32,
}

impl Origin {
    /// A request by the command `id` of the current conversation.
    pub fn by(id: u16) -> Self {
        let conversation = number();
        Self { id, conversation }
    }

    /// The command to reply to; `None` if its host has gone.
    pub fn id(self) -> Option<u16> {
        (self.conversation == number()).then_some(self.id)
    }

    /// The command's conversation.
    pub fn conversation(self) -> u32 {
        self.conversation
    }
}
