/* Charts of points: texels are points spread evenly over the triangles, so meshes need no UVs. */
#include "base/bytes.h"
#include "base/memory.h"
#include "lightmap/texels.h"

#include <math.h>

enum { CELL_POINTS = VSHI_CELL * VSHI_CELL, TILE_POINTS = VSHI_TILE * VSHI_TILE };

/* Points for all triangles together: so many for each triangle, within these limits. */
static const double EACH = 16.0, LEAST = 65536.0, MOST = 16777216.0;
/* Every triangle has so many, or one if there are too many triangles for MOST. */
enum { TRIANGLE_POINTS = 4 };

/* World area of a triangle; 0 if it is degenerate. */
static double find_area(const vshi_charts *charts, size_t triangle) {
    size_t local;
    vshi_vec corner[3];
    const vsh_mesh *mesh = &charts->meshes[vshi_charts_mesh(charts, triangle, &local)];
    vshi_mesh_triangle(mesh, local, corner);
    return vshi_mesh_degenerate(mesh, local) ? 0.0 : vshi_triangle_area(corner);
}

vsh_result vshi_points_spread(vsh_charts *charts, vsh_error *error) {
    vshi_charts *sorted = &charts->sorted;
    const size_t triangles = sorted->first[sorted->mesh_count];
    double area = 0.0;
    VSHI_TRY(vshi_allocate((void **)&charts->points, triangles + 1, sizeof *charts->points, "points", error));
    for (size_t t = 0; t < triangles; ++t) {
        area += find_area(sorted, t);
    }
    const double all = fmin(fmax(EACH * (double)triangles, LEAST), MOST);
    const double least = (double)triangles * TRIANGLE_POINTS <= all ? TRIANGLE_POINTS : 1.0;
    for (size_t t = 0; t < triangles; ++t) {
        const double own = find_area(sorted, t);
        const double count = own > 0.0 ? fmax(least, floor(all * own / area)) : 0.0;
        charts->points[t + 1] = charts->points[t] + (size_t)count;
    }
    const double tiles = (double)(charts->points[triangles] / TILE_POINTS + 1), columns = ceil(sqrt(tiles));
    charts->info.width = sorted->raster.width = (int32_t)columns * VSHI_TILE;
    charts->info.height = sorted->raster.height = (int32_t)ceil(tiles / columns) * VSHI_TILE;
    return VSH_OK;
}

uint64_t vshi_points_in_tile(const vsh_charts *charts, size_t tile) {
    const size_t count = charts->points[charts->sorted.first[charts->sorted.mesh_count]];
    const size_t first = tile * TILE_POINTS, left = count > first ? count - first : 0;
    return left < TILE_POINTS ? left : TILE_POINTS;
}

double vshi_point_area(const vsh_charts *charts, size_t triangle) {
    const size_t count = charts->points[triangle + 1] - charts->points[triangle];
    return count > 0 ? find_area(&charts->sorted, triangle) / (double)count : 0.0;
}

uint32_t vshi_point_texel(const vsh_charts *charts, size_t point) {
    const size_t tile = point / TILE_POINTS, columns = charts->sorted.columns;
    const size_t cell = point % TILE_POINTS / CELL_POINTS, place = point % CELL_POINTS;
    const size_t x = cell % VSHI_TILE_CELLS * VSHI_CELL + vshi_even_bits(place);
    const size_t y = cell / VSHI_TILE_CELLS * VSHI_CELL + vshi_even_bits(place >> 1);
    return vsh_texel((uint32_t)(tile % columns * VSHI_TILE + x), (uint32_t)(tile / columns * VSHI_TILE + y));
}

void vshi_point_weights(const vsh_charts *charts, size_t triangle, size_t point, double weight[3]) {
    /* Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018; the triangle turns it */
    static const double STEP[2] = {0.7548776662466927, 0.5698402909980532};
    const uint64_t turn = vshi_mix(triangle + 1);
    const double nth = (double)(point - charts->points[triangle]);
    double u = (double)(turn >> 32) * 0x1p-32 + nth * STEP[0];
    double v = (double)(turn & UINT32_MAX) * 0x1p-32 + nth * STEP[1];
    u -= floor(u);
    v -= floor(v);
    if (u + v > 1.0) { /* folds the square onto the triangle */
        u = 1.0 - u;
        v = 1.0 - v;
    }
    weight[0] = fmax(0.0, 1.0 - u - v);
    weight[1] = u;
    weight[2] = v;
}
