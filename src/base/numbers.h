/* Numbers as text: with a decimal point and rounded to nearest, whatever the host's locale and rounding are.
 */
#ifndef VSHI_NUMBERS_H
#define VSHI_NUMBERS_H

#include <locale.h>
#include <stdint.h>

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
