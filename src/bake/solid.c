#include "bake/fill.h"

#include "field/field.h"
#include "heightfield/heights.h"
#include "shade/occluders.h"
#include "spheres/spheres.h"

#include <math.h>

vshi_solid vshi_solid_of(const vsh_occluders *occluders) {
    vshi_solid solid = {.fields = {occluders->field}, .field_count = 1};
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        const vsh_layer *layer = &occluders->layers[i];
        if (layer->spheres != NULL) { /* their field is for rays of AO, and may have no distances */
            solid.spheres[solid.spheres_count++] = layer->spheres;
        } else if (layer->heights != NULL) {
            solid.heights[solid.heights_count++] = layer->heights;
        } else {
            solid.fields[solid.field_count++] = layer->field;
        }
    }
    for (size_t i = 0; i < solid.field_count; ++i) {
        vsh_field_info info;
        vsh_field_get_info(solid.fields[i], &info);
        solid.voxel_size = fmax(solid.voxel_size, info.voxel_size);
    }
    return solid;
}

static void lower(float *distance, float other) {
    *distance = other < *distance ? other : *distance; /* NaN stays */
}

/* The nearest estimate, not the lower bound of vsh_field_sample(): its differences give normals. */
static void sample_field(const vsh_field *field, size_t count, const double *positions, float *distances) {
    for (size_t i = 0; i < count; ++i) {
        const vshi_vec p = vshi_to_field(field, positions + 3 * i);
        const float at[3] = {(float)p.x, (float)p.y, (float)p.z};
        const bool known = vshi_finite(p) && !field->unknown;
        distances[i] = known ? (float)((double)vshi_field_distance(field, at) * field->voxel_size) : NAN;
    }
}

void vshi_solid_sample(const vshi_solid *solid, size_t count, const double *positions, float *distances) {
    sample_field(solid->fields[0], count, positions, distances);
    for (size_t f = 1; f < solid->field_count; ++f) {
        float other[VSHI_SOLID_MOST];
        sample_field(solid->fields[f], count, positions, other);
        for (size_t i = 0; i < count; ++i) {
            lower(&distances[i], other[i]);
        }
    }
    for (size_t s = 0; s < solid->spheres_count; ++s) {
        for (size_t i = 0; i < count; ++i) {
            lower(&distances[i], (float)vshi_sphere_tree_distance(solid->spheres[s], positions + 3 * i));
        }
    }
}

void vshi_solid_bound(const vshi_solid *solid, size_t count, const double *positions, float *distances) {
    vshi_solid_sample(solid, count, positions, distances);
    for (size_t h = 0; h < solid->heights_count; ++h) {
        vsh_heights_info info;
        vsh_heights_get_info(solid->heights[h], &info);
        for (size_t i = 0; i < count; ++i) {
            double square = 0.0;
            for (int axis = 0; axis < 3; ++axis) {
                const double p = positions[3 * i + (size_t)axis];
                const double off = fmax(info.bounds_min[axis] - p, p - info.bounds_max[axis]);
                square += off > 0.0 ? off * off : 0.0;
            }
            lower(&distances[i], (float)sqrt(square));
        }
    }
}

bool vshi_solid_buries(const vshi_solid *solid, const double position[3]) {
    bool buries = false;
    for (size_t h = 0; h < solid->heights_count && !buries; ++h) {
        buries = vshi_heights_hold(solid->heights[h], position);
    }
    return buries;
}
