/* Warnings and errors about lightmaps: their UVs, texels and files, and lights that one object hides. */
#include "scene/bake_scene.h"

#include "base/job.h"
#include "geometry/solidity.h"
#include "light/light.h"
#include "lightmap/planes.h"
#include "lightmap/texels.h"
#include "scene/assets.h"
#include "trace/embree.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>

/* --- UVs */

static const char *find_name(const vsh_mesh *mesh) {
    return mesh->name != NULL ? mesh->name : "";
}

static const char *find_object(const vsh_mesh *mesh) {
    return mesh->object_name != NULL ? mesh->object_name : find_name(mesh);
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
    if (vshi_charts_closeness(target->lightmap->meshes, target->lightmap->mesh_count, receiver->width,
                              receiver->height, &silent, &close, NULL) != VSH_OK ||
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

/* The target's size, doubled until it has grown by `least_factor`. */
static void name_size(const vshi_target *target, double least_factor, char *text, size_t size) {
    int32_t width = target->receiver.width, height = target->receiver.height;
    for (double factor = 1.0;
         factor < least_factor && width <= VSH_MAX_LIGHTMAP_SIZE / 2 && height <= VSH_MAX_LIGHTMAP_SIZE / 2;
         factor *= 2.0) {
        width *= 2;
        height *= 2;
    }
    snprintf(text, size, width == height ? "--size %d" : "--size %dx%d", width, height);
}

static void warn_covered(const vshi_target *target, uint64_t covered, const vsh_run *run) {
    static const double least = 0.2;
    static const double full = 0.6; /* typical share of charts on a page without padding */
    const vsh_receiver *receiver = &target->receiver;
    const double share = (double)covered / ((double)receiver->width * (double)receiver->height);
    const bool chosen = receiver->objects.only_count > 0 || receiver->objects.except_count > 0;
    if (share >= least || (chosen && !target->unwrapped) ||
        (target->lightmap->page > 0 && target->object == NULL)) {
        return; /* other objects fill the rest, or it is the last page, which need not be full */
    }
    char help[128], size[40];
    if (!target->unwrapped) {
        name_size(target, sqrt(least / share), size, sizeof size);
        snprintf(help, sizeof help, "--unwrap always packs them anew, or %s gives them more texels", size);
    } else if (receiver->texels_per_unit > 0.0) {
        snprintf(help, sizeof help, "use a smaller --size, or --texels-per-unit %.3g",
                 receiver->texels_per_unit * sqrt(least / share));
    } else { /* share = full (1 - padding / size)² */
        const double padding = 1.0 - sqrt(share / full);
        name_size(target, padding / (1.0 - sqrt(least / full)), size, sizeof size);
        snprintf(help, sizeof help, "padding takes most of the image, so use %s", size);
    }
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
        find_object(&target->lightmap->meshes[worst - reports]), worst->other_texels,
        worst->other_mesh_texels, find_object(&target->lightmap->meshes[worst->other_mesh]));
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
    const bool shadow_rays = (vsh_shadow_method_traits(scene->shade.method) & VSH_METHOD_RAYS) != 0;
    const bool ao_rays = (vsh_ao_method_traits(scene->shade.ao_method) & VSH_METHOD_RAYS) != 0;
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

/* --- hidden lights */

/* One object may hide a light from all others: a sky dome hides the sun, a bulb its own lamp. The shadow
 * planes show which lights are hidden. Rays then find the object. */
enum { POINTS = 64 /* on each mesh */, RAYS = 16 /* from a point to a light */ };

static bool is_same(const vsh_mesh *a, const vsh_mesh *b) {
    return strcmp(find_object(a), find_object(b)) == 0;
}

/* Notes the lights that reach a texel of a mesh. */
static void note_texel(const vshi_scene_page *page, size_t texel, const vsh_mesh *mesh) {
    const vsh_lightmap *planes = &page->channels.lightmap;
    const size_t lights = page->bake->scene.light_count;
    for (size_t i = 0; i <= lights; ++i) {
        const float *plane = i == lights ? planes->sky : planes->shadow != NULL ? planes->shadow[i] : NULL;
        vshi_lit *so_far = &page->bake->lit[i];
        if (plane != NULL && !so_far->several && so_far->mesh != mesh && plane[texel] > 0.0f) {
            so_far->several = so_far->mesh != NULL && !is_same(so_far->mesh, mesh);
            so_far->mesh = mesh;
        }
    }
}

void vshi_note_lit(const vshi_scene_page *page) {
    for (size_t i = 0; i < page->page.width * page->page.height; ++i) {
        const uint32_t mesh = page->page.mesh[i];
        if (mesh > 0 && page->channels.lightmap.coverage[i] == 1.0f) {
            note_texel(page, i, &page->target->lightmap->meshes[mesh - 1]);
        }
    }
}

static bool is_in_box(const vshi_triangles *triangles, const double at[3]) {
    double low[3], high[3], beyond = 0.0;
    vshi_triangles_bounds(triangles, low, high);
    for (int k = 0; k < 3; ++k) {
        beyond = fmax(beyond, fmax(low[k] - at[k], at[k] - high[k]));
    }
    return beyond <= vshi_triangles_lift(triangles); /* rounding */
}

static bool is_facing(const vshi_vec corner[3], vshi_vec at, const vsh_light *light) {
    const vshi_light_place place = vshi_light_in_world(light);
    const vshi_vec normal = vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0]));
    vshi_light_view view;
    return vshi_light_look(&place, at, false, &view) == VSHI_LIGHT_SEEN &&
           vshi_dot(normal, view.axis) > 0.0 && vshi_light_gain(light, view.axis, view.distance) > 0.0;
}

/* Whether an object hides a light from all other receivers. Either the lamp or the receivers are in its box:
 * a crate may lie in the shade of a wall, and a house that holds both has several rooms. */
static bool hides_light(const vsh_mesh *own, size_t parts, vshi_triangles **triangles, const vsh_light *light,
                        const vshi_scene_bake *bake, const vsh_run *run) {
    size_t facing = 0;
    for (size_t t = 0; t < bake->target_count; ++t) {
        for (size_t m = 0; m < bake->lightmaps[t].mesh_count; ++m) {
            const vsh_mesh *mesh = &bake->lightmaps[t].meshes[m];
            const size_t most = is_same(mesh, own) ? 0 : POINTS;
            const size_t count = mesh->triangle_count < most ? mesh->triangle_count : most;
            for (size_t k = 0; k < count; ++k) {
                vshi_vec corner[3];
                vshi_mesh_triangle(mesh, k * mesh->triangle_count / count, corner);
                const vshi_vec p = vshi_point_in(corner, k);
                const double at[3] = {p.x, p.y, p.z};
                float seen = 1.0f;
                if (!is_facing(corner, p, light)) {
                    continue;
                }
                if (*triangles == NULL && vshi_triangles_create(own, parts, run, triangles, NULL) != VSH_OK) {
                    return false; /* no bake fails for a hint */
                }
                const bool lamp =
                    light->type != VSH_LIGHT_DIRECTIONAL && is_in_box(*triangles, light->position);
                vshi_trace_shadow(*triangles, NULL, 1, at, NULL, 0.0, light, RAYS, run, &seen, NULL);
                if (seen > 0.0f || is_in_box(*triangles, at) == lamp) {
                    return false;
                }
                ++facing;
            }
        }
    }
    return facing > 0;
}

static void find_hidden_lights(const vshi_scene_bake *bake, const vsh_mesh *own, size_t parts,
                               const vsh_run *run) {
    const size_t lights = bake->scene.light_count;
    const char *name = find_object(own);
    vshi_triangles *triangles = NULL;
    vsh_light zenith = vsh_light_default();
    vsh_run quiet = *run;
    quiet.progress = NULL;
    quiet.warning = NULL;
    quiet.memory_held += bake->report.occluders.field_bytes + bake->report.occluders.triangles_bytes;
    vshi_sky_up(bake->scene.planes.sky, zenith.direction);
    for (size_t i = 0; i < lights + (bake->scene.planes.sky != VSH_UP_NONE); ++i) {
        const vsh_light *light = i < lights ? &bake->scene.lights[i] : &zenith;
        const vsh_mesh *lit = bake->lit[i].mesh;
        /* the sun may shine on a dome from outside; a lamp that lights its room is not hidden */
        const bool lights_own = light->type == VSH_LIGHT_DIRECTIONAL && lit != NULL && is_same(lit, own);
        if (!bake->lit[i].several && (lit == NULL || lights_own) &&
            hides_light(own, parts, &triangles, light, bake, &quiet)) {
            vshi_warn(run, "'%s' hides %s%s from all other objects; --no-cast '%s' lets it through", name,
                      i < lights ? "light " : "the sky", i < lights ? light->name : "", name);
        }
    }
    vshi_triangles_free(triangles);
}

void vshi_warn_hidden_lights(const vshi_scene_bake *bake, const vsh_run *run) {
    if (run->warning == NULL) {
        return;
    }
    for (size_t i = 0; i < bake->scene.caster_count; ++i) {
        const vsh_caster *caster = &bake->scene.casters[i];
        size_t count = 0;
        const vsh_mesh *meshes = vsh_assets_caster(bake->assets, i, &count);
        count = caster->type == VSH_CASTER_MESH && caster->layer == NULL ? count : 0;
        for (size_t first = 0, next; first < count; first = next) {
            for (next = first + 1; next < count && is_same(&meshes[next], &meshes[first]); ++next) {
            }
            find_hidden_lights(bake, &meshes[first], next - first, run);
        }
    }
}
