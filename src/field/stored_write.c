/* Writing fields to a file. */
#include "base/attributes.h"
#include "base/file.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "field/level.h"
#include "field/stored.h"

#include <stdlib.h>
#include <string.h>

typedef struct storing {
    const char *path;
    vsh_kept_field *fields; /* [count]: of this version's size */
    size_t count;
    const vsh_attribute *attributes;
    size_t attribute_count;
    char *head; /* records, texts and sums with it */
    uint64_t head_bytes, text_bytes, file_bytes;
    char *chunk; /* bytes on their way to the file: VSHI_STORED_CHUNK */
    size_t filled;
    uint64_t written; /* behind the head; of whole chunks */
    vshi_sink sink;
    vshi_job *job;
} storing;

static vshi_stored_head *head_of(const storing *s) {
    return (vshi_stored_head *)s->head;
}

static vshi_stored_field *record_of(const storing *s, size_t i) {
    return vshi_stored_record(s->head, i);
}

static bool is_name(const char *name) {
    size_t length = 0;
    for (; name != NULL && name[length] != '\0'; ++length) {
        if ((unsigned char)name[length] < ' ' || name[length] == 0x7f || length == VSHI_STORED_NAME) {
            return false;
        }
    }
    return name != NULL;
}

static vsh_result check_field(const storing *s, size_t i, vsh_error *error) {
    const vsh_kept_field *kept = &s->fields[i];
    if (kept->field == NULL || kept->field->unknown || vshi_field_is_empty(kept->field)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: fields[%zu]: %s", s->path, i,
                         kept->field == NULL ? "is NULL" : "has no voxels");
    }
    if (!is_name(kept->name)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: fields[%zu]: its name is NULL, longer than %d bytes or has control characters",
                         s->path, i, VSHI_STORED_NAME);
    }
    for (size_t other = 0; other < i; ++other) {
        if (strcmp(kept->name, s->fields[other].name) == 0) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "%s: fields[%zu]: '%s' is the name of fields[%zu] too", s->path, i, kept->name,
                             other);
        }
    }
    if (kept->origin_count > 0 && kept->origin == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: fields[%zu]: origin is NULL", s->path, i);
    }
    if (kept->band != NULL && !vshi_band_fits(kept->field, kept->band)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: fields[%zu]: its band is none of the level set that it was made from", s->path,
                         i);
    }
    return vshi_attributes_check(s->path, kept->origin, kept->origin_count, error);
}

/* --- the head */

static uint64_t text_bytes(const vsh_attribute *attributes, size_t count) {
    uint64_t bytes = 0;
    for (size_t i = 0; i < count; ++i) {
        bytes += strlen(attributes[i].name) + strlen(attributes[i].value) + 2;
    }
    return bytes;
}

static size_t band_blocks(const vsh_kept_field *kept) {
    size_t count = 0;
    if (kept->band != NULL) {
        vshi_voxels_blocks(kept->band, &count);
    }
    return count;
}

static uint64_t block_count(const vsh_field *field) {
    const vshi_level *top = &field->levels[field->level_count - 1];
    return top->first_index + (uint64_t)top->size[0] * (uint64_t)top->size[1] * (uint64_t)top->size[2];
}

static uint64_t place(uint64_t *at, uint64_t bytes) {
    const uint64_t here = *at;
    *at = vshi_stored_align(here + bytes, VSHI_STORED_APART);
    return here;
}

static vsh_result fill_record(const vsh_kept_field *kept, vshi_stored_field *r, uint64_t *at,
                              vsh_error *error) {
    const vsh_field *f = kept->field;
    memcpy(r->to_field, f->to_field, sizeof r->to_field);
    memcpy(r->world_min, f->world_min, sizeof r->world_min);
    memcpy(r->world_max, f->world_max, sizeof r->world_max);
    memcpy(r->bounds_min, f->bounds_min, sizeof r->bounds_min);
    memcpy(r->bounds_max, f->bounds_max, sizeof r->bounds_max);
    r->voxel_size = f->voxel_size;
    r->shell_thickness = f->shell_thickness;
    r->half_width = kept->half_width;
    r->active_voxels = f->active_voxels;
    r->grid_bytes = kept->grid_bytes;
    r->attribute_count = kept->origin_count;
    r->value_count = f->value_count;
    r->index_count = block_count(f);
    r->level_count = (uint32_t)f->level_count;
    for (int32_t l = 0; l < f->level_count; ++l) {
        const vshi_level *level = &f->levels[l];
        const uint64_t end = l + 1 < f->level_count ? level[1].first_value : f->value_count;
        vshi_stored_level *to = &r->levels[l];
        memcpy(to->origin, level->origin, sizeof to->origin);
        memcpy(to->size, level->size, sizeof to->size);
        to->value_count = end - level->first_value;
        to->brick_count = level->brick_count;
        to->band = level->band;
        to->quantum = level->quantum;
    }
    r->values_at = place(at, r->value_count * sizeof(int16_t));
    r->index_at = place(at, r->index_count * sizeof(int32_t));
    const size_t blocks = band_blocks(kept);
    if (blocks == 0) {
        return VSH_OK;
    }
    r->band.block_count = blocks;
    r->band.blocks_at = place(at, blocks * sizeof(uint32_t));
    r->band.masks_at = place(at, blocks * VSHI_MASK_WORDS * sizeof(uint64_t));
    return vshi_voxels_map(kept->band, &r->band.map, error);
}

static char *put_text(char *at, const char *text) {
    const size_t size = strlen(text) + 1;
    memcpy(at, text, size);
    return at + size;
}

static char *put_attributes(char *at, const vsh_attribute *attributes, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        at = put_text(put_text(at, attributes[i].name), attributes[i].value);
    }
    return at;
}

/* Everything but the sums. */
static vsh_result make_head(storing *s, const vsh_run *run, vsh_error *error) {
    uint64_t body = 0;
    s->text_bytes = text_bytes(s->attributes, s->attribute_count);
    for (size_t i = 0; i < s->count; ++i) {
        s->text_bytes +=
            strlen(s->fields[i].name) + 1 + text_bytes(s->fields[i].origin, s->fields[i].origin_count);
        const vsh_field *f = s->fields[i].field;
        body += vshi_stored_align(f->value_count * sizeof(int16_t), VSHI_STORED_APART) +
                vshi_stored_align(block_count(f) * sizeof(int32_t), VSHI_STORED_APART) +
                vshi_stored_band_bytes(band_blocks(&s->fields[i]));
    }
    if (s->text_bytes > VSHI_STORED_TEXT) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: names and attributes of more than %d bytes", s->path,
                         VSHI_STORED_TEXT);
    }
    const uint64_t chunks = (body + VSHI_STORED_CHUNK - 1) / VSHI_STORED_CHUNK;
    const uint64_t needs = sizeof(vshi_stored_head) + s->count * sizeof(vshi_stored_field) + s->text_bytes;
    s->head_bytes = vshi_stored_align(vshi_stored_align(needs, 8) + 8 * chunks, VSHI_STORED_ALIGN);
    s->file_bytes = s->head_bytes + body;
    VSHI_TRY(vshi_check_limit(run, (double)s->head_bytes + VSHI_STORED_CHUNK, s->path, error));
    VSHI_TRY(vshi_allocate((void **)&s->head, (size_t)s->head_bytes, 1, "head of fields", error));
    VSHI_TRY(vshi_allocate((void **)&s->chunk, VSHI_STORED_CHUNK, 1, "fields", error));
    vshi_stored_head *head = head_of(s);
    memcpy(head->magic, VSHI_STORED_MAGIC, sizeof head->magic);
    head->format = VSHI_STORED_FORMAT;
    head->field_count = (uint32_t)s->count;
    memcpy(head->version, vsh_version(), strlen(vsh_version()));
    head->file_bytes = s->file_bytes;
    head->head_bytes = s->head_bytes;
    head->text_bytes = s->text_bytes;
    head->chunk_count = chunks;
    head->attribute_count = s->attribute_count;
    uint64_t at = s->head_bytes;
    char *text = s->head + sizeof *head + s->count * sizeof(vshi_stored_field);
    text = put_attributes(text, s->attributes, s->attribute_count);
    for (size_t i = 0; i < s->count; ++i) {
        VSHI_TRY(fill_record(&s->fields[i], record_of(s, i), &at, error));
        text =
            put_attributes(put_text(text, s->fields[i].name), s->fields[i].origin, s->fields[i].origin_count);
    }
    return VSH_OK;
}

/* --- what follows it */

static uint64_t *sums_of(const storing *s) {
    const uint64_t needs = sizeof(vshi_stored_head) + s->count * sizeof(vshi_stored_field) + s->text_bytes;
    return (uint64_t *)(s->head + vshi_stored_align(needs, 8));
}

static vsh_result flush(storing *s, vsh_error *error) {
    if (s->filled > 0) {
        sums_of(s)[s->written / VSHI_STORED_CHUNK] = vshi_stored_sum(s->chunk, s->filled);
        vshi_sink_write(&s->sink, s->chunk, s->filled, s->head_bytes + s->written);
        s->written += s->filled;
        s->filled = 0;
    }
    if (s->sink.error != 0) {
        return VSH_OK; /* told where it is closed */
    }
    return vshi_job_advance(s->job, 1) ? vshi_job_fail_cancelled(s->job, error) : VSH_OK;
}

/* Adds bytes (NULL: zeros). */
static vsh_result put(storing *s, const void *bytes, uint64_t count, vsh_error *error) {
    const char *from = bytes;
    while (count > 0) {
        const size_t room = VSHI_STORED_CHUNK - s->filled, now = count < room ? (size_t)count : room;
        if (from != NULL) {
            memcpy(s->chunk + s->filled, from, now);
            from += now;
        } else {
            memset(s->chunk + s->filled, 0, now);
        }
        s->filled += now;
        count -= now;
        if (s->filled == VSHI_STORED_CHUNK) {
            VSHI_TRY(flush(s, error));
        }
    }
    return VSH_OK;
}

static vsh_result put_aligned(storing *s, const void *bytes, uint64_t count, vsh_error *error) {
    VSHI_TRY(put(s, bytes, count, error));
    const uint64_t at = s->written + s->filled; /* chunks and the head end at multiples */
    return put(s, NULL, vshi_stored_align(at, VSHI_STORED_APART) - at, error);
}

static vsh_result put_band(storing *s, const vsh_kept_field *kept, vsh_error *error) {
    const vshi_level *level = &kept->field->levels[0];
    size_t count;
    const vshi_block *blocks = vshi_voxels_blocks(kept->band, &count);
    for (size_t i = 0; i < count; ++i) {
        const uint32_t number = vshi_block_number(level->origin, level->size, blocks[i].origin);
        VSHI_TRY(put(s, &number, sizeof number, error));
    }
    VSHI_TRY(put_aligned(s, NULL, 0, error));
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY(put(s, blocks[i].mask, sizeof blocks[i].mask, error));
    }
    return VSH_OK;
}

static vsh_result put_fields(storing *s, vsh_error *error) {
    for (size_t i = 0; i < s->count; ++i) {
        const vsh_field *f = s->fields[i].field;
        VSHI_TRY(put_aligned(s, f->values, f->value_count * sizeof *f->values, error));
        VSHI_TRY(put_aligned(s, f->index, block_count(f) * sizeof *f->index, error));
        if (band_blocks(&s->fields[i]) > 0) {
            VSHI_TRY(put_band(s, &s->fields[i], error));
        }
    }
    return flush(s, error);
}

static vsh_result store(storing *s, vsh_error *error) {
    vshi_output output;
    VSHI_TRY(vshi_output_begin(&output, s->path, error));
    s->sink = vshi_sink_open(output.temporary);
    vsh_result result = put_fields(s, error);
    if (result == VSH_OK) {
        vshi_stored_head *head = head_of(s);
        head->sum = vshi_stored_sum(s->head, (size_t)s->head_bytes);
        vshi_sink_write(&s->sink, s->head, (size_t)s->head_bytes, 0);
    }
    const int failed = vshi_sink_close(&s->sink);
    if (result == VSH_OK && failed != 0) {
        result = vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", s->path, strerror(failed));
    }
    if (result != VSH_OK) {
        vshi_output_abandon(&output);
        return result;
    }
    return vshi_output_commit(&output, error);
}

/* Takes the caller's structs, of whatever version. */
static vsh_result take_fields(storing *s, const vsh_kept_field *fields, vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)&s->fields, s->count, sizeof *s->fields, "fields", error));
    for (size_t i = 0; i < s->count; ++i) {
        const char *at = (const char *)fields + i * fields->struct_size;
        s->fields[i] = vsh_kept_field_default();
        VSHI_TRY(vshi_options_resolve(at, &s->fields[i], sizeof s->fields[i], "vsh_kept_field", error));
        VSHI_TRY(check_field(s, i, error));
    }
    return VSH_OK;
}

vsh_result vsh_field_file_write(const char *path, const vsh_kept_field *fields, size_t count,
                                const vsh_attribute *attributes, size_t attribute_count, const vsh_run *run,
                                vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(path);
    VSHI_NEEDS(fields);
    VSHI_NEEDS_OF(attribute_count, attributes);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (!vshi_stored_native()) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: is for little-endian machines", path);
    }
    if (count < 1 || count > VSHI_STORED_FIELDS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %zu fields: expected 1 … %d", path, count,
                         VSHI_STORED_FIELDS);
    }
    VSHI_TRY(vshi_attributes_check(path, attributes, attribute_count, error));
    storing s = {.path = path, .count = count, .attributes = attributes, .attribute_count = attribute_count};
    vsh_result result;
    VSHI_TRY_DONE(take_fields(&s, fields, error));
    VSHI_TRY_DONE(make_head(&s, &full, error));
    s.job = vshi_job_begin(&full, "write", (size_t)head_of(&s)->chunk_count + 1);
    if (s.job == NULL) {
        VSHI_TRY_DONE(vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path));
    }
    result = store(&s, error);
done:
    vshi_job_end(s.job);
    free(s.chunk);
    free(s.head);
    free(s.fields);
    return result;
}
