/* Two files, of one kind or not: images, or grids. */
#include "comparison.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "comparison_parts.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

static int read_tolerances(compare_work *work, const char *golden) {
    char path[4096];
    const char *file = work->settings->tolerances;
    if (file == NULL) {
        if (snprintf(path, sizeof path, "%s.tolerance.json", golden) >= (int)sizeof path ||
            access(path, F_OK) != 0) {
            return CLI_OK;
        }
        file = path;
    }
    vsh_error error;
    return vsh_tolerances_read(file, &work->tolerances, &error) == VSH_OK ? CLI_OK : cli_fail(&error);
}

/* One name for each format. */
static const char *format_of(const char *path) {
    static const struct {
        const char *ending, *format;
    } other[] = {{"tiff", "tif"}, {"jpeg", "jpg"},  {"jpe", "jpg"},  {"jif", "jpg"}, {"jfif", "jpg"},
                 {"jfi", "jpg"},  {"heif", "heic"}, {"rgbe", "hdr"}, {"j2k", "jp2"}};
    const char *slash = strrchr(path, '/');
    const char *dot = strrchr(slash != NULL ? slash : path, '.');
    const char *ending = dot != NULL ? dot + 1 : "";
    for (size_t i = 0; i < sizeof other / sizeof other[0]; ++i) {
        if (strcasecmp(other[i].ending, ending) == 0) {
            return other[i].format;
        }
    }
    return ending;
}

int cli_comparison_make(const cli_compare_settings *settings, const char *golden, const char *fresh,
                        cli_comparison *c) {
    memset(c, 0, sizeof *c);
    c->golden = strdup(golden);
    c->fresh = strdup(fresh);
    if (c->golden == NULL || c->fresh == NULL) {
        return cli_out_of_memory(golden);
    }
    compare_work work = {.settings = settings, .run = cli_common_run(&settings->common), .comparison = c};
    int code = read_tolerances(&work, golden);
    const bool grids = cli_has_ending(golden, "vdb");
    const char *was = format_of(golden), *is = format_of(fresh);
    if (code == CLI_OK && strcasecmp(was, is) != 0 &&
        !cli_comparison_add_problem(c, "format: golden is '%.100s', new is '%.100s'", was, is)) {
        code = cli_out_of_memory(golden);
    }
    if (code == CLI_OK && grids == cli_has_ending(fresh, "vdb")) {
        code = grids ? compare_grids(&work) : compare_images(&work);
    }
    c->alike = c->problem_count == 0;
    for (size_t i = 0; i < c->channel_count; ++i) {
        c->alike = c->alike && cli_channel_alike(&c->channels[i]);
    }
    vsh_tolerances_free(work.tolerances);
    return code;
}
