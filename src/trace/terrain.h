/* Rays against the top of a terrain, without triangles: heights under a pyramid of their maxima (A. Tevs, I.
 * Ihrke, H.-P. Seidel, "Maximum mipmaps for fast, accurate, and scalable dynamic height field rendering",
 * 2008). */
#pragma once

#include "geometry/mesh.h"

enum { VSHI_TERRAIN_LEVELS = 18, VSHI_TERRAIN_LANES = 16 };

/* Level 0 holds the samples, level l the greatest height of each block of 2^l × 2^l cells. */
typedef struct vshi_relief {
    int32_t columns, rows;               /* samples */
    int32_t top;                         /* the level of a single block, at least 1 */
    int32_t across[VSHI_TERRAIN_LEVELS]; /* blocks in a row of a level */
    float *height[VSHI_TERRAIN_LEVELS];  /* local units; one array, which begins at height[0] */
    size_t bytes;
    float lowest, highest;
    double side;         /* the longer one, local units */
    double to_cells[12]; /* from the rays' space: x and z in cells from sample (0, 0), y up */
} vshi_relief;

/* Rays in cells. `t` is the distance along the ground; a unit is one cell along the longer of x and z. */
typedef struct vshi_terrain_rays {
    int32_t column[VSHI_TERRAIN_LANES], row[VSHI_TERRAIN_LANES];                  /* cell of the origin */
    float x[VSHI_TERRAIN_LANES], z[VSHI_TERRAIN_LANES];                           /* the origin in its cell */
    float y[VSHI_TERRAIN_LANES];                                                  /* height of the origin */
    float dx[VSHI_TERRAIN_LANES], dy[VSHI_TERRAIN_LANES], dz[VSHI_TERRAIN_LANES]; /* along a unit of t */
    float to[VSHI_TERRAIN_LANES];  /* largest t; the least is 0; below 0: no ray */
    float hit[VSHI_TERRAIN_LANES]; /* t where the ray first crosses the surface; INFINITY: nowhere */
    double begin[VSHI_TERRAIN_LANES],
        speed[VSHI_TERRAIN_LANES]; /* t is the ray's length by speed, less begin */
} vshi_terrain_rays;

typedef void vshi_terrain_kernel(const vshi_relief *relief, vshi_terrain_rays *rays);
extern vshi_terrain_kernel vshi_terrain_base, vshi_terrain_avx2, vshi_terrain_avx512;

/* Copies the heights of a mesh that is a terrain. The rays' space is the world moved by -centre, then scaled.
 * Errors: VSH_ERROR_MEMORY. Free with vshi_relief_free(), even after a failure. */
vsh_result vshi_relief_create(const vsh_mesh *mesh, vshi_terrain terrain, const double centre[3],
                              double scale, vshi_relief *relief, vsh_error *error);
void vshi_relief_free(vshi_relief *relief);

/* Sets a lane to the part from … to of the ray from `origin` along `direction`. */
void vshi_terrain_aim(const vshi_relief *relief, const float origin[3], const float direction[3], double from,
                      double to, int lane, vshi_terrain_rays *rays);

/* Leaves a lane without a ray. */
void vshi_terrain_leave(vshi_terrain_rays *rays, int lane);

/* Finds `hit` of all lanes. */
void vshi_terrain_trace(const vshi_relief *relief, vshi_terrain_rays *rays);

/* The surface's normal in the rays' space, of any length, where lane `lane` is at t. */
vshi_vec vshi_terrain_normal(const vshi_relief *relief, const vshi_terrain_rays *rays, int lane, float t);
