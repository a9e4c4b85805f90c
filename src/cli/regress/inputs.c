/* Lists the inputs of a bake and its verdict, and finds what changed since the case was last alike. */
#include "cli/commands.h"
#include "cli/message.h"
#include "cli/regress/regress.h"
#include "cli/temporary.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <vdbshade/flat.h>
#include <vdbshade/provenance.h>

static int add_digest(const regress_work *work, regress_case *one, const char *what, const char *path) {
    char digest[VSH_DIGEST_TEXT] = "none";
    vsh_error error;
    if (access(path, F_OK) == 0) {
        CLI_TRY(cli_check(vsh_file_digest(path, &work->run, digest, &error), &error));
    }
    regress_add_line(&one->inputs, "%s: %s", what, digest);
    return CLI_OK;
}

/* Adds the limits of the command line. */
static void add_limits(const regress_work *work, regress_case *one) {
    const vsh_compare_files_options *o = &work->settings->compare.options;
    regress_add_line(&one->inputs, "coverage: %s, at most %.9g, padding %d", o->coverage, o->coverage_limit,
                     o->padding);
    regress_add_line(&one->inputs, "step %.9g, reach %d, noise %.9g", o->step, o->reach, o->noise);
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        if (!isnan(o->limits[i])) {
            regress_add_line(&one->inputs, "limit of %s: %.9g", vsh_get_name(VSH_NAMES_MEASURE, i),
                             o->limits[i]);
        }
    }
}

/* Adds the files that a flat scene names. */
static int add_flat_files(const regress_work *work, const regress_case *one, regress_lines *files) {
    vsh_flat_scene *scene = NULL;
    vsh_error error;
    CLI_TRY(cli_check(vsh_flat_scene_read(one->path, &work->run, &scene, &error), &error));
    for (size_t i = 0; i < scene->caster_count; ++i) {
        if (scene->casters[i].path != NULL) {
            regress_add_line(files, "%s", scene->casters[i].path);
        }
    }
    vsh_flat_scene_free(scene);
    return CLI_OK;
}

/* Adds files in options, which may be FILE.vdb:GRID. */
static void add_option_files(const regress_work *work, const regress_case *one, regress_lines *files) {
    for (size_t i = 0; i < one->options.count; ++i) {
        const char *word = one->options.line[i];
        char *path = word[0] == '/' ? strdup(word) : regress_path(work->settings->folder, word);
        struct stat status;
        bool good = stat(path, &status) == 0;
        char *colon = strrchr(path, ':');
        if (!good && colon != NULL) {
            *colon = '\0';
            good = stat(path, &status) == 0;
        }
        if (good && S_ISREG(status.st_mode)) {
            regress_add_line(files, "%s", path);
        }
        free(path);
    }
}

/* Adds digests of the scene's file and of all files it names. */
static int add_provenance(const regress_work *work, regress_case *one) {
    const bool flat = one->command == &cli_flat;
    vsh_scene *scene = NULL;
    vsh_error error;
    CLI_TRY(flat ? CLI_OK : cli_check(vsh_scene_read(one->path, &work->run, &scene, &error), &error));
    regress_lines files = {NULL, 0};
    vsh_provenance *provenance = NULL;
    int code;
    regress_add_line(&files, "%s", one->path);
    CLI_TRY_DONE(flat ? add_flat_files(work, one, &files) : CLI_OK);
    add_option_files(work, one, &files);
    vsh_provenance_source source = vsh_provenance_source_default();
    source.scene = scene;
    source.files = (const char *const *)files.line;
    source.file_count = files.count;
    CLI_TRY_DONE(cli_check(vsh_provenance_create(&source, &work->run, &provenance, &error), &error));
    size_t count;
    const vsh_attribute *attributes = vsh_provenance_attributes(provenance, &count);
    for (size_t i = 0; i < count; ++i) {
        regress_add_line(&one->inputs, "%s: %s", attributes[i].name, attributes[i].value);
    }
done:
    vsh_provenance_free(provenance);
    regress_free_lines(&files);
    vsh_scene_free(scene);
    return code;
}

/* Adds golden bakes and their tolerances. */
static int add_golden(const regress_work *work, regress_case *one) {
    static const char *const endings[] = {"", ".tolerance.json"};
    int code = CLI_OK;
    for (size_t i = 0; i < 2 * one->outputs.count && code == CLI_OK; ++i) {
        char what[PATH_MAX], path[PATH_MAX];
        snprintf(what, sizeof what, "golden %s%s", one->outputs.line[i / 2], endings[i % 2]);
        snprintf(path, sizeof path, "%s/%s", work->golden, what + strlen("golden "));
        code = add_digest(work, one, what, path);
    }
    const char *tolerances = work->settings->compare.options.tolerances;
    return code == CLI_OK && tolerances != NULL ? add_digest(work, one, "tolerances", tolerances) : code;
}

int regress_list_inputs(const regress_work *work, regress_case *one) {
    regress_free_lines(&one->inputs);
    regress_add_line(&one->inputs, "program: %s", work->program);
    regress_add_line(&one->inputs, "command: %s", one->command->name);
    for (size_t i = 0; i < one->options.count; ++i) {
        regress_add_line(&one->inputs, "option: %s", one->options.line[i]);
    }
    CLI_TRY(add_provenance(work, one));
    add_limits(work, one);
    return add_golden(work, one);
}

/* --- the cache: the lines above for each case that was alike */

/* Names the input of a line: a file's name, or the text before the colon. */
static char *name_of(const char *line) {
    static const char input[] = "vdbshade_input_", sum[] = "sha256:";
    const char *colon = strchr(line, ':');
    const char *digest = strncmp(line, input, sizeof input - 1) == 0 ? strstr(line, sum) : NULL;
    const char *name = digest != NULL ? strchr(digest, ' ') : NULL;
    return name != NULL ? strdup(name + 1)
                        : strndup(line, colon != NULL ? (size_t)(colon - line) : strlen(line));
}

static void look_up(json_t *lines, regress_case *one) {
    for (size_t i = 0; lines != NULL && i < one->inputs.count; ++i) {
        const char *line = json_string_value(json_array_get(lines, i));
        if (line == NULL || strcmp(line, one->inputs.line[i]) != 0) {
            one->changed = name_of(one->inputs.line[i]);
            return;
        }
    }
    if (json_array_size(lines) == one->inputs.count) {
        one->status = REGRESS_UNCHANGED;
    }
}

void regress_read_cache(regress_work *work) {
    json_t *root = regress_load(work->cache, REGRESS_MOST_BYTES);
    for (size_t i = 0; i < work->case_count; ++i) {
        regress_case *one = &work->cases[i];
        if (one->status == REGRESS_FAILED) {
            continue;
        }
        one->status = REGRESS_UNLIKE;
        look_up(json_object_get(json_object_get(root, "alike"), one->name), one);
    }
    json_decref(root);
}

/* Keeps cases that --only left out. */
int regress_write_cache(const regress_work *work) {
    json_t *old = regress_load(work->cache, REGRESS_MOST_BYTES), *alike = json_object(),
           *root = json_object();
    if (work->settings->only != NULL) {
        json_object_update(alike, json_object_get(old, "alike"));
    }
    for (size_t i = 0; i < work->case_count; ++i) {
        const regress_case *one = &work->cases[i];
        json_object_del(alike, one->name);
        if (one->status != REGRESS_UNLIKE && one->status != REGRESS_FAILED) {
            json_t *lines = json_array();
            for (size_t k = 0; k < one->inputs.count; ++k) {
                json_array_append_new(lines, json_string(one->inputs.line[k]));
            }
            json_object_set_new(alike, one->name, lines);
        }
    }
    json_object_set_new(root, "alike", alike);
    char *text = json_dumps(root, JSON_INDENT(1));
    json_decref(root);
    json_decref(old);
    const int code = cli_temporary_write(work->cache, text);
    free(text);
    return code;
}
