/* Grids of .vdb files: by name, over the voxels that are active in both. */
#include "cli/message.h"
#include "comparison_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_GRIDS = 4096, MOST_TEXTS = 64 };

static const double SAME_PLACE = 1e-3; /* voxels: two lattices that differ by less are one */

typedef struct listing {
    vsh_vdb_entry *entries;
    size_t count;
} listing;

static vsh_vdb_entry *find_grid(const listing *list, const char *name) {
    for (size_t i = 0; i < list->count; ++i) {
        if (strcmp(list->entries[i].name, name) == 0) {
            return &list->entries[i];
        }
    }
    return NULL;
}

static int list_grids(const compare_work *work, const char *path, listing *list) {
    list->entries = calloc(MAX_GRIDS, sizeof *list->entries);
    if (list->entries == NULL) {
        return cli_out_of_memory(path);
    }
    vsh_error error;
    if (vsh_vdb_list(path, &work->run, list->entries, MAX_GRIDS, &list->count, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    if (list->count > MAX_GRIDS) {
        return cli_usage("%s: %zu grids; up to %d are compared", path, list->count, MAX_GRIDS);
    }
    return CLI_OK;
}

static int no_memory(const compare_work *work) {
    return cli_out_of_memory(work->comparison->golden);
}

/* World positions of the middles of voxels (0, 0, 0), and one along each axis. */
static int read_lattice(const compare_work *work, const char *path, const char *name, double places[4][3]) {
    vsh_voxels *voxels = NULL;
    vsh_error error;
    if (vsh_voxels_from_vdb(path, name, &work->run, &voxels, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    for (int i = 0; i < 4; ++i) {
        const int32_t index[3] = {i == 1, i == 2, i == 3};
        vsh_voxels_centre(voxels, index, places[i]);
    }
    vsh_voxels_free(voxels);
    return CLI_OK;
}

/* Whether the voxels of the two stand at the same places. */
static int compare_lattices(const compare_work *work, const char *name, bool *same) {
    double golden[4][3], fresh[4][3];
    int code = read_lattice(work, work->comparison->golden, name, golden);
    code = code == CLI_OK ? read_lattice(work, work->comparison->fresh, name, fresh) : code;
    if (code != CLI_OK) {
        return code;
    }
    double largest = 0.0, voxel = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = golden[1][axis] - golden[0][axis];
        voxel += side * side;
        for (int i = 0; i < 4; ++i) {
            largest = fmax(largest, fabs(golden[i][axis] - fresh[i][axis]));
        }
    }
    *same = largest <= SAME_PLACE * sqrt(voxel);
    return CLI_OK;
}

/* What the two grids say of themselves; *comparable tells whether their values can be compared. */
static int compare_kinds(const compare_work *work, const vsh_vdb_entry *golden, const vsh_vdb_entry *fresh,
                         bool *comparable) {
    cli_comparison *c = work->comparison;
    bool same = true, told = true;
    *comparable = false;
    if (golden->active_voxels == 0 && fresh->active_voxels == 0) {
        told =
            cli_comparison_add_problem(c, "grid '%s': no active voxels: nothing is compared", golden->name);
        return told ? CLI_OK : no_memory(work);
    }
    if (golden->active_voxels == 0 || fresh->active_voxels == 0) {
        told = cli_comparison_add_problem(c, "grid '%s': no active voxels in %s", golden->name,
                                          golden->active_voxels == 0 ? "golden" : "the new file");
        return told ? CLI_OK : no_memory(work);
    }
    if (strcmp(golden->grid_class, fresh->grid_class) != 0) {
        told = cli_comparison_add_problem(c, "grid '%s': golden is a '%s', new is a '%s'", golden->name,
                                          golden->grid_class, fresh->grid_class);
        return told ? CLI_OK : no_memory(work);
    }
    const int code = compare_lattices(work, golden->name, &same);
    if (code == CLI_OK && !same) {
        told = cli_comparison_add_problem(
            c,
            "grid '%s': other voxels: golden's are %g × %g × %g, new ones %g × %g × %g, or stand elsewhere",
            golden->name, golden->voxel_size[0], golden->voxel_size[1], golden->voxel_size[2],
            fresh->voxel_size[0], fresh->voxel_size[1], fresh->voxel_size[2]);
    }
    *comparable = code == CLI_OK && same;
    return told ? code : no_memory(work);
}

/* --- values */

typedef struct dense {
    float *values[2], *active[2];
    uint8_t *mask;
} dense;

static void free_dense(dense *d) {
    for (int which = 0; which < 2; ++which) {
        free(d->values[which]);
        free(d->active[which]);
    }
    free(d->mask);
}

static int copy_both(const compare_work *work, const cli_channel *channel, size_t count, dense *d) {
    const char *const paths[2] = {work->comparison->golden, work->comparison->fresh};
    for (int which = 0; which < 2; ++which) {
        d->values[which] = malloc(count * sizeof(float));
        d->active[which] = malloc(count * sizeof(float));
        if (d->values[which] == NULL || d->active[which] == NULL) {
            return no_memory(work);
        }
        vsh_error error;
        if (vsh_vdb_copy(paths[which], channel->name, channel->origin, channel->size, &work->run,
                         d->values[which], d->active[which], &error) != VSH_OK) {
            return cli_fail(&error);
        }
    }
    d->mask = malloc(count);
    return d->mask != NULL ? CLI_OK : no_memory(work);
}

/* The box that holds the active voxels of both. */
static int set_box(const compare_work *work, const vsh_vdb_entry *golden, const vsh_vdb_entry *fresh,
                   cli_channel *channel, size_t *count) {
    double voxels = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        const int32_t low = golden->index_min[axis] < fresh->index_min[axis] ? golden->index_min[axis]
                                                                             : fresh->index_min[axis];
        const int32_t high = golden->index_max[axis] > fresh->index_max[axis] ? golden->index_max[axis]
                                                                              : fresh->index_max[axis];
        channel->origin[axis] = low;
        const double side = (double)high - (double)low + 1.0;
        channel->size[axis] = side < (double)INT32_MAX ? (int32_t)side : INT32_MAX;
        voxels *= side;
    }
    const double bytes = voxels * 50.0; /* two copies, and what comparing them takes */
    if (voxels > (double)INT32_MAX ||
        (work->run.memory_limit > 0 && bytes > (double)work->run.memory_limit)) {
        cli_say(
            "%s: grid '%s': a box of %d × %d × %d voxels holds both: comparing takes about %.0f MB, over the "
            "memory limit of %.0f MB",
            work->comparison->golden, channel->name, channel->size[0], channel->size[1], channel->size[2],
            bytes / 1e6, (double)work->run.memory_limit / 1e6);
        return CLI_LIMIT;
    }
    *count = (size_t)voxels;
    return CLI_OK;
}

/* Distances are measured by the half width of the band, as other values by 1. */
static void scale_distances(const vsh_vdb_entry *golden, dense *d, size_t count) {
    if (strcmp(golden->grid_class, "level set") != 0 || !(fabs(golden->background) > 0.0)) {
        return;
    }
    const double scale = 1.0 / fabs(golden->background);
    for (int which = 0; which < 2; ++which) {
        for (size_t i = 0; i < count; ++i) {
            d->values[which][i] = (float)(scale * (double)d->values[which][i]);
        }
    }
}

/* Takes lines "NAME: VALUE" apart, where they stand. */
static compare_texts take_apart(char *lines, vsh_attribute list[MOST_TEXTS]) {
    compare_texts texts = {list, 0};
    for (char *line = strtok(lines, "\n"); line != NULL && texts.count < MOST_TEXTS;
         line = strtok(NULL, "\n")) {
        char *colon = strstr(line, ": ");
        if (colon != NULL) {
            *colon = '\0';
            list[texts.count++] = (vsh_attribute){line, colon + 2};
        }
    }
    return texts;
}

static int compare_values(const compare_work *work, vsh_vdb_entry *golden, vsh_vdb_entry *fresh) {
    cli_channel *channel = cli_comparison_add(work->comparison, golden->name);
    if (channel == NULL) {
        return no_memory(work);
    }
    vsh_attribute lists[2][MOST_TEXTS];
    const compare_texts texts[2] = {take_apart(golden->attributes, lists[0]),
                                    take_apart(fresh->attributes, lists[1])};
    cli_channel_set_limits(work, texts, channel);
    size_t count = 0;
    dense d = {{NULL, NULL}, {NULL, NULL}, NULL};
    int code = set_box(work, golden, fresh, channel, &count);
    code = code == CLI_OK ? copy_both(work, channel, count, &d) : code;
    if (code == CLI_OK) {
        scale_distances(golden, &d, count);
        vsh_compare_coverage(count, d.active[0], d.active[1], d.mask, &channel->coverage);
        channel->coverage_failed = channel->coverage.share > channel->coverage_limit;
        const vsh_compared compared = {{channel->size[0], channel->size[1], channel->size[2]},
                                       d.values[0],
                                       d.values[1],
                                       work->settings->padding ? NULL : d.mask};
        code = cli_channel_measure(work, channel, &compared);
    }
    free_dense(&d);
    return code;
}

int compare_grids(const compare_work *work) {
    cli_comparison *c = work->comparison;
    listing lists[2] = {{NULL, 0}, {NULL, 0}};
    int code = list_grids(work, c->golden, &lists[0]);
    code = code == CLI_OK ? list_grids(work, c->fresh, &lists[1]) : code;
    for (int which = 0; which < 2; ++which) {
        for (size_t i = 0; i < lists[which].count && code == CLI_OK; ++i) {
            const char *name = lists[which].entries[i].name;
            if (find_grid(&lists[1 - which], name) == NULL &&
                !cli_comparison_add_problem(c, "grid '%s': in %s alone", name,
                                            which == 0 ? "golden" : "the new file")) {
                code = no_memory(work);
            }
        }
    }
    for (size_t i = 0; i < lists[0].count && code == CLI_OK; ++i) {
        vsh_vdb_entry *golden = &lists[0].entries[i], *fresh = find_grid(&lists[1], golden->name);
        bool comparable = false;
        code = fresh != NULL ? compare_kinds(work, golden, fresh, &comparable) : code;
        code = code == CLI_OK && comparable ? compare_values(work, golden, fresh) : code;
    }
    if (code == CLI_OK && lists[0].count == 0 && !cli_comparison_add_problem(c, "golden holds no grids")) {
        code = no_memory(work);
    }
    free(lists[0].entries);
    free(lists[1].entries);
    return code;
}
