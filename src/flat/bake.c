/* Light maps of a plane, texel by texel. */
#include "bake/padding.h"
#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "flat/distances.h"
#include "light/light.h"
#include "light/types.h"

#include <vdbshade/flat.h>

#include <math.h>
#include <stdlib.h>

enum { MAX_SIZE = 65536, MAX_SUPERSAMPLE = 16, MAX_SAMPLES = MAX_SUPERSAMPLE * MAX_SUPERSAMPLE };

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
    vshi_flat_grid grid; /* of the classic method */
    double texel[2];     /* size, world units */
    uint8_t *state;      /* [height][width], for padding; or NULL */
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
        return vshi_flat_classic(&b->grid, &view, b->options.max_steps);
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
    double bytes = padded ? texels * (1.0 + sizeof(int16_t)) : 0.0;
    if (b->casters != NULL) {
        vsh_outline_info info;
        vsh_outline_get_info(b->casters, &info);
        bytes += (double)info.bytes;
    }
    if (classic) {
        const double grid = vshi_flat_grid_bytes(b->casters, margin_of(b), cell);
        if (isinf(grid)) {
            return vshi_fail(
                error, VSH_ERROR_LIMIT,
                "flat: method classic: more than 2^31 distances: the outline and the lights' widths "
                "are too large for texels of %g",
                cell);
        }
        bytes += grid;
    }
    VSHI_TRY(vshi_check_limit(run, bytes, "flat", error));
    if (padded) {
        void *memory = NULL;
        VSHI_TRY(vshi_allocate(&memory, (size_t)texels, 1, "padding", error));
        b->state = memory;
    }
    if (classic) {
        VSHI_TRY(vshi_flat_grid_make(b->casters, margin_of(b), cell, run, &b->grid, error));
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
