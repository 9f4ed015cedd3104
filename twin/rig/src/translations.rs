//! Keeps a run's translation of its program for the next run of that program in this process.
//!
//! The emulator translates instructions when they are first run, which takes more than half of a
//! short run's time. Soon after its start, a program has copied itself to where it runs and
//! switches on the memory protection unit (MPU). At that point a core that has run the same program
//! before takes over, with the state of the core that it replaces. Translations change only the
//! duration of a run.
#![expect(
    unsafe_code,
    reason = "a core is handed the memory of a run by pointers"
)]

use std::hash::{DefaultHasher, Hasher};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rigless::emulator::{CoreBus, CoreSpec, DataModel, Error, Exit, HostCall, Processor, Queued};
use rigless::soc::{Endian, Width};
use rigless::time::VirtualNanos;

use crate::mpu;

/// Memory in which programs run: ITCM, the flash's first bank, the ROM. Translations of other
/// addresses are not kept.
const CODE: [Range<u64>; 3] = [
    0..0x1_0000,
    0x0800_0000..0x0810_0000,
    0x1FF0_0000..0x1FF2_0000,
];
/// The largest number of kept cores: several programs, on as many threads as a computer for tests
/// has.
const MOST_KEPT: usize = 16;

/// Makes the cores of a board keep their translations. `is_on` shows whether a program has switched
/// the MPU on; it is needed if the core itself has no MPU to check.
pub fn keep(spec: &mut CoreSpec, is_on: Option<Arc<AtomicBool>>) {
    let make = spec.processor.clone();
    spec.processor = Arc::new(move |endian| {
        Ok(Box::new(Core {
            inner: Some(make(endian)?),
            mapped: Vec::new(),
            is_on: is_on.clone(),
            program: None,
        }))
    });
}

/// A stretch of memory that a run mapped.
#[derive(Debug)]
struct Mapped {
    start: u64,
    length: u64,
    host: *mut u8,
    writable: bool,
}

// SAFETY: it is read by methods of the core alone, which is used by one thread at a time.
unsafe impl Send for Mapped {}

impl Mapped {
    /// Returns the part of its bytes that lies in `range`.
    fn bytes(&self, range: &Range<u64>) -> &[u8] {
        let start = range.start.max(self.start);
        let end = range.end.min(self.start + self.length);
        if start >= end {
            return &[];
        }
        let (offset, length) = ((start - self.start) as usize, (end - start) as usize);
        // SAFETY: inside the mapped memory, which stays until the core that holds this is dropped,
        // and which nobody writes while a method of that core reads it.
        unsafe { std::slice::from_raw_parts(self.host.add(offset), length) }
    }

    fn place(&self) -> (u64, u64, bool) {
        (self.start, self.length, self.writable)
    }
}

/// The conditions for which translations are valid.
#[derive(Debug, PartialEq, Eq)]
struct Program {
    /// Hash of the program's bytes.
    hash: u64,
    /// Start, length and whether it is writable, for all memory.
    memory: Vec<(u64, u64, bool)>,
    /// Whether the core enforces the MPU's regions.
    is_enforced: bool,
}

/// Cores that no run uses now; the one that was used last is at the end.
type Kept = Vec<(Program, Box<dyn Processor>)>;

static KEPT: Mutex<Kept> = Mutex::new(Vec::new());

fn kept() -> MutexGuard<'static, Kept> {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Debug)]
struct Core {
    /// Always present until this is dropped.
    inner: Option<Box<dyn Processor>>,
    mapped: Vec<Mapped>,
    is_on: Option<Arc<AtomicBool>>,
    /// The program at the time when the MPU was switched on; present from then on.
    program: Option<Program>,
}

impl Core {
    fn inner(&self) -> &dyn Processor {
        self.inner.as_deref().expect("a core")
    }

    fn inner_mut(&mut self) -> &mut dyn Processor {
        self.inner.as_deref_mut().expect("a core")
    }

    fn program_now(&self) -> Program {
        let mut hasher = DefaultHasher::new();
        for range in &CODE {
            for mapped in &self.mapped {
                hasher.write(mapped.bytes(range));
            }
        }
        Program {
            hash: hasher.finish(),
            memory: self.mapped.iter().map(Mapped::place).collect(),
            is_enforced: self.is_on.is_none(),
        }
    }

    fn is_protected(&mut self) -> bool {
        if let Some(is_on) = &self.is_on {
            return is_on.load(Ordering::Relaxed);
        }
        let core = self.inner_mut();
        let control = core.debugger_access(None, mpu::CTRL_ADDRESS, Width::W32, VirtualNanos(0));
        control.is_some_and(|control| control & mpu::ENABLE != 0)
    }

    /// Replaces this core by a kept one, if there is one for this program.
    fn hand_over(&mut self) {
        let program = self.program_now();
        let found = {
            let mut kept = kept();
            let at = kept.iter().position(|(its, _)| *its == program);
            at.map(|at| kept.remove(at))
        };
        self.program = Some(program);
        let Some((_, mut next)) = found else {
            return;
        };
        for mapped in &self.mapped {
            // SAFETY: the promise of `map`'s caller to this core holds for the one inside it. The
            // memory that was mapped at the same addresses before is all replaced before it runs.
            unsafe { next.map(mapped.start, mapped.length, mapped.host, mapped.writable) };
        }
        let mut from = 0;
        for range in CODE {
            next.ask(Queued::Invalidate(from, range.start));
            from = range.end;
        }
        next.ask(Queued::Invalidate(from, 1 << 32));
        if next.load(&self.inner().save()).is_ok() {
            self.inner = Some(next);
        }
    }
}

impl Drop for Core {
    fn drop(&mut self) {
        let (Some(program), Some(core)) = (self.program.take(), self.inner.take()) else {
            return;
        };
        if program == self.program_now() && !std::thread::panicking() {
            let mut kept = kept();
            if kept.len() == MOST_KEPT {
                kept.remove(0);
            }
            kept.push((program, core));
        }
    }
}

/// All that a run without a debugger needs of a core.
impl Processor for Core {
    fn run(&mut self, budget: u32, bus: &mut dyn CoreBus) -> (Exit, u64) {
        let ran = self.inner_mut().run(budget, bus);
        if self.program.is_none() && self.is_protected() {
            self.hand_over();
        }
        ran
    }

    fn retired(&self) -> u64 {
        self.inner().retired()
    }

    fn ask(&mut self, queued: Queued) {
        debug_assert!(!matches!(queued, Queued::Route(_)), "nothing is watched");
        self.inner_mut().ask(queued);
    }

    fn maps(&self, start: u64, length: u64) -> bool {
        self.inner().maps(start, length)
    }

    fn page_size(&self) -> u64 {
        self.inner().page_size()
    }

    unsafe fn map(&mut self, start: u64, length: u64, host: *mut u8, writable: bool) {
        self.mapped.push(Mapped {
            start,
            length,
            host,
            writable,
        });
        // SAFETY: the caller's promise.
        unsafe { self.inner_mut().map(start, length, host, writable) };
    }

    fn boot(&mut self, table: u64, read: &dyn Fn(u64, Width) -> Option<u64>) {
        self.inner_mut().boot(table, read);
    }

    fn reset(&mut self) {
        self.program = None;
        self.inner_mut().reset();
    }

    fn take_reset_request(&mut self) -> bool {
        self.inner_mut().take_reset_request()
    }

    fn next_event(&self) -> Option<VirtualNanos> {
        self.inner().next_event()
    }

    fn on_event(&mut self, now: VirtualNanos) {
        self.inner_mut().on_event(now);
    }

    fn waiting(&self) -> bool {
        self.inner().waiting()
    }

    fn pc(&self) -> u64 {
        self.inner().pc()
    }

    fn data_model(&self) -> DataModel {
        self.inner().data_model()
    }

    fn byte_order(&self, address: u64) -> Endian {
        self.inner().byte_order(address)
    }

    fn own_ranges(&self) -> Vec<Range<u64>> {
        self.inner().own_ranges()
    }

    fn save(&self) -> Vec<u8> {
        self.inner().save()
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.inner_mut().load(bytes)
    }

    fn check_reads(&mut self, every: bool) {
        self.inner_mut().check_reads(every);
    }

    fn check_words(&mut self, words: &[u64]) {
        self.inner_mut().check_words(words);
    }

    fn host_call(&self, read: &mut dyn FnMut(u64, Width) -> Option<u64>) -> Option<HostCall> {
        self.inner().host_call(read)
    }

    fn answer_host_call(&mut self, answer: Option<u64>) {
        self.inner_mut().answer_host_call(answer);
    }
}
