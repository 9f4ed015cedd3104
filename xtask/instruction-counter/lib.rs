//! A QEMU plugin that records what a program executes, exactly and repeatably: which blocks of
//! instructions run, and in which order they follow each other.
//!
//! Recording begins when the program calls a function named `counting_begins`, and ends when it
//! calls `counting_ends`; both may be repeated. A call of `last_band_begins` separates what ran
//! before from what runs after it. At the end of the run the plugin writes one JSON object to
//! QEMU's log:
//!
//! ```text
//! {"blocks":[[ADDRESS,…],…],"runs":[[LAST_BAND,FROM,TO,COUNT],…]}
//! ```
//!
//! A block is the list of its instructions' addresses, in order. COUNT is the number of times that
//! block TO ran right after block FROM, which is `null` after a call. Blocks that QEMU translated
//! several times count as one. Without interrupts and faults a program leaves a block only at its
//! end, and the counts are exact.

mod qemu;
mod record;

use std::ffi::{CStr, CString, c_char, c_int, c_uint, c_void};
use std::ptr;
use std::sync::{Mutex, PoisonError};

use qemu::{BlockHandle, PluginId};
use record::{Mark, Record};

/// The plugin interface's version that this plugin uses; QEMU reads it first.
#[unsafe(no_mangle)]
#[allow(non_upper_case_globals)]
pub static qemu_plugin_version: c_int = if cfg!(feature = "plugin-api-2") { 2 } else { 1 };

/// The data recorded until now. With one processor, the lock is always free.
static RECORD: Mutex<Record> = Mutex::new(Record::new());

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
    let number = with_record(|record| record.add_block(addresses(handle), mark(handle)));
    // The number is passed as a pointer, through which nothing is ever read.
    let data = ptr::without_provenance_mut(number);
    // SAFETY: the handle is valid during this call.
    unsafe {
        qemu::qemu_plugin_register_vcpu_tb_exec_cb(handle, executed, qemu::NO_REGISTERS, data);
    }
}

/// QEMU is about to run a block.
extern "C" fn executed(_cpu: c_uint, data: *mut c_void) {
    with_record(|record| record.run(data.addr()));
}

/// QEMU ends.
extern "C" fn ended(_id: PluginId, _data: *mut c_void) {
    let text = CString::new(with_record(|record| record.report())).unwrap_or_default();
    // SAFETY: a string that ends with a zero byte.
    unsafe { qemu::qemu_plugin_outs(text.as_ptr()) };
}

fn with_record<T>(work: impl FnOnce(&mut Record) -> T) -> T {
    work(&mut RECORD.lock().unwrap_or_else(PoisonError::into_inner))
}

fn addresses(handle: BlockHandle) -> Vec<u64> {
    // SAFETY: the handle is valid while QEMU translates the block, and the indices are inside it.
    unsafe {
        (0..qemu::qemu_plugin_tb_n_insns(handle))
            .map(|i| qemu::qemu_plugin_insn_vaddr(qemu::qemu_plugin_tb_get_insn(handle, i)))
            .collect()
    }
}

/// The block's mark: its function's name, if that is a marking function.
fn mark(handle: BlockHandle) -> Option<Mark> {
    // SAFETY: as above, and a block has at least one instruction.
    let symbol = unsafe { qemu::qemu_plugin_insn_symbol(qemu::qemu_plugin_tb_get_insn(handle, 0)) };
    if symbol.is_null() {
        return None;
    }
    // SAFETY: not null, so it is a string of QEMU's that ends with a zero byte.
    match unsafe { CStr::from_ptr(symbol) }.to_bytes() {
        b"counting_begins" => Some(Mark::Begin),
        b"counting_ends" => Some(Mark::End),
        b"last_band_begins" => Some(Mark::LastBand),
        _ => None,
    }
}
