/* How far from a surface a scene's field must be able to tell distances apart. */
#include "scene/occluders.h"

#include "base/elementary.h"
#include "base/floats.h"
#include "base/vec.h"
#include "light/view.h"

/* Tangent of 60°: wider half angles are marched as if they were this wide, as a tangent without
 * bound would ask for a field without bound. */
static const double widest_tangent = 1.7320508075688772;

double vshi_scene_reach(const vsh_scene *scene, const vsh_grid_info *info, const double receivers_min[3],
                        const double receivers_max[3]) {
    vshi_vec sides;
    double *side[3] = {&sides.x, &sides.y, &sides.z};
    for (int i = 0; i < 3; ++i) {
        *side[i] = fmax(info->bounds_max[i], receivers_max[i]) - fmin(info->bounds_min[i], receivers_min[i]);
    }
    const double longest = vshi_length(sides);          /* ray from a receiver to a caster */
    double reach = info->half_width * info->voxel_size; /* what the finest level has anyway */
    for (size_t i = 0; i < scene->light_count; ++i) {
        const vshi_light_place place = vshi_light_in_world(&scene->lights[i]);
        if (place.parallel) {
            const double half_angle = fmin(place.half, vshi_atan(widest_tangent));
            reach = fmax(reach, vshi_tan(half_angle) * longest);
        } else {
            /* At t of the distance d to a sphere of radius r, the cone is r t/d wide: never wider than r. */
            reach = fmax(reach, fmin(place.radius, widest_tangent * longest));
        }
    }
    if (vsh_planes_shaded(&scene->planes) > 0) { /* rays across the scene, which coarse levels shorten */
        reach = fmax(reach, longest);
    }
    return scene->ao ? fmax(reach, scene->shade.ao_distance) : reach;
}

double vsh_scene_reach(const vsh_scene *scene, const vsh_grid *grid, const double receivers_min[3],
                       const double receivers_max[3]) {
    VSHI_FLOATS;
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    return vshi_scene_reach(scene, &info, receivers_min, receivers_max);
}
