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
    return (cli_common){0, machine_memory() / 4 * 3, false, false, false, VSH_ISA_BEST, false, false, false};
}

vsh_run cli_common_run(const cli_common *common) {
    vsh_run run = vsh_run_default();
    run.threads = common->threads;
    run.memory_limit = common->memory_limit;
    run.isa = common->isa;
    run.reader = common->trusted ? NULL : VSH_READER;
    run.confined = common->confined;
    run.allow_outside = common->allow_outside;
    run.progress = cli_progress_report;
    run.warning = cli_warnings_take;
    cli_warnings_begin(common->verbose, common->quiet);
    return run;
}

static int check_reader(const cli_common *common) {
    if (common->trusted && common->confined) {
        return cli_usage("--trusted and --confined: give one of the two");
    }
    return CLI_OK;
}

int cli_common_take(cli_common *common, int key, const char *name, const char *value, bool *taken) {
    *taken = true;
    switch (key) {
    case CLI_KEY_THREADS:
        return cli_take_integer(name, value, 1, 1024, &common->threads);
    case CLI_KEY_MEMORY_LIMIT:
        return cli_take_bytes(name, value, &common->memory_limit);
    case CLI_KEY_ISA:
        return cli_take_name(name, value, vsh_isa, vsh_isa_name, &common->isa);
    case CLI_KEY_TRUSTED:
        common->trusted = true;
        return check_reader(common);
    case CLI_KEY_CONFINED:
        common->confined = true;
        return check_reader(common);
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

static int take_rule(cli_grid_settings *settings, const char *name, const char *pattern, int32_t solidity) {
    if (settings->rule_count == CLI_MOST_RULES) {
        return cli_usage("--%s %s: more than %d patterns", name, pattern, CLI_MOST_RULES);
    }
    settings->rules[settings->rule_count++] = (vsh_solidity_rule){pattern, solidity};
    return CLI_OK;
}

int cli_take_unit(const char *name, const char *value, double *unit) {
    *unit = vsh_unit(value);
    return *unit > 0.0 ? CLI_OK : cli_take_positive(name, value, unit);
}

int cli_grid_take(cli_grid_settings *settings, int key, const char *name, const char *value, bool *taken) {
    *taken = true;
    switch (key) {
    case CLI_KEY_RESOLUTION:
        settings->has_resolution = true;
        return cli_take_integer(name, value, 2, 65536, &settings->options.resolution);
    case CLI_KEY_VOXEL_SIZE:
        settings->has_voxel_size = true;
        return cli_take_positive(name, value, &settings->options.voxel_size);
    case CLI_KEY_HALF_WIDTH:
        settings->has_half_width = true;
        return cli_take_number(name, value, 3.0, 100.0, &settings->options.half_width);
    case CLI_KEY_UNIT:
        return cli_take_unit(name, value, &settings->unit);
    case CLI_KEY_CAST_BLENDED:
        settings->cast_blended = true;
        return CLI_OK;
    case CLI_KEY_SHELL_THICKNESS:
        settings->has_shell_thickness = true;
        return cli_take_number(name, value, 1.0, 50.0, &settings->options.shell_thickness);
    case CLI_KEY_SOLID:
        return take_rule(settings, name, value, VSH_SOLIDITY_SOLID);
    case CLI_KEY_SHELL:
        return take_rule(settings, name, value, VSH_SOLIDITY_SHELL);
    case CLI_KEY_INWARD:
        return take_rule(settings, name, value, VSH_SOLIDITY_INWARD);
    default:
        *taken = false;
        return CLI_OK;
    }
}

int cli_grid_check(const cli_grid_settings *settings) {
    if (settings->has_resolution && settings->has_voxel_size) {
        return cli_usage("--resolution and --voxel-size: give one of the two");
    }
    return CLI_OK;
}

void cli_grid_apply(const cli_grid_settings *settings, vsh_scene *scene) {
    vsh_grid_options *options = &scene->grid;
    scene->unit = settings->unit > 0.0 ? settings->unit : scene->unit;
    scene->cast_blended = settings->cast_blended ? 1 : scene->cast_blended;
    if (settings->rule_count > 0) {
        scene->solidity = settings->rules;
        scene->solidity_count = settings->rule_count;
    }
    scene->voxels_named = scene->voxels_named || settings->has_resolution || settings->has_voxel_size;
    if (settings->has_resolution) {
        options->resolution = settings->options.resolution;
        options->voxel_size = 0.0;
    }
    if (settings->has_voxel_size) {
        options->voxel_size = settings->options.voxel_size;
    }
    if (settings->has_half_width) {
        options->half_width = settings->options.half_width;
    }
    if (settings->has_shell_thickness) {
        options->shell_thickness = settings->options.shell_thickness;
    }
}
