#include "bake_scene/warn.h"

#include "base/job.h"

#include <inttypes.h>
#include <stdio.h>

enum { WORST = 3 }; /* meshes that are named */

/* " 'floor' 1200, 'walls' 300 and 4 others", those with the most texels first. */
static void name_worst(const vshi_target *target, const uint64_t *invalid, char *text, size_t size) {
    size_t worst[WORST], named = 0, others = 0, at = 0;
    for (size_t m = 0; m < target->mesh_count; ++m) {
        others += invalid[m] > 0;
        size_t place = named;
        for (; place > 0 && invalid[worst[place - 1]] < invalid[m]; --place) {
            if (place < WORST) {
                worst[place] = worst[place - 1];
            }
        }
        if (invalid[m] > 0 && place < WORST) {
            worst[place] = m;
            named += named < WORST;
        }
    }
    text[0] = '\0';
    for (size_t k = 0; k < named && at < size; ++k) {
        const char *name = target->meshes[worst[k]].name;
        at += (size_t)snprintf(text + at, size - at, "%s'%s' %" PRIu64, k > 0 ? ", " : "",
                               name != NULL ? name : "", invalid[worst[k]]);
    }
    if (others > named && at < size) {
        snprintf(text + at, size - at, " and %zu more", others - named);
    }
}

static void note_invalid(const vshi_target *target, const vsh_bake_stats *baked, bool traced,
                         const vsh_run *run) {
    char names[512];
    const char *by = traced ? "" : "voxels decide, and --method exact is sharper; ";
    name_worst(target, baked->invalid_by_mesh, names, sizeof names);
    vshi_note(run,
              "%s: %" PRIu64 " of %" PRIu64 " texels are invalid (inside a solid or behind a wall): %s; %s"
              "--invalid FILE.png shows where",
              target->receiver.path, baked->invalid_texels, baked->texels, names, by);
}

/* Whether values are what cones read, and no rays refine them. */
static bool cones_decide(const vsh_scene *scene) {
    return (scene->light_count > 0 &&
            (vsh_shadow_method_traits(scene->shade.method) & VSH_METHOD_RAYS) == 0) ||
           (scene->ao && (vsh_ao_method_traits(scene->shade.ao_method) & VSH_METHOD_RAYS) == 0);
}

void vshi_warn_baked(const vsh_scene *scene, const vshi_target *target, const vsh_bake_stats *baked,
                     const vsh_run *run) {
    const char *path = target->receiver.path;
    const vsh_shade_stats *shade = &baked->shade;
    if (baked->invalid_texels > 0) {
        note_invalid(target, baked, vsh_scene_marches(scene, NULL) == 0, run);
    }
    if (shade->unfinished > 0) {
        vshi_warn(run, "%s: %" PRIu64 " of %" PRIu64 " marches ran out of %d steps; use larger voxels", path,
                  shade->unfinished, shade->marches, scene->shade.max_steps);
    }
    if (shade->beyond_reach > 0 && cones_decide(scene)) {
        vshi_warn(run,
                  "%s: %" PRIu64 " of %" PRIu64
                  " cones grew wider than the field reaches, so far shadows may be too "
                  "dark; --method exact and --ao-method exact use rays",
                  path, shade->beyond_reach, shade->marches);
    }
}

vsh_result vshi_refuse_invalid(const vshi_target *target, const vsh_bake_stats *baked, vsh_error *error) {
    if (baked->texels == 0 || baked->invalid_texels < baked->texels) {
        return VSH_OK;
    }
    return vshi_fail(error, VSH_ERROR_INPUT,
                     "%s: nothing to bake: all %" PRIu64
                     " texels are inside solids or behind walls; 'vdbshade info' tells what is taken "
                     "for solid; is it to receive at all, or does what surrounds it cast?",
                     target->receiver.path, baked->texels);
}

void vshi_warn_clipping(const char *output, const vsh_image_clipping *cut, const vsh_run *run) {
    if (cut->clipped > 0) {
        vshi_warn(
            run,
            "%s: %.3g %% of the texels are brighter than 1, up to %.3g, and cut to 1; write .exr, or floats "
            "(--bits 32) where the format has them, or dim the lights",
            output, 100.0 * (double)cut->clipped / (double)cut->texels, (double)cut->largest);
    }
}
