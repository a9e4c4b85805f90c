/* Tables of names, found by number and by name. */
#ifndef VSHI_NAMES_H
#define VSHI_NAMES_H

#include <stdint.h>
#include <string.h>

/* A table of static strings; its size with it. */
typedef struct vshi_names {
    const char *const *names;
    int32_t count;
} vshi_names;

#define VSHI_NAMES(table)                                                                                    \
    { table, (int32_t)(sizeof(table) / sizeof((table)[0])) }

/* Number of a name; -1 for what is none, or NULL. */
static inline int32_t vshi_name_find(vshi_names of, const char *name) {
    for (int32_t i = 0; name != NULL && i < of.count; ++i) {
        if (strcmp(of.names[i], name) == 0) {
            return i;
        }
    }
    return -1;
}

/* Name of a number; NULL for what is none. */
static inline const char *vshi_name_at(vshi_names of, int32_t i) {
    return i >= 0 && i < of.count ? of.names[i] : NULL;
}

#endif
