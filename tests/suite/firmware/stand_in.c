/* The firmware's logic on a computer: what would be pins is a script on standard input, what it prints goes to standard
 * output. Arguments: period in us, channels, bits, most steps, start of the clock in us.
 *
 *     t 20000     it is so late now, in us: poll
 *     w 20000     it is so late now, and only the timer comes round: the loop is stuck
 *     x 4b0a      these bytes come from the host now
 *
 * Beside the board's lines it prints "!pressure N" when the control box is told, and at the end "!conversions N". */

#include "gripper_logic.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static unsigned conversions;

/* The first conversion after a change of channel still shows the one before, as behind a slow multiplexer. The others
 * differ from each other, so that an average of fewer or more than eight is another number. */
static uint16_t convert(uint8_t channel) {
  static unsigned last = 99, within;
  conversions++;
  within = channel == last && within < GRIPPER_OVERSAMPLE ? within + 1 : 0;
  last = channel;
  return within == 0 ? 4095 : (uint16_t)(400 * channel + 10 + within * within + conversions % 7);
}

static void put_pressure(uint8_t steps) { printf("!pressure %u\n", steps); }

static void print(const char *text, size_t length) { fwrite(text, 1, length, stdout); }

int main(int argc, char **argv) {
  static const char *names[] = {"flexL", "flexR", "fsrL", "fsrR", "aux1", "aux2", "aux3", "aux4"};
  static const uint32_t ohm[] = {47000, 47000, 4700, 4700, 4700, 4700, 4700, 4700};
  GripperPins pins = {convert, put_pressure, print};
  GripperSetup setup;
  GripperState state;
  uint32_t now;
  char command[4096];
  if (argc != 6) return 2;
  setup.period_us = (uint32_t)strtoul(argv[1], NULL, 10);
  setup.channels = (uint8_t)atoi(argv[2]);
  setup.names = names;
  setup.divider_ohm = ohm;
  setup.bits = (uint8_t)atoi(argv[3]);
  setup.most_steps = (uint8_t)atoi(argv[4]);
  now = (uint32_t)strtoul(argv[5], NULL, 10);
  gripper_begin(&state, &setup, &pins, now);
  while (fgets(command, sizeof command, stdin)) {
    if (command[0] == 't') {
      now = (uint32_t)strtoul(command + 2, NULL, 10);
      gripper_poll(&state, &setup, &pins, now);
    } else if (command[0] == 'w') {
      now = (uint32_t)strtoul(command + 2, NULL, 10);
      gripper_watch(&state, &pins, now);
    } else {
      const char *hex = command + 2;
      unsigned byte;
      for (; sscanf(hex, "%2x", &byte) == 1; hex += 2) gripper_hear(&state, &setup, &pins, (char)byte, now);
    }
  }
  printf("!conversions %u\n", conversions);
  return 0;
}
