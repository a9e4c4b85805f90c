/* Tiles of a lightmap, traced: shadow values are final, shared AO leaves its shots. */
#include "bake/origins.h"
#include "bake/page.h"
#include "bake/planes.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "shade/ao.h"
#include "shade/layers.h"
#include "shade/shadow.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct vshi_tracer {
    const vsh_occluders *occluders;
    vsh_layer *layers;    /* [layer_count]: the occluders', of points that are lifted already */
    vsh_occluders lifted; /* with them */
    bool layered_ao;
    const vsh_light *lights;
    size_t light_count;
    vsh_shade_options shade; /* resolved */
    uint32_t needs;          /* VSHI_NEEDS_… */
    vshi_placement placement;
    bool traces_shadow, traces_ao; /* rays against triangles, which begin on the receiver's */
    vshi_shadow_shader *shadow;    /* [light_count] */
    vshi_ao_shader ao, sky;
    bool shared; /* AO is, if charts have a spacing */
    bool held;   /* some samples are compared with the casters */
    int32_t threads, isa;
};

/* What is known of the errors of a page's channels. */
typedef struct checking {
    vshi_field_error of;
    vshi_truth_channel *channels; /* [light_count + 2]: of lights, AO, the sky; NULL: nothing is held */
} checking;

/* --- prepared */

static bool needs(uint32_t needs, uint32_t any) {
    return (needs & any) != 0;
}

/* Layers for points that start_offset and surface_offset have lifted off the occluders' field: what their own
 * voxels need beyond that is left. */
static vsh_result lift_layers(vshi_tracer *t, vsh_error *error) {
    const vsh_occluders *occluders = t->occluders;
    const double start = t->shade.start_offset, surface = t->shade.surface_offset;
    const double lifted = start * occluders->field->voxel_size + surface;
    VSHI_TRY(vshi_allocate((void **)&t->layers, occluders->layer_count, sizeof *t->layers, "layers", error));
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        vsh_layer *layer = &t->layers[i];
        *layer = occluders->layers[i];
        t->layered_ao = t->layered_ao || layer->ao != 0;
        if (layer->field != NULL) {
            const vsh_field *own = layer->field;
            const double offset = layer->start_offset < 0.0 ? start : layer->start_offset;
            const double height = offset * own->voxel_size + 0.5 * own->shell_thickness + surface;
            layer->start_offset = fmin(16.0, fmax(0.0, (height - lifted) / own->voxel_size));
        }
    }
    t->lifted = *occluders;
    t->lifted.layers = t->layers;
    t->lifted.lifted = start * occluders->field->voxel_size;
    return VSH_OK;
}

/* Marched points have their start offset already. For traced ones, which begin on the triangles, shading adds
 * it. */
static vsh_shade_options options_for(const vshi_tracer *t, bool traced, bool sky, int32_t axis) {
    vsh_shade_options shade = sky ? vshi_sky_options(&t->shade, axis) : t->shade;
    if (!traced) {
        shade.start_offset = 0.0;
        shade.surface_offset = 0.0;
    }
    return shade;
}

static const vsh_occluders *occluders_for(const vshi_tracer *t, bool traced) {
    return traced ? t->occluders : &t->lifted;
}

static vsh_result open_ao(vshi_tracer *t, const vsh_lightmap *planes, bool sky, vshi_ao_shader *shader,
                          vsh_error *error) {
    const vsh_shade_options shade = options_for(t, t->traces_ao, sky, planes->asked.sky);
    const vshi_ao_shading shading = {
        .shared = t->shared, .bent = !sky && planes->bent != NULL, .outside = true};
    return vshi_ao_open(occluders_for(t, t->traces_ao), &shade, shading, t->isa, shader, error);
}

static bool keeps_error(const vsh_shade_options *shade, bool of_light) {
    const uint32_t traits =
        of_light ? vsh_shadow_method_traits(shade->method) : vsh_ao_method_traits(shade->ao_method);
    return (traits & VSH_METHOD_KEEPS_ERROR) != 0;
}

static bool holds(const vshi_tracer *t) {
    const vsh_occluders *casters = t->occluders;
    const bool estimates =
        (needs(t->needs, VSHI_NEEDS_LIGHTS) && keeps_error(&t->shade, true)) ||
        (needs(t->needs, VSHI_NEEDS_AO | VSHI_NEEDS_OPEN) && keeps_error(&t->shade, false));
    return (casters->true_triangles != NULL || casters->true_solids != NULL) && casters->layer_count == 0 &&
           estimates;
}

static vsh_result prepare(vshi_tracer *t, const vsh_lightmap *planes, bool held, vsh_error *error) {
    const vsh_triangles *triangles = t->occluders->triangles;
    const bool lights = needs(t->needs, VSHI_NEEDS_LIGHTS),
               ao = needs(t->needs, VSHI_NEEDS_AO | VSHI_NEEDS_OPEN);
    VSHI_TRY(lift_layers(t, error));
    t->traces_shadow = vshi_shadow_traces(&t->shade, triangles);
    t->traces_ao = vshi_ao_traces(&t->shade, triangles);
    t->shared = !t->layered_ao && keeps_error(&t->shade, false);
    t->held = held && holds(t);
    t->placement = vshi_placement_open(t->occluders, &t->shade, (vshi_origins_for){lights, ao}, t->isa);
    VSHI_TRY(vshi_allocate((void **)&t->shadow, t->light_count, sizeof *t->shadow, "lights", error));
    for (size_t i = 0; lights && i < t->light_count; ++i) {
        const vsh_shade_options shade = options_for(t, t->traces_shadow, false, VSH_UP_NONE);
        VSHI_TRY(vshi_shadow_open(occluders_for(t, t->traces_shadow), &t->lights[i], &shade, t->isa,
                                  &t->shadow[i], error));
    }
    if (needs(t->needs, VSHI_NEEDS_AO)) {
        VSHI_TRY(open_ao(t, planes, false, &t->ao, error));
    }
    return needs(t->needs, VSHI_NEEDS_OPEN) ? open_ao(t, planes, true, &t->sky, error) : VSH_OK;
}

vsh_result vshi_tracer_create(const vsh_occluders *occluders, const vsh_light *lights, size_t light_count,
                              const vsh_shade_options *shade, const vsh_lightmap *planes, bool held,
                              const vsh_run *run, vshi_tracer **tracer, vsh_error *error) {
    vshi_tracer *t = NULL;
    *tracer = NULL;
    VSHI_TRY(vshi_allocate((void **)&t, 1, sizeof *t, "lightmap", error));
    t->occluders = occluders;
    t->lights = lights;
    t->light_count = light_count;
    t->shade = *shade;
    t->needs = vshi_planes_need_given(planes);
    t->threads = run->threads;
    t->isa = run->isa;
    const vsh_result result = prepare(t, planes, held, error);
    if (result != VSH_OK) {
        vshi_tracer_free(t);
        return result;
    }
    *tracer = t;
    return VSH_OK;
}

void vshi_tracer_free(vshi_tracer *tracer) {
    if (tracer == NULL) {
        return;
    }
    for (size_t i = 0; tracer->shadow != NULL && i < tracer->light_count; ++i) {
        vshi_shadow_close(&tracer->shadow[i]);
    }
    vshi_ao_close(&tracer->sky);
    vshi_ao_close(&tracer->ao);
    free(tracer->shadow);
    free(tracer->layers);
    free(tracer);
}

bool vshi_tracer_shares(const vshi_tracer *tracer, int32_t spacing) {
    return vshi_ao_is_shared(&tracer->shade, spacing, tracer->layered_ao);
}

static void close_checking(checking *c, size_t light_count) {
    for (size_t i = 0; c->channels != NULL && i < light_count + 2; ++i) {
        vshi_truth_channel_close(&c->channels[i]);
    }
    free(c->channels);
    c->channels = NULL;
}

static vsh_result open_checking(const vshi_tracer *t, const vshi_page *page, checking *c, vsh_error *error) {
    const bool lights = needs(t->needs, VSHI_NEEDS_LIGHTS),
               ao = needs(t->needs, VSHI_NEEDS_AO | VSHI_NEEDS_OPEN);
    *c = (checking){.channels = NULL};
    if (!t->held) {
        return VSH_OK;
    }
    c->of = vshi_field_error_open(t->occluders, &t->shade, page->charts->info.samples,
                                  (!lights || t->traces_shadow) && (!ao || t->traces_ao));
    VSHI_TRY(vshi_allocate((void **)&c->channels, t->light_count + 2, sizeof *c->channels,
                           "error of the field", error));
    for (size_t i = 0; i < t->light_count + 2; ++i) {
        const vsh_shade_options shade =
            i > t->light_count ? vshi_sky_options(&t->shade, page->lightmap.asked.sky) : t->shade;
        const vsh_light *light = i < t->light_count ? &t->lights[i] : NULL;
        VSHI_TRY(vshi_truth_channel_open(&c->of, light, &shade, &c->channels[i], error));
    }
    return VSH_OK;
}

/* --- one tile at work */

enum { AROUND = VSHI_TILE + 2, FRAME = 4 * (VSHI_TILE + 1) };

/* The memory of one thread. */
typedef struct work {
    vshi_samples samples;
    vshi_origins origins;
    size_t own; /* samples of the tile; those of the frame follow */
    float *values, *deviation;
    float *vectors;    /* [room][3]: bent normals, or tint */
    float *irradiance; /* [room][3] */
    vshi_smooth_work *smooth;
    /* of texels that share AO: */
    uint32_t *at;    /* [AROUND][AROUND] */
    float *position; /* [room][3]: from the page's centre */
    int32_t *rays;
    uint8_t *level;
    vshi_held_sample *held; /* [held_count] */
    size_t held_count;
    vshi_held_texel *held_texels;
} work;

typedef struct tracing {
    const vshi_tracer *tracer;
    vshi_page *page;
    const uint32_t *tiles; /* NULL: all */
    checking checking;
    bool shares;
    int32_t rows; /* of cells that are shaded together */
    vshi_job *job;
    work *works; /* [work_count] */
    size_t work_count;
    atomic_bool *busy; /* [work_count] */
} tracing;

/* Samples that a tile's work has room for. */
static size_t room_of(const vsh_charts *charts, int32_t rows, bool shares) {
    const size_t n = (size_t)charts->sorted.raster.supersample;
    return (size_t)rows * VSHI_CELL * VSHI_TILE * n * n + (shares ? FRAME : 0);
}

static int32_t rows_of(const vsh_charts *charts) {
    return charts->sorted.raster.supersample == 1 ? VSHI_TILE_CELLS : 1;
}

double vshi_trace_bytes(const vsh_charts *charts, int32_t threads) {
    const double each = (double)vshi_sample_bytes(charts->tangents) + VSHI_ORIGIN_BYTES +
                        12.0 * sizeof(float) + sizeof(vshi_held_sample) + sizeof(vshi_held_texel);
    const size_t tiles = vshi_charts_tiles(&charts->sorted), count = (size_t)vshi_parallel_most(threads);
    return (double)(count < tiles ? count : tiles) * (double)room_of(charts, rows_of(charts), true) * each +
           vshi_tile_bytes(&charts->sorted, threads);
}

static void free_work(work *w) {
    free(w->held_texels);
    free(w->held);
    free(w->level);
    free(w->rays);
    free(w->position);
    free(w->at);
    free(w->smooth);
    free(w->irradiance);
    free(w->vectors);
    free(w->deviation);
    free(w->values);
    vshi_origins_free(&w->origins);
    vshi_samples_free(&w->samples);
}

static vsh_result allocate_work(const tracing *t, work *w, vsh_error *error) {
    const vsh_charts *charts = t->page->charts;
    const size_t room = room_of(charts, t->rows, t->shares);
    const size_t held = t->checking.channels != NULL ? vshi_field_error_most(&t->checking.of, room) : 0;
    const char *what = "lightmap tile";
    VSHI_TRY(vshi_samples_allocate(&w->samples, room, charts->tangents, error));
    VSHI_TRY(vshi_origins_allocate(&w->origins, room, error));
    VSHI_TRY(vshi_allocate((void **)&w->values, room, sizeof *w->values, what, error));
    VSHI_TRY(vshi_allocate((void **)&w->deviation, room, sizeof *w->deviation, what, error));
    VSHI_TRY(vshi_allocate((void **)&w->vectors, room, 3 * sizeof *w->vectors, what, error));
    VSHI_TRY(vshi_allocate((void **)&w->irradiance, room, 3 * sizeof *w->irradiance, what, error));
    VSHI_TRY(vshi_allocate((void **)&w->smooth, 1, sizeof *w->smooth, what, error));
    VSHI_TRY(vshi_allocate((void **)&w->at, AROUND * AROUND, sizeof *w->at, what, error));
    VSHI_TRY(
        vshi_allocate((void **)&w->position, t->shares ? room : 0, 3 * sizeof *w->position, what, error));
    VSHI_TRY(vshi_allocate((void **)&w->rays, room, sizeof *w->rays, what, error));
    VSHI_TRY(vshi_allocate((void **)&w->level, room, 1, what, error));
    VSHI_TRY(vshi_allocate((void **)&w->held, held, sizeof *w->held, what, error));
    return vshi_allocate((void **)&w->held_texels, held, sizeof *w->held_texels, what, error);
}

/* Whether the texels of origins `k` and the one before it are one. */
static bool same_texel(const work *w, size_t k) {
    const uint32_t *texel = w->samples.texel, *sample = w->origins.sample;
    return k > 0 && k < w->origins.count && texel[sample[k]] == texel[sample[k - 1]];
}

static size_t place_of(const tracing *t, const work *w, size_t origin) {
    return vshi_page_place(t->page, w->samples.texel[w->origins.sample[origin]]);
}

/* Averages values [origins][channels] over texels, those whose first is NaN left out. A texel without a value
 * becomes invalid, unless the values are deviations. */
static void average(const tracing *t, const work *w, const float *values, size_t channels, bool deviation,
                    float *plane) {
    for (size_t k = 0, next; k < w->origins.count; k = next) {
        const size_t place = place_of(t, w, k);
        double sum[3] = {0.0, 0.0, 0.0};
        size_t count = 0;
        for (next = k; next == k || same_texel(w, next); ++next) {
            const float *value = values + channels * next;
            if (!isnan(value[0])) {
                for (size_t c = 0; c < channels; ++c) {
                    sum[c] += (double)value[c];
                }
                ++count;
            }
        }
        for (size_t c = 0; count > 0 && c < channels; ++c) {
            plane[channels * place + c] = (float)(sum[c] / (double)count);
        }
        if (count == 0 && !deviation) {
            t->page->state[place] = VSHI_TEXEL_INVALID;
        }
    }
}

/* --- channels */

/* The points of a channel: where its rays begin. */
static vsh_points place_points(const tracing *t, work *w, const vsh_light *light, bool traced) {
    vshi_origins *origins = &w->origins;
    const vsh_points points = {origins->count, origins->start, origins->normal, origins->texel};
    if (!traced && !t->page->charts->smooth) { /* nothing is lifted */
        return (vsh_points){origins->count, origins->position, origins->normal, origins->texel};
    }
    const vshi_lifter lifter = vshi_lifter_open(t->tracer->occluders, light);
    vshi_origins_lift(&lifter, &w->samples, traced, origins);
    return points;
}

/* The errors of a channel that a tile adds to, and the statistics with those before it. */
typedef struct channel {
    vsh_bake_error *sum;
    vsh_shade_stats *stats;
    double square, worst; /* of the statistics before it */
} channel;

static channel begin_channel(const tracing *t, size_t tile, size_t index) {
    vsh_shade_stats *stats = &t->page->stats[tile];
    const channel c = {&t->page->errors[tile * t->page->error_count + index], stats, stats->square_error,
                       stats->worst_error};
    stats->worst_error = 0.0;
    return c;
}

static void end_channel(const tracing *t, const work *w, const channel *c, bool of_light) {
    if (keeps_error(&t->tracer->shade, of_light)) {
        c->sum->values += (double)w->origins.count;
        c->sum->square_error += c->stats->square_error - c->square;
        c->sum->worst = fmax(c->sum->worst, c->stats->worst_error);
    }
    c->stats->worst_error = fmax(c->worst, c->stats->worst_error);
}

static void hold(const tracing *t, const work *w, size_t index, const channel *c) {
    if (t->checking.channels != NULL && keeps_error(&t->tracer->shade, index < t->tracer->light_count)) {
        vshi_field_error_add(&t->checking.channels[index], &w->samples, w->held, w->held_count, w->values,
                             c->sum);
    }
}

static float *plane_of(float *const *planes, size_t light) {
    return planes != NULL ? planes[light] : NULL;
}

static void trace_light(const tracing *t, work *w, size_t tile, size_t index) {
    const vshi_tracer *tracer = t->tracer;
    const vsh_lightmap *planes = &t->page->lightmap;
    float *shadow = plane_of(planes->shadow, index), *errors = plane_of(planes->shadow_error, index),
          *tint = plane_of(planes->tint, index);
    const vsh_light *light = &tracer->lights[index];
    const vsh_points points = place_points(t, w, light, tracer->traces_shadow);
    const channel c = begin_channel(t, tile, index);
    vshi_shadow_points(&tracer->shadow[index], &points, w->values, w->deviation, c.stats);
    if (tracer->shade.max_error >= VSHI_COARSE) { /* finer values are smooth by themselves */
        vshi_shadow_smooth(&w->origins, w->values, w->deviation, w->smooth);
    }
    if (errors != NULL) {
        average(t, w, w->deviation, 1, true, errors);
    }
    if (shadow != NULL) {
        average(t, w, w->values, 1, false, shadow);
    }
    end_channel(t, w, &c, true);
    hold(t, w, index, &c);
    if (tint != NULL) {
        vsh_shade_tint(w->origins.count, w->values, &planes->tint_by, w->vectors);
        average(t, w, w->vectors, 3, false, tint);
    }
    if (planes->irradiance != NULL) {
        const vsh_points own = {w->origins.count, w->origins.position, w->origins.normal, NULL};
        vshi_shade_irradiance(&own, NULL, light, w->values, &planes->tint_by, w->irradiance);
    }
}

/* Bent normals of samples, averaged over texels. */
static void put_bent(const tracing *t, work *w) {
    const vsh_lightmap *planes = &t->page->lightmap;
    for (size_t k = 0; k < w->origins.count; ++k) {
        const float *tangent =
            planes->bent_space == VSH_BENT_TANGENT ? w->samples.tangent + 4 * w->origins.sample[k] : NULL;
        vshi_bent_normal(w->origins.normal + 3 * k, tangent, w->vectors + 3 * k);
    }
    average(t, w, w->vectors, 3, false, planes->bent);
    for (size_t k = 0; k < w->origins.count; ++k) {
        if (!same_texel(w, k)) {
            vshi_bent_normalize(planes->bent + 3 * place_of(t, w, k));
        }
    }
}

static const float *faces_of(const tracing *t, const work *w) {
    return t->page->charts->smooth ? w->origins.face : NULL;
}

/* AO, or the sky, each sample by itself. */
static void trace_ao(const tracing *t, work *w, size_t tile, bool sky) {
    const vshi_tracer *tracer = t->tracer;
    const vsh_lightmap *planes = &t->page->lightmap;
    const bool bent = !sky && planes->bent != NULL;
    const vsh_points points = place_points(t, w, NULL, tracer->traces_ao);
    const channel c = begin_channel(t, tile, tracer->light_count + sky);
    vshi_ao_points(sky ? &tracer->sky : &tracer->ao, &points, faces_of(t, w), w->values, w->deviation,
                   bent ? w->vectors : NULL, c.stats);
    if (sky) { /* rays tell of their error before the weighing, which makes it less */
        double up[3];
        vshi_sky_up(planes->asked.sky, up);
        for (size_t k = 0; k < w->origins.count; ++k) {
            w->values[k] = vshi_sky_weighed(w->origins.normal + 3 * k, up, w->values[k]);
        }
        average(t, w, w->values, 1, false, planes->sky);
    }
    if (!sky && planes->ao_error != NULL) {
        average(t, w, w->deviation, 1, true, planes->ao_error);
    }
    if (!sky && planes->ao != NULL) {
        average(t, w, w->values, 1, false, planes->ao);
    }
    end_channel(t, w, &c, false);
    hold(t, w, tracer->light_count + sky, &c);
    if (bent) {
        put_bent(t, w);
    }
}

/* --- AO that texels share */

/* Where the tile's points, and those around it, are in a map of them. */
static vshi_texel_map lay_out(const tracing *t, work *w, size_t tile) {
    const vshi_origins *origins = &w->origins;
    const vshi_charts *sorted = &t->page->charts->sorted;
    const size_t left = tile % sorted->columns * VSHI_TILE, top = tile / sorted->columns * VSHI_TILE;
    memset(w->at, 0, AROUND * AROUND * sizeof *w->at);
    for (size_t k = 0; k < origins->count + origins->frame; ++k) {
        const size_t i = origins->sample[k];
        const uint32_t texel = w->samples.texel[i];
        const size_t x = vsh_texel_column(texel) + 1 - left, y = vsh_texel_row(texel) + 1 - top;
        const vshi_vec start =
            t->tracer->traces_ao ? vshi_sample_foot(&w->samples, i) : vshi_vec_of(origins->position + 3 * k);
        const vshi_vec at = vshi_sub(start, vshi_vec_of(t->page->charts->centre));
        w->at[y * AROUND + x] = (uint32_t)k + 1;
        w->position[3 * k] = (float)at.x;
        w->position[3 * k + 1] = (float)at.y;
        w->position[3 * k + 2] = (float)at.z;
    }
    return (vshi_texel_map){
        .width = AROUND, .height = AROUND, .at = w->at, .position = w->position, .normal = origins->normal};
}

/* What was shot, to the page. */
static vsh_result keep_shots(const tracing *t, const work *w, size_t tile, vshi_shots *shots, size_t index,
                             vsh_error *error) {
    vshi_page *page = t->page;
    const bool keeps = keeps_error(&t->tracer->shade, false);
    for (size_t k = 0; k < w->origins.count; ++k) {
        const size_t place = place_of(t, w, k);
        shots->level[place] = w->level[k];
        shots->rays[place] = w->rays[k];
        shots->share[place] = w->values[k];
        if (shots->open != NULL) {
            memcpy(shots->open + 3 * place, w->vectors + 3 * k, 3 * sizeof *shots->open);
        }
        vshi_page_note(page, &w->samples, w->origins.sample[k]);
    }
    page->errors[tile * page->error_count + index].values += keeps ? (double)w->origins.count : 0.0;
    if (t->checking.channels == NULL || !keeps) {
        return VSH_OK;
    }
    vshi_held_texels *held = &shots->held[tile];
    held->count = vshi_field_error_count(&t->checking.channels[index], &w->samples, w->held, w->held_count,
                                         w->held_texels);
    VSHI_TRY(vshi_allocate((void **)&held->list, held->count, sizeof *held->list, "lightmap tile", error));
    if (held->count > 0) {
        memcpy(held->list, w->held_texels, held->count * sizeof *held->list);
    }
    return VSH_OK;
}

static vsh_result shoot_ao(const tracing *t, work *w, size_t tile, bool sky, vsh_error *error) {
    const vshi_tracer *tracer = t->tracer;
    vshi_shots *shots = sky ? &t->page->sky : &t->page->ao;
    const vsh_points points = place_points(t, w, NULL, tracer->traces_ao);
    const size_t all = w->origins.count + w->origins.frame;
    memset(w->rays, 0, all * sizeof *w->rays);
    memset(w->level, VSHI_AO_OPEN_LEVEL, all);
    const vshi_ao_share share = {.map = lay_out(t, w, tile),
                                 .left = 1,
                                 .top = 1,
                                 .side = VSHI_TILE,
                                 .spacing = t->page->charts->ao_spacing,
                                 .rays = w->rays,
                                 .level = w->level};
    vsh_shade_stats stats = vsh_shade_stats_zero(); /* its rays are counted where values come of them */
    vshi_ao_shoot(sky ? &tracer->sky : &tracer->ao, &points, faces_of(t, w), &share, w->values,
                  shots->open != NULL ? w->vectors : NULL, &stats);
    return keep_shots(t, w, tile, shots, tracer->light_count + sky, error);
}

/* --- all of a tile */

/* Which texels are valid, so far, and whose they are. */
static void note_texels(const tracing *t, const work *w) {
    vshi_page *page = t->page;
    for (size_t i = w->own; i > 0; --i) { /* a texel is its first sample's */
        const size_t place = vshi_page_place(page, w->samples.texel[i - 1]);
        page->mesh[place] = vshi_sample_mesh(&w->samples, i - 1) + 1;
        page->state[place] = VSHI_TEXEL_INVALID;
    }
    for (size_t k = 0; k < w->origins.count; ++k) {
        page->state[place_of(t, w, k)] = VSHI_TEXEL_VALID;
    }
}

static vsh_result trace_samples(const tracing *t, work *w, size_t tile, vsh_error *error) {
    const vshi_tracer *tracer = t->tracer;
    const vsh_lightmap *planes = &t->page->lightmap;
    w->held_count = 0;
    if (t->checking.channels != NULL) {
        vshi_samples own = w->samples;
        own.count = w->own;
        w->held_count = vshi_field_error_choose(&t->checking.of, &own, &w->origins, w->held);
    }
    if (planes->irradiance != NULL) {
        memset(w->irradiance, 0, 3 * w->origins.count * sizeof *w->irradiance);
    }
    for (size_t i = 0; i < tracer->light_count; ++i) {
        if (vshi_planes_need_of_light(planes, i) != 0) {
            trace_light(t, w, tile, i);
        }
        if (vshi_job_cancelled(t->job)) {
            return VSH_OK; /* told by who counts tiles */
        }
    }
    if (planes->irradiance != NULL) {
        average(t, w, w->irradiance, 3, false, planes->irradiance);
    }
    for (int sky = 0; sky < 2; ++sky) {
        if (!needs(tracer->needs, sky ? VSHI_NEEDS_OPEN : VSHI_NEEDS_AO)) {
            continue;
        }
        if (t->shares) {
            VSHI_TRY(shoot_ao(t, w, tile, sky != 0, error));
        } else {
            trace_ao(t, w, tile, sky != 0);
        }
    }
    return VSH_OK;
}

static vsh_result trace_tile(const tracing *t, work *w, size_t number, vsh_error *error) {
    const vsh_charts *charts = t->page->charts;
    vshi_tile tile;
    vsh_result result = vshi_tile_open(&charts->sorted, number, &tile, error);
    vshi_sample_writer writer = {.charts = charts, .tile = &tile, .samples = &w->samples};
    t->page->stats[number] = vsh_shade_stats_zero();
    for (int32_t row = 0; result == VSH_OK && row < VSHI_TILE_CELLS; row += t->rows) {
        w->samples.count = 0;
        vshi_samples_write_rows(&writer, &tile, row, row + t->rows);
        w->own = w->samples.count;
        vshi_origins_find(&t->tracer->placement, &w->samples, &w->origins);
        note_texels(t, w);
        if (t->shares) {
            vshi_samples_write_frame(&writer, &tile);
            vshi_origins_add_frame(&t->tracer->placement, &w->samples, w->own, &w->origins);
        }
        result = w->origins.count > 0 ? trace_samples(t, w, number, error) : VSH_OK;
    }
    vshi_tile_close(&tile);
    return result;
}

/* Memory that no other thread works with. There are as many as threads. */
static size_t take_work(tracing *t) {
    for (size_t i = 0;; i = (i + 1) % t->work_count) {
        if (!atomic_exchange(&t->busy[i], true)) {
            return i;
        }
    }
}

static vsh_result trace_listed_tile(void *user, size_t i, vsh_error *error) {
    tracing *t = user;
    const size_t number = t->tiles != NULL ? t->tiles[i] : i;
    if (t->page->charts->samples[number] == 0) {
        return VSH_OK;
    }
    const size_t own = take_work(t);
    const vsh_result result = trace_tile(t, &t->works[own], number, error);
    atomic_store(&t->busy[own], false);
    return result;
}

/* As many as threads work on tiles at a time. */
static vsh_result allocate_works(tracing *t, size_t tiles, vsh_error *error) {
    const size_t threads = (size_t)vshi_parallel_most(t->tracer->threads);
    t->work_count = threads < tiles ? threads : tiles;
    VSHI_TRY(vshi_allocate((void **)&t->works, t->work_count, sizeof *t->works, "lightmap tiles", error));
    VSHI_TRY(vshi_allocate((void *)&t->busy, t->work_count, sizeof *t->busy, "lightmap tiles", error));
    for (size_t i = 0; i < t->work_count; ++i) {
        VSHI_TRY(allocate_work(t, &t->works[i], error));
    }
    return VSH_OK;
}

vsh_result vshi_trace_tiles(const vshi_tracer *tracer, vshi_page *page, const uint32_t *tiles, size_t count,
                            vshi_job *job, vsh_error *error) {
    const vsh_charts *charts = page->charts;
    tracing t = {.tracer = tracer,
                 .page = page,
                 .tiles = tiles,
                 .shares = page->ao.share != NULL || page->sky.share != NULL,
                 .rows = rows_of(charts),
                 .job = job};
    vsh_result result;
    VSHI_TRY_DONE(open_checking(tracer, page, &t.checking, error));
    VSHI_TRY_DONE(allocate_works(&t, count, error));
    result = vshi_parallel_each(job, count, 1, 1, trace_listed_tile, &t, error);
done:
    for (size_t i = 0; t.works != NULL && i < t.work_count; ++i) {
        free_work(&t.works[i]);
    }
    free(t.busy);
    free(t.works);
    close_checking(&t.checking, tracer->light_count);
    return result;
}
