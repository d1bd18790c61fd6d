/* Logic of the gripper's board, in plain C without Arduino: due_gripper.ino gives it the real pins, the emulator of Palpate
 * (src/device/emulator) emulated ones.
 *
 * Every period it reads each channel: one conversion discarded, for the multiplexer to settle behind a high-impedance
 * divider, then eight that are averaged. It prints
 *
 *     t_us:20000,seq:1,flexL:512.1,flexR:498.0,fsrL:30.4,fsrR:28.0,p_bar:0.55,ck:14493
 *
 * where ck is the CRC-16 of the line before it, so that a lost digit is noticed.
 *
 * Commands from the host:
 *
 *     P 0.55   line pressure, bar, in steps of 0.05      ->  # ok p=0.55
 *     V        vent                                      ->  # ok p=0.00
 *     K        keep-alive; at least every 500 ms         ->  # ok p=0.55
 *     ?        identify                                  ->  # tactile-gripper fw=2 ...
 *
 * It answers anything else with "# refused reason=...". It vents after a second without a valid command:
 * "# vent reason=watchdog".
 *
 * Time is the 32 bits of micros(), which wrap after 71.6 minutes: times are compared by their difference only.
 */
#ifndef GRIPPER_LOGIC_H
#define GRIPPER_LOGIC_H

#include <stdint.h>
#include <stddef.h>

#define GRIPPER_FIRMWARE 2             /* from 2 on, lines end in a checksum */
#define GRIPPER_MOST_CHANNELS 16
#define GRIPPER_OVERSAMPLE 8         /* conversions that are averaged */
#define GRIPPER_WATCHDOG_US 1000000u /* pressure goes off after this long without a line */
#define GRIPPER_LONGEST_HEARD 32     /* bytes of a host's line */
#define GRIPPER_STEP_CENTIBAR 5      /* the control box knows multiples of 0.05 bar */

/* What the logic needs from the board it runs on. */
typedef struct {
  uint16_t (*convert)(uint8_t channel);            /* one conversion of a channel: counts */
  void (*put_pressure)(uint8_t steps);             /* to the control box, in steps of 0.05 bar */
  void (*print)(const char *text, size_t length);  /* to the host */
} GripperPins;

/* How this board is wired and set. */
typedef struct {
  uint32_t period_us;             /* from sample to sample: 20000 is 50 Hz */
  uint8_t channels;               /* how many are read */
  const char *const *names;       /* what they are called, in order */
  const uint32_t *divider_ohm;    /* fixed resistor of each */
  uint8_t bits;                   /* of the converter */
  uint8_t most_steps;             /* highest pressure, in steps of 0.05 bar; 0: no control box is wired */
} GripperSetup;

typedef struct {
  uint32_t next_us;            /* when the next sample is due */
  uint32_t seq;                /* number of the next sample */
  volatile uint32_t heard_us;  /* when the last line came that was understood */
  volatile uint8_t steps;      /* pressure that is on */
  volatile uint8_t vented;     /* the watchdog has vented, and the remark is not yet printed */
  uint8_t heard;               /* bytes of the host's line so far */
  uint8_t overlong;            /* the line is too long: wait for its end */
  char line[GRIPPER_LONGEST_HEARD];
} GripperState;

#define GRIPPER_LINE_END 11 /* bytes kept free for ",ck:65535" and what ends a line */

/* A line for the host that is being written; what does not fit is left out, but never its end. */
typedef struct {
  char text[512];
  size_t length;
  uint8_t cut; /* something did not fit */
} GripperText;

static void gripper_put(GripperText *out, const char *text) {
  while (*text && out->length + GRIPPER_LINE_END < sizeof out->text) out->text[out->length++] = *text++;
  if (*text) out->cut = 1;
}

static void gripper_put_number(GripperText *out, uint32_t number) {
  char digits[11];
  uint8_t at = sizeof digits - 1;
  digits[at] = 0;
  do {
    digits[--at] = (char)('0' + number % 10);
    number /= 10;
  } while (number);
  gripper_put(out, digits + at);
}

/* 0.05 bar a step, with two decimals. */
static void gripper_put_bar(GripperText *out, uint8_t steps) {
  uint32_t centibar = (uint32_t)steps * GRIPPER_STEP_CENTIBAR;
  char decimals[4] = {'.', (char)('0' + centibar / 10 % 10), (char)('0' + centibar % 10), 0};
  gripper_put_number(out, centibar / 100);
  gripper_put(out, decimals);
}

/* CRC-16, CCITT polynomial 0x1021 from 0xffff, of what was written so far. */
static uint16_t gripper_checksum(const GripperText *out) {
  uint16_t sum = 0xffff;
  size_t i;
  uint8_t bit;
  for (i = 0; i < out->length; i++) {
    sum ^= (uint16_t)((uint16_t)(uint8_t)out->text[i] << 8);
    for (bit = 0; bit < 8; bit++) sum = (uint16_t)(sum & 0x8000 ? sum << 1 ^ 0x1021 : sum << 1);
  }
  return sum;
}

/* Ends a line with its checksum; one that did not fit goes without, so that the host refuses it. */
static void gripper_sign(GripperText *out, const char *key) {
  char digits[6];
  uint8_t at = sizeof digits - 1;
  uint16_t sum = gripper_checksum(out);
  if (out->cut) return;
  digits[at] = 0;
  do {
    digits[--at] = (char)('0' + sum % 10);
    sum = (uint16_t)(sum / 10);
  } while (sum);
  while (*key) out->text[out->length++] = *key++;
  while (digits[at]) out->text[out->length++] = digits[at++];
}

static void gripper_send(const GripperPins *pins, GripperText *out) {
  out->text[out->length++] = '\n';
  pins->print(out->text, out->length);
}

static void gripper_say(const GripperPins *pins, const char *text) {
  GripperText out = {{0}, 0, 0};
  gripper_put(&out, text);
  gripper_send(pins, &out);
}

static void gripper_say_ok(const GripperState *state, const GripperPins *pins) {
  GripperText out = {{0}, 0, 0};
  gripper_put(&out, "# ok p=");
  gripper_put_bar(&out, state->steps);
  gripper_send(pins, &out);
}

static void gripper_say_handshake(const GripperSetup *setup, const GripperPins *pins) {
  GripperText out = {{0}, 0, 0};
  uint8_t channel;
  gripper_put(&out, "# tactile-gripper fw=");
  gripper_put_number(&out, GRIPPER_FIRMWARE);
  gripper_put(&out, " adc=");
  gripper_put_number(&out, setup->bits);
  gripper_put(&out, " vref=3.3 rate=");
  gripper_put_number(&out, 1000000u / setup->period_us);
  for (channel = 0; channel < setup->channels; channel++) {
    gripper_put(&out, channel ? "," : " ch=");
    gripper_put(&out, setup->names[channel]);
  }
  for (channel = 0; channel < setup->channels; channel++) {
    gripper_put(&out, channel ? "," : " rm=");
    gripper_put_number(&out, setup->divider_ohm[channel]);
  }
  if (setup->most_steps) {
    gripper_put(&out, " p_max=");
    gripper_put_bar(&out, setup->most_steps);
  }
#ifdef GRIPPER_EMULATED
  gripper_put(&out, " emulated=1");
#endif
  gripper_sign(&out, " ck=");
  gripper_send(pins, &out);
}

static void gripper_set_pressure(GripperState *state, const GripperPins *pins, uint8_t steps) {
  state->steps = steps;
  pins->put_pressure(steps);
}

/* To be called once: vents, prints the handshake, and takes the first sample now. */
static void gripper_begin(GripperState *state, const GripperSetup *setup, const GripperPins *pins, uint32_t now_us) {
  GripperState fresh = {0};
  *state = fresh;
  state->next_us = now_us;
  state->heard_us = now_us;
  gripper_set_pressure(state, pins, 0);
  gripper_say_handshake(setup, pins);
}

/* "0.55" in hundredths, or -1: one digit or two, then at most two decimals, and nothing else. */
static int32_t gripper_centibar(const char *text) {
  int32_t number = 0, decimals = -1, digits = 0;
  for (; *text; text++) {
    if (*text == '.' && decimals < 0 && digits) {
      decimals = 0;
    } else if (*text >= '0' && *text <= '9' && digits < 4 && decimals < 2) {
      number = number * 10 + (*text - '0');
      digits++;
      if (decimals >= 0) decimals++;
    } else {
      return -1;
    }
  }
  if (!digits) return -1;
  for (decimals = decimals < 0 ? 0 : decimals; decimals < 2; decimals++) number *= 10;
  return number;
}

/* Answers a pressure that was asked for; true when it was one. */
static uint8_t gripper_press(GripperState *state, const GripperSetup *setup, const GripperPins *pins, const char *text) {
  int32_t centibar = gripper_centibar(text);
  if (centibar < 0) {
    gripper_say(pins, "# refused reason=not-understood");
    return 0;
  }
  if (!setup->most_steps) {
    gripper_say(pins, "# refused reason=no-control-box");
  } else if (centibar % GRIPPER_STEP_CENTIBAR) {
    gripper_say(pins, "# refused reason=not-a-step step=0.05");
  } else if (centibar / GRIPPER_STEP_CENTIBAR > setup->most_steps) {
    GripperText out = {{0}, 0, 0};
    gripper_put(&out, "# refused reason=above-maximum max=");
    gripper_put_bar(&out, setup->most_steps);
    gripper_send(pins, &out);
  } else {
    gripper_set_pressure(state, pins, (uint8_t)(centibar / GRIPPER_STEP_CENTIBAR));
    gripper_say_ok(state, pins);
  }
  return 1;
}

/* Answers one line of the host; true when it was understood. */
static uint8_t gripper_execute(GripperState *state, const GripperSetup *setup, const GripperPins *pins, const char *line) {
  if (line[0] == 'P' && line[1] == ' ') return gripper_press(state, setup, pins, line + 2);
  if (line[0] && !line[1]) {
    switch (line[0]) {
      case 'V':
        gripper_set_pressure(state, pins, 0);
        gripper_say_ok(state, pins);
        return 1;
      case 'K':
        gripper_say_ok(state, pins);
        return 1;
      case '?':
        gripper_say_handshake(setup, pins);
        return 1;
    }
  }
  gripper_say(pins, "# refused reason=not-understood");
  return 0;
}

/* Takes one byte from the host. */
static void gripper_hear(GripperState *state, const GripperSetup *setup, const GripperPins *pins, char byte,
                         uint32_t now_us) {
  if (byte == '\r') return;
  if (byte != '\n') {
    if (state->heard + 1u >= sizeof state->line) {
      state->overlong = 1;
    } else {
      state->line[state->heard++] = byte ? byte : '\1'; /* a zero would end the line early */
    }
    return;
  }
  state->line[state->heard] = 0;
  if (state->overlong) {
    gripper_say(pins, "# refused reason=too-long");
  } else if (state->heard) {
    /* Before it is executed, so that the watchdog does not take a pressure that is put on just now for an old one. */
    uint32_t before = state->heard_us;
    state->heard_us = now_us;
    if (!gripper_execute(state, setup, pins, state->line)) state->heard_us = before;
  }
  state->heard = 0;
  state->overlong = 0;
}

/* Average of the kept conversions of a channel, in tenths of a count, rounded. */
static uint32_t gripper_tenths(const GripperPins *pins, uint8_t channel) {
  uint32_t sum = 0;
  uint8_t i;
  pins->convert(channel);
  for (i = 0; i < GRIPPER_OVERSAMPLE; i++) sum += pins->convert(channel);
  return (sum * 10 + GRIPPER_OVERSAMPLE / 2) / GRIPPER_OVERSAMPLE;
}

static void gripper_sample(const GripperState *state, const GripperSetup *setup, const GripperPins *pins,
                           uint32_t now_us) {
  GripperText out = {{0}, 0, 0};
  uint8_t channel;
  gripper_put(&out, "t_us:");
  gripper_put_number(&out, now_us);
  gripper_put(&out, ",seq:");
  gripper_put_number(&out, state->seq);
  for (channel = 0; channel < setup->channels; channel++) {
    uint32_t tenths = gripper_tenths(pins, channel);
    gripper_put(&out, ",");
    gripper_put(&out, setup->names[channel]);
    gripper_put(&out, ":");
    gripper_put_number(&out, tenths / 10);
    gripper_put(&out, ".");
    gripper_put_number(&out, tenths % 10);
  }
  if (setup->most_steps) {
    gripper_put(&out, ",p_bar:");
    gripper_put_bar(&out, state->steps);
  }
  gripper_sign(&out, ",ck:");
  gripper_send(pins, &out);
}

/* Vents when the host has gone silent. It is short and prints nothing, so that a timer's interrupt may call it: printing can
 * wait for a host that hangs, and the hand must open nevertheless. */
static void gripper_watch(GripperState *state, const GripperPins *pins, uint32_t now_us) {
  /* Signed, because the interrupt's clock may be a little behind the one that a line was heard by. */
  if (state->steps && (int32_t)(now_us - state->heard_us) > (int32_t)GRIPPER_WATCHDOG_US) {
    gripper_set_pressure(state, pins, 0);
    state->vented = 1;
  }
}

/* To be called as often as possible: samples when one is due, vents when the host has gone silent. A sample is due at
 * whole periods after the beginning, however late the last one was; those that were missed altogether are counted in
 * seq, so that the host knows. */
static void gripper_poll(GripperState *state, const GripperSetup *setup, const GripperPins *pins, uint32_t now_us) {
  gripper_watch(state, pins, now_us);
  if (state->vented) {
    state->vented = 0;
    gripper_say(pins, "# vent reason=watchdog");
  }
  if ((int32_t)(now_us - state->next_us) < 0) return;
  while (now_us - state->next_us >= setup->period_us) {
    state->next_us += setup->period_us;
    state->seq++;
  }
  gripper_sample(state, setup, pins, now_us);
  state->next_us += setup->period_us;
  state->seq++;
}

#endif
