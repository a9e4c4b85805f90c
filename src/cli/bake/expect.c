/* Rates were measured on two cores of an AMD EPYC (Zen 3), with bench/README.md's assets and those of
 * assets/. Only their ratios matter for long: what the first stages take corrects them (estimate.c). */
#include "bake.h"

#include "cli/estimate.h"
#include "cli/progress.h"

#include <math.h>
#include <stdio.h>
#include <unistd.h>

static const double micro = 1e-6;

/* --- shape: from casters to a field */

/* Seconds on all cores: of a voxel of the band, of a triangle, and of one that rays may meet. */
static const double voxel_s = 1.1e-6, triangle_s = 4e-6, traced_s = 1e-6, field_voxel_s = 0.3e-6;
/* Voxels of a band for each of a voxel's area of surface: three to each side. */
static const double band = 6.5;
/* Area over the square of the longest side, of casters that are no meshes. */
static const double plain_area = 3.0;

typedef struct shape {
    double area, triangles;
    double low[3], high[3];
} shape;

static void add_mesh(shape *s, const vsh_mesh *mesh) {
    static const double identity[12] = {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    const double *t = mesh->transform != NULL ? mesh->transform : identity;
    for (size_t k = 0; k < mesh->triangle_count; ++k) {
        double p[3][3];
        for (int corner = 0; corner < 3; ++corner) {
            const float *v = mesh->positions + 3 * (size_t)mesh->indices[3 * k + (size_t)corner];
            for (int row = 0; row < 3; ++row) {
                p[corner][row] = t[4 * row] * (double)v[0] + t[4 * row + 1] * (double)v[1] +
                                 t[4 * row + 2] * (double)v[2] + t[4 * row + 3];
                s->low[row] = fmin(s->low[row], p[corner][row]);
                s->high[row] = fmax(s->high[row], p[corner][row]);
            }
        }
        double a[3], b[3];
        for (int row = 0; row < 3; ++row) {
            a[row] = p[1][row] - p[0][row];
            b[row] = p[2][row] - p[0][row];
        }
        const double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2],
                     z = a[0] * b[1] - a[1] * b[0];
        s->area += 0.5 * sqrt(x * x + y * y + z * z);
    }
    s->triangles += (double)mesh->triangle_count;
}

static bool is_traced(const vsh_scene *scene) {
    return (scene->light_count > 0 && scene->shade.method == VSH_SHADOW_EXACT) ||
           (scene->ao && scene->shade.ao_method == VSH_AO_EXACT);
}

static void expect_shape(const vsh_scene *scene, const vsh_assets *assets, double points) {
    shape s = {.low = {INFINITY, INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY, -INFINITY}};
    size_t others = 0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        size_t count = 0;
        const vsh_mesh *meshes = vsh_assets_caster(assets, i, &count);
        others += count == 0;
        for (size_t m = 0; m < count; ++m) {
            add_mesh(&s, &meshes[m]);
        }
    }
    double longest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        longest = fmax(longest, s.high[axis] - s.low[axis]);
    }
    const int32_t chosen = vsh_scene_resolution(scene, assets, NULL, points);
    const int32_t resolution = chosen != VSH_RESOLUTION_NAMED ? chosen : scene->grid.resolution;
    const double voxel = scene->grid.voxel_size > 0.0 ? scene->grid.voxel_size
                         : resolution > 0             ? longest / resolution
                                                      : longest / 256.0;
    double voxels = voxel > 0.0 ? s.area / (voxel * voxel) * band : 0.0;
    if (others > 0 && resolution > 0) {
        voxels += plain_area * band * pow(resolution, 2.0);
    }
    if (is_traced(scene)) {
        cli_progress_expect("triangles", CLI_ESTIMATE_SHAPE, s.triangles * traced_s);
    }
    if (chosen == 0) {
        return;
    }
    cli_progress_expect("voxelize", CLI_ESTIMATE_SHAPE, voxels * voxel_s + s.triangles * triangle_s);
    cli_progress_expect("field", CLI_ESTIMATE_SHAPE, voxels * field_voxel_s);
}

/* --- shade: microseconds of one core, a sample (bench/README.md) */

/* Adaptive methods: a part that all samples take, and one that grows as the error falls, to a limit of rays.
 */
static double refined(double all, double share, double error, double rays, double ray) {
    return all + fmin(share / fmax(error, 1e-4), rays * ray);
}

static double light_us(const vsh_shade_options *o) {
    switch (o->method) {
    case VSH_SHADOW_RAYS:
        return 0.2 * o->rays;
    case VSH_SHADOW_ADAPTIVE:
        return refined(0.5, 0.02, o->max_error, o->rays, 0.3);
    case VSH_SHADOW_EXACT:
        return refined(0.8, 0.009, o->max_error, o->rays, 0.1);
    default:
        return 0.45;
    }
}

static double ao_us(const vsh_shade_options *o) {
    switch (o->ao_method) {
    case VSH_AO_TAPS:
        return 1.1;
    case VSH_AO_CONES:
        return 0.4 + 0.075 * o->ao_cones;
    case VSH_AO_RAYS:
        return 0.25 * o->rays;
    case VSH_AO_ADAPTIVE:
        return refined(0.5, 0.06, o->max_error, o->rays, 0.25);
    default:
        return refined(0.5, 0.06, o->max_error, o->rays, 0.1);
    }
}

static const double chart_us = 0.13, texel_us = 0.15, padding_us = 0.1, seam_us = 0.05;
/* Of AO, what is estimated once all rays are shot. */
static const double estimate = 0.2;
/* Whether a sample is valid: by the field, or by rays. */
static const double valid_us = 0.25, traced_valid_us = 1.0;
/* Of a channel's texel, one thread. */
static const double write_us = 0.07;

static void expect_lightmap(const vsh_scene *scene, const vsh_job_lightmap *r, double threads) {
    const double texel = (double)r->covered * micro / threads, sample = (double)r->samples * micro / threads;
    const double valid = is_traced(scene) ? traced_valid_us : valid_us;
    const double shadows = sample * light_us(&scene->shade),
                 ao = scene->ao ? sample * ao_us(&scene->shade) : 0.0;
    cli_progress_expect("charts", CLI_ESTIMATE_SHADE, texel * chart_us);
    cli_progress_expect("bake", CLI_ESTIMATE_SHADE,
                        sample * (texel_us + valid) + (double)scene->light_count * shadows +
                            (1.0 - estimate) * ao);
    if (scene->ao) {
        cli_progress_expect("ao", CLI_ESTIMATE_SHADE, estimate * ao);
    }
    cli_progress_expect("padding", CLI_ESTIMATE_SHADE, texel * padding_us);
    const int32_t seams = scene->receivers[r->receiver].seams;
    if (seams == VSH_SEAMS_FIX || (seams == VSH_SEAMS_DEFAULT && vsh_lit_is_output(r->output))) {
        cli_progress_expect("seams", CLI_ESTIMATE_SHADE, texel * seam_us);
    }
    const double channels = (double)scene->light_count + (scene->ao ? 1.0 : 0.0) +
                            (scene->irradiance ? 3.0 : 0.0) + 4.0; /* A, and R, G, B */
    cli_progress_expect("write", CLI_ESTIMATE_FILE, (double)r->covered * channels * write_us * micro);
}

/* What auto comes to, and the rays that a value may take. */
static void resolve(vsh_shade_options *shade, int32_t traced) {
    shade->method = vsh_shadow_method_resolve(shade->method, traced);
    shade->ao_method = vsh_ao_method_resolve(shade->ao_method, traced);
    if (shade->rays == 0) {
        const bool all = shade->method == VSH_SHADOW_RAYS || shade->ao_method == VSH_AO_RAYS;
        shade->rays = all ? 64 : 4096;
    }
}

void cli_bake_expect(const vsh_scene *given, const vsh_bake_job *job, int32_t threads) {
    const long cores = sysconf(_SC_NPROCESSORS_ONLN);
    const double used = threads > 0 ? (double)threads : cores > 0 ? (double)cores : 1.0;
    vsh_scene scene = *given;
    resolve(&scene.shade, vsh_scene_traceable(given, NULL) && vsh_triangles_available());
    double points = 0.0;
    for (size_t i = 0; i < vsh_bake_job_count(job); ++i) {
        vsh_job_lightmap lightmap;
        vsh_bake_job_lightmap(job, i, &lightmap);
        points += (double)lightmap.samples;
    }
    expect_shape(&scene, vsh_bake_job_assets(job), points);
    for (size_t i = 0; i < vsh_bake_job_count(job); ++i) {
        vsh_job_lightmap lightmap;
        vsh_bake_job_lightmap(job, i, &lightmap);
        expect_lightmap(&scene, &lightmap, used);
    }
}
