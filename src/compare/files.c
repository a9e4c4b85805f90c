/* Compares two files, images channel by channel or .vdb files grid by grid, over what both cover. Limits: the
 * table of measures, the verdict, and files of tolerances (JSON). */
#include "base/file.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "compare/compare.h"
#include "io/json.h"
#include "levelset/access.h"
#include "scene/scene.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>
#include <vdbshade/scene.h>
#include <vdbshade/volume.h>

enum { MAX_GRIDS = 4096, MOST_TEXTS = 64, MOST_TOLERANCE_BYTES = 64 << 20 };

/* --- limits */

static const double MOST = 1e15; /* this limit, and larger ones, switch a measure off */

vsh_limits vshi_limits_default(void) {
    return (vsh_limits){.struct_size = sizeof(vsh_limits),
                        .options = vsh_compare_options_default(),
                        .value = {[VSH_MEASURE_SHIFT] = 0.1,
                                  [VSH_MEASURE_PENUMBRA] = 0.03,
                                  [VSH_MEASURE_LOST] = 3.0,
                                  [VSH_MEASURE_GAINED] = 3.0,
                                  [VSH_MEASURE_RMSE] = 0.004,
                                  [VSH_MEASURE_P99] = 0.02,
                                  [VSH_MEASURE_MAX] = 0.25}};
}

/* The noise is independent of the differences that the limits pass, so squares of errors add. The largest of
 * a million normal values is 5 standard errors away. The mean of the 16 edges or more that a penumbra needs
 * moves by a quarter of one edge's change. */
void vshi_limits_allow_noise(vsh_limits *limits, double noise) {
    double *limit = limits->value;
    limits->options.noise = noise;
    limit[VSH_MEASURE_RMSE] = sqrt(limit[VSH_MEASURE_RMSE] * limit[VSH_MEASURE_RMSE] + noise * noise);
    limit[VSH_MEASURE_MAX] += 5.0 * noise;
    limit[VSH_MEASURE_P99] += VSHI_NOISE_P99 * noise;
    limit[VSH_MEASURE_PENUMBRA] += 0.25 * VSHI_NOISE_WIDTH * noise;
}

uint32_t vshi_compare_judge(const vsh_measures *measures, const vsh_limits *limits) {
    if (measures->count == 0) {
        return (UINT32_C(1) << VSH_MEASURE_COUNT) - 1;
    }
    uint32_t failed = measures->nonfinite[0] + measures->nonfinite[1] > 0 ? 1 << VSH_MEASURE_NONFINITE : 0;
    for (int i = VSH_MEASURE_NONFINITE + 1; i < VSH_MEASURE_COUNT; ++i) {
        if (!isnan(measures->value[i]) && !(measures->value[i] <= limits->value[i])) {
            failed |= UINT32_C(1) << i;
        }
    }
    return failed;
}

/* --- files of limits */

/* Limits of all channels, or of those that match. */
typedef struct entry {
    vsh_compare_files_options given;
    const char *channel; /* a name, or a prefix and '*' */
} entry;

struct vshi_tolerances {
    entry all;
    entry *channels; /* in the file's order */
    size_t channel_count;
};

enum { OF_CHANNEL = 1, OF_FILE = 2 };

static vsh_result read_channels(vshi_json *reader, const vshi_value *value, void *member);

#define AT(member) .offset = offsetof(entry, given.member)
#define LIMIT(key, measure)                                                                                  \
    { .name = key, .kind = VSHI_NUMBER, AT(limits[measure]), .highest = 1e15 }

static const vshi_key keys[] = {
    LIMIT("shift", VSH_MEASURE_SHIFT),
    LIMIT("penumbra", VSH_MEASURE_PENUMBRA),
    LIMIT("lost", VSH_MEASURE_LOST),
    LIMIT("gained", VSH_MEASURE_GAINED),
    LIMIT("rmse", VSH_MEASURE_RMSE),
    LIMIT("p99", VSH_MEASURE_P99),
    LIMIT("max", VSH_MEASURE_MAX),
    {.name = "step", .kind = VSHI_NUMBER, AT(step), .highest = 1.0, .flags = VSHI_ABOVE},
    {.name = "reach", .kind = VSHI_INTEGER, AT(reach), .highest = VSHI_MOST_REACH},
    {.name = "coverage", .kind = VSHI_NUMBER, .variants = OF_FILE, AT(coverage_limit), .highest = 1.0},
    {.name = "channels", .kind = VSHI_CUSTOM, .variants = OF_FILE, .read = read_channels},
};
static const vshi_table key_table = VSHI_TABLE(keys);
_Static_assert(offsetof(vshi_tolerances, all) == 0, "offsets of keys are those in an entry");

static vsh_result read_channels(vshi_json *reader, const vshi_value *value, void *member) {
    vshi_tolerances *made = member;
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    VSHI_TRY(vshi_json_allocate(reader, (void **)&made->channels, json_object_size(value->json),
                                sizeof(entry), "channels"));
    vshi_value item = {.json = NULL};
    while (vshi_next_member(value, &item)) {
        entry *e = &made->channels[made->channel_count];
        const char *name;
        VSHI_TRY(vshi_json_copy(reader, 0, item.key, &name));
        *e = (entry){vsh_compare_files_options_default(), name};
        VSHI_TRY(vshi_read_object(reader, &item, &key_table, OF_CHANNEL, "a channel's tolerances", e));
        ++made->channel_count;
    }
    return VSH_OK;
}

static vsh_result read_tolerances(vshi_json *reader, const vshi_value *root, void *made) {
    ((vshi_tolerances *)made)->all.given = vsh_compare_files_options_default();
    return vshi_read_object(reader, root, &key_table, OF_FILE, "tolerances", made);
}

vsh_result vshi_tolerances_read(const char *path, vshi_tolerances **tolerances, vsh_error *error) {
    vsh_run run = vsh_run_default();
    run.memory_limit = MOST_TOLERANCE_BYTES;
    vshi_json reader = {.path = path, .run = &run, .error = error};
    return vshi_json_read(&reader, sizeof **tolerances, read_tolerances, (void **)tolerances);
}

void vshi_tolerances_free(vshi_tolerances *tolerances) {
    vshi_json_free(tolerances);
}

/* Overwrites limits, and *coverage (may be NULL), with the given ones. */
static void apply_options(const vsh_compare_files_options *given, vsh_limits *limits, double *coverage) {
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        if (!isnan(given->limits[i])) {
            limits->value[i] = given->limits[i] < MOST ? given->limits[i] : INFINITY;
        }
    }
    limits->options.step = isnan(given->step) ? limits->options.step : given->step;
    limits->options.reach = given->reach < 0 ? limits->options.reach : given->reach;
    if (coverage != NULL && !isnan(given->coverage_limit)) {
        *coverage = given->coverage_limit;
    }
}

static bool is_for(const entry *e, const char *channel) {
    const size_t length = strlen(e->channel);
    return length > 0 && e->channel[length - 1] == '*' ? strncmp(e->channel, channel, length - 1) == 0
                                                       : strcmp(e->channel, channel) == 0;
}

void vshi_tolerances_apply(const vshi_tolerances *tolerances, const char *channel, vsh_limits *limits,
                           double *coverage) {
    if (tolerances == NULL) {
        return;
    }
    apply_options(&tolerances->all.given, limits, coverage);
    for (size_t i = 0; i < tolerances->channel_count; ++i) {
        if (is_for(&tolerances->channels[i], channel)) {
            apply_options(&tolerances->channels[i].given, limits, NULL);
        }
    }
}

/* --- two files */

static const double COVERAGE_LIMIT = 0.001;
static const double SAME_PLACE = 1e-3; /* voxels that two lattices may be apart */

struct vsh_comparison {
    vsh_channel_comparison *channels;
    size_t channel_count, channel_capacity;
    char (*problems)[320]; /* other sizes, channels, voxels, formats */
    size_t problem_count, problem_capacity;
};

typedef struct files {
    const char *path[2]; /* golden, new */
    vsh_compare_files_options options;
    vsh_run run;
    vshi_tolerances *tolerances; /* may be NULL */
    vsh_comparison *comparison;
} files;

/* Attributes of a file. */
typedef struct attributes {
    const vsh_attribute *list;
    size_t count;
} attributes;

static vsh_result __attribute__((format(printf, 3, 4)))
add_problem(const files *f, vsh_error *error, const char *format, ...) {
    vsh_comparison *c = f->comparison;
    VSHI_TRY(vshi_make_room((void **)&c->problems, c->problem_count, &c->problem_capacity,
                            sizeof *c->problems, f->path[0], error));
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(c->problems[c->problem_count++], sizeof *c->problems, format, arguments);
    va_end(arguments);
    return VSH_OK;
}

/* --- one channel */

/* Finds the attribute with a channel's method, error, sampler and frame. */
static const char *find_method(const attributes *texts, const char *channel) {
    char name[VSH_CHANNEL_NAME + 16];
    snprintf(name, sizeof name, "vdbshade_%.*s", (int)strcspn(channel, "."), channel);
    for (size_t i = 0; i < texts->count; ++i) {
        if (strcmp(texts->list[i].name, name) == 0) {
            return texts->list[i].value;
        }
    }
    return "";
}

static void set_limits(const files *f, const attributes texts[2], vsh_channel_comparison *channel) {
    const vsh_compare_files_options *o = &f->options;
    channel->limits = vshi_limits_default();
    for (int which = 0; which < 2; ++which) {
        channel->max_error[which] =
            vshi_provenance_max_error(texts[which].list, texts[which].count, channel->name);
    }
    /* bakes made in the same way cast the same rays, so there is no noise between them */
    const double *e = channel->max_error;
    const bool noisy =
        !isnan(e[0]) && !isnan(e[1]) &&
        strcmp(find_method(&texts[0], channel->name), find_method(&texts[1], channel->name)) != 0;
    vshi_limits_allow_noise(&channel->limits, !isnan(o->noise) ? o->noise
                                              : noisy          ? sqrt(e[0] * e[0] + e[1] * e[1])
                                                               : 0.0);
    channel->coverage_limit = COVERAGE_LIMIT;
    vshi_tolerances_apply(f->tolerances, channel->name, &channel->limits, &channel->coverage_limit);
    apply_options(o, &channel->limits, &channel->coverage_limit);
}

static vsh_result add_channel(const files *f, const char *name, const attributes texts[2],
                              vsh_channel_comparison **channel, vsh_error *error) {
    vsh_comparison *c = f->comparison;
    VSHI_TRY(vshi_make_room((void **)&c->channels, c->channel_count, &c->channel_capacity,
                            sizeof *c->channels, f->path[0], error));
    *channel = &c->channels[c->channel_count++];
    memset(*channel, 0, sizeof **channel);
    snprintf((*channel)->name, sizeof(*channel)->name, "%s", name);
    set_limits(f, texts, *channel);
    return VSH_OK;
}

static void set_coverage(vsh_channel_comparison *channel, const vsh_coverage *coverage) {
    channel->coverage = *coverage;
    channel->coverage_failed = coverage->share > channel->coverage_limit;
}

/* Measures and judges a channel. The run's memory_held already counts its values. */
static vsh_result measure(const files *f, vsh_channel_comparison *channel, const vsh_compared *compared,
                          vsh_error *error) {
    vsh_run run = f->run;
    const uint64_t given = 2 * sizeof(float) * (uint64_t)compared->size[0] * (uint64_t)compared->size[1] *
                           (uint64_t)compared->size[2];
    run.memory_held -= run.memory_held < given ? run.memory_held : given;
    VSHI_TRY(vsh_compare(compared, &channel->limits.options, &run, &channel->measures, error));
    channel->failed = vshi_compare_judge(&channel->measures, &channel->limits);
    if (f->options.look != NULL &&
        f->options.look(f->options.user, f->comparison->channel_count - 1, channel, compared) != 0) {
        return vshi_fail(error, VSH_ERROR_CANCELLED, "%s: comparing was stopped", f->path[1]);
    }
    return VSH_OK;
}

/* --- images */

typedef struct images {
    vsh_image_file *file[2]; /* golden, new */
    vsh_image image[2];
    attributes texts[2];
    bool picture[2]; /* R, G and B only show other channels of the file */
    uint8_t *mask;   /* texels to compare */
} images;

static bool is_compared(const images *both, int which, const char *name) {
    return !both->picture[which] || strlen(name) != 1 || strchr("RGB", name[0]) == NULL;
}

static const float *find_plane(const images *both, int which, const char *name) {
    const vsh_image *image = &both->image[which];
    for (int32_t i = 0; i < image->channel_count && is_compared(both, which, name); ++i) {
        if (strcmp(image->names[i], name) == 0) {
            return image->planes[i];
        }
    }
    return NULL;
}

static vsh_result read_both(files *f, images *both, vsh_error *error) {
    for (int which = 0; which < 2; ++which) {
        VSHI_TRY(vsh_image_read(f->path[which], &f->run, &both->file[which], error));
        const vsh_image image = both->image[which] = vsh_image_view(both->file[which]);
        f->run.memory_held +=
            sizeof(float) * (uint64_t)image.width * (uint64_t)image.height * (uint64_t)image.channel_count;
        attributes *texts = &both->texts[which];
        texts->list = vsh_image_attributes(both->file[which], &texts->count);
        bool shown = false, others = false;
        for (size_t i = 0; i < texts->count; ++i) {
            shown = shown || strcmp(texts->list[i].name, VSH_IMAGE_RGB) == 0;
        }
        for (int32_t c = 0; c < image.channel_count; ++c) {
            others = others || strlen(image.names[c]) != 1;
        }
        both->picture[which] = shown && others;
    }
    return VSH_OK;
}

static vsh_result compare_names(const files *f, const images *both, vsh_error *error) {
    for (int which = 0; which < 2; ++which) {
        for (int32_t i = 0; i < both->image[which].channel_count; ++i) {
            const char *name = both->image[which].names[i];
            if (is_compared(both, which, name) && find_plane(both, 1 - which, name) == NULL) {
                VSHI_TRY(add_problem(f, error, "channel '%s': in %s alone", name,
                                     which == 0 ? "golden" : "the new image"));
            }
        }
    }
    return VSH_OK;
}

/* Makes the mask. Coverage is a channel of the results if one of the files has it. */
static vsh_result compare_coverage(const files *f, images *both, vsh_error *error) {
    const int32_t width = both->image[0].width, height = both->image[0].height;
    const size_t count = (size_t)width * (size_t)height;
    VSHI_TRY(vshi_allocate((void **)&both->mask, count, 1, f->path[0], error));
    const float *golden = find_plane(both, 0, f->options.coverage);
    const float *fresh = find_plane(both, 1, f->options.coverage);
    vsh_coverage coverage;
    vshi_compare_coverage(count, golden, fresh, both->mask, &coverage);
    if (f->options.padding) {
        memset(both->mask, 1, count);
    }
    if (golden == NULL && fresh == NULL) {
        return VSH_OK;
    }
    vsh_channel_comparison *channel;
    VSHI_TRY(add_channel(f, f->options.coverage, both->texts, &channel, error));
    memcpy(channel->size, (const int32_t[]){width, height, 1}, sizeof channel->size);
    channel->is_coverage = 1;
    set_coverage(channel, &coverage);
    return VSH_OK;
}

static vsh_result compare_channels(const files *f, const images *both, vsh_error *error) {
    const vsh_image *golden = &both->image[0];
    for (int32_t i = 0; i < golden->channel_count; ++i) {
        const char *name = golden->names[i];
        const float *values = is_compared(both, 0, name) ? find_plane(both, 1, name) : NULL;
        if (values == NULL || strcmp(name, f->options.coverage) == 0) {
            continue;
        }
        vsh_channel_comparison *channel;
        VSHI_TRY(add_channel(f, name, both->texts, &channel, error));
        const vsh_compared compared = {
            {golden->width, golden->height, 1}, golden->planes[i], values, both->mask};
        memcpy(channel->size, compared.size, sizeof channel->size);
        VSHI_TRY(measure(f, channel, &compared, error));
    }
    return VSH_OK;
}

static vsh_result compare_images(files *f, vsh_error *error) {
    images both = {.mask = NULL};
    vsh_result result;
    VSHI_TRY_DONE(read_both(f, &both, error));
    VSHI_TRY_DONE(compare_names(f, &both, error));
    const vsh_image *golden = &both.image[0], *fresh = &both.image[1];
    if (golden->width != fresh->width || golden->height != fresh->height) {
        result = add_problem(f, error, "size: golden is %d × %d, new is %d × %d", golden->width,
                             golden->height, fresh->width, fresh->height);
        goto done;
    }
    VSHI_TRY_DONE(compare_coverage(f, &both, error));
    VSHI_TRY_DONE(compare_channels(f, &both, error));
done:
    free(both.mask);
    vsh_image_free(both.file[0]);
    vsh_image_free(both.file[1]);
    return result;
}

/* --- grids */

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

static vsh_result list_grids(const files *f, const char *path, listing *list, vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)&list->entries, MAX_GRIDS, sizeof *list->entries, path, error));
    VSHI_TRY(vsh_vdb_list(path, &f->run, list->entries, MAX_GRIDS, &list->count, error));
    return list->count <= MAX_GRIDS
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "%s: %zu grids; up to %d are compared", path, list->count,
                           MAX_GRIDS);
}

/* Finds the world positions of voxel (0, 0, 0) and of its neighbour along each axis. */
static vsh_result read_lattice(const files *f, const char *path, const char *name, double places[4][3],
                               vsh_error *error) {
    vsh_voxels *voxels = NULL;
    VSHI_TRY(vsh_voxels_from_vdb(path, name, &f->run, &voxels, error));
    for (int i = 0; i < 4; ++i) {
        vshi_voxels_centre(voxels, (const int32_t[3]){i == 1, i == 2, i == 3}, places[i]);
    }
    vsh_voxels_free(voxels);
    return VSH_OK;
}

/* Compares where the voxels of both lie. */
static vsh_result compare_lattices(const files *f, const char *name, bool *same, vsh_error *error) {
    double golden[4][3], fresh[4][3], largest = 0.0, voxel = 0.0;
    VSHI_TRY(read_lattice(f, f->path[0], name, golden, error));
    VSHI_TRY(read_lattice(f, f->path[1], name, fresh, error));
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

/* Finds out whether the values of two grids can be compared. */
static vsh_result compare_kinds(const files *f, const vsh_vdb_entry *golden, const vsh_vdb_entry *fresh,
                                bool *comparable, vsh_error *error) {
    *comparable = false;
    if (golden->active_voxels == 0 && fresh->active_voxels == 0) {
        return add_problem(f, error, "grid '%s': no active voxels: nothing is compared", golden->name);
    }
    if (golden->active_voxels == 0 || fresh->active_voxels == 0) {
        return add_problem(f, error, "grid '%s': no active voxels in %s", golden->name,
                           golden->active_voxels == 0 ? "golden" : "the new file");
    }
    if (strcmp(golden->grid_class, fresh->grid_class) != 0) {
        return add_problem(f, error, "grid '%s': golden is a '%s', new is a '%s'", golden->name,
                           golden->grid_class, fresh->grid_class);
    }
    VSHI_TRY(compare_lattices(f, golden->name, comparable, error));
    if (!*comparable) {
        return add_problem(
            f, error,
            "grid '%s': other voxels: golden's are %g × %g × %g, new ones %g × %g × %g, or placed elsewhere",
            golden->name, golden->voxel_size[0], golden->voxel_size[1], golden->voxel_size[2],
            fresh->voxel_size[0], fresh->voxel_size[1], fresh->voxel_size[2]);
    }
    return VSH_OK;
}

/* Finds the box around the active voxels of both. */
static vsh_result set_box(const files *f, const vsh_vdb_entry *golden, const vsh_vdb_entry *fresh,
                          vsh_channel_comparison *channel, size_t *count, vsh_error *error) {
    double voxels = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = fmin(golden->index_min[axis], fresh->index_min[axis]);
        const double high = fmax(golden->index_max[axis], fresh->index_max[axis]);
        channel->origin[axis] = (int32_t)low;
        const double side = high - low + 1.0;
        channel->size[axis] = side < (double)INT32_MAX ? (int32_t)side : INT32_MAX;
        voxels *= side;
    }
    const double bytes =
        voxels * 26.0; /* two copies with active states, a mask, and those of vsh_compare() */
    if (voxels > (double)INT32_MAX || (f->run.memory_limit > 0 && bytes > (double)f->run.memory_limit)) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: grid '%s': a box of %d × %d × %d voxels holds both: comparing takes about %.0f "
                         "MB, over the memory limit of %.0f MB",
                         f->path[0], channel->name, channel->size[0], channel->size[1], channel->size[2],
                         bytes / 1e6, (double)f->run.memory_limit / 1e6);
    }
    *count = (size_t)voxels;
    return VSH_OK;
}

/* Scales distances to half widths of the band. */
static void scale_distances(const vsh_vdb_entry *golden, float *values, size_t count) {
    if (strcmp(golden->grid_class, "level set") != 0 || !(fabs(golden->background) > 0.0)) {
        return;
    }
    const double scale = 1.0 / fabs(golden->background);
    for (size_t i = 0; i < count; ++i) {
        values[i] = (float)(scale * (double)values[i]);
    }
}

/* Splits lines "NAME: VALUE" in place. */
static attributes split_lines(char *lines, vsh_attribute list[MOST_TEXTS]) {
    attributes texts = {list, 0};
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

static vsh_result compare_values(const files *f, vsh_vdb_entry *golden, vsh_vdb_entry *fresh, void **memory,
                                 vsh_error *error) {
    vsh_attribute lists[2][MOST_TEXTS];
    const attributes texts[2] = {split_lines(golden->attributes, lists[0]),
                                 split_lines(fresh->attributes, lists[1])};
    vsh_channel_comparison *channel;
    size_t count = 0;
    VSHI_TRY(add_channel(f, golden->name, texts, &channel, error));
    VSHI_TRY(set_box(f, golden, fresh, channel, &count, error));
    VSHI_TRY(vshi_allocate(memory, count, 4 * sizeof(float) + 1, f->path[0], error));
    float *values = *memory, *active = values + 2 * count;
    uint8_t *mask = (uint8_t *)(active + 2 * count);
    for (int which = 0; which < 2; ++which) {
        const size_t first = which == 0 ? 0 : count;
        VSHI_TRY(vshi_vdb_copy(f->path[which], channel->name, channel->origin, channel->size, &f->run,
                               values + first, active + first, error));
    }
    scale_distances(golden, values, 2 * count);
    vsh_coverage coverage;
    vshi_compare_coverage(count, active, active + count, mask, &coverage);
    set_coverage(channel, &coverage);
    const vsh_compared compared = {{channel->size[0], channel->size[1], channel->size[2]},
                                   values,
                                   values + count,
                                   f->options.padding ? NULL : mask};
    return measure(f, channel, &compared, error);
}

static vsh_result compare_grid(const files *f, vsh_vdb_entry *golden, vsh_vdb_entry *fresh,
                               vsh_error *error) {
    bool comparable;
    VSHI_TRY(compare_kinds(f, golden, fresh, &comparable, error));
    if (!comparable) {
        return VSH_OK;
    }
    void *memory = NULL;
    const vsh_result result = compare_values(f, golden, fresh, &memory, error);
    free(memory);
    return result;
}

static vsh_result compare_lists(const files *f, listing lists[2], vsh_error *error) {
    for (int which = 0; which < 2; ++which) {
        for (size_t i = 0; i < lists[which].count; ++i) {
            const char *name = lists[which].entries[i].name;
            if (find_grid(&lists[1 - which], name) == NULL) {
                VSHI_TRY(add_problem(f, error, "grid '%s': in %s alone", name,
                                     which == 0 ? "golden" : "the new file"));
            }
        }
    }
    for (size_t i = 0; i < lists[0].count; ++i) {
        vsh_vdb_entry *golden = &lists[0].entries[i], *fresh = find_grid(&lists[1], golden->name);
        if (fresh != NULL) {
            VSHI_TRY(compare_grid(f, golden, fresh, error));
        }
    }
    return lists[0].count > 0 ? VSH_OK : add_problem(f, error, "golden holds no grids");
}

static vsh_result compare_grids(files *f, vsh_error *error) {
    listing lists[2] = {{NULL, 0}, {NULL, 0}};
    vsh_result result;
    VSHI_TRY_DONE(list_grids(f, f->path[0], &lists[0], error));
    VSHI_TRY_DONE(list_grids(f, f->path[1], &lists[1], error));
    VSHI_TRY_DONE(compare_lists(f, lists, error));
done:
    free(lists[0].entries);
    free(lists[1].entries);
    return result;
}

/* --- both files */

static vsh_result find_tolerances(files *f, vsh_error *error) {
    char path[4096];
    const char *file = f->options.tolerances;
    if (file == NULL) {
        if (snprintf(path, sizeof path, "%s.tolerance.json", f->path[0]) >= (int)sizeof path ||
            access(path, F_OK) != 0) {
            return VSH_OK;
        }
        file = path;
    }
    return vshi_tolerances_read(file, &f->tolerances, error);
}

/* Maps the endings of one format to one name. */
static const char *format_of(const char *path) {
    const char *ending = vshi_path_ending(path);
    return strcasecmp(ending, "tiff") == 0 ? "tif" : strcasecmp(ending, "jpeg") == 0 ? "jpg" : ending;
}

static vsh_result compare(files *f, vsh_error *error) {
    VSHI_TRY(find_tolerances(f, error));
    const char *was = format_of(f->path[0]), *is = format_of(f->path[1]);
    if (strcasecmp(was, is) != 0) {
        VSHI_TRY(add_problem(f, error, "format: golden is '%.100s', new is '%.100s'", was, is));
    }
    const bool grids = strcasecmp(was, "vdb") == 0;
    if (grids == (strcasecmp(is, "vdb") == 0)) {
        VSHI_TRY(grids ? compare_grids(f, error) : compare_images(f, error));
    }
    vsh_comparison *c = f->comparison;
    for (size_t i = 0; i < c->channel_count; ++i) {
        vsh_channel_comparison *channel = &c->channels[i];
        channel->alike = channel->failed == 0 && !channel->coverage_failed;
    }
    return VSH_OK;
}

vsh_result vsh_compare_files(const char *golden, const char *fresh, const vsh_compare_files_options *options,
                             const vsh_run *run, vsh_comparison **comparison, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(comparison);
    VSHI_NEEDS_BOTH(golden, fresh);
    files f = {.path = {golden, fresh}, .options = vsh_compare_files_options_default()};
    VSHI_TRY(vshi_run_resolve(run, &f.run, error));
    VSHI_TRY(vshi_options_resolve(options, &f.options, sizeof f.options, "options", error));
    VSHI_TRY(vshi_allocate((void **)&f.comparison, 1, sizeof *f.comparison, golden, error));
    const vsh_result result = compare(&f, error);
    vshi_tolerances_free(f.tolerances);
    if (result != VSH_OK) {
        vsh_comparison_free(f.comparison);
        return result;
    }
    *comparison = f.comparison;
    return VSH_OK;
}

const vsh_channel_comparison *vsh_comparison_channel(const vsh_comparison *comparison, size_t index) {
    return comparison != NULL && index < comparison->channel_count ? &comparison->channels[index] : NULL;
}

const char *vsh_comparison_problem(const vsh_comparison *comparison, size_t index) {
    return comparison != NULL && index < comparison->problem_count ? comparison->problems[index] : NULL;
}

void vsh_comparison_free(vsh_comparison *comparison) {
    if (comparison != NULL) {
        free(comparison->channels);
        free(comparison->problems);
        free(comparison);
    }
}
