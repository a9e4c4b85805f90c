#include "bake_scene/part_file.h"

#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"

#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* --- numbers and texts */

void vshi_part_code_bytes(vshi_part_code *code, void *value, size_t size) {
    if (code->failed || size == 0) {
        return;
    }
    if (code->reads) {
        if (size > code->room - code->size) {
            code->failed = true;
            return;
        }
        memcpy(value, code->bytes + code->size, size);
        code->size += size;
        return;
    }
    if (size > code->room - code->size) {
        const size_t room = 2 * (code->size + size) + 4096;
        unsigned char *larger = realloc(code->bytes, room);
        if (larger == NULL) {
            code->failed = true;
            return;
        }
        code->bytes = larger;
        code->room = room;
    }
    memcpy(code->bytes + code->size, value, size);
    code->size += size;
}

void vshi_part_code_u64(vshi_part_code *code, uint64_t *value) {
    vshi_part_code_bytes(code, value, sizeof *value);
}

void vshi_part_code_f64(vshi_part_code *code, double *value) {
    vshi_part_code_bytes(code, value, sizeof *value);
}

void vshi_part_code_i32(vshi_part_code *code, int32_t *value) {
    vshi_part_code_bytes(code, value, sizeof *value);
}

/* The number of elements that follow, each of `least` bytes in the file and `size` in memory, and where they
 * are read their memory. */
void vshi_part_code_count(vshi_part_code *code, uint64_t *count, size_t least, void **list, size_t size) {
    vshi_part_code_u64(code, count);
    if (!code->reads) {
        return;
    }
    *list = NULL;
    if (code->failed || *count > (code->room - code->size) / least) {
        code->failed = true;
        *count = 0;
        return;
    }
    *list = calloc((size_t)*count + 1, size);
    if (*list == NULL) {
        code->failed = true;
        *count = 0;
    }
}

/* With its NUL, which no other is before. */
void vshi_part_code_text(vshi_part_code *code, char **text) {
    uint64_t size = code->reads ? 0 : strlen(*text) + 1;
    if (code->reads) {
        *text = NULL;
    }
    vshi_part_code_count(code, &size, 1, (void **)text, 1);
    if (!code->failed) {
        vshi_part_code_bytes(code, *text, (size_t)size);
    }
    if (code->reads && !code->failed && strlen(*text) + 1 != size) { /* calloc() put a NUL behind all */
        code->failed = true;
    }
}

void vshi_part_code_texts(vshi_part_code *code, char ***texts, uint64_t *count) {
    vshi_part_code_count(code, count, sizeof(uint64_t), (void **)texts, sizeof **texts);
    for (uint64_t i = 0; i < *count && !code->failed; ++i) {
        vshi_part_code_text(code, &(*texts)[i]);
    }
}

/* --- the head */

void vshi_part_about_free(vshi_part_about *about) {
    for (uint64_t i = 0; about->words != NULL && i < about->word_count; ++i) {
        free(about->words[i]);
    }
    for (uint64_t i = 0; about->attributes != NULL && i < about->attribute_count; ++i) {
        free(about->attributes[i].name);
        free(about->attributes[i].value);
    }
    free(about->attributes);
    free(about->words);
    free(about->version);
    *about = (vshi_part_about){.version = NULL};
}

static bool copy_words(const vshi_part_options *options, vshi_part_about *about) {
    about->words = calloc(options->word_count + 1, sizeof *about->words);
    for (size_t i = 0; about->words != NULL && i < options->word_count; ++i) {
        about->words[about->word_count++] = strdup(options->words[i]);
        if (about->words[i] == NULL) {
            return false;
        }
    }
    return about->words != NULL;
}

static bool copy_attributes(const vshi_part_options *options, vshi_part_about *about) {
    about->attributes = calloc(options->attribute_count + 1, sizeof *about->attributes);
    for (size_t i = 0; about->attributes != NULL && i < options->attribute_count; ++i) {
        vshi_part_attribute *attribute = &about->attributes[about->attribute_count++];
        attribute->name = strdup(options->attributes[i].name);
        attribute->value = strdup(options->attributes[i].value);
        if (attribute->name == NULL || attribute->value == NULL) {
            return false;
        }
    }
    return about->attributes != NULL;
}

vsh_result vshi_part_about_make(const vshi_part_options *options, vshi_part_about *about, vsh_error *error) {
    *about = (vshi_part_about){
        .version = strdup(VSHI_VERSION), .shard = options->shard, .shard_count = options->shard_count};
    return about->version != NULL && copy_words(options, about) && copy_attributes(options, about)
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_MEMORY, "part: the system refused memory");
}

void vshi_part_about_code(vshi_part_code *code, vshi_part_about *about) {
    vshi_part_code_text(code, &about->version);
    vshi_part_code_i32(code, &about->shard);
    vshi_part_code_i32(code, &about->shard_count);
    vshi_part_code_texts(code, &about->words, &about->word_count);
    vshi_part_code_count(code, &about->attribute_count, 2 * sizeof(uint64_t), (void **)&about->attributes,
                         sizeof *about->attributes);
    for (uint64_t i = 0; i < about->attribute_count && !code->failed; ++i) {
        vshi_part_code_text(code, &about->attributes[i].name);
        vshi_part_code_text(code, &about->attributes[i].value);
    }
}

vsh_result vshi_part_refuse(const char *path, const char *what, const char *theirs, const char *ours,
                            vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_INPUT,
                     "%s: is of other inputs or options: its %s is '%.160s', of the others or here '%.160s'; "
                     "bake this part again",
                     path, what, theirs, ours);
}

static vsh_result check_attributes(const vshi_part_about *about, const char *path,
                                   const vshi_part_options *options, vsh_error *error) {
    const vsh_attribute *own = options->attributes;
    const size_t count = options->attribute_count;
    for (size_t i = 0; i < count || i < about->attribute_count; ++i) {
        const vshi_part_attribute *part = i < about->attribute_count ? &about->attributes[i] : NULL;
        const vsh_attribute *here = i < count ? &own[i] : NULL;
        if (part == NULL || here == NULL || strcmp(here->name, part->name) != 0 ||
            strcmp(here->value, part->value) != 0) {
            return vshi_part_refuse(path, here != NULL ? here->name : part->name,
                                    part != NULL ? part->value : "", here != NULL ? here->value : "", error);
        }
    }
    return VSH_OK;
}

vsh_result vshi_part_about_check(const vshi_part_about *about, const char *path, int32_t shard,
                                 const vshi_part_options *options, vsh_error *error) {
    if (strcmp(about->version, VSHI_VERSION) != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: is of vdbshade %.32s, this is %s; bake this part again",
                         path, about->version, VSHI_VERSION);
    }
    if (about->shard != shard || about->shard_count != options->shard_count) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: holds part %d of %d; was it renamed?", path,
                         about->shard, about->shard_count);
    }
    return check_attributes(about, path, options, error);
}

/* --- writing */

enum { ROUND = 8 }; /* bytes of a head, for the sum's words */

void vshi_part_output_put(vshi_part_output *part, const void *bytes, size_t size) {
    part->sum = vshi_part_sum(part->sum, bytes, size);
    if (size > 0 && fwrite(bytes, size, 1, part->file) != 1 && part->error == 0) {
        part->error = errno != 0 ? errno : EIO;
    }
}

static vsh_result begin(vshi_part_output *part, const char *path, vshi_part_code *head,
                        const vshi_part_front *front, vsh_error *error) {
    static char zeros[ROUND];
    const size_t more = front->head_bytes - head->size;
    vshi_part_code_bytes(head, zeros, more);
    if (head->failed) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    VSHI_TRY(vshi_output_begin(&part->output, path, error));
    part->file = fopen(part->output.temporary, "wb");
    if (part->file == NULL) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", path, strerror(errno));
    }
    vshi_part_output_put(part, front, sizeof *front);
    vshi_part_output_put(part, head->bytes, head->size);
    return VSH_OK;
}

vsh_result vshi_part_output_begin(vshi_part_output *part, const char *path, vshi_part_code *head,
                                  vsh_error *error) {
    *part = (vshi_part_output){.sum = VSHI_PART_SUM};
    const vshi_part_front front = {VSHI_PART_MAGIC, VSHI_PART_ORDER,
                                   (head->size + ROUND - 1) / ROUND * ROUND};
    const vsh_result result = begin(part, path, head, &front, error);
    free(head->bytes);
    *head = (vshi_part_code){.reads = false};
    if (result != VSH_OK) {
        vshi_part_output_abandon(part);
    }
    return result;
}

vsh_result vshi_part_output_finish(vshi_part_output *part, vsh_error *error) {
    const uint64_t sum = part->sum;
    vshi_part_output_put(part, &sum, sizeof sum);
    if (fclose(part->file) != 0 && part->error == 0) {
        part->error = errno;
    }
    part->file = NULL;
    if (part->error != 0) {
        vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", part->output.target,
                  strerror(part->error));
        vshi_part_output_abandon(part);
        return VSH_ERROR_WRITE;
    }
    return vshi_output_commit(&part->output, error);
}

void vshi_part_output_abandon(vshi_part_output *part) {
    if (part->file != NULL) {
        fclose(part->file);
        part->file = NULL;
    }
    vshi_output_abandon(&part->output);
}

/* --- reading */

enum { MOST_TOLD = 1 << 28, IN_MEMORY = 8, CHUNK = 1 << 20 }; /* bytes; of a byte in memory; read at once */

vsh_result vshi_part_damaged(const char *path, const char *what, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: damaged: %s; bake this part again", path, what);
}

vsh_result vshi_part_read_bytes(FILE *file, const char *path, void *bytes, size_t size, vsh_error *error) {
    return size == 0 || fread(bytes, size, 1, file) == 1
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path,
                           ferror(file) ? strerror(errno) : "it ends early");
}

/* Whether the front is one of ours, and its sizes are those of the file. */
static vsh_result check_front(const char *path, const vshi_part_front *front, uint64_t size,
                              vsh_error *error) {
    if (memcmp(front->magic, VSHI_PART_MAGIC_BEGIN, strlen(VSHI_PART_MAGIC_BEGIN)) != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: is no part of a bake", path);
    }
    if (memcmp(front->magic, VSHI_PART_MAGIC, sizeof front->magic) != 0 || front->order != VSHI_PART_ORDER) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: is of another version of vdbshade, or of another kind of machine; bake this "
                         "part again",
                         path);
    }
    const uint64_t rest = size - sizeof *front - sizeof(uint64_t);
    return front->head_bytes <= rest && front->head_bytes % 8 == 0 && rest % 4 == 0
               ? VSH_OK
               : vshi_part_damaged(path, "it has not the size that it tells", error);
}

/* Reads `size` bytes into memory of its own. */
static vsh_result take(vshi_part_input *part, uint64_t size, const vsh_run *run, vshi_part_code *code,
                       vsh_error *error) {
    *code = (vshi_part_code){.reads = true};
    if (size > MOST_TOLD) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: tells %" PRIu64 " bytes of itself, at most %d",
                         part->path, size, MOST_TOLD);
    }
    VSHI_TRY(vshi_check_limit(run, IN_MEMORY * (double)size, part->path, error));
    VSHI_TRY(vshi_allocate((void **)&code->bytes, (size_t)size + 1, 1, part->path, error));
    code->room = (size_t)size;
    VSHI_TRY(vshi_part_read_bytes(part->file, part->path, code->bytes, (size_t)size, error));
    part->sum = vshi_part_sum(part->sum, code->bytes, (size_t)size);
    return VSH_OK;
}

/* Refuses a file that is too short for a part. */
static vsh_result refuse_short(vshi_part_input *part, vsh_error *error) {
    char magic[sizeof part->front.magic] = "";
    const size_t count = fread(magic, 1, sizeof magic, part->file);
    const size_t begin = strlen(VSHI_PART_MAGIC_BEGIN);
    return count >= begin && memcmp(magic, VSHI_PART_MAGIC_BEGIN, begin) == 0
               ? vshi_part_damaged(part->path, "it ends early", error)
               : vshi_fail(error, VSH_ERROR_INPUT, "%s: is no part of a bake", part->path);
}

vsh_result vshi_part_input_open(const char *path, const vsh_run *run, vshi_part_input *part,
                                vshi_part_about *about, vsh_error *error) {
    *part = (vshi_part_input){.path = path, .sum = VSHI_PART_SUM};
    *about = (vshi_part_about){.version = NULL};
    uint64_t size;
    VSHI_TRY(vshi_input_open(path, path, UINT64_MAX / 2, &part->file, &size, error));
    if (size < sizeof part->front + sizeof(uint64_t)) {
        return refuse_short(part, error);
    }
    VSHI_TRY(vshi_part_read_bytes(part->file, path, &part->front, sizeof part->front, error));
    VSHI_TRY(check_front(path, &part->front, size, error));
    part->body_bytes = size - sizeof part->front - part->front.head_bytes - sizeof(uint64_t);
    part->sum = vshi_part_sum(part->sum, &part->front, sizeof part->front);
    VSHI_TRY(take(part, part->front.head_bytes, run, &part->head, error));
    vshi_part_about_code(&part->head, about);
    if (part->head.failed) {
        return vshi_part_damaged(path, "its head", error);
    }
    return about->shard_count >= 1 && about->shard >= 1 && about->shard <= about->shard_count
               ? VSH_OK
               : vshi_part_damaged(path, "its number", error);
}

vsh_result vshi_part_input_end_head(const vshi_part_input *part, vsh_error *error) {
    return !part->head.failed && part->head.room - part->head.size < 8
               ? VSH_OK
               : vshi_part_damaged(part->path, "its head", error);
}

vsh_result vshi_part_input_check_body(vshi_part_input *part, const vsh_run *run, vsh_error *error) {
    const uint64_t bytes = part->body_bytes;
    unsigned char *chunk = NULL;
    uint64_t told;
    vshi_job *job = vshi_job_begin(run, "parts", (size_t)(bytes / CHUNK) + 1);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", part->path);
    }
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&chunk, CHUNK, 1, part->path, error));
    for (uint64_t left = bytes; left > 0;) {
        const size_t size = left < CHUNK ? (size_t)left : CHUNK;
        VSHI_TRY_DONE(vshi_part_read_bytes(part->file, part->path, chunk, size, error));
        part->sum = vshi_part_sum(part->sum, chunk, size);
        left -= size;
        VSHI_TRY_DONE(vshi_job_advance(job, 1) ? vshi_job_fail_cancelled(job, error) : VSH_OK);
    }
    VSHI_TRY_DONE(vshi_part_read_bytes(part->file, part->path, &told, sizeof told, error));
    result = told == part->sum ? VSH_OK : vshi_part_damaged(part->path, "its checksum does not match", error);
done:
    free(chunk);
    vshi_job_end(job);
    return result;
}

void vshi_part_input_close(vshi_part_input *part) {
    if (part->file != NULL) {
        fclose(part->file);
        part->file = NULL;
    }
    free(part->head.bytes);
    part->head.bytes = NULL;
}

vsh_result vshi_part_reopen(const char *path, uint64_t at, FILE **file, vsh_error *error) {
    uint64_t size;
    VSHI_TRY(vshi_input_open(path, path, UINT64_MAX / 2, file, &size, error));
    if (fseeko(*file, (off_t)at, SEEK_SET) == 0) {
        return VSH_OK;
    }
    const int why = errno;
    fclose(*file);
    *file = NULL;
    return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path, strerror(why));
}

/* --- names and words */

/* Which parts there are beside a name. */

enum { MOST_NAMED = 6 }; /* parts that are missing */

char *vshi_part_path(const char *parts, int32_t shard, int32_t count) {
    static const char *const form = "%s.%d-of-%d.part";
    const int length = snprintf(NULL, 0, form, parts, shard, count);
    char *path = length > 0 ? malloc((size_t)length + 1) : NULL;
    if (path != NULL) {
        snprintf(path, (size_t)length + 1, form, parts, shard, count);
    }
    return path;
}

/* N of "NAME.I-of-N.part"; 0: it is no such name. */
static int32_t count_of_name(const char *entry, const char *name) {
    const size_t length = strlen(name);
    int shard = 0, count = 0, used = 0;
    if (strncmp(entry, name, length) != 0 || entry[length] != '.' ||
        sscanf(entry + length, ".%5d-of-%5d.part%n", &shard, &count, &used) != 2 || used == 0 ||
        entry[length + (size_t)used] != '\0') {
        return 0;
    }
    return shard >= 1 && shard <= count && count <= VSHI_MOST_SHARDS ? count : 0;
}

vsh_result vshi_parts_count(const char *parts, int32_t *count, vsh_error *error) {
    *count = 0;
    const char *slash = strrchr(parts, '/');
    char *folder = slash == NULL ? strdup(".") : strndup(parts, slash == parts ? 1 : (size_t)(slash - parts));
    if (folder == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", parts);
    }
    DIR *open = opendir(folder);
    free(folder);
    if (open == NULL) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: its folder cannot be read: %s", parts, strerror(errno));
    }
    int32_t other = 0;
    for (const struct dirent *entry; (entry = readdir(open)) != NULL;) {
        const int32_t found = count_of_name(entry->d_name, slash != NULL ? slash + 1 : parts);
        other = found != 0 && *count != 0 && found != *count ? found : other;
        *count = found != 0 && *count == 0 ? found : *count;
    }
    closedir(open);
    if (other != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: there are parts of %d and of %d shards beside it; say which, by their number",
                         parts, *count < other ? *count : other, *count < other ? other : *count);
    }
    return *count != 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT,
                           "%s: there are no parts beside it, %s.1-of-N.part and so on", parts, parts);
}

vsh_result vshi_parts_check_there(const char *name, int32_t count, vsh_error *error) {
    char list[256] = "";
    size_t at = 0;
    int32_t missing = 0;
    for (int32_t i = 1; i <= count; ++i) {
        char *path = vshi_part_path(name, i, count);
        if (path == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", name);
        }
        if (access(path, F_OK) != 0 && ++missing <= MOST_NAMED && at < sizeof list) {
            at += (size_t)snprintf(list + at, sizeof list - at, "%s%d", missing > 1 ? ", " : "", i);
        }
        free(path);
    }
    if (missing == 0) {
        return VSH_OK;
    }
    if (missing > MOST_NAMED && at < sizeof list) {
        snprintf(list + at, sizeof list - at, " and %d more", missing - MOST_NAMED);
    }
    return vshi_fail(error, VSH_ERROR_READ, "%s: %s missing: %s of %d; bake %s by --shard I/%d", name,
                     missing == 1 ? "a part is" : "parts are", list, count, missing == 1 ? "it" : "them",
                     count);
}

vsh_result vshi_parts_first(const char *parts, int32_t shard_count, char **path, vsh_error *error) {
    *path = NULL;
    if (shard_count == 0) {
        VSHI_TRY(vshi_parts_count(parts, &shard_count, error));
    }
    for (int32_t i = 1; i <= shard_count; ++i) {
        *path = vshi_part_path(parts, i, shard_count);
        if (*path == NULL || i == shard_count || access(*path, F_OK) == 0) {
            break;
        }
        free(*path);
    }
    return *path != NULL ? VSH_OK
                         : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", parts);
}

vsh_result vsh_part_words(const char *parts, int32_t shard_count, const vsh_run *run, char ***words,
                          size_t *count, vsh_error *error) {
    VSHI_NEEDS(words);
    VSHI_NEEDS(count);
    *words = NULL;
    *count = 0;
    VSHI_NEEDS(parts);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (shard_count < 0 || shard_count > VSHI_MOST_SHARDS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "shard_count %d: expected 0 to %d", shard_count,
                         VSHI_MOST_SHARDS);
    }
    char *path;
    VSHI_TRY(vshi_parts_first(parts, shard_count, &path, error));
    vshi_part_input part;
    vshi_part_about about;
    const vsh_result result = vshi_part_input_open(path, &full, &part, &about, error);
    if (result == VSH_OK) {
        *words = about.words;
        *count = (size_t)about.word_count;
        about.words = NULL;
        about.word_count = 0;
    }
    vshi_part_about_free(&about);
    vshi_part_input_close(&part);
    free(path);
    return result;
}

void vsh_part_words_free(char **words) {
    for (size_t i = 0; words != NULL && words[i] != NULL; ++i) {
        free(words[i]);
    }
    free(words);
}
