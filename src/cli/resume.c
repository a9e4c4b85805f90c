#include "resume.h"

#include "message.h"

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
    uint64_t texels, invalid_texels, seen_texels;
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

static uint64_t checksum(const cli_planes *planes, size_t texels, const uint64_t *invalid, size_t mesh_count,
                         const vsh_bake_error *errors, size_t error_count) {
    uint64_t sum = checksum_of(UINT64_C(0xcbf29ce484222325), invalid, mesh_count * sizeof *invalid);
    for (int32_t c = 0; c < planes->image.channel_count; ++c) {
        sum = checksum_of(sum, planes->planes[c], texels * sizeof(float));
    }
    return checksum_of(sum, errors, error_count * sizeof *errors);
}

/* What must be the same for bands to be taken: text, to be freed; NULL where memory is short. */
static char *key_of(const cli_origin *origin, const vsh_image *image, int32_t band_rows) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL) {
        return NULL;
    }
    fprintf(out, "%s2: %d x %d by %d\n", magic, image->width, image->height, band_rows);
    for (int32_t c = 0; c < image->channel_count; ++c) {
        fprintf(out, "%s\n", image->names[c]);
    }
    for (size_t i = 0; i < origin->count; ++i) {
        fprintf(out, "%s: %s\n", origin->attributes[i].name, origin->attributes[i].value);
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

static void give_up(cli_resume *r) {
    cli_say("warning: %s: could not be written: %s; nothing is kept any more", r->path, strerror(errno));
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
static int open_file(cli_resume *r) {
    const int file = open(r->path, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666);
    struct stat status;
    const bool link = file < 0 && errno == ELOOP;
    const bool regular = file >= 0 && fstat(file, &status) == 0 && S_ISREG(status.st_mode);
    r->file = regular ? fdopen(file, "r+b") : NULL;
    if (r->file == NULL) {
        cli_say("%s: cannot be written: %s", r->path,
                link                    ? "it is a link"
                : file >= 0 && !regular ? "it is no regular file"
                                        : strerror(errno));
        if (file >= 0) {
            close(file);
        }
        return CLI_FILE;
    }
    if (!is_ours(r->file)) {
        cli_say("%s: is no file of --resume, and stays as it is; move it away, or bake without --resume",
                r->path);
        fclose(r->file);
        r->file = NULL;
        return CLI_FILE;
    }
    if (flock(fileno(r->file), LOCK_EX | LOCK_NB) != 0) {
        cli_say("%s: another run has it open", r->path);
        fclose(r->file);
        r->file = NULL;
        return CLI_FILE;
    }
    return CLI_OK;
}

int cli_resume_open(cli_resume *r, const char *output, const cli_origin *origin, const vsh_image *image,
                    int32_t band_rows, size_t error_count) {
    *r = (cli_resume){.file = NULL, .error_count = error_count};
    if (snprintf(r->path, sizeof r->path, "%s.resume", output) >= (int)sizeof r->path) {
        return cli_usage("%.64s…: the name is too long", output);
    }
    char *key = key_of(origin, image, band_rows);
    if (key == NULL) {
        return cli_out_of_memory(r->path);
    }
    const int code = open_file(r);
    if (code == CLI_OK) {
        r->taking = has_key(r->file, key);
        if (!r->taking) {
            if (fseek(r->file, 0, SEEK_END) == 0 && ftell(r->file) > 0) {
                cli_say("warning: %s: is of another bake, of other inputs or options; begun anew", r->path);
            }
            rewind(r->file);
            if (ftruncate(fileno(r->file), 0) != 0 || fwrite(key, strlen(key) + 1, 1, r->file) != 1 ||
                fflush(r->file) != 0) {
                give_up(r);
            }
        }
    }
    free(key);
    return code;
}

static bool read_band(cli_resume *r, const band_head *want, cli_planes *planes, vsh_bake_stats *stats,
                      size_t mesh_count, uint64_t *invalid, vsh_bake_error *errors) {
    const size_t texels = (size_t)planes->image.width * (size_t)want->rows;
    band_head head;
    bool good = fread(&head, sizeof head, 1, r->file) == 1 && head.first == want->first &&
                head.rows == want->rows && fread(invalid, sizeof *invalid, mesh_count, r->file) == mesh_count;
    for (int32_t c = 0; good && c < planes->image.channel_count; ++c) {
        good = fread(planes->planes[c], sizeof(float), texels, r->file) == texels;
    }
    good = good && fread(errors, sizeof *errors, r->error_count, r->file) == r->error_count;
    if (!good || checksum(planes, texels, invalid, mesh_count, errors, r->error_count) != head.checksum) {
        return false;
    }
    stats->texels = head.texels;
    stats->invalid_texels = head.invalid_texels;
    stats->seen_texels = head.seen_texels;
    stats->shade = head.shade;
    memcpy(stats->invalid_by_mesh, invalid, mesh_count * sizeof *invalid);
    memcpy(stats->errors, errors, r->error_count * sizeof *errors);
    return true;
}

bool cli_resume_take(cli_resume *r, int32_t first, int32_t rows, cli_planes *planes, vsh_bake_stats *stats,
                     size_t mesh_count) {
    if (r->file == NULL || !r->taking) {
        return false;
    }
    const long begin = ftell(r->file);
    const band_head want = {.first = first, .rows = rows};
    uint64_t *invalid = calloc(mesh_count + 1, sizeof *invalid);
    vsh_bake_error *errors = calloc(r->error_count + 1, sizeof *errors);
    r->taking =
        invalid != NULL && errors != NULL && read_band(r, &want, planes, stats, mesh_count, invalid, errors);
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

void cli_resume_keep(cli_resume *r, int32_t first, int32_t rows, const cli_planes *planes,
                     const vsh_bake_stats *stats, size_t mesh_count) {
    if (r->file == NULL) {
        return;
    }
    const size_t texels = (size_t)planes->image.width * (size_t)rows;
    band_head head;
    memset(&head, 0, sizeof head); /* what lies between members too */
    head.first = first;
    head.rows = rows;
    head.texels = stats->texels;
    head.invalid_texels = stats->invalid_texels;
    head.seen_texels = stats->seen_texels;
    head.shade = stats->shade;
    head.checksum =
        checksum(planes, texels, stats->invalid_by_mesh, mesh_count, stats->errors, r->error_count);
    bool good = fwrite(&head, sizeof head, 1, r->file) == 1 &&
                fwrite(stats->invalid_by_mesh, sizeof(uint64_t), mesh_count, r->file) == mesh_count;
    for (int32_t c = 0; good && c < planes->image.channel_count; ++c) {
        good = fwrite(planes->planes[c], sizeof(float), texels, r->file) == texels;
    }
    good = good && fwrite(stats->errors, sizeof *stats->errors, r->error_count, r->file) == r->error_count;
    if (!good || fflush(r->file) != 0 || fdatasync(fileno(r->file)) != 0) {
        give_up(r);
        return;
    }
    r->rows = first + rows;
}

void cli_resume_close(cli_resume *r, const char *output, int32_t height, int code) {
    if (r->file == NULL) {
        return;
    }
    fclose(r->file);
    r->file = NULL;
    if (code != CLI_OK && r->rows > 0) {
        cli_say("%s: %d of %d rows are kept in %s; the same command goes on from there", output, r->rows,
                height, r->path);
    }
}

void cli_resume_remove(const char *output) {
    char path[sizeof((cli_resume *)NULL)->path];
    if (snprintf(path, sizeof path, "%s.resume", output) < (int)sizeof path) {
        unlink(path);
    }
}
