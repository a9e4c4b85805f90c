/* Numbers in text, independent of the locale: read exactly, written so that they read back as the same bits.
 */
#pragma once

#include <locale.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <vdbshade/base.h>

VSH_BEGIN_C

enum { VSHI_DECIMAL_ROOM = 32 }; /* bytes that are enough for any number */

/* Reads all of text … end - 1 as a number: [+-]digits[.digits][e[+-]digits], correctly rounded, or nan, inf
 * or infinity in any case. Returns false if it is not a number. */
bool vshi_decimal_read(const char *text, const char *end, double *value);

/* Reads the number at the start of a text, fast: [+-]digits[.digits][e[+-]digits], correctly rounded,
 * infinite if it is too large. Returns its end, or NULL if there is none. A character that cannot belong to a
 * number must follow it. */
const char *vshi_decimal_float(const char *text, float *value);

/* Writes the shortest decimal that reads back as `value`, without exponent from 1e-6 to 1e9 (1e15); "nan",
 * "inf" or "-inf". Writes no NUL. Returns the text's end. */
char *vshi_decimal_write_float(char *text, float value);
char *vshi_decimal_write_double(char *text, double value);

VSH_END_C

/* --- numbers by the C library, independent of the host's locale and rounding */

typedef struct vshi_numbers {
    locale_t locale;
    uint16_t control; /* x87: glibc rounds numbers to and from text as its control word says */
} vshi_numbers;

static inline uint16_t vshi_numbers_control(void) {
    uint16_t word = 0;
#if defined(__x86_64__)
    __asm__ volatile("fnstcw %0" : "=m"(word));
#endif
    return word;
}

static inline void vshi_numbers_set_control(uint16_t word) {
#if defined(__x86_64__)
    __asm__ volatile("fldcw %0" : : "m"(word));
#else
    (void)word;
#endif
}

/* The C locale is a constant of the C library, so it needs no freelocale(). */
static inline vshi_numbers vshi_numbers_begin(void) {
    enum { ROUNDING = 0x0c00 }; /* 0: to nearest */
    const vshi_numbers host = {uselocale(newlocale(LC_ALL_MASK, "C", (locale_t)0)), vshi_numbers_control()};
    vshi_numbers_set_control((uint16_t)(host.control & ~ROUNDING));
    return host;
}

static inline void vshi_numbers_end(const vshi_numbers *host) {
    uselocale(host->locale);
    vshi_numbers_set_control(host->control);
}

/* Put this first in a scope that reads numbers, or writes them to files. It affects this thread only. */
#define VSHI_NUMBERS                                                                                         \
    const vshi_numbers host_numbers __attribute__((cleanup(vshi_numbers_end), unused)) = vshi_numbers_begin()
