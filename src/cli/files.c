/* Paths, files that appear whole or not at all, and text in files. */
#include "base/bytes.h"
#include "base/text.h"
#include "cli.h"

#include <errno.h>
#include <stdarg.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

const char *cli_keep_text(const char *format, ...) {
    static struct kept {
        struct kept *before;
        char text[];
    } * last; /* reaches all texts, so that no tool reports leaks */
    va_list values, again;
    va_start(values, format);
    va_copy(again, values);
    const int length = vsnprintf(NULL, 0, format, values);
    struct kept *kept = malloc(sizeof *kept + (size_t)length + 1);
    vsnprintf(kept->text, (size_t)length + 1, format, again);
    kept->before = last;
    last = kept;
    va_end(again);
    va_end(values);
    return kept->text;
}

const char *cli_bytes_text(uint64_t bytes) {
    char text[VSHI_BYTES_ROOM];
    return cli_keep_text("%s", vshi_bytes_text(bytes, text, sizeof text));
}

bool cli_has_ending(const char *path, const char *endings) {
    const char *dot = strrchr(vshi_path_name(path), '.');
    for (const char *at = endings; dot != NULL && *at != '\0'; at += strspn(at, " ")) {
        const size_t length = strcspn(at, " ");
        if (strlen(dot + 1) == length && strncasecmp(dot + 1, at, length) == 0) {
            return true;
        }
        at += length;
    }
    return false;
}

const char *cli_split_grid(const char **path) {
    const char *colon = NULL;
    for (const char *at = strchr(*path, ':'); at != NULL; at = strchr(at + 1, ':')) {
        colon = at - *path > 4 && strncasecmp(at - 4, ".vdb", 4) == 0 ? at : colon;
    }
    if (colon == NULL || access(*path, F_OK) == 0) {
        return NULL;
    }
    *path = cli_keep_text("%.*s", (int)(colon - *path), *path);
    return colon + 1;
}

bool cli_is_folder(const char *path) {
    struct stat status;
    const size_t length = strlen(path);
    return (length > 0 && path[length - 1] == '/') || (stat(path, &status) == 0 && S_ISDIR(status.st_mode));
}

const char *cli_end_path(const char *path, const char *end) {
    size_t length = strlen(path);
    while (length > 1 && path[length - 1] == '/') {
        --length;
    }
    return cli_keep_text("%.*s%s", (int)length, path, end);
}

/* --- checks */

/* Whether two paths lead to the same file, which need not exist. */
static bool is_same_file(const char *a, const char *b) {
    struct stat one, other;
    const bool has_one = stat(a, &one) == 0;
    const bool has_other = stat(b, &other) == 0;
    if (has_one && has_other) {
        return one.st_dev == other.st_dev && one.st_ino == other.st_ino;
    }
    char first[PATH_MAX], second[PATH_MAX], real[PATH_MAX], other_real[PATH_MAX];
    vshi_path_folder(a, first);
    vshi_path_folder(b, second);
    return !has_one && !has_other && strcmp(vshi_path_name(a), vshi_path_name(b)) == 0 &&
           realpath(first, real) != NULL && realpath(second, other_real) != NULL &&
           strcmp(real, other_real) == 0;
}

/* Refuses an output that is an input or one of the outputs before it. */
static int check_output(const char *const *outputs, size_t index, const char *const *inputs,
                        size_t input_count) {
    const char *output = outputs[index];
    for (size_t i = 0; i < input_count; ++i) {
        CLI_REFUSE_IF(inputs[i] != NULL && is_same_file(output, inputs[i]),
                      "%s: the output is also an input: %s", output, inputs[i]);
    }
    for (size_t i = 0; i < index; ++i) {
        CLI_REFUSE_IF(is_same_file(output, outputs[i]), "%s: two outputs would be written to this file",
                      output);
    }
    return CLI_OK;
}

int cli_check_apart(const char *const *outputs, size_t output_count, const char *const *inputs,
                    size_t input_count, const vsh_scene *scene) {
    const char **given = calloc(output_count + 1, sizeof *given);
    size_t count = 0;
    int code = CLI_OK;
    for (size_t i = 0; i < output_count; ++i) {
        if (outputs[i] != NULL) {
            given[count] = outputs[i];
            CLI_TRY_DONE(check_output(given, count++, inputs, input_count));
        }
    }
    if (scene != NULL) {
        code = cli_check(vsh_scene_check_outputs(scene, given, count, &cli_run, &cli_error));
    }
done:
    free(given);
    return code;
}

int cli_check_outputs(const char *const *outputs, size_t output_count, const char *const *inputs,
                      size_t input_count, const vsh_scene *scene) {
    CLI_TRY(cli_check_apart(outputs, output_count, inputs, input_count, scene));
    for (size_t i = 0; i < output_count; ++i) {
        CLI_TRY(outputs[i] != NULL ? cli_temporary_check(outputs[i]) : CLI_OK);
    }
    return CLI_OK;
}

/* A relative path begins with the folder of `namer`, and each later part could be a stranger's link. The
 * folders of an absolute path were named openly, so only its last part could be one. */
int cli_check_links(const char *namer, const char *path) {
    char folder[PATH_MAX], home[PATH_MAX], part[PATH_MAX], real[PATH_MAX];
    struct stat status;
    const size_t own = (size_t)(vshi_path_name(namer) - namer);
    const bool relative = strncmp(path, namer, own) == 0 && path[own] != '/';
    vshi_path_folder(namer, folder);
    const size_t length = realpath(folder, home) == NULL || strcmp(home, "/") == 0 ? 0 : strlen(home);
    for (size_t at = relative ? own : (size_t)(vshi_path_name(path) - path); path[at] != '\0';
         at += strspn(path + at, "/")) {
        at += strcspn(path + at, "/");
        snprintf(part, sizeof part, "%.*s", (int)at, path);
        if (lstat(part, &status) == 0 && S_ISLNK(status.st_mode)) {
            const char *target = realpath(part, real);
            if (target == NULL || strncmp(target, home, length) != 0 || target[length] != '/') {
                return cli_refuse(CLI_FILE,
                                  "%s: cannot be written: a link leads from the folder of '%s' to '%s'", path,
                                  namer, target != NULL ? target : "nothing");
            }
        }
    }
    return CLI_OK;
}

int cli_check_folder(const char *path) {
    char folder[PATH_MAX];
    struct stat status;
    vshi_path_folder(path, folder);
    if (stat(folder, &status) == 0 || errno != ENOENT) {
        return CLI_OK;
    }
    return cli_refuse(CLI_FILE,
                      "%s: cannot be written: there is no folder '%s'; make it first: mkdir -p '%s'", path,
                      folder, folder);
}

int cli_make_folder_of(const char *path) {
    char part[PATH_MAX];
    struct stat status;
    const char *slash = strrchr(path, '/');
    const int length = slash != NULL ? (int)(slash - path) : 0;
    if (length >= PATH_MAX) {
        return cli_refuse(CLI_FILE, "%.*s: cannot be made: %s", length, path, strerror(ENAMETOOLONG));
    }
    for (int i = 1; i <= length; ++i) {
        if (path[i] != '/') {
            continue;
        }
        snprintf(part, sizeof part, "%.*s", i, path);
        if (mkdir(part, 0777) != 0 && !(stat(part, &status) == 0 && S_ISDIR(status.st_mode))) {
            return cli_refuse(CLI_FILE, "%.*s: cannot be made: %s: %s", length, path, part,
                              strerror(errno == EEXIST ? ENOTDIR : errno));
        }
    }
    return CLI_OK;
}

/* --- files under way */

static int fail_writing(const char *target) {
    return cli_refuse(CLI_FILE, "%s: cannot be written: %s", target, strerror(errno));
}

int cli_temporary_begin(cli_temporary *t, const char *target) {
    *t = (cli_temporary){.target = target};
    CLI_TRY(cli_check(vshi_output_begin(&t->output, target, &cli_error)));
    t->file = fopen(t->output.temporary, "wb");
    if (t->file == NULL) {
        const int code = fail_writing(target);
        vshi_output_abandon(&t->output);
        return code;
    }
    return CLI_OK;
}

void cli_temporary_abandon(cli_temporary *t) {
    if (t->file != NULL) {
        fclose(t->file);
        vshi_output_abandon(&t->output);
        t->file = NULL;
    }
}

/* Only making a file shows that its name is too long, or that the file system refuses it or is full. */
int cli_temporary_check(const char *target) {
    cli_temporary t;
    const int code = cli_temporary_begin(&t, target);
    cli_temporary_abandon(&t);
    return code;
}

int cli_temporaries_commit(cli_temporary *const *list, size_t count) {
    vshi_output *outputs[CLI_MOST_TEMPORARIES];
    int code = CLI_OK;
    for (size_t i = 0; i < count; ++i) {
        cli_temporary *t = list[i];
        const bool whole = fflush(t->file) == 0 && !ferror(t->file);
        if ((fclose(t->file) != 0 || !whole) && code == CLI_OK) {
            code = fail_writing(t->target);
        }
        t->file = NULL;
        outputs[i] = &t->output;
    }
    for (size_t i = 0; i < count && code != CLI_OK; ++i) {
        vshi_output_abandon(outputs[i]);
    }
    return code != CLI_OK ? code : cli_check(vshi_outputs_commit(outputs, count, &cli_error));
}

int cli_temporary_commit(cli_temporary *t) {
    return cli_temporaries_commit(&t, 1);
}

bool cli_copy(FILE *from, FILE *to) {
    char bytes[1 << 14];
    size_t got;
    while ((got = fread(bytes, 1, sizeof bytes, from)) > 0) {
        if (fwrite(bytes, 1, got, to) != got) {
            return false;
        }
    }
    return !ferror(from);
}

/* --- text in files */

int cli_write_json(const char *path, json_t *root) {
    cli_temporary t = {.file = stdout};
    const int code = path != NULL ? cli_temporary_begin(&t, path) : CLI_OK;
    if (code == CLI_OK) {
        json_dumpf(root, t.file, JSON_INDENT(2) | JSON_REAL_PRECISION(9));
    }
    json_decref(root);
    if (path == NULL) {
        putchar('\n');
    }
    return path == NULL || code != CLI_OK ? code : cli_temporary_commit(&t);
}

json_t *cli_number_json(double value) {
    return isfinite(value) ? json_real(value) : json_null();
}

json_t *cli_utf8_json(const char *text) {
    if (text == NULL) {
        return json_null();
    }
    char *clean = malloc(3 * strlen(text) + 1);
    vshi_utf8_clean(text, clean);
    json_t *json = json_string(clean);
    free(clean);
    return json;
}

void cli_write(FILE *out, const char *before, const char *text, const char *after) {
    static const char specials[] = "<>&\"";
    static const char *const escapes[] = {"&lt;", "&gt;", "&amp;", "&quot;"};
    fputs(before, out);
    for (size_t length; *text != '\0'; text += length > 0 ? length : 1) {
        length = vshi_utf8_length(text);
        const char *special = strchr(specials, *text);
        if (special != NULL) {
            fputs(escapes[special - specials], out);
        } else if (length == 0) {
            fputs(VSHI_NO_CHARACTER, out);
        } else if (length == 1 && ((unsigned char)*text < 0x20 || *text == 0x7f)) {
            fputc('?', out); /* XML has no control characters */
        } else {
            fwrite(text, 1, length, out);
        }
    }
    fputs(after, out);
}
