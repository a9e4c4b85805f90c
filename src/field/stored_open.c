/* Opening a file of fields. */
#define _GNU_SOURCE
#include "base/floats.h"
#include "base/input.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "field/level.h"
#include "field/stored.h"

#include <errno.h>
#include <inttypes.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

static const uint64_t LARGEST = (uint64_t)1 << 50;

static vsh_result damaged(const char *path, const char *what, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: damaged: %s", path, what);
}

static vsh_result read_bytes(FILE *file, const char *path, void *to, size_t count, vsh_error *error) {
    errno = 0;
    if (fread(to, 1, count, file) == count) {
        return VSH_OK;
    }
    return ferror(file) ? vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path, strerror(errno))
                        : vshi_fail(error, VSH_ERROR_READ, "%s: is cut short", path);
}

/* What kind of file it is, and whose. */
static vsh_result check_kind(const char *path, const vshi_stored_head *head, vsh_error *error) {
    if (memcmp(head->magic, VSHI_STORED_MAGIC, sizeof head->magic) != 0) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: is no file of fields", path);
    }
    if (head->format != VSHI_STORED_FORMAT) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: is of format %" PRIu32 " of such files, this version reads %d: make it anew",
                         path, head->format, VSHI_STORED_FORMAT);
    }
    return VSH_OK;
}

static vsh_result check_version(const char *path, const vshi_stored_head *head, vsh_error *error) {
    char version[VSHI_STORED_VERSION + 1] = "";
    for (size_t i = 0; i < VSHI_STORED_VERSION && head->version[i] != '\0'; ++i) {
        version[i] = head->version[i] >= ' ' && head->version[i] <= '~' ? head->version[i] : '?';
    }
    const size_t length = strlen(version);
    for (size_t i = length; i < VSHI_STORED_VERSION; ++i) {
        version[length] = head->version[i] != '\0' ? '?' : version[length];
    }
    return strcmp(version, vsh_version()) == 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT,
                           "%s: is of vdbshade %s, this is %s, whose fields may differ: make it anew", path,
                           version, vsh_version());
}

/* Whether the counts of the head make up its bytes, and the file's. */
static vsh_result check_sizes(const char *path, const vshi_stored_head *head, uint64_t size,
                              vsh_error *error) {
    if (head->file_bytes > size) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: is cut short: %" PRIu64 " bytes, its head says %" PRIu64,
                         path, size, head->file_bytes);
    }
    if (head->file_bytes < size) {
        return damaged(path, "bytes behind its end", error);
    }
    if (head->field_count < 1 || head->field_count > VSHI_STORED_FIELDS || head->reserved[0] != 0 ||
        head->reserved[1] != 0 || head->reserved[2] != 0 || head->text_bytes > VSHI_STORED_TEXT ||
        head->attribute_count > VSHI_STORED_TEXT || head->head_bytes > head->file_bytes ||
        head->head_bytes % VSHI_STORED_ALIGN != 0) {
        return damaged(path, "its head's counts are out of range", error);
    }
    const uint64_t chunks = (head->file_bytes - head->head_bytes + VSHI_STORED_CHUNK - 1) / VSHI_STORED_CHUNK;
    const uint64_t needs = sizeof *head + head->field_count * sizeof(vshi_stored_field) + head->text_bytes;
    if (head->chunk_count != chunks ||
        head->head_bytes != vshi_stored_align(vshi_stored_align(needs, 8) + 8 * chunks, VSHI_STORED_ALIGN)) {
        return damaged(path, "its head is not as long as what is in it", error);
    }
    return VSH_OK;
}

/* Reads the head, up to what is mapped. */
static vsh_result read_head(vsh_field_file *f, FILE *file, const vsh_run *run, vsh_error *error) {
    vshi_stored_head head;
    memset(&head, 0, sizeof head);
    if (f->bytes < sizeof head) { /* no file of fields, or one that is cut short */
        char magic[sizeof head.magic] = "";
        VSHI_TRY(read_bytes(file, f->path, magic, f->bytes < sizeof magic ? 0 : sizeof magic, error));
        return memcmp(magic, VSHI_STORED_MAGIC, sizeof magic) == 0
                   ? vshi_fail(error, VSH_ERROR_READ, "%s: is cut short", f->path)
                   : vshi_fail(error, VSH_ERROR_READ, "%s: is no file of fields", f->path);
    }
    VSHI_TRY(read_bytes(file, f->path, &head, sizeof head, error));
    VSHI_TRY(check_kind(f->path, &head, error));
    VSHI_TRY(check_sizes(f->path, &head, f->bytes, error));
    VSHI_TRY(check_version(f->path, &head, error));
    const double fields = (double)head.field_count * (double)(sizeof *f->fields + sizeof *f->kept);
    VSHI_TRY(vshi_check_limit(run, (double)head.head_bytes + fields + (double)f->bytes, f->path, error));
    VSHI_TRY(vshi_allocate((void **)&f->head, (size_t)head.head_bytes, 1, "head of fields", error));
    memcpy(f->head, &head, sizeof head);
    VSHI_TRY(read_bytes(file, f->path, f->head + sizeof head, (size_t)head.head_bytes - sizeof head, error));
    vshi_stored_head *own = (vshi_stored_head *)f->head;
    own->sum = 0;
    if (vshi_stored_sum(f->head, (size_t)head.head_bytes) != head.sum) {
        return damaged(f->path, "its head's sum is another", error);
    }
    f->count = head.field_count;
    return VSH_OK;
}

static const vshi_stored_head *head_of(const vsh_field_file *f) {
    return (const vshi_stored_head *)f->head;
}

static const vshi_stored_field *record_of(const vsh_field_file *f, size_t i) {
    return vshi_stored_record(f->head, i);
}

/* --- texts */

typedef struct texts {
    const char *at, *end;
} texts;

/* The next text; NULL: there is none, or one that is not ended, too long or has control characters. */
static const char *take_text(texts *t, size_t most) {
    const size_t left = (size_t)(t->end - t->at);
    const char *text = t->at, *end = left > 0 ? memchr(text, '\0', left) : NULL;
    if (end == NULL || (size_t)(end - text) > most) {
        return NULL;
    }
    for (const char *c = text; c < end; ++c) {
        if ((unsigned char)*c < ' ' || *c == 0x7f) {
            return NULL;
        }
    }
    t->at = end + 1;
    return text;
}

static bool take_attributes(texts *t, uint64_t count, vsh_attribute *attributes) {
    for (uint64_t i = 0; i < count; ++i) {
        attributes[i].name = take_text(t, 79);
        attributes[i].value = attributes[i].name != NULL ? take_text(t, 65535) : NULL;
        if (attributes[i].value == NULL) {
            return false;
        }
    }
    return true;
}

static vsh_result read_texts(vsh_field_file *f, vsh_error *error) {
    const vshi_stored_head *head = head_of(f);
    uint64_t count = head->attribute_count;
    for (size_t i = 0; i < f->count; ++i) {
        const uint64_t more = record_of(f, i)->attribute_count;
        if (more > head->text_bytes) {
            return damaged(f->path, "more attributes than texts", error);
        }
        count += more; /* 1024 times 2^26 at most */
    }
    if (count > head->text_bytes / 2) { /* each has two NULs */
        return damaged(f->path, "more attributes than texts", error);
    }
    VSHI_TRY(vshi_allocate((void **)&f->attributes, (size_t)count + 1, sizeof *f->attributes, "attributes",
                           error)); /* there may be none */
    texts t = {.at = f->head + sizeof *head + f->count * sizeof(vshi_stored_field)};
    t.end = t.at + head->text_bytes;
    vsh_attribute *next = f->attributes;
    bool whole = take_attributes(&t, head->attribute_count, next);
    f->attribute_count = (size_t)head->attribute_count;
    next += f->attribute_count;
    for (size_t i = 0; i < f->count && whole; ++i) {
        vsh_kept_field *kept = &f->kept[i];
        *kept = vsh_kept_field_default();
        kept->name = take_text(&t, VSHI_STORED_NAME);
        kept->origin = next;
        kept->origin_count = (size_t)record_of(f, i)->attribute_count;
        kept->field = &f->fields[i];
        kept->half_width = record_of(f, i)->half_width;
        kept->grid_bytes = record_of(f, i)->grid_bytes;
        kept->band_bytes = vshi_stored_band_bytes(record_of(f, i)->band.block_count);
        whole = kept->name != NULL && take_attributes(&t, kept->origin_count, next);
        next += kept->origin_count;
    }
    return whole && t.at == t.end ? VSH_OK : damaged(f->path, "its texts are not as its head says", error);
}

/* --- what is mapped */

typedef struct summing {
    const vsh_field_file *file;
    const uint64_t *sums;
    uint64_t first;
    atomic_int differ;
} summing;

static void check_sums(void *user, size_t begin, size_t end) {
    summing *s = user;
    for (size_t i = begin; i < end; ++i) {
        const uint64_t at = s->first + (uint64_t)i * VSHI_STORED_CHUNK, left = s->file->bytes - at;
        const size_t count = left < VSHI_STORED_CHUNK ? (size_t)left : VSHI_STORED_CHUNK;
        if (vshi_stored_sum(s->file->mapped + at, count) != s->sums[i]) {
            atomic_store(&s->differ, 1);
        }
    }
}

static vsh_result map(vsh_field_file *f, FILE *file, vshi_job *job, vsh_error *error) {
    void *mapped = mmap(NULL, (size_t)f->bytes, PROT_READ, MAP_SHARED, fileno(file), 0);
    if (mapped == MAP_FAILED) {
        return vshi_fail(error, errno == ENOMEM ? VSH_ERROR_MEMORY : VSH_ERROR_READ,
                         "%s: cannot be mapped: %s", f->path, strerror(errno));
    }
    f->mapped = mapped;
    (void)madvise(mapped, (size_t)f->bytes, MADV_WILLNEED);
    const vshi_stored_head *head = head_of(f);
    const size_t chunks = (size_t)head->chunk_count;
    const uint64_t needs = sizeof *head + f->count * sizeof(vshi_stored_field) + head->text_bytes;
    summing s = {f, (const uint64_t *)(f->head + vshi_stored_align(needs, 8)), head->head_bytes, 0};
    VSHI_TRY(vshi_parallel_for(job, chunks, 4, 1, check_sums, &s, error));
    return atomic_load(&s.differ) == 0 ? VSH_OK : damaged(f->path, "the sum of a part is another", error);
}

/* The index is copied before it is checked: whatever becomes of the file, what is looked up lies within. */
static vsh_result take_field(vsh_field_file *f, size_t i, vsh_error *error) {
    const vshi_stored_field *record = record_of(f, i);
    vsh_field *field = &f->fields[i];
    field->values = (int16_t *)(uintptr_t)(f->mapped + record->values_at);
    VSHI_TRY(vshi_allocate((void **)&field->index, (size_t)record->index_count, sizeof *field->index,
                           "blocks of a field", error));
    memcpy(field->index, f->mapped + record->index_at, (size_t)record->index_count * sizeof *field->index);
    return vshi_stored_index_check(f->path, i, field, error);
}

static vsh_result check_fields(vsh_field_file *f, const vsh_run *run, vsh_error *error) {
    double held = (double)f->bytes;
    VSHI_TRY(vshi_allocate((void **)&f->fields, f->count, sizeof *f->fields, "fields", error));
    VSHI_TRY(vshi_allocate((void **)&f->kept, f->count, sizeof *f->kept, "fields", error));
    VSHI_TRY(read_texts(f, error));
    for (size_t i = 0; i < f->count; ++i) {
        const vshi_stored_field *record = record_of(f, i);
        VSHI_TRY(vshi_stored_field_check(f->path, i, record, head_of(f)->head_bytes, f->bytes, &f->fields[i],
                                         error));
        held += (double)record->index_count * sizeof(int32_t);
        for (size_t other = 0; other < i; ++other) {
            if (strcmp(f->kept[i].name, f->kept[other].name) == 0) {
                return damaged(f->path, "two fields of one name", error);
            }
        }
    }
    return vshi_check_limit(run, held, f->path, error);
}

static vsh_result open_file(vsh_field_file *f, FILE *file, const vsh_run *run, vsh_error *error) {
    VSHI_TRY(read_head(f, file, run, error));
    VSHI_TRY(check_fields(f, run, error));
    vshi_job *job = vshi_job_begin(run, "load", (size_t)head_of(f)->chunk_count + 1);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", f->path);
    }
    vsh_result result;
    VSHI_TRY_DONE(map(f, file, job, error));
    for (size_t i = 0; i < f->count; ++i) {
        VSHI_TRY_DONE(take_field(f, i, error));
    }
    result = vshi_job_advance(job, 1) ? vshi_job_fail_cancelled(job, error) : VSH_OK;
done:
    vshi_job_end(job);
    return result;
}

vsh_result vsh_field_file_open(const char *path, const vsh_run *run, vsh_field_file **file,
                               vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(file);
    *file = NULL;
    VSHI_NEEDS(path);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (!vshi_stored_native()) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: is for little-endian machines", path);
    }
    vsh_field_file *f = NULL;
    FILE *opened = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&f, 1, sizeof *f, "file of fields", error));
    f->path = strdup(path);
    if (f->path == NULL) {
        VSHI_TRY_DONE(vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path));
    }
    VSHI_TRY_DONE(vshi_input_open(path, path, LARGEST, &opened, &f->bytes, error));
    VSHI_TRY_DONE(open_file(f, opened, &full, error));
    *file = f;
    f = NULL;
done:
    if (opened != NULL) {
        fclose(opened);
    }
    vsh_field_file_close(f);
    return result;
}

void vsh_field_file_close(vsh_field_file *file) {
    if (file == NULL) {
        return;
    }
    for (size_t i = 0; file->fields != NULL && i < file->count; ++i) {
        free(file->fields[i].index);
    }
    if (file->mapped != NULL) {
        munmap((void *)(uintptr_t)file->mapped, (size_t)file->bytes);
    }
    free(file->attributes);
    free(file->kept);
    free(file->fields);
    free(file->head);
    free(file->path);
    free(file);
}

int32_t vsh_field_file_is(const char *path) {
    FILE *file;
    uint64_t size;
    vsh_error ignored;
    if (path == NULL || vshi_input_open(path, path, UINT64_MAX, &file, &size, &ignored) != VSH_OK) {
        return 0;
    }
    char magic[sizeof VSHI_STORED_MAGIC - 1];
    const bool whole = fread(magic, 1, sizeof magic, file) == sizeof magic;
    fclose(file);
    return whole && memcmp(magic, VSHI_STORED_MAGIC, sizeof magic) == 0;
}

const char *vsh_field_file_path(const vsh_field_file *file) {
    return file->path;
}

uint64_t vsh_field_file_bytes(const vsh_field_file *file) {
    return file->bytes;
}

size_t vsh_field_file_count(const vsh_field_file *file) {
    return file->count;
}

const vsh_attribute *vsh_field_file_attributes(const vsh_field_file *file, size_t *count) {
    *count = file->attribute_count;
    return file->attributes;
}

void vsh_field_file_get_sized(const vsh_field_file *file, size_t index, vsh_kept_field *field,
                              size_t field_size) {
    vshi_give(field, field_size, &file->kept[index], sizeof file->kept[index]);
}
