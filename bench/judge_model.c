/* Reads a model's triangles in world space, and its solids. */
#include "judge.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void *judge_take(size_t bytes) {
    void *memory = calloc(bytes > 0 ? bytes : 1, 1);
    if (memory == NULL) {
        fputs("judge: the system refused memory\n", stderr);
        exit(4);
    }
    return memory;
}

void judge_give_up(const char *what, const char *why) {
    fprintf(stderr, "judge: %s: %s\n", what, why);
    exit(2);
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static bool normalize(double v[3]) {
    const double length = sqrt(dot(v, v));
    for (int k = 0; k < 3; ++k) {
        v[k] /= length;
    }
    return length > 0.0 && isfinite(length);
}

/* --- the model */

static double transformed(const vsh_mesh *mesh, const float *v, int row) {
    const double *m = mesh->transform;
    return m == NULL ? (double)v[row]
                     : m[4 * row] * v[0] + m[4 * row + 1] * v[1] + m[4 * row + 2] * v[2] + m[4 * row + 3];
}

/* By the cofactors of the transform, which are its inverse's transpose times its determinant. */
static void normal_of(const vsh_mesh *mesh, const float *v, double out[3]) {
    const double *m = mesh->transform;
    for (int k = 0; k < 3; ++k) {
        if (m == NULL) {
            out[k] = (double)v[k];
            continue;
        }
        const double *a = m + 4 * ((k + 1) % 3), *b = m + 4 * ((k + 2) % 3);
        out[k] = (a[1] * b[2] - a[2] * b[1]) * v[0] + (a[2] * b[0] - a[0] * b[2]) * v[1] +
                 (a[0] * b[1] - a[1] * b[0]) * v[2];
    }
}

static bool mirrors(const vsh_mesh *mesh) {
    double columns[3][3];
    static const float axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int k = 0; k < 3; ++k) {
        normal_of(mesh, axes[k],
                  columns[k]); /* cofactors: their determinant is that of the transform, squared */
    }
    return mesh->transform != NULL &&
           dot(columns[0], (double[]){mesh->transform[0], mesh->transform[4], mesh->transform[8]}) < 0.0;
}

static bool take_triangle(const vsh_mesh *mesh, const uint32_t *corner, bool flip, judge_triangle *t) {
    for (int c = 0; c < 3; ++c) {
        const uint32_t v = corner[flip ? 2 - c : c];
        for (int k = 0; k < 3; ++k) {
            t->p[c][k] = transformed(mesh, mesh->positions + 3 * (size_t)v, k);
        }
        for (int k = 0; k < 2; ++k) {
            t->uv[c][k] = mesh->uvs != NULL ? (double)mesh->uvs[2 * (size_t)v + (size_t)k] : (double)NAN;
        }
    }
    double e[2][3];
    for (int k = 0; k < 3; ++k) {
        e[0][k] = t->p[1][k] - t->p[0][k];
        e[1][k] = t->p[2][k] - t->p[0][k];
    }
    for (int k = 0; k < 3; ++k) {
        t->g[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
    }
    if (!normalize(t->g)) {
        return false;
    }
    t->bend = 0.0;
    for (int c = 0; c < 3; ++c) {
        memcpy(t->n[c], t->g, sizeof t->g);
        if (mesh->normals != NULL) {
            normal_of(mesh, mesh->normals + 3 * (size_t)corner[flip ? 2 - c : c], t->n[c]);
            if (flip) {
                for (int k = 0; k < 3; ++k) {
                    t->n[c][k] = -t->n[c][k];
                }
            }
            if (!normalize(t->n[c])) {
                memcpy(t->n[c], t->g, sizeof t->g);
            }
        }
        t->bend = fmax(t->bend, acos(fmin(1.0, fmax(-1.0, dot(t->n[c], t->g)))));
    }
    return true;
}

judge_triangle *judge_take_triangles(const vsh_mesh *meshes, size_t mesh_count, size_t *count, double low[3],
                                     double high[3]) {
    size_t all = 0;
    for (size_t m = 0; m < mesh_count; ++m) {
        all += meshes[m].triangle_count;
    }
    judge_triangle *triangles = judge_take(all * sizeof *triangles);
    *count = 0;
    for (size_t m = 0; m < mesh_count; ++m) {
        const bool flip = mirrors(&meshes[m]);
        for (size_t i = 0; i < meshes[m].triangle_count; ++i) {
            judge_triangle *t = &triangles[*count];
            t->mesh = (uint32_t)m;
            *count += take_triangle(&meshes[m], meshes[m].indices + 3 * i, flip, t) ? 1 : 0;
            for (int c = 0; c < 9; ++c) {
                low[c % 3] = fmin(low[c % 3], t->p[c / 3][c % 3]);
                high[c % 3] = fmax(high[c % 3], t->p[c / 3][c % 3]);
            }
        }
    }
    return triangles;
}

/* --- solids: "v" and "f" of an OBJ; convex faces become fans */

judge_shape judge_read_solids(const char *path, const char *kind) {
    FILE *file = fopen(path, "r");
    if (file == NULL) {
        judge_give_up(path, "cannot be opened");
    }
    judge_shape s = {.low = {INFINITY, INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY, -INFINITY}};
    size_t room = 1 << 16;
    char line[1024];
    bool wanted = false;
    s.positions = judge_take(room * 3 * sizeof *s.positions);
    s.indices = judge_take(room * 6 * sizeof *s.indices);
    while (fgets(line, sizeof line, file) != NULL) {
        if (s.vertices + 64 > room || s.triangles + 64 > 2 * room) {
            room *= 2;
            s.positions = realloc(s.positions, room * 3 * sizeof *s.positions);
            s.indices = realloc(s.indices, room * 6 * sizeof *s.indices);
            if (s.positions == NULL || s.indices == NULL) {
                judge_give_up(path, "no memory");
            }
        }
        if (line[0] == 'o') {
            wanted = strncmp(line + 2, kind, strlen(kind)) == 0; /* other objects only count for the size */
        } else if (line[0] == 'v') {
            float *p = s.positions + 3 * s.vertices++;
            if (sscanf(line + 1, "%f %f %f", &p[0], &p[1], &p[2]) != 3) {
                judge_give_up(path, line);
            }
            for (int k = 0; k < 3; ++k) {
                s.low[k] = fmin(s.low[k], (double)p[k]);
                s.high[k] = fmax(s.high[k], (double)p[k]);
            }
        } else if (line[0] == 'f' && wanted) {
            uint32_t first = 0, last = 0, corner = 0;
            char *at = line + 1;
            for (unsigned n = 0; (corner = (uint32_t)strtoul(at, &at, 10)) != 0; ++n) {
                if (n >= 2) {
                    const uint32_t fan[3] = {first - 1, last - 1, corner - 1};
                    memcpy(s.indices + 3 * s.triangles++, fan, sizeof fan);
                }
                first = n == 0 ? corner : first;
                last = corner;
            }
        }
    }
    fclose(file);
    return s;
}

void judge_position(const judge_triangle *t, double column, double row, double size, double at[3],
                    double n[3]) {
    const double u = column / size, v = 1.0 - row / size;
    double b[3], whole = 0.0, normal[3] = {0};
    for (int c = 0; c < 3; ++c) {
        const double *p = t->uv[(c + 1) % 3], *q = t->uv[(c + 2) % 3];
        b[c] = (p[0] - u) * (q[1] - v) - (p[1] - v) * (q[0] - u);
        whole += b[c];
    }
    for (int k = 0; k < 3; ++k) {
        at[k] = 0.0;
        for (int c = 0; c < 3; ++c) {
            at[k] += b[c] / whole * t->p[c][k];
            normal[k] += b[c] / whole * t->n[c][k];
        }
    }
    if (n != NULL) {
        memcpy(n, normalize(normal) ? normal : t->g, 3 * sizeof *n);
    }
}
