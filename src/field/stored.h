/* How fields lie in a file (docs/field.md, "The file"). Numbers are little-endian and stand where the
 * structs below have them, so that a machine of that order takes values as they are mapped.
 *
 *     head | records | text | sums        VSHI_STORED_ALIGN bytes, or a multiple
 *     values and index of each field,     each aligned to 64 bytes, zeros between
 *     blocks and masks of its band
 *
 * Nothing of a file is believed: the head is copied and checked member by member, so is each index, and each
 * band once it is asked for; what is mapped is only ever read as heights, of which any will do. Sums tell
 * damage, not malice. */
#ifndef VSHI_FIELD_STORED_H
#define VSHI_FIELD_STORED_H

#include "field/field.h"
#include "levelset/volume.h"

#include <stdbool.h>
#include <vdbshade/field_file.h>

enum {
    VSHI_STORED_FORMAT = 2,
    VSHI_STORED_ALIGN = 4096,
    VSHI_STORED_APART = 64,
    VSHI_STORED_CHUNK = 1 << 20, /* bytes behind the head that have a sum */
    VSHI_STORED_FIELDS = 1024,
    VSHI_STORED_TEXT = 64 << 20,
    VSHI_STORED_NAME = 255,
    VSHI_STORED_VERSION = 32
};

#define VSHI_STORED_MAGIC "VSHFIELD"

typedef struct vshi_stored_head {
    char magic[8];
    uint32_t format;
    uint32_t field_count;
    char version[VSHI_STORED_VERSION]; /* of the library; zeros behind it */
    uint64_t file_bytes;
    uint64_t head_bytes; /* with records, text and sums */
    uint64_t text_bytes;
    uint64_t chunk_count;
    uint64_t attribute_count; /* of the file: the first texts, each a name and a value */
    uint64_t reserved[3];
    uint64_t sum; /* of the head with this as 0 */
} vshi_stored_head;

typedef struct vshi_stored_level {
    int32_t origin[3];
    int32_t size[3];
    uint64_t value_count; /* with those of the two constant bricks */
    uint64_t brick_count;
    float band;
    float quantum;
} vshi_stored_level;

/* Which voxels the level set's band has: masks of blocks of the finest level. Their values are the level's,
 * rounded. */
typedef struct vshi_stored_band {
    vshi_map map;         /* of the level set */
    uint64_t block_count; /* 0: it is not kept, and all is 0 */
    uint64_t blocks_at;   /* uint32_t [block_count]: their numbers in the level, rising */
    uint64_t masks_at;    /* uint64_t [block_count][8]: vshi_block.mask */
} vshi_stored_band;

/* Its texts follow those of the record before: the name, then its attributes. */
typedef struct vshi_stored_field {
    double to_field[12];
    double voxel_size;
    double shell_thickness;
    double half_width;
    double world_min[3];
    double world_max[3];
    float bounds_min[3];
    float bounds_max[3];
    uint64_t active_voxels;
    uint64_t grid_bytes;
    uint64_t attribute_count;
    uint64_t values_at; /* these two from the file's begin, bytes */
    uint64_t index_at;
    uint64_t value_count;
    uint64_t index_count;
    uint32_t level_count;
    uint32_t reserved;
    vshi_stored_band band;
    vshi_stored_level levels[VSHI_MAX_LEVELS];
} vshi_stored_field;

_Static_assert(sizeof(vshi_stored_head) == 120, "no padding");
_Static_assert(sizeof(vshi_stored_level) == 48, "no padding");
_Static_assert(sizeof(vshi_stored_band) == 192, "no padding");
_Static_assert(sizeof(vshi_stored_field) == 256 + 192 + 48 * VSHI_MAX_LEVELS, "no padding");

struct vsh_field_file {
    char *path;
    char *head; /* head_bytes: records and texts */
    const char *mapped;
    uint64_t bytes;
    size_t count;
    vsh_field *fields;         /* [count]: without surfaces; their values are mapped */
    vsh_kept_field *kept;      /* [count] */
    vsh_attribute *attributes; /* all: of the file, then of the fields */
    size_t attribute_count;    /* of the file */
};

static inline bool vshi_stored_native(void) {
    return __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
}

static inline uint64_t vshi_stored_align(uint64_t at, uint64_t align) {
    return (at + align - 1) / align * align;
}

/* Record `i` behind a head. */
static inline vshi_stored_field *vshi_stored_record(char *head, size_t i) {
    return (vshi_stored_field *)(head + sizeof(vshi_stored_head)) + i;
}

/* A sum of bytes; `count` may be 0. */
uint64_t vshi_stored_sum(const void *bytes, size_t count);

/* Fills a field from its record, all but index and values. Errors: VSH_ERROR_READ, with `path`, the field's
 * number and the member: what does not fit together, or into `file_bytes`. */
vsh_result vshi_stored_field_check(const char *path, size_t number, const vshi_stored_field *record,
                                   uint64_t head_bytes, uint64_t file_bytes, vsh_field *field,
                                   vsh_error *error);

/* Checks what index and values hold: the constant bricks, and that each block's brick is among its level's.
 * Errors: VSH_ERROR_READ, likewise. */
vsh_result vshi_stored_index_check(const char *path, size_t number, const vsh_field *field, vsh_error *error);

/* Whether voxels are of the lattice that a field is on, as far as doubles can tell. */
bool vshi_band_fits(const vsh_field *field, const vsh_voxels *band);

/* Bytes that a band of so many blocks takes in a file. */
static inline uint64_t vshi_stored_band_bytes(uint64_t blocks) {
    return vshi_stored_align(blocks * sizeof(uint32_t), VSHI_STORED_APART) +
           blocks * VSHI_MASK_WORDS * sizeof(uint64_t);
}

#endif
