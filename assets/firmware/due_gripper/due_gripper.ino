/* Palpate's firmware for an Arduino Due: two flex strips, two force pads or the channels of another gripper, and, where it takes one, the line pressure of the
 * control box. Wiring: README.md. Logic: gripper_logic.h; here are only the pins. */

#include "gripper_logic.h"

/* SerialUSB is the native port (USB 2341:003e), which does not reset the board when it is opened. Serial is the
 * programming port (2341:003d) at 115200 baud. */
#ifndef HOST
#define HOST SerialUSB
#endif

/* Highest line pressure, in steps of 0.05 bar: 20 is 1.0 bar. 0 when no control box is wired; the board then refuses
 * pressure commands. Never above the limit of the fingers: 30 is 1.5 bar. */
#ifndef MOST_STEPS
#define MOST_STEPS 0
#endif

/* Analogue output to the control box, 0.55 V to 2.75 V over 0 to 1.5 bar. DAC0 cannot reach 0 V: the box must take
 * 0.55 V as no pressure. With a box that takes 0 to 10 V, amplify and shift by an op-amp. */
#define PRESSURE_PIN DAC0
#define STEPS_AT_FULL_SCALE 30
#if MOST_STEPS > STEPS_AT_FULL_SCALE
#error "MOST_STEPS is above 30, which is 1.5 bar: beyond the limit of the fingers, and of the converter"
#endif

/* The chip restarts when its core has stood still for so long. Longer than GRIPPER_WATCHDOG_US, so that a print that waits
 * for a host which hangs costs the pressure, not the connection. */
#define CHIP_WATCHDOG_MS 2000
#if MOST_STEPS > 0 && defined(ARDUINO_ARCH_SAM)
#define CHIP_WATCHDOG
#endif

/* Channels of another gripper: palpate doctor --gripper FILE.toml --firmware-header > gripper_channels.h, beside this file. */
#if defined(__has_include)
#if __has_include("gripper_channels.h")
#include "gripper_channels.h"
#endif
#endif
#ifndef CHANNELS
#define CHANNELS 4
static const uint8_t pins_read[] = {A0, A1, A2, A3};
static const char *const names[] = {"flexL", "flexR", "fsrL", "fsrR"};
static const uint32_t divider_ohm[] = {47000, 47000, 4700, 4700};
#endif

static uint16_t convert(uint8_t channel) { return (uint16_t)analogRead(pins_read[channel]); }

static void put_pressure(uint8_t steps) {
#if MOST_STEPS > 0
  analogWrite(PRESSURE_PIN, (uint32_t)steps * 4095 / STEPS_AT_FULL_SCALE);
#else
  (void)steps;
#endif
}

static void print(const char *text, size_t length) { HOST.write((const uint8_t *)text, length); }

static const GripperPins pins = {convert, put_pressure, print};
static const GripperSetup gripper = {20000, CHANNELS, names, divider_ohm, 12, MOST_STEPS};
static GripperState state;

#if MOST_STEPS > 0
/* The core calls this from an interrupt every millisecond. */
#ifdef __cplusplus
extern "C"
#endif
int sysTickHook(void) {
  gripper_watch(&state, &pins, micros());
#ifdef CHIP_WATCHDOG
  if (!state.steps) watchdogReset(); /* under pressure only loop() does */
#endif
  return 0;
}
#endif

#ifdef CHIP_WATCHDOG
/* The core calls this first of all, and turns the chip's watchdog off where it is missing. It can be set once. */
void watchdogSetup(void) { watchdogEnable(CHIP_WATCHDOG_MS); }

/* The core calls this as soon as pins work, before setup(): no pressure, also after a restart. */
void initVariant(void) { put_pressure(0); }
#endif

void setup() {
  put_pressure(0);
  HOST.begin(115200); /* the native port ignores the rate */
  analogReadResolution(12);
  analogWriteResolution(12);
  gripper_begin(&state, &gripper, &pins, micros());
}

void loop() {
#ifdef CHIP_WATCHDOG
  watchdogReset();
#endif
  while (HOST.available()) gripper_hear(&state, &gripper, &pins, (char)HOST.read(), micros());
  gripper_poll(&state, &gripper, &pins, micros());
}
