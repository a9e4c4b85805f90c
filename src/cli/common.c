/* The options that several commands share. */
#include "message.h"
#include "options.h"
#include "progress.h"
#include "warnings.h"

#include <stdio.h>
#include <sys/resource.h>
#include <unistd.h>
#include <vdbshade/reader.h>

/* The machine's memory, or where they are less the control group's (a container) and what the process may
 * address (ulimit -v). 0: not known. */
static uint64_t machine_memory(void) {
    const long pages = sysconf(_SC_PHYS_PAGES);
    const long page = sysconf(_SC_PAGESIZE);
    uint64_t bytes = pages > 0 && page > 0 ? (uint64_t)pages * (uint64_t)page : 0;
    static const char *const limits[] = {"/sys/fs/cgroup/memory.max",
                                         "/sys/fs/cgroup/memory/memory.limit_in_bytes"};
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; ++i) {
        FILE *file = fopen(limits[i], "r");
        unsigned long long limit = 0;
        if (file != NULL) {
            if (fscanf(file, "%llu", &limit) == 1 && limit > 0 && (bytes == 0 || limit < bytes)) {
                bytes = limit;
            }
            fclose(file);
        }
    }
    struct rlimit space;
    if (getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY &&
        (bytes == 0 || space.rlim_cur < bytes)) {
        bytes = space.rlim_cur;
    }
    return bytes;
}

cli_common cli_common_default(void) {
    return (cli_common){.memory_limit = machine_memory() / 4 * 3, .sandbox = CLI_SANDBOX_AUTO};
}

vsh_run cli_common_run(const cli_common *common) {
    vsh_run run = vsh_run_default();
    run.threads = common->threads;
    run.memory_limit = common->memory_limit;
    run.reader = common->sandbox == CLI_SANDBOX_OFF ? NULL : VSH_READER;
    run.confined = common->sandbox == CLI_SANDBOX_REQUIRE;
    run.allow_outside = common->allow_outside;
    run.progress = cli_progress_report;
    run.warning = cli_warnings_parse;
    run.notes = common->verbose;
    cli_warnings_begin(common->verbose, common->quiet);
    return run;
}

static int parse_sandbox(const char *name, const char *value, int *sandbox) {
    static const char *const names[] = {
        [CLI_SANDBOX_AUTO] = "auto", [CLI_SANDBOX_REQUIRE] = "require", [CLI_SANDBOX_OFF] = "off"};
    for (int i = CLI_SANDBOX_AUTO; i <= CLI_SANDBOX_OFF; ++i) {
        if (strcmp(value, names[i]) == 0) {
            *sandbox = i;
            return CLI_OK;
        }
    }
    return cli_usage("%s '%s': expected auto, require or off", name, value);
}

int cli_common_parse(cli_common *common, int key, const char *name, const char *value, bool *taken) {
    *taken = true;
    switch (key) {
    case CLI_KEY_THREADS:
        return cli_parse_integer(name, value, 1, 1024, &common->threads);
    case CLI_KEY_MEMORY_LIMIT:
        return cli_parse_bytes(name, value, &common->memory_limit);
    case CLI_KEY_SANDBOX:
        return parse_sandbox(name, value, &common->sandbox);
    case CLI_KEY_ALLOW_OUTSIDE:
        common->allow_outside = true;
        return CLI_OK;
    case CLI_KEY_QUIET:
        common->quiet = true;
        return CLI_OK;
    case CLI_KEY_VERBOSE:
        common->verbose = true;
        return CLI_OK;
    case CLI_KEY_PROGRESS:
        common->progress = true;
        return CLI_OK;
    default:
        *taken = false;
        return CLI_OK;
    }
}
