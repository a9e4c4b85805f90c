/* Fields in a file: made once, and mapped into memory by whoever shades with them (docs/field.md). */
#ifndef VDBSHADE_FIELD_FILE_H
#define VDBSHADE_FIELD_FILE_H

#include "field.h"
#include "voxels.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A field of a file, or one that is to be written there. A view; nothing is owned. */
typedef struct vsh_kept_field {
    size_t struct_size;
    const char *name;       /* UTF-8 without control characters, at most 255 bytes; may be "". No two of a
                               file are alike */
    const vsh_field *field; /* with all of its levels; of a file it holds no surface */
    double half_width;      /* these two of the level set that it was made from, as in vsh_grid_info */
    uint64_t grid_bytes;    /* 0: not known */
    const vsh_attribute *origin; /* [origin_count]: what shaped it, in words of whoever wrote the file */
    size_t origin_count;
    const vsh_voxels *band; /* of that level set all of its band, as vsh_voxels_from_grid() makes it with a
                               band of 0; NULL: it is not kept, and of a file: vsh_field_file_band() */
    uint64_t band_bytes;    /* of a file: that its band takes there, 0: it keeps none. Not read where it is
                               written */
} vsh_kept_field;

static inline vsh_kept_field vsh_kept_field_default(void) {
    vsh_kept_field field = {sizeof(vsh_kept_field), "", NULL, 3.0, 0, NULL, 0, NULL, 0};
    return field;
}

/* Writes fields[count], all of one struct_size, to a file, with attributes[attribute_count] for people (may
 * be NULL where that is 0). It is of this version of the library and of no other. The same fields give the
 * same bytes. Atomic: written beside `path` and renamed. Errors:
 * - VSH_ERROR_ARGUMENT: path empty, no fields, more than 1024, a field NULL, one that holds nothing or knows
 *   no distances, a band that is no level set's or another's, names or attributes other than said here and
 *   in vsh_attribute, run;
 * - VSH_ERROR_LIMIT: run->memory_limit, by what the fields take; texts of more than 64 MiB;
 * - VSH_ERROR_WRITE: no such folder, no permission, a folder or device in the way, disk full;
 * - VSH_ERROR_UNSUPPORTED: a machine that is not little-endian;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED (under the stage "write"). */
VSH_API vsh_result vsh_field_file_write(const char *path, const vsh_kept_field *fields, size_t count,
                                        const vsh_attribute *attributes, size_t attribute_count,
                                        const vsh_run *run, vsh_error *error);

/* A file that is open and has passed all checks. Immutable; may be shared by threads. Close it with
 * vsh_field_file_close(). */
typedef struct vsh_field_file vsh_field_file;

/* Opens a file: reads and checks all of it, and maps its values, which processes then share. Nobody may write
 * into the file while it is open, or cut it (the system then ends the process): who makes it anew replaces
 * it, as vsh_field_file_write() does. Errors, each of which says what is wrong:
 * - VSH_ERROR_ARGUMENT: path or file NULL, run;
 * - VSH_ERROR_READ: no such file, no permission, no regular file, no file of fields, cut short, damaged;
 * - VSH_ERROR_INPUT: of another version of the format or of the library;
 * - VSH_ERROR_LIMIT: run->memory_limit, against what it takes once mapped;
 * - VSH_ERROR_UNSUPPORTED: a machine that is not little-endian;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED (under the stage "load"). */
VSH_API vsh_result vsh_field_file_open(const char *path, const vsh_run *run, vsh_field_file **file,
                                       vsh_error *error);
VSH_API void vsh_field_file_close(vsh_field_file *file); /* NULL does nothing */

/* 1 where a file begins as one of fields does, whatever its name; 0 else, and where it cannot be read. */
VSH_API int32_t vsh_field_file_is(const char *path);

/* Its path, as it was opened; bytes; fields; and attributes, (*count) of them. All belong to the file. Cannot
 * fail. */
VSH_API const char *vsh_field_file_path(const vsh_field_file *file);
VSH_API uint64_t vsh_field_file_bytes(const vsh_field_file *file);
VSH_API size_t vsh_field_file_count(const vsh_field_file *file);
VSH_API const vsh_attribute *vsh_field_file_attributes(const vsh_field_file *file, size_t *count);

/* Field `index` (< count): a view that belongs to the file. Cannot fail. */
VSH_API void vsh_field_file_get_sized(const vsh_field_file *file, size_t index, vsh_kept_field *field,
                                      size_t field_size);
static inline void vsh_field_file_get(const vsh_field_file *file, size_t index, vsh_kept_field *field) {
    vsh_field_file_get_sized(file, index, field, sizeof *field);
}

/* Field `index` as vsh_field_create() makes it with these options (NULL: their default) of the level set that
 * it was made from, bit by bit; its values stay the file's, which must outlive it. Free it with
 * vsh_field_free(). Errors:
 * - VSH_ERROR_ARGUMENT: a pointer NULL, an index beyond the file's, a reach that is negative or not finite,
 * options, run;
 * - VSH_ERROR_INPUT: a reach farther than its levels go;
 * - VSH_ERROR_LIMIT: run->memory_limit;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_field_file_field(const vsh_field_file *file, size_t index,
                                        const vsh_field_options *options, const vsh_run *run,
                                        vsh_field **field, vsh_error *error);

/* The voxels of the band of the level set that field `index` was made from, as vsh_voxels_from_grid() makes
 * them of it, bit by bit: all of it (`band` 0, or its half width). They need neither file nor field. Free
 * with vsh_voxels_free(). Errors:
 * - VSH_ERROR_ARGUMENT: a pointer NULL, an index beyond the file's, a band that is negative, not finite or
 *   wider than the level set's, run;
 * - VSH_ERROR_INPUT: the file keeps no band of this field, or is asked for a narrower one, which distances
 *   of 16 bits cannot tell;
 * - VSH_ERROR_READ: damaged;
 * - VSH_ERROR_LIMIT: run->memory_limit, or the machine's memory;
 * - VSH_ERROR_UNSUPPORTED: the module of level sets cannot be loaded;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_field_file_band(const vsh_field_file *file, size_t index, double band,
                                       const vsh_run *run, vsh_voxels **voxels, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
