/* Reads JSON files through tables of keys (name, type, range, place in a struct), and tells the place of
 * errors. */
#pragma once

#include "base/error.h"

#include <jansson.h>
#include <stdbool.h>

/* --- a file */

/* Memory that is freed with the struct that was read. */
typedef struct vshi_json_block vshi_json_block;

/* The state of reading one file. Callers set the first three members. */
typedef struct vshi_json {
    const char *path;   /* for messages, and as the folder of the paths in it */
    const vsh_run *run; /* resolved; of vshi_json_read() */
    vsh_error *error;
    const char *text;
    size_t size;
    vshi_json_block *blocks;
} vshi_json;

/* A value with the path to it from the root; on the stack of the function that found it. */
typedef struct vshi_value {
    const struct vshi_value *parent; /* NULL: the root */
    const char *key;                 /* NULL: an array's item */
    size_t ordinal;                  /* number of the member or item in its parent, in the text's order */
    size_t depth;                    /* 0: the root */
    json_t *json;
} vshi_value;

/* Reads a value into a struct, or into its member at the key's offset. */
typedef vsh_result vshi_read_fn(vshi_json *reader, const vshi_value *value, void *member);

/* Allocates a struct of `size` bytes, zeroed, and reads the root of the reader's text into it. Free it with
 * vshi_json_free(). All numbers are read as doubles, so that large integers are out of range, not damaged.
 * Errors: VSH_ERROR_INPUT, VSH_ERROR_MEMORY, those of `read`. */
vsh_result vshi_json_parse(vshi_json *reader, size_t size, vshi_read_fn *read, void **made);

/* Reads the file at the reader's path and parses it in the same way, on a stack that is large enough. Needs
 * the reader's run. Errors: also VSH_ERROR_READ, VSH_ERROR_LIMIT (64 MiB, run->memory_limit). */
vsh_result vshi_json_read(vshi_json *reader, size_t size, vshi_read_fn *read, void **made);

/* Frees such a struct with all its memory. NULL does nothing. */
void vshi_json_free(void *made);

/* Allocates zeroed memory that is freed with the struct. */
vsh_result vshi_json_allocate(vshi_json *reader, void **memory, size_t count, size_t size, const char *what);

/* Copies the first `prefix` bytes of the file's path and `string`. */
vsh_result vshi_json_copy(vshi_json *reader, size_t prefix, const char *string, const char **copy);

/* --- values */

/* Fail with "FILE:LINE:COLUMN: lights[0].angle_deg: …": the place of the value, or of its key. */
vsh_result vshi_json_fail(const vshi_json *reader, const vshi_value *value, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
vsh_result vshi_json_fail_key(const vshi_json *reader, const vshi_value *value, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Moves to the next member of an object, or the first if member->json is NULL. Returns false at the end. */
bool vshi_next_member(const vshi_value *object, vshi_value *member);

/* Finds member `key` of an object; returns false if there is none. */
bool vshi_member(const vshi_value *object, const char *key, vshi_value *member);

/* Returns item `index` (< its size) of an array. */
vshi_value vshi_item(const vshi_value *array, size_t index);

/* Fails if `value` has another JSON type. */
vsh_result vshi_expect(const vshi_json *reader, const vshi_value *value, json_type type);

/* Fails if an object has both keys, at the later one. */
vsh_result vshi_reject_both(const vshi_json *reader, const vshi_value *object, const char *one,
                            const char *other);

/* A list, as a member of a struct. */
typedef struct vshi_list {
    void *items;
    size_t count;
} vshi_list;

/* --- tables of keys */

/* The largest magnitude in a scene. Above it, doubles cannot separate points a unit apart, and products of a
 * few numbers are not finite. */
#define VSHI_LARGEST 1e15
/* Limits of the library for lengths of voxels and of AO. A scene can be smaller or larger. */
#define VSHI_SMALLEST_LENGTH 1e-12
#define VSHI_LARGEST_VOXEL 1e12
#define VSHI_PI 3.14159265358979323846

typedef enum vshi_key_kind {
    VSHI_NUMBER,  /* double */
    VSHI_DEGREES, /* double, kept as radians */
    VSHI_INTEGER, /* int32_t */
    VSHI_BOOL,    /* int32_t */
    VSHI_VECTOR,  /* double[count] */
    VSHI_NAME,    /* int32_t: a name's number */
    VSHI_STRING,  /* const char *, not empty */
    VSHI_PATH,    /* const char *, in the folder of the scene file unless it is absolute */
    VSHI_LIST,    /* { items; size_t count; }: an array of objects; `read` reads each into `count` bytes */
    VSHI_CUSTOM,  /* any value; `read` reads it */
    VSHI_LATER    /* read by the caller, before or after the others */
} vshi_key_kind;

enum {
    VSHI_ABOVE = 1,   /* the range's lower end is excluded */
    VSHI_BELOW = 2,   /* the range's upper end is excluded */
    VSHI_NONZERO = 4, /* a vector's length must not be 0 */
};

/* Returns the name of value i, NULL after the last. */
typedef const char *vshi_name_fn(int32_t i);

/* A key as a text, on a command line for example, and its help. All zero: only files have this key. */
typedef struct vshi_option {
    const char *name;      /* "max-error" */
    const char *value;     /* a word for the value: "N", "VOXELS"; NULL: VSHI_BOOL */
    const char *help;      /* its purpose, without range and default */
    const char *range;     /* in words: for VSHI_CUSTOM, and ranges that are no pair of numbers */
    const char *otherwise; /* the default, if it is no number or name */
    int32_t group;         /* the caller's */
    bool by;               /* numbers have an x between them, not a comma */
} vshi_option;

typedef struct vshi_key {
    const char *name;
    vshi_key_kind kind;
    uint32_t variants; /* bits: the variants of the object that have this key; 0: all */
    uint32_t required; /* bits: the variants that need this key */
    size_t offset;
    double lowest; /* numbers, and each number of a vector */
    double highest;
    int32_t flags;
    int32_t count;
    int32_t names;         /* VSH_NAMES_…, if name_of is NULL */
    vshi_name_fn *name_of; /* other names */
    vshi_read_fn *read;
    size_t flag;                /* offset of an int32_t that becomes 1 with the key; 0: none */
    void (*then)(void *target); /* called after the key was read; may be NULL */
    vshi_option option;
} vshi_key;

/* A row of a table: its name, its VSHI_…, and its other members that are not 0. */
#define VSHI_KEY(key, of_kind, ...)                                                                          \
    { .name = key, .kind = VSHI_##of_kind, __VA_ARGS__ }
#define VSHI_ANY .lowest = -VSHI_LARGEST, .highest = VSHI_LARGEST  /* any number */
#define VSHI_POSITIVE .highest = VSHI_LARGEST, .flags = VSHI_ABOVE /* numbers above 0 */
#define VSHI_NEEDED_BY(bits) .variants = bits, .required = bits    /* variants that need the key */

#define VSHI_ALL UINT32_MAX

typedef struct vshi_table {
    const vshi_key *keys;
    size_t key_count;
} vshi_table;

#define VSHI_TABLE(keys)                                                                                     \
    { keys, sizeof(keys) / sizeof((keys)[0]) }

/* Reads an object's members, in the order of the text, into `target`. `variant` is one bit; `what` describes
 * the object ("a spot light"). Errors: VSH_ERROR_INPUT at the first key that is unknown, missing, out of
 * range, or of another variant or type. */
vsh_result vshi_read_object(vshi_json *reader, const vshi_value *object, const vshi_table *table,
                            uint32_t variant, const char *what, void *target);

/* Reads one value as `key` says into `member`. */
vsh_result vshi_read_value(vshi_json *reader, const vshi_value *value, const vshi_key *key, void *member);

/* Reads the value of a VSHI_NAME key before the rest of its object; keeps *index if there is no such key. */
vsh_result vshi_read_choice(vshi_json *reader, const vshi_value *object, const vshi_key *key, int32_t *index);

/* Returns the name of a value of a VSHI_NAME key, NULL after the last. */
const char *vshi_key_name(const vshi_key *key, int32_t i);

/* --- keys as texts */

/* Reads a text into `target` as `key` says: numbers with commas between them, names, VSHI_BOOL "true",
 * "false", or NULL for true. Strings are not copied. Errors: VSH_ERROR_INPUT, "NAME 'TEXT': expected …";
 * VSH_ERROR_MEMORY. */
vsh_result vshi_read_text(const vshi_key *key, const char *name, const char *text, void *target,
                          vsh_error *error);

/* Writes the range of a key in words, "1 to 4096"; "" if it has none. */
void vshi_key_range(const vshi_key *key, char *text, size_t size);

/* Writes the value of a key in `target`, "64"; "" for other kinds than names and numbers. */
void vshi_key_value(const vshi_key *key, const void *target, char *text, size_t size);
