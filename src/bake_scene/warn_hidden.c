/* Warns of a light that one object hides from all others: a sky dome hides the sun, a bulb its own lamp. The
 * shadow planes show which lights are hidden. Rays then find the object. */
#include "bake/planes.h"
#include "bake_scene/warn.h"
#include "base/job.h"
#include "light/light.h"
#include "light/view.h"
#include "mesh/enclosure.h"
#include "trace/embree.h"

#include <string.h>

enum { POINTS = 64 /* on each mesh */, RAYS = 16 /* from a point to a light */ };

static const char *name_of(const vsh_mesh *mesh) {
    const char *name = mesh->object_name != NULL ? mesh->object_name : mesh->name;
    return name != NULL ? name : "";
}

static bool is_same(const vsh_mesh *a, const vsh_mesh *b) {
    return strcmp(name_of(a), name_of(b)) == 0;
}

/* Notes what reaches a texel of a mesh. */
static void note_texel(const vshi_job_page *page, size_t texel, const vsh_mesh *mesh) {
    const vsh_lightmap *planes = &page->channels.lightmap;
    const size_t lights = page->job->scene.light_count;
    for (size_t i = 0; i <= lights; ++i) {
        const float *plane = i == lights ? planes->sky : planes->shadow != NULL ? planes->shadow[i] : NULL;
        vshi_lit *so_far = &page->job->lit[i];
        if (plane != NULL && !so_far->several && so_far->mesh != mesh && plane[texel] > 0.0f) {
            so_far->several = so_far->mesh != NULL && !is_same(so_far->mesh, mesh);
            so_far->mesh = mesh;
        }
    }
}

void vshi_note_lit(const vshi_job_page *page) {
    for (size_t i = 0; i < page->page.width * page->page.height; ++i) {
        const uint32_t mesh = page->page.mesh[i];
        if (mesh > 0 && page->channels.lightmap.coverage[i] == 1.0f) {
            note_texel(page, i, &page->target->meshes[mesh - 1]);
        }
    }
}

static bool is_in_box(const vsh_triangles *triangles, const double at[3]) {
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
static bool hides_light(const vsh_mesh *own, size_t parts, vsh_triangles **triangles, const vsh_light *light,
                        const vshi_targets *targets, const vsh_run *run) {
    size_t facing = 0;
    for (size_t t = 0; t < targets->count; ++t) {
        for (size_t m = 0; m < targets->list[t].mesh_count; ++m) {
            const vsh_mesh *mesh = &targets->list[t].meshes[m];
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
                if (*triangles == NULL && vsh_triangles_create(own, parts, run, triangles, NULL) != VSH_OK) {
                    return false; /* no bake fails for a hint */
                }
                const bool lamp =
                    light->type != VSH_LIGHT_DIRECTIONAL && is_in_box(*triangles, light->position);
                vsh_trace_shadow(*triangles, NULL, 1, at, NULL, 0.0, light, RAYS, run, &seen, NULL);
                if (seen > 0.0f || is_in_box(*triangles, at) == lamp) {
                    return false;
                }
                ++facing;
            }
        }
    }
    return facing > 0;
}

static void look_at(const vsh_bake_job *job, const vsh_mesh *own, size_t parts, const vsh_run *run) {
    const size_t lights = job->scene.light_count;
    const char *name = name_of(own);
    vsh_triangles *triangles = NULL;
    vsh_light zenith = vsh_light_default();
    vsh_run quiet = *run;
    quiet.progress = NULL;
    quiet.warning = NULL;
    quiet.memory_held += job->report.occluders.field_bytes + job->report.occluders.triangles_bytes;
    vshi_sky_up(job->scene.planes.sky, zenith.direction);
    for (size_t i = 0; i < lights + (job->scene.planes.sky != VSH_UP_NONE); ++i) {
        const vsh_light *light = i < lights ? &job->scene.lights[i] : &zenith;
        const vsh_mesh *lit = job->lit[i].mesh;
        /* the sun may shine on a dome from outside; a lamp that lights its room is not hidden */
        const bool lights_own = light->type == VSH_LIGHT_DIRECTIONAL && lit != NULL && is_same(lit, own);
        if (!job->lit[i].several && (lit == NULL || lights_own) &&
            hides_light(own, parts, &triangles, light, &job->targets, &quiet)) {
            vshi_warn(run, "'%s' hides %s%s from all other objects; --no-cast '%s' lets it through", name,
                      i < lights ? "light " : "the sky", i < lights ? light->name : "", name);
        }
    }
    vsh_triangles_free(triangles);
}

void vshi_warn_hidden_lights(const vsh_bake_job *job, const vsh_run *run) {
    if (run->warning == NULL) {
        return;
    }
    for (size_t i = 0; i < job->scene.caster_count; ++i) {
        const vsh_caster *caster = &job->scene.casters[i];
        size_t count = 0;
        const vsh_mesh *meshes = vsh_assets_caster(job->assets, i, &count);
        count = caster->type == VSH_CASTER_MESH && caster->layer == NULL ? count : 0;
        for (size_t first = 0, next; first < count; first = next) {
            for (next = first + 1; next < count && is_same(&meshes[next], &meshes[first]); ++next) {
            }
            look_at(job, &meshes[first], next - first, run);
        }
    }
}
