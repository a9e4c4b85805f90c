/* What came of the cases: lines, JSON, and the reports that comparisons have. */
#define _GNU_SOURCE /* asprintf */
#include "cli/document.h"
#include "cli/message.h"
#include "regress.h"

#include <stdlib.h>

static const char *const status_names[] = {"unchanged", "alike", "not alike", "failed", "updated"};

/* What the golden bake was that a new one took the place of. */
static void print_updated(const cli_comparison *c, const char *output) {
    if (c->alike) {
        return;
    }
    if (c->golden == NULL) {
        printf("  %s: is the golden bake now; there was none\n", output);
        return;
    }
    printf("  %s: is the golden bake now; the one before differed:\n", output);
    const char *problem;
    const vsh_channel_comparison *channel;
    for (size_t i = 0; (problem = cli_comparison_problem(c, i)) != NULL; ++i) {
        printf("    %s\n", problem);
    }
    for (size_t i = 0; (channel = vsh_comparison_channel(c->made, i)) != NULL; ++i) {
        char what[CLI_EXPLANATION];
        cli_channel_explain(channel, what);
        if (what[0] != '\0') {
            printf("    %s: %s\n", channel->name, what);
        }
    }
}

static const char *failure_of(const regress_case *one, char *text, size_t size) {
    snprintf(text, size, "the bake ended with exit code %d%s%s", one->code, one->reason != NULL ? ": " : "",
             one->reason != NULL ? one->reason : "");
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
            } else if (one->status == REGRESS_UPDATED) {
                print_updated(&one->comparisons[k], one->outputs.line[k]);
            } else if (one->status != REGRESS_UNCHANGED && !one->comparisons[k].alike) {
                char prefix[300];
                snprintf(prefix, sizeof prefix, "  %.250s: ", one->outputs.line[k]);
                cli_comparison_print(stdout, &one->comparisons[k], prefix);
            }
        }
    }
}

static int print_json(const regress_work *work) {
    json_t *cases = json_array();
    for (size_t i = 0; i < work->case_count; ++i) {
        const regress_case *one = &work->cases[i];
        json_t *outputs = json_array();
        for (size_t k = 0; k < one->outputs.count && one->comparisons[k].name != NULL; ++k) {
            json_array_append_new(outputs, cli_comparison_json(&one->comparisons[k]));
        }
        const bool failed = one->status == REGRESS_FAILED;
        json_array_append_new(
            cases, json_pack("{s:o,s:s,s:o,s:o,s:o,s:o}", "name", cli_utf8_json(one->name), "status",
                             status_names[one->status], "changed",
                             one->changed != NULL ? cli_utf8_json(one->changed) : json_null(), "exit_code",
                             failed ? json_integer(one->code) : json_null(), "reason",
                             failed && one->reason != NULL ? cli_utf8_json(one->reason) : json_null(),
                             "outputs", outputs));
    }
    json_t *root = json_pack("{s:o}", "cases", cases);
    const bool whole = root != NULL && json_dumpf(root, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(9)) == 0;
    json_decref(root);
    putchar('\n');
    return whole ? CLI_OK : cli_out_of_memory(work->folder);
}

/* One entry an output, also of cases that were not baked. */
static int write_files(const regress_work *work) {
    const cli_compare_settings *s = &work->settings->compare;
    size_t count = 0, at = 0;
    for (size_t i = 0; i < work->case_count; ++i) {
        count += work->cases[i].outputs.count;
    }
    cli_comparison *all = calloc(count + 1, sizeof *all);
    bool good = all != NULL;
    for (size_t i = 0; i < work->case_count && good; ++i) {
        regress_case *one = &work->cases[i];
        for (size_t k = 0; k < one->outputs.count && good; ++k) {
            cli_comparison *c = &one->comparisons[k];
            if (c->name == NULL) {
                good = asprintf(&c->name, "%s/%s", one->name, one->outputs.line[k]) >= 0;
                c->alike = one->status == REGRESS_UNCHANGED;
            }
            if (one->status == REGRESS_FAILED && cli_comparison_problem(c, 0) == NULL) {
                failure_of(one, c->problem, sizeof c->problem);
            }
            all[at++] = *c;
        }
    }
    const int code = good ? cli_comparison_report(s, all, at) : cli_out_of_memory(work->folder);
    free(all);
    return code;
}

int regress_report(const regress_work *work) {
    const cli_compare_settings *s = &work->settings->compare;
    int code = CLI_OK;
    if (s->json) {
        code = print_json(work);
    } else if (!s->common.quiet) {
        print_lines(work);
    }
    return code == CLI_OK && (s->junit != NULL || s->html != NULL) ? write_files(work) : code;
}
