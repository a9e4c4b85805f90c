/* Numbers as text: with a decimal point, whatever the host's locale writes. */
#ifndef VSHI_NUMBERS_H
#define VSHI_NUMBERS_H

#include <locale.h>

/* The C locale is a constant of the C library: nothing is taken, nothing to be given back. */
static inline locale_t vshi_numbers_begin(void) {
    return uselocale(newlocale(LC_ALL_MASK, "C", (locale_t)0));
}

static inline void vshi_numbers_end(const locale_t *host) {
    uselocale(*host);
}

/* First in a scope that reads numbers, or writes them where they stay: of this thread only. */
#define VSHI_NUMBERS                                                                                         \
    const locale_t host_locale __attribute__((cleanup(vshi_numbers_end), unused)) = vshi_numbers_begin()

#endif
