/* The band of a mesh, voxel by voxel: distances against every triangle, sides against counted crossings. */
#include "grids.h"
#include "mesh/mesh.h"
#include "shapes.h"
#include "testing.h"

#define ERROR_MOST 1e-3 /* voxels */

static double to_segment(vshi_vec p, vshi_vec a, vshi_vec b) {
    const vshi_vec ab = vshi_sub(b, a), ap = vshi_sub(p, a);
    const double length = vshi_dot(ab, ab);
    const double t = length > 0.0 ? fmin(fmax(vshi_dot(ap, ab) / length, 0.0), 1.0) : 0.0;
    return vshi_length(vshi_sub(ap, vshi_scale(ab, t)));
}

/* Solves for the foot of p on the plane; if that is outside the triangle, an edge is the nearest. */
static double to_triangle(vshi_vec p, const vshi_vec corner[3]) {
    const vshi_vec u = vshi_sub(corner[1], corner[0]), v = vshi_sub(corner[2], corner[0]),
                   w = vshi_sub(p, corner[0]), normal = vshi_cross(u, v);
    const double area = vshi_dot(normal, normal), b = vshi_dot(vshi_cross(u, w), normal),
                 c = vshi_dot(vshi_cross(w, v), normal);
    if (area > 0.0 && b >= 0.0 && c >= 0.0 && b + c <= area) {
        return fabs(vshi_dot(w, normal)) / sqrt(area);
    }
    return fmin(to_segment(p, corner[0], corner[1]),
                fmin(to_segment(p, corner[1], corner[2]), to_segment(p, corner[2], corner[0])));
}

static double to_shape(const double p[3], const shape *s) {
    const vsh_mesh mesh = shape_mesh(s, "shape");
    double least = DBL_MAX;
    for (size_t i = 0; i < s->triangles; ++i) {
        vshi_vec corner[3];
        vshi_mesh_triangle(&mesh, i, corner);
        least = fmin(least, to_triangle(vshi_vec_of(p), corner));
    }
    return least;
}

/* Whether a ray from p crosses an odd number of triangles. */
static int is_inside(const double p[3], const shape *s) {
    const vshi_vec direction = {0.331662, 0.712317, 0.618583};
    const vsh_mesh mesh = shape_mesh(s, "shape");
    int odd = 0;
    for (size_t i = 0; i < s->triangles; ++i) {
        vshi_vec corner[3];
        vshi_mesh_triangle(&mesh, i, corner);
        const vshi_vec u = vshi_sub(corner[1], corner[0]), v = vshi_sub(corner[2], corner[0]),
                       w = vshi_sub(vshi_vec_of(p), corner[0]), wu = vshi_cross(w, u),
                       dv = vshi_cross(direction, v);
        const double scale = 1.0 / vshi_dot(u, dv), a = scale * vshi_dot(w, dv),
                     b = scale * vshi_dot(direction, wu);
        odd ^= a >= 0.0 && b >= 0.0 && a + b <= 1.0 && scale * vshi_dot(v, wu) > 0.0;
    }
    return odd;
}

/* A closed surface with bumps and hollows. Folds narrower than a voxel have no voxel within and are taken for
 * closed: there are none. */
static shape *bumpy(int rows, double amplitude) {
    shape *s = shape_new();
    const int columns = 2 * rows;
    for (int row = 0; row <= rows; ++row) {
        for (int column = 0; column < (row == 0 || row == rows ? 1 : columns); ++column) {
            const double polar = 3.14159265358979 * row / rows, around = 3.14159265358979 * column / rows;
            const double x = sin(polar) * cos(around), y = cos(polar), z = sin(polar) * sin(around);
            const double r = 1.0 + amplitude * (sin(7.0 * x + 3.0 * y) + sin(9.0 * y + 2.0 * z) +
                                                sin(11.0 * z + 5.0 * x) + 0.5 * sin(31.0 * x * y + 23.0 * z));
            shape_vertex(s, r * x, r * y, r * z);
        }
    }
    const uint32_t last = (uint32_t)s->vertices - 1;
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const int next = (column + 1) % columns;
            const uint32_t up = (uint32_t)(1 + (row - 1) * columns), down = (uint32_t)(1 + row * columns);
            if (row > 0) {
                shape_triangle(s, up + (uint32_t)column, up + (uint32_t)next,
                               row == rows - 1 ? last : down + (uint32_t)column);
            }
            if (row < rows - 1) {
                shape_triangle(s, row == 0 ? 0 : up + (uint32_t)next, down + (uint32_t)next,
                               down + (uint32_t)column);
            }
        }
    }
    return s;
}

static vsh_grid *grid_of(const shape *s, double voxel, double half_width, int32_t solidity) {
    vsh_mesh mesh = shape_mesh(s, "mesh");
    mesh.solidity = solidity;
    vsh_grid_options options = with_voxel(voxel);
    options.half_width = half_width;
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_meshes(&mesh, 1, &options, NULL, &grid, &failure));
    return grid;
}

/* Some `count` voxels of all leaves, against the triangles. Voxels farther than the half width have it. */
static void compare(const shape *s, const vsh_grid *grid, size_t count) {
    FREED_BY(free_leaves) leaves all = leaves_of(grid);
    const double voxel = all.info.voxel_size;
    const size_t step = all.count * 512 / count | 1;
    double worst = 0.0;
    size_t wrong = 0, near = 0;
    for (size_t i = 0; i < all.count * 512; i += step) {
        double p[3];
        const double value = value_at(&all, i, p) / voxel;
        const double truth = fmin(to_shape(p, s) / voxel, all.info.half_width);
        worst = fmax(worst, fabs(fabs(value) - truth));
        wrong += truth > ERROR_MOST && (value < 0.0) != is_inside(p, s);
        near += truth < all.info.half_width;
    }
    assert_true(near > count / 4);
    assert_less(worst, ERROR_MOST);
    assert_int_equal(wrong, 0);
}

TEST(distances_are_to_the_nearest_triangle_and_sides_by_crossings) {
    const struct {
        int rows;
        double amplitude, voxel, half_width;
    } cases[] = {
        {6, 0.02, 0.02, 3.0},  /* triangles of many voxels */
        {24, 0.05, 0.03, 3.0}, /* of some */
        {70, 0.06, 0.06, 3.0}, /* of less than one */
        {40, 0.08, 0.06, 3.0}, /* with folds */
        {24, 0.05, 0.05, 20.0} /* a wide band */
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        FREED shape *s = bumpy(cases[i].rows, cases[i].amplitude);
        OWNED(vsh_grid) *grid = grid_of(s, cases[i].voxel, cases[i].half_width, VSH_SOLIDITY_SOLID);
        compare(s, grid, 1500);
    }
}

/* A box whose faces are fans of needles around a point near one of their edges. */
static shape *needles(void) {
    enum { ACROSS = 400 };
    shape *s = shape_new();
    for (int face = 0; face < 6; ++face) {
        const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        const uint32_t first = (uint32_t)s->vertices;
        for (int i = 0; i <= 4 * ACROSS; ++i) {
            const int side = i / ACROSS % 4;
            const double t = -1.0 + 2.0 * (i % ACROSS) / ACROSS;
            const double along[4][2] = {{t, -1.0}, {1.0, t}, {-t, 1.0}, {-1.0, -t}};
            double p[3];
            p[axis] = face % 2 == 0 ? -1.0 : 1.0;
            p[u] = i == 4 * ACROSS ? 0.3 : along[side][0];
            p[v] = i == 4 * ACROSS ? -0.9999 : along[side][1];
            shape_vertex(s, p[0], p[1], p[2]);
        }
        for (uint32_t i = 0; i < 4 * ACROSS; ++i) {
            shape_triangle(s, first + i, first + (i + 1) % (4 * ACROSS), first + 4 * ACROSS);
        }
    }
    return s;
}

TEST(needles_are_as_exact_as_others) {
    FREED shape *s = needles();
    const double voxels[] = {0.031, 0.11, 0.007};
    for (size_t i = 0; i < sizeof voxels / sizeof voxels[0]; ++i) {
        OWNED(vsh_grid) *grid = grid_of(s, voxels[i], 3.0, VSH_SOLIDITY_SOLID);
        const double worst = worst_error(grid, unit_cube, 2.99, 2.99);
        assert_less(worst, ERROR_MOST);
    }
}

/* Needles alone in space, as sheets, along the voxels' middles: beyond their ends is nothing. */
TEST(a_lone_needle_ends_where_it_ends) {
    const double heights[] = {1e-1, 1e-3, 1e-5, 1e-6}; /* voxels */
    const double voxel = 1.0 / 128.0;
    for (size_t k = 0; k < sizeof heights / sizeof heights[0]; ++k) {
        FREED shape *s = shape_new();
        const double height = heights[k] * voxel;
        shape_triangle(s, shape_vertex(s, -0.3125, -0.3125, 0.0), shape_vertex(s, 0.3125, 0.3125, 0.0),
                       shape_vertex(s, 0.01 - height, 0.01 + height, 0.0));
        OWNED(vsh_grid) *grid = grid_of(s, voxel, 3.0, VSH_SOLIDITY_SHELL);
        FREED_BY(free_leaves) leaves all = leaves_of(grid);
        const double background = all.info.half_width * voxel, half = 0.5 * all.info.shell_thickness;
        double worst = 0.0;
        for (size_t i = 0; i < all.count * 512; ++i) {
            double p[3];
            const double value = value_at(&all, i, p);
            const double truth = fmin(fmax(to_shape(p, s) - half, -background), background);
            worst = fmax(worst, fabs(value - truth) / voxel);
        }
        assert_less(worst, ERROR_MOST);
    }
}

typedef struct bounds {
    double low[3], high[3];
} bounds;

static int is_in_box(const double p[3], const bounds *b, double by) {
    int in = 1;
    for (int i = 0; i < 3; ++i) {
        in &= p[i] > b->low[i] + by && p[i] < b->high[i] - by;
    }
    return in;
}

/* The distance to what of a box's faces is not in the other, by points `step` apart. */
static double to_faces(const double p[3], const bounds *b, const bounds *other, double step) {
    double least = DBL_MAX;
    for (int face = 0; face < 6; ++face) {
        const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        double q[3];
        q[axis] = face % 2 == 0 ? b->low[axis] : b->high[axis];
        for (q[u] = b->low[u]; q[u] <= b->high[u] + 1e-9; q[u] += step) {
            for (q[v] = b->low[v]; q[v] <= b->high[v] + 1e-9; q[v] += step) {
                const double length = vshi_length(vshi_sub(vshi_vec_of(p), vshi_vec_of(q)));
                least = length < least && !is_in_box(q, other, -1e-9) ? length : least;
            }
        }
    }
    return least;
}

/* Depth in a union is to its own surface, wherever its parts have theirs; within two voxels of where those
 * cross, it may be less. */
TEST(depth_is_to_the_surface_of_the_union) {
    const bounds boxes[2] = {{{-1.03, -0.5, -0.5}, {1.01, 0.52, 0.5}},
                             {{-0.4, -0.31, -0.33}, {0.42, 1.23, 0.3}}};
    const double voxel = 0.05, step = 0.01;
    FREED shape *s = shape_new();
    shape_box(s, boxes[0].low, boxes[0].high, ALL_SIDES);
    shape_box(s, boxes[1].low, boxes[1].high, ALL_SIDES);
    OWNED(vsh_grid) *grid = grid_of(s, voxel, 6.0, VSH_SOLIDITY_SOLID);
    FREED_BY(free_leaves) leaves all = leaves_of(grid);
    double deeper = 0.0, shallower = 0.0;
    size_t compared = 0;
    for (size_t i = 0; i < all.count * 512; i += 7) {
        double p[3];
        const double depth = -value_at(&all, i, p) / voxel;
        if (!is_in_box(p, &boxes[0], voxel) && !is_in_box(p, &boxes[1], voxel)) {
            continue;
        }
        const double truth = fmin(
            fmin(to_faces(p, &boxes[0], &boxes[1], step), to_faces(p, &boxes[1], &boxes[0], step)) / voxel,
            all.info.half_width);
        deeper = fmax(deeper, depth - truth);
        shallower = fmax(shallower, truth - depth);
        ++compared;
    }
    assert_true(compared > 500);
    assert_less(deeper, 0.05);
    assert_less(shallower, 2.0);
}
