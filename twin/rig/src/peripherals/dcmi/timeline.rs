//! The sequence of the sensor's signals: the next step and its time.

use rigless::device::{DeviceContext, Level, RegisterFile};
use rigless::time::{EventId, VirtualNanos};

use super::receiver::control;
use super::signals::{Frame, Run};
use super::{Dcmi, GROUP, flag};
use crate::camera::output::Output;

/// The sensor's next step.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step {
    /// VSYNC goes to its active level: a frame begins.
    VsyncBegins,
    /// VSYNC goes back to its idle level.
    VsyncEnds,
    /// Bytes arrive.
    Bytes(Bytes),
    /// A silent sensor may start to send again.
    Retry,
}

/// Some of a run's bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bytes {
    pub run: Run,
    pub from: u32,
    pub to: u32,
}

/// The planned step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Next {
    pub step: Step,
    pub at: VirtualNanos,
    pub event: EventId,
}

/// The origin from which frame starts are counted, to avoid drift.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Epoch {
    at_ns: u64,
    clock_hz: u64,
    clocks: u64,
}

impl Dcmi {
    /// Restarts the sensor's frame timing: after power-up, a new clock, a register reset.
    pub fn start_over(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let now = context.now().0;
        self.next = None;
        self.epoch = Epoch::default();
        let frame = self.frame.take();
        let active_high = frame.is_some_and(|frame| frame.output.vsync_active_high);
        if active_high && self.vsync == Level::High {
            // VSYNC was at its active level. Its fall is an edge like any other.
            self.camera.lock().count_edge(now);
        }
        self.set_vsync(Level::Low, registers, context);
        self.camera.lock().restart();
        let (output, fault) = {
            let camera = self.camera.lock();
            (camera.output(now), camera.next_fault(now))
        };
        match (output, fault) {
            (Some(output), _) => self.plan(
                Step::VsyncBegins,
                now + output.clocks_ns(output.frame_clocks()),
                context,
            ),
            (None, Some(at)) => self.plan(Step::Retry, at, context),
            (None, None) => {}
        }
    }

    /// Schedules the next step again: a reset dropped the events of this slot, but does not affect
    /// the sensor.
    pub fn reschedule(&mut self, context: &mut DeviceContext<'_>) {
        if let Some(next) = &mut self.next {
            next.event = context.schedule(next.at);
        }
    }

    pub(super) fn plan(&mut self, step: Step, at_ns: u64, context: &mut DeviceContext<'_>) {
        let at = VirtualNanos(at_ns);
        self.next = Some(Next {
            step,
            at,
            event: context.schedule(at),
        });
    }

    /// Plans the steps from the beginning of a line on.
    pub(super) fn plan_from(&mut self, line: u32, context: &mut DeviceContext<'_>) {
        let Some(frame) = &self.frame else { return };
        let vsync_lines = frame.output.vsync_lines;
        let end = if line < vsync_lines {
            vsync_lines
        } else {
            frame.output.lines
        };
        let run = if self.listens() {
            frame.run_from(line, end, self.inverted(&frame.output))
        } else {
            None
        };
        match run {
            Some(run) => self.plan_group(run, 0, context),
            None if line < vsync_lines => {
                let at = frame.instant(vsync_lines, 0);
                self.plan(Step::VsyncEnds, at, context);
            }
            None => {
                let clocks = self.epoch.clocks + frame.output.frame_clocks();
                let at = self.epoch.at_ns + frame.output.clocks_ns(clocks);
                self.epoch.clocks = clocks;
                self.plan(Step::VsyncBegins, at, context);
            }
        }
    }

    pub(super) fn plan_group(&mut self, run: Run, from: u32, context: &mut DeviceContext<'_>) {
        self.plan_bytes(run, from, (from + GROUP).min(run.bytes), context);
    }

    /// Plans the arrival of bytes, at the time when the last of them is on the lines.
    pub(super) fn plan_bytes(
        &mut self,
        run: Run,
        from: u32,
        to: u32,
        context: &mut DeviceContext<'_>,
    ) {
        let Some(frame) = &self.frame else { return };
        let at = frame.instant(run.line, run.start + to);
        self.plan(Step::Bytes(Bytes { run, from, to }), at, context);
    }

    /// Returns whether the data lines have any effect now.
    pub(super) fn listens(&self) -> bool {
        let wanted = self.receiver.capturing() || self.enabled & flag::LINE != 0;
        wanted && self.settings.has(control::ENABLE) && self.pins.clock && self.pins.hsync
    }

    /// Returns whether HREF's idle level is taken for data.
    pub(super) fn inverted(&self, output: &Output) -> bool {
        output.href_active_high == self.settings.has(control::HSYNC_BLANKS_HIGH)
    }

    pub(super) fn begin_frame(
        &mut self,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let now = context.now().0;
        let Some(output) = self.camera.lock().output(now) else {
            return self.start_over(registers, context);
        };
        self.camera.lock().complain(&output);
        if output.pixel_clock_hz != self.epoch.clock_hz {
            self.epoch = Epoch {
                at_ns: now,
                clock_hz: output.pixel_clock_hz,
                clocks: 0,
            };
        }
        let level = Level::from(output.vsync_active_high);
        self.frame = Some(Frame::new(now, output));
        self.set_vsync(level, registers, context);
        self.plan_from(0, context);
    }

    pub(super) fn end_vsync(
        &mut self,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let exposed = self.camera.lock().count_edge(context.now().0);
        let Some(frame) = &mut self.frame else { return };
        frame.exposed = Some(exposed);
        let level = Level::from(!frame.output.vsync_active_high);
        let vsync_lines = frame.output.vsync_lines;
        self.set_vsync(level, registers, context);
        self.camera.lock().log_truth(exposed);
        self.plan_from(vsync_lines, context);
    }
}
