//! Declarations from QEMU's plugin interface (`qemu-plugin.h`) that this plugin uses. They are
//! written by hand because the header is not packaged everywhere.

use std::ffi::{c_char, c_int, c_uint, c_void};

/// The plugin's number, given by QEMU.
pub type PluginId = u64;
/// A block of instructions that QEMU translates and runs as one.
pub type BlockHandle = *mut c_void;
/// One instruction of a block.
pub type InstructionHandle = *mut c_void;

/// `QEMU_PLUGIN_CB_NO_REGS`: the callback reads no register.
pub const NO_REGISTERS: c_int = 0;

unsafe extern "C" {
    pub fn qemu_plugin_register_vcpu_tb_trans_cb(
        id: PluginId,
        callback: extern "C" fn(PluginId, BlockHandle),
    );
    pub fn qemu_plugin_register_vcpu_tb_exec_cb(
        block: BlockHandle,
        callback: extern "C" fn(c_uint, *mut c_void),
        flags: c_int,
        data: *mut c_void,
    );
    pub fn qemu_plugin_register_atexit_cb(
        id: PluginId,
        callback: extern "C" fn(PluginId, *mut c_void),
        data: *mut c_void,
    );
    pub fn qemu_plugin_tb_n_insns(block: BlockHandle) -> usize;
    pub fn qemu_plugin_tb_get_insn(block: BlockHandle, index: usize) -> InstructionHandle;
    pub fn qemu_plugin_insn_symbol(instruction: InstructionHandle) -> *const c_char;
    pub fn qemu_plugin_outs(text: *const c_char);
}
