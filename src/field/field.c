#include "field/level.h"

#include "base/floats.h"
#include "base/memory.h"
#include "geometry/mesh.h"
#include "trace/trace.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Voxel size of a field that has one value everywhere, finest voxels. */
#define CONSTANT_SCALE 0x1p60f

/* Default reach, diagonals of the bounds: enough for a light of 60° at receivers several diagonals away. */
static const double DEFAULT_REACH = 4.0;

void vshi_field_free(vsh_field *field) {
    if (field == NULL) {
        return;
    }
    vshi_triangles_free(field->surface);
    free(field->values);
    free(field->index);
    free(field);
}

/* Returns the reach in finest voxels. `reach` is in world units; 0 asks for the default. */
static double find_reach(const vsh_field *field, double reach) {
    double diagonal = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double edge = field->bounds_max[axis] - field->bounds_min[axis];
        diagonal += edge * edge;
    }
    return reach > 0.0 ? reach / field->voxel_size : DEFAULT_REACH * sqrt(diagonal);
}

/* World to index space of a similarity m: its transpose over the squared scale. */
static void invert(const double *m, double voxel_size, double inverse[12]) {
    const double s = 1.0 / (voxel_size * voxel_size);
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            inverse[4 * row + column] = s * m[4 * column + row];
        }
        inverse[4 * row + 3] =
            -(inverse[4 * row] * m[3] + inverse[4 * row + 1] * m[7] + inverse[4 * row + 2] * m[11]);
    }
}

/* Box of the lattice points next to the surface, field space. */
static bool find_bounds(vsh_field *field, const vshi_below *finest) {
    const vshi_level *level = &field->levels[0];
    int32_t low[3] = {INT32_MAX, INT32_MAX, INT32_MAX}, high[3] = {INT32_MIN, INT32_MIN, INT32_MIN};
    for (size_t i = 0; i < finest->brick_count; ++i) {
        const int8_t *box = finest->boxes + 6 * i;
        int32_t corner[3];
        vshi_block_corner(level->origin, level->size, (size_t)finest->bricks[i], corner);
        for (int axis = 0; axis < 3 && box[0] <= box[3]; ++axis) {
            const int32_t a = corner[axis] + box[axis], b = corner[axis] + box[3 + axis];
            low[axis] = a < low[axis] ? a : low[axis];
            high[axis] = b > high[axis] ? b : high[axis];
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        field->bounds_min[axis] = (float)low[axis];
        field->bounds_max[axis] = (float)high[axis];
    }
    return low[0] <= high[0];
}

/* Derives coarser levels, up to one that reaches so many finest voxels. `held`: bytes in use beside the
 * field. */
static vsh_result derive_levels(vsh_field *f, double reach, double held, const vsh_run *run, vshi_job *job,
                                vshi_below *below, vsh_error *error) {
    for (size_t units = 30; f->level_count < VSHI_MAX_LEVELS; units /= 2) {
        if (f->levels[f->level_count - 1].band >= reach) {
            break;
        }
        VSHI_TRY(
            vshi_level_derive(f, below, (vshi_field_budget){run, held + vshi_field_bytes(f)}, job, error));
        VSHI_TRY(vshi_job_step(job, units, error));
    }
    return VSH_OK;
}

vsh_result vshi_field_create(const vsh_grid *grid, const vshi_field_options *options, const vsh_run *run,
                             vsh_field **field, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(field);
    VSHI_NEEDS(grid);
    vshi_field_options o = vshi_field_options_default();
    vsh_run r;
    vshi_below below = {.bricks = NULL};
    vsh_field *f = NULL;
    o = options != NULL ? *options : o;
    VSHI_TRY(vshi_run_resolve(run, &r, error));
    if (!(o.reach >= 0.0 && !isinf(o.reach))) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "reach %g: expected a length, 0 or more", o.reach);
    }
    if (!(o.grown >= 0.0 && o.grown <= 1.0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "field: grown %g: expected 0 … 1 voxels", o.grown);
    }

    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    /* each level has a quarter of the work of the one below */
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, &r, "field", 100, "field", error));
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&f, 1, sizeof *f, "field", error));
    f->voxel_size = info.voxel_size;
    f->grown = o.grown;
    f->shell_thickness = info.shell_thickness;
    f->active_voxels = info.active_voxels;
    memcpy(f->world_min, info.bounds_min, sizeof f->world_min);
    memcpy(f->world_max, info.bounds_max, sizeof f->world_max);
    invert(info.transform, info.voxel_size, f->to_field);

    const float band = (float)fmin(info.half_width, VSHI_COARSE_BAND);
    VSHI_TRY_DONE(
        vshi_level_read(f, grid, band, (vshi_field_budget){&r, (double)info.bytes}, job, &below, error));
    if (!find_bounds(f, &below)) {
        result = vshi_fail(error, VSH_ERROR_INPUT, "field: the level set has no surface");
        goto done;
    }
    vshi_job_advance(job, 40);
    VSHI_TRY_DONE(derive_levels(f, find_reach(f, o.reach), (double)info.bytes, &r, job, &below, error));
    if (o.surface != 0) {
        const vshi_field_budget budget = {&r, (double)info.bytes + vshi_field_bytes(f)};
        VSHI_TRY_DONE(vshi_field_add_surface(f, budget, job, error));
    }
    *field = f;
    f = NULL;
done:
    vshi_below_free(&below);
    vshi_field_free(f);
    vshi_job_end(job);
    return result;
}

/* Makes a field of one level, with voxels wider than any scene: 2³ blocks around the origin share one brick,
 * whose values are the band (`free`) or 0. */
static vsh_result create_constant(double voxel_size, float band, bool free, vsh_field **field,
                                  vsh_error *error) {
    enum { BLOCKS = 8 };
    *field = NULL;
    if (!(voxel_size >= 1e-12 && voxel_size <= 1e12)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "voxel_size %g is out of range 1e-12 … 1e12", voxel_size);
    }
    vsh_field *f = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&f, 1, sizeof *f, "field", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&f->index, BLOCKS, sizeof *f->index, "field", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&f->values, VSHI_BRICK_VALUES, sizeof *f->values, "field", error));
    vshi_blocks blocks = {.scale = CONSTANT_SCALE};
    vshi_blocks_set_band(&blocks, band);
    for (int v = 0; v < VSHI_BRICK_VALUES; ++v) {
        f->values[v] = free ? blocks.most : 0;
    }
    f->voxel_size = voxel_size;
    f->value_count = VSHI_BRICK_VALUES;
    f->level_count = 1;
    f->levels[0] = (vshi_level){.origin = {-VSHI_BRICK_CELLS, -VSHI_BRICK_CELLS, -VSHI_BRICK_CELLS},
                                .size = {2, 2, 2},
                                .brick_count = 1,
                                .scale = blocks.scale,
                                .band = blocks.band,
                                .quantum = blocks.quantum,
                                .rounding = free ? 0.5f * blocks.quantum : 0.0f};
    for (int axis = 0; axis < 3; ++axis) {
        f->to_field[5 * axis] = 1.0 / voxel_size;
    }
    *field = f;
    f = NULL;
done:
    vshi_field_free(f);
    return result;
}

vsh_result vshi_field_create_empty(double voxel_size, vsh_field **field, vsh_error *error) {
    VSHI_TRY(create_constant(voxel_size, VSHI_COARSE_BAND * CONSTANT_SCALE, true, field, error));
    for (int axis = 0; axis < 3; ++axis) {
        (*field)->bounds_min[axis] = INFINITY; /* an empty box, which no cone meets */
        (*field)->bounds_max[axis] = -INFINITY;
    }
    return VSH_OK;
}

vsh_result vshi_field_create_unknown(double voxel_size, const double low[3], const double high[3],
                                     vsh_field **field, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_TRY(create_constant(voxel_size, CONSTANT_SCALE, false, field, error));
    vsh_field *f = *field;
    f->unknown = true;
    for (int axis = 0; axis < 3; ++axis) {
        /* centred on 0, like a level set of the same casters, because positions become floats */
        const double middle = round((low[axis] + 0.5 * (high[axis] - low[axis])) / voxel_size);
        f->to_field[4 * axis + 3] = -middle;
        f->world_min[axis] = low[axis];
        f->world_max[axis] = high[axis];
        f->bounds_min[axis] = (float)(low[axis] / voxel_size - middle);
        f->bounds_max[axis] = (float)(high[axis] / voxel_size - middle);
    }
    return VSH_OK;
}

/* Closer to the end of a level's band than this, voxels of the level, the next level gives the gradient:
 * corners that are clamped to the band would turn it. */
static const float GRADIENT_ROOM = 1.0f;

static void level_gradient(const vsh_field *field, int32_t l, const float p[3], float gradient[3]) {
    if (l == 0) {
        vshi_level_sample(field, 0, p, gradient);
        return;
    }
    /* a coarse cell's own gradient has the errors of its corners: 14° beside a sphere, 2° with this */
    const float step = 0.5f * field->levels[l].scale;
    for (int axis = 0; axis < 3; ++axis) {
        float low[3] = {p[0], p[1], p[2]}, high[3] = {p[0], p[1], p[2]};
        low[axis] -= step;
        high[axis] += step;
        gradient[axis] = vshi_level_sample(field, l, high, NULL) - vshi_level_sample(field, l, low, NULL);
    }
}

/* Lower bound of |distance| from a coarse level's sample `h`, finest voxels. */
static float coarse_bound(const vshi_level *level, float h) {
    const float size = fabsf(h) / level->scale, node = h < 0.0f ? 2.0f * VSHI_NODE : VSHI_NODE;
    const float clear = size - VSHI_SLACK;
    const float error = clear * VSHI_SLACK > VSHI_CURVATURE ? VSHI_CURVATURE / clear : VSHI_SLACK;
    return (size - error - node) * level->scale - level->rounding;
}

float vshi_field_lower_bound(const vsh_field *field, const float p[3], float gradient[3]) {
    float bound = 0.0f, sign = 0.0f;
    int32_t steep = 0; /* level of the gradient */
    bool saturated = true;
    for (int32_t l = 0; l < field->level_count && saturated; ++l) {
        const vshi_level *level = &field->levels[l];
        const float h = vshi_level_sample(field, l, p, NULL);
        sign = l == 0 ? h : sign;
        bound = l == 0 ? fabsf(h) : fmaxf(bound, coarse_bound(level, h));
        saturated = vshi_level_saturated(level, h);
        steep =
            fabsf(h) > level->band - GRADIENT_ROOM * level->scale && l + 1 < field->level_count ? l + 1 : l;
    }
    if (gradient != NULL && saturated) {
        gradient[0] = gradient[1] = gradient[2] = 0.0f;
    } else if (gradient != NULL) {
        level_gradient(field, steep, p, gradient);
    }
    return copysignf(bound, sign);
}

void vsh_field_sample(const vsh_field *field, size_t count, const double *positions, float *distances) {
    VSHI_FLOATS;
    for (size_t i = 0; i < count; ++i) {
        const vshi_vec p = vshi_to_field(field, positions + 3 * i);
        const float at[3] = {(float)p.x, (float)p.y, (float)p.z};
        const float h = vshi_field_lower_bound(field, at, NULL);
        distances[i] = vshi_finite(p) && !field->unknown ? (float)((double)h * field->voxel_size) : NAN;
    }
}

void vsh_field_get_info(const vsh_field *field, vsh_field_info *info) {
    VSHI_FLOATS;
    const vshi_level *top = &field->levels[field->level_count - 1];
    uint64_t bricks = 0;
    for (int32_t l = 0; l < field->level_count; ++l) {
        bricks += field->levels[l].brick_count;
    }
    vsh_field_info found = {
        .voxel_size = field->voxel_size,
        .reach = top->band * field->voxel_size,
        .shell_thickness = field->shell_thickness,
        .levels = field->level_count,
        .bricks = bricks,
        .bytes = (uint64_t)vshi_field_bytes(field) +
                 (field->surface != NULL ? vshi_triangles_bytes(field->surface) : 0),
        .active_voxels = field->active_voxels,
    };
    memcpy(found.bounds_min, field->world_min, sizeof found.bounds_min);
    memcpy(found.bounds_max, field->world_max, sizeof found.bounds_max);
    *info = found;
}

/* --- lost casters: parts thinner than voxels, with no voxel's centre inside. The field is negative within a
 * voxel of a surface that it holds, along the normal. So it is sampled there, at places all over a mesh, each
 * for the same area. A slab that is 1.25 voxels thick has a voxel's centre an eighth of a voxel under its
 * surface, wherever it lies. */

/* Sampled places of all meshes together, and least number of each mesh; samples to each side of a place. */
enum { PLACES = 16384, LEAST = 64, STEPS = 5 };
/* Greatest distance of a sample from the surface, voxels. Both sides are sampled, as faces may be flipped. */
static const double DEPTH = 1.25;
/* Distance from the surface at which rays to the other side begin, share of DEPTH. */
static const double NEAR = 1e-4;
static const double GOLDEN = 0.61803398874989485, SILVER = 0.41421356237309515;

/* Sum of the triangles' areas. */
static double mesh_area(const vsh_mesh *mesh) {
    double area = 0.0;
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        vshi_vec corner[3];
        vshi_mesh_triangle(mesh, i, corner);
        area += vshi_mesh_degenerate(mesh, i) ? 0.0 : vshi_triangle_area(corner);
    }
    return area;
}

static double fraction(double x) {
    return x - floor(x);
}

static bool holds(const vsh_field *field, vshi_vec place, vshi_vec normal) {
    for (int step = -STEPS; step <= STEPS; ++step) {
        const double height = DEPTH * field->voxel_size * step / STEPS;
        const vshi_vec world = vshi_add(place, vshi_scale(normal, height));
        const vshi_vec p = vshi_to_field(field, (const double[]){world.x, world.y, world.z});
        if (vshi_field_distance(field, (const float[]){(float)p.x, (float)p.y, (float)p.z}) <= 0.0f) {
            return true;
        }
    }
    return false;
}

/* Thickness of a solid under a place, world units: infinite for a sheet, which has no other side. Negative if
 * it is too thick for voxels to lose: then they only cut an edge. */
static double find_thickness(const vsh_field *field, const vshi_triangles *triangles, vshi_vec place,
                             vshi_vec normal) {
    const double thin = DEPTH * field->voxel_size;
    double nearest = INFINITY;
    for (int side = -1; side <= 1; side += 2) {
        const vshi_vec d = vshi_scale(normal, side), from = vshi_add(place, vshi_scale(d, NEAR * thin));
        const vshi_segment_ray ray = {{from.x, from.y, from.z}, {d.x, d.y, d.z}, INFINITY};
        nearest = fmin(nearest, vshi_triangles_distance(triangles, &ray));
    }
    return nearest <= thin || isinf(nearest) ? nearest : -1.0;
}

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Samples `places` places of a mesh; `thickness` has room for as many. */
static void sample_mesh(const vsh_field *field, const vsh_mesh *mesh, double area, size_t places,
                        const vshi_triangles *triangles, double *thickness, vshi_lost *lost) {
    if (mesh->mask != NULL) { /* a sheet: voxels hold it as a shell */
        return;
    }
    double before = 0.0;
    size_t next = 0, gone = 0, measured = 0;
    for (size_t i = 0; i < mesh->triangle_count && next < places; ++i) {
        vshi_vec corner[3];
        if (vshi_mesh_degenerate(mesh, i)) {
            continue;
        }
        vshi_mesh_triangle(mesh, i, corner);
        before += vshi_triangle_area(corner);
        const vshi_vec normal = vshi_unit(vshi_triangle_normal(corner));
        for (; next < places && ((double)next + 0.5) / (double)places * area <= before; ++next) {
            const vshi_vec at =
                vshi_triangle_point(corner, fraction((double)next * GOLDEN), fraction((double)next * SILVER));
            if (holds(field, at, normal)) {
                continue;
            }
            const double thick = triangles != NULL ? find_thickness(field, triangles, at, normal) : INFINITY;
            if (thick < 0.0) {
                continue;
            }
            ++gone;
            if (isfinite(thick)) {
                thickness[measured++] = thick;
            }
        }
    }
    lost->share = (double)gone / (double)places;
    qsort(thickness, measured, sizeof *thickness, by_value);
    lost->thickness = measured > 0 ? thickness[measured / 10] : 0.0;
}

vsh_result vshi_field_find_lost(const vsh_field *field, const vsh_mesh *meshes, size_t mesh_count,
                                const vshi_triangles *triangles, vshi_lost *lost, vsh_error *error) {
    double sum = 0.0;
    for (size_t m = 0; m < mesh_count; ++m) {
        sum += mesh_area(&meshes[m]);
    }
    void *thickness = NULL;
    VSHI_TRY(vshi_allocate(&thickness, PLACES + LEAST, sizeof(double), "lost casters", error));
    for (size_t m = 0; m < mesh_count; ++m) {
        const double area = mesh_area(&meshes[m]);
        const size_t places = LEAST + (size_t)(sum > 0.0 ? PLACES * (area / sum) : 0.0);
        vshi_lost found = {0.0, 0.0};
        if (area > 0.0) {
            sample_mesh(field, &meshes[m], area, places, triangles, thickness, &found);
        }
        lost[m] = found;
    }
    free(thickness);
    return VSH_OK;
}
