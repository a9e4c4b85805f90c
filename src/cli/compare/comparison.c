/* Two files compared by the library, and pictures of their channels where a page is asked for. */
#include "comparison.h"
#include "cli/message.h"

#include <stdlib.h>
#include <string.h>

typedef struct looking {
    const char *page;
    cli_comparison *comparison;
    int code;
} looking;

static int32_t look(void *user, size_t index, const vsh_channel_comparison *channel,
                    const vsh_compared *compared) {
    looking *l = user;
    cli_comparison *c = l->comparison;
    char **more = realloc(c->pictures, (index + 1) * sizeof *more);
    if (more == NULL) {
        l->code = cli_out_of_memory(l->page);
        return 1;
    }
    c->pictures = more;
    while (c->picture_count <= index) {
        c->pictures[c->picture_count++] = NULL;
    }
    c->pictures[index] = cli_comparison_pictures(l->page, channel, compared);
    l->code = c->pictures[index] != NULL ? CLI_OK : CLI_LIMIT;
    return l->code;
}

int cli_comparison_make(const cli_compare_settings *settings, const char *golden, const char *fresh,
                        cli_comparison *c) {
    memset(c, 0, sizeof *c);
    c->golden = strdup(golden);
    c->fresh = strdup(fresh);
    if (c->golden == NULL || c->fresh == NULL) {
        return cli_out_of_memory(golden);
    }
    const vsh_run run = cli_common_run(&settings->common);
    looking l = {settings->html, c, CLI_OK};
    vsh_compare_files_options options = settings->options;
    options.look = settings->html != NULL ? look : NULL;
    options.user = &l;
    vsh_error error;
    if (vsh_compare_files(golden, fresh, &options, &run, &c->made, &error) != VSH_OK) {
        return l.code != CLI_OK ? l.code : cli_fail(&error);
    }
    c->alike = vsh_comparison_alike(c->made) != 0;
    return CLI_OK;
}

const char *cli_comparison_problem(const cli_comparison *c, size_t index) {
    if (c->problem[0] != '\0') {
        return index == 0 ? c->problem : NULL;
    }
    return vsh_comparison_problem(c->made, index);
}

void cli_comparison_free(cli_comparison *c) {
    for (size_t i = 0; i < c->picture_count; ++i) {
        free(c->pictures[i]);
    }
    free(c->pictures);
    vsh_comparison_free(c->made);
    free(c->name);
    free(c->golden);
    free(c->fresh);
    memset(c, 0, sizeof *c);
}
