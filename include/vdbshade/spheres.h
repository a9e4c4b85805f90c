/* Lists of spheres. Their hard and classic shadows have closed forms. */
#ifndef VDBSHADE_SPHERES_H
#define VDBSHADE_SPHERES_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Spheres under a hierarchy of bounding spheres. Immutable; may be shared by threads. */
typedef struct vsh_spheres vsh_spheres;

/* Copies `count` spheres [count][4]: x, y, z, radius, world units, under a transform ([12], local to world,
 * three rows of four: any of rotation, translation, mirroring and one scale; NULL: none). Free the result
 * with vsh_spheres_free(). Errors:
 * - VSH_ERROR_ARGUMENT: spheres (of a count over 0) or made NULL, a transform that is not finite, shears,
 *   scales unevenly or flattens, run;
 * - VSH_ERROR_INPUT: no spheres; a number that is not finite or over 1e15 in size, a radius that is not over
 *   0, by the sphere's number from 0;
 * - VSH_ERROR_LIMIT: more than 2^30 spheres, run->memory_limit (about 100 bytes a sphere);
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_spheres_create(const double *spheres, size_t count, const double *transform,
                                      const vsh_run *run, vsh_spheres **made, vsh_error *error);
VSH_API void vsh_spheres_free(vsh_spheres *spheres); /* NULL does nothing */

/* What spheres come to. */
typedef struct vsh_spheres_info {
    size_t count;         /* spheres */
    double bounds_min[3]; /* world box */
    double bounds_max[3];
    uint64_t bytes; /* in memory */
} vsh_spheres_info;

/* Cannot fail. */
VSH_API void vsh_spheres_get_info(const vsh_spheres *spheres, vsh_spheres_info *info);

/* Reads spheres from a CSV file: a row each of x, y, z and radius, parted by commas, semicolons, tabs or
 * blanks; numbers with a decimal point, perhaps in quotes. Empty rows and rows that begin with # are passed
 * over, and a first row of names. *spheres is [*count][4]; free it with vsh_spheres_list_free(). Errors:
 * - VSH_ERROR_ARGUMENT: path, spheres or count NULL, run;
 * - VSH_ERROR_READ: no such file, no permission, no regular file;
 * - VSH_ERROR_INPUT: no spheres; by the row's number in the file: not four numbers, one that is not finite or
 *   over 1e15 in size, a radius that is not over 0;
 * - VSH_ERROR_LIMIT: run->memory_limit, a file of more than 16 GiB;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED (under the stage "load"). */
VSH_API vsh_result vsh_spheres_read(const char *path, const vsh_run *run, double **spheres, size_t *count,
                                    vsh_error *error);
VSH_API void vsh_spheres_list_free(double *spheres); /* NULL does nothing */

#ifdef __cplusplus
}
#endif
#endif
