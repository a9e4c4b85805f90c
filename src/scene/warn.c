/* Warnings and errors about lightmaps: their UVs, texels and files, and lights that one object hides. */
#include "scene/bake_scene.h"

#include "base/job.h"
#include "geometry/solidity.h"
#include "lightmap/planes.h"
#include "lightmap/texels.h"
#include "scene/assets.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>

/* --- UVs */

static const char *find_name(const vsh_mesh *mesh) {
    return mesh->name != NULL ? mesh->name : "";
}

/* Warns of charts closer than a texel, unless charts overlap: then a warning says so. */
static void warn_close(const vshi_target *target, const vsh_uv_report *reports, const vsh_run *run) {
    const vsh_receiver *receiver = &target->receiver;
    for (size_t m = 0; m < target->lightmap->mesh_count; ++m) {
        if (reports[m].overlap_texels > 0) {
            return;
        }
    }
    vsh_run silent = *run;
    silent.warning = NULL;
    vshi_closeness close;
    const vshi_charts *sorted = &target->charts->sorted;
    if (vshi_charts_closeness(sorted->meshes, sorted->mesh_count, receiver->width, receiver->height, &silent,
                              &close, NULL) != VSH_OK ||
        close.texels == 0) {
        return; /* a failure is not worth an error: this is only a hint */
    }
    const double larger = receiver->width > receiver->height ? receiver->width : receiver->height;
    const double apart = close.gap > 0.0 ? ceil(larger / close.gap) : INFINITY;
    char help[128] = "they touch at every size; unwrap with a margin";
    if (apart <= VSH_MAX_LIGHTMAP_SIZE) {
        snprintf(help, sizeof help, "from --size %.0f on they are apart", apart);
    }
    vshi_warn(run,
              "%s: charts lie closer than a texel to each other along %" PRIu64 " texels, %" PRIu64
              " of them of mesh '%s': values bleed between them; %s",
              receiver->path, close.texels, close.mesh_texels,
              find_name(&target->lightmap->meshes[close.mesh]), help);
}

static void warn_covered(const vshi_target *target, uint64_t covered, const vsh_run *run) {
    static const double least = 0.2;
    const vsh_receiver *receiver = &target->receiver;
    const double share = (double)covered / ((double)receiver->width * (double)receiver->height);
    const bool chosen = receiver->objects.only_count > 0 || receiver->objects.except_count > 0;
    if (share >= least || (chosen && !target->unwrapped) ||
        (target->lightmap->page > 0 && target->object == NULL)) {
        return; /* other objects fill the rest, or it is the last page, which need not be full */
    }
    const char *help = !target->unwrapped ? "--unwrap always packs them anew"
                       : receiver->texels_per_unit > 0.0
                           ? "use a smaller --size or a higher --texels-per-unit"
                           : "padding takes most of the image, so use a larger --size";
    vshi_warn(run, "%s: %s%s%scharts cover %.2g %% of %d × %d texels: %s", receiver->path,
              target->object != NULL ? "object '" : "", target->object != NULL ? target->object : "",
              target->object != NULL ? "': " : "", 100.0 * share, receiver->width, receiver->height, help);
}

void vshi_warn_uvs(const vshi_target *target, const vsh_uv_report *reports, uint64_t covered,
                   const vsh_run *run) {
    for (size_t m = 0; m < target->lightmap->mesh_count; ++m) {
        vshi_warn_mesh_uvs(target->receiver.path, &target->lightmap->meshes[m], m, &reports[m], run);
    }
    if (run->warning != NULL && target->receiver.type != VSH_RECEIVER_HEIGHTFIELD) { /* that is one chart */
        warn_close(target, reports, run);
        warn_covered(target, covered, run);
    }
}

static vsh_result refuse_empty(const vshi_target *target, const vsh_uv_report *reports, vsh_error *error) {
    const vsh_receiver *receiver = &target->receiver;
    size_t triangles = 0, outside = 0, flat = 0;
    for (size_t m = 0; m < target->lightmap->mesh_count; ++m) {
        triangles += target->lightmap->meshes[m].triangle_count;
        outside += reports[m].outside_triangles;
        flat += reports[m].degenerate_triangles;
    }
    return vshi_fail(
        error, VSH_ERROR_INPUT,
        "%s: nothing to bake: the UVs of its %zu triangles cover none of %d × %d texels; %zu have "
        "no area in the UV set, %zu leave the unit square; %s",
        receiver->path, triangles, receiver->width, receiver->height, flat, outside,
        flat + outside > 0 ? "choose another set with --uv-set, or unwrap it anew"
                           : "raise --size, or unwrap it anew");
}

vsh_result vshi_refuse_uvs(const vshi_target *target, const vsh_uv_report *reports, uint64_t covered,
                           vsh_error *error) {
    if (covered == 0) {
        return refuse_empty(target, reports, error);
    }
    const vsh_receiver *receiver = &target->receiver;
    const vsh_uv_report *worst = reports;
    uint64_t texels = 0;
    size_t count = 0;
    for (size_t i = 0; i < target->lightmap->mesh_count; ++i) {
        texels += reports[i].other_texels;
        count += reports[i].other_texels > 0;
        worst = reports[i].other_texels > worst->other_texels ? &reports[i] : worst;
    }
    if (receiver->allow_overlap || (double)texels <= VSH_LARGEST_OVERLAP * (double)covered) {
        return VSH_OK;
    }
    return vshi_fail(
        error, VSH_ERROR_INPUT,
        "%s: objects share texels of the lightmap: %zu of %zu meshes lie over others, on %" PRIu64
        " texels (charts cover %" PRIu64 "); '%.100s' on %zu, %zu of them over '%.100s'. "
        "-o FILE.glb, or --unwrap auto with an image, makes one atlas with texels of its own for each "
        "object; --per-object gives each object an image; --receive NAME chooses some objects; "
        "\"allow_overlap\": true in a scene's receiver bakes the UVs as they are",
        receiver->path, count, target->lightmap->mesh_count, texels, covered,
        vshi_object_name(&target->lightmap->meshes[worst - reports]), worst->other_texels,
        worst->other_mesh_texels, vshi_object_name(&target->lightmap->meshes[worst->other_mesh]));
}

/* --- baked texels */

static void note_invalid(const vshi_target *target, const vsh_bake_stats *baked, bool traced,
                         const vsh_run *run) {
    const uint64_t *invalid = baked->invalid_by_mesh;
    const char *by = traced ? "" : "voxels decide, and --method exact is sharper; ";
    size_t worst = 0;
    for (size_t m = 1; m < target->lightmap->mesh_count; ++m) {
        worst = invalid[m] > invalid[worst] ? m : worst;
    }
    vshi_note(run,
              "%s: %" PRIu64 " of %" PRIu64 " texels are invalid (inside a solid or behind a wall), %" PRIu64
              " of them of mesh '%s'; %s--invalid FILE.png shows where",
              target->receiver.path, baked->invalid_texels, baked->texels, invalid[worst],
              find_name(&target->lightmap->meshes[worst]), by);
}

void vshi_warn_baked(const vsh_scene *scene, const vshi_target *target, const vsh_bake_stats *baked,
                     const vsh_run *run) {
    const char *path = target->receiver.path;
    const vsh_shade_stats *shade = &baked->shade;
    const bool shadow_rays =
        (vsh_method_traits(VSH_NAMES_SHADOW, scene->shade.method) & VSH_METHOD_RAYS) != 0;
    const bool ao_rays = (vsh_method_traits(VSH_NAMES_AO, scene->shade.ao_method) & VSH_METHOD_RAYS) != 0;
    const bool cones_decide = (scene->light_count > 0 && !shadow_rays) || (scene->ao && !ao_rays);
    if (baked->invalid_texels > 0) {
        note_invalid(target, baked, vshi_scene_marches(scene, NULL) == 0, run);
    }
    if (shade->unfinished > 0) {
        vshi_warn(run, "%s: %" PRIu64 " of %" PRIu64 " marches ran out of %d steps; use larger voxels", path,
                  shade->unfinished, shade->marches, scene->shade.max_steps);
    }
    if (shade->beyond_reach > 0 && cones_decide) {
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
                     " texels are inside solids or behind walls; 'vdbshade info' lists the solids; leave "
                     "this mesh out (--no-receive NAME), or the solid around it (--no-cast NAME)",
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

double vshi_warn_vertex_colors(const vshi_target *target, const double *errors, double most,
                               const vsh_run *run) {
    const vsh_scene_lightmap *lightmap = target->lightmap;
    size_t worst = 0, count = 0;
    for (size_t m = 0; m < lightmap->mesh_count; ++m) {
        count += errors[m] > most;
        worst = errors[m] > errors[worst] ? m : worst;
    }
    if (count > 0) {
        vshi_warn(
            run,
            "%s: triangles of %zu of %zu meshes are too large for the light on them; mesh '%s' is %.2g off "
            "(RMSE); subdivide it, or bake a lightmap",
            lightmap->output, count, lightmap->mesh_count, vshi_object_name(&lightmap->meshes[worst]),
            errors[worst]);
    }
    return errors[worst];
}

/* --- lights that objects hide: a sky dome hides the sun, a bulb its own lamp */

static bool is_same(const vsh_mesh *a, const vsh_mesh *b) {
    return strcmp(vshi_object_name(a), vshi_object_name(b)) == 0;
}

/* Adds a texel of a mesh to the objects that each light reaches. */
static void add_texel(const vshi_scene_page *page, size_t texel, const vsh_mesh *mesh) {
    const vsh_lightmap *planes = &page->channels.lightmap;
    const size_t lights = page->bake->scene.light_count;
    for (size_t i = 0; i <= lights; ++i) {
        const float *plane = i == lights ? planes->sky : planes->shadow != NULL ? planes->shadow[i] : NULL;
        vshi_lit_objects *so_far = &page->bake->lit[i];
        if (plane != NULL && !so_far->several && so_far->mesh != mesh && plane[texel] > 0.0f) {
            so_far->several = so_far->mesh != NULL && !is_same(so_far->mesh, mesh);
            so_far->mesh = mesh;
        }
    }
}

void vshi_find_lit_objects(const vshi_scene_page *page) {
    for (size_t i = 0; i < page->page.width * page->page.height; ++i) {
        const uint32_t mesh = page->page.mesh[i];
        if (mesh > 0 && page->channels.lightmap.coverage[i] == 1.0f) {
            add_texel(page, i, &page->target->lightmap->meshes[mesh - 1]);
        }
    }
}

/* Whether another object than that of a mesh receives. */
static bool has_others(const vshi_scene_bake *bake, const vsh_mesh *mesh) {
    bool others = false;
    for (size_t i = 0; i < bake->target_count; ++i) {
        for (size_t m = 0; m < bake->lightmaps[i].mesh_count; ++m) {
            others = others || !is_same(&bake->lightmaps[i].meshes[m], mesh);
        }
    }
    return others;
}

void vshi_warn_lights(const vshi_scene_bake *bake, const vsh_run *run) {
    const size_t lights = bake->scene.light_count;
    for (size_t i = 0; i < lights + (bake->scene.planes.sky != VSH_UP_NONE); ++i) {
        const vsh_mesh *lit = bake->lit[i].mesh;
        const char *what = i < lights ? "light " : "the sky",
                   *name = i < lights ? bake->scene.lights[i].name : "";
        const bool is_far = i == lights || bake->scene.lights[i].type == VSH_LIGHT_DIRECTIONAL;
        if (lit == NULL) {
            vshi_warn(
                run,
                "%s%s reaches no texel; if an object hides it, such as a sky dome or the bulb of a lamp, "
                "--no-cast NAME lets it through",
                what, name);
        } else if (!bake->lit[i].several && is_far && has_others(bake, lit)) {
            vshi_warn(
                run,
                "%s%s reaches '%s' alone; if that hides it from the others, --no-cast '%s' lets it through",
                what, name, vshi_object_name(lit), vshi_object_name(lit));
        }
    }
}
