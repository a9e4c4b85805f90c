/* Which samples of a tile are valid, and where their rays begin. */
#include "base/memory.h"
#include "lightmap/page.h"
#include "shade/ao.h"
#include "shade/kernel/march.h"
#include "shade/shadow.h"
#include "trace/trace.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Height, voxels, at which a sample is tested: a voxel, the resolution of the field. Touching solids keep
 * their inner surfaces in a mesh's level set. So under a box on a floor the distance falls by no more than
 * the height. */
static const double PROBE_HEIGHT = 1.0;
/* A closer surface at the probe, as a share of its height, is another one. The sample lies in a crease, where
 * the field may err by more than a start offset clears. Its rays begin at the probe. */
static const double CREASE = 0.75;
/* Even closer, which is all that a start offset clears, the sample counts as inside: the field is not known
 * better. On the cloister 1.4 % of the samples are so close. One in twelve of these is buried and reads up to
 * 1 instead of 0. They made two thirds of AO's squared error. */
static const double CLEAR = 0.25;

/* The samples of a tile under way. */
typedef struct lifting {
    const vshi_placement *placement;
    const vshi_samples *samples;
    vshi_origins *origins;
} lifting;

static void lift(const lifting *l, size_t i, double offset, double shell, double origin[3]) {
    const vshi_samples *samples = l->samples;
    const double height = offset + ((samples->mesh[i] & VSHI_SAMPLE_SHEET) != 0 ? shell : 0.0);
    const vshi_vec p = vshi_sample_foot(samples, i);
    const double at[3] = {p.x, p.y, p.z};
    for (size_t k = 0; k < 3; ++k) {
        origin[k] = at[k] + height * (double)samples->geometric[3 * i + k];
    }
}

/* The probe of a sample in a field, in its space. */
static vshi_vec probe(const lifting *l, const vshi_probed_field *in, size_t i) {
    double origin[3];
    lift(l, i, in->probe, in->shell, origin);
    return vshi_to_field(in->field, origin);
}

/* At most this many samples of a cell are tested together. */
enum { TOGETHER = 64 };

/* Tests samples first … last - 1 together, in a field that decides. */
static void test_in_field(const lifting *l, size_t field, size_t first, size_t last) {
    const vshi_probed_field *in = &l->placement->fields[field];
    const float radius = (float)(CREASE * in->probe / in->field->voxel_size);
    float at[3][TOGETHER];
    float *const centres[3] = {at[0], at[1], at[2]};
    bool is_free[TOGETHER];
    for (size_t i = first; i < last; ++i) {
        const vshi_vec p = probe(l, in, i);
        at[0][i - first] = (float)p.x;
        at[1][i - first] = (float)p.y;
        at[2][i - first] = (float)p.z;
    }
    l->placement->kernel->balls(in->field, last - first, centres, radius, is_free);
    for (size_t i = first; i < last; ++i) {
        const size_t k = i - first;
        if (is_free[k]) {
            continue;
        }
        const double distance =
            in->field->voxel_size *
            (double)vshi_field_distance(in->field, (float[]){at[0][k], at[1][k], at[2][k]});
        l->origins->valid[i] = l->origins->valid[i] && distance >= CLEAR * in->probe;
        const uint8_t crease = l->origins->crease[i];
        if (distance < CREASE * in->probe &&
            (crease == 0 || in->probe > l->placement->fields[crease - 1].probe)) {
            l->origins->crease[i] = (uint8_t)(field + 1);
        }
    }
}

/* The end of the samples that are tested together from `first` on: those of a cell. */
static size_t together_end(const vshi_samples *samples, size_t first) {
    const uint32_t *texel = samples->texel;
    size_t end = first + 1;
    while (end < samples->count && end - first < TOGETHER &&
           ((texel[end] ^ texel[first]) & ~0x00070007u) == 0) {
        ++end;
    }
    return end;
}

/* Whether the point is inside a solid, by a ray from a little behind it. */
static bool is_solid_behind(const vshi_triangles *triangles, const vshi_segment_ray *ray) {
    vshi_segment_ray behind = *ray;
    for (size_t axis = 0; axis < 3; ++axis) {
        behind.origin[axis] += ray->far * ray->direction[axis];
    }
    behind.far = INFINITY;
    return vshi_triangles_depth(triangles, &behind) > 0;
}

/* Makes samples first … last - 1 on another face invalid. If that face crosses the sample's plane, every ray
 * meets it at once, and a short ray in the plane, across the sample, finds it. If it lies in the plane, as
 * that of a floor under a box, every ray begins behind it, and a short ray back through the sample finds it.
 * Both sides of a card also lie in one plane, but have no solid between them. */
static void drop_touching(const lifting *l, const vshi_triangles *triangles, size_t first, size_t last) {
    static const double ACROSS[2] = {0.7648, 0.6442}; /* along no axis, and no usual edge */
    static const double NEAR = 0.25; /* share of the offset: 16 roundings of a float; a wider gap is a gap */
    const double offset = vshi_triangles_offset(triangles), near = NEAR * offset;
    vshi_segment_ray across[TOGETHER], back[TOGETHER];
    size_t of[TOGETHER], count = 0;
    bool crossed[TOGETHER], covered[TOGETHER];
    for (size_t i = first; i < last; ++i) {
        if (l->origins->valid[i]) {
            const vshi_vec normal = vshi_vec_off(l->samples->geometric + 3 * i);
            const vshi_vec foot = vshi_sample_foot(l->samples, i), down = vshi_scale(normal, -1.0);
            vshi_vec u, v;
            vshi_frame(normal, &u, &v);
            const vshi_vec d = vshi_unit(vshi_add(vshi_scale(u, ACROSS[0]), vshi_scale(v, ACROSS[1])));
            const vshi_vec p =
                vshi_add(foot, vshi_sub(vshi_scale(normal, offset), vshi_scale(d, 0.5 * offset)));
            const vshi_vec q = vshi_add(foot, vshi_scale(normal, near));
            across[count] = (vshi_segment_ray){{p.x, p.y, p.z}, {d.x, d.y, d.z}, offset};
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

/* Tests samples first … last - 1 together, by rays against a field's triangles. The field knows a sample to
 * be in the open if only the sample's own surface is near. */
static void test_by_rays(const lifting *l, const vshi_probed_field *in, size_t first, size_t last) {
    double at[3 * TOGETHER];
    vshi_vec probes[TOGETHER];
    uint8_t where[TOGETHER];
    bool follows[TOGETHER];
    size_t i = first;
    do {
        vshi_vec_to_doubles(vshi_sample_foot(l->samples, i), at + 3 * (i - first));
        probes[i - first] = probe(l, in, i);
        follows[i - first] =
            i > first && ((l->samples->mesh[i] | l->samples->mesh[i - 1]) & VSHI_SAMPLE_BORDER) == 0;
    } while (++i < last);
    const vshi_open_field open = {in->field, probes, CREASE * in->probe};
    vshi_inside(in->triangles, last - first, at, l->samples->geometric + 3 * first, follows, &open, where);
    for (i = first; i < last; ++i) {
        if (where[i - first] != VSHI_OUTSIDE) {
            l->origins->valid[i] = 0;
        }
    }
    drop_touching(l, in->triangles, first, last);
}

static void validate_together(const lifting *l, size_t first, size_t last) {
    const vshi_placement *p = l->placement;
    uint8_t *valid = l->origins->valid;
    memset(valid + first, 1, last - first);
    for (size_t field = 0; field < p->field_count; ++field) {
        if (p->fields[field].triangles != NULL) {
            test_by_rays(l, &p->fields[field], first, last);
        }
        if (p->fields[field].marched) {
            test_in_field(l, field, first, last);
        }
    }
    for (size_t solid = 0; solid < p->solid_count; ++solid) {
        for (size_t i = first; i < last; ++i) {
            double at[3];
            vshi_vec_to_doubles(vshi_sample_foot(l->samples, i), at);
            valid[i] = valid[i] && !(p->heights[solid] != NULL ? vshi_heights_hold(p->heights[solid], at)
                                                               : vshi_spheres_hold(p->spheres[solid], at));
        }
    }
}

/* The texel for samplers. Further samples of a texel get a distant place, so that their rays differ. */
static uint32_t sampler_texel(const vshi_samples *samples, size_t i) {
    static const uint32_t COLUMN_STEP = 47, ROW_STEP = 29;
    const uint32_t texel = samples->texel[i];
    uint32_t sample = 0;
    for (size_t k = i; k > 0 && samples->texel[k - 1] == texel; --k) {
        ++sample;
    }
    return vsh_texel((vsh_texel_column(texel) + COLUMN_STEP * sample) & 0xffff,
                     (vsh_texel_row(texel) + ROW_STEP * sample) & 0xffff);
}

static void add_origin(const lifting *l, size_t i, double height, size_t at) {
    vshi_origins *origins = l->origins;
    lift(l, i, height, l->placement->fields[0].shell, origins->position + 3 * at);
    memcpy(origins->normal + 3 * at, l->samples->normal + 3 * i, 3 * sizeof(float));
    memcpy(origins->face + 3 * at, l->samples->geometric + 3 * i, 3 * sizeof(float));
    origins->texel[at] = sampler_texel(l->samples, i);
    origins->sample[at] = (uint32_t)i;
}

void vshi_origins_find(const vshi_placement *placement, const vshi_samples *samples, vshi_origins *origins) {
    const lifting l = {placement, samples, origins};
    origins->count = origins->frame = 0;
    memset(origins->crease, 0, samples->count);
    for (size_t i = 0, next; i < samples->count; i = next) {
        next = together_end(samples, i);
        validate_together(&l, i, next);
    }
    for (size_t i = 0; i < samples->count; ++i) {
        if (origins->valid[i]) {
            const uint8_t crease = origins->crease[i];
            add_origin(&l, i, crease > 0 ? placement->fields[crease - 1].probe : placement->offset,
                       origins->count++);
        }
    }
}

void vshi_origins_add_frame(const vshi_placement *placement, const vshi_samples *samples, size_t first,
                            vshi_origins *origins) {
    const lifting l = {placement, samples, origins};
    for (size_t i = first; i < samples->count; ++i) {
        add_origin(&l, i, placement->offset, origins->count + origins->frame++);
    }
}

static void add_field(vshi_placement *p, const vsh_field *field, const vshi_triangles *triangles,
                      bool marched) {
    p->fields[p->field_count++] =
        (vshi_probed_field){.field = field,
                            .probe = fmax(p->offset, PROBE_HEIGHT * field->voxel_size),
                            .shell = 0.5 * field->shell_thickness,
                            .triangles = triangles,
                            .marched = marched || triangles == NULL};
}

vshi_placement vshi_placement_open(const vsh_occluders *occluders, const vsh_shade_options *options,
                                   bool lights, bool ao, int32_t isa) {
    vshi_placement p = {.kernel = vshi_kernel_of(isa),
                        .offset =
                            options->start_offset * occluders->field->voxel_size + options->surface_offset};
    vsh_shade_options own = *options;
    const bool marches_ao = !vshi_ao_traces(options, occluders->triangles);
    add_field(&p, occluders->field, occluders->triangles,
              (lights && !vshi_shadow_traces(options, occluders->triangles)) || (ao && marches_ao));
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        const vshi_layer *layer = &occluders->layers[i];
        own.method = layer->method == VSH_SHADOW_OF_SCENE ? options->method : layer->method;
        if (layer->field != NULL) {
            const bool shades = lights && !vshi_layer_is_closed(layer), occludes = ao && layer->ao != 0;
            add_field(&p, layer->field, layer->triangles,
                      (shades && !vshi_shadow_traces(&own, layer->triangles)) ||
                          (occludes && !vshi_ao_traces(options, layer->triangles)));
        } else {
            p.heights[p.solid_count] = layer->heights;
            p.spheres[p.solid_count++] = layer->spheres;
        }
    }
    return p;
}

vsh_result vshi_origins_allocate(vshi_origins *origins, size_t room, vsh_error *error) {
    *origins = (vshi_origins){.count = 0};
    const vshi_array arrays[] = {
        VSHI_ARRAY(origins->sample, room),    VSHI_ARRAY(origins->position, 3 * room),
        VSHI_ARRAY(origins->start, 3 * room), VSHI_ARRAY(origins->normal, 3 * room),
        VSHI_ARRAY(origins->face, 3 * room),  VSHI_ARRAY(origins->texel, room),
        VSHI_ARRAY(origins->valid, room),     VSHI_ARRAY(origins->crease, room),
    };
    return VSHI_ALLOCATE_BLOCK(arrays, "lightmap samples", error);
}

void vshi_origins_free(vshi_origins *origins) {
    free(origins->sample); /* the block's first array */
    *origins = (vshi_origins){.count = 0};
}

void vshi_origins_lift(const vshi_lifter *lifter, const vshi_samples *samples, bool traced,
                       vshi_origins *origins) {
    for (size_t k = 0; k < origins->count + origins->frame; ++k) {
        const vshi_lift_point point = vshi_sample_lift_point(samples, origins->sample[k]);
        const vshi_vec base = traced ? point.foot : vshi_vec_of(origins->position + 3 * k);
        vshi_vec_to_doubles(vshi_add(base, vshi_lift_find(lifter, &point)), origins->start + 3 * k);
    }
}
