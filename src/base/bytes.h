/* Sizes in memory, as text. */
#ifndef VSHI_BYTES_H
#define VSHI_BYTES_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum { VSHI_BYTES_ROOM = 32 };

/* "1.5 GiB", into text[capacity], which is returned. */
static inline const char *vshi_bytes_text(uint64_t bytes, char *text, size_t capacity) {
    static const char *const units[] = {"bytes", "KiB", "MiB", "GiB", "TiB"};
    double value = (double)bytes;
    size_t unit = 0;
    while (value >= 1000.0 && unit + 1 < sizeof units / sizeof units[0]) {
        value /= 1024.0;
        ++unit;
    }
    snprintf(text, capacity, "%.*f %s", unit > 0 && value < 100.0 ? 1 : 0, value, units[unit]);
    return text;
}

#endif
