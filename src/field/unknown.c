#include "base/floats.h"
#include "base/memory.h"
#include "base/try.h"
#include "field/field.h"

#include <math.h>

/* One level of 2³ blocks around the origin, all of the same brick of zeros, wider than any scene. */
enum { BLOCKS = 8 };
#define SCALE 0x1p60f
#define QUANTUM 0x1p46f

static const double LEAST = 1e-12, MOST = 1e12;

vsh_result vshi_field_create_unknown(double voxel_size, const double low[3], const double high[3],
                                     vsh_field **field, vsh_error *error) {
    VSHI_FLOATS;
    *field = NULL;
    if (!(voxel_size >= LEAST && voxel_size <= MOST)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "voxel_size %g is out of range 1e-12 … 1e12", voxel_size);
    }
    vsh_field *f = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&f, 1, sizeof *f, "field", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&f->index, BLOCKS, sizeof *f->index, "field", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&f->values, VSHI_BRICK_VALUES, sizeof *f->values, "field", error));
    f->unknown = true;
    f->voxel_size = voxel_size;
    f->value_count = VSHI_BRICK_VALUES;
    f->level_count = 1;
    vshi_level *level = &f->levels[0];
    *level = (vshi_level){.brick_count = 1, .scale = SCALE, .band = SCALE, .quantum = QUANTUM};
    for (int axis = 0; axis < 3; ++axis) {
        /* around 0, for positions become floats, as a level set of the same casters is */
        const double middle = round((low[axis] + 0.5 * (high[axis] - low[axis])) / voxel_size);
        level->origin[axis] = -VSHI_BRICK_CELLS;
        level->size[axis] = 2;
        f->to_field[5 * axis] = 1.0 / voxel_size;
        f->to_field[4 * axis + 3] = -middle;
        f->world_min[axis] = low[axis];
        f->world_max[axis] = high[axis];
        f->bounds_min[axis] = (float)(low[axis] / voxel_size - middle);
        f->bounds_max[axis] = (float)(high[axis] / voxel_size - middle);
    }
    *field = f;
    f = NULL;
done:
    vsh_field_free(f);
    return result;
}
