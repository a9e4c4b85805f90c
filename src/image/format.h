/* What a format of images can hold. */
#ifndef VSHI_FORMAT_H
#define VSHI_FORMAT_H

#include <stdbool.h>
#include <stdint.h>

enum { VSHI_BITS_8 = 1, VSHI_BITS_16 = 2, VSHI_BITS_32 = 4 };

enum {
    VSHI_ALPHA_NONE = 0,
    VSHI_ALPHA_KEPT = 1,  /* with R, G and B where A is 0 */
    VSHI_ALPHA_ALWAYS = 2 /* the same, and there must be one: 1 where none is given */
};

/* 8 and 16 bits are integers, 32 is float. */
typedef struct vshi_format {
    const char *name; /* OpenImageIO's, where that writes it */
    int32_t bits;     /* VSHI_BITS_… that it can be written with */
    int32_t alpha;    /* VSHI_ALPHA_… */
    int32_t max_size; /* pixels along a side */
    bool lossy;       /* values change by more than their rounding */
    bool grey;        /* one channel, R */
    double held;      /* bytes a value that the writer keeps until the end, over those of the value itself */
} vshi_format;

#endif
