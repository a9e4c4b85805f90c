/* Borders that charts share on a smooth surface, and the texels that a bilinear lookup reads along them. */
#ifndef VSHI_BAKE_SEAMS_H
#define VSHI_BAKE_SEAMS_H

#include "bake/charts.h"

/* The lightmaps that are stitched together; triangles, and texels, are numbered through all of them. */
typedef struct vshi_seam_pages {
    const vshi_charts **charts; /* [count] */
    size_t count;
    size_t *first;   /* [count + 1]: each page's first triangle */
    uint64_t *texel; /* [count + 1]: and its first texel */
} vshi_seam_pages;

/* The page of a triangle. */
static inline size_t vshi_seam_page(const vshi_seam_pages *pages, size_t triangle) {
    size_t low = 0, high = pages->count;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (pages->first[middle] <= triangle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/* An edge where two triangles go on into each other in the world, but not in the lightmap. */
typedef struct vshi_seam {
    double x[2][2], y[2][2]; /* [side][end], texels; an end of both sides is one place in the world */
    uint32_t chart[2];       /* of each side */
    uint32_t page[2];
} vshi_seam;

typedef struct vshi_seams {
    uint32_t *chart; /* [triangles of all pages]: the same number for all of a chart */
    vshi_seam *list; /* [count] */
    size_t count;
    double bytes;
} vshi_seams;

/* Finds charts (triangles that share edges, in the world and in the lightmap) and the seams between them, or
 * of a chart with itself: edges of equal ends in the world at both of which the sides' normals are no further
 * apart than an angle of this cosine. Of edges with more than a few triangles not all pairs are. Errors:
 * VSH_ERROR_LIMIT (run->memory_limit; 2^32 / 3 triangles), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. Free with
 * vshi_seams_free(), after a failure too. */
vsh_result vshi_seams_find(const vshi_seam_pages *pages, double cosine, const vsh_run *run, vshi_job *job,
                           vshi_seams *seams, vsh_error *error);
void vshi_seams_free(vshi_seams *seams);

enum { VSHI_SEAM_READS = 8 }; /* texels: four on each side */

/* A place on a seam: Σ weight × texel is the difference of what bilinear lookups give on both sides. Weights
 * are multiples of 2^-24 and sum up to 0, so that equal texels differ by 0 exactly. The squares of
 * differences count by `share`, what there is of the border for each in half texels, so that a seam of short
 * edges is like one of long ones. */
typedef struct vshi_seam_row {
    uint32_t unknown[VSHI_SEAM_READS];
    float weight[VSHI_SEAM_READS];
    float share;
} vshi_seam_row;

/* The texels that seams read are the unknowns. They are numbered island by island: no row reads of two. */
typedef struct vshi_seam_system {
    size_t unknown_count;
    uint64_t *texel; /* [unknown_count]: of its page, y × width + x */
    uint32_t *page;  /* [unknown_count] */
    uint32_t *chart; /* [unknown_count]: that covers it; VSHI_NO_CHART: none */
    size_t row_count;
    vshi_seam_row *rows; /* [row_count], island by island */
    double shares;       /* of all rows */
    size_t island_count;
    uint32_t *first_unknown; /* these two [island_count + 1] */
    uint32_t *first_row;
    uint64_t crowded; /* places that are not among them, as a third chart would be read there */
    double bytes;
} vshi_seam_system;

#define VSHI_NO_CHART UINT32_MAX

/* Makes the system of all seams, in steps of half a texel. Errors: VSH_ERROR_LIMIT (run->memory_limit; 2^32
 * places), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. Free with vshi_seam_system_free(), after a failure too. */
vsh_result vshi_seam_system_make(const vshi_seam_pages *pages, const vshi_seams *seams, const vsh_run *run,
                                 vshi_job *job, vshi_seam_system *system, vsh_error *error);
void vshi_seam_system_free(vshi_seam_system *system);

/* An island's unknowns in one channel: changes of texels, by which seams differ least. */
typedef struct vshi_seam_problem {
    const vshi_seam_row *rows;
    size_t row_count, unknown_count;
    uint32_t first;         /* number of its first unknown in the rows */
    const double *low;      /* [unknown_count]: ≤ 0, the least change of each */
    const double *high;     /* ≥ 0 */
    const double *keep;     /* > 0: what the square of a change costs */
    const double *gradient; /* at no change */
    double *change;         /* found */
    double *work;           /* [VSHI_SEAM_WORK × unknown_count] */
    vshi_job *job;          /* looked at: it may be cancelled */
} vshi_seam_problem;

enum { VSHI_SEAM_WORK = 2 }; /* vectors */

/* values[unknown] → gradient of ½ Σ share (row · values)². */
void vshi_seam_gradient(const vshi_seam_problem *problem, const double *values, double *gradient);

/* Minimises ½ Σ share (row · (value + change))² + ½ Σ keep change² within low … high. The same bits wherever
 * it runs; returns how many steps it took. */
int vshi_seam_solve(vshi_seam_problem *problem);

#endif
