//! Finds the branches between the functions of an ELF for the Cortex-M7. It decodes the Thumb code
//! without a disassembler.

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};

/// A branch from one function to the start of another, by their mangled names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Branch {
    /// Address of the branch.
    pub address: u64,
    /// The function that contains it.
    pub from: String,
    /// The functions at the branch's target: several names may share their code.
    pub to: Vec<String>,
}

/// The functions of an ELF: names and size by address.
type Functions = BTreeMap<u64, (Vec<String>, u64)>;

/// Returns every call and every jump from one function to another. Branches through registers are
/// not found.
///
/// # Errors
/// If the file is not an ELF, or has no symbols.
pub fn branches(elf: &[u8]) -> Result<Vec<Branch>> {
    let file = object::File::parse(elf)?;
    let mut functions = Functions::new();
    // The symbol `$t` begins code and `$d` begins data.
    let mut is_code = BTreeMap::new();
    for symbol in file.symbols() {
        let (name, address) = (symbol.name()?, symbol.address());
        match name.split('.').next() {
            Some("$t") => drop(is_code.insert(address, true)),
            Some("$d") => drop(is_code.insert(address, false)),
            _ if symbol.kind() == SymbolKind::Text && symbol.size() > 0 => {
                // Bit 0 of a function's address marks Thumb code.
                let entry = functions.entry(address & !1).or_default();
                entry.0.push(name.to_owned());
                entry.1 = symbol.size();
            }
            _ => {}
        }
    }
    let mut found = Vec::new();
    for section in file
        .sections()
        .filter(|section| section.kind() == SectionKind::Text)
    {
        let (start, bytes) = (section.address(), section.data()?);
        for (&address, (names, size)) in functions.range(start..start + bytes.len() as u64) {
            let from = names.first().context("a function without a name")?;
            let code = bytes.get((address - start) as usize..).unwrap_or_default();
            let code = &code[..code.len().min(*size as usize)];
            for (at, target) in targets(code, address, &is_code) {
                if let Some((to, _)) = functions.get(&target).filter(|_| target != address) {
                    let (from, to) = (from.clone(), to.clone());
                    found.push(Branch {
                        address: at,
                        from,
                        to,
                    });
                }
            }
        }
    }
    Ok(found)
}

/// Returns the addresses and targets of a function's branches.
fn targets(code: &[u8], start: u64, is_code: &BTreeMap<u64, bool>) -> Vec<(u64, u64)> {
    let half = |at: usize| {
        Some(u32::from(u16::from_le_bytes([
            *code.get(at)?,
            *code.get(at + 1)?,
        ])))
    };
    let (mut at, mut found) = (0, Vec::new());
    while let Some(first) = half(at) {
        let address = start + at as u64;
        let mark = is_code.range(..=address).next_back();
        if mark.is_some_and(|(_, is_code)| !is_code) {
            at += 2;
            continue;
        }
        // 11101, 11110 and 11111 begin instructions of two halfwords.
        let (offset, length) = match first >> 11 {
            0b11101..=0b11111 => (half(at + 2).and_then(|second| wide(first, second)), 4),
            _ => (narrow(first), 2),
        };
        found.extend(offset.map(|offset| (address, (address + 4).wrapping_add_signed(offset))));
        at += length;
    }
    found
}

/// Returns the offset of a branch of one halfword: conditional (T1), or not (T2). Returns `None` if
/// it is not a branch.
fn narrow(half: u32) -> Option<i64> {
    match (half >> 12, half >> 8 & 0xF) {
        (0b1101, 0..=13) => Some(signed(half & 0xFF, 8) << 1),
        _ if half >> 11 == 0b11100 => Some(signed(half & 0x7FF, 11) << 1),
        _ => None,
    }
}

/// Returns the offset of a branch of two halfwords: conditional (T3), B.W (T4), or BL. Returns
/// `None` if it is not a branch.
fn wide(first: u32, second: u32) -> Option<i64> {
    if first >> 11 != 0b11110 || second >> 15 != 1 {
        return None;
    }
    let (sign, j1, j2) = (first >> 10 & 1, second >> 13 & 1, second >> 11 & 1);
    let low = second & 0x7FF;
    match (second >> 14 & 1, second >> 12 & 1) {
        (0, 0) if first >> 6 & 0xF < 14 => {
            let bits = sign << 19 | j2 << 18 | j1 << 17 | (first & 0x3F) << 11 | low;
            Some(signed(bits, 20) << 1)
        }
        (_, 1) => {
            let [i1, i2] = [j1, j2].map(|j| 1 ^ j ^ sign);
            let bits = sign << 23 | i1 << 22 | i2 << 21 | (first & 0x3FF) << 11 | low;
            Some(signed(bits, 24) << 1)
        }
        _ => None,
    }
}

/// Returns a signed number of this many bits.
fn signed(bits: u32, count: u32) -> i64 {
    i64::from((bits << (32 - count)) as i32 >> (32 - count))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn led_to(halves: &[u16]) -> Vec<(u64, u64)> {
        let code: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        targets(&code, 0x1000, &BTreeMap::new())
    }

    /// The expected encodings are those of `llvm-mc`.
    #[test]
    fn branches_lead_where_they_do() {
        assert_eq!(led_to(&[0xE7FE]), [(0x1000, 0x1000)], "b .");
        assert_eq!(
            led_to(&[0xBF00, 0xD0FD]),
            [(0x1002, 0x1000)],
            "nop; beq 0x1000"
        );
        assert_eq!(led_to(&[0xF7FF, 0xFFFE]), [(0x1000, 0x1000)], "bl .");
        assert_eq!(led_to(&[0xF000, 0xF800]), [(0x1000, 0x1004)], "bl .+4");
        assert_eq!(led_to(&[0xF000, 0xB880]), [(0x1000, 0x1104)], "b.w .+0x104");
        assert_eq!(led_to(&[0xF47F, 0xAFFE]), [(0x1000, 0x1000)], "bne.w .");
        assert_eq!(led_to(&[0x4770, 0xF3BF, 0x8F4F]), [], "bx lr; dsb");
    }
}
