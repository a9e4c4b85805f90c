/* Where the camera stands: where it is told to, or as near as it sees everything. */
#include "cli/message.h"
#include "render.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double degree = 0.017453292519943295;
/* A three-quarter view from a little above. */
static const double azimuth_deg = 35.0, elevation_deg = 25.0;

static size_t count_vertices(const vsh_lit_meshes *lit, size_t count) {
    size_t vertices = 0;
    for (size_t i = 0; i < count; ++i) {
        for (size_t m = 0; m < lit[i].mesh_count; ++m) {
            vertices += lit[i].meshes[m].vertex_count;
        }
    }
    return vertices;
}

/* A mesh's vertices in the world, those that its triangles use. */
static bool add_vertices(const vsh_mesh *mesh, double *points, size_t *count) {
    static const double identity[12] = {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    const double *t = mesh->transform != NULL ? mesh->transform : identity;
    bool *used = calloc(mesh->vertex_count + 1, sizeof *used);
    if (used == NULL) {
        return false;
    }
    for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) {
        used[mesh->indices[i]] = true;
    }
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        const float *p = mesh->positions + 3 * v;
        double *to = points + 3 * *count;
        for (int row = 0; row < 3; ++row) {
            to[row] = t[4 * row] * (double)p[0] + t[4 * row + 1] * (double)p[1] +
                      t[4 * row + 2] * (double)p[2] + t[4 * row + 3];
        }
        *count += used[v] && isfinite(to[0]) && isfinite(to[1]) && isfinite(to[2]);
    }
    free(used);
    return true;
}

static void add_box(const vsh_field *field, double *points, size_t *count) {
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    for (int corner = 0; corner < 8; ++corner) {
        double *point = points + 3 * (*count)++;
        for (int axis = 0; axis < 3; ++axis) {
            point[axis] = corner >> axis & 1 ? info.bounds_max[axis] : info.bounds_min[axis];
        }
    }
}

/* What is to be seen: vertices of meshes, and the corners of the boxes around surfaces. [*count][3] */
static double *find_points(const render_surfaces *seen, const vsh_render_options *o, size_t *count) {
    const size_t room = 8 * seen->count + count_vertices(o->lit, o->lit_count) + 1;
    double *points = malloc(3 * room * sizeof *points);
    bool done = points != NULL;
    *count = 0;
    for (size_t i = 0; done && i < seen->count; ++i) {
        add_box(seen->surfaces[i].field, points, count);
    }
    for (size_t i = 0; done && i < o->lit_count; ++i) {
        for (size_t m = 0; done && m < o->lit[i].mesh_count; ++m) {
            done = add_vertices(&o->lit[i].meshes[m], points, count);
        }
    }
    if (!done) {
        free(points);
        return NULL;
    }
    return points;
}

/* Frames the box around points, so that all of it is seen from any angle of --orbit. */
static vsh_result frame_box(const render_settings *s, size_t count, const double *points, vsh_camera *camera,
                            vsh_error *error) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < 3 * count; ++i) {
        low[i % 3] = fmin(low[i % 3], points[i]);
        high[i % 3] = fmax(high[i % 3], points[i]);
    }
    return vsh_camera_frame(camera, low, high, azimuth_deg * degree, elevation_deg * degree,
                            (double)s->width / (double)s->height, error);
}

int render_camera_place(const render_settings *s, const render_surfaces *seen, vsh_render_options *o) {
    vsh_camera *camera = &o->camera;
    vsh_error error;
    size_t count;
    double *points = find_points(seen, o, &count);
    if (points == NULL) {
        return cli_out_of_memory("camera");
    }
    memcpy(camera->up, s->up, sizeof camera->up);
    camera->fov = s->fov_deg * degree;
    const bool near = s->orbit_deg == 0.0 && !s->has_camera;
    const vsh_result result =
        near ? vsh_camera_frame_points(camera, count, points, azimuth_deg * degree, elevation_deg * degree,
                                       (double)s->width / (double)s->height, &error)
             : frame_box(s, count, points, camera, &error);
    free(points);
    if (s->has_camera) {
        memcpy(camera->position, s->camera, sizeof camera->position);
    }
    if (s->has_look_at) {
        memcpy(camera->target, s->look_at, sizeof camera->target);
    }
    if (result != VSH_OK || vsh_camera_check(camera, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    if (!near) {
        vsh_camera_orbit(camera, s->orbit_deg * degree);
    }
    return CLI_OK;
}
