/* vdbshade regress: a folder of scenes, baked where something changed and held against their golden bakes. */
#define _GNU_SOURCE /* asprintf, dladdr */
#include "regress.h"
#include "cli/commands.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/temporary.h"

#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <vdbshade/provenance.h>

enum { KEY_UPDATE = 0x2000, KEY_ALL, KEY_CACHE, KEY_BAKES, KEY_ONLY };

static const cli_option options[] = {
    {0, NULL, NULL, "What is done"},
    {KEY_UPDATE, "update", NULL,
     "put new bakes in the place of golden ones that they are\nnot like, and of missing ones"},
    {KEY_ALL, "all", NULL, "bake what did not change, too"},
    {KEY_ONLY, "only", "TEXT", "only cases whose names hold it"},
    {KEY_CACHE, "cache", "FILE", "what was alike, and of what inputs\n(DIR/.regress-cache.json)"},
    {KEY_BAKES, "bakes", "FOLDER", "keep the new bakes there"},
    {0, NULL, NULL, "Reports"},
    CLI_REPORT_OPTIONS,
    CLI_COMPARE_OPTIONS,
    {CLI_KEY_TOLERANCES, "tolerances", "FILE.json",
     "limits of all, in place of their own\nDIR/golden/OUTPUT.tolerance.json"},
    CLI_COMMON_OPTIONS,
};

static int regress_main(int argc, char **argv);

const cli_command cli_regress = {
    "regress",
    "DIR [options]",
    "Bakes the scenes of a folder whose inputs, options or golden bakes changed, and compares as\n"
    "'vdbshade compare' does with DIR/golden. Scenes are DIR/*.json; DIR/regress.json names cases with\n"
    "commands and options of their own. Ends with 0 where all are alike, 1 where one is not or has no\n"
    "golden bake. See docs/regression.md. Numbers in brackets are what holds without the option.",
    options,
    sizeof options / sizeof options[0],
    regress_main};

static int take(void *settings, int key, const char *name, const char *value) {
    regress_settings *s = settings;
    switch (key) {
    case KEY_UPDATE:
        s->update = true;
        return CLI_OK;
    case KEY_ALL:
        s->all = true;
        return CLI_OK;
    case KEY_ONLY:
        s->only = value;
        return CLI_OK;
    case KEY_CACHE:
        s->cache = value;
        return CLI_OK;
    case KEY_BAKES:
        s->bakes = value;
        return CLI_OK;
    default:
        return cli_compare_parse(&s->compare, key, name, value);
    }
}

/* --- beforehand */

/* Another program may bake otherwise: its bytes are an input too, and those of the library. */
static int hash_program(regress_work *work) {
    char program[VSH_DIGEST_TEXT], library[VSH_DIGEST_TEXT] = "";
    vsh_error error;
    if (vsh_file_digest("/proc/self/exe", NULL, program, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    Dl_info found;
    const char *(*const version)(void) = vsh_version;
    void *address;
    memcpy(&address, &version, sizeof address);
    if (dladdr(address, &found) != 0 && found.dli_fname != NULL) {
        vsh_file_digest(found.dli_fname, NULL, library, &error); /* a name that is not there adds nothing */
    }
    return asprintf(&work->program, "%s %s %s", vsh_version(), program, library) >= 0
               ? CLI_OK
               : cli_out_of_memory("program");
}

/* The folder for new bakes. */
static int make_bakes(regress_work *work) {
    const char *given = work->settings->bakes;
    if (given == NULL) {
        return regress_folder_make(&work->folder_of_bakes, &work->bakes);
    }
    if (mkdir(given, 0777) != 0 && errno != EEXIST) {
        cli_say("%s: cannot be made: %s", given, strerror(errno));
        return CLI_FILE;
    }
    work->bakes = realpath(given, NULL);
    if (work->bakes == NULL) {
        cli_say("%s: cannot be made: %s", given, strerror(errno));
        return CLI_FILE;
    }
    return CLI_OK;
}

static int prepare(regress_work *work) {
    const regress_settings *s = work->settings;
    work->folder = strdup(s->folder);
    work->golden = regress_path(s->folder, "golden");
    work->cache = s->cache != NULL ? strdup(s->cache) : regress_path(s->folder, ".regress-cache.json");
    if (work->folder == NULL || work->golden == NULL || work->cache == NULL) {
        return cli_out_of_memory(s->folder);
    }
    int code = regress_find_cases(work);
    code =
        code == CLI_OK ? cli_compare_check_reports(&s->compare, (const char *const *)&work->cache, 1) : code;
    code = code == CLI_OK && s->cache == NULL ? cli_check_links(work->golden, work->cache) : code;
    code = code == CLI_OK ? cli_temporary_check(work->cache) : code;
    code = code == CLI_OK ? hash_program(work) : code;
    for (size_t i = 0; i < work->case_count && code == CLI_OK; ++i) {
        regress_case *one = &work->cases[i];
        if (one->status != REGRESS_FAILED) {
            code = regress_failed(one, regress_list_inputs(work, one));
        }
    }
    return code;
}

/* --- baking, before there are threads; then comparing */

static int bake_all(regress_work *work) {
    for (size_t i = 0; i < work->case_count; ++i) {
        regress_case *one = &work->cases[i];
        if (one->status == REGRESS_FAILED || (one->status == REGRESS_UNCHANGED && !work->settings->all)) {
            continue;
        }
        one->status = REGRESS_UNLIKE;
        if (cli_progress_report(NULL, one->name, 0.0) != 0) {
            const vsh_error cancelled = {VSH_ERROR_CANCELLED, ""};
            return cli_fail(&cancelled);
        }
        cli_keep_message("");
        const int code = regress_bake(work, one);
        if (code == CLI_INTERRUPTED) {
            return code;
        }
        if (code != CLI_OK) {
            regress_mark_failed(one, code);
        }
    }
    return CLI_OK;
}

/* Both files of an output; to be freed. */
static bool output_paths(const regress_work *work, const char *output, char *paths[2]) {
    paths[0] = regress_path(work->golden, output);
    paths[1] = regress_path(work->bakes, output);
    return paths[0] != NULL && paths[1] != NULL;
}

typedef int output_fn(regress_work *work, regress_case *one, size_t output, const char *golden,
                      const char *fresh);

/* Calls fn for each output that was baked. */
static int each_output(regress_work *work, output_fn *fn) {
    int code = CLI_OK;
    for (size_t i = 0; i < work->case_count && code == CLI_OK; ++i) {
        regress_case *one = &work->cases[i];
        for (size_t k = 0; k < one->outputs.count && code == CLI_OK && one->status == REGRESS_UNLIKE; ++k) {
            char *paths[2];
            code = output_paths(work, one->outputs.line[k], paths) ? fn(work, one, k, paths[0], paths[1])
                                                                   : cli_out_of_memory(work->folder);
            free(paths[0]);
            free(paths[1]);
        }
    }
    return code;
}

static int compare_output(regress_work *work, regress_case *one, size_t output, const char *golden,
                          const char *fresh) {
    cli_comparison *c = &one->comparisons[output];
    int code = CLI_OK;
    if (access(golden, F_OK) == 0) {
        code = cli_comparison_make(&work->settings->compare, golden, fresh, c);
    } else {
        snprintf(c->problem, sizeof c->problem, "no golden bake %.200s; 'vdbshade regress --update' makes it",
                 golden);
    }
    if (code == CLI_OK && asprintf(&c->name, "%s/%s", one->name, one->outputs.line[output]) < 0) {
        c->name = NULL;
        code = cli_out_of_memory(golden);
    }
    return code;
}

static void judge(regress_work *work) {
    for (size_t i = 0; i < work->case_count; ++i) {
        regress_case *one = &work->cases[i];
        bool alike = one->status == REGRESS_UNLIKE;
        for (size_t k = 0; k < one->outputs.count && alike; ++k) {
            alike = one->comparisons[k].alike;
        }
        one->status = alike ? REGRESS_ALIKE : one->status;
    }
}

static int update_output(regress_work *work, regress_case *one, size_t output, const char *golden,
                         const char *fresh) {
    (void)golden;
    (void)fresh;
    return one->comparisons[output].alike ? CLI_OK : regress_update(work, one->outputs.line[output]);
}

/* What they depend on is listed anew: golden bakes are part of it. */
static int update_all(regress_work *work) {
    int code = each_output(work, update_output);
    for (size_t i = 0; i < work->case_count && code == CLI_OK; ++i) {
        if (work->cases[i].status == REGRESS_UNLIKE) {
            work->cases[i].status = REGRESS_UPDATED;
            code = regress_list_inputs(work, &work->cases[i]);
        }
    }
    return code;
}

static int verdict(const regress_work *work) {
    int code = CLI_OK;
    for (size_t i = 0; i < work->case_count; ++i) {
        const regress_case *one = &work->cases[i];
        if (one->status == REGRESS_FAILED && code <= CLI_UNLIKE) {
            code = one->code;
        } else if (one->status == REGRESS_UNLIKE && code == CLI_OK) {
            code = CLI_UNLIKE;
        }
    }
    return code;
}

static int run(regress_work *work) {
    const regress_settings *s = work->settings;
    int code = prepare(work);
    if (code != CLI_OK) {
        return code;
    }
    regress_read_cache(work);
    code = make_bakes(work);
    code = code == CLI_OK ? bake_all(work) : code;
    code = code == CLI_OK ? each_output(work, compare_output) : code;
    if (code == CLI_OK) {
        judge(work);
        code = s->update ? update_all(work) : CLI_OK;
    }
    code = code == CLI_OK ? regress_write_cache(work) : code;
    code = code == CLI_OK ? regress_report(work) : code;
    return code == CLI_OK ? verdict(work) : code;
}

static int regress_main(int argc, char **argv) {
    regress_settings s = {.compare = cli_compare_settings_default()};
    bool help;
    int code = cli_parse(&cli_regress, argc, argv, take, &s, "DIR", &s.folder, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    cli_progress_begin(s.compare.common.progress, s.compare.common.quiet);
    regress_work work = {.settings = &s};
    code = run(&work);
    regress_folder_remove(&work.folder_of_bakes, work.bakes);
    for (size_t i = 0; i < work.case_count; ++i) {
        regress_free_case(&work.cases[i]);
    }
    free(work.cases);
    free(work.program);
    free(work.bakes);
    free(work.cache);
    free(work.golden);
    free(work.folder);
    cli_progress_end();
    return code;
}
