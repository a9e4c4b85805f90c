/* How many shards there is work for, as far as a scene tells before a file is read. */
#include "bake_scene/bounds.h"
#include "bake_scene/shares.h"
#include "bake_scene/work.h"
#include "shade/rays_expected.h"

#include <math.h>
#include <string.h>

/* Where nothing was looked at yet: texels in a penumbra, and AO of a texel that shares it or has its own,
 * rather too little. */
static const double USUAL_PENUMBRA = 0.05, USUAL_SHARED = 1050.0, USUAL_ALONE = 5000.0;
/* What these take more where fields are marched by rays that cones leave over, and by rays alone, rather too
 * much than too little. */
static const double MARCHED = 2.5, MARCHED_RAYS = 25.0;
/* What all borders may take. */
static const double MOST_BORDERS = 0.1;
/* What each part takes by itself beside what it does for any: a heightfield's triangles, of 256 samples on a
 * side; and the few, where they take as long as others. What of all that may be. */
static const double TRIANGLES_OF_HEIGHTS = 8e7, MOST_OWN = 0.12;

/* Whether its size is what it says. */
static bool is_sized(const vsh_receiver *receiver) {
    return receiver->atlas != VSH_ATLAS_OBJECTS && receiver->texels_per_unit == 0.0 && receiver->pages <= 1 &&
           receiver->max_size == 0 && receiver->width > 0 && receiver->height > 0;
}

/* What a texel takes, and whether what is open at some is not shaded. */
typedef struct usual {
    double light, shared, alone; /* all lights; all that is open, if texels share it or not */
    bool shares;
} usual;

/* Whether something is not traced against triangles of meshes. */
static bool marches_field(const vsh_scene *scene) {
    bool marches = vsh_scene_marches(scene, NULL) != 0;
    for (size_t i = 0; i < scene->layer_count; ++i) {
        marches = marches || vsh_scene_marches(scene, &scene->layers[i]) != 0;
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        marches = marches || scene->casters[i].type != VSH_CASTER_MESH;
    }
    return marches;
}

/* What rays of a scene take more than those to triangles. */
static double marching(const vsh_scene *scene) {
    const bool rays = scene->shade.method == VSH_SHADOW_RAYS || scene->shade.ao_method == VSH_AO_RAYS;
    const uint32_t traits = vsh_shadow_method_traits(vsh_shadow_method_resolve(scene->shade.method, 0)) |
                            vsh_ao_method_traits(vsh_ao_method_resolve(scene->shade.ao_method, 0));
    const bool adaptive = (traits & VSH_METHOD_KEEPS_ERROR) != 0;
    return !marches_field(scene) ? 1.0 : rays ? MARCHED_RAYS : adaptive ? MARCHED : 1.0;
}

static usual usual_of(const vsh_scene *scene) {
    const double finer = vshi_rays_expected(scene->shade.max_error) * marching(scene),
                 openings = vshi_work_openings(scene);
    const usual u = {.light =
                         (double)scene->light_count * (VSHI_LIT + USUAL_PENUMBRA * finer * VSHI_PENUMBRA),
                     .shared = openings * finer * USUAL_SHARED,
                     .alone = openings * finer * USUAL_ALONE,
                     .shares = openings > 0.0};
    return u;
}

double vshi_shares_most(const vsh_scene *scene, double least) {
    const usual u = usual_of(scene);
    double ns = 0.0, own = 0.0, borders = 0.0;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const vsh_receiver *receiver = &scene->receivers[i];
        if (!is_sized(receiver)) {
            return INFINITY;
        }
        const double across = receiver->supersample;
        const double points = (double)receiver->width * receiver->height * across * across;
        const bool shares = u.shares && receiver->supersample == 1 && receiver->ao_spacing > 1;
        const double each = VSHI_LAID_OUT + VSHI_VALID + u.light + (shares ? u.shared : u.alone);
        ns += points * each;
        own += receiver->type == VSH_RECEIVER_HEIGHTFIELD ? TRIANGLES_OF_HEIGHTS : 0.0;
        borders += MOST_BORDERS * receiver->height / (shares ? VSHI_SHARED_ROWS * receiver->ao_spacing : 1.0);
    }
    return fmin(fmin(1e-9 * ns / least, 1.0 + borders), own > 0.0 ? MOST_OWN * ns / own : INFINITY);
}
