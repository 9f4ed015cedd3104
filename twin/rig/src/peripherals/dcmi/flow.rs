//! The way of a line's bytes into the FIFO: in groups of one FIFO's worth, each at the instant at
//! which its last byte is on the lines.
//!
//! Every event stops the core. To save events, the rest of a line after its second group is one
//! event, at the line's end. This needs a DMA that took each word of the line's first group at
//! once. The groups then follow each other as the FIFO is emptied. All effects at a line's
//! beginning or end keep their times: interrupts of the interface, and of a DMA whose blocks are
//! whole lines. So does the answer to whether a counter has moved since the last block. A write to
//! the interface within the line finds the bytes that have come by then, and the rest comes in
//! groups.
//!
//! Differences from the chip: memory that is read within a line has less of it. If the DMA is
//! stopped within a line, the overrun comes at the line's end. If the sensor starts over within a
//! line, the rest of that line is lost.
//!
//! A fault that disturbs the camera or the DMA within a line keeps that line in groups. A busy bus
//! does the same to all lines of a run in which it is ever busy.

use rigless::device::{DeviceContext, Level, RegisterFile};

use super::receiver::Overrun;
use super::signals::{Run, sampled_while_changing};
use super::timeline::{Bytes, Step};
use super::{Dcmi, GROUP, LONGEST_LAST_WAIT_NS, LONGEST_WAIT_NS, control, flag};
use crate::faults::Kind;

impl Dcmi {
    pub(super) fn bytes(
        &mut self,
        bytes: Bytes,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        // The first group left at once.
        let flows = bytes.from == GROUP
            && self.receiver.waiting() == 0
            && !self.is_disturbed(&bytes.run, context.now().0);
        let is_rest = bytes.to - bytes.from > GROUP;
        self.receive_group(bytes);
        if is_rest && self.feed.lock().is_ready {
            self.hand_over(context);
        } else {
            self.receive_due();
        }
        let (Bytes { run, to, .. }, now) = (bytes, context.now().0);
        match self.early_vsync(&run, now).filter(|_| to == run.bytes) {
            Some(level) => {
                self.wait_for_the_bus(LONGEST_LAST_WAIT_NS, context);
                self.set_vsync(level, registers, context);
            }
            None if self.faults.on(Kind::BusBusy, now) => {
                self.wait_for_the_bus(LONGEST_WAIT_NS, context);
            }
            None => {}
        }
        self.drive(context);
        if to == run.bytes || !self.listens() {
            self.plan_from(run.line + 1, context);
        } else if flows {
            self.plan_bytes(run, to, run.bytes, context);
        } else {
            self.plan_group(run, to, context);
        }
    }

    /// Receives all due bytes and hands their words to the DMA, which takes them with one request.
    fn hand_over(&mut self, context: &mut DeviceContext<'_>) {
        let mut words = Vec::new();
        loop {
            while self.receiver.waiting() > 0 {
                words.push(self.receiver.take());
            }
            if self.due.is_none() {
                break;
            }
            self.receive_due();
        }
        self.feed.lock().words.extend(words);
        context.request(0, Level::High);
        context.request(0, Level::Low);
    }

    /// Returns VSYNC's active level if it comes at the end of a run: the frame's last one, under
    /// [`Kind::VsyncEarly`].
    fn early_vsync(&self, run: &Run, now_ns: u64) -> Option<Level> {
        let output = &self.frame.as_ref()?.output;
        let is_last = run.row.is_some_and(|row| row + 1 == output.rows);
        (is_last && self.faults.on(Kind::VsyncEarly, now_ns))
            .then(|| Level::from(output.vsync_active_high))
    }

    /// Returns whether a fault may delay words of a run or end it early.
    fn is_disturbed(&self, run: &Run, now_ns: u64) -> bool {
        let Some(frame) = &self.frame else {
            return true;
        };
        let end_ns = frame.instant(run.line, run.start + run.bytes);
        let disturbing = [Kind::DcmiOverrun, Kind::CameraAbsent, Kind::CameraSilent];
        let disturbs = |kind| {
            let change = self.faults.next_change(kind, now_ns);
            self.faults.on(kind, now_ns) || change.is_some_and(|at| at <= end_ns)
        };
        self.faults.asked_for(Kind::BusBusy)
            || self.early_vsync(run, now_ns).is_some()
            || disturbing.into_iter().any(disturbs)
    }

    /// Receives the due bytes up to the next word that has to leave first.
    pub(super) fn receive_due(&mut self) {
        while let Some(due) = self.due.take_if(|_| self.receiver.waiting() == 0) {
            self.receive_group(due);
        }
    }

    /// Receives all due bytes, although words wait.
    pub(super) fn receive_all_due(&mut self) {
        while let Some(due) = self.due.take() {
            self.receive_group(due);
        }
    }

    /// Receives the first group of the due bytes; the rest stays due.
    fn receive_group(&mut self, Bytes { run, from, to }: Bytes) {
        let group = (from + GROUP).min(to);
        let waiting = self.receiver.waiting();
        let ends = group == run.bytes && run.ends_line;
        if self.receive(&run, from, group, ends).is_err() {
            self.raised |= flag::OVERRUN;
            self.counters.overruns += 1;
            if !self.listens() {
                return;
            }
        } else {
            self.counters.words += (self.receiver.waiting() - waiting) as u64;
        }
        if ends {
            self.raised |= flag::LINE;
        }
        let from = group;
        self.due = (group < to).then_some(Bytes { run, from, to });
    }

    /// Prepares for an access to the interface within a line that arrives as one event. The bytes
    /// until now are received, and the rest arrives in groups.
    pub(super) fn catch_up(&mut self, context: &mut DeviceContext<'_>) {
        let (Some(next), Some(frame)) = (self.next, &self.frame) else {
            return;
        };
        let Step::Bytes(Bytes { run, from, to }) = next.step else {
            return;
        };
        if to - from <= GROUP {
            return;
        }
        let now = context.now().0;
        let came = |until: u32| frame.instant(run.line, run.start + until) <= now;
        let groups = (from..to).step_by(GROUP as usize).skip(1);
        let until = groups.take_while(|&until| came(until)).last();
        if let Some(to) = until {
            self.due = Some(Bytes { run, from, to });
            self.receive_due();
        }
        self.plan_group(run, until.unwrap_or(from), context);
    }

    fn receive(&mut self, run: &Run, from: u32, to: u32, ends: bool) -> Result<(), Overrun> {
        let Some(frame) = &mut self.frame else {
            return Ok(());
        };
        let at_stable_edge = frame.output.stable_at_rising == self.settings.has(control::RISING);
        let base = u64::from(run.line) << 32;
        let picture = |exposed| self.camera.lock().picture(exposed);
        let bytes = frame.bytes(run, from, to, picture);
        for (i, byte) in (from..to).zip(bytes) {
            let sampled = if at_stable_edge {
                byte
            } else {
                sampled_while_changing(self.last_byte, byte, base + u64::from(i))
            };
            self.last_byte = byte;
            self.receiver
                .byte(sampled & self.pins.data, &self.settings)?;
        }
        if ends {
            self.receiver.end_line()?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, SharedCamera, Supply, part};
    use crate::faults::Faults;
    use crate::frame_source::TestPicture;
    use crate::peripherals::dcmi::Pins;
    use crate::peripherals::dma::Feed;
    use crate::rules::Rules;
    use crate::truth::TruthLog;
    use rigless::device::Device;
    use rigless::mcu::Mcu;
    use rigless::soc::stm32h743::Stm32h743;
    use rigless::soc::stm32h743::generated::dcmi::Register;
    use rigless::time::VirtualNanos;

    /// A part, its camera interface during a capture, and the words that a DMA took from it.
    struct Bench {
        part: Stm32h743,
        slot: usize,
        dcmi: Dcmi,
        feed: Feed,
        words: Vec<u32>,
    }

    impl Bench {
        fn new() -> Bench {
            let (faults, rules) = (Faults::default(), Rules::default());
            let camera = SharedCamera::new(Camera::new(
                part::Kind::Ov7725,
                Box::new(TestPicture),
                TruthLog::default(),
                faults.clone(),
                rules.clone(),
                1,
            ));
            camera.lock().supply(Supply {
                powered: true,
                clock_hz: 24_000_000,
                sccb: true,
                reset: false,
            });
            let part = Stm32h743::new().unwrap();
            let slot = part.bus().slot("DCMI").unwrap();
            let feed = Feed::default();
            let mut dcmi = Dcmi::new(camera, faults, rules, feed.clone(), 1);
            let pins = Pins {
                data: 0xFF,
                clock: true,
                hsync: true,
                vsync: true,
            };
            dcmi.wire(pins, 240_000_000);
            let mut bench = Bench {
                part,
                slot,
                dcmi,
                feed,
                words: Vec::new(),
            };
            let polarities = control::RISING | control::VSYNC_BLANKS_HIGH;
            let capture = control::ENABLE | control::CAPTURE | polarities;
            bench.write(0, Register::Cr, capture);
            let (registers, mut context) = bench.part.bus_mut().drive(VirtualNanos(0), slot);
            bench.dcmi.start_over(registers, &mut context);
            bench
        }

        fn write(&mut self, at_ns: u64, register: Register, value: u32) {
            let (registers, mut context) =
                (self.part.bus_mut()).drive(VirtualNanos(at_ns), self.slot);
            registers.set(register, value.into());
            Device::write(
                &mut self.dcmi,
                register,
                value.into(),
                registers,
                &mut context,
            );
        }

        /// Runs the next step, and lets the DMA take words while there are any.
        fn step(&mut self) {
            let next = self.dcmi.next.expect("the camera goes on");
            let (registers, mut context) = self.part.bus_mut().drive(next.at, self.slot);
            self.dcmi.on_event(next.event, registers, &mut context);
            self.take(next.at);
        }

        fn take(&mut self, at: VirtualNanos) {
            while self.dcmi.receiver.waiting() > 0 {
                let (registers, mut context) = self.part.bus_mut().drive(at, self.slot);
                let word = Device::read(&mut self.dcmi, Register::Dr, registers, &mut context);
                self.words.push(word.expect("a word") as u32);
            }
        }

        /// Returns the bytes that arrive next; `None` if the next step is another.
        fn coming(&self) -> Option<Bytes> {
            match self.dcmi.next?.step {
                Step::Bytes(bytes) => Some(bytes),
                _ => None,
            }
        }

        /// Runs until the rest of a line is planned as one event.
        fn until_the_rest_of_a_line(&mut self) -> Bytes {
            for _ in 0..1_000 {
                if let Some(bytes) = self.coming().filter(|it| it.to - it.from > GROUP) {
                    return bytes;
                }
                self.step();
            }
            panic!("every line arrives in groups");
        }

        /// Returns the instant, ns, at which this many bytes of the next run are on the lines.
        fn instant(&self, until: u32) -> u64 {
            let run = self.coming().expect("bytes").run;
            let frame = self.dcmi.frame.as_ref().expect("a frame");
            frame.instant(run.line, run.start + until)
        }
    }

    #[test]
    fn a_line_that_flows_arrives_in_three_steps() {
        let mut bench = Bench::new();
        let rest = bench.until_the_rest_of_a_line();
        assert_eq!((rest.from, rest.to), (2 * GROUP, rest.run.bytes));
        assert_eq!(bench.words.len() as u32 * 4, rest.from);
        bench.step();
        assert_eq!(bench.words.len() as u32 * 4, rest.run.bytes);
        assert_eq!(bench.dcmi.counters.overruns, 0);
    }

    /// A DMA that runs gets the same words at once.
    #[test]
    fn the_rest_of_a_line_is_handed_over() {
        let [mut bench, mut word_by_word] = [Bench::new(), Bench::new()];
        bench.until_the_rest_of_a_line();
        bench.feed.lock().is_ready = true;
        bench.step();
        bench.words.append(&mut bench.feed.lock().words);
        word_by_word.until_the_rest_of_a_line();
        word_by_word.step();
        assert_eq!(bench.words, word_by_word.words);
        assert_eq!(bench.dcmi.counters, word_by_word.dcmi.counters);
        assert_eq!(bench.dcmi.receiver.waiting(), 0);
    }

    /// The bytes on the lines by then are received, the rest comes in groups, and the total is the
    /// same.
    #[test]
    fn a_write_amid_a_line_finds_what_has_come_and_loses_nothing() {
        let [mut bench, mut undisturbed] = [Bench::new(), Bench::new()];
        let rest = bench.until_the_rest_of_a_line();
        undisturbed.until_the_rest_of_a_line();
        let until = rest.from + 5 * GROUP;
        let at = bench.instant(until) + 1;
        bench.write(at, Register::Ier, 0);
        bench.take(VirtualNanos(at));
        assert_eq!(bench.words.len() as u32 * 4, until);
        let coming = bench.coming().expect("the next group");
        assert_eq!((coming.from, coming.to), (until, until + GROUP));
        while bench.words.len() as u32 * 4 < rest.run.bytes {
            bench.step();
        }
        undisturbed.step();
        assert_eq!(bench.words, undisturbed.words);
        assert_eq!(bench.dcmi.counters, undisturbed.dcmi.counters);
        assert_eq!(
            bench.dcmi.next.map(|next| next.at),
            undisturbed.dcmi.next.map(|next| next.at)
        );
    }

    /// The interface signals the end of the frame before its last words are taken.
    #[test]
    fn an_early_vsync_comes_with_the_last_byte() {
        let mut bench = Bench::new();
        bench.dcmi.faults = Faults::new(vec!["vsync-early".parse().unwrap()]);
        let is_last = |bench: &Bench| {
            let Some(Bytes { run, to, .. }) = bench.coming() else {
                return false;
            };
            to == run.bytes && bench.dcmi.early_vsync(&run, 0).is_some()
        };
        while !is_last(&bench) {
            bench.step();
        }
        let next = bench.dcmi.next.expect("the last bytes");
        let (registers, mut context) = bench.part.bus_mut().drive(next.at, bench.slot);
        bench.dcmi.on_event(next.event, registers, &mut context);
        assert_eq!(bench.dcmi.vsync, Level::High);
        assert_ne!(bench.dcmi.raised & flag::FRAME, 0);
        assert_eq!(bench.dcmi.receiver.waiting() as u32 * 4, GROUP);
        assert!(bench.dcmi.bus.is_some() && !bench.dcmi.requested);
    }

    /// A DMA that stops within a line costs the frame, at the latest when the next line begins.
    #[test]
    fn words_that_nobody_takes_overrun() {
        let mut bench = Bench::new();
        bench.until_the_rest_of_a_line();
        for _ in 0..2 {
            let next = bench.dcmi.next.expect("the camera goes on");
            let (registers, mut context) = bench.part.bus_mut().drive(next.at, bench.slot);
            bench.dcmi.on_event(next.event, registers, &mut context);
        }
        assert_eq!(bench.dcmi.counters.overruns, 1);
        assert!(!bench.dcmi.receiver.capturing());
    }
}
