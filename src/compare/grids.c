/* Grids of .vdb files: by name, over the voxels that are active in both. */
#include "base/memory.h"
#include "base/try.h"
#include "compare/files.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/voxels.h>

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

static vsh_result list_grids(const vshi_compare_work *work, const char *path, listing *list,
                             vsh_error *error) {
    void *entries;
    VSHI_TRY(vshi_allocate(&entries, MAX_GRIDS, sizeof *list->entries, path, error));
    list->entries = entries;
    VSHI_TRY(vsh_vdb_list(path, &work->run, list->entries, MAX_GRIDS, &list->count, error));
    return list->count <= MAX_GRIDS
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "%s: %zu grids; up to %d are compared", path, list->count,
                           MAX_GRIDS);
}

/* World positions of the middles of voxels (0, 0, 0), and one along each axis. */
static vsh_result read_lattice(const vshi_compare_work *work, const char *path, const char *name,
                               double places[4][3], vsh_error *error) {
    vsh_voxels *voxels = NULL;
    VSHI_TRY(vsh_voxels_from_vdb(path, name, &work->run, &voxels, error));
    for (int i = 0; i < 4; ++i) {
        const int32_t index[3] = {i == 1, i == 2, i == 3};
        vsh_voxels_centre(voxels, index, places[i]);
    }
    vsh_voxels_free(voxels);
    return VSH_OK;
}

/* Whether the voxels of the two stand at the same places. */
static vsh_result compare_lattices(const vshi_compare_work *work, const char *name, bool *same,
                                   vsh_error *error) {
    double golden[4][3], fresh[4][3];
    VSHI_TRY(read_lattice(work, work->path[0], name, golden, error));
    VSHI_TRY(read_lattice(work, work->path[1], name, fresh, error));
    double largest = 0.0, voxel = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = golden[1][axis] - golden[0][axis];
        voxel += side * side;
        for (int i = 0; i < 4; ++i) {
            largest = fmax(largest, fabs(golden[i][axis] - fresh[i][axis]));
        }
    }
    *same = largest <= SAME_PLACE * sqrt(voxel);
    return VSH_OK;
}

/* What the two grids say of themselves; *comparable tells whether their values can be compared. */
static vsh_result compare_kinds(const vshi_compare_work *work, const vsh_vdb_entry *golden,
                                const vsh_vdb_entry *fresh, bool *comparable, vsh_error *error) {
    *comparable = false;
    if (golden->active_voxels == 0 && fresh->active_voxels == 0) {
        return vshi_compare_problem(work, error, "grid '%s': no active voxels: nothing is compared",
                                    golden->name);
    }
    if (golden->active_voxels == 0 || fresh->active_voxels == 0) {
        return vshi_compare_problem(work, error, "grid '%s': no active voxels in %s", golden->name,
                                    golden->active_voxels == 0 ? "golden" : "the new file");
    }
    if (strcmp(golden->grid_class, fresh->grid_class) != 0) {
        return vshi_compare_problem(work, error, "grid '%s': golden is a '%s', new is a '%s'", golden->name,
                                    golden->grid_class, fresh->grid_class);
    }
    VSHI_TRY(compare_lattices(work, golden->name, comparable, error));
    if (!*comparable) {
        return vshi_compare_problem(
            work, error,
            "grid '%s': other voxels: golden's are %g × %g × %g, new ones %g × %g × %g, or stand elsewhere",
            golden->name, golden->voxel_size[0], golden->voxel_size[1], golden->voxel_size[2],
            fresh->voxel_size[0], fresh->voxel_size[1], fresh->voxel_size[2]);
    }
    return VSH_OK;
}

/* --- values */

typedef struct dense {
    float *values[2], *active[2];
    uint8_t *mask;
} dense;

static vsh_result copy_both(const vshi_compare_work *work, const vsh_channel_comparison *channel,
                            size_t count, dense *d, vsh_error *error) {
    void *memory;
    for (int which = 0; which < 2; ++which) {
        VSHI_TRY(vshi_allocate(&memory, count, sizeof(float), work->path[which], error));
        d->values[which] = memory;
        VSHI_TRY(vshi_allocate(&memory, count, sizeof(float), work->path[which], error));
        d->active[which] = memory;
        VSHI_TRY(vsh_vdb_copy(work->path[which], channel->name, channel->origin, channel->size, &work->run,
                              d->values[which], d->active[which], error));
    }
    VSHI_TRY(vshi_allocate(&memory, count, 1, work->path[0], error));
    d->mask = memory;
    return VSH_OK;
}

/* The box that holds the active voxels of both. */
static vsh_result set_box(const vshi_compare_work *work, const vsh_vdb_entry *golden,
                          const vsh_vdb_entry *fresh, vsh_channel_comparison *channel, size_t *count,
                          vsh_error *error) {
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
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: grid '%s': a box of %d × %d × %d voxels holds both: comparing takes about %.0f "
                         "MB, over the memory limit of %.0f MB",
                         work->path[0], channel->name, channel->size[0], channel->size[1], channel->size[2],
                         bytes / 1e6, (double)work->run.memory_limit / 1e6);
    }
    *count = (size_t)voxels;
    return VSH_OK;
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
static vshi_texts take_apart(char *lines, vsh_attribute list[MOST_TEXTS]) {
    vshi_texts texts = {list, 0};
    char *rest = NULL;
    for (char *line = strtok_r(lines, "\n", &rest); line != NULL && texts.count < MOST_TEXTS;
         line = strtok_r(NULL, "\n", &rest)) {
        char *colon = strstr(line, ": ");
        if (colon != NULL) {
            *colon = '\0';
            list[texts.count++] = (vsh_attribute){line, colon + 2};
        }
    }
    return texts;
}

static vsh_result compare_values(const vshi_compare_work *work, vsh_vdb_entry *golden, vsh_vdb_entry *fresh,
                                 dense *d, vsh_error *error) {
    vsh_attribute lists[2][MOST_TEXTS];
    const vshi_texts texts[2] = {take_apart(golden->attributes, lists[0]),
                                 take_apart(fresh->attributes, lists[1])};
    vsh_channel_comparison *channel;
    VSHI_TRY(vshi_compare_channel(work, golden->name, texts, &channel, error));
    size_t count = 0;
    VSHI_TRY(set_box(work, golden, fresh, channel, &count, error));
    VSHI_TRY(copy_both(work, channel, count, d, error));
    scale_distances(golden, d, count);
    vsh_compare_coverage(count, d->active[0], d->active[1], d->mask, &channel->coverage);
    channel->coverage_failed = channel->coverage.share > channel->coverage_limit;
    const vsh_compared compared = {{channel->size[0], channel->size[1], channel->size[2]},
                                   d->values[0],
                                   d->values[1],
                                   work->options.padding ? NULL : d->mask};
    return vshi_compare_measure(work, channel, &compared, error);
}

static vsh_result compare_grid(const vshi_compare_work *work, vsh_vdb_entry *golden, vsh_vdb_entry *fresh,
                               vsh_error *error) {
    bool comparable;
    VSHI_TRY(compare_kinds(work, golden, fresh, &comparable, error));
    if (!comparable) {
        return VSH_OK;
    }
    dense d = {.mask = NULL};
    const vsh_result result = compare_values(work, golden, fresh, &d, error);
    for (int which = 0; which < 2; ++which) {
        free(d.values[which]);
        free(d.active[which]);
    }
    free(d.mask);
    return result;
}

static vsh_result compare(const vshi_compare_work *work, listing lists[2], vsh_error *error) {
    for (int which = 0; which < 2; ++which) {
        VSHI_TRY(list_grids(work, work->path[which], &lists[which], error));
    }
    for (int which = 0; which < 2; ++which) {
        for (size_t i = 0; i < lists[which].count; ++i) {
            const char *name = lists[which].entries[i].name;
            if (find_grid(&lists[1 - which], name) == NULL) {
                VSHI_TRY(vshi_compare_problem(work, error, "grid '%s': in %s alone", name,
                                              which == 0 ? "golden" : "the new file"));
            }
        }
    }
    for (size_t i = 0; i < lists[0].count; ++i) {
        vsh_vdb_entry *golden = &lists[0].entries[i], *fresh = find_grid(&lists[1], golden->name);
        if (fresh != NULL) {
            VSHI_TRY(compare_grid(work, golden, fresh, error));
        }
    }
    return lists[0].count > 0 ? VSH_OK : vshi_compare_problem(work, error, "golden holds no grids");
}

vsh_result vshi_compare_grids(vshi_compare_work *work, vsh_error *error) {
    listing lists[2] = {{NULL, 0}, {NULL, 0}};
    const vsh_result result = compare(work, lists, error);
    free(lists[0].entries);
    free(lists[1].entries);
    return result;
}
