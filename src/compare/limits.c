/* The table of measures with their limits, the verdict, and files of limits, which are JSON. */
#include "base/floats.h"
#include "base/job.h"
#include "compare/compare.h"
#include "json/json.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_REACH = 16, MOST_BYTES = 64 << 20 };

static const double MOST = 1e15; /* this limit, and larger ones, switch a measure off */

static const double default_limits[VSH_MEASURE_COUNT] = {
    [VSH_MEASURE_SHIFT] = 0.1,  [VSH_MEASURE_PENUMBRA] = 0.03, [VSH_MEASURE_LOST] = 3.0,
    [VSH_MEASURE_GAINED] = 3.0, [VSH_MEASURE_RMSE] = 0.004,    [VSH_MEASURE_P99] = 0.02,
    [VSH_MEASURE_MAX] = 0.25,
};

vsh_limits vsh_limits_default(void) {
    vsh_limits known = {.struct_size = sizeof known, .options = vsh_compare_options_default()};
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        known.value[i] = default_limits[i];
    }
    return known;
}

/* The noise is independent of the differences that the limits pass, so squares of errors add. The largest of
 * a million normal values is 5 standard errors away. The mean of the 16 edges or more that a penumbra needs
 * moves by a quarter of one edge's change. */
void vsh_limits_allow_noise(vsh_limits *limits, double noise) {
    VSHI_FLOATS;
    double *limit = limits->value;
    limits->options.noise = noise;
    limit[VSH_MEASURE_RMSE] = sqrt(limit[VSH_MEASURE_RMSE] * limit[VSH_MEASURE_RMSE] + noise * noise);
    limit[VSH_MEASURE_MAX] += 5.0 * noise;
    limit[VSH_MEASURE_P99] += VSHI_NOISE_P99 * noise;
    limit[VSH_MEASURE_PENUMBRA] += 0.25 * VSHI_NOISE_WIDTH * noise;
}

uint32_t vsh_compare_judge(const vsh_measures *measures, const vsh_limits *limits) {
    VSHI_FLOATS;
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

/* --- files */

/* Limits of all channels, or of those that match. */
typedef struct entry {
    vsh_compare_files_options given;
    const char *channel; /* a name, or a prefix and '*' */
} entry;

struct vsh_tolerances {
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
    {.name = "reach", .kind = VSHI_INTEGER, AT(reach), .highest = MOST_REACH},
    {.name = "coverage", .kind = VSHI_NUMBER, .variants = OF_FILE, AT(coverage_limit), .highest = 1.0},
    {.name = "channels", .kind = VSHI_CUSTOM, .variants = OF_FILE, .read = read_channels},
};
static const vshi_table key_table = VSHI_TABLE(keys);
_Static_assert(offsetof(vsh_tolerances, all) == 0, "offsets of keys are those in an entry");

static vsh_result read_channels(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_tolerances *made = member;
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
    ((vsh_tolerances *)made)->all.given = vsh_compare_files_options_default();
    return vshi_read_object(reader, root, &key_table, OF_FILE, "tolerances", made);
}

vsh_result vsh_tolerances_read(const char *path, vsh_tolerances **tolerances, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(tolerances);
    *tolerances = NULL;
    VSHI_NEEDS(path);
    vsh_run run = vsh_run_default();
    run.memory_limit = MOST_BYTES;
    vshi_json reader = {.path = path, .run = &run, .error = error};
    void *made;
    VSHI_TRY(vshi_json_read(&reader, sizeof **tolerances, read_tolerances, &made));
    *tolerances = made;
    return VSH_OK;
}

void vsh_tolerances_free(vsh_tolerances *tolerances) {
    vshi_json_free(tolerances);
}

void vshi_apply_options(const vsh_compare_files_options *given, vsh_limits *limits, double *coverage) {
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

void vsh_tolerances_apply(const vsh_tolerances *tolerances, const char *channel, vsh_limits *limits,
                          double *coverage) {
    if (tolerances == NULL) {
        return;
    }
    vshi_apply_options(&tolerances->all.given, limits, coverage);
    for (size_t i = 0; i < tolerances->channel_count; ++i) {
        if (is_for(&tolerances->channels[i], channel)) {
            vshi_apply_options(&tolerances->channels[i].given, limits, NULL);
        }
    }
}
