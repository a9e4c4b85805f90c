/* Nearest places in the world, by a k-d tree. */
#pragma once

#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct vshi_place {
    float at[3];
    uint32_t number; /* unique */
} vshi_place;

/* A k-d tree: the middle of each part of the list splits it, along the part's longest axis. */
typedef struct vshi_places {
    vshi_place *list; /* [count] */
    uint8_t *axis;    /* [count]: the axis of each split */
    size_t count;
} vshi_places;

/* Bytes for each place. */
enum { VSHI_PLACE_BYTES = sizeof(vshi_place) + 1 };

/* Sorts places->list [count], and makes the tree. Errors: VSH_ERROR_MEMORY. Free with vshi_places_free(),
 * even after an error. */
vsh_result vshi_places_sort(vshi_places *places, vsh_error *error);
void vshi_places_free(vshi_places *places);

/* The number of the nearest place closer than the root of `square`, of equally near ones the lowest;
 * UINT32_MAX: there is none. Thread safe. */
uint32_t vshi_places_nearest(const vshi_places *places, const float at[3], float square);

/* Calls found() with each place at most `within` from the line from a to b, and with others near it, until it
 * returns false. Thread safe. */
void vshi_places_along(const vshi_places *places, const float a[3], const float b[3], float within,
                       bool (*found)(void *user, uint32_t number), void *user);
