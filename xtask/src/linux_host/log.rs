//! What the kernel's log may say.

/// The lowest urgency that is a warning (`KERN_WARNING`); lower numbers are more urgent.
const WARNING: u32 = 4;

/// Lines that Linux prints whatever the device does, and why.
const EXPECTED: [(&str, &str); 2] = [
    (
        "vhci_hcd: vhci_device speed not set",
        "the driver of USB/IP has no name for full speed when it resets a port",
    ),
    (
        "clocksource: ",
        "the emulated PC stands still while its process waits for a processor",
    ),
];

/// The warnings in a kernel's log of lines `<URGENCY>[TIME] TEXT`, but for the expected ones.
pub fn warnings(log: &str) -> Vec<&str> {
    let is_warning = |line: &&str| {
        let urgency = line.strip_prefix('<').and_then(|rest| rest.split_once('>'));
        // A line without one goes on with the line before it, whose urgency counts.
        let urgency = urgency.and_then(|(number, _)| number.parse::<u32>().ok());
        urgency.is_some_and(|number| number & 7 <= WARNING)
    };
    let is_expected = |line: &&str| EXPECTED.iter().any(|(text, _)| line.contains(text));
    let lines = log.lines().filter(is_warning);
    lines.filter(|line| !is_expected(line)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_are_found_but_for_expected_ones() {
        let log = "<6>[    1.0] usb 1-1: new full-speed USB device number 2 using vhci_hcd\n\
                   <3>[    1.1] vhci_hcd: vhci_device speed not set\n\
                   <4>[    1.2] cdc_acm 1-1:1.0: no reply\n\
                   a line that goes on\n\
                   <27>[    1.3] usb 1-1: device descriptor read/64, error -110\n";
        let found = warnings(log);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].contains("no reply") && found[1].contains("error -110"));
    }
}
