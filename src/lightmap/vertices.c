/* Vertex colours by least squares over points on the faces (Kavan, Bargteil and Sloan, "Least squares vertex
 * baking", 2011). A vertex itself is often hidden inside a neighbour, and its own value is not the mean of
 * the triangles around it. */
#include "base/memory.h"
#include "geometry/edges.h"
#include "lightmap/page.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Weight of a squared difference along an edge, as a share of the triangle's area. It decides for vertices
 * without points, and moves the others by less than the points' noise does. */
static const double SMOOTH = 1e-3;
/* Sweeps end when no colour with points moves by more than this, far less than the points' noise. */
static const double SETTLED = 1e-4;
enum { SWEEPS = 400 };

typedef struct fit {
    const vsh_charts *charts;
    const float *coverage, *values;
    size_t channels, vertex_count, triangle_count;
    size_t *first;          /* [meshes + 1]: number of each mesh's first vertex */
    uint32_t *weld;         /* [vertex_count]: the first vertex that shares the colour */
    uint32_t *corners;      /* [triangle_count][3]: vertices, welded */
    uint32_t *begin, *list; /* corners of each vertex, as of vshi_list_groups() */
    float *matrix;          /* [triangle_count][3][3]: the triangle's part of the normal equations */
    vshi_vec *right, *x;    /* [vertex_count] */
} fit;

/* Cuts a colour to 0 … 1, as files hold no others. */
static vshi_vec cut(vshi_vec v) {
    return (vshi_vec){fmin(fmax(v.x, 0.0), 1.0), fmin(fmax(v.y, 0.0), 1.0), fmin(fmax(v.z, 0.0), 1.0)};
}

/* A valid point. Begins as zeros. */
typedef struct fit_point {
    size_t next, triangle; /* next: number of the point after it */
    double area;           /* the triangle's, over the number of its points */
    double weight[3];
    vshi_vec value;
} fit_point;

static bool next_point(const fit *f, fit_point *p) {
    const size_t *points = f->charts->points;
    for (; p->next < f->charts->info.samples; ++p->next) {
        const size_t place = vsh_texel_place(vshi_point_texel(f->charts, p->next), f->charts->info.width);
        if (f->coverage[place] == 1.0f) {
            const float *v = f->values + f->channels * place;
            while (points[p->triangle + 1] <= p->next) {
                ++p->triangle;
            }
            p->area = vshi_point_area(f->charts, p->triangle);
            p->value =
                cut(f->channels == 3 ? vshi_vec_off(v) : (vshi_vec){(double)*v, (double)*v, (double)*v});
            vshi_point_weights(f->charts, p->triangle, p->next++, p->weight);
            return true;
        }
    }
    return false;
}

static void key_of_vertex(const void *user, size_t vertex, uint64_t key[VSHI_KEY_WORDS]) {
    const fit *f = user;
    const size_t m = vshi_find_group(f->first, f->charts->sorted.mesh_count, vertex),
                 v = vertex - f->first[m];
    const vsh_mesh *mesh = &f->charts->sorted.meshes[m];
    const vshi_vec at = vshi_sub(vshi_mesh_place(mesh, v), vshi_vec_of(f->charts->centre)); /* for floats */
    const vshi_vec n = mesh->normals != NULL
                           ? vshi_transform_normal(mesh->transform, vshi_vec_off(mesh->normals + 3 * v))
                           : (vshi_vec){0.0, 0.0, 0.0};
    const float all[6] = {(float)at.x + 0.0f, (float)at.y + 0.0f, (float)at.z + 0.0f, /* -0 is 0 */
                          (float)n.x + 0.0f,  (float)n.y + 0.0f,  (float)n.z + 0.0f};
    memcpy(key, all, sizeof all);
}

/* Welds vertices with equal positions and normals, and adds up the equations. Begins with the mean value. */
static vsh_result add_up(fit *f, vsh_error *error) {
    const vshi_charts *sorted = &f->charts->sorted;
    vshi_vec mean = {0.0, 0.0, 0.0};
    double area = 0.0;
    VSHI_TRY(vshi_weld(f->vertex_count, key_of_vertex, f, f->weld, error));
    for (size_t t = 0; t < f->triangle_count; ++t) {
        size_t local;
        const size_t m = vshi_charts_mesh(sorted, t, &local);
        const double count = (double)(f->charts->points[t + 1] - f->charts->points[t]);
        const double smooth = SMOOTH * count * vshi_point_area(f->charts, t);
        for (size_t k = 0; k < 9; ++k) {
            f->matrix[9 * t + k] = (float)((k % 4 == 0 ? 2.0 : -1.0) * smooth);
        }
        for (size_t k = 0; k < 3; ++k) {
            f->corners[3 * t + k] = f->weld[f->first[m] + sorted->meshes[m].indices[3 * local + k]];
        }
    }
    vshi_list_groups(f->corners, 3 * f->triangle_count, (uint32_t)f->vertex_count, f->begin, f->list);
    for (fit_point p = {.next = 0}; next_point(f, &p);) {
        area += p.area;
        mean = vshi_add(mean, vshi_scale(p.value, p.area));
        for (size_t k = 0; k < 9; ++k) {
            f->matrix[9 * p.triangle + k] += (float)(p.area * p.weight[k / 3] * p.weight[k % 3]);
        }
        for (size_t k = 0; k < 3; ++k) {
            vshi_vec *right = &f->right[f->corners[3 * p.triangle + k]];
            *right = vshi_add(*right, vshi_scale(p.value, p.area * p.weight[k]));
        }
    }
    for (size_t v = 0; v < f->vertex_count && area > 0.0; ++v) {
        f->x[v] = vshi_scale(mean, 1.0 / area);
    }
    return VSH_OK;
}

/* Moves a vertex to the best value in range while the others stay; returns the step, 0 without points. */
static double relax(fit *f, size_t vertex) {
    double diagonal = 0.0;
    vshi_vec rest = f->right[vertex];
    for (size_t i = 3 * (size_t)f->begin[vertex]; i < 3 * (size_t)f->begin[vertex + 1]; ++i) {
        const size_t corner = f->list[i / 3], other = f->corners[corner / 3 * 3 + i % 3];
        const double entry = (double)f->matrix[3 * corner + i % 3];
        diagonal += other == vertex ? entry : 0.0;
        rest = other == vertex ? rest : vshi_sub(rest, vshi_scale(f->x[other], entry));
    }
    if (!(diagonal > 0.0)) {
        return 0.0;
    }
    const vshi_vec before = f->x[vertex];
    f->x[vertex] = cut(vshi_scale(rest, 1.0 / diagonal));
    return vshi_length(f->right[vertex]) > 0.0 ? vshi_length(vshi_sub(f->x[vertex], before)) : 0.0;
}

/* Projected Gauss-Seidel (Cryer 1971), forwards and backwards in turn: on one thread, in an order that is
 * always the same. */
static vsh_result solve(fit *f, const vsh_run *run, vsh_error *error) {
    vshi_job *job;
    vsh_result result = VSH_OK;
    VSHI_TRY(vshi_job_open(&job, run, "fit", SWEEPS, "vertex colours", error));
    double most = 1.0;
    for (int sweep = 0; sweep < SWEEPS && most > SETTLED && result == VSH_OK; ++sweep) {
        most = 0.0;
        for (size_t i = 0; i < f->vertex_count; ++i) {
            const size_t v = sweep % 2 == 0 ? i : f->vertex_count - 1 - i;
            most = f->weld[v] == v ? fmax(most, relax(f, v)) : most;
        }
        result = vshi_job_step(job, 1, error);
    }
    vshi_job_end(job);
    return result;
}

/* Finds the error that is left on each mesh. */
static void measure(const fit *f, double *error) {
    double squares = 0.0, area = 0.0;
    size_t mesh = 0;
    for (fit_point p = {.next = 0}; next_point(f, &p);) {
        for (; p.triangle >= f->charts->sorted.first[mesh + 1]; ++mesh) {
            squares = area = 0.0;
        }
        vshi_vec off = p.value;
        for (size_t k = 0; k < 3; ++k) {
            off = vshi_sub(off, vshi_scale(f->x[f->corners[3 * p.triangle + k]], p.weight[k]));
        }
        squares += p.area * vshi_dot(off, off) / 3.0;
        area += p.area;
        error[mesh] = sqrt(squares / area);
    }
}

vsh_result vshi_vertex_colors_fit(const vsh_charts *charts, const float *coverage, const float *values,
                                  size_t channels, const vsh_run *run, vshi_vertex_colors *colors,
                                  vsh_error *error) {
    static const char what[] = "vertex colours";
    const size_t meshes = charts->sorted.mesh_count, triangles = charts->sorted.first[meshes];
    fit f = {charts, coverage, values, channels, .triangle_count = triangles};
    for (size_t m = 0; m < meshes; ++m) {
        f.vertex_count += charts->sorted.meshes[m].vertex_count;
    }
    const size_t vertices = f.vertex_count;
    const vshi_array arrays[] = {VSHI_ARRAY(f.first, meshes + 1),      VSHI_ARRAY(f.weld, vertices),
                                 VSHI_ARRAY(f.corners, 3 * triangles), VSHI_ARRAY(f.begin, vertices + 2),
                                 VSHI_ARRAY(f.list, 3 * triangles),    VSHI_ARRAY(f.matrix, 9 * triangles),
                                 VSHI_ARRAY(f.right, vertices),        VSHI_ARRAY(f.x, vertices)};
    const vshi_array results[] = {{(void **)&colors->values, vertices, sizeof(uint16_t[4])},
                                  VSHI_ARRAY(colors->error, meshes)};
    const double bytes = 60.0 * (double)triangles + 64.0 * (double)vertices;
    vsh_result result;
    *colors = (vshi_vertex_colors){NULL, NULL};
    if (vertices >= UINT32_MAX || triangles > UINT32_MAX / 3) {
        VSHI_TRY_DONE(vshi_fail(error, VSH_ERROR_LIMIT,
                                "%s: %zu vertices of %zu triangles, at most %u of each", what, vertices,
                                triangles, UINT32_MAX / 3));
    }
    VSHI_TRY_DONE(vshi_check_limit(run, bytes, what, error));
    VSHI_TRY_DONE(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(results, what, error));
    for (size_t m = 0; m < meshes; ++m) {
        f.first[m + 1] = f.first[m] + charts->sorted.meshes[m].vertex_count;
    }
    VSHI_TRY_DONE(add_up(&f, error));
    VSHI_TRY_DONE(solve(&f, run, error));
    measure(&f, colors->error);
    for (size_t v = 0; v < vertices; ++v) {
        const vshi_vec x = vshi_scale(f.x[f.weld[v]], UINT16_MAX);
        const uint16_t color[4] = {(uint16_t)lround(x.x), (uint16_t)lround(x.y), (uint16_t)lround(x.z),
                                   UINT16_MAX};
        memcpy(colors->values + 4 * v, color, sizeof color);
    }
done:
    free(f.first); /* the block's first array */
    return result;
}
