//! A QEMU plugin that counts executed instructions, exactly and repeatably, by address.
//!
//! Counting begins when the program calls a function named `counting_begins` and ends when it calls `counting_ends`, as
//! often as it likes. At the end of the run the plugin writes one line per instruction to QEMU's log: its
//! address in hexadecimal and how often it ran. An address may have several lines, which add up.
//!
//! Counts are kept per translated block: QEMU tells of each one that it runs. A program that takes no interrupt and no
//! fault leaves a block only at its end, so the counts are exact.

mod qemu;

use std::ffi::{CStr, CString, c_char, c_int, c_uint, c_void};
use std::fmt::Write;
use std::ptr;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};

use qemu::{BlockHandle, PluginId};

/// The version of the plugin interface that this is written against; QEMU reads it before anything else.
#[unsafe(no_mangle)]
#[allow(non_upper_case_globals)]
pub static qemu_plugin_version: c_int = if cfg!(feature = "plugin-api-2") { 2 } else { 1 };

/// A translated block.
struct Block {
    addresses: Vec<u64>,
    /// Whether counting begins or ends with this block; `None` for nearly all.
    switch: Option<bool>,
    /// How often it ran while counting.
    runs: AtomicU64,
}

/// Every block that was ever translated. They are never freed: QEMU keeps their addresses.
static BLOCKS: Mutex<Vec<&'static Block>> = Mutex::new(Vec::new());
static COUNTING: AtomicBool = AtomicBool::new(false);

/// QEMU calls this once, when it loads the plugin.
#[unsafe(no_mangle)]
pub extern "C" fn qemu_plugin_install(
    id: PluginId,
    _info: *const c_void,
    _argument_count: c_int,
    _arguments: *mut *mut c_char,
) -> c_int {
    // SAFETY: both callbacks live as long as the plugin, and take what QEMU gives them.
    unsafe {
        qemu::qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
        qemu::qemu_plugin_register_atexit_cb(id, ended, ptr::null_mut());
    }
    0
}

/// QEMU has translated a block.
extern "C" fn translated(_id: PluginId, handle: BlockHandle) {
    let block: &'static Block = Box::leak(Box::new(Block {
        addresses: addresses(handle),
        switch: switch(handle),
        runs: AtomicU64::new(0),
    }));
    let mut blocks = BLOCKS.lock().unwrap_or_else(PoisonError::into_inner);
    blocks.push(block);
    let data = ptr::from_ref(block).cast_mut().cast();
    // SAFETY: the handle is valid during this call; the block is never freed and only read through shared references.
    unsafe {
        qemu::qemu_plugin_register_vcpu_tb_exec_cb(handle, executed, qemu::NO_REGISTERS, data)
    };
}

/// QEMU is about to run a block.
extern "C" fn executed(_cpu: c_uint, data: *mut c_void) {
    // SAFETY: `translated` gave the address of a block that is never freed.
    let block = unsafe { &*data.cast_const().cast::<Block>() };
    if let Some(counting) = block.switch {
        // The two functions themselves, their return included, do not count.
        COUNTING.store(counting, Relaxed);
    } else if COUNTING.load(Relaxed) {
        block.runs.fetch_add(1, Relaxed);
    }
}

/// QEMU ends.
extern "C" fn ended(_id: PluginId, _data: *mut c_void) {
    let blocks = BLOCKS.lock().unwrap_or_else(PoisonError::into_inner);
    let text = CString::new(report(&blocks)).unwrap_or_default();
    // SAFETY: a string that ends with a zero byte.
    unsafe { qemu::qemu_plugin_outs(text.as_ptr()) };
}

fn report(blocks: &[&Block]) -> String {
    let mut text = String::new();
    for block in blocks {
        let runs = block.runs.load(Relaxed);
        for address in block.addresses.iter().filter(|_| runs > 0) {
            let _ = writeln!(text, "{address:x} {runs}");
        }
    }
    text
}

fn addresses(handle: BlockHandle) -> Vec<u64> {
    // SAFETY: the handle is valid while QEMU translates the block, and the indices are inside it.
    unsafe {
        (0..qemu::qemu_plugin_tb_n_insns(handle))
            .map(|i| qemu::qemu_plugin_insn_vaddr(qemu::qemu_plugin_tb_get_insn(handle, i)))
            .collect()
    }
}

/// Whether the block belongs to one of the two functions that begin and end counting.
fn switch(handle: BlockHandle) -> Option<bool> {
    // SAFETY: as above, and a block has at least one instruction.
    let symbol = unsafe { qemu::qemu_plugin_insn_symbol(qemu::qemu_plugin_tb_get_insn(handle, 0)) };
    if symbol.is_null() {
        return None;
    }
    // SAFETY: not null, so it is a string of QEMU's that ends with a zero byte.
    match unsafe { CStr::from_ptr(symbol) }.to_bytes() {
        b"counting_begins" => Some(true),
        b"counting_ends" => Some(false),
        _ => None,
    }
}
