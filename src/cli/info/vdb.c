#include "base/bytes.h"
#include "cli/message.h"
#include "cli/options.h"
#include "info.h"

#include <inttypes.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/grid.h>

enum { MAX_LISTED = 4096 };

/* Whether it is of `vdbshade volume`: what is wrong with it as a caster is then no problem. */
static bool is_ours(const vsh_vdb_entry *grid) {
    return strstr(grid->attributes, "vdbshade_version") != NULL && strcmp(grid->grid_class, "level set") != 0;
}

static void print_grid(const vsh_vdb_entry *grid) {
    char bytes[32];
    printf("grid '%s'\n  type: %s\n  class: %s\n", grid->name, grid->type, grid->grid_class);
    printf("  voxel size: %g %g %g\n", grid->voxel_size[0], grid->voxel_size[1], grid->voxel_size[2]);
    if (grid->background != 0.0) {
        printf("  background: %g", grid->background);
        if (grid->voxel_size[0] > 0.0 && strcmp(grid->grid_class, "level set") == 0) {
            printf(" (%.3g voxels)", fabs(grid->background) / grid->voxel_size[0]);
        }
        putchar('\n');
    }
    printf("  active voxels: %" PRIu64 ", %d %d %d to %d %d %d\n", grid->active_voxels, grid->index_min[0],
           grid->index_min[1], grid->index_min[2], grid->index_max[0], grid->index_max[1],
           grid->index_max[2]);
    printf("  memory: %s\n", vshi_bytes_text(grid->bytes, bytes, sizeof bytes));
    for (const char *line = grid->attributes; *line != '\0';) {
        const size_t length = strcspn(line, "\n");
        printf("  %.*s\n", (int)length, line);
        line += length + (line[length] != '\0');
    }
    if (is_ours(grid)) {
        printf(
            "  holds: values that vdbshade baked, to be looked up: it is no caster and needs to be none\n");
    } else if (grid->problem[0] != '\0') {
        printf(grid->mended != 0 ? "  note: %s: its distances are made anew where it is used\n"
                                 : "  problem: %s\n",
               grid->problem);
    }
}

static void say_names(const char *path, const char *name, const vsh_vdb_entry *entries, size_t count) {
    char names[700] = "";
    size_t used = 0;
    for (size_t i = 0; i < count && used < sizeof names; ++i) {
        used +=
            (size_t)snprintf(names + used, sizeof names - used, "%s'%s'", i > 0 ? ", " : "", entries[i].name);
    }
    cli_say("%s: no grid '%s'; it holds %s", path, name, names);
}

int cli_info_vdb(const char *path, const char *name, const vsh_run *run) {
    vsh_vdb_entry *entries = calloc(MAX_LISTED, sizeof *entries);
    if (entries == NULL) {
        cli_say("%s: the system refused memory", path);
        return CLI_LIMIT;
    }
    size_t count = 0;
    vsh_error error;
    if (vsh_vdb_list(path, run, entries, MAX_LISTED, &count, &error) != VSH_OK) {
        free(entries);
        return cli_fail(&error);
    }
    const size_t listed = count < MAX_LISTED ? count : MAX_LISTED;
    size_t shown = 0;
    for (size_t i = 0; i < listed; ++i) {
        if (name == NULL || strcmp(entries[i].name, name) == 0) {
            print_grid(&entries[i]);
            ++shown;
        }
    }
    if (name != NULL && shown == 0) {
        say_names(path, name, entries, listed);
        free(entries);
        return CLI_USAGE;
    }
    if (count == 0) {
        printf("problem: no grids\n");
    }
    if (count > MAX_LISTED && name == NULL) {
        printf("… and %zu more grids\n", count - MAX_LISTED);
    }
    free(entries);
    return CLI_OK;
}
