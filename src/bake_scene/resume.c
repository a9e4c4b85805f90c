#include "bake_scene/resume.h"

#include "base/job.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

static const char magic[] = "vdbshade resume "; /* the file begins with it; the format's number follows */

/* Before every band. All of the file is of the machine's own byte order: it is of one bake on one machine. */
typedef struct band_head {
    int32_t first, rows;
    uint64_t texels, invalid_texels;
    vsh_shade_stats shade;
    uint64_t checksum; /* of what follows: invalid_by_mesh, the planes, then the errors of channels */
} band_head;

/* FNV-1a (Fowler, Noll and Vo, 1991), a word at a time. */
static uint64_t checksum_of(uint64_t sum, const void *bytes, size_t size) {
    const unsigned char *at = bytes;
    for (size_t i = 0; i + 4 <= size; i += 4) {
        uint32_t word;
        memcpy(&word, at + i, 4);
        sum = (sum ^ word) * UINT64_C(0x100000001b3);
    }
    return sum;
}

static uint64_t checksum(const vshi_channels *channels, size_t texels, const uint64_t *invalid,
                         size_t mesh_count, const vsh_bake_error *errors, size_t error_count) {
    uint64_t sum = checksum_of(UINT64_C(0xcbf29ce484222325), invalid, mesh_count * sizeof *invalid);
    for (int32_t c = 0; c < channels->image.channel_count; ++c) {
        sum = checksum_of(sum, channels->planes[c], texels * sizeof(float));
    }
    if (channels->known != NULL) {
        sum = checksum_of(sum, channels->known, texels * sizeof *channels->known);
    }
    if (channels->kept != NULL) {
        sum = checksum_of(sum, channels->kept, channels->kept_bytes);
    }
    return checksum_of(sum, errors, error_count * sizeof *errors);
}

/* What must be the same for bands to be taken: text, to be freed; NULL where memory is short. */
static char *text_of(const vshi_resume_key *key) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL) {
        return NULL;
    }
    fprintf(out, "%s5: %d x %d by %d\n", magic, key->image->width, key->image->height, key->band_rows);
    if (key->part) {
        fprintf(out, "rows %d to %d\n", key->first, key->end);
    }
    for (int32_t c = 0; c < key->image->channel_count; ++c) {
        fprintf(out, "%s\n", key->image->names[c]);
    }
    for (size_t i = 0; i < key->attribute_count; ++i) {
        fprintf(out, "%s: %s\n", key->attributes[i].name, key->attributes[i].value);
    }
    if (fclose(out) != 0) {
        free(text);
        return NULL;
    }
    return text;
}

/* Whether the file begins with the key, with its NUL. */
static bool has_key(FILE *file, const char *key) {
    for (const char *at = key;; ++at) {
        const int c = getc(file);
        if (c != (unsigned char)*at) {
            return false;
        }
        if (c == '\0') {
            return true;
        }
    }
}

static void give_up(vshi_resume *r) {
    vshi_warn(r->run, "%s: could not be written: %s; the bake goes on, but cannot be resumed", r->path,
              strerror(errno));
    fclose(r->file);
    r->file = NULL;
    unlink(r->path);
}

/* Whether the file is one of ours, or was going to be when its run was killed. */
static bool is_ours(FILE *file) {
    char head[sizeof magic - 1];
    const size_t count = fread(head, 1, sizeof head, file);
    rewind(file);
    return memcmp(head, magic, count) == 0;
}

/* Nobody asked for this name: whatever else stands there is left as it is, and not waited for. */
static vsh_result open_file(vshi_resume *r, vsh_error *error) {
    const int file = open(r->path, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666);
    struct stat status;
    if (file < 0) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", r->path,
                         errno == ELOOP ? "it is a link" : strerror(errno));
    }
    const bool regular = fstat(file, &status) == 0 && S_ISREG(status.st_mode);
    r->file = regular ? fdopen(file, "r+b") : NULL;
    if (r->file == NULL) {
        const char *why = regular ? strerror(errno) : "it is no regular file";
        close(file);
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", r->path, why);
    }
    if (!is_ours(r->file)) {
        return vshi_fail(
            error, VSH_ERROR_WRITE,
            "%s: is no file of --resume, and stays as it is; move it away, or bake without --resume",
            r->path);
    }
    if (flock(fileno(r->file), LOCK_EX | LOCK_NB) != 0) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: another run has it open", r->path);
    }
    return VSH_OK;
}

/* Begins the file anew. */
static void begin_file(vshi_resume *r, const char *key) {
    if (fseek(r->file, 0, SEEK_END) == 0 && ftell(r->file) > 0) {
        vshi_warn(r->run, "%s: belongs to another bake (other inputs or options); this one begins anew",
                  r->path);
    }
    rewind(r->file);
    if (ftruncate(fileno(r->file), 0) != 0 || fwrite(key, strlen(key) + 1, 1, r->file) != 1 ||
        fflush(r->file) != 0) {
        give_up(r);
    }
}

vsh_result vshi_resume_open(const char *output, const vshi_resume_key *key, size_t error_count,
                            const vsh_run *run, vshi_resume *r, vsh_error *error) {
    *r = (vshi_resume){.run = run, .error_count = error_count};
    if (snprintf(r->path, sizeof r->path, "%s.resume", output) >= (int)sizeof r->path) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%.64s…: the name is too long", output);
    }
    char *text = text_of(key);
    if (text == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", r->path);
    }
    const vsh_result result = open_file(r, error);
    if (result == VSH_OK) {
        r->taking = has_key(r->file, text);
        if (!r->taking) {
            begin_file(r, text);
        }
    } else if (r->file != NULL) {
        fclose(r->file);
        r->file = NULL;
    }
    free(text);
    return result;
}

static bool read_band(vshi_resume *r, const band_head *want, vshi_channels *channels, vsh_bake_stats *stats,
                      size_t mesh_count, uint64_t *invalid, vsh_bake_error *errors) {
    const size_t texels = (size_t)channels->image.width * (size_t)want->rows;
    band_head head;
    bool good = fread(&head, sizeof head, 1, r->file) == 1 && head.first == want->first &&
                head.rows == want->rows && fread(invalid, sizeof *invalid, mesh_count, r->file) == mesh_count;
    for (int32_t c = 0; good && c < channels->image.channel_count; ++c) {
        good = fread(channels->planes[c], sizeof(float), texels, r->file) == texels;
    }
    good = good && (channels->known == NULL ||
                    fread(channels->known, sizeof *channels->known, texels, r->file) == texels);
    good = good && (channels->kept == NULL ||
                    fread(channels->kept, 1, channels->kept_bytes, r->file) == channels->kept_bytes);
    good = good && fread(errors, sizeof *errors, r->error_count, r->file) == r->error_count;
    if (!good || checksum(channels, texels, invalid, mesh_count, errors, r->error_count) != head.checksum) {
        return false;
    }
    stats->texels = head.texels;
    stats->invalid_texels = head.invalid_texels;
    stats->shade = head.shade;
    memcpy(stats->invalid_by_mesh, invalid, mesh_count * sizeof *invalid);
    memcpy(stats->errors, errors, r->error_count * sizeof *errors);
    return true;
}

bool vshi_resume_take(vshi_resume *r, int32_t first, int32_t rows, vshi_channels *channels,
                      vsh_bake_stats *stats, size_t mesh_count) {
    if (r->file == NULL || !r->taking) {
        return false;
    }
    const long begin = ftell(r->file);
    const band_head want = {.first = first, .rows = rows};
    uint64_t *invalid = calloc(mesh_count + 1, sizeof *invalid);
    vsh_bake_error *errors = calloc(r->error_count + 1, sizeof *errors);
    r->taking = invalid != NULL && errors != NULL &&
                read_band(r, &want, channels, stats, mesh_count, invalid, errors);
    free(errors);
    free(invalid);
    if (r->taking) {
        r->rows = first + rows;
        return true;
    }
    /* what was cut off in the middle of a band is written again */
    if (begin < 0 || fseek(r->file, begin, SEEK_SET) != 0 || ftruncate(fileno(r->file), begin) != 0) {
        give_up(r);
    }
    return false;
}

void vshi_resume_keep(vshi_resume *r, int32_t first, int32_t rows, const vshi_channels *channels,
                      const vsh_bake_stats *stats, size_t mesh_count) {
    if (r->file == NULL) {
        return;
    }
    const size_t texels = (size_t)channels->image.width * (size_t)rows;
    band_head head;
    memset(&head, 0, sizeof head); /* what lies between members too */
    head.first = first;
    head.rows = rows;
    head.texels = stats->texels;
    head.invalid_texels = stats->invalid_texels;
    head.shade = stats->shade;
    head.checksum =
        checksum(channels, texels, stats->invalid_by_mesh, mesh_count, stats->errors, r->error_count);
    bool good = fwrite(&head, sizeof head, 1, r->file) == 1 &&
                fwrite(stats->invalid_by_mesh, sizeof(uint64_t), mesh_count, r->file) == mesh_count;
    for (int32_t c = 0; good && c < channels->image.channel_count; ++c) {
        good = fwrite(channels->planes[c], sizeof(float), texels, r->file) == texels;
    }
    good = good && (channels->known == NULL ||
                    fwrite(channels->known, sizeof *channels->known, texels, r->file) == texels);
    good = good && (channels->kept == NULL ||
                    fwrite(channels->kept, 1, channels->kept_bytes, r->file) == channels->kept_bytes);
    good = good && fwrite(stats->errors, sizeof *stats->errors, r->error_count, r->file) == r->error_count;
    if (!good || fflush(r->file) != 0 || fdatasync(fileno(r->file)) != 0) {
        give_up(r);
        return;
    }
    r->rows = first + rows;
}

int32_t vshi_resume_close(vshi_resume *r) {
    if (r->file == NULL) {
        return 0;
    }
    fclose(r->file);
    r->file = NULL;
    return r->rows;
}

void vshi_resume_remove(const char *output) {
    char path[sizeof((vshi_resume *)NULL)->path];
    if (snprintf(path, sizeof path, "%s.resume", output) < (int)sizeof path) {
        unlink(path);
    }
}
