/* Lightmaps without seams (Iwanicki, "Lighting technology of The Last of Us", 2013). */
#include "bake/seams.h"

#include "bake/planes.h"
#include "bake/texels.h"
#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"

#include <math.h>
#include <stdlib.h>

/* What changing a texel that holds no value of its own costs, of what others cost: it is to give way first,
 * but not to run away where it is hardly read. */
static const double GUESS = 0.1;

enum { VECTORS = 5 + VSHI_SEAM_WORK }; /* low, high, keep, gradient, change */

/* Sums over an island's rows. */
typedef struct island {
    double before, after; /* squares of differences */
    double largest;       /* value */
} island;

/* A channel: one component of a plane of each page. */
typedef struct channel {
    float **values; /* [page_count]: of its first texel */
    size_t stride;
    int range;
    double *vectors; /* [VECTORS × unknown_count] */
    island *islands; /* [island_count] */
} channel;

typedef struct stitching {
    vshi_seam_system system;
    const vsh_stitch_options *options;
    const vsh_stitch_page *pages; /* [page_count] */
    size_t page_count;
    channel *channels; /* [channel_count] */
    float **values;    /* [channel_count × page_count]: theirs */
    size_t channel_count;
    size_t begin, batch; /* channels at work */
    double *vectors;     /* [batch × VECTORS × unknown_count] */
    island *islands;     /* [batch × island_count] */
    vshi_job *job;
    double square_before, square_after; /* of all channels that are done */
} stitching;

enum { LOW, HIGH, KEEP, GRADIENT, CHANGE, WORK };

static double *vector(const stitching *s, const channel *c, int which, size_t first) {
    return c->vectors + (size_t)which * s->system.unknown_count + first;
}

static float *value_of(const stitching *s, const channel *c, size_t unknown) {
    return c->values[s->system.page[unknown]] + s->system.texel[unknown] * c->stride;
}

static bool is_guess(const stitching *s, size_t unknown) {
    const float *coverage = s->pages[s->system.page[unknown]].lightmap->coverage;
    return coverage != NULL ? coverage[s->system.texel[unknown]] == 0.0f
                            : s->system.chart[unknown] == VSHI_NO_CHART;
}

/* The largest value that is read together with each unknown. */
static void find_largest(const vshi_seam_problem *p, const double *values, double *largest) {
    for (size_t u = 0; u < p->unknown_count; ++u) {
        largest[u] = 0.0;
    }
    for (size_t r = 0; r < p->row_count; ++r) {
        const uint32_t *unknown = p->rows[r].unknown;
        double most = 0.0;
        for (int k = 0; k < VSHI_SEAM_READS; ++k) {
            most = fmax(most, values[unknown[k] - p->first]);
        }
        for (int k = 0; k < VSHI_SEAM_READS; ++k) {
            largest[unknown[k] - p->first] = fmax(largest[unknown[k] - p->first], most);
        }
    }
}

/* How far an unknown may go. */
static void set_limits(const stitching *s, const channel *c, size_t unknown, double value, double largest,
                       double *low, double *high) {
    const double top = c->range == VSHI_RANGE_SHARE ? 1.0 : fmax(largest, value);
    double change = s->options->max_change * top;
    if (is_guess(s, unknown)) {
        change = top;
    }
    *low = fmin(fmax(-change, -value), 0.0);
    *high = c->range == VSHI_RANGE_SHARE ? fmax(fmin(change, 1.0 - value), 0.0) : change;
}

/* Rounded towards what it was, where rounding would pass the limit. */
static float moved(float value, double change, double low, double high) {
    float to = (float)((double)value + change);
    if ((double)to - (double)value > high || (double)to - (double)value < low) {
        to = nextafterf(to, value);
    }
    return to;
}

static double square_of(const vshi_seam_problem *p, const double *values) {
    double sum = 0.0;
    for (size_t r = 0; r < p->row_count; ++r) {
        double difference = 0.0;
        for (int k = 0; k < VSHI_SEAM_READS; ++k) {
            difference += (double)p->rows[r].weight[k] * values[p->rows[r].unknown[k] - p->first];
        }
        sum += (double)p->rows[r].share * difference * difference;
    }
    return sum;
}

/* One island in one channel. What is not finite stays, and so does all that is read with it. */
static void stitch_island(const stitching *s, const channel *c, size_t i) {
    const vshi_seam_system *system = &s->system;
    const size_t first = system->first_unknown[i], count = system->first_unknown[i + 1] - first;
    double *low = vector(s, c, LOW, first), *high = vector(s, c, HIGH, first),
           *keep = vector(s, c, KEEP, first);
    double *gradient = vector(s, c, GRADIENT, first), *values = vector(s, c, CHANGE, first);
    vshi_seam_problem p = {.rows = system->rows + system->first_row[i],
                           .row_count = system->first_row[i + 1] - system->first_row[i],
                           .unknown_count = count,
                           .first = (uint32_t)first,
                           .low = low,
                           .high = high,
                           .keep = keep,
                           .gradient = gradient,
                           .change = values,
                           .work = c->vectors + (WORK * system->unknown_count + VSHI_SEAM_WORK * first),
                           .job = s->job};
    island *sums = &c->islands[i];
    *sums = (island){0.0, 0.0, 0.0};
    bool finite = true;
    for (size_t u = 0; u < count; ++u) {
        values[u] = (double)*value_of(s, c, first + u);
        finite = finite && isfinite(values[u]);
    }
    if (!finite || p.row_count == 0) {
        return;
    }
    find_largest(&p, values, p.work);
    for (size_t u = 0; u < count; ++u) {
        sums->largest = fmax(sums->largest, values[u]);
        set_limits(s, c, first + u, values[u], p.work[u], &low[u], &high[u]);
        keep[u] = s->options->keep * (is_guess(s, first + u) ? GUESS : 1.0);
    }
    sums->before = square_of(&p, values);
    vshi_seam_gradient(&p, values, gradient);
    vshi_seam_solve(&p);
    for (size_t u = 0; u < count; ++u) {
        float *value = value_of(s, c, first + u);
        *value = moved(*value, p.change[u], low[u], high[u]);
        p.work[u] = (double)*value;
    }
    sums->after = square_of(&p, p.work);
}

static void stitch_islands(void *user, size_t begin, size_t end) {
    const stitching *s = user;
    for (size_t i = begin; i < end; ++i) {
        stitch_island(s, &s->channels[s->begin + i % s->batch], i / s->batch);
    }
}

/* In the order of the islands; of light in parts of the largest value. */
static void add_sums(stitching *s, const channel *c) {
    double before = 0.0, after = 0.0, largest = 0.0;
    for (size_t i = 0; i < s->system.island_count; ++i) {
        before += c->islands[i].before;
        after += c->islands[i].after;
        largest = fmax(largest, c->islands[i].largest);
    }
    const double scale = c->range == VSHI_RANGE_SHARE ? 1.0 : largest > 0.0 ? largest * largest : 1.0;
    s->square_before += before / scale;
    s->square_after += after / scale;
}

/* A few channels at a time, one a thread: islands are few where charts meet at their corners. */
static vsh_result stitch_channels(stitching *s, const vsh_run *run, vsh_error *error) {
    const vshi_seam_system *system = &s->system;
    const int32_t threads = vshi_job_threads(s->job);
    const size_t most = threads > 0 ? (size_t)threads : s->channel_count;
    const size_t room = s->channel_count < most ? s->channel_count : most;
    const double bytes = (double)room * ((double)system->unknown_count * VECTORS * sizeof(double) +
                                         (double)system->island_count * sizeof(island));
    VSHI_TRY(vshi_check_limit(run, system->bytes + bytes, "seams", error));
    /* one more of each, as there may be none */
    VSHI_TRY(vshi_allocate((void **)&s->vectors, room * VECTORS, (system->unknown_count + 1) * sizeof(double),
                           "seams", error));
    VSHI_TRY(vshi_allocate((void **)&s->islands, room * (system->island_count + 1), sizeof(island), "seams",
                           error));
    for (s->begin = 0; s->begin < s->channel_count; s->begin += s->batch) {
        const size_t left = s->channel_count - s->begin;
        s->batch = left < room ? left : room;
        for (size_t k = 0; k < s->batch; ++k) {
            s->channels[s->begin + k].vectors = s->vectors + k * VECTORS * system->unknown_count;
            s->channels[s->begin + k].islands = s->islands + k * system->island_count;
        }
        VSHI_TRY(vshi_parallel_for(s->job, s->batch * system->island_count, 1, 0, stitch_islands, s, error));
        for (size_t k = 0; k < s->batch; ++k) {
            add_sums(s, &s->channels[s->begin + k]);
        }
        if (vshi_job_advance(s->job, s->batch)) {
            return vshi_job_fail_cancelled(s->job, error);
        }
    }
    return VSH_OK;
}

/* Counts the channels that are stitched, or (`list`) puts page `page`'s part of them in the list. */
static size_t list_channels(const vsh_lightmap *lightmap, size_t light_count, channel *list, size_t page) {
    size_t kind_count, count = 0;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (const vshi_plane_kind *kind = kinds; kind < kinds + kind_count; ++kind) {
        const size_t planes = kind->range == VSHI_RANGE_NONE ? 0 : kind->per_light ? light_count : 1;
        const size_t components = vshi_plane_components(kind);
        for (size_t i = 0; i < planes * components; ++i) {
            float *plane = vshi_plane_of(lightmap, kind, i / components);
            if (plane != NULL && list != NULL) {
                list[count].values[page] = plane + i % components;
                list[count].stride = components;
                list[count].range = kind->range;
            }
            count += plane != NULL;
        }
    }
    return count;
}

static vsh_result make_channels(stitching *s, size_t light_count, vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)&s->channels, s->channel_count, sizeof *s->channels, "seams", error));
    VSHI_TRY(vshi_allocate((void **)&s->values, s->channel_count * s->page_count, sizeof *s->values, "seams",
                           error));
    for (size_t c = 0; c < s->channel_count; ++c) {
        s->channels[c].values = s->values + c * s->page_count;
    }
    for (size_t page = 0; page < s->page_count; ++page) {
        list_channels(s->pages[page].lightmap, light_count, s->channels, page);
    }
    return VSH_OK;
}

static vsh_result make_pages(const stitching *s, vshi_seam_pages *pages, vsh_error *error) {
    const size_t count = s->page_count;
    pages->count = count;
    VSHI_TRY(vshi_allocate((void **)&pages->charts, count, sizeof *pages->charts, "seams", error));
    VSHI_TRY(vshi_allocate((void **)&pages->first, count + 1, sizeof *pages->first, "seams", error));
    VSHI_TRY(vshi_allocate((void **)&pages->texel, count + 1, sizeof *pages->texel, "seams", error));
    for (size_t page = 0; page < count; ++page) {
        const vshi_charts *charts = &s->pages[page].charts->sorted;
        pages->charts[page] = charts;
        pages->first[page + 1] = pages->first[page] + charts->first[charts->mesh_count];
        pages->texel[page + 1] =
            pages->texel[page] + (uint64_t)charts->raster.width * (uint64_t)charts->raster.height;
    }
    return VSH_OK;
}

static vsh_result stitch(stitching *s, size_t light_count, const vsh_run *run, vsh_stitch_report *report,
                         vsh_error *error) {
    static const double RADIANS = 3.14159265358979323846 / 180.0;
    vshi_seams seams = {NULL, NULL, 0, 0.0};
    vshi_seam_pages pages = {NULL, 0, NULL, NULL};
    vshi_seam_system *system = &s->system;
    vsh_result result;
    VSHI_TRY_DONE(make_channels(s, light_count, error));
    VSHI_TRY_DONE(make_pages(s, &pages, error));
    VSHI_TRY_DONE(
        vshi_seams_find(&pages, vshi_cos(s->options->max_angle * RADIANS), run, s->job, &seams, error));
    VSHI_TRY_DONE(vshi_seam_system_make(&pages, &seams, run, s->job, system, error));
    report->seams = seams.count;
    report->places = system->row_count;
    report->crowded = system->crowded;
    report->texels = system->unknown_count;
    vshi_seams_free(&seams);
    VSHI_TRY_DONE(vshi_job_advance(s->job, 1) ? vshi_job_fail_cancelled(s->job, error) : VSH_OK);
    VSHI_TRY_DONE(stitch_channels(s, run, error));
    const double all = (double)s->channel_count * system->shares;
    report->before = all > 0.0 ? sqrt(s->square_before / all) : 0.0;
    report->after = all > 0.0 ? sqrt(s->square_after / all) : 0.0;
done:
    free(s->islands);
    free(s->vectors);
    free(s->values);
    free(s->channels);
    vshi_seam_system_free(system);
    vshi_seams_free(&seams);
    free(pages.texel);
    free(pages.first);
    free(pages.charts);
    return result;
}

static vsh_result check_option(double value, double least, double most, const char *name, vsh_error *error) {
    if (!(value >= least && value <= most)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_stitch_options.%s %g: expected %g … %g", name, value,
                         least, most);
    }
    return VSH_OK;
}

static vsh_result check_pages(stitching *s, size_t light_count, vsh_run *run, vsh_error *error) {
    for (size_t page = 0; page < s->page_count; ++page) {
        const vsh_stitch_page *given = &s->pages[page];
        VSHI_NEEDS(given->charts);
        VSHI_NEEDS(given->lightmap);
        const size_t count = list_channels(given->lightmap, light_count, NULL, page);
        if (page > 0 && count != s->channel_count) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "vsh_stitch_page %zu: %zu channels, where the first page has %zu", page, count,
                             s->channel_count);
        }
        s->channel_count = count;
        run->memory_held += given->charts->info.bytes;
    }
    return VSH_OK;
}

vsh_result vsh_lightmaps_stitch(const vsh_stitch_page *pages, size_t page_count, size_t light_count,
                                const vsh_stitch_options *options, const vsh_run *run,
                                vsh_stitch_report *report, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_OF(page_count, pages);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vsh_stitch_options own = vsh_stitch_options_default();
    VSHI_TRY(vshi_options_resolve(options, &own, sizeof own, "vsh_stitch_options", error));
    VSHI_TRY(check_option(own.max_change, 0.0, 1.0, "max_change", error));
    VSHI_TRY(check_option(own.max_angle, 0.0, 180.0, "max_angle", error));
    VSHI_TRY(check_option(own.keep, 1e-6, 1.0, "keep", error));
    stitching s = {.options = &own, .pages = pages, .page_count = page_count};
    VSHI_TRY(check_pages(&s, light_count, &full, error));
    s.job = vshi_job_begin(&full, "seams", s.channel_count + 1);
    if (s.job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "seams: the system refused memory");
    }
    vsh_stitch_report found = {0};
    const vsh_result result = stitch(&s, light_count, &full, &found, error);
    vshi_job_end(s.job);
    if (result == VSH_OK && report != NULL) {
        *report = found;
    }
    return result;
}

vsh_result vsh_lightmap_stitch(const vsh_charts *charts, const vsh_lightmap *lightmap, size_t light_count,
                               const vsh_stitch_options *options, const vsh_run *run,
                               vsh_stitch_report *report, vsh_error *error) {
    VSHI_NEEDS(charts);
    VSHI_NEEDS(lightmap);
    const vsh_stitch_page page = {charts, lightmap};
    return vsh_lightmaps_stitch(&page, 1, light_count, options, run, report, error);
}
