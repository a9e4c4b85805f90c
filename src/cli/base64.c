#include "base64.h"

static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

void cli_base64_put(cli_base64 *to, uint8_t byte) {
    to->held = to->held << 8 | byte;
    if (++to->holding == 3) {
        for (int shift = 18; shift >= 0; shift -= 6) {
            fputc(letters[to->held >> shift & 63], to->out);
        }
        to->held = 0;
        to->holding = 0;
    }
}

void cli_base64_end(cli_base64 *to) {
    const int rest = to->holding;
    if (rest == 0) {
        return;
    }
    const uint32_t held = to->held << (8 * (3 - rest));
    for (int i = 0; i <= rest; ++i) {
        fputc(letters[held >> (18 - 6 * i) & 63], to->out);
    }
    fputs(rest == 1 ? "==" : "=", to->out);
    to->holding = 0;
}
