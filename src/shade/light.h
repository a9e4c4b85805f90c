/* What the library's parts share about lights. */
#ifndef VSHI_LIGHT_H
#define VSHI_LIGHT_H

#include <vdbshade/light.h>

#include <stdbool.h>

/* Whether a name can be part of a channel's name and of a packing ("R=shadow.sun,A=A"): letters, digits, '_'
 * and '-', 1 … 63 of them. */
bool vshi_light_name_valid(const char *name);

#endif
