/* vdbshade regress: bakes the scenes of a folder that changed, compares them with golden bakes, and reports.
 */
#define _GNU_SOURCE /* dladdr */
#include "cli/regress/regress.h"
#include "cli/commands.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/temporary.h"

#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const cli_option options[] = {
    {0, NULL, NULL, "What is done"},
    {CLI_FLAG(regress_settings, update), "update", NULL,
     "replace golden bakes that differ, and add missing ones"},
    {CLI_FLAG(regress_settings, all), "all", NULL, "bake unchanged cases, too"},
    {CLI_TEXT(regress_settings, only), "only", "TEXT", "only cases whose names contain it"},
    {CLI_TEXT(regress_settings, cache), "cache", "FILE",
     "cases that were alike, with their inputs\n(DIR/.regress-cache.json)"},
    {CLI_TEXT(regress_settings, bakes), "bakes", "FOLDER", "keep the new bakes there"},
    {0, NULL, NULL, "Reports"},
    CLI_REPORT_OPTIONS,
    CLI_COMPARE_OPTIONS,
    {CLI_TEXT(cli_compare_settings, options.tolerances), "tolerances", "FILE.json",
     "limits of all, instead of\nDIR/golden/OUTPUT.tolerance.json"},
    CLI_COMMON_OPTIONS,
};

static int regress_main(int argc, char **argv);

const cli_command cli_regress = {
    "regress",
    "DIR [options]",
    "Bakes the scenes of a folder whose inputs, options or golden bakes changed, and compares them with\n"
    "DIR/golden as 'vdbshade compare' does. Scenes are DIR/*.json. DIR/regress.json names cases with\n"
    "commands and options of their own. Ends with 0 if all are alike, and with 1 if one is not, or has no\n"
    "golden bake. See docs/pipeline.md. Numbers in brackets are defaults.",
    options,
    sizeof options / sizeof options[0],
    regress_main};

/* --- preparing */

/* Hashes program and library: another version may bake other values. */
static int hash_program(regress_work *work) {
    char program[VSH_DIGEST_TEXT], library[VSH_DIGEST_TEXT] = "";
    vsh_error error;
    CLI_TRY(cli_check(vsh_file_digest("/proc/self/exe", NULL, program, &error), &error));
    Dl_info found;
    const char *(*const version)(void) = vsh_version;
    void *address;
    memcpy(&address, &version, sizeof address);
    if (dladdr(address, &found) != 0 && found.dli_fname != NULL) {
        vsh_file_digest(found.dli_fname, NULL, library, &error); /* empty if there is no such file */
    }
    snprintf(work->program, sizeof work->program, "%s %s %s", vsh_version(), program, library);
    return CLI_OK;
}

static int prepare(regress_work *work) {
    const regress_settings *s = work->settings;
    work->golden = regress_path(s->folder, "golden");
    work->cache = s->cache != NULL ? strdup(s->cache) : regress_path(s->folder, ".regress-cache.json");
    CLI_TRY(regress_find_cases(work));
    CLI_TRY(cli_compare_check_reports(&s->compare, (const char *const *)&work->cache, 1));
    CLI_TRY(s->cache == NULL ? cli_check_links(work->golden, work->cache) : CLI_OK);
    CLI_TRY(cli_temporary_check(work->cache));
    CLI_TRY(hash_program(work));
    for (size_t i = 0; i < work->case_count; ++i) {
        regress_case *one = &work->cases[i];
        if (one->status != REGRESS_FAILED) {
            CLI_TRY(regress_fail_alone(one, regress_list_inputs(work, one)));
        }
    }
    return CLI_OK;
}

/* --- baking, before there are threads, then comparing */

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

static int compare_output(const regress_work *work, const regress_case *one, size_t output) {
    cli_comparison *c = &one->comparisons[output];
    const char *name = one->outputs.line[output];
    char *golden = regress_path(work->golden, name), *fresh = regress_path(work->bakes, name);
    int code = CLI_OK;
    if (access(golden, F_OK) == 0) {
        code = cli_comparison_make(&work->settings->compare, golden, fresh, c);
    } else {
        snprintf(c->problem, sizeof c->problem, "no golden bake %.200s; 'vdbshade regress --update' makes it",
                 golden);
    }
    free(golden);
    free(fresh);
    return code;
}

static int compare_case(const regress_work *work, regress_case *one) {
    bool alike = true;
    for (size_t k = 0; k < one->outputs.count; ++k) {
        CLI_TRY(compare_output(work, one, k));
        alike = alike && one->comparisons[k].alike;
    }
    one->status = alike ? REGRESS_ALIKE : REGRESS_UNLIKE;
    return CLI_OK;
}

/* Replaces golden bakes. They are inputs, so those are listed again. */
static int update_case(const regress_work *work, regress_case *one) {
    for (size_t k = 0; k < one->outputs.count; ++k) {
        CLI_TRY(one->comparisons[k].alike ? CLI_OK : regress_update(work, one->outputs.line[k]));
    }
    one->status = REGRESS_UPDATED;
    return regress_list_inputs(work, one);
}

static int compare_all(regress_work *work) {
    for (size_t i = 0; i < work->case_count; ++i) {
        if (work->cases[i].status == REGRESS_UNLIKE) {
            CLI_TRY(compare_case(work, &work->cases[i]));
        }
    }
    for (size_t i = 0; i < work->case_count && work->settings->update; ++i) {
        if (work->cases[i].status == REGRESS_UNLIKE) {
            CLI_TRY(update_case(work, &work->cases[i]));
        }
    }
    return CLI_OK;
}

/* --- reports */

static const char *const status_names[] = {"unchanged", "alike", "not alike", "failed", "updated"};

static const char *failure_of(const regress_case *one, char *text, size_t size) {
    snprintf(text, size, "the bake ended with exit code %d%s%s", one->code,
             one->reason[0] != '\0' ? ": " : "", one->reason);
    return text;
}

static void print_lines(const regress_work *work) {
    for (size_t i = 0; i < work->case_count; ++i) {
        const regress_case *one = &work->cases[i];
        printf("%s: %s", one->name, status_names[one->status]);
        if (one->changed != NULL) {
            printf(" (changed: %s)", one->changed);
        }
        putchar('\n');
        for (size_t k = 0; k < one->outputs.count; ++k) {
            if (one->status == REGRESS_FAILED) {
                char why[1200];
                printf("  %s: %s\n", one->outputs.line[k], failure_of(one, why, sizeof why));
            } else if (one->status == REGRESS_UPDATED && one->comparisons[k].golden == NULL) {
                printf("  %s: is the golden bake now\n", one->outputs.line[k]);
            } else if (one->status != REGRESS_UNCHANGED && !one->comparisons[k].alike) {
                char prefix[300];
                snprintf(prefix, sizeof prefix, "  %.250s: ", one->outputs.line[k]);
                cli_comparison_print(&one->comparisons[k], prefix);
            }
        }
    }
}

static bool is_compared(const regress_case *one) {
    return one->status != REGRESS_UNCHANGED && one->status != REGRESS_FAILED;
}

static void print_json(const regress_work *work) {
    json_t *cases = json_array();
    for (size_t i = 0; i < work->case_count; ++i) {
        const regress_case *one = &work->cases[i];
        json_t *outputs = json_array();
        for (size_t k = 0; k < one->outputs.count && is_compared(one); ++k) {
            json_array_append_new(outputs, cli_comparison_json(&one->comparisons[k]));
        }
        const bool failed = one->status == REGRESS_FAILED;
        json_array_append_new(
            cases, json_pack("{s:o,s:s,s:o,s:o,s:o,s:o}", "name", cli_utf8_json(one->name), "status",
                             status_names[one->status], "changed", cli_utf8_json(one->changed), "exit_code",
                             failed ? json_integer(one->code) : json_null(), "reason",
                             failed && one->reason[0] != '\0' ? cli_utf8_json(one->reason) : json_null(),
                             "outputs", outputs));
    }
    cli_print_json(json_pack("{s:o}", "cases", cases));
}

/* Writes JUnit and HTML, also for cases that were not baked. */
static int write_files(const regress_work *work) {
    size_t count = 0, at = 0;
    for (size_t i = 0; i < work->case_count; ++i) {
        count += work->cases[i].outputs.count;
    }
    cli_comparison *all = calloc(count, sizeof *all);
    for (size_t i = 0; i < work->case_count; ++i) {
        const regress_case *one = &work->cases[i];
        for (size_t k = 0; k < one->outputs.count; ++k) {
            cli_comparison *c = &one->comparisons[k];
            c->name = regress_path(one->name, one->outputs.line[k]);
            c->alike = c->alike || one->status == REGRESS_UNCHANGED;
            if (one->status == REGRESS_FAILED && cli_comparison_problem(c, 0) == NULL) {
                failure_of(one, c->problem, sizeof c->problem);
            }
            all[at++] = *c;
        }
    }
    const int code = cli_comparison_report(&work->settings->compare, all, at);
    free(all);
    return code;
}

/* --- the command */

static int find_verdict(const regress_work *work) {
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

static int run_cases(regress_work *work) {
    CLI_TRY(prepare(work));
    regress_read_cache(work);
    CLI_TRY(regress_make_folder(work));
    CLI_TRY(bake_all(work));
    CLI_TRY(compare_all(work));
    CLI_TRY(regress_write_cache(work));
    const cli_compare_settings *s = &work->settings->compare;
    if (s->json) {
        print_json(work);
    } else if (!cli_given.quiet) {
        print_lines(work);
    }
    CLI_TRY(write_files(work));
    return find_verdict(work);
}

static int regress_main(int argc, char **argv) {
    regress_settings s = {.compare = cli_compare_settings_default()};
    CLI_TRY(cli_parse(&cli_regress, argc, argv, cli_compare_parse, &s, &s.folder));
    regress_work work = {.settings = &s, .run = cli_make_run()};
    const int code = run_cases(&work);
    regress_remove_folder(&work);
    for (size_t i = 0; i < work.case_count; ++i) {
        regress_free_case(&work.cases[i]);
    }
    free(work.cases);
    free(work.bakes);
    free(work.cache);
    free(work.golden);
    return code;
}
