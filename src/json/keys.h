/* Objects read through tables of keys: name, type, range, place in a struct. */
#ifndef VSHI_KEYS_H
#define VSHI_KEYS_H

#include "json/reader.h"

/* Magnitudes over this are no scene: a double then no longer tells points a unit apart, and products of a few
 * such numbers are not finite. */
#define VSHI_LARGEST 1e15
#define VSHI_PI 3.14159265358979323846

typedef enum vshi_kind {
    VSHI_NUMBER,  /* double */
    VSHI_DEGREES, /* double, kept as radians */
    VSHI_INTEGER, /* int32_t */
    VSHI_BOOL,    /* int32_t */
    VSHI_VECTOR,  /* double[count] */
    VSHI_NAME,    /* int32_t: number of the name that `name_of` gives back */
    VSHI_STRING,  /* const char *, not empty */
    VSHI_PATH,    /* const char *, behind the folder of the scene file unless it is absolute */
    VSHI_CUSTOM,  /* what `read` makes of it */
    VSHI_LATER    /* read by the caller, before or after the rest */
} vshi_kind;

enum {
    VSHI_ABOVE = 1,   /* the range's lower end is excluded */
    VSHI_BELOW = 2,   /* the range's upper end is excluded */
    VSHI_NONZERO = 4, /* a vector's length must not be 0 */
};

/* Name of value i, NULL behind the last. */
typedef const char *vshi_name_fn(int32_t i);

/* Reads a value into the struct's member at the key's offset. */
typedef vsh_result vshi_read_fn(vshi_reader *reader, const vshi_value *value, void *member);

typedef struct vshi_key {
    const char *name;
    vshi_kind kind;
    uint32_t variants; /* bits of the variants of the object that have this key; 0: all */
    uint32_t required; /* bits of those that cannot do without */
    size_t offset;
    double lowest; /* numbers, and each number of a vector */
    double highest;
    int32_t flags;
    int32_t count;
    vshi_name_fn *name_of;
    vshi_read_fn *read;
} vshi_key;

#define VSHI_ALL UINT32_MAX

typedef struct vshi_table {
    const vshi_key *keys;
    size_t key_count;
} vshi_table;

#define VSHI_TABLE(keys)                                                                                     \
    { keys, sizeof(keys) / sizeof((keys)[0]) }

/* Reads an object's members, in the order of the text, into `target`. `variant` is one bit; `what` describes
 * the object ("a spot light"). Errors: VSH_ERROR_INPUT at the first key that is unknown, not of this variant,
 * missing, of the wrong type or out of range. */
vsh_result vshi_read_object(vshi_reader *reader, const vshi_value *object, const vshi_table *table,
                            uint32_t variant, const char *what, void *target);

/* Reads one value as `key` says into `member`. */
vsh_result vshi_read_value(vshi_reader *reader, const vshi_value *value, const vshi_key *key, void *member);

/* Number of the name that is the value of `key`; *index is left alone where there is no such key. */
vsh_result vshi_read_choice(vshi_reader *reader, const vshi_value *object, const char *key,
                            vshi_name_fn *name_of, int32_t *index);

/* Fails where `value` is not of a JSON type. */
vsh_result vshi_expect(const vshi_reader *reader, const vshi_value *value, json_type type);

/* Reads an array of objects, each into an item of `item_size` bytes, with `read`. */
vsh_result vshi_read_list(vshi_reader *reader, const vshi_value *array, size_t lowest, size_t highest,
                          size_t item_size, vshi_read_fn *read, void **items, size_t *count);

#endif
