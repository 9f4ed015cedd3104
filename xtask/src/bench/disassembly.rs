//! The image's instructions as text, by LLVM's disassembler.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::process;

/// One instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// Without a condition: an instruction that an `it` makes conditional takes its slot either
    /// way.
    pub mnemonic: String,
    /// What follows it, without comments.
    pub operands: String,
}

/// The instructions by their addresses.
pub type Disassembly = BTreeMap<u64, Instruction>;

/// Disassembles an ELF.
///
/// # Errors
/// When `llvm-objdump` cannot be run.
pub fn disassemble(image: &Path) -> Result<Disassembly> {
    let mut command = Command::new("llvm-objdump");
    command.args(["--disassemble", "--no-show-raw-insn", "--mcpu=cortex-m7"]);
    Ok(parse(&process::output(command.arg(image))?))
}

fn parse(text: &str) -> Disassembly {
    let mut conditional = 0;
    let instructions = text.lines().filter_map(|line| {
        let (address, mut instruction) = instruction(line)?;
        if conditional > 0 {
            conditional -= 1;
            instruction.mnemonic = without_condition(&instruction.mnemonic);
        } else if is_it(&instruction.mnemonic) {
            conditional = instruction.mnemonic.len() - 1;
        }
        Some((address, instruction))
    });
    instructions.collect()
}

/// An address, a colon, the mnemonic and the operands, separated by tabs.
fn instruction(line: &str) -> Option<(u64, Instruction)> {
    let (address, rest) = line.split_once(':')?;
    let address = u64::from_str_radix(address.trim(), 16).ok()?;
    let rest = rest.trim();
    let (mnemonic, operands) = rest.split_once(['\t', ' ']).unwrap_or((rest, ""));
    let operands = operands.split('@').next().unwrap_or("").trim();
    (!mnemonic.is_empty()).then(|| {
        (
            address,
            Instruction {
                mnemonic: mnemonic.to_owned(),
                operands: operands.to_owned(),
            },
        )
    })
}

/// `it`, `ite`, `itett` …: as many conditional instructions follow as it has letters after the
/// first.
pub fn is_it(mnemonic: &str) -> bool {
    let rest = mnemonic.strip_prefix("it");
    rest.is_some_and(|rest| rest.chars().all(|c| c == 't' || c == 'e'))
}

fn without_condition(mnemonic: &str) -> String {
    let (name, width) = mnemonic.split_once('.').unwrap_or((mnemonic, ""));
    let name = &name[..name.len().saturating_sub(2)];
    if width.is_empty() {
        name.to_owned()
    } else {
        format!("{name}.{width}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\nhivtac-qemu-image:\tfile format elf32-littlearm\n\n\
        00000400 <push_row>:\n     400:      \tite\tlo\n     402:      \tmovlo\tr0, #1\n\
             \x20    404:      \tldrhs.w\tr1, [pc, #16]          @ 0x418 \
             <push_row+0x18>\n     408:      \tbx\tlr\n";

    fn instruction(mnemonic: &str, operands: &str) -> Instruction {
        Instruction {
            mnemonic: mnemonic.to_owned(),
            operands: operands.to_owned(),
        }
    }

    #[test]
    fn conditions_and_comments_are_left_out() {
        let expected = [
            (0x400, instruction("ite", "lo")),
            (0x402, instruction("mov", "r0, #1")),
            (0x404, instruction("ldr.w", "r1, [pc, #16]")),
            (0x408, instruction("bx", "lr")),
        ];
        assert_eq!(parse(TEXT), Disassembly::from(expected));
    }

    #[test]
    fn conditional_blocks_are_recognized() {
        assert!(is_it("it") && is_it("itttt") && is_it("ite"));
        assert!(!is_it("isb") && !is_it("item"));
    }
}
