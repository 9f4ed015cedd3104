//! A QEMU plugin that counts the instructions that a program executes, exactly and repeatably.
//!
//! Counting begins when the program calls a function named `counting_begins`, and ends when it
//! calls `counting_ends`; both may be repeated. A call of `last_band_begins` separates what ran
//! before from what runs after it. At the end of the run the plugin writes both numbers to QEMU's
//! log: `[BEFORE,AFTER]`.
//!
//! QEMU runs blocks of instructions. Without interrupts and faults a program leaves a block only at
//! its end, and the counts are exact.

mod qemu;

use std::ffi::{CStr, CString, c_char, c_int, c_uint, c_void};
use std::ptr;
use std::sync::{Mutex, PoisonError};

use qemu::{BlockHandle, PluginId};

/// The plugin interface's version that this plugin uses; QEMU reads it first.
#[unsafe(no_mangle)]
#[allow(non_upper_case_globals)]
pub static qemu_plugin_version: c_int = if cfg!(feature = "plugin-api-2") { 2 } else { 1 };

/// The count until now. With one processor, the lock is always free.
static COUNTER: Mutex<Counter> = Mutex::new(Counter {
    blocks: Vec::new(),
    is_counting: false,
    part: 0,
    counts: [0; 2],
});

/// The effect of a block of instructions.
#[derive(Clone, Copy)]
enum Block {
    /// It is the body of `counting_begins`, which is not counted, nor are the other two.
    Begin,
    /// It is the body of `counting_ends`.
    End,
    /// It is the body of `last_band_begins`.
    LastBand,
    /// Its number of instructions.
    Work(usize),
}

struct Counter {
    /// All blocks that QEMU translated, in that order.
    blocks: Vec<Block>,
    is_counting: bool,
    /// 0, and 1 from the last band on.
    part: usize,
    counts: [usize; 2],
}

impl Counter {
    fn run(&mut self, number: usize) {
        match self.blocks[number] {
            Block::Begin => self.is_counting = true,
            Block::End => self.is_counting = false,
            Block::LastBand => self.part = 1,
            Block::Work(count) if self.is_counting => self.counts[self.part] += count,
            Block::Work(_) => {}
        }
    }
}

/// QEMU calls this once, when it loads the plugin.
#[unsafe(no_mangle)]
pub extern "C" fn qemu_plugin_install(
    id: PluginId,
    _info: *const c_void,
    _argument_count: c_int,
    _arguments: *mut *mut c_char,
) -> c_int {
    // SAFETY: both callbacks live as long as the plugin, and accept QEMU's arguments.
    unsafe {
        qemu::qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
        qemu::qemu_plugin_register_atexit_cb(id, ended, ptr::null_mut());
    }
    0
}

/// QEMU has translated a block.
extern "C" fn translated(_id: PluginId, handle: BlockHandle) {
    let block = block(handle);
    let number = with_counter(|counter| {
        counter.blocks.push(block);
        counter.blocks.len() - 1
    });
    // The number is passed as a pointer, through which nothing is ever read.
    let data = ptr::without_provenance_mut(number);
    // SAFETY: the handle is valid during this call.
    unsafe {
        qemu::qemu_plugin_register_vcpu_tb_exec_cb(handle, executed, qemu::NO_REGISTERS, data);
    }
}

/// QEMU is about to run a block.
extern "C" fn executed(_cpu: c_uint, data: *mut c_void) {
    with_counter(|counter| counter.run(data.addr()));
}

/// QEMU ends.
extern "C" fn ended(_id: PluginId, _data: *mut c_void) {
    let text = with_counter(|counter| format!("{:?}\n", counter.counts));
    let text = CString::new(text).unwrap_or_default();
    // SAFETY: a string that ends with a zero byte.
    unsafe { qemu::qemu_plugin_outs(text.as_ptr()) };
}

fn with_counter<T>(work: impl FnOnce(&mut Counter) -> T) -> T {
    work(&mut COUNTER.lock().unwrap_or_else(PoisonError::into_inner))
}

fn block(handle: BlockHandle) -> Block {
    // SAFETY: the handle is valid while QEMU translates the block, which has an instruction.
    let (symbol, count) = unsafe {
        let first = qemu::qemu_plugin_tb_get_insn(handle, 0);
        let symbol = qemu::qemu_plugin_insn_symbol(first);
        (symbol, qemu::qemu_plugin_tb_n_insns(handle))
    };
    if symbol.is_null() {
        return Block::Work(count);
    }
    // SAFETY: not null, so it is a string of QEMU's that ends with a zero byte.
    match unsafe { CStr::from_ptr(symbol) }.to_bytes() {
        b"counting_begins" => Block::Begin,
        b"counting_ends" => Block::End,
        b"last_band_begins" => Block::LastBand,
        _ => Block::Work(count),
    }
}
