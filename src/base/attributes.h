/* Lines of text that files carry. */
#ifndef VSHI_ATTRIBUTES_H
#define VSHI_ATTRIBUTES_H

#include "base/error.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* VSH_ERROR_ARGUMENT, naming `path` and the attribute, where one is not as vsh_attribute says. */
VSHI_SHARED vsh_result vshi_attributes_check(const char *path, const vsh_attribute *attributes, size_t count,
                                             vsh_error *error);

/* A list that owns its texts; begins as zeros. */
typedef struct vshi_attributes {
    vsh_attribute *list; /* [count] */
    size_t count, capacity;
} vshi_attributes;

/* Adds a copy of both texts, control characters in them as '?'. False where memory is short. */
bool vshi_attributes_add(vshi_attributes *attributes, const char *name, const char *value);
void vshi_attributes_free(vshi_attributes *attributes);

#ifdef __cplusplus
}
#endif
#endif
