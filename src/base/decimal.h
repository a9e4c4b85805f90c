/* Numbers in text, as every locale writes them in files: read exactly, written so that they read back as the
 * same bits. */
#ifndef VSHI_DECIMAL_H
#define VSHI_DECIMAL_H

#include <locale.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { VSHI_DECIMAL_ROOM = 32 }; /* what any number takes as text */

/* The number that text … end - 1 is, all of it: [+-]digits[.digits][e[+-]digits], correctly rounded, or nan,
 * inf and infinity in any case. False where it is none. */
bool vshi_decimal_read(const char *text, const char *end, double *value);

/* The number at the text's begin, correctly rounded (infinite where it is too large), as fast as it goes:
 * [+-]digits[.digits][e[+-]digits]. Returns behind it, NULL where there is none. The text must go on behind
 * the number with anything that cannot belong to one. */
const char *vshi_decimal_float(const char *text, float *value);

/* The shortest decimal that reads back as `value`, without exponent from 1e-6 to 1e9 (1e15); "nan", "inf" and
 * "-inf". Not ended by NUL. Returns behind it. */
char *vshi_decimal_write_float(char *text, float value);
char *vshi_decimal_write_double(char *text, double value);

#ifdef __cplusplus
}
#endif

/* --- numbers by the C library: with a decimal point and rounded to nearest, whatever the host's locale and
 * rounding are */

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

/* The C locale is a constant of the C library: nothing is taken, nothing to be given back. */
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

/* First in a scope that reads numbers, or writes them where they stay: of this thread only. */
#define VSHI_NUMBERS                                                                                         \
    const vshi_numbers host_numbers __attribute__((cleanup(vshi_numbers_end), unused)) = vshi_numbers_begin()

#endif
