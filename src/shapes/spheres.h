/* Casters of spheres: distances, and shadows in closed form by the methods hard and classic. */
#pragma once

#include <stdbool.h>
#include <vdbshade/light.h>

/* Spheres under a hierarchy of bounding spheres. Immutable; may be shared by threads. */
typedef struct vshi_spheres vshi_spheres;

/* Copies spheres [count][4]: x, y, z, radius. Free the result with vshi_spheres_free(). `transform` ([12],
 * local to world, three rows of four) may rotate, translate, mirror and scale evenly; NULL: identity. Errors:
 * - VSH_ERROR_ARGUMENT: any other transform;
 * - VSH_ERROR_INPUT: no spheres. A number that is not finite or beyond ±1e15, or a radius that is not above
 *   0: the message gives the sphere's number from 0;
 * - VSH_ERROR_LIMIT: more than 2^30 spheres. run->memory_limit, with about 100 bytes a sphere;
 * - VSH_ERROR_MEMORY. */
vsh_result vshi_spheres_create(const double *spheres, size_t count, const double *transform,
                               const vsh_run *run, vshi_spheres **made, vsh_error *error);
void vshi_spheres_free(vshi_spheres *spheres); /* NULL does nothing */

typedef struct vshi_spheres_info {
    size_t count;         /* spheres */
    double bounds_min[3]; /* world box */
    double bounds_max[3];
    uint64_t bytes; /* in memory */
} vshi_spheres_info;

void vshi_spheres_get_info(const vshi_spheres *spheres, vshi_spheres_info *info);

/* Reads spheres from a CSV file. A row holds x, y, z and radius between commas, semicolons, tabs or blanks.
 * Numbers have a decimal point and may be in quotes. Empty rows, rows that begin with #, and a first row of
 * names do not count. *spheres is [*count][4]; free it with free(). Errors:
 * - VSH_ERROR_READ: no such file, no permission, no regular file;
 * - VSH_ERROR_INPUT: no spheres, or a bad row: the message gives its number in the file;
 * - VSH_ERROR_LIMIT: run->memory_limit, a file of more than 16 GiB;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_spheres_read(const char *path, const vsh_run *run, double **spheres, size_t *count,
                             vsh_error *error);

typedef struct vshi_ball_block vshi_ball_block;

struct vshi_spheres {
    double (*sphere)[4];    /* [info.count], world */
    vshi_ball_block *block; /* the tree; [0] is the uppermost */
    size_t block_count, block_capacity;
    double middle[3];
    vshi_spheres_info info;
};

/* Signed distance to the nearest sphere, world units, negative within one; exact outside of all. */
double vshi_spheres_distance(const vshi_spheres *spheres, const double position[3]);

/* Writes the visible share of a light (checked before) at points begin ... end - 1 to visibility[end -
 * begin]. VSH_SHADOW_HARD: 0 or 1, by the ray to the light's centre. VSH_SHADOW_CLASSIC: the nearest miss (I.
 * Quilez, "sphere soft shadow", 2014). Points turned away get 1, points within a sphere 0, invalid ones NaN.
 * Thread safe. */
void vshi_spheres_shadow(const vshi_spheres *spheres, const vsh_light *light, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, float *visibility,
                         vsh_shade_stats *stats);

/* Whether a world position is within a sphere, deeper than receivers may be off. */
bool vshi_spheres_hold(const vshi_spheres *spheres, const double position[3]);
