#include "bake_scene/warn.h"

#include "base/job.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <vdbshade/bake_scene.h>

static const char *name_of(const vsh_mesh *mesh) {
    return mesh->name != NULL ? mesh->name : "";
}

static const char *object_of(const vsh_mesh *mesh) {
    return mesh->object_name != NULL ? mesh->object_name : name_of(mesh);
}

static void warn_mesh(const char *path, const vsh_mesh *mesh, const vsh_uv_report *uv, const vsh_run *run) {
    const char *name = name_of(mesh);
    if (uv->overlap_texels > uv->other_texels) {
        vshi_warn(run,
                  "%s: mesh '%s': %zu texels of %zu triangles lie over other charts of the same object; "
                  "unwrap it anew",
                  path, name, uv->overlap_texels - uv->other_texels, uv->overlap_triangles);
    }
    if (uv->other_texels > 0) {
        vshi_warn(run,
                  "%s: mesh '%s': %zu texels lie over charts of other objects; use --per-object or one atlas",
                  path, name, uv->other_texels);
    }
    if (uv->outside_triangles > 0) {
        vshi_warn(run,
                  "%s: mesh '%s': %zu triangles leave the UV square; the parts outside are not baked; "
                  "--uv-set N chooses another set",
                  path, name, uv->outside_triangles);
    }
    if (uv->degenerate_triangles > 0) {
        vshi_warn(run,
                  "%s: mesh '%s': %zu triangles have no area in the UV set and are not baked; unwrap them",
                  path, name, uv->degenerate_triangles);
    }
}

/* Where some charts lie over others, that has been told. */
static void warn_close(const vshi_target *target, const vsh_uv_report *reports, const vsh_run *run) {
    const vsh_receiver *receiver = &target->receiver;
    for (size_t m = 0; m < target->mesh_count; ++m) {
        if (reports[m].overlap_texels > 0) {
            return;
        }
    }
    vsh_run silent = *run;
    silent.warning = NULL;
    vsh_closeness close;
    if (vsh_charts_closeness(target->meshes, target->mesh_count, receiver->width, receiver->height, &silent,
                             &close, NULL) != VSH_OK ||
        close.texels == 0) {
        return; /* no more than a hint: nothing is refused for the want of it */
    }
    const double larger = receiver->width > receiver->height ? receiver->width : receiver->height;
    const double apart = close.gap > 0.0 ? ceil(larger / close.gap) : INFINITY;
    char help[128] = "they touch, so no size parts them; unwrap with a margin";
    if (apart <= VSH_MAX_LIGHTMAP_SIZE) {
        snprintf(help, sizeof help, "from --size %.0f on they are apart", apart);
    }
    vshi_warn(run,
              "%s: charts lie closer than a texel to each other along %" PRIu64 " texels, %" PRIu64
              " of them of mesh '%s': values bleed between them; %s",
              receiver->path, close.texels, close.mesh_texels, name_of(&target->meshes[close.mesh]), help);
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
    static const double full = 0.6; /* the share that charts cover of a page without padding, about */
    const vsh_receiver *receiver = &target->receiver;
    const double share = (double)covered / ((double)receiver->width * (double)receiver->height);
    const bool chosen = receiver->objects.only_count > 0 || receiver->objects.except_count > 0;
    if (share >= least || (chosen && !target->unwrapped) || (target->page > 0 && target->object == NULL)) {
        return; /* other objects fill the rest of the layout; the last page need not be full */
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
    for (size_t m = 0; m < target->mesh_count; ++m) {
        warn_mesh(target->receiver.path, &target->meshes[m], &reports[m], run);
    }
    if (run->warning != NULL && target->receiver.type != VSH_RECEIVER_HEIGHTFIELD) { /* that is one chart */
        warn_close(target, reports, run);
        warn_covered(target, covered, run);
    }
}

static vsh_result refuse_empty(const vshi_target *target, const vsh_uv_report *reports, vsh_error *error) {
    const vsh_receiver *receiver = &target->receiver;
    size_t triangles = 0, outside = 0, flat = 0;
    for (size_t m = 0; m < target->mesh_count; ++m) {
        triangles += target->meshes[m].triangle_count;
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

/* Objects that each fill a unit square of their own are not one lightmap, whatever its size. */
vsh_result vshi_refuse_uvs(const vshi_target *target, const vsh_uv_report *reports, uint64_t covered,
                           bool allow_overlap, vsh_error *error) {
    if (covered == 0) {
        return refuse_empty(target, reports, error);
    }
    const vsh_receiver *receiver = &target->receiver;
    const vsh_uv_report *worst = reports;
    uint64_t texels = 0;
    size_t count = 0;
    for (size_t i = 0; i < target->mesh_count; ++i) {
        texels += reports[i].other_texels;
        count += reports[i].other_texels > 0;
        worst = reports[i].other_texels > worst->other_texels ? &reports[i] : worst;
    }
    if (allow_overlap || receiver->allow_overlap || (double)texels <= VSH_LARGEST_OVERLAP * (double)covered) {
        return VSH_OK;
    }
    return vshi_fail(
        error, VSH_ERROR_INPUT,
        "%s: objects share texels of the lightmap: %zu of %zu meshes lie over others, on %" PRIu64
        " texels (%" PRIu64 " are covered at all); '%.100s' on %zu, %zu of them over '%.100s': "
        "give each object an image of its own (--per-object), choose some (--receive NAME), or "
        "unwrap them together into one atlas (in Blender: select all, edit mode, UV > Smart UV "
        "Project); \"allow_overlap\": true of a scene's receiver bakes it as it is",
        receiver->path, count, target->mesh_count, texels, covered,
        object_of(&target->meshes[worst - reports]), worst->other_texels, worst->other_mesh_texels,
        object_of(&target->meshes[worst->other_mesh]));
}
