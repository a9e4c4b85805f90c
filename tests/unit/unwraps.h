/* Looks at an atlas by code of its own: which texels triangles touch, which centres they have, how they
 * stretch. */
#pragma once

#include "shapes.h"
#include "testing.h"

/* Texels: UVs are 32-bit, and a border that is rounded over a texel's edge by so much does not touch it. */
static const double ROUNDING = 1e-3;

typedef struct corner_uvs {
    double at[3][2]; /* texels */
} corner_uvs;

static inline corner_uvs uvs_of(const vsh_atlas_mesh *m, const vsh_atlas_info *info, size_t triangle) {
    corner_uvs c;
    for (size_t k = 0; k < 3; ++k) {
        const uint32_t v = m->indices[3 * triangle + k];
        assert_true(v < m->vertex_count);
        c.at[k][0] = (double)m->uvs[2 * v] * info->width;
        c.at[k][1] = (double)m->uvs[2 * v + 1] * info->height;
    }
    return c;
}

static inline double doubled_area(const corner_uvs *c) {
    return (c->at[1][0] - c->at[0][0]) * (c->at[2][1] - c->at[0][1]) -
           (c->at[1][1] - c->at[0][1]) * (c->at[2][0] - c->at[0][0]);
}

/* Whether the triangle and the texel's square, shrunk by the rounding, have a point in common: by separating
 * axes. */
static inline int touches(const corner_uvs *c, int x, int y) {
    const double low[2] = {x + ROUNDING, y + ROUNDING}, high[2] = {x + 1 - ROUNDING, y + 1 - ROUNDING};
    for (int d = 0; d < 2; ++d) {
        const double least = fmin(c->at[0][d], fmin(c->at[1][d], c->at[2][d])),
                     most = fmax(c->at[0][d], fmax(c->at[1][d], c->at[2][d]));
        if (most < low[d] || least > high[d]) {
            return 0;
        }
    }
    for (int k = 0; k < 3; ++k) {
        const double *a = c->at[k], *b = c->at[(k + 1) % 3];
        const double nx = a[1] - b[1], ny = b[0] - a[0]; /* to the left: inwards */
        const double far = fmax(nx * (low[0] - a[0]), nx * (high[0] - a[0])) +
                           fmax(ny * (low[1] - a[1]), ny * (high[1] - a[1]));
        if (far < 0.0) {
            return 0;
        }
    }
    return 1;
}

/* Whether the triangle has the texel's centre. Of the triangles around an edge or a corner, exactly one has
 * it. */
static inline int has_centre(const corner_uvs *c, int x, int y) {
    const double px = x + 0.5, py = y + 0.5;
    for (int k = 0; k < 3; ++k) {
        const double *a = c->at[k], *b = c->at[(k + 1) % 3];
        /* from the same end for both triangles beside the edge */
        const int swap = a[0] > b[0] || (a[0] == b[0] && a[1] > b[1]);
        const double *p = swap ? b : a, *q = swap ? a : b;
        double side = (q[0] - p[0]) * (py - p[1]) - (q[1] - p[1]) * (px - p[0]);
        side = swap ? -side : side;
        const int owns = a[1] > b[1] || (a[1] == b[1] && a[0] < b[0]);
        if (side < 0.0 || (side == 0.0 && !owns)) {
            return 0;
        }
    }
    return 1;
}

typedef struct texel_box {
    int x0, y0, x1, y1;
} texel_box;

static inline texel_box box_of(const corner_uvs *c, const vsh_atlas_info *info) {
    texel_box b = {info->width, info->height, 0, 0};
    for (int k = 0; k < 3; ++k) {
        b.x0 = (int)fmin(b.x0, floor(c->at[k][0]));
        b.y0 = (int)fmin(b.y0, floor(c->at[k][1]));
        b.x1 = (int)fmax(b.x1, ceil(c->at[k][0]));
        b.y1 = (int)fmax(b.y1, ceil(c->at[k][1]));
    }
    return b;
}

/* World corner k of a triangle. */
static inline void place_of(const vsh_mesh *mesh, uint32_t v, double at[3]) {
    const float *p = mesh->positions + 3 * (size_t)v;
    for (int r = 0; r < 3; ++r) {
        static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
        const double *m = (mesh->transform != NULL ? mesh->transform : identity) + 4 * r;
        at[r] = m[0] * (double)p[0] + m[1] * (double)p[1] + m[2] * (double)p[2] + m[3];
    }
}

/* Normal of a triangle, as long as twice its area. */
static inline void normal_of(double p[3][3], double n[3]) {
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        n[i] = (p[1][j] - p[0][j]) * (p[2][k] - p[0][k]) - (p[1][k] - p[0][k]) * (p[2][j] - p[0][j]);
    }
}

/* Twice a triangle's area in the world, and the larger and the smaller singular value of the map from its
 * UVs. */
static inline double stretch_of(const vsh_mesh *mesh, const corner_uvs *c, const uint32_t *corner,
                                double *larger, double *smaller) {
    double p[3][3], s[3], t[3], a = 0, b = 0, d = 0, n[3];
    for (int k = 0; k < 3; ++k) {
        place_of(mesh, corner[k], p[k]);
    }
    const double area = doubled_area(c);
    for (int i = 0; i < 3; ++i) {
        s[i] = (p[0][i] * (c->at[1][1] - c->at[2][1]) + p[1][i] * (c->at[2][1] - c->at[0][1]) +
                p[2][i] * (c->at[0][1] - c->at[1][1])) /
               area;
        t[i] = (p[0][i] * (c->at[2][0] - c->at[1][0]) + p[1][i] * (c->at[0][0] - c->at[2][0]) +
                p[2][i] * (c->at[1][0] - c->at[0][0])) /
               area;
        a += s[i] * s[i];
        b += s[i] * t[i];
        d += t[i] * t[i];
    }
    const double root = sqrt((a - d) * (a - d) + 4 * b * b);
    *larger = sqrt(0.5 * (a + d + root));
    *smaller = sqrt(fmax(0.0, 0.5 * (a + d - root)));
    normal_of(p, n);
    return length3(n);
}

static inline int is_flat(const vsh_mesh *mesh, size_t triangle) {
    vsh_mesh own = *mesh;
    double p[3][3], n[3];
    own.transform = NULL;
    for (size_t k = 0; k < 3; ++k) {
        place_of(&own, mesh->indices[3 * triangle + k], p[k]);
    }
    normal_of(p, n);
    return n[0] == 0 && n[1] == 0 && n[2] == 0;
}

/* The information about an atlas, with the size of one of its pages. */
static inline vsh_atlas_info info_of_page(const vsh_atlas *atlas, const vsh_atlas_info *info,
                                          uint32_t number) {
    const vsh_atlas_page page = vsh_atlas_page_view(atlas, number);
    vsh_atlas_info of = *info;
    assert_in_range(page.width, 1, info->width);
    assert_in_range(page.height, 1, info->height);
    of.width = page.width;
    of.height = page.height;
    return of;
}

/* Sums over a chart. */
typedef struct chart_sums {
    double squares, world, flat;
} chart_sums;

static inline void look_at_mesh(const vsh_mesh *mesh, size_t index, const vsh_atlas *atlas,
                                const vsh_atlas_info *info, uint32_t *claims, uint8_t *centres,
                                chart_sums *sums) {
    const vsh_atlas_mesh m = vsh_atlas_mesh_view(atlas, index);
    FREED uint32_t *chart_of = calloc(m.vertex_count + 1, sizeof *chart_of);
    assert_int_equal(m.triangle_count, mesh->triangle_count);
    for (size_t i = 0; i < m.triangle_count; ++i) {
        for (size_t k = 0; k < 3; ++k) {
            assert_int_equal(m.sources[m.indices[3 * i + k]], mesh->indices[3 * i + k]);
        }
        assert_int_equal(m.charts[i] == VSH_NO_CHART, is_flat(mesh, i));
        if (m.charts[i] == VSH_NO_CHART) {
            continue;
        }
        const uint32_t chart = m.charts[i];
        assert_true(chart < info->charts);
        const vsh_atlas_chart view = vsh_atlas_charts(atlas)[chart];
        assert_int_equal(view.mesh, index);
        assert_true(view.page < info->pages);
        const vsh_atlas_info page = info_of_page(atlas, info, view.page);
        const corner_uvs c = uvs_of(&m, &page, i);
        for (size_t k = 0; k < 3; ++k) {
            uint32_t *seen = &chart_of[m.indices[3 * i + k]];
            assert_true(*seen == 0 || *seen == chart + 1);
            *seen = chart + 1;
            assert_true(c.at[k][0] >= 0 && c.at[k][0] <= page.width && c.at[k][1] >= 0 &&
                        c.at[k][1] <= page.height);
        }
        assert_that(doubled_area(&c) > 0.0, "mesh %zu: triangle %zu is flipped, or has no area: %g texels",
                    index, i, doubled_area(&c));
        double larger, smaller;
        const double world = stretch_of(mesh, &c, mesh->indices + 3 * i, &larger, &smaller);
        sums[chart].squares += 0.5 * (larger * larger + smaller * smaller) * world;
        sums[chart].world += world;
        sums[chart].flat += doubled_area(&c);
        const texel_box box = box_of(&c, &page);
        for (int y = box.y0; y < box.y1; ++y) {
            for (int x = box.x0; x < box.x1; ++x) {
                const size_t texel =
                    ((size_t)view.page * (size_t)info->height + (size_t)y) * (size_t)info->width + (size_t)x;
                if (touches(&c, x, y)) {
                    assert_that(claims[texel] == 0 || claims[texel] == chart + 1,
                                "texel %d, %d of page %u: claimed by charts %u and %u", x, y, view.page,
                                claims[texel] - 1, chart);
                    claims[texel] = chart + 1;
                    assert_true(x >= view.min[0] && x < view.max[0] && y >= view.min[1] && y < view.max[1]);
                }
                assert_that(!has_centre(&c, x, y) || ++centres[texel] == 1,
                            "texel %d, %d of page %u: two triangles of chart %u lie there", x, y, view.page,
                            chart);
            }
        }
    }
}

static inline void look_at_padding(const vsh_atlas_info *info, int padding, const uint32_t *claims) {
    const int w = info->width, h = info->height;
    for (uint32_t page = 0; page < info->pages; ++page) {
        const uint32_t *at = claims + (size_t)page * (size_t)w * (size_t)h;
        for (int y = 0; y < h; ++y) {
            for (int x = 0; x < w; ++x) {
                const uint32_t own = at[(size_t)y * (size_t)w + (size_t)x];
                for (int dy = 0; own != 0 && dy <= padding && y + dy < h; ++dy) {
                    for (int dx = -padding; dx <= padding; ++dx) {
                        if (x + dx < 0 || x + dx >= w) {
                            continue;
                        }
                        const uint32_t other = at[(size_t)(y + dy) * (size_t)w + (size_t)(x + dx)];
                        assert_that(other == 0 || other == own,
                                    "page %u: charts %u and %u are nearer than %d texels at %d, %d", page,
                                    own - 1, other - 1, padding, x, y);
                    }
                }
            }
        }
    }
}

/* Checks everything that an atlas promises. */
static inline void look_at_atlas(const vsh_mesh *meshes, size_t count, const vsh_unwrap_options *o,
                                 const vsh_atlas *atlas) {
    const vsh_atlas_info info = atlas_info(atlas);
    assert_int_equal(info.meshes, count);
    assert_true(o->fit_pages ? info.width <= o->width && info.height <= o->height
                             : info.width == o->width && info.height == o->height);
    assert_true(info.pages <= (o->atlas == VSH_ATLAS_OBJECTS ? count : (size_t)o->max_pages));
    double of_pages = 0;
    for (uint32_t page = 0; page < info.pages; ++page) {
        const vsh_atlas_page view = vsh_atlas_page_view(atlas, page);
        of_pages += (double)view.width * view.height;
        assert_true(view.covered > 0 && view.covered <= 1 && view.texels_per_unit >= info.texels_per_unit);
    }
    const size_t texels = (size_t)info.width * (size_t)info.height * info.pages;
    FREED uint32_t *claims = calloc(texels, sizeof *claims);
    FREED uint8_t *centres = calloc(texels, 1);
    FREED chart_sums *sums = calloc(info.charts, sizeof *sums);
    for (size_t m = 0; m < count; ++m) {
        look_at_mesh(&meshes[m], m, atlas, &info, claims, centres, sums);
    }
    look_at_padding(&info, o->padding, claims);
    double area = 0, stretch = 0, worst = 0;
    size_t claimed = 0;
    for (size_t i = 0; i < texels; ++i) {
        claimed += claims[i] != 0;
    }
    for (uint32_t c = 0; c < info.charts; ++c) {
        const vsh_atlas_chart view = vsh_atlas_charts(atlas)[c];
        const double own = sqrt(sums[c].squares * sums[c].flat) / sums[c].world;
        if (sums[c].flat > 0.1) { /* texels: below, 32-bit UVs tell no more of the shape */
            assert_that(fabs(own - (double)view.stretch) <= 5e-3 * own &&
                            (o->keep_uvs != VSH_UNWRAP_ALWAYS || own <= o->max_stretch + 1e-3),
                        "chart %u: stretch %g, said to be %g, at most %g", c, own, (double)view.stretch,
                        o->max_stretch);
        }
        area += sums[c].world;
        stretch += sums[c].world * (double)view.stretch;
        worst = fmax(worst, (double)view.stretch);
    }
    assert_true(fabs(info.stretch - stretch / area) < 1e-3 && fabs(info.worst_stretch - worst) < 1e-6);
    /* a triangle that only just touches a texel may count or not */
    assert_that(fabs((double)claimed / of_pages - info.covered) <= 0.01,
                "%g of the texels are covered, said to be %g", (double)claimed / of_pages, info.covered);
}

static inline vsh_unwrap_options unwrap_into(int32_t size) {
    vsh_unwrap_options o = vsh_unwrap_options_default();
    o.width = o.height = size;
    return o;
}

/* Unwraps the meshes and checks the atlas. Returns its info. */
static inline vsh_atlas_info unwrap_well(const vsh_mesh *meshes, size_t count, const vsh_unwrap_options *o,
                                         vsh_atlas **kept) {
    vsh_atlas *atlas = NULL;
    assert_ok(vsh_unwrap(meshes, count, o, NULL, &atlas, &failure));
    look_at_atlas(meshes, count, o, atlas);
    const vsh_atlas_info info = atlas_info(atlas);
    if (kept != NULL) {
        *kept = atlas;
    } else {
        vsh_atlas_free(atlas);
    }
    return info;
}

/* --- more shapes */

/* A grid of quads over (u, v), wrapped where asked; twisted: u = 1 meets u = 0 with v the other way. */
typedef void grid_fn(double u, double v, double p[3]);

static inline void shape_grid(shape *s, grid_fn *fn, uint32_t nu, uint32_t nv, int wrap_u, int wrap_v,
                              int twisted) {
    const uint32_t first = (uint32_t)s->vertices, mu = wrap_u ? nu : nu + 1, mv = wrap_v ? nv : nv + 1;
    for (uint32_t i = 0; i < mu; ++i) {
        for (uint32_t j = 0; j < mv; ++j) {
            double p[3];
            fn((double)i / nu, (double)j / nv, p);
            shape_vertex(s, p[0], p[1], p[2]);
        }
    }
    for (uint32_t i = 0; i < nu; ++i) {
        for (uint32_t j = 0; j < nv; ++j) {
            const uint32_t i1 = i + 1 == mu ? 0 : i + 1, j1 = j + 1 == mv ? 0 : j + 1;
            const int turn = twisted && i + 1 == mu;
            const uint32_t a = first + i * mv + j, b = first + i1 * mv + (turn ? mv - 1 - j : j),
                           c = first + i1 * mv + (turn ? mv - 1 - j1 : j1), d = first + i * mv + j1;
            shape_quad(s, a, b, c, d);
        }
    }
}

static inline void torus_at(double u, double v, double p[3]) {
    const double a = 6.283185307179586 * u, b = 6.283185307179586 * v;
    p[0] = (2 + cos(b)) * cos(a);
    p[1] = (2 + cos(b)) * sin(a);
    p[2] = sin(b);
}

static inline void moebius_at(double u, double v, double p[3]) {
    const double a = 6.283185307179586 * u, w = 0.8 * (v - 0.5);
    p[0] = (2 + w * cos(a / 2)) * cos(a);
    p[1] = (2 + w * cos(a / 2)) * sin(a);
    p[2] = w * sin(a / 2);
}

/* Numbers of [0, 1) that are the same everywhere. */
static inline double next_number(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}
