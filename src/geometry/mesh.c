#include "geometry/mesh.h"

#include "base/memory.h"
#include "base/vec.h"

#include <stdio.h>
#include <string.h>

vshi_mesh_name vshi_mesh_label(const vsh_mesh *mesh, size_t index) {
    vshi_mesh_name name;
    if (mesh->name != NULL && mesh->name[0] != '\0') {
        const int written = snprintf(name.text, sizeof name.text, "mesh '%s'", mesh->name);
        if (written >= (int)sizeof name.text) {
            /* Room for "…'", without leaving half a UTF-8 character before it. */
            size_t end = sizeof name.text - 5;
            while (end > 0 && ((unsigned char)name.text[end] & 0xc0) == 0x80) {
                --end;
            }
            snprintf(name.text + end, sizeof name.text - end, "…'");
        }
    } else if (index == VSHI_MESH_ALONE) {
        snprintf(name.text, sizeof name.text, "mesh");
    } else {
        snprintf(name.text, sizeof name.text, "mesh %zu", index);
    }
    return name;
}

bool vshi_mesh_same_transform(const double *a, const double *b) {
    return a == b || (a != NULL && b != NULL && memcmp(a, b, 12 * sizeof *a) == 0);
}

vsh_result vshi_mesh_check_transform(const vsh_mesh *mesh, size_t index, vsh_error *error) {
    const double *m = mesh->transform;
    if (m == NULL) {
        return VSH_OK;
    }
    for (int i = 0; i < 12; ++i) {
        if (!isfinite(m[i])) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: transform row %d column %d is %g, expected a finite number",
                             vshi_mesh_label(mesh, index).text, i / 4, i % 4, m[i]);
        }
    }
    if (vshi_transform_flattens(m)) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: the transform flattens it (determinant %g)",
                         vshi_mesh_label(mesh, index).text, vshi_transform_determinant(m));
    }
    return VSH_OK;
}

static bool is_loose(const vsh_mesh *mesh) {
    return mesh->indices16 != NULL || mesh->position_stride != 0 || mesh->normal_stride != 0 ||
           mesh->uv_stride != 0;
}

static vsh_result check_arrays(const vsh_mesh *mesh, size_t index, vsh_error *error) {
    if ((mesh->positions == NULL && mesh->vertex_count > 0) ||
        (mesh->indices == NULL && mesh->indices16 == NULL && mesh->triangle_count > 0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %s are NULL", vshi_mesh_label(mesh, index).text,
                         mesh->positions == NULL && mesh->vertex_count > 0 ? "positions" : "indices");
    }
    if (mesh->vertex_count > UINT32_MAX || mesh->triangle_count > SIZE_MAX / 64) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: %zu vertices and %zu triangles, at most %u and %zu can be addressed",
                         vshi_mesh_label(mesh, index).text, mesh->vertex_count, mesh->triangle_count,
                         UINT32_MAX, SIZE_MAX / 64);
    }
    return VSH_OK;
}

vsh_result vshi_mesh_validate(const vsh_mesh *mesh, size_t index, vsh_error *error) {
    VSHI_TRY(check_arrays(mesh, index, error));
    if (is_loose(mesh)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: strides and 16-bit indices are not supported here",
                         vshi_mesh_label(mesh, index).text);
    }
    VSHI_TRY(vshi_mesh_check_transform(mesh, index, error));
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        const vshi_vec local = vshi_vec_off(mesh->positions + 3 * v);
        if (!vshi_finite(local) || !vshi_finite(vshi_mesh_place(mesh, v))) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: vertex %zu of %zu lies at (%g, %g, %g)%s",
                             vshi_mesh_label(mesh, index).text, v, mesh->vertex_count, local.x, local.y,
                             local.z,
                             vshi_finite(local) ? ", which the transform moves beyond the range of numbers"
                                                : ", expected finite numbers");
        }
    }
    for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) {
        if (mesh->indices[i] >= mesh->vertex_count) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: triangle %zu uses vertex %u, but there are only %zu",
                             vshi_mesh_label(mesh, index).text, i / 3, mesh->indices[i], mesh->vertex_count);
        }
    }
    return VSH_OK;
}

/* --- strides and 16-bit indices */

/* An array of vertices: its members in vsh_mesh, and its floats a vertex. */
static const struct {
    const char *name;
    size_t array, stride, floats;
} vertex_arrays[] = {
    {"position_stride", offsetof(vsh_mesh, positions), offsetof(vsh_mesh, position_stride), 3},
    {"normal_stride", offsetof(vsh_mesh, normals), offsetof(vsh_mesh, normal_stride), 3},
    {"uv_stride", offsetof(vsh_mesh, uvs), offsetof(vsh_mesh, uv_stride), 2},
};
enum { VERTEX_ARRAYS = sizeof vertex_arrays / sizeof vertex_arrays[0] };

static size_t *stride_of(vsh_mesh *mesh, int array) {
    return (size_t *)((char *)mesh + vertex_arrays[array].stride);
}

static const float **floats_of(vsh_mesh *mesh, int array) {
    return (const float **)((char *)mesh + vertex_arrays[array].array);
}

/* Checks a loose mesh, a copy of the caller's struct, and adds the elements of 4 bytes that its arrays take.
 */
static vsh_result measure(vsh_mesh *mesh, size_t index, size_t *elements, vsh_error *error) {
    VSHI_TRY(check_arrays(mesh, index, error));
    if (mesh->indices != NULL && mesh->indices16 != NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: both indices and indices16: expected one of them",
                         vshi_mesh_label(mesh, index).text);
    }
    *elements += mesh->indices16 != NULL ? 3 * mesh->triangle_count : 0;
    for (int a = 0; a < VERTEX_ARRAYS; ++a) {
        const size_t stride = *stride_of(mesh, a), size = vertex_arrays[a].floats * sizeof(float);
        if (stride != 0 && (stride < size || stride > VSH_MAX_STRIDE || stride % sizeof(float) != 0)) {
            return vshi_fail(
                error, VSH_ERROR_ARGUMENT, "%s: %s %zu: expected 0, or a multiple of 4 from %zu to %d",
                vshi_mesh_label(mesh, index).text, vertex_arrays[a].name, stride, size, VSH_MAX_STRIDE);
        }
        const bool copied = stride != 0 && *floats_of(mesh, a) != NULL;
        *elements += copied ? vertex_arrays[a].floats * mesh->vertex_count : 0;
    }
    return VSH_OK;
}

/* Copies the loose arrays of a mesh; returns the place behind them. */
static char *copy_arrays(vsh_mesh *mesh, char *to) {
    mesh->checked = NULL;
    if (mesh->indices16 != NULL) {
        uint32_t *indices = (uint32_t *)(void *)to;
        for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) {
            indices[i] = mesh->indices16[i];
        }
        mesh->indices = indices;
        mesh->indices16 = NULL;
        to += 3 * mesh->triangle_count * sizeof *indices;
    }
    for (int a = 0; a < VERTEX_ARRAYS; ++a) {
        const char *from = (const char *)*floats_of(mesh, a);
        const size_t stride = *stride_of(mesh, a), size = vertex_arrays[a].floats * sizeof(float);
        *stride_of(mesh, a) = 0;
        if (stride == 0 || from == NULL) {
            continue;
        }
        *floats_of(mesh, a) = (const float *)(void *)to;
        for (size_t v = 0; v < mesh->vertex_count; ++v, to += size) {
            memcpy(to, from + stride * v, size);
        }
    }
    return to;
}

vsh_result vshi_meshes_tighten(const vsh_mesh *meshes, size_t count, vshi_tight_meshes *tight,
                               vsh_error *error) {
    *tight = (vshi_tight_meshes){.meshes = meshes};
    size_t loose = 0, elements = 0;
    for (size_t m = 0; m < count; ++m) {
        vsh_mesh mesh = meshes[m];
        if (is_loose(&mesh)) {
            VSHI_TRY(measure(&mesh, m, &elements, error));
            ++loose;
        }
    }
    if (loose == 0) {
        return VSH_OK;
    }
    const size_t structs = count * sizeof *meshes;
    VSHI_TRY(vshi_allocate(&tight->memory, 1, structs + elements * sizeof(float), "meshes", error));
    vsh_mesh *copies = tight->memory;
    memcpy(copies, meshes, structs);
    char *to = (char *)tight->memory + structs;
    for (size_t m = 0; m < count; ++m) {
        to = is_loose(&copies[m]) ? copy_arrays(&copies[m], to) : to;
    }
    tight->meshes = copies;
    tight->bytes = structs + elements * sizeof(float);
    return VSH_OK;
}

vshi_vec vshi_mesh_face_normal(const vsh_mesh *mesh, size_t i) {
    const uint32_t *index = mesh->indices + 3 * i;
    const vshi_vec a = vshi_vec_off(mesh->positions + 3 * (size_t)index[0]);
    const vshi_vec b = vshi_vec_off(mesh->positions + 3 * (size_t)index[1]);
    const vshi_vec c = vshi_vec_off(mesh->positions + 3 * (size_t)index[2]);
    return vshi_cross(vshi_sub(b, a), vshi_sub(c, a));
}

bool vshi_mesh_degenerate(const vsh_mesh *mesh, size_t i) {
    const vshi_vec normal = vshi_mesh_face_normal(mesh, i);
    return normal.x == 0.0 && normal.y == 0.0 && normal.z == 0.0;
}

/* Sample `i` of the way around the edge: row 0, then the last column, the last row, the first column. */
static size_t edge_sample(vshi_terrain t, size_t i) {
    const size_t across = t.columns - 1, down = t.rows - 1;
    if (i < across) {
        return i;
    }
    i -= across;
    if (i < down) {
        return i * t.columns + across;
    }
    i -= down;
    if (i < across) {
        return down * t.columns + across - i;
    }
    return (down - (i - across)) * t.columns;
}

void vshi_terrain_triangle(vshi_terrain t, size_t i, uint32_t vertex[3]) {
    const size_t across = t.columns - 1, cells = across * (t.rows - 1), samples = t.columns * t.rows;
    if (i < 2 * cells) {
        const size_t cell = i / 2, first = cell / across * t.columns + cell % across;
        const size_t below = first + t.columns;
        vertex[0] = (uint32_t)first;
        vertex[1] = (uint32_t)(i % 2 == 0 ? below + 1 : below);
        vertex[2] = (uint32_t)(i % 2 == 0 ? first + 1 : below + 1);
        return;
    }
    const size_t edge = vshi_terrain_edge_length(t), at = (i - 2 * cells) / 3, next = (at + 1) % edge;
    const size_t corners[3][3] = {{edge_sample(t, at), edge_sample(t, next), samples + next},
                                  {edge_sample(t, at), samples + next, samples + at},
                                  {samples + edge, samples + at, samples + next}};
    for (size_t k = 0; k < 3; ++k) {
        vertex[k] = (uint32_t)corners[(i - 2 * cells) % 3][k];
    }
}

static bool grows_along_axes(const float *positions, vshi_terrain t) {
    for (size_t i = 0; i < t.columns * t.rows; ++i) {
        const float *p = positions + 3 * i;
        if ((i % t.columns > 0 && !(p[0] > p[-3])) ||
            (i >= t.columns && !(p[2] > p[2 - 3 * (ptrdiff_t)t.columns]))) {
            return false;
        }
    }
    return true;
}

/* The terrain with a mesh's counts of vertices and triangles; 0 rows if there is none. */
static vshi_terrain guess_terrain(const vsh_mesh *mesh) {
    if (mesh->triangle_count < 2 || mesh->indices[1] < 3) { /* the first triangle is 0, columns + 1, 1 */
        return (vshi_terrain){0};
    }
    const size_t columns = (size_t)mesh->indices[1] - 1, vertices = mesh->vertex_count;
    const vshi_terrain guesses[2] = {
        {columns, vertices / columns, false},
        {columns, vertices + 3 > 2 * columns ? (vertices + 3 - 2 * columns) / (columns + 2) : 0, true}};
    for (int i = 0; i < 2; ++i) {
        if (guesses[i].rows >= 2 && vshi_terrain_vertex_count(guesses[i]) == vertices &&
            vshi_terrain_triangle_count(guesses[i]) == mesh->triangle_count) {
            return guesses[i];
        }
    }
    return (vshi_terrain){0};
}

bool vshi_mesh_is_terrain(const vsh_mesh *mesh, vshi_terrain *terrain) {
    *terrain = guess_terrain(mesh);
    if (terrain->rows == 0) {
        return false;
    }
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        uint32_t vertex[3];
        vshi_terrain_triangle(*terrain, i, vertex);
        if (memcmp(vertex, mesh->indices + 3 * i, sizeof vertex) != 0) {
            return false;
        }
    }
    return grows_along_axes(mesh->positions, *terrain);
}

/* --- samples of coarse smooth meshes are lifted towards the surface that their normals describe, after
 * Hanika, "Hacking the Shadow Terminator" (Ray Tracing Gems II, 2021): p' = p + Σ b_i (-min(0, (p -
 * v_i)·n_i)) n_i. Only convex parts are lifted, by about the sagitta of the arc over the triangle. */

/* A triangle is flat if its vertex normals are nearer to the geometric normal than this (0.08°): exporters
 * write normals with a float's noise, and a flat mesh must stay exactly flat. */
static const double FLAT_COSINE = 1.0 - 1e-6;

/* Normals that lean farther than this (53°) come from a shared hard edge, not from a curved surface. They
 * shade, but do not lift. On a cube with averaged normals (54.7°) the lift would be two thirds of its half
 * edge, and tear it off the floor. */
static const double LIFT_COSINE = 0.6;

/* The least cosine between the shading and the geometric normal. */
static const double LEAST_COSINE = 1e-3;

bool vshi_surface_set(const vsh_mesh *mesh, size_t triangle, vshi_surface *surface) {
    uint32_t vertex[3];
    vshi_mesh_triangle_of(mesh, triangle, surface->corner, vertex);
    const vshi_vec *corner = surface->corner;
    surface->geometric = vshi_unit(vshi_triangle_normal(corner));
    surface->mirrored = vshi_transform_determinant(mesh->transform) < 0.0;
    surface->smooth = false;
    for (int k = 0; k < 3; ++k) {
        surface->normal[k] = surface->geometric;
        surface->lifts[k] = false;
        if (mesh->normals == NULL) {
            continue;
        }
        const vshi_vec given = vshi_vec_off(mesh->normals + 3 * (size_t)vertex[k]);
        const vshi_vec normal = vshi_unit(vshi_transform_normal(mesh->transform, vshi_unit(given)));
        const double cosine = vshi_dot(normal, surface->geometric);
        if (!vshi_finite(given) || !(cosine > 0.0)) {
            continue;
        }
        surface->normal[k] = normal;
        surface->lifts[k] = cosine > LIFT_COSINE;
        surface->smooth = surface->smooth || cosine < FLAT_COSINE;
    }
    return vshi_dot(surface->geometric, surface->geometric) > 0.0;
}

void vshi_surface_at(const vshi_surface *surface, const double weight[3], vshi_vec *position,
                     vshi_vec *normal, vshi_vec *lift) {
    const double b[3] = {weight[0], weight[surface->mirrored ? 2 : 1], weight[surface->mirrored ? 1 : 2]};
    const vshi_vec *corner = surface->corner;
    const vshi_vec p = vshi_add(corner[0], vshi_add(vshi_scale(vshi_sub(corner[1], corner[0]), b[1]),
                                                    vshi_scale(vshi_sub(corner[2], corner[0]), b[2])));
    *position = p;
    *normal = surface->geometric;
    *lift = (vshi_vec){0.0, 0.0, 0.0};
    if (!surface->smooth) {
        return;
    }
    vshi_vec sum = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; ++k) {
        const vshi_vec n = surface->normal[k];
        sum = vshi_add(sum, vshi_scale(n, b[k]));
        const double below = vshi_dot(vshi_sub(p, corner[k]), n);
        if (surface->lifts[k] && below < 0.0) {
            *position = vshi_add(*position, vshi_scale(n, -b[k] * below));
        }
    }
    *lift = vshi_sub(*position, p);
    vshi_vec unit = vshi_unit(sum);
    const double cosine = vshi_dot(unit, surface->geometric);
    if (cosine < LEAST_COSINE) {
        unit = vshi_unit(vshi_add(unit, vshi_scale(surface->geometric, LEAST_COSINE - cosine)));
    }
    *normal = unit;
}

vshi_vec vshi_surface_tangent(const vsh_mesh *mesh, size_t triangle, double *handedness) {
    vshi_vec corner[3];
    uint32_t vertex[3];
    vshi_mesh_triangle_of(mesh, triangle, corner, vertex);
    double u[3], v[3];
    for (int k = 0; k < 3; ++k) {
        u[k] = (double)mesh->uvs[2 * (size_t)vertex[k]];
        v[k] = (double)mesh->uvs[2 * (size_t)vertex[k] + 1];
    }
    const vshi_vec a = vshi_sub(corner[1], corner[0]), b = vshi_sub(corner[2], corner[0]);
    const double area = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0]);
    *handedness = area < 0.0 ? -1.0 : 1.0;
    if (area == 0.0) {
        return (vshi_vec){0.0, 0.0, 0.0};
    }
    return vshi_unit(
        vshi_scale(vshi_sub(vshi_scale(a, v[2] - v[0]), vshi_scale(b, v[1] - v[0])), *handedness));
}

/* --- patterns of meshes' names, as a shell matches files. fnmatch(3) depends on the locale, and needs
 * exponential time for some patterns. */

/* The end of the UTF-8 character at `text`. */
static const char *next_character(const char *text) {
    for (++text; ((unsigned char)*text & 0xc0) == 0x80; ++text) {
    }
    return text;
}

/* Matches a byte with the set behind a "[": "[!…]" matches all other bytes, "[a-z]" a range. Returns the end
 * of the set; NULL if no "]" closes it. */
static const char *match_set(const char *pattern, char byte, bool *found) {
    const unsigned char c = (unsigned char)byte;
    const bool others = *pattern == '!' || *pattern == '^';
    bool in = false;
    const char *at = pattern + others;
    for (const char *first = at; *at != ']' || at == first; ++at) {
        if (*at == '\0') {
            return NULL;
        }
        const unsigned char low = (unsigned char)*at;
        if (at[1] == '-' && at[2] != ']' && at[2] != '\0') {
            at += 2;
        }
        in = in || (low <= c && c <= (unsigned char)*at);
    }
    *found = in != others;
    return at + 1;
}

/* Matches one character with a pattern that is no "*", and moves both on. */
static bool match_one(const char **pattern, const char **text) {
    const char *p = *pattern;
    bool found = false;
    const char *end = *p == '[' ? match_set(p + 1, **text, &found) : NULL;
    if (end != NULL) {
        *pattern = end;
        *text += 1;
        return found;
    }
    if (*p == '?') {
        *pattern = p + 1;
        *text = next_character(*text);
        return true;
    }
    p += *p == '\\' && p[1] != '\0';
    *pattern = p + 1;
    return *p == *(*text)++;
}

/* A mismatch only goes back to the last "*": the matches of earlier ones need no change (Krauss, "Matching
 * wildcards", 2008). */
static bool glob(const char *pattern, const char *text) {
    const char *star = NULL, *resume = NULL;
    while (*text != '\0') {
        if (*pattern == '*') {
            star = ++pattern;
            resume = text;
        } else if (*pattern == '\0' || !match_one(&pattern, &text)) {
            if (star == NULL) {
                return false;
            }
            pattern = star;
            text = ++resume;
        }
    }
    while (*pattern == '*') {
        ++pattern;
    }
    return *pattern == '\0';
}

/* A name with brackets must match itself, too. */
static bool matches(const char *name, const char *pattern) {
    return strcmp(name, pattern) == 0 || glob(pattern, name);
}

int32_t vshi_mesh_matches(const vsh_mesh *mesh, const char *pattern) {
    if (mesh == NULL || pattern == NULL) {
        return 0;
    }
    static const char of_material[] = "material:";
    enum { OF_MATERIAL = sizeof of_material - 1 };
    if (strncmp(pattern, of_material, OF_MATERIAL) == 0) {
        return mesh->material_name != NULL && matches(mesh->material_name, pattern + OF_MATERIAL);
    }
    const char *name = mesh->name, *object = mesh->object_name;
    if (name == NULL && object == NULL) {
        return matches("", pattern);
    }
    if ((name != NULL && matches(name, pattern)) || (object != NULL && matches(object, pattern))) {
        return 1;
    }
    const size_t length = object != NULL ? strlen(object) : 0;
    return name != NULL && length > 0 && strncmp(name, object, length) == 0 && name[length] == '/' &&
           matches(name + length + 1, pattern);
}
