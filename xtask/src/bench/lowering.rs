//! Rewrites the image's instructions for LLVM's machine-code analyzer. Instructions that it does
//! not know or counts too low are replaced by what the core does.
//!
//! - Branches, calls and returns have no target and take one slot of the branch unit: the core's
//!   branch target cache handles a correctly predicted one in a cycle.
//! - `it` takes one slot. Each conditional instruction after it takes its own, whether or not it is
//!   executed.
//! - A comparison of floating-point numbers becomes a subtraction; reading its flags becomes a move
//!   to the core's registers.
//! - Loads and stores of several registers (`ldm`, `push` …), one cycle in the analyzer, become one
//!   load or store for each register.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;

use crate::process;

/// An instruction that takes one slot and waits for nothing.
pub const FILLER: &str = "mov.w r8, #0";

/// The register for the difference that replaces a comparison.
const SCRATCH: &str = "s31";

/// Conditional branches.
const CONDITIONS: &str = "beq bne bhs bcs blo bcc bmi bpl bvs bvc bhi bls bge blt bgt ble";

/// Instructions that the analyzer cannot process; no hot loop has them.
const UNMODELLED: &str = "bkpt svc udf cpsid cpsie msr mrs dsb isb dmb wfi";

/// The lines that replace each instruction of an ELF, by its address.
pub fn disassemble(image: &Path) -> Result<BTreeMap<u64, Vec<String>>> {
    let objdump = "llvm-objdump --disassemble --no-show-raw-insn --mcpu=cortex-m7";
    let mut command = process::command(objdump);
    Ok(parse(&process::output(command.arg(image))?))
}

fn parse(text: &str) -> BTreeMap<u64, Vec<String>> {
    let mut conditional = 0;
    let instructions = text.lines().filter_map(|line| {
        let (address, mnemonic, operands) = instruction(line)?;
        if conditional == 0 {
            if is_it(mnemonic) {
                conditional = mnemonic.len() - 1;
            }
            return Some((address, lower(mnemonic, operands)));
        }
        conditional -= 1;
        let (name, width) = mnemonic.split_at(mnemonic.find('.').unwrap_or(mnemonic.len()));
        let name = &name[..name.len().saturating_sub("eq".len())];
        Some((address, lower(&format!("{name}{width}"), operands)))
    });
    instructions.collect()
}

/// Splits a line into address, mnemonic and operands. A colon follows the address, tabs separate
/// the rest, and a comment may follow.
fn instruction(line: &str) -> Option<(u64, &str, &str)> {
    let (address, rest) = line.split_once(':')?;
    let address = u64::from_str_radix(address.trim(), 16).ok()?;
    let rest = rest.trim();
    let (mnemonic, operands) = rest.split_once(['\t', ' ']).unwrap_or((rest, ""));
    let operands = operands.split('@').next().unwrap_or("").trim();
    (!mnemonic.is_empty()).then_some((address, mnemonic, operands))
}

/// Whether a mnemonic is `it`, `ite`, `itett` …, which is followed by as many conditional
/// instructions as it has letters after the first.
fn is_it(mnemonic: &str) -> bool {
    let rest = mnemonic.strip_prefix("it");
    rest.is_some_and(|rest| rest.chars().all(|c| c == 't' || c == 'e'))
}

fn lower(mnemonic: &str, operands: &str) -> Vec<String> {
    let one = |line: &str| vec![line.to_owned()];
    let (first, rest) = operands.split_once(", ").unwrap_or((operands, ""));
    match mnemonic.split('.').next().unwrap_or("") {
        "b" | "bl" => one("b #-8"),
        // The return stack knows the target.
        "bx" if operands == "lr" => one("b #-8"),
        "bx" | "blx" => one(&format!("bx {operands}")),
        name @ ("cbz" | "cbnz") => one(&format!("{name} {first}, #4")),
        // `[pc, r1]` is a load, and a branch to the loaded address.
        "tbb" | "tbh" => {
            let index = rest.split(", ").next().unwrap_or("").trim_end_matches(']');
            vec![format!("ldrb r12, [sp, {index}]"), "bx r12".to_owned()]
        }
        "vcmp" | "vcmpe" if rest.starts_with('#') => one(&format!("vneg.f32 {SCRATCH}, {first}")),
        "vcmp" | "vcmpe" => one(&format!("vsub.f32 {SCRATCH}, {operands}")),
        "vmrs" => one(&format!("vmov r12, {SCRATCH}")),
        "push" | "vpush" => several("str", "sp", operands),
        "pop" | "vpop" => several("ldr", "sp", operands),
        "ldm" | "ldmdb" | "ldmia" | "vldmia" | "vldmdb" => several("ldr", first, rest),
        "stm" | "stmdb" | "stmia" | "vstmia" | "vstmdb" => several("str", first, rest),
        name if is_one_of(CONDITIONS, name) => one("bne #-8"),
        name if is_one_of(UNMODELLED, name) => one(FILLER),
        name if is_it(name) || name.starts_with('<') => one(FILLER),
        _ => one(&format!("{mnemonic} {operands}")),
    }
}

fn is_one_of(names: &str, name: &str) -> bool {
    names.split(' ').any(|it| it == name)
}

/// One access for each register of `{r4, r5, pc}`, two words for a double register of the
/// floating-point unit. A load of `pc`, which is always the last, returns.
fn several(verb: &str, base: &str, registers: &str) -> Vec<String> {
    let base = base.trim_end_matches('!');
    let registers = registers.trim_matches(['{', '}']).split(", ");
    let line = |(index, register): (usize, &str)| {
        if register == "pc" {
            return vec![format!("ldr r12, [{base}]"), "b #-8".to_owned()];
        }
        let is_float = register.starts_with(['d', 's']) && register != "sp";
        let (prefix, offset) = (if is_float { "v" } else { "" }, 4 * index);
        vec![format!("{prefix}{verb} {register}, [{base}, #{offset}]")]
    };
    registers.enumerate().flat_map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instructions_are_written_as_what_the_core_does() {
        let text = "\nhivtac-qemu-image:\tfile format elf32-littlearm\n\n00000400 <push_row>:\n\
                    400:      \tite\tlo\n     402:      \tmovlo\tr0, #1\n\
                    404:      \tldrhs.w\tr1, [pc, #16]          @ 0x418 <push_row+0x18>\n\
                    408:      \tcbz\tr3, 0x4ca4 <f+0x2>\n  40a: \ttbb\t[pc, r1]\n\
                    40c:      \tvcmp.f32\ts0, #0\n  40e: \tstm\tr0!, {r1, d2}\n\
                    410:      \tbhs.w\t0x4ca4\n  414: \tbic\tr0, r0, #1\n\
                    418:      \tpop.w\t{r4, pc}\n";
        let lines: Vec<String> = parse(text).into_values().flatten().collect();
        let expected = "mov.w r8, #0;mov r0, #1;ldr.w r1, [pc, #16];cbz r3, #4;\
                        ldrb r12, [sp, r1];bx r12;vneg.f32 s31, s0;str r1, [r0, #0];\
                        vstr d2, [r0, #4];bne #-8;bic r0, r0, #1;\
                        ldr r4, [sp, #0];ldr r12, [sp];b #-8";
        assert_eq!(lines.join(";"), expected);
    }
}
