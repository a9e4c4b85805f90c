/* Light maps of a plane, texel by texel: 2D distance-field lighting (Kaplan) with the soft shadow of Quilez
 * (2010). A ray from each point to a light's centre marches through a grid of signed distances. The visible
 * share is the least h/(s t): h is the distance at t along the ray, s the sine of the light's half angle. */
#include "flat/flat.h"

#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "light/light.h"
#include "lightmap/padding.h"
#include "shapes/outline.h"

#include <vdbshade/picture.h>

#include <math.h>
#include <stdlib.h>

enum { MAX_SIZE = 65536, MAX_SUPERSAMPLE = 16, MAX_SAMPLES = MAX_SUPERSAMPLE * MAX_SUPERSAMPLE };
/* Ends rays whose steps are too short to change t. Along a wall, ten steps cross a cell. */
enum { MAX_STEPS = 16384 };

/* A light as seen from a point. */
typedef struct view {
    vshi_point point;
    vshi_point towards; /* unit, to the light's centre */
    double distance;    /* to the centre; infinite for a directional light */
    double sine;        /* of half the light's angle; 0: a hard light */
} view;

/* False if the point is in the light's disc, and sees all of it. */
static bool find_view(const vsh_light *light, vshi_point point, view *v) {
    v->point = point;
    if (light->type == VSH_LIGHT_DIRECTIONAL) {
        const double length = vshi_hypot(light->direction[0], light->direction[1]);
        v->towards = (vshi_point){light->direction[0] / length, light->direction[1] / length};
        v->distance = INFINITY;
        v->sine = vshi_sin(0.5 * light->angle);
        return true;
    }
    const double x = light->position[0] - point.x, y = light->position[1] - point.y;
    const double d = v->distance = vshi_hypot(x, y);
    if (!(d > light->radius)) {
        v->towards = (vshi_point){0.0, 0.0};
        return false;
    }
    v->towards = (vshi_point){x / d, y / d};
    v->sine = light->radius / d;
    return true;
}

/* --- the grid */

/* Signed distances to the outline on a grid. World units. */
typedef struct grid {
    const vsh_outline *outline;
    double low[2], high[2];
    double cell;
    size_t columns, rows;
    float *values; /* [rows][columns] */
} grid;

static const double MAX_VALUES = 0x1p31;
/* In cells: the distance of a hit, and the shortest step, which moves rays on along walls. */
static const double MET = 0.01, SHORTEST_STEP = 0.1;

static void fill_grid_rows(void *user, size_t begin, size_t end) {
    const grid *g = user;
    for (size_t row = begin; row < end; ++row) {
        double bound = INFINITY; /* a neighbour's distance and a step bound the next one's */
        for (size_t column = 0; column < g->columns; ++column) {
            const vshi_point p = {g->low[0] + (double)column * g->cell, g->low[1] + (double)row * g->cell};
            const double distance = sqrt(vshi_outline_square(g->outline, p, bound * bound));
            bound = distance * (1.0 + 1e-9) + 1.001 * g->cell;
            g->values[row * g->columns + column] =
                (float)(vshi_outline_winding(g->outline, p) != 0 ? -distance : distance);
        }
    }
}

/* Interpolates the grid bilinearly. */
static double sample(const grid *g, vshi_point p) {
    const double x = fmin(fmax((p.x - g->low[0]) / g->cell, 0.0), (double)(g->columns - 1));
    const double y = fmin(fmax((p.y - g->low[1]) / g->cell, 0.0), (double)(g->rows - 1));
    const size_t i = x < (double)(g->columns - 2) ? (size_t)x : g->columns - 2;
    const size_t k = y < (double)(g->rows - 2) ? (size_t)y : g->rows - 2;
    const double u = x - (double)i, v = y - (double)k;
    const float *at = g->values + k * g->columns + i, *above = at + g->columns;
    return (1.0 - v) * ((1.0 - u) * (double)at[0] + u * (double)at[1]) +
           v * ((1.0 - u) * (double)above[0] + u * (double)above[1]);
}

/* Finds the least h/(s t) along the ray to the light's centre, at most 1; 0 if the ray hits the outline. */
static double find_visible(const grid *g, const view *v) {
    double t = g->cell, end = v->distance;
    vshi_clip_axis(v->point.x, v->towards.x, g->low[0], g->high[0], &t, &end);
    vshi_clip_axis(v->point.y, v->towards.y, g->low[1], g->high[1], &t, &end);
    double least = 1.0; /* also of a ray that misses the grid */
    for (int step = 0; step < MAX_STEPS && t < end; ++step) {
        const double h =
            sample(g, (vshi_point){v->point.x + t * v->towards.x, v->point.y + t * v->towards.y});
        if (h < MET * g->cell) {
            return 0.0;
        }
        least = h < least * v->sine * t ? h / (v->sine * t) : least;
        t += fmax(h, SHORTEST_STEP * g->cell);
    }
    return least;
}

/* --- checks */

static vsh_result check_options(const vsh_flat_options *o, vsh_error *error) {
    const vshi_range ranges[] = {{"flat: width", o->width, 1, MAX_SIZE},
                                 {"flat: height", o->height, 1, MAX_SIZE},
                                 {"flat: supersample", o->supersample, 1, MAX_SUPERSAMPLE},
                                 {"flat: padding", o->padding, 0, VSHI_MAX_PADDING}};
    VSHI_TRY(vshi_check_ranges(ranges, sizeof ranges / sizeof ranges[0], error));
    for (int axis = 0; axis < 2; ++axis) {
        const double low = o->region_min[axis], high = o->region_max[axis];
        if (!(fabs(low) <= VSHI_OUTLINE_LARGEST && fabs(high) <= VSHI_OUTLINE_LARGEST && low < high)) {
            return vshi_fail(
                error, VSH_ERROR_ARGUMENT,
                "flat: region %.9g … %.9g along %s: expected two numbers of at most %g in size, the "
                "lower first",
                low, high, axis == 0 ? "x" : "y", VSHI_OUTLINE_LARGEST);
        }
    }
    return VSH_OK;
}

static vsh_result check_lights(const vsh_light *lights, size_t count, vsh_error *error) {
    for (size_t i = 0; i < count; ++i) {
        vsh_error reason;
        if (vsh_light_check(&lights[i], &reason) != VSH_OK) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "light %zu: %.900s", i, reason.message);
        }
        if (vsh_get_name(VSH_NAMES_FLAT_LIGHT, lights[i].type) == NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "light %zu: '%s': a plane has no %s lights", i,
                             lights[i].name, vshi_light_type_of(lights[i].type)->name);
        }
        const double *way = lights[i].type == VSH_LIGHT_SPOT ? lights[i].axis : lights[i].direction;
        if (lights[i].type != VSH_LIGHT_SPHERE && !(vshi_hypot(way[0], way[1]) > 0.0)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "light %zu: '%s': its direction has no length in the plane", i, lights[i].name);
        }
    }
    return VSH_OK;
}

/* --- texels */

typedef struct bake {
    const vsh_outline *casters;
    const vsh_light *lights;
    size_t light_count;
    vsh_flat_options options;
    const vsh_flat_map *map;
    grid grid;       /* without values if there are no casters */
    double texel[2]; /* size, world units */
    uint8_t *state;  /* [height][width], for padding; or NULL */
} bake;

static float *plane(float *const *planes, size_t index) {
    return planes != NULL ? planes[index] : NULL;
}

/* Finds the share of a light that a point sees, 0 beyond its reach, and the gain of the light's colour. */
static double shade_point(const bake *b, const vsh_light *light, vshi_point p, double *gain) {
    view v;
    const bool outside = find_view(light, p, &v);
    *gain = 1.0;
    if (light->type != VSH_LIGHT_DIRECTIONAL) {
        const vshi_vec to = {v.towards.x, v.towards.y, 0.0};
        /* inside the lamp, falloff is that of its rim, and spots shine everywhere */
        vsh_light flat = *light;
        flat.axis[2] = 0.0;
        flat.type = outside ? light->type : VSH_LIGHT_SPHERE;
        *gain = vshi_light_gain(&flat, to, fmax(v.distance, fmax(light->radius, 1e-30)));
        if (light->falloff == VSH_FALLOFF_QUADRATIC && v.distance >= light->reach) {
            return 0.0;
        }
    }
    return outside && b->casters != NULL ? find_visible(&b->grid, &v) : 1.0;
}

static void bake_texel(const bake *b, size_t row, size_t column) {
    const int32_t n = b->options.supersample;
    const size_t at = row * (size_t)b->options.width + column;
    vshi_point samples[MAX_SAMPLES]; /* outside solids */
    size_t count = 0;
    for (int32_t i = 0; i < n * n; ++i) {
        const double x = (double)column + (i % n + 0.5) / n, y = (double)row + ((double)(i / n) + 0.5) / n;
        const vshi_point p = {b->options.region_min[0] + x * b->texel[0],
                              b->options.region_max[1] - y * b->texel[1]};
        if (b->casters == NULL || vshi_outline_winding(b->casters, p) == 0) {
            samples[count++] = p;
        }
    }
    if (b->map->coverage != NULL) {
        b->map->coverage[at] = (float)((double)count / (n * n));
    }
    if (b->state != NULL) {
        b->state[at] = count > 0 ? VSHI_TEXEL_VALID : VSHI_TEXEL_EMPTY;
    }
    double rgb[3] = {0.0, 0.0, 0.0};
    for (size_t l = 0; l < b->light_count; ++l) {
        double seen = 0.0, lit = 0.0;
        for (size_t i = 0; i < count; ++i) {
            double gain;
            const double share = shade_point(b, &b->lights[l], samples[i], &gain);
            seen += share;
            lit += share * gain;
        }
        float *shadow = plane(b->map->shadow, l);
        if (shadow != NULL) {
            shadow[at] = (float)(count > 0 ? seen / (double)count : 0.0);
        }
        for (int c = 0; c < 3 && count > 0; ++c) {
            rgb[c] += lit / (double)count * b->lights[l].color[c];
        }
    }
    for (size_t c = 0; c < 3; ++c) {
        float *irradiance = plane(b->map->irradiance, c);
        if (irradiance != NULL) {
            irradiance[at] = (float)rgb[c];
        }
    }
}

static void bake_rows(void *user, size_t begin, size_t end) {
    const bake *b = user;
    for (size_t row = begin; row < end; ++row) {
        for (size_t column = 0; column < (size_t)b->options.width; ++column) {
            bake_texel(b, row, column);
        }
    }
}

/* Fills texels in solids from their neighbours. */
static vsh_result pad(const bake *b, const vsh_run *run, vsh_error *error) {
    const int32_t radius[VSHI_TEXEL_KINDS] = {[VSHI_TEXEL_EMPTY] = b->options.padding};
    vshi_plane *planes;
    size_t count = 0;
    VSHI_TRY(vshi_allocate((void **)&planes, b->light_count + 3, sizeof *planes, "planes", error));
    for (size_t i = 0; i < b->light_count + 3; ++i) {
        float *values =
            i < b->light_count ? plane(b->map->shadow, i) : plane(b->map->irradiance, i - b->light_count);
        if (values != NULL) {
            planes[count++] = (vshi_plane){values, 1};
        }
    }
    vshi_store store = {.run = run};
    const vsh_result result = vshi_padding_fill(&store, run, b->options.width, b->options.height, b->state,
                                                radius, planes, count, NULL, error);
    vshi_store_close(&store);
    free(planes);
    return result;
}

/* Finds the width around the outline in which distances matter: the widest cone's radius. */
static double find_margin(const bake *b) {
    const vshi_outline_node *root = &b->casters->nodes[0];
    double sides[2], margin = 0.0;
    for (int axis = 0; axis < 2; ++axis) {
        sides[axis] = fmax(root->high[axis], b->options.region_max[axis]) -
                      fmin(root->low[axis], b->options.region_min[axis]);
    }
    const double longest = vshi_hypot(sides[0], sides[1]);
    for (size_t i = 0; i < b->light_count; ++i) {
        const vsh_light *light = &b->lights[i];
        margin = fmax(margin, light->type == VSH_LIGHT_DIRECTIONAL ? vshi_sin(0.5 * light->angle) * longest
                                                                   : fmin(light->radius, longest));
    }
    return margin;
}

static vsh_result place_grid(bake *b, vsh_error *error) {
    const vshi_outline_node *root = &b->casters->nodes[0];
    const double margin = find_margin(b), cell = fmin(b->texel[0], b->texel[1]);
    double sides[2];
    b->grid.outline = b->casters;
    b->grid.cell = cell;
    for (int axis = 0; axis < 2; ++axis) {
        sides[axis] = ceil((root->high[axis] - root->low[axis] + 2.0 * margin) / cell) + 2.0;
        b->grid.low[axis] = root->low[axis] - margin - 0.5 * cell;
        b->grid.high[axis] = b->grid.low[axis] + (sides[axis] - 1.0) * cell;
    }
    if (!(sides[0] * sides[1] <= MAX_VALUES)) {
        return vshi_fail(
            error, VSH_ERROR_LIMIT,
            "flat: more than 2^31 distances: the outline and the lights' widths are too large for "
            "texels of %g",
            cell);
    }
    b->grid.columns = (size_t)sides[0];
    b->grid.rows = (size_t)sides[1];
    return VSH_OK;
}

/* Runs fn over rows as a job of its own. */
static vsh_result run_rows(const vsh_run *run, const char *stage, size_t rows, size_t units,
                           vshi_range_fn *fn, void *user, vsh_error *error) {
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, run, stage, rows * units, "flat", error));
    const vsh_result result = vshi_parallel_for(job, rows, 1, units, fn, user, error);
    vshi_job_end(job);
    return result;
}

/* Allocates the states for padding, and fills the grid. */
static vsh_result prepare(bake *b, const vsh_run *run, vsh_error *error) {
    if (b->casters == NULL) {
        return VSH_OK;
    }
    const size_t texels = (size_t)b->options.width * (size_t)b->options.height;
    const bool padded = b->options.padding > 0;
    vshi_outline_info info;
    vshi_outline_get_info(b->casters, &info);
    VSHI_TRY(place_grid(b, error));
    const size_t values = b->grid.columns * b->grid.rows;
    const double bytes = (double)info.bytes + (padded ? (double)texels * (1.0 + sizeof(int16_t)) : 0.0) +
                         (double)values * sizeof(float);
    VSHI_TRY(vshi_check_limit(run, bytes, "flat", error));
    VSHI_TRY(vshi_allocate((void **)&b->state, padded ? texels : 0, 1, "padding", error));
    VSHI_TRY(vshi_allocate((void **)&b->grid.values, values, sizeof(float), "distances", error));
    return run_rows(run, "field", b->grid.rows, 1, fill_grid_rows, &b->grid, error);
}

vsh_result vshi_flat_bake(const vsh_outline *casters, const vsh_light *lights, size_t light_count,
                          const vsh_flat_options *options, const vsh_run *run, const vsh_flat_map *map,
                          vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(map);
    VSHI_NEEDS_OF(light_count, lights);
    bake b = {.casters = casters,
              .lights = lights,
              .light_count = light_count,
              .options = vsh_flat_options_default(),
              .map = map};
    vsh_run full;
    VSHI_TRY(vshi_options_resolve(options, &b.options, sizeof b.options, "vsh_flat_options", error));
    VSHI_TRY(check_options(&b.options, error));
    VSHI_TRY(check_lights(lights, light_count, error));
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    b.texel[0] = (b.options.region_max[0] - b.options.region_min[0]) / b.options.width;
    b.texel[1] = (b.options.region_max[1] - b.options.region_min[1]) / b.options.height;
    vsh_result result;
    VSHI_TRY_DONE(prepare(&b, &full, error));
    VSHI_TRY_DONE(
        run_rows(&full, "flat", (size_t)b.options.height, (size_t)b.options.width, bake_rows, &b, error));
    result = b.state != NULL ? pad(&b, &full, error) : VSH_OK;
done:
    free(b.grid.values);
    free(b.state);
    return result;
}
