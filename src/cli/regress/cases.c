/* Finds the cases of a folder: its scenes, and those of its regress.json, whose options are checked. The
 * folder may be a stranger's that a CI runs as it came. So only the command line of `regress` itself may ask
 * to write files, or to parse them unconfined. */
#define _GNU_SOURCE /* asprintf */
#include "base/file.h"
#include "cli/commands.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/regress/regress.h"

#include <dirent.h>
#include <errno.h>
#include <fnmatch.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <vdbshade/flat.h>

static const char list_name[] = "regress.json";

enum { MOST_SCENE = 64 << 20 }; /* bytes of a scene */

void regress_add_line(regress_lines *lines, const char *format, ...) {
    lines->line = realloc(lines->line, (lines->count + 2) * sizeof *lines->line);
    va_list arguments;
    va_start(arguments, format);
    lines->count += vasprintf(&lines->line[lines->count], format, arguments) >= 0;
    va_end(arguments);
    lines->line[lines->count] = NULL;
}

void regress_free_lines(regress_lines *lines) {
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
    regress_free_lines(&one->options);
    regress_free_lines(&one->outputs);
    regress_free_lines(&one->inputs);
    free(one->changed);
    free(one->reason);
    free(one->output);
    free(one->path);
    free(one->scene);
    free(one->name);
    memset(one, 0, sizeof *one);
}

void regress_mark_failed(regress_case *one, int code) {
    one->status = REGRESS_FAILED;
    one->code = code;
    free(one->reason);
    one->reason = strdup(cli_last_message());
}

int regress_fail_alone(regress_case *one, int code) {
    if (code != CLI_USAGE && code != CLI_FILE) {
        return code;
    }
    regress_mark_failed(one, code);
    return CLI_OK;
}

static regress_case *add_case(regress_work *work, const char *scene, const char *name, size_t name_length) {
    work->cases = realloc(work->cases, (work->case_count + 1) * sizeof *work->cases);
    regress_case *one = &work->cases[work->case_count++];
    *one = (regress_case){.scene = strdup(scene),
                          .path = regress_path(work->settings->folder, scene),
                          .name = strndup(name, name_length)};
    return one;
}

/* --- outputs of scenes */

json_t *regress_load(const char *path, uint64_t most) {
    FILE *file;
    uint64_t size;
    if (vshi_input_open(path, path, most, &file, &size, NULL) != VSH_OK) {
        return NULL;
    }
    json_t *root = json_loadf(file, 0, NULL);
    fclose(file);
    return root;
}

static bool has_region(const char *path) {
    json_t *root = regress_load(path, MOST_SCENE);
    const bool has = json_object_get(root, "region") != NULL;
    json_decref(root);
    return has;
}

/* Completes command and outputs. A scene with a region is for `flat`. It is read as a scene first, because
 * that checks the memory limit before taking any. */
static int list_outputs(const regress_work *work, regress_case *one) {
    vsh_error error = {VSH_OK, ""};
    vsh_flat_scene *flat = NULL;
    if (one->command == NULL || (one->command == &cli_flat && one->output == NULL)) {
        vsh_flat_scene_read(one->path, &work->run, &flat, &error);
    }
    if (one->command == NULL) {
        const bool is_flat = flat != NULL || error.code == VSH_ERROR_LIMIT || has_region(one->path);
        one->command = is_flat ? &cli_flat : &cli_bake;
    }
    if (one->command == &cli_flat && error.code != VSH_OK) {
        return cli_fail(&error);
    }
    if (one->output == NULL && flat != NULL && flat->output != NULL) {
        one->output = strdup(cli_file_name(flat->output));
    }
    vsh_flat_scene_free(flat);
    if (one->output != NULL) {
        regress_add_line(&one->outputs, "%s", one->output);
    } else if (one->command == &cli_bake) {
        vsh_scene *scene = NULL;
        CLI_TRY(cli_check(vsh_scene_read(one->path, &work->run, &scene, &error), &error));
        for (size_t i = 0; i < scene->receiver_count; ++i) {
            regress_add_line(&one->outputs, "%s", cli_file_name(scene->receivers[i].output));
        }
        vsh_scene_free(scene);
    }
    return one->outputs.count > 0
               ? CLI_OK
               : cli_usage("%s: nothing says what '%s' writes; give it an \"output\" in %s", one->path,
                           one->name, list_name);
}

/* --- regress.json */

static int bad_case(const regress_work *work, size_t i, const char *what) {
    return cli_usage("%s/%s: cases[%zu]: %s", work->settings->folder, list_name, i, what);
}

static int read_options(const regress_work *work, const json_t *options, size_t i, regress_case *one) {
    size_t k;
    json_t *word;
    bool strings = options == NULL || json_is_array(options);
    json_array_foreach(options, k, word) {
        strings = strings && json_is_string(word);
        if (strings) {
            regress_add_line(&one->options, "%s", json_string_value(word));
        }
    }
    return strings ? CLI_OK : bad_case(work, i, "options: expected an array of strings");
}

static int read_case(regress_work *work, json_t *json, size_t i) {
    static const cli_command *const commands[] = {&cli_bake, &cli_volume, &cli_flat, &cli_voxelize};
    const char *scene = NULL, *name = NULL, *output = NULL, *command = NULL;
    const json_t *words = NULL;
    json_error_t why;
    if (json_unpack_ex(json, &why, 0, "{s:s,s?s,s?s,s?s,s?o!}", "scene", &scene, "name", &name, "output",
                       &output, "command", &command, "options", &words) != 0) {
        return bad_case(work, i, why.text);
    }
    if (output != NULL && (strchr(output, '/') != NULL || output[strspn(output, ".")] == '\0')) {
        return bad_case(work, i, "output: a name without a folder is expected");
    }
    regress_case *one = name != NULL ? add_case(work, scene, name, strlen(name))
                                     : add_case(work, scene, scene, strcspn(scene, "."));
    one->output = output != NULL ? strdup(output) : NULL;
    for (size_t k = 0; command != NULL && k < sizeof commands / sizeof commands[0]; ++k) {
        one->command = strcmp(commands[k]->name, command) == 0 ? commands[k] : one->command;
    }
    if (command != NULL && one->command == NULL) {
        return bad_case(work, i, "command: expected bake, volume, flat or voxelize");
    }
    return read_options(work, words, i, one);
}

static int read_list(regress_work *work, const char *path) {
    FILE *file;
    uint64_t size;
    vsh_error error;
    if (vshi_input_open(path, path, REGRESS_MOST_BYTES, &file, &size, &error) != VSH_OK) {
        return access(path, F_OK) != 0 && errno == ENOENT ? CLI_OK : cli_fail(&error);
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
    return code;
}

/* --- options of regress.json */

/* Options of all commands that change values, besides settings, which all do. Others are refused. Add a new
 * option here if it writes nothing. */
static const char *const changes_values[] = {
    "receive",      "no-receive", "no-cast",        "one-sided", "sun",    "sun-angle",  "lights",
    "light-radius", "caster",     "treat",          "half",      "band",   "box",        "like",
    "inside",       "name",       "box-voxel-size", "density",   "height", "size-world", "floor"};

static bool is_allowed(const char *option) {
    const vsh_setting *setting;
    for (size_t i = 0; (setting = cli_setting(i)) != NULL; ++i) {
        if (strcmp(setting->option, option) == 0) {
            return true;
        }
    }
    for (size_t i = 0; i < sizeof changes_values / sizeof changes_values[0]; ++i) {
        if (strcmp(changes_values[i], option) == 0) {
            return true;
        }
    }
    return false;
}

static int check_options(const regress_work *work, const regress_case *one) {
    for (size_t i = 0; i < one->options.count; ++i) {
        const char *word = one->options.line[i];
        cli_option option; /* the word is "--NAME" or "--NAME=VALUE" */
        const bool found = strncmp(word, "--", 2) == 0 && cli_find_option(one->command, word, &option);
        if (!found || !is_allowed(option.name)) {
            return cli_usage(
                "%s/%s: case '%s': option '%s' of '%s' may not be in this file, because it does not change "
                "values; give --sandbox, --threads and --memory-limit to 'vdbshade regress' itself",
                work->settings->folder, list_name, one->name, word, one->command->name);
        }
        i += option.value != NULL && strchr(word, '=') == NULL; /* skip its value */
    }
    return CLI_OK;
}

/* --- the folder's other scenes */

static int is_scene(const struct dirent *entry) {
    const char *name = entry->d_name;
    return name[0] != '.' && cli_has_ending(name, "json") && strcmp(name, list_name) != 0 &&
           fnmatch("*.tolerance.json", name, 0) != 0;
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
    const int count = scandir(work->settings->folder, &entries, is_scene, alphasort);
    if (count < 0) {
        cli_say("%s: cannot be read: %s", work->settings->folder, strerror(errno));
        return CLI_FILE;
    }
    const size_t listed = work->case_count;
    for (int i = 0; i < count; ++i) {
        const char *scene = entries[i]->d_name;
        if (!is_listed(work, listed, scene)) {
            add_case(work, scene, scene, strlen(scene) - strlen(".json"));
        }
        free(entries[i]);
    }
    free(entries);
    return CLI_OK;
}

/* --- all cases */

static int check_unique(const regress_work *work) {
    for (size_t i = 0; i < work->case_count; ++i) {
        const regress_case *one = &work->cases[i];
        for (size_t k = 0; k <= i; ++k) {
            const regress_case *other = &work->cases[k];
            if (k < i && strcmp(one->name, other->name) == 0) {
                return cli_usage("%s: two cases are named '%s'; name them in %s", work->settings->folder,
                                 one->name, list_name);
            }
            for (size_t a = 0; a < one->outputs.count; ++a) {
                for (size_t b = 0; b < (k < i ? other->outputs.count : a); ++b) {
                    if (strcmp(one->outputs.line[a], other->outputs.line[b]) == 0) {
                        return cli_usage("%s: both '%s' and '%s' write '%s'", work->settings->folder,
                                         other->name, one->name, one->outputs.line[a]);
                    }
                }
            }
        }
    }
    return CLI_OK;
}

static int complete_case(const regress_work *work, regress_case *one) {
    CLI_TRY(regress_fail_alone(one, list_outputs(work, one)));
    CLI_TRY(one->options.count > 0 ? check_options(work, one) : CLI_OK);
    if (one->status == REGRESS_FAILED) { /* reported under the scene's own name */
        regress_free_lines(&one->outputs);
        regress_add_line(&one->outputs, "%s", one->scene);
    }
    one->comparisons = calloc(one->outputs.count, sizeof *one->comparisons);
    return CLI_OK;
}

int regress_find_cases(regress_work *work) {
    char *list = regress_path(work->settings->folder, list_name);
    const int code = read_list(work, list);
    free(list);
    CLI_TRY(code);
    CLI_TRY(add_scenes(work));
    const char *only = work->settings->only;
    size_t kept = 0;
    for (size_t i = 0; i < work->case_count; ++i) {
        if (only != NULL && strstr(work->cases[i].name, only) == NULL) {
            regress_free_case(&work->cases[i]);
        } else {
            work->cases[kept++] = work->cases[i];
        }
    }
    work->case_count = kept;
    if (kept == 0) {
        return only != NULL ? cli_usage("%s: no case's name holds '%s'", work->settings->folder, only)
                            : cli_usage("%s: no scenes (.json) in it", work->settings->folder);
    }
    for (size_t i = 0; i < kept; ++i) {
        CLI_TRY(complete_case(work, &work->cases[i]));
    }
    return check_unique(work);
}
