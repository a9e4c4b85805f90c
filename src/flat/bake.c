/* Light maps of a plane, texel by texel. */
#include "bake/padding.h"
#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "flat/visible.h"
#include "light/light.h"
#include "light/types.h"

#include <vdbshade/flat.h>

#include <math.h>
#include <stdlib.h>

enum { MAX_SIZE = 65536, MAX_SUPERSAMPLE = 16, MAX_SAMPLES = MAX_SUPERSAMPLE * MAX_SUPERSAMPLE };

/* --- the classic method, on a grid */

/* Distances to the outline on a grid. */
typedef struct grid {
    double low[2], high[2]; /* world rectangle */
    double cell;            /* world units */
    size_t columns, rows;
    float *values; /* [rows][columns], signed, world units */
} grid;

static const double MAX_VALUES = 0x1p31;
/* In cells: the distance of a hit, and the shortest step, which moves rays on along walls. */
static const double MET = 0.01;
static const double SHORTEST_STEP = 0.1;

static void size_of(const vsh_outline *outline, double margin, double cell, double sides[2]) {
    const vshi_outline_node *root = &outline->nodes[0];
    for (int axis = 0; axis < 2; ++axis) {
        sides[axis] = ceil((root->high[axis] - root->low[axis] + 2.0 * margin) / cell) + 2.0;
    }
}

typedef struct filling {
    const vsh_outline *outline;
    grid *grid;
} filling;

static void fill_grid_rows(void *user, size_t begin, size_t end) {
    const filling *f = user;
    const grid *g = f->grid;
    for (size_t row = begin; row < end; ++row) {
        double bound = INFINITY; /* a neighbour's distance and a step bound the next one's */
        for (size_t column = 0; column < g->columns; ++column) {
            const vshi_point p = {g->low[0] + (double)column * g->cell, g->low[1] + (double)row * g->cell};
            const double distance = sqrt(vshi_outline_square(f->outline, p, bound * bound));
            bound = distance * (1.0 + 1e-9) + 1.001 * g->cell;
            g->values[row * g->columns + column] =
                (float)(vshi_outline_winding(f->outline, p) != 0 ? -distance : distance);
        }
    }
}

/* Makes a grid of the size that size_of() found. Free the values with free(). Errors: VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. */
static vsh_result make_grid(const vsh_outline *outline, double margin, double cell, const double sides[2],
                            const vsh_run *run, grid *made, vsh_error *error) {
    *made = (grid){.cell = cell, .columns = (size_t)sides[0], .rows = (size_t)sides[1]};
    for (int axis = 0; axis < 2; ++axis) {
        made->low[axis] = outline->nodes[0].low[axis] - margin - 0.5 * cell;
        made->high[axis] = made->low[axis] + (sides[axis] - 1.0) * cell;
    }
    void *memory = NULL;
    vsh_result result = vshi_allocate(&memory, made->columns * made->rows, sizeof(float), "distances", error);
    made->values = memory;
    if (result != VSH_OK) {
        return result;
    }
    vshi_job *job = vshi_job_begin(run, "field", made->rows);
    filling f = {outline, made};
    result = job != NULL ? vshi_parallel_for(job, made->rows, 1, 1, fill_grid_rows, &f, error)
                         : vshi_fail(error, VSH_ERROR_MEMORY, "distances: the system refused memory");
    vshi_job_end(job);
    return result;
}

/* Bilinear, in the grid. */
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

/* The part of the ray in the grid's rectangle. */
static bool clip_ray(const grid *g, const vshi_flat_view *v, double *from, double *to) {
    const double origin[2] = {v->point.x, v->point.y}, direction[2] = {v->towards.x, v->towards.y};
    for (int axis = 0; axis < 2; ++axis) {
        if (direction[axis] == 0.0) {
            if (origin[axis] < g->low[axis] || origin[axis] > g->high[axis]) {
                return false;
            }
            continue;
        }
        const double a = (g->low[axis] - origin[axis]) / direction[axis];
        const double b = (g->high[axis] - origin[axis]) / direction[axis];
        *from = fmax(*from, fmin(a, b));
        *to = fmin(*to, fmax(a, b));
    }
    return *from < *to;
}

/* Technique "soft shadows in raymarched SDFs" (Quilez, 2010) in the plane, as 2D lighting uses it (Kaplan):
 * the least h/(s t) along the ray to the light's centre, 0 where it meets something. */
static double find_classic(const grid *g, const vshi_flat_view *v, int32_t max_steps) {
    double t = g->cell, end = v->distance;
    if (!clip_ray(g, v, &t, &end)) {
        return 1.0;
    }
    const double sine =
        isinf(v->distance) ? v->slope / sqrt(1.0 + v->slope * v->slope) : v->radius / v->distance;
    double least = 1.0;
    for (int32_t step = 0; step < max_steps && t < end; ++step) {
        const double h =
            sample(g, (vshi_point){v->point.x + t * v->towards.x, v->point.y + t * v->towards.y});
        if (h < MET * g->cell) {
            return 0.0;
        }
        least = h < least * sine * t ? h / (sine * t) : least;
        t += fmax(h, SHORTEST_STEP * g->cell);
    }
    return least;
}

/* --- what is asked for */

static vsh_result check_options(const vsh_flat_options *o, vsh_error *error) {
    const struct {
        const char *name;
        int32_t value, least, most;
    } integers[] = {{"width", o->width, 1, MAX_SIZE},
                    {"height", o->height, 1, MAX_SIZE},
                    {"method", o->method, 0, VSH_FLAT_EXACT},
                    {"supersample", o->supersample, 1, MAX_SUPERSAMPLE},
                    {"padding", o->padding, 0, VSHI_MAX_PADDING},
                    {"max_steps", o->max_steps, 16, 65536}};
    for (size_t i = 0; i < sizeof integers / sizeof integers[0]; ++i) {
        if (integers[i].value < integers[i].least || integers[i].value > integers[i].most) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "flat: %s %d: expected %d … %d", integers[i].name,
                             integers[i].value, integers[i].least, integers[i].most);
        }
    }
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
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "light %zu: '%s': a plane knows no %s lights", i,
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
    grid grid;       /* of the classic method */
    double texel[2]; /* size, world units */
    uint8_t *state;  /* [height][width], for padding; or NULL */
} bake;

static float *plane(float *const *planes, size_t index) {
    return planes != NULL ? planes[index] : NULL;
}

/* Share of a light that a point sees; 0 beyond its reach. `gain` takes what reaches it of the light's colour.
 */
static double see(const bake *b, const vsh_light *light, vshi_point p, double *gain) {
    vshi_flat_view view;
    const bool outside = vshi_flat_look(light, p, &view);
    *gain = 1.0;
    if (light->type != VSH_LIGHT_DIRECTIONAL) {
        const vshi_vec to = {view.towards.x, view.towards.y, 0.0};
        /* in the light the falloff is that of its rim, and a spot shines everywhere */
        vsh_light flat = *light;
        flat.axis[2] = 0.0;
        flat.type = outside ? light->type : VSH_LIGHT_SPHERE;
        *gain = vshi_light_gain(&flat, to, fmax(view.distance, fmax(light->radius, 1e-30)));
        if (light->falloff == VSH_FALLOFF_QUADRATIC && view.distance >= light->reach) {
            return 0.0;
        }
    }
    if (!outside) {
        return 1.0;
    }
    if (b->options.method == VSH_FLAT_EXACT) {
        return vshi_flat_visible(b->casters, &view);
    }
    if (b->options.method == VSH_FLAT_CLASSIC && b->grid.values != NULL) {
        return find_classic(&b->grid, &view, b->options.max_steps);
    }
    return vshi_flat_centre_visible(b->casters, &view) ? 1.0 : 0.0;
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
            const double share = see(b, &b->lights[l], samples[i], &gain);
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
    void *memory = NULL;
    vsh_result result = vshi_allocate(&memory, b->light_count + 3, sizeof(vshi_plane), "planes", error);
    if (result != VSH_OK) {
        return result;
    }
    vshi_plane *planes = memory;
    size_t count = 0;
    for (size_t i = 0; i < b->light_count + 3; ++i) {
        float *values =
            i < b->light_count ? plane(b->map->shadow, i) : plane(b->map->irradiance, i - b->light_count);
        if (values != NULL) {
            planes[count++] = (vshi_plane){values, 1};
        }
    }
    vshi_store store = {.run = run};
    result = vshi_padding_fill(&store, run, b->options.width, b->options.height, b->state, radius, planes,
                               count, NULL, error);
    vshi_store_close(&store);
    free(planes);
    return result;
}

/* How far around the outline the distance decides: as wide as the widest light's cone gets. */
static double margin_of(const bake *b) {
    const vshi_outline_node *root = &b->casters->nodes[0];
    double sides[2], margin = 0.0;
    for (int axis = 0; axis < 2; ++axis) {
        sides[axis] = fmax(root->high[axis], b->options.region_max[axis]) -
                      fmin(root->low[axis], b->options.region_min[axis]);
    }
    for (size_t i = 0; i < b->light_count; ++i) {
        const vsh_light *light = &b->lights[i];
        margin = fmax(margin, light->type == VSH_LIGHT_DIRECTIONAL
                                  ? vshi_sin(0.5 * light->angle) * vshi_hypot(sides[0], sides[1])
                                  : light->radius);
    }
    return margin;
}

static vsh_result prepare(bake *b, const vsh_run *run, vsh_error *error) {
    const double texels = (double)b->options.width * (double)b->options.height;
    const bool classic = b->options.method == VSH_FLAT_CLASSIC && b->casters != NULL;
    const bool padded = b->options.padding > 0 && b->casters != NULL;
    const double cell = fmin(b->texel[0], b->texel[1]);
    double margin = 0.0, sides[2] = {0.0, 0.0};
    double bytes = padded ? texels * (1.0 + sizeof(int16_t)) : 0.0;
    if (b->casters != NULL) {
        vsh_outline_info info;
        vsh_outline_get_info(b->casters, &info);
        bytes += (double)info.bytes;
    }
    if (classic) {
        margin = margin_of(b);
        size_of(b->casters, margin, cell, sides);
        if (!(sides[0] * sides[1] <= MAX_VALUES)) {
            return vshi_fail(
                error, VSH_ERROR_LIMIT,
                "flat: method classic: more than 2^31 distances: the outline and the lights' widths "
                "are too large for texels of %g",
                cell);
        }
        bytes += sides[0] * sides[1] * sizeof(float);
    }
    VSHI_TRY(vshi_check_limit(run, bytes, "flat", error));
    if (padded) {
        void *memory = NULL;
        VSHI_TRY(vshi_allocate(&memory, (size_t)texels, 1, "padding", error));
        b->state = memory;
    }
    if (classic) {
        VSHI_TRY(make_grid(b->casters, margin, cell, sides, run, &b->grid, error));
    }
    return VSH_OK;
}

vsh_result vsh_flat_bake(const vsh_outline *casters, const vsh_light *lights, size_t light_count,
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
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(prepare(&b, &full, error));
    const size_t width = (size_t)b.options.width, height = (size_t)b.options.height;
    vshi_job *job = vshi_job_begin(&full, "flat", width * height);
    result = job != NULL ? vshi_parallel_for(job, height, 1, width, bake_rows, &b, error)
                         : vshi_fail(error, VSH_ERROR_MEMORY, "flat: the system refused memory");
    vshi_job_end(job);
    if (result == VSH_OK && b.state != NULL) {
        result = pad(&b, &full, error);
    }
done:
    free(b.grid.values);
    free(b.state);
    return result;
}

double vsh_flat_visibility(const vsh_outline *casters, const vsh_light *light, const double point[2]) {
    VSHI_FLOATS;
    const vshi_point p = {point[0], point[1]};
    vshi_flat_view view;
    if (!isfinite(p.x) || !isfinite(p.y) || vsh_get_name(VSH_NAMES_FLAT_LIGHT, light->type) == NULL) {
        return NAN;
    }
    return vshi_flat_look(light, p, &view) ? vshi_flat_visible(casters, &view) : 1.0;
}
