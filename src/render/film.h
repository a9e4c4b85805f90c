/* From samples to pixels. */
#ifndef VSHI_FILM_H
#define VSHI_FILM_H

#include "base/job.h"
#include "render/grid.h"

/* What a ray brought back. */
typedef struct vshi_seen {
    float color[3];
    float alpha;
    float depth; /* infinite: nothing */
    float normal[3];
} vshi_seen;

typedef struct vshi_film {
    const vshi_sample_grid *grid;
    const vsh_picture *picture;
    double weight[3 * 16]; /* of the 3 N samples across the filter */
} vshi_film;

/* Empties the picture's planes. */
void vshi_film_begin(vshi_film *film, const vshi_sample_grid *grid, const vsh_picture *picture);

/* Adds rows of samples, [rows × columns], to the pixels that they reach. Every row is added once, in order.
 */
vsh_result vshi_film_add(const vshi_film *film, const vshi_seen *seen, int32_t first_row, int32_t rows,
                         vshi_job *job, vsh_error *error);

/* Makes normals unit. */
void vshi_film_end(const vshi_film *film);

#endif
