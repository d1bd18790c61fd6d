//! The board: the firmware of `assets/firmware/due_gripper/gripper_logic.h`, compiled into the emulator (`firmware.c`).

#![expect(unsafe_code, reason = "the firmware is C; every call into it stands in this file")]

use std::ffi::{c_char, c_void};

/// Hundredths of a bar in a step of the control box.
const STEP_CENTIBAR: u32 = 5;

/// How a board is wired and set.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BoardSetup {
    /// From sample to sample (µs): 20000 is 50 Hz.
    pub(super) period_us: u32,
    /// Names of the channels, in order; at most 8, of at most 15 bytes.
    pub(super) channels: Vec<String>,
    /// Fixed resistor of each channel's divider (ohm).
    pub(super) divider_ohm: Vec<u32>,
    /// Bits of the converter.
    pub(super) bits: u8,
    /// Highest pressure, in steps of 0.05 bar; 0 where no control box is wired.
    pub(super) most_steps: u8,
}

/// A board that runs the firmware.
#[derive(Debug)]
pub(super) struct FirmwareBoard {
    /// An `EmulatedBoard` of `firmware.c`, which points into itself: it stays where it is.
    memory: Box<[u64]>,
}

/// What the firmware calls while it runs: `EmulatedPins` of `firmware.c`.
#[repr(C)]
struct Pins {
    context: *mut c_void,
    convert: extern "C" fn(*mut c_void, u8) -> u16,
    put_pressure: extern "C" fn(*mut c_void, u8),
    print: extern "C" fn(*mut c_void, *const c_char, usize),
}

/// The context of [`Pins`] during one call.
struct Call<'a> {
    convert: &'a mut dyn FnMut(usize) -> u32,
    printed: &'a mut String,
    /// Pressures that were put out, in steps.
    pressures: Vec<u8>,
}

/// `EmulatedBoard` of `firmware.c`.
#[repr(C)]
struct Board {
    _private: [u8; 0],
}

unsafe extern "C" {
    fn palpate_firmware_size() -> usize;
    fn palpate_firmware_wire(
        board: *mut Board,
        period_us: u32,
        channels: u8,
        names: *const c_char,
        divider_ohm: *const u32,
        bits: u8,
        most_steps: u8,
    ) -> u8;
    fn palpate_firmware_begin(board: *mut Board, pins: *const Pins, now_us: u32);
    fn palpate_firmware_hear(board: *mut Board, pins: *const Pins, byte: u8, now_us: u32);
    #[cfg(test)]
    fn palpate_firmware_watch(board: *mut Board, pins: *const Pins, now_us: u32);
    fn palpate_firmware_poll(board: *mut Board, pins: *const Pins, now_us: u32);
    fn palpate_firmware_set_by_hand(board: *mut Board, steps: u8, now_us: u32);
    fn palpate_firmware_line_steps(board: *const Board) -> u8;
    fn palpate_firmware_next_us(board: *const Board) -> u32;
}

/// The call that a context belongs to.
///
/// # Safety
///
/// `context` must be that of the [`Pins`] made by [`FirmwareBoard::run`], which is still running.
unsafe fn call<'a>(context: *mut c_void) -> &'a mut Call<'a> {
    // SAFETY: `run` lends its `Call` to the firmware through this pointer and does not touch it meanwhile.
    unsafe { &mut *context.cast() }
}

extern "C" fn convert(context: *mut c_void, channel: u8) -> u16 {
    // SAFETY: the firmware hands back the context that `run` gave it.
    let call = unsafe { call(context) };
    (call.convert)(usize::from(channel)) as u16
}

extern "C" fn put_pressure(context: *mut c_void, steps: u8) {
    // SAFETY: the firmware hands back the context that `run` gave it.
    unsafe { call(context) }.pressures.push(steps);
}

extern "C" fn print(context: *mut c_void, text: *const c_char, length: usize) {
    // SAFETY: the firmware hands back the context that `run` gave it, and a text of that length.
    let (call, text) = unsafe { (call(context), std::slice::from_raw_parts(text.cast::<u8>(), length)) };
    call.printed.push_str(&String::from_utf8_lossy(text));
}

impl FirmwareBoard {
    /// Starts it at a time of its clock (µs): it vents, prints its handshake, and takes the first sample now.
    /// Panics where the setup does not fit the firmware.
    pub(super) fn begin(setup: &BoardSetup, now_us: u32, out: &mut String) -> Self {
        let BoardSetup { period_us, channels, divider_ohm, bits, most_steps } = setup;
        assert!(divider_ohm.len() == channels.len(), "a resistor for each channel");
        let names: Vec<u8> =
            channels.iter().flat_map(|name| name.bytes().filter(|byte| *byte > 0).chain([0])).collect();
        // SAFETY: it takes nothing and only says a size.
        let bytes = unsafe { palpate_firmware_size() };
        let mut board = Self { memory: vec![0; bytes.div_ceil(size_of::<u64>())].into() };
        let channels = u8::try_from(channels.len()).unwrap_or(u8::MAX);
        // SAFETY: the memory is large enough, aligned and zero, which is an `EmulatedBoard` without a setup; `names` holds
        // a text that ends in a zero for each channel, and `divider_ohm` a number for each.
        let fits = unsafe {
            let (names, ohm) = (names.as_ptr().cast(), divider_ohm.as_ptr());
            palpate_firmware_wire(board.pointer(), *period_us, channels, names, ohm, *bits, *most_steps)
        };
        assert!(fits == 1, "the firmware has no room for {setup:?}");
        // SAFETY: `run` gives valid pointers.
        board.run(&mut |_| 0, out, |board, pins| unsafe { palpate_firmware_begin(board, pins, now_us) });
        board
    }

    /// Pressure that is on (bar).
    pub(super) fn line_bar(&self) -> f64 {
        // SAFETY: the memory holds a board that was wired.
        let steps = unsafe { palpate_firmware_line_steps(self.memory.as_ptr().cast()) };
        f64::from(u32::from(steps) * STEP_CENTIBAR) / 100.0
    }

    /// When its next sample is due, on its clock (µs).
    pub(super) fn next_us(&self) -> u32 {
        // SAFETY: the memory holds a board that was wired.
        unsafe { palpate_firmware_next_us(self.memory.as_ptr().cast()) }
    }

    /// Sets the pressure by hand at the control box, in steps of 0.05 bar: the watchdog leaves it for the next second.
    pub(super) fn set_by_hand(&mut self, steps: u8, now_us: u32) {
        // SAFETY: the memory holds a board that was wired.
        unsafe { palpate_firmware_set_by_hand(self.pointer(), steps, now_us) }
    }

    /// Takes one byte from the host; true when a pressure was set by it.
    pub(super) fn hear(&mut self, byte: u8, now_us: u32, out: &mut String) -> bool {
        // SAFETY: `run` gives valid pointers.
        let receive = |board, pins| unsafe { palpate_firmware_hear(board, pins, byte, now_us) };
        !self.run(&mut |_| 0, out, receive).is_empty()
    }

    /// Samples when one is due, vents when the host has gone silent. `convert` makes one conversion of a channel.
    pub(super) fn poll(&mut self, now_us: u32, convert: &mut dyn FnMut(usize) -> u32, out: &mut String) {
        // SAFETY: `run` gives valid pointers.
        self.run(convert, out, |board, pins| unsafe { palpate_firmware_poll(board, pins, now_us) });
    }

    /// Lets the watchdog's timer come round while the loop is stuck.
    #[cfg(test)]
    pub(super) fn watch(&mut self, now_us: u32, out: &mut String) {
        // SAFETY: `run` gives valid pointers.
        self.run(&mut |_| 0, out, |board, pins| unsafe { palpate_firmware_watch(board, pins, now_us) });
    }

    fn pointer(&mut self) -> *mut Board {
        self.memory.as_mut_ptr().cast()
    }

    /// Runs a function of the firmware on this board; the pressures that it put out, in steps.
    fn run(
        &mut self,
        convert_one: &mut dyn FnMut(usize) -> u32,
        printed: &mut String,
        function: impl FnOnce(*mut Board, *const Pins),
    ) -> Vec<u8> {
        let mut call = Call { convert: convert_one, printed, pressures: Vec::new() };
        let pins = Pins { context: (&raw mut call).cast(), convert, put_pressure, print };
        function(self.pointer(), &raw const pins);
        call.pressures
    }
}
