//! Instructions as LLVM's machine-code analyzer takes them: what it does not know or counts too low
//! is written as what the core does instead.
//!
//! - Branches, calls and returns go nowhere and take one slot of the branch unit: the core's branch
//!   target cache turns a correctly predicted one around in a cycle. Wrong predictions are counted
//!   apart (`tables`).
//! - `it` takes one slot; what it makes conditional takes its own whether it is executed or not.
//! - A comparison of floating-point numbers is a subtraction, and reading its flags a move to the
//!   core's registers.
//! - Loads and stores of several registers (`ldm`, `push` …), one cycle to the analyzer, are one
//!   load or store each.

use super::disassembly::{Instruction, is_it};

/// Takes one slot and waits for nothing.
pub const FILLER: &str = "mov.w r8, #0";

/// Takes the difference that a comparison is.
const SCRATCH: &str = "s31";

/// Conditional branches.
const CONDITIONS: [&str; 16] = [
    "beq", "bne", "bhs", "bcs", "blo", "bcc", "bmi", "bpl", "bvs", "bvc", "bhi", "bls", "bge",
    "blt", "bgt", "ble",
];

/// What LLVM's analyzer cannot take, and no hot loop has.
const UNMODELLED: [&str; 11] = [
    "bkpt", "svc", "udf", "cpsid", "cpsie", "msr", "mrs", "dsb", "isb", "dmb", "wfi",
];

/// The lines that stand for an instruction.
pub fn lower(instruction: &Instruction) -> Vec<String> {
    let operands = instruction.operands.as_str();
    let name = instruction.mnemonic.split('.').next().unwrap_or("");
    let one = |line: String| vec![line];
    match name {
        "b" | "bl" => one("b #-8".to_owned()),
        // The return stack knows where to.
        "bx" if operands == "lr" => one("b #-8".to_owned()),
        "bx" | "blx" => one(format!("bx {operands}")),
        "cbz" | "cbnz" => {
            let register = operands.split(',').next().unwrap_or("r0");
            one(format!("{name} {register}, #4"))
        }
        "tbb" | "tbh" => table_branch(operands),
        "vcmp" | "vcmpe" => one(comparison(operands)),
        "vmrs" => one(format!("vmov r12, {SCRATCH}")),
        "push" | "vpush" => several("str", "sp", operands),
        "pop" | "vpop" => several("ldr", "sp", operands),
        "ldm" | "ldmdb" | "ldmia" | "vldmia" | "vldmdb" => list("ldr", operands),
        "stm" | "stmdb" | "stmia" | "vstmia" | "vstmdb" => list("str", operands),
        _ if is_it(name) || UNMODELLED.contains(&name) || name.starts_with('<') => {
            one(FILLER.to_owned())
        }
        _ if CONDITIONS.contains(&name) => one("bne #-8".to_owned()),
        _ => one(format!("{} {operands}", instruction.mnemonic)),
    }
}

/// `s0, s1` or `s0, #0`
fn comparison(operands: &str) -> String {
    match operands.split_once(", ") {
        Some((a, b)) if !b.starts_with('#') => format!("vsub.f32 {SCRATCH}, {a}, {b}"),
        Some((a, _)) => format!("vneg.f32 {SCRATCH}, {a}"),
        None => FILLER.to_owned(),
    }
}

/// `[pc, r1]` or `[r0, r1, lsl #1]`: a load, and a branch to what it gave.
fn table_branch(operands: &str) -> Vec<String> {
    let index = operands.trim_matches(['[', ']']).split(", ").nth(1);
    let load = format!("ldrb r12, [sp, {}]", index.unwrap_or("r0"));
    vec![load, "bx r12".to_owned()]
}

/// `r0!, {r1, r2}`
fn list(verb: &str, operands: &str) -> Vec<String> {
    let (base, registers) = operands.split_once(", ").unwrap_or((operands, ""));
    several(verb, base.trim_end_matches('!'), registers)
}

/// One access for each register of `{r4, r5, pc}`; two words for one of the floating-point unit's.
fn several(verb: &str, base: &str, registers: &str) -> Vec<String> {
    let registers = registers
        .trim_matches(['{', '}'])
        .split(", ")
        .filter(|word| !word.is_empty());
    let mut lines = Vec::new();
    let mut returns = false;
    for (index, register) in registers.enumerate() {
        let offset = 4 * index;
        match register {
            "pc" => returns = true,
            _ if register.starts_with('d') || register.starts_with('s') && register != "sp" => {
                lines.push(format!("v{verb} {register}, [{base}, #{offset}]"));
            }
            _ => lines.push(format!("{verb} {register}, [{base}, #{offset}]")),
        }
    }
    if returns {
        lines.push(format!("ldr r12, [{base}]"));
        lines.push("b #-8".to_owned());
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lowered(mnemonic: &str, operands: &str) -> Vec<String> {
        lower(&Instruction {
            mnemonic: mnemonic.to_owned(),
            operands: operands.to_owned(),
        })
    }

    #[test]
    fn branches_lead_nowhere() {
        assert_eq!(lowered("bl", "0x4ca4 <memset>"), ["b #-8"]);
        assert_eq!(lowered("bhs.w", "0x4ca4 <f+0x2>"), ["bne #-8"]);
        assert_eq!(lowered("cbz", "r3, 0x4ca4 <f+0x2>"), ["cbz r3, #4"]);
        assert_eq!(lowered("tbb", "[pc, r1]"), ["ldrb r12, [sp, r1]", "bx r12"]);
        // Not a branch.
        assert_eq!(lowered("bic", "r0, r0, #1"), ["bic r0, r0, #1"]);
    }

    #[test]
    fn comparisons_are_subtractions() {
        assert_eq!(lowered("vcmp.f32", "s0, #0"), ["vneg.f32 s31, s0"]);
        assert_eq!(lowered("vcmpe.f32", "s0, s2"), ["vsub.f32 s31, s0, s2"]);
        assert_eq!(lowered("vmrs", "APSR_nzcv, fpscr"), ["vmov r12, s31"]);
    }

    #[test]
    fn several_registers_are_several_accesses() {
        assert_eq!(
            lowered("pop.w", "{r4, pc}"),
            ["ldr r4, [sp, #0]", "ldr r12, [sp]", "b #-8"]
        );
        assert_eq!(
            lowered("stm", "r0!, {r1, r2}"),
            ["str r1, [r0, #0]", "str r2, [r0, #4]"]
        );
        assert_eq!(lowered("vpush", "{d8}"), ["vstr d8, [sp, #0]"]);
    }
}
