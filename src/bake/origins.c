#include "bake/origins.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "heightfield/heights.h"
#include "shade/inside.h"
#include "shade/kernel/march.h"
#include "shade/layers.h"
#include "spheres/spheres.h"
#include "trace/embree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where a sample is looked at for whether it is free: a voxel above its surface, which is as much as the
 * field tells apart. Touching solids keep their inner surfaces in a mesh's level set, so under a box that
 * stands on a floor the distance falls by no more than the height. */
static const double PROBE_HEIGHT = 1.0;
/* What is nearer than this at the probe, in its heights, is another surface: a sample in a crease, where the
 * field may be off by more than a start offset clears. Its rays begin at the probe. */
static const double CREASE = 0.75;
/* And nearer than this, which is all that a start offset clears, it may as well be within: the field is no
 * better known. On the cloister 1.4 % of the samples are so near; one in twelve is buried, reads up to 1
 * where it should be 0, and those made two thirds of AO's squared error. */
static const double CLEAR = 0.25;

/* A field that samples are looked at in. */
typedef struct looked_at {
    const vsh_field *field;
    double probe; /* world units: how far above its surface a sample is looked at for whether it is free */
    double shell; /* world units, open meshes on top of it */
    const vsh_triangles *triangles; /* its casters', where rays are traced against them; else NULL */
    bool marched;                   /* it is looked at itself: methods march it, or there are no triangles */
} looked_at;

typedef struct lifting {
    const vsh_texels *texels;
    vshi_origins *origins;
    double offset; /* world units, all meshes */
    size_t field_count;
    looked_at fields[1 + VSH_MAX_LAYERS]; /* that of the bake, then those of its layers */
    size_t solid_count;
    const vsh_heights *heights[VSH_MAX_LAYERS]; /* layers without a field: one of these two */
    const vsh_spheres *spheres[VSH_MAX_LAYERS];
    const vshi_kernel *kernel;
    uint8_t
        *crease; /* [samples]: 0, or 1 + the field in whose crease a sample lies, that of the highest probe */
} lifting;

static size_t block_end(const lifting *l, size_t block) {
    const size_t end = (block + 1) * VSHI_ORIGIN_BLOCK;
    return end < l->texels->count ? end : l->texels->count;
}

static void put(vshi_vec p, double at[3]) {
    at[0] = p.x;
    at[1] = p.y;
    at[2] = p.z;
}

static void lift(const lifting *l, size_t i, double offset, double shell, double origin[3]) {
    const vsh_texels *texels = l->texels;
    const double height = offset + (vshi_sample_is_sheet(texels, i) ? shell : 0.0);
    const vshi_vec p = vshi_sample_foot(texels, i);
    const double at[3] = {p.x, p.y, p.z};
    for (size_t k = 0; k < 3; ++k) {
        origin[k] = at[k] + height * (double)texels->geometric[3 * i + k];
    }
}

/* Where a sample is looked at in a field, in its space. */
static void probe(const lifting *l, const looked_at *in, size_t i, float at[3]) {
    double origin[3];
    lift(l, i, in->probe, in->shell, origin);
    const vshi_vec p = vshi_to_field(in->field, origin);
    at[0] = (float)p.x;
    at[1] = (float)p.y;
    at[2] = (float)p.z;
}

/* Samples that are looked at together follow each other in a tile, at most so many: whatever the band, they
 * are the same. */
enum { TOGETHER = 64 };

/* Looks at samples first … last - 1, which belong together, in a field that decides. */
static void look(const lifting *l, size_t field, size_t first, size_t last) {
    const looked_at *in = &l->fields[field];
    const float radius = (float)(CREASE * in->probe / in->field->voxel_size);
    float at[3][TOGETHER];
    float *const centres[3] = {at[0], at[1], at[2]};
    bool is_free[TOGETHER];
    for (size_t i = first; i < last; ++i) {
        float p[3];
        probe(l, in, i, p);
        for (size_t k = 0; k < 3; ++k) {
            at[k][i - first] = p[k];
        }
    }
    l->kernel->balls(in->field, last - first, centres, radius, is_free);
    for (size_t i = first; i < last; ++i) {
        const size_t k = i - first;
        if (is_free[k]) {
            continue;
        }
        const double distance =
            in->field->voxel_size *
            (double)vshi_field_distance(in->field, (float[]){at[0][k], at[1][k], at[2][k]});
        l->origins->valid[i] = l->origins->valid[i] && distance >= CLEAR * in->probe;
        const uint8_t crease = l->crease[i];
        if (distance < CREASE * in->probe && (crease == 0 || in->probe > l->fields[crease - 1].probe)) {
            l->crease[i] = (uint8_t)(field + 1);
        }
    }
}

/* Samples that are traced, from `first` on. */
typedef struct tracing {
    const lifting *lifting;
    const looked_at *in;
    size_t first;
} tracing;

/* A vshi_open_fn: no surface is near but the sample's own, and what is within a solid the field knows. */
static bool is_open(const void *user, size_t i) {
    const tracing *t = user;
    float at[3];
    probe(t->lifting, t->in, t->first + i, at);
    return t->in->field->voxel_size * (double)vshi_field_distance(t->in->field, at) >= CREASE * t->in->probe;
}

static bool same_tile(const vsh_texels *texels, size_t i, size_t k) {
    return ((texels->texel[i] ^ texels->texel[k]) & ~0x00070007u) == 0;
}

/* Behind the samples that are looked at together from `first` on. */
static size_t together_end(const vsh_texels *texels, size_t first) {
    size_t end = first + 1;
    while (end < texels->count && end - first < TOGETHER && same_tile(texels, end, first)) {
        ++end;
    }
    return end;
}

/* The first sample from i on with which others begin to be looked at together. */
static size_t together_begin(const vsh_texels *texels, size_t i) {
    size_t first = i;
    while (first > 0 && same_tile(texels, first - 1, i)) {
        --first;
    }
    const size_t begin = i - (i - first) % TOGETHER;
    return begin == i ? i : together_end(texels, begin);
}

/* Whether the point is inside a solid, by a ray along `way` from a little behind it. */
static bool is_solid_behind(const vsh_triangles *triangles, const vshi_segment_ray *ray) {
    vshi_segment_ray behind = *ray;
    for (size_t axis = 0; axis < 3; ++axis) {
        behind.origin[axis] += ray->far * ray->direction[axis];
    }
    behind.far = INFINITY;
    return vshi_triangles_depth(triangles, &behind) > 0;
}

/* Leaves out valid samples first … last - 1 that lie on another face. If that crosses the sample's plane,
 * every ray meets it at once: a short ray in the plane, across the sample, finds it. If it lies in the plane,
 * as that of a floor under a box, every ray begins behind it: a short ray back through the sample finds it.
 * Both sides of a card also lie in one plane, but have no solid between them. */
static void leave_out_touching(const lifting *l, const vsh_triangles *triangles, size_t first, size_t last) {
    static const double ACROSS[2] = {0.7648, 0.6442}; /* along no axis, and no edge that people build */
    static const double NEAR = 0.25; /* of the lift: 16 roundings of a float; a wider gap is a gap */
    const double lift = vshi_triangles_lift(triangles), near = NEAR * lift;
    vshi_segment_ray across[TOGETHER], back[TOGETHER];
    size_t of[TOGETHER], count = 0;
    bool crossed[TOGETHER], covered[TOGETHER];
    for (size_t i = first; i < last; ++i) {
        if (l->origins->valid[i]) {
            const vshi_vec normal = vshi_vec_off(l->texels->geometric + 3 * i);
            const vshi_vec foot = vshi_sample_foot(l->texels, i), down = vshi_scale(normal, -1.0);
            vshi_vec u, v;
            vshi_frame(normal, &u, &v);
            const vshi_vec d = vshi_unit(vshi_add(vshi_scale(u, ACROSS[0]), vshi_scale(v, ACROSS[1])));
            const vshi_vec p = vshi_add(foot, vshi_sub(vshi_scale(normal, lift), vshi_scale(d, 0.5 * lift)));
            const vshi_vec q = vshi_add(foot, vshi_scale(normal, near));
            across[count] = (vshi_segment_ray){{p.x, p.y, p.z}, {d.x, d.y, d.z}, lift};
            back[count] = (vshi_segment_ray){{q.x, q.y, q.z}, {down.x, down.y, down.z}, 2.0 * near};
            of[count++] = i;
        }
    }
    vshi_triangles_blocked(triangles, across, count, crossed);
    vshi_triangles_meet_backs(triangles, back, count, covered);
    for (size_t k = 0; k < count; ++k) {
        l->origins->valid[of[k]] = !crossed[k] && !(covered[k] && is_solid_behind(triangles, &back[k]));
    }
}

/* Looks at samples first … last - 1, which belong together, by rays against a field's triangles. */
static void trace(const lifting *l, const looked_at *in, size_t first, size_t last) {
    double at[3 * TOGETHER];
    uint8_t where[TOGETHER];
    bool follows[TOGETHER];
    size_t i = first;
    do { /* there is one */
        put(vshi_sample_foot(l->texels, i), at + 3 * (i - first));
        follows[i - first] =
            i > first && !vshi_sample_is_border(l->texels, i) && !vshi_sample_is_border(l->texels, i - 1);
    } while (++i < last);
    const tracing task = {l, in, first};
    vshi_inside(in->triangles, last - first, at, l->texels->geometric + 3 * first, follows, is_open, &task,
                where);
    for (i = first; i < last; ++i) {
        if (where[i - first] != VSHI_OUTSIDE) {
            l->origins->valid[i] = 0;
        }
    }
    leave_out_touching(l, in->triangles, first, last);
}

/* Samples within a heightfield or a sphere that are none of their surfaces. */
static void look_at_solid(const lifting *l, size_t solid, size_t first, size_t last) {
    for (size_t i = first; i < last; ++i) {
        double at[3];
        put(vshi_sample_foot(l->texels, i), at);
        const bool held = l->heights[solid] != NULL ? vshi_heights_hold(l->heights[solid], at)
                                                    : vshi_spheres_hold(l->spheres[solid], at);
        l->origins->valid[i] = l->origins->valid[i] && !held;
    }
}

static void validate_together(const lifting *l, size_t first, size_t last) {
    memset(l->origins->valid + first, 1, last - first);
    for (size_t field = 0; field < l->field_count; ++field) {
        if (l->fields[field].triangles != NULL) {
            trace(l, &l->fields[field], first, last);
        }
        if (l->fields[field].marched) {
            look(l, field, first, last);
        }
    }
    for (size_t solid = 0; solid < l->solid_count; ++solid) {
        look_at_solid(l, solid, first, last);
    }
}

/* Those that begin in the blocks. */
static void validate(void *user, size_t begin, size_t end) {
    const lifting *l = user;
    const size_t last = end > begin ? block_end(l, end - 1) : 0;
    for (size_t i = begin < end ? together_begin(l->texels, begin * VSHI_ORIGIN_BLOCK) : last, next; i < last;
         i = next) {
        next = together_end(l->texels, i);
        validate_together(l, i, next);
    }
}

/* Valid samples that are not needed are left out; the rest are counted. */
static vsh_result keep_needed(const lifting *l, vshi_origins_keep *keep, void *user, vsh_error *error) {
    vshi_origins *origins = l->origins;
    const vsh_texels *texels = l->texels;
    const size_t rows = texels->band.held_end - texels->band.held_begin;
    VSHI_TRY(vshi_allocate((void **)&origins->needed, rows, 1, "lightmap rows", error));
    memset(origins->needed, VSHI_ROW_WANTED, rows);
    VSHI_TRY(keep(user, origins, origins->needed, error));
    for (size_t row = 0; row < rows; ++row) {
        if (origins->needed[row] == VSHI_ROW_LEFT_OUT &&
            texels->row_start[row + 1] > texels->row_start[row]) {
            const size_t first = texels->row_start[row];
            memset(origins->valid + first, 0, texels->row_start[row + 1] - first);
        }
    }
    for (size_t i = 0; i < texels->count; ++i) {
        origins->before[i / VSHI_ORIGIN_BLOCK] += origins->valid[i];
    }
    return VSH_OK;
}

/* Samplers tell points apart by it: the texel, and for the further samples of a texel a place some
 * way off, so that they do not all send their rays the same way. */
static uint32_t sampler_texel(const vsh_texels *texels, size_t i) {
    static const uint32_t COLUMN_STEP = 47, ROW_STEP = 29;
    const uint32_t texel = texels->texel[i];
    uint32_t sample = 0;
    for (size_t k = i; k > 0 && texels->texel[k - 1] == texel; --k) {
        ++sample;
    }
    return vsh_texel((vsh_texel_column(texel) + COLUMN_STEP * sample) & 0xffff,
                     (vsh_texel_row(texel) + ROW_STEP * sample) & 0xffff);
}

static void pack(void *user, size_t begin, size_t end) {
    const lifting *l = user;
    vshi_origins *origins = l->origins;
    for (size_t block = begin; block < end; ++block) {
        size_t next = origins->before[block];
        for (size_t i = block * VSHI_ORIGIN_BLOCK; i < block_end(l, block); ++i) {
            if (origins->valid[i]) {
                const uint8_t crease = l->crease[i];
                lift(l, i, crease > 0 ? l->fields[crease - 1].probe : l->offset, l->fields[0].shell,
                     origins->position + 3 * next);
                memcpy(origins->normal + 3 * next, l->texels->normal + 3 * i, 3 * sizeof(float));
                if (origins->face != NULL) {
                    memcpy(origins->face + 3 * next, l->texels->geometric + 3 * i, 3 * sizeof(float));
                }
                origins->texel[next] = sampler_texel(l->texels, i);
                ++next;
            }
        }
    }
}

/* Where the tile rows begin among the valid samples. */
static void find_rows(const vsh_texels *texels, vshi_origins *origins) {
    const vshi_band *band = &texels->band;
    const size_t rows = band->held_end - band->held_begin;
    for (size_t row = 0; row <= rows; ++row) {
        const size_t sample = texels->row_start[row], block = sample / VSHI_ORIGIN_BLOCK;
        origins->row_start[row] = origins->before[block];
        for (size_t i = block * VSHI_ORIGIN_BLOCK; i < sample; ++i) {
            origins->row_start[row] += origins->valid[i];
        }
    }
    origins->rows = (vshi_point_rows){.count = rows,
                                      .start = origins->row_start,
                                      .first = band->own_begin - band->held_begin,
                                      .last = band->own_end - band->held_begin};
}

static void look_in(lifting *l, const vsh_field *field, const vsh_triangles *triangles, int32_t method,
                    int32_t ao_method, vshi_origins_for what) {
    const bool traced = triangles != NULL;
    const bool marched = (what.lights && vsh_shadow_method_resolve(method, traced) != VSH_SHADOW_EXACT) ||
                         (what.ao && vsh_ao_method_resolve(ao_method, traced) != VSH_AO_EXACT);
    l->fields[l->field_count++] = (looked_at){.field = field,
                                              .probe = fmax(l->offset, PROBE_HEIGHT * field->voxel_size),
                                              .shell = 0.5 * field->shell_thickness,
                                              .triangles = triangles,
                                              .marched = marched || triangles == NULL};
}

double vshi_origins_sample_bytes(bool traced, bool smooth) {
    return 2.0 + (traced || smooth ? 6.0 : 3.0) * sizeof(double) + (smooth ? 7.0 : 4.0) * sizeof(float);
}

vsh_result vshi_origins_create(const vsh_occluders *occluders, const vsh_texels *texels,
                               const vsh_shade_options *options, vshi_origins_for what,
                               vshi_origins_keep *keep, void *user, const vsh_run *run, vshi_origins *origins,
                               vsh_error *error) {
    const char *name = "lightmap samples";
    *origins = (vshi_origins){.blocks = (texels->count + VSHI_ORIGIN_BLOCK - 1) / VSHI_ORIGIN_BLOCK};
    lifting l = {.texels = texels,
                 .origins = origins,
                 .kernel = vshi_kernel_of(run->isa),
                 .offset = options->start_offset * occluders->field->voxel_size + options->surface_offset};
    look_in(&l, occluders->field, occluders->triangles, options->method, options->ao_method, what);
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        const vsh_layer *layer = &occluders->layers[i];
        if (layer->field != NULL) {
            const int32_t method = layer->method < 0 ? options->method : layer->method;
            const vshi_origins_for here = {what.lights && !vshi_layer_is_closed(layer),
                                           what.ao && layer->ao != 0};
            look_in(&l, layer->field, layer->triangles, method, options->ao_method, here);
        } else {
            l.heights[l.solid_count] = layer->heights;
            l.spheres[l.solid_count++] = layer->spheres;
        }
    }
    vsh_result result;
    vshi_job *job = vshi_job_begin(run, "validate", 2 * origins->blocks);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", name);
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&origins->valid, texels->count, 1, name, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&l.crease, texels->count, 1, name, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&origins->before, origins->blocks + 1, sizeof(size_t), name, error));
    VSHI_TRY_DONE(vshi_parallel_for(job, origins->blocks, 1, 1, validate, &l, error));
    VSHI_TRY_DONE(keep_needed(&l, keep, user, error));
    for (size_t block = 0; block <= origins->blocks; ++block) {
        const size_t valid = origins->before[block];
        origins->before[block] = origins->count;
        origins->count += valid;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&origins->row_start,
                                texels->band.held_end - texels->band.held_begin + 1, sizeof(size_t), name,
                                error));
    find_rows(texels, origins);
    VSHI_TRY_DONE(
        vshi_allocate((void **)&origins->position, origins->count, 3 * sizeof(double), name, error));
    const bool starts = texels->smooth || vshi_shadow_traces(options, occluders->triangles) ||
                        vshi_ao_traces(options, occluders->triangles);
    VSHI_TRY_DONE(vshi_allocate((void **)&origins->start, starts ? origins->count : 0, 3 * sizeof(double),
                                name, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&origins->texel, origins->count, sizeof(uint32_t), name, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&origins->normal, origins->count, 3 * sizeof(float), name, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&origins->face, texels->smooth ? origins->count : 0,
                                3 * sizeof(float), name, error));
    VSHI_TRY_DONE(vshi_parallel_for(job, origins->blocks, 1, 1, pack, &l, error));
done:
    free(l.crease);
    vshi_job_end(job);
    return result;
}

/* --- where shadow rays begin */

typedef struct starting {
    const vshi_lifter *lifter;
    const vsh_texels *texels;
    vshi_origins *origins;
    bool traced;
} starting;

static void place_starts(void *user, size_t begin, size_t end) {
    const starting *a = user;
    const vsh_texels *texels = a->texels;
    const vshi_origins *origins = a->origins;
    for (size_t block = begin; block < end; ++block) {
        size_t next = origins->before[block];
        const size_t last = (block + 1) * VSHI_ORIGIN_BLOCK;
        for (size_t i = block * VSHI_ORIGIN_BLOCK; i < last && i < texels->count; ++i) {
            if (!origins->valid[i]) {
                continue;
            }
            const vshi_lift_point point = vshi_sample_lift_point(texels, i);
            const vshi_vec base = a->traced ? point.foot : vshi_vec_of(origins->position + 3 * next);
            put(vshi_add(base, vshi_lift_find(a->lifter, &point)), origins->start + 3 * next++);
        }
    }
}

vsh_result vshi_origins_lift(const vshi_lifter *lifter, const vsh_texels *texels, bool traced,
                             const vsh_run *run, vshi_origins *origins, vsh_error *error) {
    starting task = {lifter, texels, origins, traced};
    vshi_job *job = vshi_job_begin(run, "lift", origins->blocks);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "lift: the system refused memory");
    }
    const vsh_result result = vshi_parallel_for(job, origins->blocks, 1, 1, place_starts, &task, error);
    vshi_job_end(job);
    return result;
}

void vshi_origins_free(vshi_origins *origins) {
    free(origins->face);
    free(origins->normal);
    free(origins->texel);
    free(origins->start);
    free(origins->position);
    free(origins->needed);
    free(origins->row_start);
    free(origins->before);
    free(origins->valid);
    *origins = (vshi_origins){0};
}
