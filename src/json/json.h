/* The state of reading one scene: its text, its memory, and where in it we are. */
#ifndef VSHI_JSON_JSON_H
#define VSHI_JSON_JSON_H

#include "base/error.h"

#include <jansson.h>
#include <stdbool.h>

/* Memory that lives as long as the scene. */
typedef struct vshi_json_block {
    struct vshi_json_block *next;
    void *memory;
} vshi_json_block;

typedef struct vshi_json {
    const char *path; /* of the scene file, for messages and as the folder of the paths in it */
    const char *text;
    size_t size;
    vshi_json_block *blocks;
    vsh_error *error;
} vshi_json;

/* A value with the way to it from the root; lives on the stack of whoever went that way. */
typedef struct vshi_value {
    const struct vshi_value *parent; /* NULL: the root */
    const char *key;                 /* NULL: an array's item */
    size_t ordinal;                  /* number of the member or item in its parent, in the text's order */
    size_t depth;                    /* 0: the root */
    json_t *json;
} vshi_value;

/* The text of a file, to be freed with free(), which reading as JSON keeps within
 * run->memory_limit. Errors: VSH_ERROR_READ, VSH_ERROR_LIMIT (64 MiB, the limit), VSH_ERROR_MEMORY. */
vsh_result vshi_json_text(const char *path, const vsh_run *run, char **text, size_t *size, vsh_error *error);

/* The text as JSON, or an error with Jansson's line and column. Numbers are all read as doubles, so that one
 * too large for an integer is out of range like any other. Free with json_decref(). */
vsh_result vshi_json_load(vshi_json *reader, json_t **json);

/* "FILE:LINE:COLUMN: lights[0].angle_deg: …", with the place of the value, or of its key. */
vsh_result vshi_json_fail(const vshi_json *reader, const vshi_value *value, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
vsh_result vshi_json_fail_key(const vshi_json *reader, const vshi_value *value, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Member `key` of an object; false where there is none. */
bool vshi_member(const vshi_value *object, const char *key, vshi_value *member);

/* Item `index` (< its size) of an array. */
vshi_value vshi_item(const vshi_value *array, size_t index);

/* Fails where an object has both keys, at the one that comes later. */
vsh_result vshi_reject_both(const vshi_json *reader, const vshi_value *object, const char *one,
                            const char *other);

/* Zeroed memory that belongs to the scene. */
vsh_result vshi_json_allocate(vshi_json *reader, void **memory, size_t count, size_t size, const char *what);
void vshi_blocks_free(vshi_json_block *blocks);

/* A copy of `string`, behind the first `prefix` bytes of the scene's path. */
vsh_result vshi_json_copy(vshi_json *reader, size_t prefix, const char *string, const char **copy);

#endif
