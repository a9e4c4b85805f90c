/* What there is to bake in a folder: its scenes, and what its regress.json says of them. */
#define _GNU_SOURCE /* asprintf */
#include "base/input.h"
#include "cli/commands.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "regress.h"

#include <dirent.h>
#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <vdbshade/flat.h>

static const char list_name[] = "regress.json";

/* Of a list of cases or what a cache keeps, which strangers may have made: as JSON a hundred times that. */
enum { MOST_BYTES = 4 << 20, MOST_SCENE = 64 << 20 };

bool regress_lines_add(regress_lines *lines, const char *format, ...) {
    char **more = realloc(lines->line, (lines->count + 1) * sizeof *more);
    if (more == NULL) {
        return false;
    }
    lines->line = more;
    va_list arguments;
    va_start(arguments, format);
    const int length = vasprintf(&more[lines->count], format, arguments);
    va_end(arguments);
    lines->count += length >= 0;
    return length >= 0;
}

void regress_lines_free(regress_lines *lines) {
    for (size_t i = 0; i < lines->count; ++i) {
        free(lines->line[i]);
    }
    free(lines->line);
    *lines = (regress_lines){NULL, 0};
}

char *regress_path(const char *folder, const char *name) {
    char *path;
    return asprintf(&path, "%s/%s", folder, name) >= 0 ? path : NULL;
}

void regress_free_case(regress_case *one) {
    for (size_t i = 0; one->comparisons != NULL && i < one->outputs.count; ++i) {
        cli_comparison_free(&one->comparisons[i]);
    }
    free(one->comparisons);
    regress_lines_free(&one->options);
    regress_lines_free(&one->outputs);
    regress_lines_free(&one->inputs);
    free(one->changed);
    free(one->reason);
    free(one->output);
    free(one->scene);
    free(one->name);
    memset(one, 0, sizeof *one);
}

static int no_memory(const regress_work *work) {
    return cli_out_of_memory(work->folder);
}

static regress_case *add_case(regress_work *work) {
    regress_case *more = realloc(work->cases, (work->case_count + 1) * sizeof *more);
    if (more == NULL) {
        return NULL;
    }
    work->cases = more;
    regress_case *one = &more[work->case_count++];
    memset(one, 0, sizeof *one);
    return one;
}

static const char *last_part(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

/* --- what a scene writes */

static json_t *load(const char *path, uint64_t most) {
    FILE *file;
    uint64_t size;
    if (vshi_input_open(path, path, most, &file, &size, NULL) != VSH_OK) {
        return NULL;
    }
    json_t *root = json_loadf(file, 0, NULL);
    fclose(file);
    return root;
}

json_t *regress_load(const char *path) {
    return load(path, MOST_BYTES);
}

/* Scenes for 2D have a region, and a command of their own. Read as a scene first, which finds the memory
 * limit passed before any of it is taken. */
static int find_command(const regress_work *work, regress_case *one, const char *path) {
    const vsh_run run = cli_common_run(&work->settings->compare.common);
    vsh_error error;
    vsh_flat_scene *scene = NULL;
    bool flat = vsh_flat_scene_read(path, &run, &scene, &error) == VSH_OK;
    vsh_flat_scene_free(scene);
    if (!flat && error.code == VSH_ERROR_LIMIT) {
        return cli_fail(&error);
    }
    if (!flat) {
        json_t *root = load(path, MOST_SCENE);
        flat = json_object_get(root, "region") != NULL;
        json_decref(root);
    }
    one->command = flat ? &cli_flat : &cli_bake;
    return CLI_OK;
}

static int list_scene_outputs(const regress_work *work, regress_case *one, const char *path) {
    const vsh_run run = cli_common_run(&work->settings->compare.common);
    vsh_error error;
    vsh_scene *scene = NULL;
    if (vsh_scene_read(path, &run, &scene, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    bool good = true;
    for (size_t i = 0; i < scene->receiver_count && good; ++i) {
        good = regress_lines_add(&one->outputs, "%s", last_part(scene->receivers[i].output));
    }
    vsh_scene_free(scene);
    return good ? CLI_OK : no_memory(work);
}

static int list_flat_output(const regress_work *work, regress_case *one, const char *path) {
    const vsh_run run = cli_common_run(&work->settings->compare.common);
    vsh_error error;
    vsh_flat_scene *scene = NULL;
    if (vsh_flat_scene_read(path, &run, &scene, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    if (scene->output != NULL) {
        one->output = strdup(last_part(scene->output));
        if (one->output == NULL || !regress_lines_add(&one->outputs, "%s", one->output)) {
            vsh_flat_scene_free(scene);
            return no_memory(work);
        }
    }
    vsh_flat_scene_free(scene);
    return CLI_OK;
}

/* After scene, command and -o are known. */
static int list_outputs(const regress_work *work, regress_case *one) {
    char *path = regress_path(work->folder, one->scene);
    if (path == NULL) {
        return no_memory(work);
    }
    int code = one->command == NULL ? find_command(work, one, path) : CLI_OK;
    if (code != CLI_OK) {
        free(path);
        return code;
    }
    if (one->output != NULL) {
        code = regress_lines_add(&one->outputs, "%s", one->output) ? CLI_OK : no_memory(work);
    } else if (one->command == &cli_bake) {
        code = list_scene_outputs(work, one, path);
    } else if (one->command == &cli_flat) {
        code = list_flat_output(work, one, path);
    }
    if (code == CLI_OK && one->outputs.count == 0) {
        code = cli_usage("%s: nothing says what '%s' writes; give it an \"output\" in %s", path, one->name,
                         list_name);
    }
    free(path);
    return code;
}

/* --- regress.json */

static const cli_command *const commands[] = {&cli_bake, &cli_volume, &cli_flat, &cli_voxelize};

static int bad_list(const regress_work *work, size_t i, const char *what) {
    return cli_usage("%s/%s: cases[%zu]: %s", work->folder, list_name, i, what);
}

static int read_options(const regress_work *work, const json_t *options, size_t i, regress_case *one) {
    size_t k;
    json_t *word;
    if (options != NULL && !json_is_array(options)) {
        return bad_list(work, i, "options: expected an array of strings");
    }
    json_array_foreach(options, k, word) {
        if (!json_is_string(word)) {
            return bad_list(work, i, "options: expected an array of strings");
        }
        if (!regress_lines_add(&one->options, "%s", json_string_value(word))) {
            return no_memory(work);
        }
    }
    return CLI_OK;
}

static int read_case(regress_work *work, json_t *json, size_t i) {
    static const char *const keys[] = {"name", "scene", "command", "options", "output"};
    const char *key;
    json_t *value;
    if (!json_is_object(json)) {
        return bad_list(work, i, "expected an object");
    }
    json_object_foreach(json, key, value) {
        bool known = false;
        for (size_t k = 0; k < sizeof keys / sizeof keys[0]; ++k) {
            known = known || strcmp(keys[k], key) == 0;
        }
        if (!known) {
            char text[160];
            const char *near = cli_nearest(key, keys, sizeof keys / sizeof keys[0]);
            snprintf(text, sizeof text,
                     near != NULL ? "%.60s: unknown key; did you mean \"%s\"?" : "%.60s: unknown key", key,
                     near);
            return bad_list(work, i, text);
        }
        if (strcmp(key, "options") != 0 && (!json_is_string(value) || json_string_length(value) == 0)) {
            return bad_list(work, i, "name, scene, command and output are strings, not empty");
        }
    }
    const char *scene = json_string_value(json_object_get(json, "scene"));
    const char *name = json_string_value(json_object_get(json, "name"));
    const char *output = json_string_value(json_object_get(json, "output"));
    const char *command = json_string_value(json_object_get(json, "command"));
    if (scene == NULL) {
        return bad_list(work, i, "key \"scene\" is missing");
    }
    if (output != NULL &&
        (strchr(output, '/') != NULL || strcmp(output, ".") == 0 || strcmp(output, "..") == 0)) {
        return bad_list(work, i, "output: a name without a folder is expected");
    }
    regress_case *one = add_case(work);
    if (one == NULL) {
        return no_memory(work);
    }
    one->scene = strdup(scene);
    one->name = name != NULL ? strdup(name) : strndup(scene, strcspn(scene, "."));
    one->output = output != NULL ? strdup(output) : NULL;
    if (one->scene == NULL || one->name == NULL || (output != NULL && one->output == NULL)) {
        return no_memory(work);
    }
    for (size_t k = 0; command != NULL && k < sizeof commands / sizeof commands[0]; ++k) {
        one->command = strcmp(commands[k]->name, command) == 0 ? commands[k] : one->command;
    }
    if (command != NULL && one->command == NULL) {
        return bad_list(work, i, "command: expected bake, volume, flat or voxelize");
    }
    return read_options(work, json_object_get(json, "options"), i, one);
}

static int read_list(regress_work *work) {
    char *path = regress_path(work->folder, list_name);
    if (path == NULL) {
        return no_memory(work);
    }
    FILE *file;
    uint64_t size;
    vsh_error error;
    if (vshi_input_open(path, path, MOST_BYTES, &file, &size, &error) != VSH_OK) {
        const int failed = access(path, F_OK) != 0 && errno == ENOENT ? CLI_OK : cli_fail(&error);
        free(path);
        return failed;
    }
    int code = CLI_OK;
    json_error_t where;
    json_t *root = json_loadf(file, JSON_REJECT_DUPLICATES, &where);
    fclose(file);
    const json_t *cases = json_object_get(root, "cases");
    if (root == NULL) {
        code = cli_usage("%s:%d:%d: %s", path, where.line, where.column, where.text);
    } else if (!json_is_array(cases) || json_object_size(root) != 1) {
        code = cli_usage("%s: expected an object with the one key \"cases\", an array", path);
    }
    for (size_t i = 0; code == CLI_OK && i < json_array_size(cases); ++i) {
        code = read_case(work, json_array_get(cases, i), i);
    }
    json_decref(root);
    free(path);
    return code;
}

/* --- the folder's other scenes */

static int is_scene(const struct dirent *entry) {
    const char *name = entry->d_name;
    const size_t length = strlen(name);
    static const char tolerance[] = ".tolerance.json";
    const bool tolerances =
        length >= sizeof tolerance - 1 && strcmp(name + length - (sizeof tolerance - 1), tolerance) == 0;
    return name[0] != '.' && cli_has_ending(name, "json") && !tolerances && strcmp(name, list_name) != 0;
}

static bool is_listed(const regress_work *work, size_t listed, const char *scene) {
    for (size_t i = 0; i < listed; ++i) {
        if (strcmp(work->cases[i].scene, scene) == 0) {
            return true;
        }
    }
    return false;
}

static int add_scenes(regress_work *work) {
    struct dirent **entries;
    const int count = scandir(work->folder, &entries, is_scene, alphasort);
    if (count < 0) {
        cli_say("%s: cannot be read: %s", work->folder, strerror(errno));
        return CLI_FILE;
    }
    int code = CLI_OK;
    const size_t listed = work->case_count;
    for (int i = 0; i < count; ++i) {
        const char *scene = entries[i]->d_name;
        if (code == CLI_OK && !is_listed(work, listed, scene)) {
            regress_case *one = add_case(work);
            code = one != NULL ? CLI_OK : no_memory(work);
            if (one != NULL) {
                one->scene = strdup(scene);
                one->name = strndup(scene, strlen(scene) - strlen(".json"));
                code = one->scene != NULL && one->name != NULL ? CLI_OK : no_memory(work);
            }
        }
        free(entries[i]);
    }
    free(entries);
    return code;
}

/* --- all of them */

static int check_options(const regress_work *work, const regress_case *one) {
    char *list = regress_path(work->folder, list_name);
    const int code = list != NULL ? regress_check_options(one, list) : no_memory(work);
    free(list);
    return code;
}

static int check_unique(const regress_work *work) {
    for (size_t i = 0; i < work->case_count; ++i) {
        const regress_case *one = &work->cases[i];
        for (size_t k = 0; k <= i; ++k) {
            const regress_case *other = &work->cases[k];
            if (k < i && strcmp(one->name, other->name) == 0) {
                return cli_usage("%s: two cases are named '%s'; name them in %s", work->folder, one->name,
                                 list_name);
            }
            for (size_t a = 0; a < one->outputs.count; ++a) {
                for (size_t b = 0; b < (k < i ? other->outputs.count : a); ++b) {
                    if (strcmp(one->outputs.line[a], other->outputs.line[b]) == 0) {
                        return cli_usage("%s: both '%s' and '%s' write '%s'", work->folder, other->name,
                                         one->name, one->outputs.line[a]);
                    }
                }
            }
        }
    }
    return CLI_OK;
}

void regress_mark_failed(regress_case *one, int code) {
    one->status = REGRESS_FAILED;
    one->code = code;
    free(one->reason);
    one->reason = cli_last_message()[0] != '\0' ? strdup(cli_last_message()) : NULL;
}

int regress_failed(regress_case *one, int code) {
    if (code != CLI_USAGE && code != CLI_FILE) {
        return code;
    }
    regress_mark_failed(one, code);
    return CLI_OK;
}

int regress_find_cases(regress_work *work) {
    int code = read_list(work);
    code = code == CLI_OK ? add_scenes(work) : code;
    const char *only = work->settings->only;
    size_t kept = 0;
    for (size_t i = 0; i < work->case_count; ++i) {
        regress_case *one = &work->cases[i];
        if (code == CLI_OK && only != NULL && strstr(one->name, only) == NULL) {
            regress_free_case(one);
            continue;
        }
        work->cases[kept] = *one;
        one = &work->cases[kept++];
        code = code == CLI_OK ? regress_failed(one, list_outputs(work, one)) : code;
        code = code == CLI_OK && one->options.count > 0 ? check_options(work, one) : code;
        if (code == CLI_OK && one->status == REGRESS_FAILED) { /* to be told of by the scene's own name */
            regress_lines_free(&one->outputs);
            code = regress_lines_add(&one->outputs, "%s", one->scene) ? CLI_OK : no_memory(work);
        }
        if (code == CLI_OK) {
            one->comparisons = calloc(one->outputs.count, sizeof *one->comparisons);
            code = one->comparisons != NULL ? CLI_OK : no_memory(work);
        }
    }
    work->case_count = kept;
    if (code == CLI_OK && kept == 0) {
        return only != NULL ? cli_usage("%s: no case's name holds '%s'", work->folder, only)
                            : cli_usage("%s: no scenes (.json) in it", work->folder);
    }
    return code == CLI_OK ? check_unique(work) : code;
}
