#include "field/field.h"

#include "base/memory.h"
#include "base/parallel.h"
#include "trace/trace.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    MOST_QUADS = 6, /* in a cell: all twelve edges on one loop make ten triangles, two a quad */
    CELL_EDGES = 12,
    BRICK_EDGES = 3 * VSHI_BRICK_VALUES,
    GRAIN = 16 /* bricks */
};

/* Places in the brick of a cell's corners; corner x, y, z is bit 4, 2, 1. */
static const uint16_t corner_at[8] = {0, 1, 9, 10, 81, 82, 90, 91};

/* The corners of an edge, the lower first; edges along z, y and x. */
static const uint8_t edge_corners[CELL_EDGES][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3},
                                                    {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};

/* Corners around a face, in the same order on both sides of a cell, and the edges from each to the next. */
static const uint8_t face_corners[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                           {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}};
static const uint8_t face_edges[6][4] = {{0, 5, 1, 4},   {2, 7, 3, 6},  {0, 9, 2, 8},
                                         {1, 11, 3, 10}, {4, 10, 6, 8}, {5, 11, 7, 9}};

/* The surface where the level's trilinear cells equal a height, by bricks. */
typedef struct surface_bricks {
    const vsh_field *field;
    int32_t height; /* half quanta, odd: no value equals it */
    size_t brick_count;
    uint32_t *bricks;  /* [brick_count]: their blocks */
    uint32_t *corners; /* these two: [brick_count + 1]: counts of all bricks before each */
    uint32_t *quads;
    vshi_job *job;
} surface_bricks;

/* The quads of a cell, by its edges. */
typedef struct cell_quads {
    uint8_t count;
    bool ambiguous; /* signs are not enough: a face is crossed twice */
    uint8_t edges[MOST_QUADS][4];
} cell_quads;

/* For each edge: the edges joined with it in its two faces. */
typedef struct joined {
    uint8_t count[CELL_EDGES];
    uint8_t edges[CELL_EDGES][2];
} joined;

static void join(joined *j, uint8_t a, uint8_t b) {
    j->edges[a][j->count[a]++] = b;
    j->edges[b][j->count[b]++] = a;
}

/* Joins the crossed edges of a face. Returns whether the face is crossed twice. */
static bool join_face(joined *j, int face, const int32_t value[8]) {
    const uint8_t *corner = face_corners[face], *edge = face_edges[face];
    uint8_t crossed[4];
    int count = 0;
    for (int k = 0; k < 4; ++k) {
        if ((value[corner[k]] < 0) != (value[corner[(k + 1) & 3]] < 0)) {
            crossed[count++] = edge[k];
        }
    }
    if (count == 2) {
        join(j, crossed[0], crossed[1]);
    }
    if (count == 4) { /* cut off the corners of one sign with the smaller product */
        const bool odd =
            (int64_t)value[corner[0]] * value[corner[2]] > (int64_t)value[corner[1]] * value[corner[3]];
        join(j, edge[odd ? 0 : 3], edge[odd ? 1 : 0]);
        join(j, edge[odd ? 2 : 1], edge[odd ? 3 : 2]);
    }
    return count == 4;
}

/* Follows the loops of joined edges, and cuts each into quads. */
static void find_quads(const int32_t value[8], cell_quads *quads) {
    joined j = {.count = {0}};
    *quads = (cell_quads){.count = 0};
    for (int face = 0; face < 6; ++face) {
        quads->ambiguous |= join_face(&j, face, value);
    }
    for (uint8_t first = 0; first < CELL_EDGES; ++first) {
        uint8_t loop[CELL_EDGES];
        int length = 0;
        uint8_t at = first;
        while (j.count[at] > 0) { /* used edges have 0 */
            j.count[at] = 0;
            loop[length++] = at;
            at = j.edges[at][j.count[j.edges[at][0]] > 0 ? 0 : 1];
        }
        for (int k = 1; k + 1 < length; k += 2) {
            uint8_t *quad = quads->edges[quads->count++];
            quad[0] = loop[0];
            quad[1] = loop[k];
            quad[2] = loop[k + 1];
            quad[3] = loop[k + 2 < length ? k + 2 : k + 1];
        }
    }
}

typedef struct extraction {
    surface_bricks *surface;
    cell_quads cells[256]; /* by the signs of the corners, 1 below the height */
    const double *centre;
    double scale;
    float *corners;
    uint32_t *quads; /* NULL: only count */
} extraction;

static void make_cells(extraction *e) {
    for (int signs = 0; signs < 256; ++signs) {
        int32_t value[8];
        for (int c = 0; c < 8; ++c) {
            value[c] = (signs >> c & 1) != 0 ? -1 : 1;
        }
        find_quads(value, &e->cells[signs]);
    }
}

/* A brick under extraction. */
typedef struct brick {
    const extraction *extraction;
    const int16_t *values;
    float origin[3]; /* of the first value, field space */
    uint32_t corner_count, quad_count;
    uint32_t first_corner;
    float *corners; /* NULL: only count */
    uint32_t *quads;
    uint16_t number[BRICK_EDGES]; /* 1 + number of the corner on the edge; 0: none yet */
} brick;

/* Writes the corner at which the surface crosses the edge between two values. */
static void write_corner(const brick *b, uint32_t corner, int at, int axis, int32_t low, int32_t high) {
    const extraction *e = b->extraction;
    double p[3] = {(double)(at / VSHI_STRIDE_X), (double)(at / VSHI_STRIDE_Y % VSHI_BRICK_EDGE),
                   (double)(at % VSHI_STRIDE_Y)};
    p[axis] += (double)low / (double)(low - high);
    for (int k = 0; k < 3; ++k) {
        b->corners[3 * (size_t)corner + (size_t)k] =
            (float)(((double)b->origin[k] + p[k] - e->centre[k]) * e->scale);
    }
}

static uint32_t corner_of(brick *b, int at, int edge, const int32_t value[8]) {
    const uint8_t *ends = edge_corners[edge];
    const int low = at + corner_at[ends[0]], axis = 2 - edge / 4;
    uint16_t *number = &b->number[3 * low + axis];
    if (*number == 0) {
        *number = (uint16_t)++b->corner_count;
        if (b->corners != NULL) {
            write_corner(b, *number - 1u, low, axis, value[ends[0]], value[ends[1]]);
        }
    }
    return b->first_corner + *number - 1u;
}

/* Adds the cell whose first value is at `at`. */
static void add_cell(brick *b, int at) {
    int32_t value[8];
    unsigned signs = 0;
    for (int c = 0; c < 8; ++c) {
        value[c] = 2 * b->values[at + corner_at[c]] - b->extraction->surface->height;
        signs |= (unsigned)(value[c] < 0) << c;
    }
    const cell_quads *cell = &b->extraction->cells[signs];
    cell_quads by_value;
    if (cell->ambiguous) {
        find_quads(value, &by_value);
        cell = &by_value;
    }
    for (int q = 0; q < cell->count; ++q, ++b->quad_count) {
        for (size_t k = 0; k < 4; ++k) {
            const uint32_t corner = corner_of(b, at, cell->edges[q][k], value);
            if (b->quads != NULL) {
                b->quads[4 * (size_t)b->quad_count + k] = corner;
            }
        }
    }
}

static void extract(void *user, size_t begin, size_t end) {
    const extraction *e = user;
    surface_bricks *s = e->surface;
    const vshi_level *level = &s->field->levels[0];
    brick b = {.extraction = e};
    for (size_t i = begin; i < end; ++i) {
        int32_t corner[3];
        vshi_block_corner(level->origin, level->size, s->bricks[i], corner);
        b.values = s->field->values + s->field->index[level->first_index + s->bricks[i]];
        b.corner_count = b.quad_count = 0;
        memset(b.number, 0, sizeof b.number);
        if (e->quads != NULL) {
            b.first_corner = s->corners[i];
            b.corners = e->corners + 3 * (size_t)s->corners[i];
            b.quads = e->quads + 4 * (size_t)s->quads[i];
            for (int axis = 0; axis < 3; ++axis) {
                b.origin[axis] = (float)corner[axis];
            }
        }
        for (int cell = 0; cell < VSHI_BRICK_CELLS * VSHI_BRICK_CELLS * VSHI_BRICK_CELLS; ++cell) {
            add_cell(&b, VSHI_STRIDE_X * (cell >> 6) + VSHI_STRIDE_Y * (cell >> 3 & 7) + (cell & 7));
        }
        if (e->quads == NULL) {
            s->corners[i + 1] = b.corner_count;
            s->quads[i + 1] = b.quad_count;
        }
    }
}

/* Lists the blocks of the finest level that have their own bricks. `bricks` may be NULL. */
static size_t list_bricks(const vsh_field *field, uint32_t *bricks) {
    const vshi_level *level = &field->levels[0];
    const size_t blocks = vshi_block_index(level->size, level->size[0], 0, 0);
    const int32_t constant = (int32_t)level->first_value + VSHI_BRICK_VALUES;
    size_t count = 0;
    for (size_t block = 0; block < blocks; ++block) {
        if (field->index[level->first_index + block] > constant) {
            if (bricks != NULL) {
                bricks[count] = (uint32_t)block;
            }
            ++count;
        }
    }
    return count;
}

/* Counts corners and quads. Free it with free_surface(), even after an error. `height` is within the level's
 * band. */
static vsh_result find_surface(const vsh_field *field, double height, vshi_field_budget budget, vshi_job *job,
                               surface_bricks *surface, vsh_error *error) {
    *surface = (surface_bricks){.field = field, .brick_count = list_bricks(field, NULL), .job = job};
    surface->height = 2 * (int32_t)floor(height / (double)field->levels[0].quantum) + 1;
    const size_t count = surface->brick_count;
    VSHI_TRY(vshi_check_limit(budget.run, budget.held + 3.0 * sizeof(uint32_t) * (double)(count + 1),
                              "surface", error));
    VSHI_TRY(vshi_allocate((void **)&surface->bricks, count, sizeof(uint32_t), "surface", error));
    VSHI_TRY(vshi_allocate((void **)&surface->corners, count + 1, sizeof(uint32_t), "surface", error));
    VSHI_TRY(vshi_allocate((void **)&surface->quads, count + 1, sizeof(uint32_t), "surface", error));
    list_bricks(field, surface->bricks);
    extraction e = {.surface = surface};
    make_cells(&e);
    VSHI_TRY(vshi_parallel_for(job, count, GRAIN, 0, extract, &e, error));
    for (size_t i = 0; i < count; ++i) {
        if (__builtin_add_overflow(surface->corners[i + 1], surface->corners[i], &surface->corners[i + 1]) ||
            __builtin_add_overflow(surface->quads[i + 1], surface->quads[i], &surface->quads[i + 1])) {
            return vshi_fail(error, VSH_ERROR_LIMIT,
                             "surface: its quads pass the limit of 2^32; use larger voxels");
        }
    }
    return VSH_OK;
}

static void free_surface(surface_bricks *surface) {
    free(surface->quads);
    free(surface->corners);
    free(surface->bricks);
}

/* vshi_quads.write: writes the quads, moved and scaled, field space. */
static vsh_result write_surface(void *user, const double centre[3], double scale, float *corners,
                                uint32_t *quads, vsh_error *error) {
    surface_bricks *surface = user;
    extraction e = {.surface = surface, .centre = centre, .scale = scale, .corners = corners, .quads = quads};
    make_cells(&e);
    return vshi_parallel_for(surface->job, surface->brick_count, GRAIN, 0, extract, &e, error);
}

vsh_result vshi_field_add_surface(vsh_field *field, vshi_field_budget budget, vshi_job *job,
                                  vsh_error *error) {
    surface_bricks surface;
    vsh_result result = find_surface(field, field->grown, budget, job, &surface, error);
    if (result != VSH_OK || surface.quads[surface.brick_count] == 0) { /* all parts are too thin */
        goto done;
    }
    vshi_quads quads = {.corner_count = surface.corners[surface.brick_count],
                        .quad_count = surface.quads[surface.brick_count],
                        .write = write_surface,
                        .user = &surface};
    for (int axis = 0; axis < 3; ++axis) { /* a voxel around the bounds, for any height */
        quads.low[axis] = (double)field->bounds_min[axis] - 1.0;
        quads.high[axis] = (double)field->bounds_max[axis] + 1.0;
    }
    budget.held += 3.0 * sizeof(uint32_t) * (double)(surface.brick_count + 1);
    result = vshi_triangles_of_quads(&quads, budget.run, budget.held, job, &field->surface, error);
done:
    free_surface(&surface);
    return result;
}

/* A mesh under refinement, triangle by triangle. */
typedef struct refinement {
    const vsh_field *field;
    float *positions; /* NULL: only count */
    size_t triangle_count;
} refinement;

static double sample_finest(const vsh_field *field, vshi_vec p) {
    return (double)vshi_level_sample(field, 0, (float[]){(float)p.x, (float)p.y, (float)p.z}, NULL);
}

/* Moves the middle of an edge to the surface; false if it is there already. The result depends on the two
 * ends alone, so the triangles on both sides agree. */
static bool find_middle(const vsh_field *field, vshi_vec a, vshi_vec b, vshi_vec *middle) {
    enum { STEPS = 3 };
    static const double NEAR = 1.0 / 64.0, ASIDE = 0.5; /* voxels */
    *middle = vshi_scale(vshi_add(a, b), 0.5);
    double height = sample_finest(field, *middle);
    if (fabs(height) < NEAR) {
        return false;
    }
    for (int step = 0; step < STEPS; ++step) {
        vshi_vec slope;
        double *const of_axis[3] = {&slope.x, &slope.y, &slope.z};
        for (int axis = 0; axis < 3; ++axis) {
            const vshi_vec by = {axis == 0 ? ASIDE : 0.0, axis == 1 ? ASIDE : 0.0, axis == 2 ? ASIDE : 0.0};
            *of_axis[axis] =
                sample_finest(field, vshi_add(*middle, by)) - sample_finest(field, vshi_sub(*middle, by));
        }
        const double square = vshi_dot(slope, slope),
                     most = fabs(height) < ASIDE ? 1.0 : ASIDE / fabs(height);
        if (!(square > 0.25)) { /* a ridge without a way down */
            return step > 0;
        }
        *middle = vshi_sub(*middle, vshi_scale(slope, most * height / square));
        *middle = (vshi_vec){(double)(float)middle->x, (double)(float)middle->y, (double)(float)middle->z};
        height = sample_finest(field, *middle);
    }
    return true;
}

/* Adds a triangle, turned to face the growing field. */
static void add_triangle(refinement *r, const vshi_vec corner[3]) {
    static const double ASIDE = 0.25; /* voxels */
    float *to = r->positions != NULL ? r->positions + 9 * r->triangle_count : NULL;
    ++r->triangle_count;
    if (to == NULL) {
        return;
    }
    const vshi_vec middle = vshi_scale(vshi_add(corner[0], vshi_add(corner[1], corner[2])), 1.0 / 3.0);
    const vshi_vec aside = vshi_scale(vshi_unit(vshi_triangle_normal(corner)), ASIDE);
    const bool outwards =
        sample_finest(r->field, vshi_add(middle, aside)) > sample_finest(r->field, vshi_sub(middle, aside));
    for (int k = 0; k < 3; ++k) {
        const vshi_vec p = corner[outwards || k == 0 ? k : 3 - k];
        to[3 * k] = (float)p.x;
        to[3 * k + 1] = (float)p.y;
        to[3 * k + 2] = (float)p.z;
    }
}

/* Adds a triangle, cut at the edges whose middles are off the surface. */
static void refine(refinement *r, const vshi_vec corner[3], int depth) { /* NOLINT(misc-no-recursion) */
    enum { DEEPEST = 2 };
    vshi_vec middle[3];
    int cut = 0, first = 0;
    for (int k = 0; k < 3 && depth < DEEPEST; ++k) {
        if (find_middle(r->field, corner[k], corner[(k + 1) % 3], &middle[k])) {
            cut |= 1 << k;
        }
    }
    if (cut == 0) {
        add_triangle(r, corner);
        return;
    }
    if (cut == 7) {
        for (int k = 0; k < 3; ++k) {
            refine(r, (vshi_vec[]){corner[k], middle[k], middle[(k + 2) % 3]}, depth + 1);
        }
        refine(r, middle, depth + 1);
        return;
    }
    while ((cut >> first & 1) == 0) { /* begin with a cut edge whose successor is the other one */
        ++first;
    }
    if ((cut >> (first + 1) % 3 & 1) == 0 && (cut >> (first + 2) % 3 & 1) != 0) {
        first = (first + 2) % 3;
    }
    const int second = (first + 1) % 3, third = (first + 2) % 3;
    const vshi_vec m = middle[first];
    if ((cut >> second & 1) == 0) {
        refine(r, (vshi_vec[]){corner[first], m, corner[third]}, depth + 1);
        refine(r, (vshi_vec[]){m, corner[second], corner[third]}, depth + 1);
        return;
    }
    refine(r, (vshi_vec[]){m, corner[second], middle[second]}, depth + 1);
    refine(r, (vshi_vec[]){m, middle[second], corner[third]}, depth + 1);
    refine(r, (vshi_vec[]){m, corner[third], corner[first]}, depth + 1);
}

static void refine_quads(refinement *r, const float *corners, const uint32_t *quads, size_t count) {
    r->triangle_count = 0;
    for (size_t q = 0; q < count; ++q) {
        vshi_vec p[4];
        for (int k = 0; k < 4; ++k) {
            p[k] = vshi_vec_off(corners + 3 * (size_t)quads[4 * q + (size_t)k]);
        }
        refine(r, p, 0);
        if (quads[4 * q + 2] != quads[4 * q + 3]) {
            refine(r, (vshi_vec[]){p[0], p[2], p[3]}, 0);
        }
    }
}

static void find_transform(const vsh_field *field, double transform[12]) {
    const vshi_vec zero = vshi_to_world(field, (vshi_vec){0.0, 0.0, 0.0});
    for (int column = 0; column < 4; ++column) {
        const vshi_vec axis = {column == 0 ? 1.0 : 0.0, column == 1 ? 1.0 : 0.0, column == 2 ? 1.0 : 0.0};
        const vshi_vec to = column < 3 ? vshi_sub(vshi_to_world(field, axis), zero) : zero;
        transform[column] = to.x;
        transform[4 + column] = to.y;
        transform[8 + column] = to.z;
    }
}

static double bytes_of(const vshi_surface_quads *quads) {
    return 12.0 * (double)quads->corner_count + 16.0 * (double)quads->quad_count;
}

vsh_result vshi_surface_quads_make(const vsh_field *field, double height, const vsh_run *run,
                                   vshi_surface_quads *quads, vsh_error *error) {
    static const double centre[3] = {0.0, 0.0, 0.0};
    *quads = (vshi_surface_quads){.corners = NULL};
    surface_bricks surface = {.bricks = NULL};
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, run, "surface", 2 * list_bricks(field, NULL), "surface", error));
    vsh_result result;
    VSHI_TRY_DONE(find_surface(field, height, (vshi_field_budget){run, 0.0}, job, &surface, error));
    quads->corner_count = surface.corners[surface.brick_count];
    quads->quad_count = surface.quads[surface.brick_count];
    VSHI_TRY_DONE(vshi_check_limit(run, bytes_of(quads), "surface", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&quads->corners, quads->corner_count, 3 * sizeof *quads->corners,
                                "surface", error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&quads->quads, quads->quad_count, 4 * sizeof *quads->quads, "surface", error));
    result = write_surface(&surface, centre, 1.0, quads->corners, quads->quads, error);
done:
    free_surface(&surface);
    vshi_job_end(job);
    return result;
}

void vshi_surface_quads_free(vshi_surface_quads *quads) {
    free(quads->quads);
    free(quads->corners);
    *quads = (vshi_surface_quads){.corners = NULL};
}

static vsh_result make_mesh(const vsh_field *field, const vsh_run *run, const vshi_surface_quads *quads,
                            vshi_surface_mesh *mesh, vsh_error *error) {
    refinement r = {field, NULL, 0};
    refine_quads(&r, quads->corners, quads->quads, quads->quad_count);
    const double bytes = bytes_of(quads) + 48.0 * (double)r.triangle_count;
    VSHI_TRY(vshi_check_limit(run, bytes, "surface", error));
    if (r.triangle_count > UINT32_MAX / 3) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "surface: %zu triangles, at most %u", r.triangle_count,
                         UINT32_MAX / 3);
    }
    mesh->triangle_count = r.triangle_count;
    mesh->vertex_count = 3 * r.triangle_count;
    VSHI_TRY(
        vshi_allocate((void **)&mesh->positions, mesh->vertex_count, 3 * sizeof(float), "surface", error));
    VSHI_TRY(vshi_allocate((void **)&mesh->indices, mesh->vertex_count, sizeof(uint32_t), "surface", error));
    r.positions = mesh->positions;
    refine_quads(&r, quads->corners, quads->quads, quads->quad_count);
    for (size_t i = 0; i < mesh->vertex_count; ++i) {
        mesh->indices[i] = (uint32_t)i;
    }
    find_transform(field, mesh->transform);
    return VSH_OK;
}

vsh_result vshi_surface_mesh_make(const vsh_field *field, const vsh_run *run, vshi_surface_mesh *mesh,
                                  vsh_error *error) {
    *mesh = (vshi_surface_mesh){.positions = NULL};
    vshi_surface_quads quads;
    vsh_result result = vshi_surface_quads_make(field, 0.0, run, &quads, error);
    result = result == VSH_OK ? make_mesh(field, run, &quads, mesh, error) : result;
    vshi_surface_quads_free(&quads);
    return result;
}

void vshi_surface_mesh_free(vshi_surface_mesh *mesh) {
    free(mesh->indices);
    free(mesh->positions);
    *mesh = (vshi_surface_mesh){.positions = NULL};
}

/* Bounds a quad's deviation from its cell. A mixed difference m of the values adds up to m / 4: that of xy at
 * the middle. */
static double bound_bend(const int16_t *v) {
    const int xy = v[90] - v[81] - v[9] + v[0], xz = v[82] - v[81] - v[1] + v[0],
              yz = v[10] - v[9] - v[1] + v[0];
    const int xyz = v[91] - v[90] - v[82] - v[10] + v[81] + v[9] + v[1] - v[0];
    return 0.25 * (abs(xy) + abs(xz) + abs(yz) + abs(xyz));
}

bool vshi_surface_clears(const vsh_field *field, vshi_vec place) {
    const vshi_level *level = &field->levels[0];
    const double at[3] = {place.x, place.y, place.z};
    const float p[3] = {(float)place.x, (float)place.y, (float)place.z};
    int32_t cell[3];
    for (int axis = 0; axis < 3; ++axis) {
        const double x = floor(at[axis]) - level->origin[axis];
        if (!(x >= 0.0 && x < (double)(VSHI_BRICK_CELLS * level->size[axis]))) {
            return true;
        }
        cell[axis] = (int32_t)x;
    }
    const int16_t *v = vshi_level_cell(field, level, cell);
    const double height = (double)vshi_level_sample(field, 0, p, NULL);
    return height - field->grown > bound_bend(v) * (double)level->quantum;
}
