/* The board's firmware for the emulator: gripper_logic.h as it goes onto the board, with its pins given by the emulator.
 * Its one user is firmware.rs. */

/* It says so in its handshake: its trials must not pass for those of a real gripper. */
#define GRIPPER_EMULATED
#include "gripper_logic.h"

#ifdef _MSC_VER
#define PER_THREAD __declspec(thread)
#else
#define PER_THREAD __thread
#endif

#define LONGEST_NAME 16

/* A board. Its names and resistors are its own, so that it must not be moved. */
typedef struct {
  GripperState state;
  GripperSetup setup;
  char names[GRIPPER_MOST_CHANNELS][LONGEST_NAME];
  const char *name[GRIPPER_MOST_CHANNELS];
  uint32_t divider_ohm[GRIPPER_MOST_CHANNELS];
  uint8_t line_steps; /* pressure at the control box */
} EmulatedBoard;

/* What a board calls during one of the functions below. */
typedef struct {
  void *context;
  uint16_t (*convert)(void *context, uint8_t channel);
  void (*put_pressure)(void *context, uint8_t steps);
  void (*print)(void *context, const char *text, size_t length);
} EmulatedPins;

static PER_THREAD EmulatedBoard *board_now;
static PER_THREAD const EmulatedPins *pins_now;

static uint16_t convert(uint8_t channel) { return pins_now->convert(pins_now->context, channel); }

static void put_pressure(uint8_t steps) {
  board_now->line_steps = steps;
  pins_now->put_pressure(pins_now->context, steps);
}

static void print(const char *text, size_t length) { pins_now->print(pins_now->context, text, length); }

static const GripperPins pins = {convert, put_pressure, print};

static void enter(EmulatedBoard *board, const EmulatedPins *services) {
  board_now = board;
  pins_now = services;
}

size_t palpate_firmware_size(void) { return sizeof(EmulatedBoard); }

/* Wires a board: `names` holds a text for each channel, each ended by a zero. Zero where that does not fit. */
uint8_t palpate_firmware_wire(EmulatedBoard *board, uint32_t period_us, uint8_t channels, const char *names,
                              const uint32_t *divider_ohm, uint8_t bits, uint8_t most_steps) {
  uint8_t channel;
  size_t length;
  if (channels > GRIPPER_MOST_CHANNELS || !period_us) return 0;
  for (channel = 0; channel < channels; channel++) {
    for (length = 0; names[length]; length++) {
      if (length + 1 >= LONGEST_NAME) return 0;
      board->names[channel][length] = names[length];
    }
    board->names[channel][length] = 0;
    names += length + 1;
    board->name[channel] = board->names[channel];
    board->divider_ohm[channel] = divider_ohm[channel];
  }
  board->setup.period_us = period_us;
  board->setup.channels = channels;
  board->setup.names = board->name;
  board->setup.divider_ohm = board->divider_ohm;
  board->setup.bits = bits;
  board->setup.most_steps = most_steps;
  return 1;
}

void palpate_firmware_begin(EmulatedBoard *board, const EmulatedPins *services, uint32_t now_us) {
  enter(board, services);
  gripper_begin(&board->state, &board->setup, &pins, now_us);
}

void palpate_firmware_hear(EmulatedBoard *board, const EmulatedPins *services, uint8_t byte, uint32_t now_us) {
  enter(board, services);
  gripper_hear(&board->state, &board->setup, &pins, (char)byte, now_us);
}

void palpate_firmware_watch(EmulatedBoard *board, const EmulatedPins *services, uint32_t now_us) {
  enter(board, services);
  gripper_watch(&board->state, &pins, now_us);
}

void palpate_firmware_poll(EmulatedBoard *board, const EmulatedPins *services, uint32_t now_us) {
  enter(board, services);
  gripper_poll(&board->state, &board->setup, &pins, now_us);
}

/* Pressure set by hand at the control box: it is no command of the host, and the watchdog does not count. */
void palpate_firmware_set_by_hand(EmulatedBoard *board, uint8_t steps, uint32_t now_us) {
  board->line_steps = steps;
  board->state.steps = steps;
  board->state.heard_us = now_us;
}

uint8_t palpate_firmware_line_steps(const EmulatedBoard *board) { return board->line_steps; }

uint32_t palpate_firmware_next_us(const EmulatedBoard *board) { return board->state.next_us; }
