/* Numbers in text, as every locale writes them in files: read exactly, written so that they read back as the
 * same bits. */
#ifndef VSHI_DECIMAL_H
#define VSHI_DECIMAL_H

#include <stdbool.h>
#include <stddef.h>

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

#endif
