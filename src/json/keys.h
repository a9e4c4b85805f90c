/* Objects read through tables of keys: name, type, range, place in a struct. */
#ifndef VSHI_KEYS_H
#define VSHI_KEYS_H

#include "json/json.h"

/* Magnitudes over this are no scene: a double then no longer tells points a unit apart, and products of a few
 * such numbers are not finite. */
#define VSHI_LARGEST 1e15
/* Limits of the library for lengths of voxels and of AO. A scene can be smaller or larger. */
#define VSHI_SMALLEST_LENGTH 1e-12
#define VSHI_LARGEST_VOXEL 1e12
#define VSHI_PI 3.14159265358979323846

typedef enum vshi_kind {
    VSHI_NUMBER,  /* double */
    VSHI_DEGREES, /* double, kept as radians */
    VSHI_INTEGER, /* int32_t */
    VSHI_BOOL,    /* int32_t */
    VSHI_VECTOR,  /* double[count] */
    VSHI_NAME,    /* int32_t: a name's number */
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
typedef vsh_result vshi_read_fn(vshi_json *reader, const vshi_value *value, void *member);

/* How a key is given as a text, on a command line say, and told of. All zero: it stands in files alone. */
typedef struct vshi_option {
    const char *name;      /* "max-error" */
    const char *value;     /* what stands for the value: "N", "VOXELS"; NULL: of VSHI_BOOL */
    const char *help;      /* what it is for, without range and default */
    const char *range;     /* of VSHI_CUSTOM, and where numbers do not say it: in words */
    const char *otherwise; /* what holds without it, where that is not its default's number or name */
    int32_t group;         /* the caller's */
    bool by;               /* numbers have an x between them, not a comma */
} vshi_option;

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
    int32_t names;         /* VSH_NAMES_…, if name_of is NULL */
    vshi_name_fn *name_of; /* other names */
    vshi_read_fn *read;
    void (*then)(void *target); /* after it was read: what else follows for the struct; may be NULL */
    vshi_option option;
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
vsh_result vshi_read_object(vshi_json *reader, const vshi_value *object, const vshi_table *table,
                            uint32_t variant, const char *what, void *target);

/* Reads one value as `key` says into `member`. */
vsh_result vshi_read_value(vshi_json *reader, const vshi_value *value, const vshi_key *key, void *member);

/* Reads a text as `key` says into `target`: numbers with commas between them, names, VSHI_BOOL "true",
 * "false", or NULL for true. Strings are kept as the pointers that they are. Errors: VSH_ERROR_INPUT, "NAME
 * 'TEXT': expected …"; VSH_ERROR_MEMORY. */
vsh_result vshi_read_text(const vshi_key *key, const char *name, const char *text, void *target,
                          vsh_error *error);

/* What vshi_read_text() takes, in words: "a whole number from 1 to 4096"; and the range alone, "1 to 4096",
 * or
 * "" where there is none to tell. */
void vshi_key_expected(const vshi_key *key, char *text, size_t size);
void vshi_key_range(const vshi_key *key, char *text, size_t size);

/* What `target` holds, "64"; "" where it holds nothing that is not off. */
void vshi_key_value(const vshi_key *key, const void *target, char *text, size_t size);

/* Name of a value of a VSHI_NAME key, NULL behind the last. */
const char *vshi_key_name(const vshi_key *key, int32_t i);

/* Reads the value of a VSHI_NAME key before the rest of its object; keeps *index if there is no such key. */
vsh_result vshi_read_choice(vshi_json *reader, const vshi_value *object, const vshi_key *key, int32_t *index);

/* Fails where `value` is not of a JSON type. */
vsh_result vshi_expect(const vshi_json *reader, const vshi_value *value, json_type type);

/* Reads an array of objects, each into an item of `item_size` bytes, with `read`. */
vsh_result vshi_read_list(vshi_json *reader, const vshi_value *array, size_t lowest, size_t highest,
                          size_t item_size, vshi_read_fn *read, void **items, size_t *count);

#endif
