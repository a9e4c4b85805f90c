/* Warns of lights that one caster hides from all receivers: a sky dome hides the sun, a bulb its own lamp.
 * The caster's box must hold the receivers, or the lamp: a crate may well lie in the shade of a wall. Points
 * on the receivers stand for their texels. */
#include "bake_scene/warn.h"

#include "bake/planes.h"
#include "base/job.h"
#include "base/memory.h"
#include "light/light.h"
#include "light/view.h"
#include "mesh/enclosure.h"
#include "shade/occluders.h"
#include "trace/embree.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    POINTS = 4096, /* half of them by area, half of them shared alike by the receivers */
    FIRST = 64,    /* of them, which nearly always find the light */
    STRIDE = 1571, /* prime: the first points come from all over the receivers */
    RAYS = 16,     /* from a point to a light */
    NAMED = 2      /* receivers that the warning names */
};
/* Tolerance for receivers that end at the caster's box, in its diagonals: rounding. */
static const double ROUNDING = 1e-6;
/* Cosine with the sky's axis: such points see no more than the sky. */
static const double LEVEL = 0.999;

typedef struct box {
    vshi_vec low, high;
} box;

typedef struct receiving {
    const vsh_mesh *mesh;
    box box;
    double area; /* once points are spread */
} receiving;

/* An object that may hide lights. */
typedef struct hider {
    const vsh_mesh *meshes;
    size_t count;
    box box;
} hider;

typedef struct points {
    size_t count;
    double position[POINTS][3];
    float normal[POINTS][3];
} points;

typedef struct search {
    const vsh_bake_job *job;
    const vsh_run *run;
    vsh_run quiet;
    receiving *list; /* [count] */
    size_t count;
    const vsh_mesh *left_out; /* of the object that gets no points; NULL: all get some */
    points all;
    points facing; /* the points that face the light */
    float seen[POINTS];
} search;

static const char *name_of(const vsh_mesh *mesh) {
    const char *name = mesh->object_name != NULL ? mesh->object_name : mesh->name;
    return name != NULL ? name : "";
}

static bool is_same(const vsh_mesh *a, const vsh_mesh *b) {
    return strcmp(name_of(a), name_of(b)) == 0;
}

/* --- boxes */

/* The C library's fmin() and fmax() are calls, and take most of the time. */
static double lower(double a, double b) {
    return a < b ? a : b;
}

static double upper(double a, double b) {
    return a > b ? a : b;
}

static void grow(box *b, const vsh_mesh *mesh) {
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        const vshi_vec p = vshi_transform_point(mesh->transform, vshi_vec_off(mesh->positions + 3 * v));
        b->low = (vshi_vec){lower(b->low.x, p.x), lower(b->low.y, p.y), lower(b->low.z, p.z)};
        b->high = (vshi_vec){upper(b->high.x, p.x), upper(b->high.y, p.y), upper(b->high.z, p.z)};
    }
}

static box box_of(const vsh_mesh *meshes, size_t count) {
    box b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (size_t m = 0; m < count; ++m) {
        grow(&b, &meshes[m]);
    }
    return b;
}

static bool holds(const box *outer, const box *inner, double room) {
    return inner->low.x >= outer->low.x - room && inner->high.x <= outer->high.x + room &&
           inner->low.y >= outer->low.y - room && inner->high.y <= outer->high.y + room &&
           inner->low.z >= outer->low.z - room && inner->high.z <= outer->high.z + room;
}

/* Whether the hider's box holds all receivers but itself. */
static bool holds_receivers(const search *s, const hider *h) {
    const double room = ROUNDING * vshi_length(vshi_sub(h->box.high, h->box.low));
    for (size_t i = 0; i < s->count; ++i) {
        if (!holds(&h->box, &s->list[i].box, room) && !is_same(s->list[i].mesh, h->meshes)) {
            return false;
        }
    }
    return true;
}

static bool holds_lamp(const hider *h, const vsh_light *light) {
    const vshi_vec at = vshi_vec_of(light->position);
    const box lamp = {at, at};
    return light->type != VSH_LIGHT_DIRECTIONAL && holds(&h->box, &lamp, 0.0);
}

/* --- points */

static double area_vector(const vsh_mesh *mesh, size_t triangle, vshi_vec corner[3], vshi_vec *normal) {
    vshi_mesh_triangle(mesh, triangle, corner);
    *normal = vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0]));
    return 0.5 * vshi_length(*normal);
}

static void add_point(points *p, vshi_vec at, vshi_vec normal) {
    const vshi_vec n = vshi_unit(normal);
    double *position = p->position[p->count];
    float *out = p->normal[p->count++];
    position[0] = at.x, position[1] = at.y, position[2] = at.z;
    out[0] = (float)n.x, out[1] = (float)n.y, out[2] = (float)n.z;
}

/* Measures the receivers that get points; returns how many they are. */
static size_t measure(search *s, double *area) {
    vshi_vec corner[3], normal;
    size_t count = 0;
    *area = 0.0;
    for (size_t i = 0; i < s->count; ++i) {
        receiving *r = &s->list[i];
        r->area = 0.0;
        if (s->left_out == NULL || !is_same(r->mesh, s->left_out)) {
            for (size_t t = 0; t < r->mesh->triangle_count; ++t) {
                r->area += area_vector(r->mesh, t, corner, &normal);
            }
            count += r->area > 0.0;
            *area += r->area;
        }
    }
    return count;
}

static void spread_points(search *s, const vsh_mesh *left_out) {
    double area, reached = 0.0;
    s->left_out = left_out;
    s->all.count = 0;
    const size_t count = measure(s, &area);
    vshi_vec corner[3], normal;
    for (size_t i = 0; i < s->count; ++i) {
        const receiving *r = &s->list[i];
        const double weight = 0.5 * POINTS * (1.0 / area + 1.0 / ((double)count * r->area));
        for (size_t t = 0; t < r->mesh->triangle_count && r->area > 0.0; ++t) {
            reached += weight * area_vector(r->mesh, t, corner, &normal);
            while (s->all.count < POINTS && reached >= (double)s->all.count + 0.5) {
                add_point(&s->all, vshi_point_in(corner, s->all.count), normal);
            }
        }
    }
}

/* Keeps the points that would see some of the light if nothing were in its way; false where one is in it. */
static bool keep_facing(search *s, const vsh_light *light) {
    const vshi_light_place place = vshi_light_in_world(light);
    s->facing.count = 0;
    for (size_t k = 0; k < POINTS; ++k) {
        const size_t i = k * STRIDE % POINTS;
        if (i >= s->all.count) {
            continue;
        }
        const vshi_vec at = vshi_vec_of(s->all.position[i]), normal = vshi_vec_off(s->all.normal[i]);
        vshi_light_view view;
        const vshi_light_side side = vshi_light_look(&place, at, false, &view);
        if (side == VSHI_LIGHT_WITHIN) {
            return false;
        }
        if (side == VSHI_LIGHT_SEEN && vshi_dot(normal, view.axis) > 0.0 &&
            vshi_light_gain(light, view.axis, view.distance) > 0.0) {
            add_point(&s->facing, at, normal);
        }
    }
    return true;
}

/* Keeps the points that face up. */
static void keep_level(search *s, int32_t axis) {
    double up[3];
    vshi_sky_up(axis, up);
    s->facing.count = 0;
    for (size_t k = 0; k < POINTS; ++k) {
        const size_t i = k * STRIDE % POINTS;
        if (i < s->all.count && vshi_dot(vshi_vec_off(s->all.normal[i]), vshi_vec_of(up)) > LEVEL) {
            add_point(&s->facing, vshi_vec_of(s->all.position[i]), vshi_vec_off(s->all.normal[i]));
        }
    }
}

/* Whether the triangles hide a light, or (NULL) the sky, from all points that face it. */
static bool hide_all(search *s, const vsh_triangles *triangles, const vsh_light *light) {
    const points *p = &s->facing;
    const double lift = vshi_triangles_lift(triangles);
    for (size_t first = 0, count; first < p->count; first += count) {
        count = first == 0 && p->count > FIRST ? FIRST : p->count - first;
        const vsh_result result =
            light != NULL ? vsh_trace_shadow(triangles, NULL, count, p->position[first], p->normal[first],
                                             lift, light, RAYS, &s->quiet, s->seen, NULL)
                          : vsh_trace_ao(triangles, NULL, count, p->position[first], p->normal[first], lift,
                                         INFINITY, RAYS, &s->quiet, s->seen, NULL);
        for (size_t i = 0; i < count; ++i) {
            if (result != VSH_OK || s->seen[i] > 0.0f) {
                return false;
            }
        }
    }
    return p->count > 0;
}

/* --- what is said */

/* "'ground', 'house' and 3 more"; returns how many there are. */
static size_t name_receivers(const search *s, const hider *h, char *text, size_t size) {
    const vsh_mesh *last = NULL;
    size_t count = 0, used = 0;
    for (size_t i = 0; i < s->count; ++i) {
        const vsh_mesh *mesh = s->list[i].mesh;
        if (is_same(mesh, h->meshes) || (last != NULL && is_same(mesh, last))) {
            continue;
        }
        last = mesh;
        if (count++ < NAMED) {
            used += (size_t)snprintf(text + used, size - used, "%s'%.100s'", count > 1 ? ", " : "",
                                     name_of(mesh));
        }
    }
    if (count > NAMED) {
        snprintf(text + used, size - used, " and %zu more", count - NAMED);
    }
    return count;
}

static void warn(const search *s, const hider *h, const vsh_light *light, bool beside) {
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-.";
    char names[300], what[100] = "the sky";
    const char *hides = name_of(h->meshes);
    const char *quote = hides[0] != '\0' && hides[strspn(hides, plain)] == '\0' ? "" : "'";
    const size_t count = name_receivers(s, h, names, sizeof names);
    if (light != NULL) {
        snprintf(what, sizeof what, "light '%s'", light->name);
    }
    if (count == 0) {
        return;
    }
    const char *whom = beside ? "the light" : count > 1 ? "them" : "it";
    vshi_warn(s->run, "%s reaches no texel of %s: '%s' encloses %s; --no-cast %s%s%s lets it through", what,
              names, hides, whom, quote, hides, quote);
}

/* --- search */

static void look_at(search *s, const hider *h) {
    const vsh_scene *scene = &s->job->scene;
    const bool around = holds_receivers(s, h);
    const vsh_triangles *all = s->job->occluders->triangles; /* made already: they nearly always end it */
    vsh_triangles *own = NULL;
    s->all.count = 0;
    for (size_t i = 0; i <= scene->light_count; ++i) {
        const vsh_light *light = i < scene->light_count ? &scene->lights[i] : NULL;
        const bool lamp = light != NULL && holds_lamp(h, light);
        if ((!around && !lamp) || (light == NULL && scene->planes.sky == VSH_UP_NONE)) {
            continue;
        }
        /* a lamp is meant to light the room that it is in, and the sun no dome from outside */
        const vsh_mesh *left_out = lamp ? NULL : h->meshes;
        if (s->all.count == 0 || s->left_out != left_out) {
            spread_points(s, left_out);
        }
        if (light == NULL) {
            keep_level(s, scene->planes.sky);
        } else if (!keep_facing(s, light)) {
            continue;
        }
        if (all != NULL && !hide_all(s, all, light)) {
            continue;
        }
        if (own == NULL && vsh_triangles_create(h->meshes, h->count, &s->quiet, &own, NULL) != VSH_OK) {
            return; /* this is a hint: no bake fails for it */
        }
        if (hide_all(s, own, light)) {
            warn(s, h, light, !around);
        }
    }
    vsh_triangles_free(own);
}

static bool list_receivers(search *s) {
    const vshi_targets *targets = &s->job->targets;
    for (size_t i = 0; i < targets->count; ++i) {
        s->count += targets->list[i].mesh_count;
    }
    s->list = calloc(s->count + 1, sizeof *s->list);
    for (size_t i = 0, at = 0; i < targets->count && s->list != NULL; ++i) {
        for (size_t m = 0; m < targets->list[i].mesh_count; ++m) {
            const vsh_mesh *mesh = &targets->list[i].meshes[m];
            s->list[at++] = (receiving){mesh, box_of(mesh, 1), 0.0};
        }
    }
    return s->list != NULL;
}

void vshi_warn_hidden_lights(const vsh_bake_job *job, const vsh_run *run) {
    const vsh_scene *scene = &job->scene;
    const bool lit = scene->light_count > 0 || scene->planes.sky != VSH_UP_NONE;
    if (run->warning == NULL || !lit || scene->tile != NULL || !vsh_triangles_available()) {
        return; /* a tile's lights reach other tiles */
    }
    search *s = calloc(1, sizeof *s);
    if (s == NULL) {
        return;
    }
    s->job = job;
    s->run = run;
    s->quiet = *run;
    s->quiet.progress = NULL;
    s->quiet.warning = NULL;
    s->quiet.memory_held += job->report.occluders.field_bytes + job->report.occluders.triangles_bytes;
    const bool listed = list_receivers(s);
    for (size_t i = 0; i < scene->caster_count && listed; ++i) {
        size_t count = 0;
        const vsh_mesh *meshes = vsh_assets_caster(job->assets, i, &count);
        const bool casts = scene->casters[i].type == VSH_CASTER_MESH && scene->casters[i].layer == NULL;
        for (size_t first = 0, next; first < count && casts; first = next) {
            for (next = first + 1; next < count && is_same(&meshes[next], &meshes[first]); ++next) {
            }
            const hider h = {&meshes[first], next - first, box_of(&meshes[first], next - first)};
            look_at(s, &h);
        }
    }
    free(s->list);
    free(s);
}
